// Quantisation of rays: entry into the root box, unit direction, codes of the number contract.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine.hpp"

namespace retrace {
namespace {

constexpr double kPositionUnit = 1.0 / (1 << contract::kPositionFrac);

/// A product with it is exact, as std::ldexp is, and no call.
constexpr double power_of_two(int exponent) { return static_cast<double>(std::int64_t{1} << exponent); }

std::int32_t round_code(double value, int frac, std::int64_t low, std::int64_t high) {
  const double code = std::floor(value * power_of_two(frac) + 0.5);
  return static_cast<std::int32_t>(std::clamp(code, static_cast<double>(low), static_cast<double>(high)));
}

}  // namespace

GridRay quantise(const WorldRay& ray, const GridTransform& transform, const std::array<std::int32_t, 6>& box,
                 bool any) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(ray.origin[axis] + ray.center[axis])) throw Error("ray: origin is not finite");
    if (!std::isfinite(ray.direction[axis])) throw Error("ray: direction is not finite");
  }
  if (std::isnan(ray.t_min) || std::isnan(ray.t_max)) throw Error("ray: t_min or t_max is not a number");
  // Dividing by the largest component first keeps the length of very long and very short directions finite.
  const double largest = std::max({std::abs(ray.direction.x), std::abs(ray.direction.y), std::abs(ray.direction.z)});
  if (largest == 0.0) throw Error("ray: direction is zero");
  const glm::dvec3 scaled = ray.direction / largest;
  const double scaled_length = glm::length(scaled);
  const glm::dvec3 unit = scaled / scaled_length;
  const double length = scaled_length * largest * transform.scale;  // grid units per unit of t
  if (!std::isfinite(length) || length < std::numeric_limits<double>::min())
    throw Error("ray: the length of the direction is out of range");

  const glm::dvec3 origin =
      ray.center == transform.center ? ray.origin * transform.scale : transform.to_grid(ray.origin + ray.center);
  double enter = ray.t_min * length, leave = ray.t_max * length;
  bool outside = !(enter <= leave);
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box[2 * axis] * kPositionUnit, high = box[2 * axis + 1] * kPositionUnit;
    if (unit[axis] == 0.0) {
      outside = outside || origin[axis] < low || origin[axis] > high;
      continue;
    }
    const double a = (low - origin[axis]) / unit[axis], b = (high - origin[axis]) / unit[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  outside = outside || !(enter <= leave);

  GridRay result;
  result.outside = outside;
  result.t_scale = 1.0 / length;
  result.record.any = any ? 1 : 0;
  if (outside) return result;
  result.t_base = enter / length;
  constexpr std::int64_t kUnit = std::int64_t{1} << contract::kDirectionFrac;
  for (int axis = 0; axis < 3; ++axis) {
    result.record.origin[axis] =
        round_code(origin[axis] + enter * unit[axis], contract::kPositionFrac, box[2 * axis], box[2 * axis + 1]);
    result.record.direction[axis] = round_code(unit[axis], contract::kDirectionFrac, -kUnit, kUnit - 1);
  }
  constexpr double kLimit = static_cast<double>((std::int64_t{1} << contract::kTLimitBits) - 1);
  const double room = std::floor((ray.t_max * length - enter) * power_of_two(contract::kTLimitFrac));
  result.record.t_max = static_cast<std::uint32_t>(std::clamp(room, 0.0, kLimit));
  return result;
}

}  // namespace retrace
