// The memory behind the AXI4 port of a simulated core, as the device sees it: a model (axi_memory.hpp) or a simulated DRAM (dram/dram_memory.hpp).
#pragma once
#include <cstdint>
#include <span>

#include "testbench/sim/core/axi_monitor.hpp"

namespace retrace::cosim {

class BusMemory {
 public:
  virtual ~BusMemory() = default;
  /// Bytes of memory from address `base()` on. Throws Error if there cannot be so many; contents are kept.
  virtual void resize(std::uint64_t bytes) = 0;
  virtual std::uint64_t base() const = 0;
  /// Of a host: whole words, while the core asks for nothing.
  virtual void write(std::uint64_t address, std::span<const std::uint64_t> words) = 0;
  virtual void read(std::uint64_t address, std::span<std::uint64_t> words) = 0;

  /// Reset of the port: what the master drives in this clock of it. Everything in flight is forgotten.
  virtual void reset(const AxiMasterSignals& master) = 0;
  /// One clock: `master` is what the core drives in this clock, signals() what the memory drives in it; signals() changes for the next clock.
  virtual void clock(const AxiMasterSignals& master) = 0;
  virtual const AxiSlaveSignals& signals() const = 0;

  virtual AxiMonitor& monitor() = 0;
  virtual std::uint64_t read_bytes_of(std::uint32_t id) const = 0;
  /// An assertion of the RTL behind the port has failed.
  virtual bool failed() const { return false; }
};

}  // namespace retrace::cosim
