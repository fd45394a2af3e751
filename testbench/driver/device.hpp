// A device that holds a Retrace core: registers, memory, interrupt. The driver (core_driver.hpp) sees nothing else, so that a card behind a
// kernel driver can take the place of the simulation: mmap of the registers, DMA for the memory, an eventfd for the interrupt.
#pragma once
#include <cstdint>
#include <span>

namespace retrace::cosim {

class Device {
 public:
  virtual ~Device() = default;
  virtual std::uint32_t read_register(std::uint32_t offset) = 0;
  virtual void write_register(std::uint32_t offset, std::uint32_t value) = 0;
  /// Device address of `bytes` bytes, aligned to 4096; release_all() gives all of it back.
  virtual std::uint64_t allocate(std::uint64_t bytes) = 0;
  virtual void release_all() = 0;
  /// 64-bit words, little endian; addresses are multiples of 8.
  virtual void write_memory(std::uint64_t address, std::span<const std::uint64_t> words) = 0;
  virtual void read_memory(std::uint64_t address, std::span<std::uint64_t> words) = 0;
  /// Returns when the interrupt is raised (true) or after a slice of time that the device chooses (false), so that the caller can show
  /// progress and give up.
  virtual bool wait_interrupt() = 0;
  /// Clocks the core has seen, as far as the device knows; limits are stated in them.
  virtual std::uint64_t clocks() const = 0;
};

}  // namespace retrace::cosim
