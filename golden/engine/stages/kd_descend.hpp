// kd_descend in double: near child if t < t_plane(split), else far. Returns the child's node index.
// Counterparts: hls/stages/kd_descend.hpp, rtl/walk/rt_kd_descend.sv. Source: Lee 2007, section 3.
#pragma once
#include "ray_setup.hpp"

namespace retrace::golden {

/// `plane` is t_plane(ray, axis, split); `child` the index of the left child.
inline std::uint32_t kd_descend(const RayState& ray, int axis, double plane, std::uint32_t child, double t) {
  const bool near = t < plane;
  return child + (near == ray.negative[axis] ? 1u : 0u);
}

}  // namespace retrace::golden
