// A simulated DRAM behind the core's AXI4 port, clock by clock beside the core. A host reads and writes through the same port, while the core asks for
// nothing: the bytes take the path that they take on a board.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "testbench/sim/core/bus_memory.hpp"
#include "testbench/sim/dram/dram_model.hpp"

namespace retrace::cosim {

class DramMemory final : public BusMemory {
 public:
  DramMemory(const std::string& name, std::uint64_t seed);

  void resize(std::uint64_t bytes) override;
  std::uint64_t base() const override { return model_->base(); }
  std::uint64_t bytes() const { return model_->bytes(); }
  void write(std::uint64_t address, std::span<const std::uint64_t> words) override;
  void read(std::uint64_t address, std::span<std::uint64_t> words) override;

  void reset(const AxiMasterSignals& master) override;
  void clock(const AxiMasterSignals& master) override;
  const AxiSlaveSignals& signals() const override { return out_; }
  AxiMonitor& monitor() override { return monitor_; }
  std::uint64_t read_bytes_of(std::uint32_t id) const override { return id_bytes_[id % id_bytes_.size()]; }
  bool failed() const override { return model_->failed(); }

 private:
  void check(const char* what, std::uint64_t address, std::uint64_t bytes) const;
  void step(const AxiMasterSignals& master);

  std::string name_;
  std::unique_ptr<DramModel> model_;
  AxiSlaveSignals out_;
  AxiMonitor monitor_;
  std::array<std::uint64_t, 128> id_bytes_{};
};

}  // namespace retrace::cosim
