// One Verilated DRAM (rt_dram_port, LiteDRAM's controller, its model of a DRAM) with plain signals.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "testbench/sim/core/core_model.hpp"

namespace retrace::cosim {

class DramModel {
 public:
  virtual ~DramModel() = default;
  /// One rising clock edge that sees what the master drives; `out` is what the port drives after it.
  virtual void clock(bool rst_n, const AxiMasterSignals& in, AxiSlaveSignals& out) = 0;
  virtual std::uint64_t base() const = 0;
  virtual std::uint64_t bytes() const = 0;
  virtual bool failed() const = 0;
};

/// Memories that are built, by their names in scripts/boards/memories.yml.
const std::vector<std::string>& dram_names();
/// Throws Error for an unknown name, listing the known ones.
std::unique_ptr<DramModel> make_dram_model(const std::string& name, std::uint64_t seed);

}  // namespace retrace::cosim
