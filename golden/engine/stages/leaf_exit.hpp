// leaf_exit in double: where a ray leaves the cell with the bounds `bound` (by face); the lowest axis wins a tie.
// Counterparts: hls/stages/leaf_exit.hpp, rtl/leaf/rt_leaf_exit.sv. Source: Lee 2007, section 3.
#pragma once
#include <array>

#include "ray_setup.hpp"

namespace retrace::golden {

struct LeafExit {
  double t_exit;
  int face;
};

inline LeafExit leaf_exit(const RayState& ray, const std::array<double, 6>& bound) {
  LeafExit exit{1e300, 0};
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.zero[axis]) continue;
    const int face = 2 * axis + (ray.negative[axis] ? 0 : 1);
    const double t = t_plane(ray, axis, bound[face]);
    if (t < exit.t_exit) exit = {t, face};
  }
  return exit;
}

}  // namespace retrace::golden
