// A set-associative cache with least-recently-used replacement, fed from access logs: what part of a structure's memory
// traffic a cache of a given size keeps on the chip. 64-byte lines, one unified cache, reads only. Rays are interleaved
// as a core with ray contexts does: `contexts` rays are in flight and take turns, one access each; who has finished
// takes the next ray.
#pragma once
#include <cstdint>
#include <vector>

#include "probe.hpp"

namespace retrace::accel {

struct CacheShape {
  std::uint32_t bytes = 65536;
  std::uint32_t ways = 4;
};

class CacheModel {
 public:
  /// Bytes must be a power of two of at least ways * 64. Throws std::invalid_argument.
  explicit CacheModel(CacheShape shape);
  /// True on a hit.
  bool access(std::uint32_t line) {
    ++accesses_;
    std::uint32_t* set = tags_.data() + std::size_t{line & set_mask_} * ways_;
    // Most recent first, so the last tag is the one to drop.
    for (std::uint32_t w = 0; w < ways_; ++w) {
      if (set[w] != line) continue;
      for (; w > 0; --w) set[w] = set[w - 1];
      set[0] = line;
      return true;
    }
    for (std::uint32_t w = ways_ - 1; w > 0; --w) set[w] = set[w - 1];
    set[0] = line;
    ++misses_;
    return false;
  }
  std::uint64_t accesses() const { return accesses_; }
  std::uint64_t misses() const { return misses_; }

 private:
  std::uint32_t ways_, set_mask_;
  std::vector<std::uint32_t> tags_;
  std::uint64_t accesses_ = 0, misses_ = 0;
};

/// Feeds all rays of the log to all caches.
void replay(const AccessLog& log, std::size_t contexts, std::vector<CacheModel>& caches);

}  // namespace retrace::accel
