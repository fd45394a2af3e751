// See axi_memory.hpp. Rules: AMBA AXI protocol specification (IHI 0022), chapters A3 and A5.
#include "testbench/cosim/core/axi_memory.hpp"

#include <algorithm>

#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr std::uint32_t kSlvErr = 2, kDecErr = 3, kIncr = 1;
constexpr std::uint64_t kBoundary = 4096;
constexpr std::size_t kMostReads = 512, kMostWrites = 64, kMostViolations = 20;

}  // namespace

AxiMemory::AxiMemory(int data_bytes, const MemoryOptions& options)
    : data_bytes_(data_bytes), options_(options), random_(options.seed) {
  set_options(options);
  drive();
}

void AxiMemory::set_options(const MemoryOptions& options) {
  if (options.latency_min < 1 || options.latency_max < options.latency_min || options.latency_max > 100000)
    throw Error("memory model: latency must be 1 <= min <= max <= 100000 clocks");
  if (options.bytes_per_clock < 0 || options.stall_percent < 0 || options.stall_percent > 95)
    throw Error("memory model: bytes per clock must not be negative, stalls are 0 .. 95 percent");
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

void AxiMemory::read(std::uint64_t address, std::span<std::uint64_t> words) const {
  if (!inside(address, words.size() * 8) || address % 8 != 0) throw Error("memory model: read outside the memory");
  std::copy_n(words_.begin() + (address - base()) / 8, words.size(), words.begin());
}

void AxiMemory::arm(const ErrorInjection& errors) {
  errors_ = errors;
  read_number_ = write_number_ = 0;
}

void AxiMemory::violation(const std::string& what) {
  if (violations_.size() < kMostViolations) violations_.push_back("clock " + std::to_string(now_) + ": " + what);
}

std::uint64_t AxiMemory::latency() {
  return static_cast<std::uint64_t>(random_.integer(options_.latency_min, options_.latency_max));
}

void AxiMemory::check_address(const char* channel, std::uint64_t address, std::uint32_t len, std::uint32_t size,
                              std::uint32_t burst) {
  const std::string name = channel;
  if (burst != kIncr) violation(name + ": burst is not INCR");
  if (1u << size != static_cast<std::uint32_t>(data_bytes_)) violation(name + ": size is not the width of the bus");
  if (len > 255) violation(name + ": more than 256 beats");
  if (address % data_bytes_ != 0) violation(name + ": address is not aligned to the bus");
  if (address % kBoundary + (len + 1) * static_cast<std::uint64_t>(data_bytes_) > kBoundary)
    violation(name + ": burst crosses 4 KB");
}

void AxiMemory::accept(const AxiMasterSignals& m) {
  if (before_valid_) {
    const auto held = [&](const char* channel, bool was, bool ready, bool is, bool same) {
      if (!was || ready) return;
      if (!is)
        violation(std::string(channel) + ": valid dropped before it was accepted");
      else if (!same)
        violation(std::string(channel) + ": payload changed before it was accepted");
    };
    // before_ holds what was offered in the clock before and not taken then.
    held("AR", before_.ar_valid, false, m.ar_valid,
         m.ar_id == before_.ar_id && m.ar_addr == before_.ar_addr && m.ar_len == before_.ar_len);
    held("AW", before_.aw_valid, false, m.aw_valid,
         m.aw_id == before_.aw_id && m.aw_addr == before_.aw_addr && m.aw_len == before_.aw_len);
    held("W", before_.w_valid, false, m.w_valid,
         m.w_data == before_.w_data && m.w_last == before_.w_last && m.w_strb == before_.w_strb);
  }
  before_ = m;
  before_.ar_valid = m.ar_valid && !out_.ar_ready;
  before_.aw_valid = m.aw_valid && !out_.aw_ready;
  before_.w_valid = m.w_valid && !out_.w_ready;
  before_valid_ = true;

  if (m.ar_valid && out_.ar_ready) {
    check_address("AR", m.ar_addr, m.ar_len, m.ar_size, m.ar_burst);
    Read read{m.ar_id, m.ar_addr, now_ + latency(), m.ar_len + 1, 0, read_number_++, false};
    read.outside = !inside(m.ar_addr, read.beats * static_cast<std::uint64_t>(data_bytes_));
    outside_ += read.outside;
    ++read_bursts_;
    reads_.push_back(read);
  }
  if (m.aw_valid && out_.aw_ready) {
    check_address("AW", m.aw_addr, m.aw_len, m.aw_size, m.aw_burst);
    Write write{m.aw_id, m.aw_addr, m.aw_len + 1, write_number_++, false};
    write.outside = !inside(m.aw_addr, write.beats * static_cast<std::uint64_t>(data_bytes_));
    outside_ += write.outside;
    ++write_bursts_;
    writes_.push_back(write);
  }
  if (m.w_valid && out_.w_ready) {
    if (m.w_strb != (1u << data_bytes_) - 1) violation("W: strobes are not all ones");
    write_words_.push_back({m.w_data, m.w_last});
    written_bytes_ += data_bytes_;
    bucket_ -= data_bytes_;
  }
  if (out_.r_valid && m.r_ready) out_.r_valid = false;
  if (out_.b_valid && m.b_ready) out_.b_valid = false;
}

void AxiMemory::finish_writes() {
  while (!writes_.empty() && write_words_.size() >= writes_.front().beats) {
    const Write write = writes_.front();
    writes_.pop_front();
    const bool error = write.number == errors_.write_burst;
    for (std::uint32_t beat = 0; beat < write.beats; ++beat) {
      const Beat data = write_words_.front();
      write_words_.pop_front();
      if (data.last != (beat + 1 == write.beats)) violation("W: last is not on the last beat");
      if (write.outside || error) continue;
      const std::uint64_t word = (write.address - base()) / 8 + beat * static_cast<std::uint64_t>(data_bytes_) / 8;
      for (int i = 0; i < data_bytes_ / 8; ++i) words_[word + i] = data.data[i];
    }
    const std::uint32_t response = write.outside ? kDecErr : error ? (errors_.decode_error ? kDecErr : kSlvErr) : 0;
    answers_.push_back({write.id, response, now_ + latency()});
  }
}

void AxiMemory::drive() {
  out_.ar_ready = reads_.size() < kMostReads && !stalled();
  out_.aw_ready = writes_.size() < kMostWrites && !stalled();
  out_.w_ready = write_words_.size() < kMostWrites && bucket_ >= data_bytes_ && !stalled();
  if (!out_.r_valid && !reads_.empty() && bucket_ >= data_bytes_ * (out_.w_ready ? 2 : 1) && !stalled()) {
    auto chosen = reads_.end();
    if (!options_.reorder) {
      if (reads_.front().ready <= now_ + 1) chosen = reads_.begin();
    } else {
      // The first burst of each id is a candidate.
      std::vector<std::deque<Read>::iterator> candidates;
      std::vector<std::uint32_t> seen;
      for (auto it = reads_.begin(); it != reads_.end(); ++it) {
        if (std::find(seen.begin(), seen.end(), it->id) != seen.end()) continue;
        seen.push_back(it->id);
        if (it->ready <= now_ + 1) candidates.push_back(it);
      }
      if (!candidates.empty()) chosen = candidates[random_.below(candidates.size())];
    }
    if (chosen != reads_.end()) {
      Read& read = *chosen;
      const std::uint64_t address = read.address + read.beat * static_cast<std::uint64_t>(data_bytes_);
      const bool hurt = (read.number == errors_.read_burst &&
                         (errors_.read_beat < 0 || errors_.read_beat == static_cast<int>(read.beat))) ||
                        (address >= errors_.bad_begin && address < errors_.bad_end);
      out_.r_valid = true;
      out_.r_id = read.id;
      out_.r_resp = read.outside ? kDecErr : hurt ? (errors_.decode_error ? kDecErr : kSlvErr) : 0;
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
  if (!out_.b_valid && !answers_.empty() && answers_.front().ready <= now_ + 1 && !stalled()) {
    out_.b_valid = true;
    out_.b_id = answers_.front().id;
    out_.b_resp = answers_.front().response;
    answers_.pop_front();
  }
}

void AxiMemory::clock(const AxiMasterSignals& master) {
  accept(master);
  finish_writes();
  ++now_;
  // Unused bandwidth is not saved up beyond a beat each way.
  bucket_ = std::min(bucket_ + options_.bytes_per_clock, 2.0 * data_bytes_ + options_.bytes_per_clock);
  drive();
}

}  // namespace retrace::cosim
