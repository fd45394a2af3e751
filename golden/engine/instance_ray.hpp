// What instance_enter is given, and the ray that it makes.
#pragma once
#include <cmath>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace {

/// `reach`: the limit of t in the world, exclusive.
inline contract::InstanceEnterInRecord instance_enter_in(const contract::InstanceRecord& instance,
                                                         const contract::RayRecord& ray, std::uint32_t reach) {
  contract::InstanceEnterInRecord in;
  in.m = instance.m;
  in.b = instance.b;
  in.e = instance.e;
  in.box = instance.box;
  in.origin = ray.origin;
  in.direction = ray.direction;
  in.reach = reach;
  return in;
}

/// The ray of the object: exact from here on.
inline contract::RayRecord object_ray(const contract::InstanceEnterOutRecord& entry) {
  contract::RayRecord ray;
  ray.origin = entry.origin;
  ray.direction = entry.direction;
  ray.t_max = entry.t_max;
  return ray;
}

/// t in the world, grid units, of a t in the object, without the rounding of the codes.
inline double world_t(double t, const contract::InstanceEnterOutRecord& entry) {
  return std::ldexp(std::ldexp(static_cast<double>(entry.start), -contract::kEntryStartFrac) + t,
                    -static_cast<int>(entry.scale));
}

}  // namespace retrace
