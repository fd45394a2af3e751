// See axi_memory.hpp. Rules of the bus: axi_monitor.hpp.
#include "testbench/sim/core/axi_memory.hpp"

#include <algorithm>
#include <bitset>

#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr std::uint32_t kSlvErr = 2, kDecErr = 3;
constexpr std::uint64_t kBoundary = 4096;
constexpr std::size_t kMostReads = 512, kMostWrites = 64, kIds = 128;

}  // namespace

AxiMemory::AxiMemory(int data_bytes, const MemoryOptions& options)
    : data_bytes_(data_bytes),
      options_(options),
      random_(options.seed),
      monitor_(data_bytes, {.most_wait = options.most_wait}) {
  set_options(options);
  drive();
}

void AxiMemory::set_options(const MemoryOptions& options) {
  if (options.latency_min < 1 || options.latency_max < options.latency_min || options.latency_max > 100000)
    throw Error("memory model: latency must be 1 <= min <= max <= 100000 clocks");
  if (options.bytes_per_clock < 0 || options.stall_percent < 0 || options.stall_percent > 95)
    throw Error("memory model: bytes per clock must not be negative, stalls are 0 .. 95 percent");
  if (options.base % kBoundary != 0) throw Error("memory model: its base must be a multiple of 4096");
  if (options.base != options_.base && !words_.empty()) throw Error("memory model: a memory in use cannot move");
  options_ = options;
  if (options_.bytes_per_clock == 0) options_.bytes_per_clock = data_bytes_;
}

void AxiMemory::resize(std::uint64_t bytes) {
  if (bytes / 8 > words_.size()) words_.resize((bytes + 7) / 8);
}

bool AxiMemory::inside(std::uint64_t address, std::uint64_t bytes) const {
  return address >= base() && address - base() + bytes <= words_.size() * 8;
}

void AxiMemory::write(std::uint64_t address, std::span<const std::uint64_t> words) {
  if (!inside(address, words.size() * 8) || address % 8 != 0) throw Error("memory model: write outside the memory");
  std::copy(words.begin(), words.end(), words_.begin() + (address - base()) / 8);
}

void AxiMemory::read(std::uint64_t address, std::span<std::uint64_t> words) {
  if (!inside(address, words.size() * 8) || address % 8 != 0) throw Error("memory model: read outside the memory");
  std::copy_n(words_.begin() + (address - base()) / 8, words.size(), words.begin());
}

void AxiMemory::arm(const ErrorInjection& errors) {
  errors_ = errors;
  read_number_ = write_number_ = 0;
}

void AxiMemory::watch_writes(std::uint64_t begin, std::uint64_t end) {
  watch_begin_ = begin;
  written_times_.assign(end - begin, 0);
  stray_writes_ = 0;
}

std::uint64_t AxiMemory::latency() {
  return static_cast<std::uint64_t>(random_.integer(options_.latency_min, options_.latency_max));
}

bool AxiMemory::refused(std::uint64_t address, std::uint64_t bytes) const {
  return !inside(address, bytes) || address % kBoundary + bytes > kBoundary;
}

void AxiMemory::accept(const AxiMasterSignals& m) {
  if (m.ar_valid && out_.ar_ready) {
    Read read{m.ar_id, m.ar_addr, now_ + latency(), m.ar_len + 1, 0, read_number_++, false};
    read.outside = refused(m.ar_addr, read.beats * static_cast<std::uint64_t>(data_bytes_));
    outside_ += read.outside;
    ++read_bursts_;
    reads_.push_back(read);
  }
  if (m.aw_valid && out_.aw_ready) {
    Write write{m.aw_id, m.aw_addr, m.aw_len + 1, write_number_++, false};
    write.outside = refused(m.aw_addr, write.beats * static_cast<std::uint64_t>(data_bytes_));
    outside_ += write.outside;
    ++write_bursts_;
    writes_.push_back(write);
  }
  if (m.w_valid && out_.w_ready) {
    write_words_.push_back({m.w_data, m.w_strb});
    written_bytes_ += data_bytes_;
    bucket_ -= data_bytes_;
  }
  if (out_.r_valid && m.r_ready) out_.r_valid = false;
  if (out_.b_valid && m.b_ready) out_.b_valid = false;
}

void AxiMemory::store(std::uint64_t address, const Beat& beat) {
  for (int i = 0; i < data_bytes_; ++i) {
    if ((beat.strobes >> i & 1) == 0) continue;
    const std::uint64_t at = address + i, shift = 8 * (at % 8);
    std::uint64_t& word = words_[(at - base()) / 8];
    word = (word & ~(0xffull << shift)) | ((beat.data[i / 8] >> (8 * (i % 8)) & 0xff) << shift);
    if (at >= watch_begin_ && at - watch_begin_ < written_times_.size())
      ++written_times_[at - watch_begin_];
    else
      ++stray_writes_;
  }
}

void AxiMemory::finish_writes() {
  while (!writes_.empty() && write_words_.size() >= writes_.front().beats) {
    const Write write = writes_.front();
    writes_.pop_front();
    const bool error = write.number == errors_.write_burst;
    for (std::uint32_t beat = 0; beat < write.beats; ++beat) {
      const Beat data = write_words_.front();
      write_words_.pop_front();
      if (write.outside || error) continue;
      store(write.address + beat * static_cast<std::uint64_t>(data_bytes_), data);
    }
    const std::uint32_t response = write.outside ? kDecErr : error ? (errors_.decode_error ? kDecErr : kSlvErr) : 0;
    answers_.push_back({write.id, response, now_ + latency()});
  }
}

// The oldest entry, or, with `reorder`, any of the oldest of each id; end if none of them is ready.
template <typename Entry>
typename std::deque<Entry>::iterator AxiMemory::choose(std::deque<Entry>& entries) {
  if (entries.empty()) return entries.end();
  if (!options_.reorder) return entries.front().ready <= now_ + 1 ? entries.begin() : entries.end();
  std::vector<typename std::deque<Entry>::iterator> candidates;
  std::bitset<kIds> seen;
  for (auto it = entries.begin(); it != entries.end(); ++it) {
    if (seen[it->id % kIds]) continue;
    seen[it->id % kIds] = true;
    if (it->ready <= now_ + 1) candidates.push_back(it);
  }
  return candidates.empty() ? entries.end() : candidates[random_.below(candidates.size())];
}

void AxiMemory::drive() {
  std::uint64_t beats_asked = 0;
  for (const Write& write : writes_) beats_asked += write.beats;
  const bool address_first = options_.write_order == WriteOrder::kAddressFirst;
  const bool data_first = options_.write_order == WriteOrder::kDataFirst;
  out_.ar_ready = !stalled(AxiChannel::kAr) && reads_.size() < kMostReads;
  out_.aw_ready =
      !stalled(AxiChannel::kAw) && writes_.size() < kMostWrites && (!data_first || write_words_.size() > beats_asked);
  out_.w_ready = !stalled(AxiChannel::kW) && write_words_.size() < kMostWrites && bucket_ >= data_bytes_ &&
                 (!address_first || write_words_.size() < beats_asked);
  const bool r_active = !stalled(AxiChannel::kR), b_active = !stalled(AxiChannel::kB);
  if (!out_.r_valid && r_active && bucket_ >= data_bytes_ * (out_.w_ready ? 2 : 1)) {
    const auto chosen = choose(reads_);
    if (chosen != reads_.end()) {
      Read& read = *chosen;
      const std::uint64_t address = read.address + read.beat * static_cast<std::uint64_t>(data_bytes_);
      const bool hurt = (read.number == errors_.read_burst &&
                         (errors_.read_beat < 0 || errors_.read_beat == static_cast<int>(read.beat))) ||
                        (address >= errors_.bad_begin && address < errors_.bad_end);
      out_.r_valid = true;
      out_.r_id = read.id;
      out_.r_resp = read.outside ? kDecErr : hurt ? (errors_.decode_error ? kDecErr : kSlvErr) : 0;
      hurt_beats_ += hurt;
      out_.r_last = ++read.beat == read.beats;
      // What comes with an error is rubbish.
      for (int i = 0; i < data_bytes_ / 8; ++i)
        out_.r_data[i] = out_.r_resp != 0 ? random_.bits() : words_[(address - base()) / 8 + i];
      read_bytes_ += data_bytes_;
      id_bytes_[read.id % id_bytes_.size()] += data_bytes_;
      bucket_ -= data_bytes_;
      if (out_.r_last) reads_.erase(chosen);
    }
  }
  if (!out_.b_valid && b_active) {
    const auto chosen = choose(answers_);
    if (chosen != answers_.end()) {
      out_.b_valid = true;
      out_.b_id = chosen->id;
      out_.b_resp = chosen->response;
      answers_.erase(chosen);
    }
  }
}

void AxiMemory::reset(const AxiMasterSignals& master) {
  reads_.clear();
  writes_.clear();
  write_words_.clear();
  answers_.clear();
  out_ = {};
  monitor_.clock(false, master, out_);
  ++now_;
}

void AxiMemory::clock(const AxiMasterSignals& master) {
  monitor_.clock(true, master, out_);
  accept(master);
  finish_writes();
  ++now_;
  // Unused bandwidth is not saved up beyond a beat each way.
  bucket_ = std::min(bucket_ + options_.bytes_per_clock, 2.0 * data_bytes_ + options_.bytes_per_clock);
  drive();
}

}  // namespace retrace::cosim
