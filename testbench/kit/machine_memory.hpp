// The memory that the models of machines share: answers after a latency, moves so many bytes a clock, and stands behind direct-mapped caches.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

namespace retrace {

struct MachineMemory {
  static constexpr double kLatency = 60;       ///< clocks from a request to the first byte
  static constexpr double kBytesPerClock = 8;  ///< of all ports together
};

/// Lines of a section, by number. A lookup that misses fills.
class MachineCache {
 public:
  explicit MachineCache(std::size_t lines) : held_(lines, ~std::uint64_t{0}) {}
  bool look_up(std::uint64_t line) {
    ++lookups_;
    std::uint64_t& held = held_[line % held_.size()];
    if (held == line) return true;
    held = line;
    ++misses_;
    return false;
  }
  std::uint64_t lookups() const { return lookups_; }
  std::uint64_t misses() const { return misses_; }
  double hit_rate() const {
    return lookups_ ? 1.0 - static_cast<double>(misses_) / static_cast<double>(lookups_) : 1.0;
  }

 private:
  std::vector<std::uint64_t> held_;
  std::uint64_t lookups_ = 0, misses_ = 0;
};

}  // namespace retrace
