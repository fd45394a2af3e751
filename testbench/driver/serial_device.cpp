// See serial_device.hpp.
#include "testbench/driver/serial_device.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <random>

#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"
#include "rtl/shell/rt_regs.h"

namespace retrace::cosim {
namespace {

constexpr std::size_t kLeastBudget = 32;   // payload of the shortest frames: one ray
constexpr std::size_t kFirstBudget = 256;  // before the line is known
constexpr std::size_t kOverhead = 24;      // flags, header, check sequence, some escapes; both ways
constexpr int kTriesOfDivisible = 2;
constexpr double kLeastTimeout = 0.05;     // seconds; USB and scheduling
constexpr double kMargin = 4;              // times what the line took for a byte, and memory for a word, so far
constexpr double kClocksPerWord = 20;      // of a fill or a sum, before one has been timed
constexpr double kLeastClockHz = 1e6;      // whatever the board says of itself
constexpr std::uint32_t kBlock = 128;      // bytes of registers read at once
constexpr std::size_t kMostWords = 65535;  // of an operation's count
constexpr std::uint32_t kControl = offsetof(rt_regs_t, control);

const char* meaning(link::Status status) {
  constexpr const char* kMeaning[link::kStatuses] = {"done",
                                                     "damaged",
                                                     "another version of the protocol",
                                                     "another session: the board was reset, or another program uses it",
                                                     "malformed",
                                                     "the answer would be too long",
                                                     "the bus answered with an error",
                                                     "there is no such register"};
  const auto index = static_cast<std::size_t>(status);
  return index < std::size(kMeaning) ? kMeaning[index] : "unknown status";
}

}  // namespace

SerialDevice::SerialDevice(std::unique_ptr<SerialLine> line, const LinkOptions& options)
    : line_(std::move(line)),
      options_(options),
      reader_(70000),
      budget_(kFirstBudget),
      most_budget_(kFirstBudget),
      byte_seconds_(10.0 / options.baud) {
  if (options_.seed == 0) options_.seed = std::random_device{}();
  std::mt19937_64 random(options_.seed);
  session_ = static_cast<std::uint16_t>(random());
  sequence_ = static_cast<std::uint16_t>(random());

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
  word_seconds_ = kClocksPerWord / std::max<double>(identity_.clock_hz, kLeastClockHz);
  clocks_low_ = static_cast<std::uint32_t>(word(link::kBoardClocks));
  runs_ = static_cast<std::uint32_t>(word(link::kBoardRuns));
  if (identity_.most_frame < kLeastBudget + kOverhead || identity_.memory_base % kAlignment != 0)
    fail("the board's description makes no sense");
  most_budget_ =
      std::min<std::size_t>(identity_.most_frame - link::kRequestHeader - link::Request::kMemoryHeader, 8 * kMostWords);
}

void SerialDevice::fail(const std::string& what) const { throw Error("serial link: " + line_->name() + ": " + what); }

double SerialDevice::timeout(std::size_t bytes, std::size_t words) const {
  return slack_ * (kLeastTimeout +
                   kMargin * (byte_seconds_ * static_cast<double>(bytes) + word_seconds_ * static_cast<double>(words)));
}

void SerialDevice::failed(std::size_t bytes) { budget_ = std::max(kLeastBudget, std::min(budget_, bytes) * 2 / 3); }
void SerialDevice::succeeded(std::size_t bytes) {
  // Only a frame that used the budget says that there could be more.
  if (2 * bytes >= budget_) budget_ = std::min(most_budget_, budget_ + budget_ / 4 + 1);
}

bool SerialDevice::exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer) {
  ++sequence_;
  std::vector<std::uint8_t> body{link::kRequest, static_cast<std::uint8_t>(sequence_),
                                 static_cast<std::uint8_t>(sequence_ >> 8), static_cast<std::uint8_t>(session_),
                                 static_cast<std::uint8_t>(session_ >> 8)};
  body.insert(body.end(), request.bytes().begin(), request.bytes().end());
  const std::vector<std::uint8_t> line = link::frame(body);
  const std::size_t load = std::max(request.bytes().size(), answer_bytes);
  const std::size_t expected = line.size() + answer_bytes + kOverhead, walked = request.walked();
  ++statistics_.frames;
  double heard = line_->now();
  bool ever = false;
  for (int tries = 1;; ++tries) {
    line_->write(line);
    statistics_.bytes_out += line.size();
    const double sent = line_->now(), until = sent + timeout(expected, walked);
    bool again = false;
    while (!again) {
      const double left = until - line_->now();
      if (left <= 0) break;
      const std::vector<std::uint8_t> bytes = line_->read(left);
      statistics_.bytes_in += bytes.size();
      if (!bytes.empty()) {
        heard = line_->now();
        ever = true;
      }
      for (const std::uint8_t byte : bytes) {
        const auto frame = reader_.take(byte);
        if (!frame) continue;
        if (!frame->good || frame->body.size() < link::kResponseHeader) {
          again = true;
          continue;
        }
        const std::vector<std::uint8_t>& b = frame->body;
        if ((b[0] & link::kRequestBit) != 0) continue;  // an echo of what was sent
        if (b[0] != link::kResponse)
          fail("the board speaks version " + std::to_string(b[0] & 0x0f) + " of the protocol, this program version " +
               std::to_string(link::kResponse & 0x0f));
        answer.status = static_cast<link::Status>(b[5]);
        if (answer.status == link::Status::kDamaged) {
          again = true;
          continue;
        }
        if (link::get(b, 1, 2) != sequence_ || link::get(b, 3, 2) != session_) continue;  // of a frame before
        answer.position = static_cast<std::uint16_t>(link::get(b, 6, 2));
        answer.data.assign(b.begin() + link::kResponseHeader, b.end());
        if (tries == 1) {
          // The board's own work says nothing about the line, so it is booked apart.
          const double elapsed = line_->now() - sent;
          const auto learn = [](double& known, double sample) { known = std::max(sample, 0.9 * known + 0.1 * sample); };
          if (walked == 0) {
            learn(byte_seconds_, elapsed / static_cast<double>(expected));
          } else {
            learn(word_seconds_,
                  std::max(0.0, elapsed - byte_seconds_ * static_cast<double>(expected)) / static_cast<double>(walked));
          }
          succeeded(load);
        }
        slack_ = std::max(1.0, slack_ / 2);
        return true;
      }
    }
    // Not answered: damaged on its way there or back, or not at all.
    ++statistics_.repeated;
    if (!again) {
      ++statistics_.timeouts;
      slack_ = std::min(16.0, 2 * slack_);
    }
    if (line_->now() - heard > std::max(options_.patience, 2 * timeout(expected, walked)))
      fail(ever || clocks_low_ != 0 || identity_.memory_bytes != 0 ? "the board does not answer any more"
                                                                   : "nothing answers");
    if (tries >= options_.most_tries)
      fail("no whole answer in " + std::to_string(tries) +
           " tries; the line damages too much, or it is no Retrace board");
    failed(load);
    if (divisible && tries >= kTriesOfDivisible && load > kLeastBudget) return false;
  }
}

bool SerialDevice::carry_out(const link::Request& request, std::size_t answer_bytes, bool divisible,
                             std::vector<std::uint8_t>& data) {
  Answer answer;
  if (!exchange(request, answer_bytes, divisible, answer)) return false;
  if (answer.status != link::Status::kOk)
    fail(std::string("the board refuses an operation: ") + meaning(answer.status) + " (at byte " +
         std::to_string(answer.position) + ")");
  if (answer.data.size() != answer_bytes)
    fail("an answer of " + std::to_string(answer.data.size()) + " bytes instead of " + std::to_string(answer_bytes));
  data = std::move(answer.data);
  return true;
}

// --- registers ---

void SerialDevice::flush() {
  std::vector<std::uint8_t> none;
  while (!writes_.empty()) {
    // A frame is given up for shorter ones only if it does no harm twice: not with what starts or resets.
    std::size_t count = std::clamp<std::size_t>(budget() / link::Request::kRegWriteBytes, 1, writes_.size());
    for (std::size_t i = 0; i < count; ++i) {
      if (writes_[i].first != kControl) continue;
      count =
          count == writes_.size() && i + 1 == count && budget() >= kFirstBudget ? count : std::max<std::size_t>(i, 1);
      break;
    }
    const bool control = writes_[count - 1].first == kControl;
    link::Request request;
    for (std::size_t i = 0; i < count; ++i) request.reg_write(writes_[i].first, writes_[i].second);
    if (!carry_out(request, 0, !control, none)) continue;
    writes_.erase(writes_.begin(), writes_.begin() + static_cast<std::ptrdiff_t>(count));
  }
}

void SerialDevice::write_register(std::uint32_t offset, std::uint32_t value) {
  idle_ = false;
  blocks_.clear();
  writes_.emplace_back(offset, value);
  if (offset == kControl) flush();
}

std::vector<std::uint32_t> SerialDevice::read_words(std::uint32_t offset, std::uint16_t count) {
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

std::uint32_t SerialDevice::read_register(std::uint32_t offset) {
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

bool SerialDevice::wait_interrupt() {
  flush();
  const std::vector<std::uint32_t> now = read_words(board_offset(link::kBoardIrq), 3);
  clocks_ += now[2] - clocks_low_;  // modulo 2^32
  clocks_low_ = now[2];
  runs_ = now[1];
  idle_ = (now[0] & 1) != 0;
  return idle_;
}

// --- memory ---

std::uint64_t SerialDevice::allocate(std::uint64_t bytes) {
  const std::uint64_t need = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  if (need > identity_.memory_bytes - used_)
    fail("the board's memory of " + std::to_string(identity_.memory_bytes) +
         " bytes is too small: " + std::to_string(used_) + " are used, " + std::to_string(bytes) + " more are needed");
  const std::uint64_t address = identity_.memory_base + used_;
  used_ += need;
  return address;
}

void SerialDevice::check_range(std::uint64_t address, std::size_t words) const {
  if (address % 8 != 0 || address < identity_.memory_base || address - identity_.memory_base > identity_.memory_bytes ||
      words > (identity_.memory_bytes - (address - identity_.memory_base)) / 8)
    fail("access outside the board's memory");
}

std::uint32_t SerialDevice::memory_sum(std::uint64_t address, std::size_t words) {
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

void SerialDevice::write_memory(std::uint64_t address, std::span<const std::uint64_t> words) {
  check_range(address, words.size());
  flush();
  std::vector<std::uint8_t> none;
  for (std::size_t at = 0; at < words.size();) {
    const std::uint64_t to = address + 8 * at;
    std::size_t same = 1;
    while (at + same < words.size() && same < kMostWords && words[at + same] == words[at]) ++same;
    link::Request request;
    std::size_t count = same;
    if (same > 2) {
      request.mem_fill(to, static_cast<std::uint16_t>(same), words[at]);
    } else {
      // Up to the next long stretch of equal words.
      const std::size_t most = std::clamp<std::size_t>(budget() / 8, 1, words.size() - at);
      count = 1;
      while (count < most && !(at + count + 2 < words.size() && words[at + count] == words[at + count + 1] &&
                               words[at + count] == words[at + count + 2]))
        ++count;
      request.mem_write(to, words.subspan(at, count));
    }
    if (carry_out(request, 0, true, none)) at += count;
  }
  for (std::size_t at = 0; at < words.size(); at += kMostWords) {
    const auto part = words.subspan(at, std::min(kMostWords, words.size() - at));
    if (memory_sum(address + 8 * at, part.size()) != sum_of(part))
      fail("the board's memory does not hold what was written to it");
  }
}

void SerialDevice::read_memory(std::uint64_t address, std::span<std::uint64_t> words) {
  check_range(address, words.size());
  flush();
  std::vector<std::uint8_t> data;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t n = std::clamp<std::size_t>(budget() / 8, 1, words.size() - at);
    link::Request request;
    request.mem_read(address + 8 * at, static_cast<std::uint16_t>(n));
    if (!carry_out(request, 8 * n, true, data)) continue;
    for (std::size_t i = 0; i < n; ++i) words[at + i] = link::get(data, 8 * i, 8);
    at += n;
  }
  for (std::size_t at = 0; at < words.size(); at += kMostWords) {
    const auto part = words.subspan(at, std::min(kMostWords, words.size() - at));
    if (memory_sum(address + 8 * at, part.size()) != sum_of(part))
      fail("what was read is not what the board's memory holds");
  }
}

}  // namespace retrace::cosim
