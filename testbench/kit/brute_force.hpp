// The nearest hit over all triangles with the kernels' own test, without any acceleration structure.
#pragma once
#include <span>
#include <vector>

#include "golden/engine/engine.hpp"

namespace retrace {

class BruteForce {
 public:
  explicit BruteForce(const MemoryImage& image);

  struct Result {
    bool hit = false;
    std::uint32_t t = 0, id = contract::kNoTriangle;  ///< codes, as in the hit record
    std::int32_t dz = 0;                              ///< d'z code of that hit
  };
  /// Closest hit with t <= t_max; the lowest id on equal t. For any-hit rays too (is there one at all?).
  /// Triangles whose id is in `without` do not count.
  Result trace(const contract::RayRecord& ray, std::span<const std::uint32_t> without = {}) const;

 private:
  // Rows as floats, one array a coefficient. A float test with a wide margin rejects what cannot be hit; everything
  // else goes through the exact test, so the answer is that of the exact test on every triangle.
  static constexpr int kColumns = 14;
  std::vector<float> columns_[kColumns];
  std::vector<contract::TriangleRecord> triangles_;
};

}  // namespace retrace
