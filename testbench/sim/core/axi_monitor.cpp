// See axi_monitor.hpp.
#include "testbench/sim/core/axi_monitor.hpp"

#include <algorithm>

namespace retrace::cosim {
namespace {

constexpr std::uint32_t kIncr = 1, kExclusiveOkay = 1;
constexpr std::uint64_t kPage = 4096;
constexpr std::uint64_t kResetSettles = 2;  // clocks until a synchronous reset has reached the outputs

std::size_t index(AxiChannel channel) { return static_cast<std::size_t>(channel); }

}  // namespace

const char* name_of(AxiChannel channel) {
  constexpr std::array<const char*, kAxiChannels> kNames = {"AR", "R", "AW", "W", "B"};
  return kNames[index(channel)];
}

const char* name_of(AxiRule rule) {
  constexpr std::array<const char*, kAxiRules> kNames = {
      "valid dropped before it was accepted",
      "payload changed before it was accepted",
      "valid during reset",
      "burst is not INCR",
      "size is not the width of the bus",
      "burst is longer than the core promises",
      "address is not aligned to the bus",
      "burst crosses 4 KB",
      "last is not on the last beat",
      "strobe beyond the bus",
      "answer without a request",
      "response is none of OKAY, SLVERR, DECERR",
      "not accepted within the limit",
      "request without an answer",
  };
  return kNames[static_cast<std::size_t>(rule)];
}

std::string AxiViolation::text() const {
  return "clock " + std::to_string(clock) + ": " + name_of(channel) + ": " + name_of(rule);
}

void AxiHandshakes::violation(AxiChannel channel, AxiRule rule) {
  if (violations_.size() < kMostViolations) violations_.push_back({channel, now_, rule});
}

bool AxiHandshakes::begin_clock(bool rst_n) {
  ++now_;
  reset_clocks_ = rst_n ? 0 : reset_clocks_ + 1;
  in_reset_ = !rst_n;
  if (in_reset_) offers_ = {};
  return rst_n;
}

bool AxiHandshakes::handshake(AxiChannel channel, bool valid, bool ready, const Payload& payload) {
  Offer& offer = offers_[index(channel)];
  if (in_reset_) {
    if (valid && reset_clocks_ > kResetSettles) violation(channel, AxiRule::kValidInReset);
    return false;
  }
  if (offer.pending) {
    if (!valid)
      violation(channel, AxiRule::kValidHeld);
    else if (payload != offer.payload)
      violation(channel, AxiRule::kPayloadHeld);
  }
  if (valid && !ready) {
    if (!offer.pending) offer.waited = 0;
    if (++offer.waited == most_wait_) violation(channel, AxiRule::kWait);
  }
  offer.pending = valid && !ready;
  if (offer.pending) offer.payload = payload;
  return valid && ready;
}

AxiMonitor::AxiMonitor(int data_bytes, const AxiMonitorLimits& limits)
    : AxiHandshakes(limits.most_wait), data_bytes_(static_cast<std::uint32_t>(data_bytes)), limits_(limits) {}

void AxiMonitor::address(AxiChannel channel, std::uint64_t address, std::uint32_t len, std::uint32_t size,
                         std::uint32_t burst, std::uint32_t most_bytes) {
  const std::uint32_t bytes = (len + 1) * data_bytes_;
  if (burst != kIncr) violation(channel, AxiRule::kBurstType);
  if (1u << size != data_bytes_) violation(channel, AxiRule::kBurstSize);
  if (bytes > most_bytes) violation(channel, AxiRule::kBurstLength);
  if (address % data_bytes_ != 0) violation(channel, AxiRule::kAlignment);
  if (address % kPage + bytes > kPage) violation(channel, AxiRule::kBoundary);
}

// Write data have no id: they belong to the accepted addresses in their order, and may come before them.
void AxiMonitor::match_writes() {
  while (!writes_open_.empty() && !beats_.empty()) {
    Write& write = writes_open_.front();
    const bool last = beats_.front();
    beats_.pop_front();
    if (last != (write.beats == 1)) violation(AxiChannel::kW, AxiRule::kLast);
    if (--write.beats > 0) continue;
    ++unacknowledged_[write.id % kIds];
    ++acknowledgements_open_;
    writes_open_.pop_front();
  }
}

void AxiMonitor::clock(bool rst_n, const AxiMasterSignals& m, const AxiSlaveSignals& s) {
  if (!begin_clock(rst_n)) {
    for (auto& beats : read_beats_) beats.clear();
    writes_open_.clear();
    beats_.clear();
    unacknowledged_.fill(0);
    reads_open_ = acknowledgements_open_ = 0;
  }
  // Answers first: they belong to what was accepted in an earlier clock, and have to when they are offered.
  if (rst_n && s.r_valid && read_beats_[s.r_id % kIds].empty()) violation(AxiChannel::kR, AxiRule::kUnasked);
  if (rst_n && s.b_valid && unacknowledged_[s.b_id % kIds] == 0) violation(AxiChannel::kB, AxiRule::kUnasked);
  if (handshake(AxiChannel::kR, s.r_valid, m.r_ready, {s.r_data[0], s.r_data[1], s.r_id, s.r_resp | (s.r_last << 2)})) {
    auto& bursts = read_beats_[s.r_id % kIds];
    if (s.r_resp == kExclusiveOkay) violation(AxiChannel::kR, AxiRule::kResponse);
    if (!bursts.empty()) {
      if (s.r_last != (bursts.front() == 1)) violation(AxiChannel::kR, AxiRule::kLast);
      if (--bursts.front() == 0) {
        bursts.pop_front();
        --reads_open_;
        ++reads_;
      }
    }
  }
  if (handshake(AxiChannel::kB, s.b_valid, m.b_ready, {s.b_id, s.b_resp})) {
    if (s.b_resp == kExclusiveOkay) violation(AxiChannel::kB, AxiRule::kResponse);
    if (unacknowledged_[s.b_id % kIds] != 0) {
      --unacknowledged_[s.b_id % kIds];
      --acknowledgements_open_;
      ++writes_;
    }
  }
  if (handshake(AxiChannel::kAr, m.ar_valid, s.ar_ready,
                {m.ar_addr, m.ar_id, m.ar_len, m.ar_size | (m.ar_burst << 8)})) {
    address(AxiChannel::kAr, m.ar_addr, m.ar_len, m.ar_size, m.ar_burst, limits_.most_read_bytes);
    read_beats_[m.ar_id % kIds].push_back(m.ar_len + 1);
    ++reads_open_;
  }
  const bool beat = handshake(AxiChannel::kW, m.w_valid, s.w_ready,
                              {m.w_data[0], m.w_data[1], m.w_strb, static_cast<std::uint64_t>(m.w_last)});
  if (handshake(AxiChannel::kAw, m.aw_valid, s.aw_ready,
                {m.aw_addr, m.aw_id, m.aw_len, m.aw_size | (m.aw_burst << 8)})) {
    address(AxiChannel::kAw, m.aw_addr, m.aw_len, m.aw_size, m.aw_burst, limits_.most_write_bytes);
    writes_open_.push_back({m.aw_id, m.aw_len + 1});
  }
  if (beat) {
    const std::uint32_t all = (1u << data_bytes_) - 1;
    if ((m.w_strb & ~all) != 0) violation(AxiChannel::kW, AxiRule::kStrobes);
    partial_beats_ += m.w_strb != all;
    early_beats_ += writes_open_.empty();
    beats_.push_back(m.w_last);
  }
  match_writes();
}

bool AxiMonitor::idle() const {
  return reads_open_ == 0 && acknowledgements_open_ == 0 && writes_open_.empty() && beats_.empty();
}

void AxiMonitor::check_idle() {
  if (reads_open_ != 0) violation(AxiChannel::kR, AxiRule::kUnanswered);
  if (!writes_open_.empty()) violation(AxiChannel::kW, AxiRule::kUnanswered);
  if (!beats_.empty()) violation(AxiChannel::kAw, AxiRule::kUnanswered);
  if (acknowledgements_open_ != 0) violation(AxiChannel::kB, AxiRule::kUnanswered);
}

void AxiLiteMonitor::clock(bool rst_n, const AxiLiteMasterSignals& m, const AxiLiteSlaveSignals& s) {
  constexpr std::uint32_t kAll = 0xf;
  if (!begin_clock(rst_n)) {
    addresses_ = beats_ = writes_;
    asked_ = reads_;
  }
  if (rst_n && s.r_valid && reads_ == asked_) violation(AxiChannel::kR, AxiRule::kUnasked);
  if (rst_n && s.b_valid && writes_ == std::min(addresses_, beats_)) violation(AxiChannel::kB, AxiRule::kUnasked);
  if (handshake(AxiChannel::kR, s.r_valid, m.r_ready, {s.r_data, s.r_resp})) {
    if (s.r_resp == kExclusiveOkay) violation(AxiChannel::kR, AxiRule::kResponse);
    reads_ += reads_ < asked_;
  }
  if (handshake(AxiChannel::kB, s.b_valid, m.b_ready, {s.b_resp})) {
    if (s.b_resp == kExclusiveOkay) violation(AxiChannel::kB, AxiRule::kResponse);
    writes_ += writes_ < std::min(addresses_, beats_);
  }
  asked_ += handshake(AxiChannel::kAr, m.ar_valid, s.ar_ready, {m.ar_addr});
  const bool address = handshake(AxiChannel::kAw, m.aw_valid, s.aw_ready, {m.aw_addr});
  const bool beat = handshake(AxiChannel::kW, m.w_valid, s.w_ready, {m.w_data, m.w_strb});
  if (beat) {
    if ((m.w_strb & ~kAll) != 0) violation(AxiChannel::kW, AxiRule::kStrobes);
    partial_ += m.w_strb != kAll;
  }
  // The half that completes a pair says in which order it came.
  if (address && beat && addresses_ == beats_)
    ++together_;
  else if (address && addresses_ < beats_)
    ++data_first_;
  else if (beat && beats_ < addresses_)
    ++address_first_;
  addresses_ += address;
  beats_ += beat;
}

void AxiLiteMonitor::check_idle() {
  if (reads_ != asked_) violation(AxiChannel::kR, AxiRule::kUnanswered);
  if (addresses_ < beats_) violation(AxiChannel::kAw, AxiRule::kUnanswered);
  if (beats_ < addresses_) violation(AxiChannel::kW, AxiRule::kUnanswered);
  if (writes_ != std::min(addresses_, beats_)) violation(AxiChannel::kB, AxiRule::kUnanswered);
}

}  // namespace retrace::cosim
