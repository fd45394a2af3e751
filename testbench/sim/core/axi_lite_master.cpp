// See axi_lite_master.hpp.
#include "testbench/sim/core/axi_lite_master.hpp"

namespace retrace::cosim {

void AxiLiteMaster::write(std::uint32_t offset, std::uint32_t value, std::uint32_t strobes) {
  aw_.push_back(offset);
  w_.push_back({value, strobes});
  ++writes_open_;
}

void AxiLiteMaster::read(std::uint32_t offset) {
  ar_.push_back(offset);
  ++reads_open_;
}

void AxiLiteMaster::reset() {
  out_ = {};
  aw_.clear();
  w_.clear();
  ar_.clear();
  writes_open_ = reads_open_ = 0;
  write_answers_.clear();
  read_answers_.clear();
}

const AxiLiteMasterSignals& AxiLiteMaster::drive() {
  // VALID, once high, stays until clock() has seen READY. Without it the payload is noise.
  if (!out_.aw_valid) {
    out_.aw_valid = active(AxiChannel::kAw) && !aw_.empty();
    out_.aw_addr = out_.aw_valid ? aw_.front() : static_cast<std::uint32_t>(random_.bits());
  }
  if (!out_.w_valid) {
    out_.w_valid = active(AxiChannel::kW) && !w_.empty();
    out_.w_data = out_.w_valid ? w_.front().value : static_cast<std::uint32_t>(random_.bits());
    out_.w_strb = out_.w_valid ? w_.front().strobes : static_cast<std::uint32_t>(random_.below(16));
  }
  if (!out_.ar_valid) {
    out_.ar_valid = active(AxiChannel::kAr) && !ar_.empty();
    out_.ar_addr = out_.ar_valid ? ar_.front() : static_cast<std::uint32_t>(random_.bits());
  }
  out_.b_ready = active(AxiChannel::kB);
  out_.r_ready = active(AxiChannel::kR);
  return out_;
}

void AxiLiteMaster::clock(const AxiLiteSlaveSignals& slave) {
  if (out_.aw_valid && slave.aw_ready) {
    aw_.pop_front();
    out_.aw_valid = false;
  }
  if (out_.w_valid && slave.w_ready) {
    w_.pop_front();
    out_.w_valid = false;
  }
  if (out_.ar_valid && slave.ar_ready) {
    ar_.pop_front();
    out_.ar_valid = false;
  }
  if (out_.b_ready && slave.b_valid) {
    write_answers_.push_back({slave.b_resp, 0});
    writes_open_ -= writes_open_ > 0;
  }
  if (out_.r_ready && slave.r_valid) {
    read_answers_.push_back({slave.r_resp, slave.r_data});
    reads_open_ -= reads_open_ > 0;
  }
}

}  // namespace retrace::cosim
