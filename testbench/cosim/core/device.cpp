// See device.hpp.
#include "testbench/cosim/core/device.hpp"

#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr std::uint64_t kPage = 4096;
constexpr int kLiteTimeout = 1000;       // clocks an AXI4-Lite access may take
constexpr std::uint64_t kSlice = 20000;  // clocks of one wait_interrupt()

}  // namespace

SimulatedDevice::SimulatedDevice(const Options& options)
    : model_(make_core_model(options.configuration, options.seed, options.waves)),
      memory_(model_->data_bytes(), options.memory) {
  in_.rst_n = false;
  for (int i = 0; i < 8; ++i) model_->clock(in_, out_);
  in_.rst_n = true;
  run(4);
}

void SimulatedDevice::step() {
  in_.axi = memory_.signals();
  const AxiMasterSignals master = out_.axi;
  model_->clock(in_, out_);
  memory_.clock(master);
}

void SimulatedDevice::run(std::uint64_t clocks) {
  for (std::uint64_t i = 0; i < clocks; ++i) step();
  if (model_->failed()) throw Error("rtl core: an assertion failed before clock " + std::to_string(model_->clocks()));
  if (!memory_.violations().empty()) throw Error("rtl core breaks a rule of the bus: " + memory_.violations().front());
}

std::uint32_t SimulatedDevice::read_register(std::uint32_t offset) {
  in_.lite.ar_valid = true;
  in_.lite.ar_addr = offset;
  in_.lite.r_ready = true;
  for (int i = 0; i < kLiteTimeout; ++i) {
    const AxiLiteSlaveSignals slave = out_.lite;
    run(1);
    if (slave.ar_ready) in_.lite.ar_valid = false;
    if (slave.r_valid) {
      in_.lite.ar_valid = in_.lite.r_ready = false;
      if (slave.r_resp != 0)
        throw Error("rtl core: register read of " + std::to_string(offset) + " answered with an error");
      return slave.r_data;
    }
  }
  throw Error("rtl core: register read is not answered");
}

void SimulatedDevice::write_register(std::uint32_t offset, std::uint32_t value) {
  in_.lite.aw_valid = in_.lite.w_valid = in_.lite.b_ready = true;
  in_.lite.aw_addr = offset;
  in_.lite.w_data = value;
  for (int i = 0; i < kLiteTimeout; ++i) {
    const AxiLiteSlaveSignals slave = out_.lite;
    run(1);
    if (slave.aw_ready) in_.lite.aw_valid = false;
    if (slave.w_ready) in_.lite.w_valid = false;
    if (slave.b_valid) {
      in_.lite.aw_valid = in_.lite.w_valid = in_.lite.b_ready = false;
      if (slave.b_resp != 0)
        throw Error("rtl core: register write of " + std::to_string(offset) + " answered with an error");
      return;
    }
  }
  throw Error("rtl core: register write is not answered");
}

std::uint64_t SimulatedDevice::allocate(std::uint64_t bytes) {
  const std::uint64_t address = AxiMemory::base() + used_;
  used_ += (bytes + kPage - 1) / kPage * kPage;
  memory_.resize(used_);
  return address;
}

void SimulatedDevice::release_all() { used_ = 0; }

bool SimulatedDevice::wait_interrupt() {
  constexpr std::uint64_t kCheck = 64;  // clocks between looks at assertions
  for (std::uint64_t i = 0; i < kSlice; i += kCheck) {
    for (std::uint64_t k = 0; k < kCheck; ++k) {
      if (out_.irq) return true;
      step();
    }
    run(0);
  }
  return out_.irq;
}

}  // namespace retrace::cosim
