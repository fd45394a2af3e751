// shadow: the ray from a hit towards the light.
//   origin = floor(o + (t - min(t, 2^-12)) d + 1/2) on the grid, wrapped; direction = light, no component below -(1 - 2^-12)
//   passed by where the light is 0, or the origin lies outside of the root box on some axis and the direction does not lead back
// Counterparts: golden/engine/stages/shadow.hpp, rtl/ray/rt_shadow.sv.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

inline raster_out_record shadow(const raster_out_record& ray, const t_limit_t& t, const frame_record& frame,
                                const position_t box[6]) {
  RT_INLINE
  t_limit_t along = 0;
  if (t > contract::kShadowBack) along = t - contract::kShadowBack;
  raster_out_record out;
  out.pixel = ray.pixel;
  out.bad = 0;
  out.scale = 0;
  out.start = 0;
  flag_t passes = frame.light[0] == 0 && frame.light[1] == 0 && frame.light[2] == 0;
  position_t origin[3];
  direction_t direction[3];
AXES:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<contract::kTLimitBits + contract::kDirectionBits + 2> way = ray.direction[i];
    way *= along;
    way += 1 << (contract::kDirectionFrac - 1);
    way >>= contract::kDirectionFrac;
    way += ray.origin[i];
    origin[i] = way;
    direction[i] = frame.light[i];
    if (frame.light[i] == -(1 << contract::kNormalFrac)) direction[i] = 1 - (1 << contract::kNormalFrac);
    direction[i] <<= contract::kDirectionFrac - contract::kNormalFrac;
    if (origin[i] < box[2 * i] && direction[i] <= 0) passes = 1;
    if (origin[i] > box[2 * i + 1] && direction[i] >= 0) passes = 1;
  }
  out.enters = !passes;
  out.t_max = 0;
  if (!passes) out.t_max = (1 << contract::kTLimitBits) - 1;
AXES_OUT:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    out.origin[i] = 0;
    out.direction[i] = 0;
    if (!passes) {
      out.origin[i] = origin[i];
      out.direction[i] = direction[i];
    }
  }
  return out;
}

}  // namespace retrace::hls
