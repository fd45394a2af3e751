// ray_setup: reciprocals of the direction, and whether the ray can be traced.
//   per axis, D = |direction code|:  R = min(floor(2^52 / (D << e)), 2^26 - 1) with the sign of the direction, D << e in [2^26, 2^27)
//                                    shift = 26 - e, so that (s - o) / d = (s - o) * R / 2^shift
// A direction of zero is legal: that axis never exits. Origins outside the root box and zero directions are marked invalid.
// Error: R is below 2^52 / (D << e) by less than 1, a relative 2^-25 of t (docs/error-bounds.md).
// Counterparts: golden/engine/stages/ray_setup.hpp, rtl/ray/rt_ray_setup.sv. Source: Lee 2007, section 3; Amanatides & Woo 1987.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

static const int kMagnitudeBits = contract::kDirectionBits;  // |direction| reaches 2^26

// Leading zeros of a magnitude in 27 bits, as a priority encoder; 26 for 1, and 26 for 0 as well.
inline recip_shift_t leading_zeros(const ap_uint<kMagnitudeBits>& magnitude) {
  RT_INLINE
  recip_shift_t zeros = kMagnitudeBits - 1;
ENCODE:
  for (int bit = 0; bit < kMagnitudeBits; ++bit) {
    RT_UNROLL
    if (magnitude[bit]) zeros = kMagnitudeBits - 1 - bit;
  }
  return zeros;
}

struct axis_reciprocal {
  reciprocal_t reciprocal;
  recip_shift_t shift;
  flag_t zero;
  flag_t negative;
};

inline axis_reciprocal reciprocal_of(const direction_t& d) {
  RT_INLINE
  const flag_t negative = d < 0;
  const flag_t zero = d == 0;
  ap_uint<kMagnitudeBits> magnitude = d;
  if (negative) magnitude = -d;
  const recip_shift_t zeros = leading_zeros(magnitude);
  ap_uint<kMagnitudeBits> normalised = magnitude;
  normalised <<= zeros;
  if (zero) normalised = 1 << (kMagnitudeBits - 1);
  const ap_uint<2 * kMagnitudeBits - 1> numerator = 1LL << (2 * (kMagnitudeBits - 1));
  const ap_uint<2 * kMagnitudeBits - 1> quotient = numerator / normalised;
  reciprocal_t reciprocal = (1 << (contract::kReciprocalBits - 1)) - 1;
  if (quotient < (1 << (contract::kReciprocalBits - 1))) reciprocal = quotient;
  if (negative) reciprocal = -reciprocal;
  if (zero) reciprocal = 0;
  recip_shift_t shift = kMagnitudeBits - 1;
  shift -= zeros;
  axis_reciprocal out;
  out.reciprocal = reciprocal;
  out.shift = shift;
  out.zero = zero;
  out.negative = negative;
  return out;
}

inline ray_setup_out_record ray_setup(const ray_setup_in_record& in) {
  RT_INLINE
  ray_setup_out_record out;
  flag_t inside = 1;
  flag_t moves = 0;
AXES:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    const direction_t d = in.direction[axis];
    const axis_reciprocal ray = reciprocal_of(d);
    out.origin[axis] = in.origin[axis];
    out.direction[axis] = d;
    out.reciprocal[axis] = ray.reciprocal;
    out.shift[axis] = ray.shift;
    out.zero[axis] = ray.zero;
    out.negative[axis] = ray.negative;
    if (in.origin[axis] < in.box[2 * axis] || in.origin[axis] > in.box[2 * axis + 1]) inside = 0;
    if (!ray.zero) moves = 1;
  }
  out.t_max = in.t_max;
  out.any = in.any;
  out.valid = inside & moves;
  return out;
}

}  // namespace retrace::hls
