// instance_enter: a ray of the world becomes a ray of an instance's object, or passes its box by.
//   S_i = sum m_ij o_j + b_i,  D_i = sum m_ij d_j                         exact, units 2^-55 and 2^-57
//   L = max_i (e_i + size D_i) - 57,  X_i = floor(D_i 2^(e_i - L - 5)),  g_i: upper bound of |X_i| in units of 2^-9
//   k = L + [sum g_i^2 > 2^18],  A_i = X_i >> (1 + k - L) with 51 fraction bits: its length lies in [0.498, 1]
//   d'_i = round(A_i 2^-25);  reciprocals as in ray_setup
//   s = max(0, max_i (e_i + size S_i) - 56)
//   slabs of the object's box, scaled by 2^-s and grown by slab_pad, on floor(S_i 2^(e_i - 31 - s)): near, far
//   q = max(0, floor(16 near 2^s));  o'_i = round((S_i 2^e_i + q A_i) 2^-31);  t_max = (reach << k) - 1 - (q << 20)
// size x: the bits of x without its sign. Entered if near <= far, far >= 0, q fits its format, t_max >= 0. 18 multiplications of 32 x 27 bits,
// 6 of 27 x 27, 3 of 24 x 52. Rounded once a ray and instance, never by the leaf it comes from; bounds: docs/error-bounds.md.
// Counterparts: golden/engine/stages/instance_enter.hpp, rtl/isect/rt_instance_enter.sv. Source: Wald et al. 2003; Schmittler et al. 2004.
#pragma once
#include "../include/arithmetic.hpp"
#include "ray_setup.hpp"

namespace retrace::hls {

static const int kInstanceSumBits = 60;  // three products of 32 x 27 bits and the offset: any record, any ray
static const int kInstanceSizeBits = 7;  // of a size and an exponent
static const int kLongBits = 52;         // A
static const int kLongFrac = 51;
static const int kBoundBits = 9;  // fraction bits of g
static const int kPlaceUnit = contract::kInstanceCoefficientFrac + contract::kPositionFrac;
static const int kCourseUnit = contract::kInstanceCoefficientFrac + contract::kDirectionFrac;
static const int kStepShift = contract::kTFrac - contract::kEntryStartFrac;
static const int kSlabBits = contract::kTBits + 1;  // t of a slab: the longest way into a box is 10.5

typedef ap_int<kInstanceSumBits> instance_sum_t;
typedef ap_uint<kInstanceSizeBits> instance_size_t;
typedef ap_int<kLongBits> long_direction_t;
typedef ap_int<kSlabBits> slab_t;

// Bits without the sign, as a priority encoder.
inline instance_size_t size_of(const instance_sum_t& value) {
  RT_INLINE
  const flag_t negative = value < 0;
  instance_size_t size = 0;
ENCODE:
  for (int bit = 0; bit < kInstanceSumBits - 1; ++bit) {
    RT_UNROLL
    const flag_t set = value[bit];
    if (set != negative) size = bit + 1;
  }
  return size;
}

// row . point, exact, on top of `offset`.
inline instance_sum_t instance_row(const instance_coefficient_t row[3], const ap_int<contract::kPositionBits> point[3],
                                   const instance_sum_t& offset) {
  RT_INLINE
  instance_sum_t sum = offset;
TERMS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    instance_sum_t product = row[i];
    product *= point[i];
    sum += product;
  }
  return sum;
}

// As t_plane, with a range twice as large.
inline slab_t slab_plane(const position_t& plane, const position_t& origin, const reciprocal_t& reciprocal,
                         const recip_shift_t& shift) {
  RT_INLINE
  const position_t distance = plane - origin;
  product_t t = multiply(distance, reciprocal);
  t >>= shift;
  const product_t highest = (1LL << (kSlabBits - 1)) - 1;
  const product_t lowest = -(1LL << (kSlabBits - 1));
  if (t > highest) t = highest;
  if (t < lowest) t = lowest;
  return slab_t(t);
}

inline instance_enter_out_record instance_enter(const instance_enter_in_record& in) {
  RT_INLINE
  // S and D, their sizes.
  instance_sum_t place[3], course[3];
  instance_size_t place_size = 0, course_size = 0;
  flag_t bad = 0;
ROWS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    instance_sum_t offset = in.b[i];
    offset <<= contract::kPositionFrac;
    const instance_sum_t no_offset = 0;
    const instance_coefficient_t row[3] = {in.m[3 * i], in.m[3 * i + 1], in.m[3 * i + 2]};
    place[i] = instance_row(row, in.origin, offset);
    course[i] = instance_row(row, in.direction, no_offset);
    instance_size_t size = size_of(place[i]);
    size += in.e[i];
    if (size > place_size) place_size = size;
    size = size_of(course[i]);
    size += in.e[i];
    if (size > course_size) course_size = size;
    if (in.e[i] > contract::kRowExponentMax) bad = 1;
  }
  if (course_size < kCourseUnit - 1 || course_size > kCourseUnit + contract::kEntryScaleMax) bad = 1;
  instance_size_t spread = 0;
  if (place_size > kPlaceUnit + 1) {
    spread = place_size;
    spread -= kPlaceUnit + 1;
  }
  if (spread > contract::kEntrySpreadMax) {
    bad = 1;
    spread = 0;
  }

  // X, and whether k is L or L + 1.
  ap_int<kLongBits + 1> fine[3];
  ap_uint<2 * kBoundBits + 3> squares = 0;
NORM:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    // course_size - e is at least 41 in a record that is not bad, and at least the size of D in any.
    ap_uint<6> down = course_size;
    down -= in.e[i];
    down -= kCourseUnit - 1 - contract::kRowExponentMax;
    ap_int<kInstanceSumBits + 11> wide = course[i];
    wide <<= kLongFrac + 1 - (kCourseUnit - 1 - contract::kRowExponentMax);
    wide >>= down;
    fine[i] = wide;
    const ap_int<kBoundBits + 1> coarse = fine[i] >> (kLongFrac + 1 - kBoundBits);
    ap_uint<kBoundBits + 1> bound = coarse;
    if (coarse < 0) bound = -1 - coarse;
    bound += 1;
    ap_uint<2 * kBoundBits + 3> square = bound;
    square *= bound;
    squares += square;
  }
  const flag_t longer = squares > (1 << (2 * kBoundBits));
  ap_int<kInstanceSizeBits + 1> scale = course_size;
  scale -= kCourseUnit;
  if (longer) scale += 1;
  if (scale < 0 || scale > contract::kEntryScaleMax) bad = 1;
  const entry_scale_t k = scale;

  // A, d', its reciprocals, the slabs.
  instance_enter_out_record out;
  long_direction_t along[3];
  slab_t near = -(1LL << (kSlabBits - 1));
  slab_t far = (1LL << (kSlabBits - 1)) - 1;
  flag_t outside = 0;
SLABS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<kLongBits + 1> halved = fine[i] >> 1;
    if (longer) halved >>= 1;
    along[i] = halved;
    long_direction_t rounded = along[i];
    rounded += 1 << (kLongFrac - contract::kDirectionFrac - 1);
    rounded >>= kLongFrac - contract::kDirectionFrac;
    const direction_t d = rounded;
    const axis_reciprocal ray = reciprocal_of(d);
    instance_size_t down = kPlaceUnit - contract::kPositionFrac;
    down += spread;
    down -= in.e[i];
    const position_t at = place[i] >> down;
    position_t lower = in.box[2 * i];
    position_t upper = in.box[2 * i + 1];
    lower <<= contract::kPositionFrac - contract::kBoxFaceFrac;
    upper <<= contract::kPositionFrac - contract::kBoxFaceFrac;
    lower >>= spread;
    upper >>= spread;
    lower -= contract::kSlabPad;
    upper += contract::kSlabPad;
    const position_t first = ray.negative ? upper : lower;
    const position_t last = ray.negative ? lower : upper;
    const slab_t enter = slab_plane(first, at, ray.reciprocal, ray.shift);
    const slab_t leave = slab_plane(last, at, ray.reciprocal, ray.shift);
    if (ray.zero) {
      if (at < lower || at > upper) outside = 1;
    } else {
      if (enter > near) near = enter;
      if (leave < far) far = leave;
    }
    out.direction[i] = d;
    out.reciprocal[i] = ray.reciprocal;
    out.shift[i] = ray.shift;
    out.zero[i] = ray.zero;
    out.negative[i] = ray.negative;
  }

  // q, o', what is left of the reach.
  ap_uint<kSlabBits + contract::kEntrySpreadMax> way = 0;
  if (near >= 0) way = near;
  way <<= spread;
  way >>= kStepShift;
  const entry_start_t start = way;
  ap_uint<contract::kTReachBits + contract::kEntryScaleMax> reach = in.reach;
  reach <<= k;
  ap_uint<contract::kEntryStartBits + kStepShift> behind = start;
  behind <<= kStepShift;
  const flag_t near_enough = behind < reach;
  ap_uint<contract::kTReachBits + contract::kEntryScaleMax> left = reach;
  left -= behind;
  left -= 1;
  const flag_t enters =
      !bad && !outside && near <= far && far >= 0 && (way >> contract::kEntryStartBits) == 0 && near_enough;
  out.t_max = (1U << contract::kTLimitBits) - 1;
  if ((left >> contract::kTLimitBits) == 0) out.t_max = left;
ORIGINS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<kInstanceSumBits + contract::kRowExponentMax> sum = place[i];
    sum <<= in.e[i];
    ap_int<kInstanceSumBits + contract::kRowExponentMax> step = along[i];
    step *= start;
    sum += step;
    sum += 1LL << (kPlaceUnit - contract::kPositionFrac - 1);
    sum >>= kPlaceUnit - contract::kPositionFrac;
    out.origin[i] = position_t(sum);
  }
  out.scale = k;
  out.start = start;
  out.enters = enters;
  out.bad = bad;
  if (!enters) {
  CLEAR:
    for (int i = 0; i < 3; ++i) {
      RT_UNROLL
      out.origin[i] = 0;
      out.direction[i] = 0;
      out.reciprocal[i] = 0;
      out.shift[i] = 0;
      out.zero[i] = 0;
      out.negative[i] = 0;
    }
    out.t_max = 0;
    out.scale = 0;
    out.start = 0;
  }
  return out;
}

// t in the world of a hit at t in the object. It fits where the hit counts: it is below the entry's reach.
inline t_limit_t world_t(const t_limit_t& t, const entry_start_t& start, const entry_scale_t& scale) {
  RT_INLINE
  ap_uint<contract::kEntryStartBits + kStepShift + 1> sum = start;
  sum <<= kStepShift;
  sum += t;
  sum >>= scale;
  return t_limit_t(sum);
}

}  // namespace retrace::hls
