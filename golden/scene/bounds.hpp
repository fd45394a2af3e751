// The least box around points, and around boxes of grid codes that are moved there.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

#include "hls/include/contract.hpp"

namespace retrace {

struct Bounds {
  glm::dvec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};

  void add(const glm::dvec3& p) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  /// The corners of a box of codes, by face; `moved(corner)`, of a corner in grid units, is where each lies.
  template <typename Moved>
  void add_corners(const std::array<std::int32_t, 6>& box, Moved moved) {
    constexpr double kUnit = 1.0 / (1 << contract::kPositionFrac);
    for (unsigned corner = 0; corner < 8; ++corner) {
      glm::dvec3 p;
      for (unsigned axis = 0; axis < 3; ++axis)
        p[static_cast<int>(axis)] = box[2 * axis + (corner >> axis & 1)] * kUnit;
      add(moved(p));
    }
  }
  bool empty() const { return !(lower.x <= upper.x); }
};

}  // namespace retrace
