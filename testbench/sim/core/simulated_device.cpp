// See simulated_device.hpp.
#include "testbench/sim/core/simulated_device.hpp"

#include "golden/scene/geometry.hpp"
#include "testbench/sim/dram/dram_memory.hpp"

namespace retrace::cosim {
namespace {

constexpr std::uint64_t kPage = 4096;
constexpr int kResetClocks = 8;
constexpr int kLiteTimeout = 100000;     // clocks in which what is queued on the AXI4-Lite port has to end
constexpr std::uint64_t kSlice = 20000;  // clocks of one wait_interrupt()

std::unique_ptr<BusMemory> make_memory(int data_bytes, const SimulatedDevice::Options& options) {
  if (options.memory.dram.empty()) return std::make_unique<AxiMemory>(data_bytes, options.memory);
  if (data_bytes != 8)
    throw Error("rtl core: a simulated DRAM has a bus of 8 bytes, the configuration '" + options.configuration +
                "' one of " + std::to_string(data_bytes));
  return std::make_unique<DramMemory>(options.memory.dram, options.seed);
}

}  // namespace

SimulatedDevice::SimulatedDevice(const Options& options)
    : model_(make_core_model(options.configuration, options.seed, options.waves)),
      memory_(make_memory(model_->data_bytes(), options)),
      registers_(options.lite),
      lite_monitor_(options.lite_wait) {
  hard_reset();
}

void SimulatedDevice::hard_reset() {
  registers_.reset();
  in_.lite = {};
  in_.rst_n = false;
  for (int i = 0; i < kResetClocks; ++i) {
    lite_monitor_.clock(false, in_.lite, out_.lite);
    memory_->reset(out_.axi);
    in_.axi = memory_->signals();
    model_->clock(in_, out_);
  }
  in_.rst_n = true;
  run(kResetClocks);
}

void SimulatedDevice::step() {
  in_.axi = memory_->signals();
  in_.lite = registers_.drive();
  const CoreOutputs driven = out_;
  model_->clock(in_, out_);
  memory_->clock(driven.axi);
  lite_monitor_.clock(true, in_.lite, driven.lite);
  registers_.clock(driven.lite);
}

void SimulatedDevice::run(std::uint64_t clocks) {
  for (std::uint64_t i = 0; i < clocks; ++i) step();
  if (!memory_->monitor().violations().empty())
    throw Error("rtl core: AXI4: " + memory_->monitor().violations().front().text());
  if (!lite_monitor_.violations().empty())
    throw Error("rtl core: AXI4-Lite: " + lite_monitor_.violations().front().text());
  if (memory_->failed())
    throw Error("simulated DRAM: an assertion failed before clock " + std::to_string(model_->clocks()));
  if (model_->failed()) throw Error("rtl core: an assertion failed before clock " + std::to_string(model_->clocks()));
}

void SimulatedDevice::check_idle() {
  memory_->monitor().check_idle();
  lite_monitor_.check_idle();
  run(0);
}

void SimulatedDevice::finish_registers() {
  for (int i = 0; i < kLiteTimeout; ++i) {
    if (registers_.idle()) return;
    run(1);
  }
  throw Error("rtl core: a register access is not answered");
}

std::uint32_t SimulatedDevice::read_register(std::uint32_t offset) {
  finish_registers();
  registers_.read_answers().clear();
  registers_.read(offset);
  finish_registers();
  const AxiLiteMaster::Answer answer = registers_.read_answers().front();
  registers_.read_answers().clear();
  if (answer.response != 0)
    throw Error("rtl core: register read of " + std::to_string(offset) + " answered with an error");
  return answer.data;
}

void SimulatedDevice::write_register(std::uint32_t offset, std::uint32_t value) {
  finish_registers();
  registers_.write_answers().clear();
  registers_.write(offset, value);
  finish_registers();
  const AxiLiteMaster::Answer answer = registers_.write_answers().front();
  registers_.write_answers().clear();
  if (answer.response != 0)
    throw Error("rtl core: register write of " + std::to_string(offset) + " answered with an error");
}

std::uint64_t SimulatedDevice::allocate(std::uint64_t bytes) {
  const std::uint64_t address = memory_->base() + used_;
  used_ += (bytes + kPage - 1) / kPage * kPage;
  memory_->resize(used_);
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
