// The device of the simulation: the Verilated core with a modelled memory, or with a simulated DRAM.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "testbench/driver/device.hpp"
#include "testbench/sim/core/axi_lite_master.hpp"
#include "testbench/sim/core/axi_memory.hpp"
#include "testbench/sim/core/axi_monitor.hpp"
#include "testbench/sim/core/core_model.hpp"

namespace retrace::cosim {

class SimulatedDevice final : public Device {
 public:
  struct Options {
    std::string configuration = "ecp5";
    MemoryOptions memory;
    std::string waves;
    std::uint64_t seed = 1;
    LiteOptions lite = {};
    std::uint64_t lite_wait = 1000;  ///< clocks the core has to accept an address, a beat, an answer
  };
  explicit SimulatedDevice(const Options& options);

  std::uint32_t read_register(std::uint32_t offset) override;
  void write_register(std::uint32_t offset, std::uint32_t value) override;
  std::uint64_t allocate(std::uint64_t bytes) override;
  void release_all() override;
  void write_memory(std::uint64_t address, std::span<const std::uint64_t> words) override {
    memory_->write(address, words);
  }
  void read_memory(std::uint64_t address, std::span<std::uint64_t> words) override { memory_->read(address, words); }
  bool wait_interrupt() override;
  std::uint64_t clocks() const override { return model_->clocks(); }

  /// The modelled memory; std::bad_cast where a DRAM is simulated.
  AxiMemory& memory() { return dynamic_cast<AxiMemory&>(*memory_); }
  BusMemory& bus_memory() { return *memory_; }
  const BusMemory& bus_memory() const { return *memory_; }
  int data_bytes() const { return model_->data_bytes(); }
  /// The port behind read_register() and write_register(), which wait for their answer; what is queued here goes on while clocks pass.
  AxiLiteMaster& registers() { return registers_; }
  const AxiLiteMonitor& lite_monitor() const { return lite_monitor_; }
  /// rst_ni is low for some clocks. What was in flight on both ports is forgotten; the contents of the memory stay.
  void hard_reset();
  /// Nothing is in flight on either port, and nobody has broken a rule.
  void check_idle();
  /// Clocks pass. Throws Error if an assertion of the RTL fails or a rule of the bus is broken.
  void run(std::uint64_t clocks);
  bool interrupt() const { return out_.irq; }

 private:
  void step();
  void finish_registers();

  std::unique_ptr<CoreModel> model_;
  std::unique_ptr<BusMemory> memory_;
  AxiLiteMaster registers_;
  AxiLiteMonitor lite_monitor_;
  CoreInputs in_;
  CoreOutputs out_;
  std::uint64_t used_ = 0;
};

}  // namespace retrace::cosim
