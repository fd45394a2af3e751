// ray_setup in double: reciprocals of the direction.
// A direction of zero gets a reciprocal so large that every plane but the origin's own is beyond reach, on the side where it lies; the
// origin's own plane gives t = 0. Both are what kd_descend does with its zero flag.
// Counterparts: hls/stages/ray_setup.hpp, rtl/ray/rt_ray_setup.sv. Source: Lee 2007, section 3.
#pragma once
#include <glm/glm.hpp>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

struct RayState {
  glm::dvec3 origin, direction, reciprocal;
  glm::bvec3 negative, zero;
  double t_max;
  bool any;

  /// The record that this was made of, for decisions in integers.
  contract::RayRecord codes() const {
    contract::RayRecord ray;
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = static_cast<std::int32_t>(origin[axis] * (1 << contract::kPositionFrac));
      ray.direction[axis] = static_cast<std::int32_t>(direction[axis] * (1 << contract::kDirectionFrac));
    }
    ray.t_max = static_cast<std::uint32_t>(t_max * (1 << contract::kTLimitFrac));
    ray.any = any ? 1 : 0;
    return ray;
  }
};

inline RayState ray_setup(const contract::RayRecord& ray) {
  constexpr double kBeyond = 1e30;
  RayState state;
  for (int axis = 0; axis < 3; ++axis) {
    state.origin[axis] = ray.origin[axis] * (1.0 / (1 << contract::kPositionFrac));
    state.direction[axis] = ray.direction[axis] * (1.0 / (1 << contract::kDirectionFrac));
    state.zero[axis] = ray.direction[axis] == 0;
    state.negative[axis] = ray.direction[axis] < 0;
    state.reciprocal[axis] = state.zero[axis] ? kBeyond : 1.0 / state.direction[axis];
  }
  state.t_max = ray.t_max * (1.0 / (1 << contract::kTLimitFrac));
  state.any = ray.any != 0;
  return state;
}

/// Ray parameter at which the ray crosses `plane` on `axis`.
inline double t_plane(const RayState& ray, int axis, double plane) {
  return (plane - ray.origin[axis]) * ray.reciprocal[axis];
}

}  // namespace retrace::golden
