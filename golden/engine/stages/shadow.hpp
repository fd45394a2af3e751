// shadow, golden: the ray from a hit towards the light. Exact integers.
//   origin = floor(o + (t - min(t, 2^-12)) d + 1/2) on the grid, wrapped; direction = light, no component below -(1 - 2^-12); t_max = all of it
//   passed by where the light is 0, or the origin lies outside of the root box on some axis and the direction does not lead back (raster)
// The origin lies before the surface that is hit: where the light is behind it the ray meets that surface, and otherwise nothing of it.
// Counterparts: hls/stages/shadow.hpp, rtl/ray/rt_shadow.sv.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

inline contract::RasterOutRecord shadow(const contract::RasterOutRecord& ray, std::uint32_t t,
                                        const contract::FrameRecord& frame, const std::array<std::int32_t, 6>& box) {
  contract::RasterOutRecord out;
  out.pixel = ray.pixel;
  const std::int64_t along = t - std::min<std::uint32_t>(t, contract::kShadowBack);
  constexpr std::int64_t kHalf = std::int64_t{1} << (contract::kDirectionFrac - 1);
  constexpr int kWrap = 32 - contract::kPositionBits;
  std::array<std::int32_t, 3> origin{}, direction{};
  bool passes = true;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t moved = ray.origin[a] + ((along * ray.direction[a] + kHalf) >> contract::kDirectionFrac);
    origin[a] = static_cast<std::int32_t>(static_cast<std::uint32_t>(moved) << kWrap) >> kWrap;
    direction[a] = std::max(frame.light[a], -((1 << contract::kNormalFrac) - 1)) *
                   (1 << (contract::kDirectionFrac - contract::kNormalFrac));
    if (direction[a] != 0) passes = false;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (origin[a] < box[2 * a] && direction[a] <= 0) passes = true;
    if (origin[a] > box[2 * a + 1] && direction[a] >= 0) passes = true;
  }
  if (passes) return out;
  out.enters = 1;
  out.origin = origin;
  out.direction = direction;
  out.t_max = (1u << contract::kTLimitBits) - 1;
  return out;
}

}  // namespace retrace::golden
