// See board_device.hpp.
#include "testbench/driver/board_device.hpp"

#include <algorithm>
#include <cstddef>
#include <random>

#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"
#include "rtl/shell/rt_regs.h"
#include "testbench/driver/dram_init.hpp"

namespace retrace::cosim {
namespace {

constexpr std::size_t kLeastFrame = 56;      // one ray, header, check sequence
constexpr std::size_t kAtOnce = 256;         // bytes of register writes that stay together with a start
constexpr std::uint32_t kBlock = 128;        // bytes of registers read at once
constexpr std::uint64_t kOffChip = 1 << 20;  // bytes; a larger memory is tried out before it is used
constexpr std::uint32_t kControl = offsetof(rt_regs_t, control);

const char* meaning(link::Status status) {
  constexpr const char* kMeaning[link::kStatuses] = {"done",
                                                     "damaged",
                                                     "another version of the protocol",
                                                     "another session: the board was reset, or another program uses it",
                                                     "malformed",
                                                     "the answer would be too long",
                                                     "the bus answered with an error",
                                                     "there is no such register",
                                                     "frames before it are missing"};
  const auto index = static_cast<std::size_t>(status);
  return index < std::size(kMeaning) ? kMeaning[index] : "unknown status";
}

}  // namespace

BoardDevice::BoardDevice(const LinkOptions& options) : options_(options) {
  if (options_.seed == 0) options_.seed = std::random_device{}();
  std::mt19937_64 random(options_.seed);
  session_ = static_cast<std::uint16_t>(random());
  sequence_ = static_cast<std::uint16_t>(random());
}

void BoardDevice::begin() {
  // What is asked first is short, so that it gets through a bad line.
  link::Request request;
  request.open();
  request.reg_read(board_offset(link::kBoardIdentity), 1);
  Answer answer;
  exchange(request, 4, false, answer);
  if (answer.status != link::Status::kOk || answer.data.size() != 4 || link::get(answer.data, 0, 4) != link::kBoardId)
    fail("what answers is no Retrace board");
  const std::vector<std::uint32_t> words = read_words(board_offset(link::kBoardIdentity), link::kBoardRegisters);
  const auto word = [&](link::BoardRegister index) { return std::uint64_t{words[index]}; };
  const auto image_version = static_cast<std::uint32_t>(word(link::kBoardVersion) >> 8 & 0xff);
  if (image_version != static_cast<std::uint32_t>(contract::kImageVersion))
    fail("the board reads memory images of version " + std::to_string(image_version) +
         ", this program writes version " + std::to_string(contract::kImageVersion));
  identity_.most_frame = word(link::kBoardVersion) >> 16;
  identity_.memory_base = word(link::kBoardMemoryLow) | word(link::kBoardMemoryHigh) << 32;
  identity_.memory_bytes = word(link::kBoardMemoryBytes);
  identity_.clock_hz = static_cast<std::uint32_t>(word(link::kBoardClockHz));
  clocks_low_ = static_cast<std::uint32_t>(word(link::kBoardClocks));
  runs_ = static_cast<std::uint32_t>(word(link::kBoardRuns));
  if (identity_.most_frame < kLeastFrame || identity_.memory_base % kAlignment != 0)
    fail("the board's description makes no sense");
  prepare_memory(static_cast<std::uint32_t>(word(link::kBoardMemoryState)));
  if (identity_.memory_bytes >= kOffChip) check_memory();
}

std::size_t BoardDevice::most_load() const {
  return std::min<std::size_t>(identity_.most_frame - link::kRequestHeader - link::Request::kMemoryHeader,
                               8 * kMostWords);
}

void BoardDevice::fail(const std::string& what) const { throw Error(link_name() + ": " + what); }
void BoardDevice::refused(const Answer& answer) const {
  fail(std::string("the board refuses an operation: ") + meaning(answer.status) + " (at byte " +
       std::to_string(answer.position) + ")");
}

void BoardDevice::prepare_memory(std::uint32_t state) {
  class Control final : public DramControl {
   public:
    explicit Control(BoardDevice& board) : board_(board) {}
    void write(std::uint32_t address, std::uint32_t value) override {
      board_.write_register(link::kMemoryControl + address, value);
    }
    std::uint32_t read(std::uint32_t address) override { return board_.read_register(link::kMemoryControl + address); }
    void wait(std::uint32_t clocks) override {
      board_.flush();
      board_.pass(clocks / std::max<double>(board_.identity_.clock_hz, 1));
    }

   private:
    BoardDevice& board_;
  };
  constexpr std::uint32_t kState = 0xff, kControllerShift = 8;
  if (const std::uint32_t controller = state >> kControllerShift & kState;
      (state & kState) == link::kMemoryNotInitialised && controller != 0) {
    if (controller > dram_facts().size())
      fail("the board's memory has a controller of kind " + std::to_string(controller) + ", this program knows " +
           std::to_string(dram_facts().size()));
    Control control(*this);
    try {
      initialise_dram(dram_facts()[controller - 1], control);
      flush();
    } catch (const Error& error) {
      flush();
      fail(error.what());
    }
    state = read_board(link::kBoardMemoryState);
  }
  if ((state & kState) == link::kMemoryNotInitialised) fail("the board's memory has not been initialised");
  if ((state & kState) != link::kMemoryReady) fail("the board's memory does not answer: its initialisation has failed");
}

void BoardDevice::check_memory() {
  // A word of its own at the beginning, at each power of two and at the end. What was there is put back, for a write that is resumed.
  std::vector<std::uint64_t> places{0, identity_.memory_bytes - 8}, kept;
  for (std::uint64_t offset = 8; offset < identity_.memory_bytes; offset *= 2) places.push_back(offset);
  constexpr std::uint64_t kPattern = 0x9e3779b97f4a7c15;
  const auto look = [&](std::size_t i) {
    std::uint64_t word = 0;
    fetch_words(identity_.memory_base + places[i], {&word, 1});
    return word;
  };
  const auto put = [&](std::size_t i, std::uint64_t word) {
    send_words(identity_.memory_base + places[i], {&word, 1});
  };
  for (std::size_t i = 0; i < places.size(); ++i) kept.push_back(look(i));
  for (std::size_t i = 0; i < places.size(); ++i) put(i, (i + 1) * kPattern);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (look(i) != (i + 1) * kPattern)
      fail("the board's memory does not answer: a word written at byte " + std::to_string(places[i]) + " of its " +
           std::to_string(identity_.memory_bytes) + " is not there");
  for (std::size_t i = 0; i < places.size(); ++i) put(i, kept[i]);
}

bool BoardDevice::carry_out(const link::Request& request, std::size_t answer_bytes, bool divisible,
                            std::vector<std::uint8_t>& data) {
  Answer answer;
  if (!exchange(request, answer_bytes, divisible, answer)) return false;
  if (answer.status != link::Status::kOk) refused(answer);
  if (answer.data.size() != answer_bytes)
    fail("an answer of " + std::to_string(answer.data.size()) + " bytes instead of " + std::to_string(answer_bytes));
  data = std::move(answer.data);
  return true;
}

// --- registers ---

void BoardDevice::flush() {
  std::vector<std::uint8_t> none;
  while (!writes_.empty()) {
    // A frame is given up for shorter ones only if it does no harm twice: not with what starts or resets.
    std::size_t count = std::clamp<std::size_t>(budget() / link::Request::kRegWriteBytes, 1, writes_.size());
    for (std::size_t i = 0; i < count; ++i) {
      if (writes_[i].first != kControl) continue;
      count = count == writes_.size() && i + 1 == count && budget() >= kAtOnce ? count : std::max<std::size_t>(i, 1);
      break;
    }
    const bool once =
        std::any_of(writes_.begin(), writes_.begin() + static_cast<std::ptrdiff_t>(count),
                    [](const auto& write) { return write.first == kControl || write.first >= link::kMemoryControl; });
    link::Request request;
    for (std::size_t i = 0; i < count; ++i) request.reg_write(writes_[i].first, writes_[i].second);
    if (!carry_out(request, 0, !once, none)) continue;
    writes_.erase(writes_.begin(), writes_.begin() + static_cast<std::ptrdiff_t>(count));
  }
}

void BoardDevice::write_register(std::uint32_t offset, std::uint32_t value) {
  idle_ = false;
  blocks_.clear();
  writes_.emplace_back(offset, value);
  if (offset == kControl) flush();
}

std::vector<std::uint32_t> BoardDevice::read_words(std::uint32_t offset, std::uint16_t count) {
  std::vector<std::uint32_t> words;
  std::vector<std::uint8_t> data;
  while (words.size() < count) {
    const std::size_t n = std::clamp<std::size_t>(budget() / 4, 1, count - words.size());
    link::Request request;
    request.reg_read(offset + 4 * static_cast<std::uint32_t>(words.size()), static_cast<std::uint16_t>(n));
    if (!carry_out(request, 4 * n, true, data)) continue;
    for (std::size_t i = 0; i < n; ++i) words.push_back(static_cast<std::uint32_t>(link::get(data, 4 * i, 4)));
  }
  return words;
}

std::uint32_t BoardDevice::read_register(std::uint32_t offset) {
  flush();
  if (!idle_ || offset >= sizeof(rt_regs_t)) return read_words(offset, 1).front();
  const std::uint32_t block = offset / kBlock * kBlock;
  auto found = blocks_.find(block);
  if (found == blocks_.end()) {
    const auto bytes = std::min<std::uint32_t>(kBlock, static_cast<std::uint32_t>(sizeof(rt_regs_t)) - block);
    found = blocks_.emplace(block, read_words(block, static_cast<std::uint16_t>(bytes / 4))).first;
  }
  return found->second[(offset - block) / 4];
}

bool BoardDevice::wait_interrupt() {
  flush();
  const std::vector<std::uint32_t> now = read_words(board_offset(link::kBoardIrq), 3);
  clocks_ += now[2] - clocks_low_;  // modulo 2^32
  clocks_low_ = now[2];
  runs_ = now[1];
  idle_ = (now[0] & 1) != 0;
  return idle_;
}

// --- memory ---

std::uint64_t BoardDevice::allocate(std::uint64_t bytes) {
  const std::uint64_t need = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  if (need > identity_.memory_bytes - used_)
    fail("the board's memory of " + std::to_string(identity_.memory_bytes) +
         " bytes is too small: " + std::to_string(used_) + " are used, " + std::to_string(bytes) + " more are needed");
  const std::uint64_t address = identity_.memory_base + used_;
  used_ += need;
  return address;
}

void BoardDevice::check_range(std::uint64_t address, std::size_t words) const {
  if (address % 8 != 0 || address < identity_.memory_base || address - identity_.memory_base > identity_.memory_bytes ||
      words > (identity_.memory_bytes - (address - identity_.memory_base)) / 8)
    fail("access outside the board's memory");
}

std::uint32_t BoardDevice::memory_sum(std::uint64_t address, std::size_t words) {
  // The check sequence of a long range is that of its parts, hashed in their order; both sides cut it alike.
  link::Request request;
  request.mem_crc(address, static_cast<std::uint16_t>(words));
  std::vector<std::uint8_t> data;
  carry_out(request, 4, false, data);
  return static_cast<std::uint32_t>(link::get(data, 0, 4));
}

namespace {
std::uint32_t sum_of(std::span<const std::uint64_t> words) {
  std::vector<std::uint8_t> bytes(words.size() * 8);
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (int k = 0; k < 8; ++k)
      bytes[8 * i + static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(words[i] >> (8 * k));
  }
  return link::crc(bytes);
}
}  // namespace

bool BoardDevice::holds(std::uint64_t address, std::span<const std::uint64_t> words) {
  return memory_sum(address, words.size()) == sum_of(words);
}

std::size_t BoardDevice::next_write(std::uint64_t address, std::span<const std::uint64_t> words, std::size_t at,
                                    std::size_t most, link::Request& request) {
  const std::uint64_t to = address + 8 * at;
  std::size_t same = 1;
  while (at + same < words.size() && same < kMostWords && words[at + same] == words[at]) ++same;
  if (same > 2) {
    request.mem_fill(to, static_cast<std::uint16_t>(same), words[at]);
    return same;
  }
  // Up to the next long stretch of equal words.
  const std::size_t fits = std::clamp<std::size_t>(most / 8, 1, words.size() - at);
  std::size_t count = 1;
  while (count < fits && !(at + count + 2 < words.size() && words[at + count] == words[at + count + 1] &&
                           words[at + count] == words[at + count + 2]))
    ++count;
  request.mem_write(to, words.subspan(at, count));
  return count;
}

void BoardDevice::send_words(std::uint64_t address, std::span<const std::uint64_t> words) {
  std::vector<std::uint8_t> none;
  for (std::size_t at = 0; at < words.size();) {
    link::Request request;
    const std::size_t count = next_write(address, words, at, budget(), request);
    if (carry_out(request, 0, true, none)) at += count;
  }
}

void BoardDevice::fetch_words(std::uint64_t address, std::span<std::uint64_t> words) {
  std::vector<std::uint8_t> data;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t n = std::clamp<std::size_t>(budget() / 8, 1, words.size() - at);
    link::Request request;
    request.mem_read(address + 8 * at, static_cast<std::uint16_t>(n));
    if (!carry_out(request, 8 * n, true, data)) continue;
    for (std::size_t i = 0; i < n; ++i) words[at + i] = link::get(data, 8 * i, 8);
    at += n;
  }
}

void BoardDevice::write_memory(std::uint64_t address, std::span<const std::uint64_t> words) {
  check_range(address, words.size());
  flush();
  // A long write goes on where one before was broken off: what the board's memory holds already is not sent again.
  bool resumes = words.size() > kMostWords;
  for (std::size_t at = 0; at < words.size(); at += kMostWords) {
    const auto part = words.subspan(at, std::min(kMostWords, words.size() - at));
    resumes = resumes && holds(address + 8 * at, part);
    if (resumes) continue;
    send_words(address + 8 * at, part);
    if (!holds(address + 8 * at, part)) fail("the board's memory does not hold what was written to it");
  }
}

void BoardDevice::read_memory(std::uint64_t address, std::span<std::uint64_t> words) {
  check_range(address, words.size());
  flush();
  fetch_words(address, words);
  for (std::size_t at = 0; at < words.size(); at += kMostWords) {
    const auto part = words.subspan(at, std::min(kMostWords, words.size() - at));
    if (!holds(address + 8 * at, part)) fail("what was read is not what the board's memory holds");
  }
}

}  // namespace retrace::cosim
