// instance_enter, golden: a ray of the world becomes a ray of an instance's object.
//
//   S_i = sum m_ij o_j + b_i,  D_i = sum m_ij d_j                         exact, units 2^-55 and 2^-57
//   L = max_i (e_i + size D_i) - 57,  X_i = floor(D_i 2^(e_i - L - 5)),  g_i: upper bound of |X_i| in units of 2^-9
//   k = L + [sum g_i^2 > 2^18]            so that A_i = X_i >> (1 + k - L), unit 2^-51, has a length of at least 0.498 and at most 1
//   d'_i = round(A_i 2^-25);  reciprocals as in ray_setup
//   s = max(0, max_i (e_i + size S_i) - 56)
//   slabs of the object's box, scaled by 2^-s and grown by slab_pad, on floor(S_i 2^(e_i - 31 - s)): near, far
//   q = max(0, floor(16 near 2^s));  o'_i = round((S_i 2^e_i + q A_i) 2^-31)
//   t' = reach' of the object: (reach << k) - 1 - (q << 20)
// size x: the bits of x without its sign. The ray of the object depends on ray and instance alone, is rounded once and exact from then on:
// what holds for a ray through one tree holds for it. In the world a hit at t' lies at (q 2^20 + t') >> k, monotone in t'.
// Exact integers here; transform_exactly() is the same transform in reals, without any rounding. Bounds: docs/error-bounds.md, "instance_enter".
// Counterparts: hls/stages/instance_enter.hpp, rtl/isect/rt_instance_enter.sv. Source: Wald et al. 2003; Schmittler et al. 2004.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

namespace detail {

using Int128 = __int128;

/// Bits of a value without its sign: -2^size <= value < 2^size, and no smaller size will do.
inline int size_of(std::int64_t value) {
  return std::bit_width(static_cast<std::uint64_t>(value < 0 ? ~value : value));
}

/// floor(value 2^-shift); a negative shift multiplies.
inline Int128 scale_down(Int128 value, int shift) {
  return shift >= 0 ? value >> shift : value * (Int128{1} << -shift);
}

struct SlabRay {
  std::int32_t reciprocal = 0;
  unsigned shift = 0;
};

/// 1 / direction as ray_setup has it; the direction is not 0.
inline SlabRay slab_reciprocal(std::int32_t direction) {
  const std::int64_t magnitude = std::abs(std::int64_t{direction});
  const int zeros = contract::kDirectionBits - static_cast<int>(std::bit_width(static_cast<std::uint64_t>(magnitude)));
  const std::int64_t quotient = std::min((std::int64_t{1} << 2 * contract::kDirectionFrac) / (magnitude << zeros),
                                         (std::int64_t{1} << (contract::kReciprocalBits - 1)) - 1);
  return {static_cast<std::int32_t>(direction < 0 ? -quotient : quotient),
          static_cast<unsigned>(contract::kDirectionFrac - zeros)};
}

}  // namespace detail

/// Where a slab is so far away that its t does not fit, it lies here: beyond all that do.
inline constexpr std::int64_t kSlabLimit = std::int64_t{1} << contract::kTBits;

inline contract::InstanceEnterOutRecord instance_enter(const contract::InstanceEnterInRecord& in) {
  using detail::Int128;
  contract::InstanceEnterOutRecord out;
  std::array<std::int64_t, 3> place{}, course{};  // S and D
  int place_size = 0, course_size = 0;
  bool small = true;
  for (std::size_t i = 0; i < 3; ++i) {
    place[i] = in.b[i] * (std::int64_t{1} << contract::kPositionFrac);
    for (std::size_t j = 0; j < 3; ++j) {
      place[i] += std::int64_t{in.m[3 * i + j]} * in.origin[j];
      course[i] += std::int64_t{in.m[3 * i + j]} * in.direction[j];
    }
    const int e = static_cast<int>(in.e[i]);
    small = small && e <= contract::kRowExponentMax;
    place_size = std::max(place_size, e + detail::size_of(place[i]));
    course_size = std::max(course_size, e + detail::size_of(course[i]));
  }
  constexpr int kCourseUnit = contract::kInstanceCoefficientFrac + contract::kDirectionFrac;  // 57
  constexpr int kPlaceUnit = contract::kInstanceCoefficientFrac + contract::kPositionFrac;    // 55
  constexpr int kLongFrac = 51;                                                               // of A
  const int level = course_size - kCourseUnit;
  const int spread = std::max(0, place_size - kPlaceUnit - 1);
  out.bad = 1;
  if (!small || level < -1 || level > contract::kEntryScaleMax || spread > contract::kEntrySpreadMax) return out;

  std::array<std::int64_t, 3> fine{};  // X, then A
  std::int64_t squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    fine[i] = static_cast<std::int64_t>(
        detail::scale_down(course[i], kCourseUnit + level - static_cast<int>(in.e[i]) - kLongFrac - 1));
    const std::int64_t coarse = fine[i] >> (kLongFrac + 1 - 9), bound = (coarse < 0 ? ~coarse : coarse) + 1;
    squares += bound * bound;
  }
  const bool longer = squares > 1 << 18;
  const int scale = level + (longer ? 1 : 0);
  if (scale < 0 || scale > contract::kEntryScaleMax) return out;
  out.bad = 0;

  contract::InstanceEnterOutRecord entry;
  bool outside = false;
  std::int64_t near = -kSlabLimit, far = kSlabLimit - 1;
  for (std::size_t i = 0; i < 3; ++i) {
    fine[i] >>= longer ? 2 : 1;
    const auto d = static_cast<std::int32_t>((fine[i] + (1 << (kLongFrac - contract::kDirectionFrac - 1))) >>
                                             (kLongFrac - contract::kDirectionFrac));
    const auto at = static_cast<std::int64_t>(
        detail::scale_down(place[i], kPlaceUnit - contract::kPositionFrac + spread - static_cast<int>(in.e[i])));
    std::array<std::int64_t, 2> face{};
    for (std::size_t side = 0; side < 2; ++side) {
      const std::int64_t code = in.box[2 * i + side] * (1 << (contract::kPositionFrac - contract::kBoxFaceFrac));
      face[side] = (code >> spread) + (side == 0 ? -contract::kSlabPad : contract::kSlabPad);
    }
    entry.direction[i] = d;
    entry.zero[i] = d == 0;
    entry.negative[i] = d < 0;
    if (d == 0) {
      outside = outside || at < face[0] || at > face[1];
      continue;
    }
    const detail::SlabRay ray = detail::slab_reciprocal(d);
    entry.reciprocal[i] = ray.reciprocal;
    entry.shift[i] = ray.shift;
    const auto plane = [&](std::size_t side) {
      return std::clamp((face[side] - at) * ray.reciprocal >> ray.shift, -kSlabLimit, kSlabLimit - 1);
    };
    near = std::max(near, plane(d < 0 ? 1 : 0));
    far = std::min(far, plane(d < 0 ? 0 : 1));
  }
  const std::int64_t start = near < 0 ? 0 : (near << spread) >> (contract::kTFrac - contract::kEntryStartFrac);
  const std::int64_t limit =
      (std::int64_t{in.reach} << scale) - 1 - (start << (contract::kTFrac - contract::kEntryStartFrac));
  if (outside || near > far || far < 0 || start >> contract::kEntryStartBits != 0 || limit < 0) return out;
  for (std::size_t i = 0; i < 3; ++i) {
    const Int128 sum = (Int128{place[i]} << in.e[i]) + Int128{start} * fine[i];
    constexpr int kShift = kPlaceUnit - contract::kPositionFrac;
    const auto code = static_cast<std::uint64_t>((sum + (Int128{1} << (kShift - 1))) >> kShift);
    entry.origin[i] = static_cast<std::int32_t>(contract::detail::sign_extend(code, contract::kPositionBits));
  }
  entry.t_max = static_cast<std::uint32_t>(std::min(limit, (std::int64_t{1} << contract::kTLimitBits) - 1));
  entry.scale = static_cast<std::uint32_t>(scale);
  entry.start = static_cast<std::uint32_t>(start);
  entry.enters = 1;
  return entry;
}

/// t in the world of a hit at t in the object.
inline std::uint32_t world_t(std::uint32_t t, std::uint32_t start, std::uint32_t scale) {
  return static_cast<std::uint32_t>(((std::uint64_t{start} << (contract::kTFrac - contract::kEntryStartFrac)) + t) >>
                                    scale);
}

/// The instance's transform of a point (offset) or a direction (no offset) given as codes, in reals.
inline std::array<long double, 3> transform_exactly(const contract::InstanceEnterInRecord& in,
                                                    const std::array<std::int32_t, 3>& codes, int frac, bool offset) {
  std::array<long double, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) {
    long double sum = offset ? std::ldexp(static_cast<long double>(in.b[i]), -contract::kInstanceOffsetFrac) : 0.0L;
    for (std::size_t j = 0; j < 3; ++j)
      sum += std::ldexp(static_cast<long double>(std::int64_t{in.m[3 * i + j]} * codes[j]),
                        -contract::kInstanceCoefficientFrac - frac);
    result[i] = std::ldexp(sum, static_cast<int>(in.e[i]));
  }
  return result;
}

}  // namespace retrace::golden
