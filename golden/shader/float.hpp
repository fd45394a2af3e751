// The numbers of the shader unit on the host: each operation in doubles, exact or so close that rounding to 24 bits gives what rounding the exact
// value gives, then rounded once.
//   add, multiply, reciprocal   a double has at least 2 x 24 + 2 bits, so rounding twice is rounding once (Figueroa 1995)
//   reciprocal root             no argument's root is as close to a place half way as the double's error; the test goes through all of them
// Counterparts: hls/shader/float.hpp, which has the definition of the format, rtl/shader/rt_float_*.sv.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hls/shader/isa.hpp"

namespace retrace::golden {

inline constexpr float kGreatest = std::numeric_limits<float>::max();
inline constexpr double kLeast = 0x1p-126;

/// To 24 bits, ties to even; below the least number zero, beyond the greatest the greatest.
inline float float_round(double exact) {
  const double size = std::abs(exact);
  if (size >= kGreatest) return std::copysign(kGreatest, static_cast<float>(std::copysign(1.0, exact)));
  if (size < kLeast) return static_cast<float>(std::copysign(size < kLeast * (1 - 0x1p-25) ? 0.0 : kLeast, exact));
  return static_cast<float>(exact);
}

/// A number from its bits, and back.
inline float float_read(std::uint32_t bits) {
  const std::uint32_t exponent = bits >> shader::kFractionBits & ((1u << shader::kExponentBits) - 1);
  const float sign = bits >> 31 ? -1.0f : 1.0f;
  if (exponent == 0) return std::copysign(0.0f, sign);
  if (exponent == (1u << shader::kExponentBits) - 1) return sign * kGreatest;
  return std::bit_cast<float>(bits);
}
inline std::uint32_t float_bits(float x) { return std::bit_cast<std::uint32_t>(x); }

inline float float_mul(float x, float y) { return float_round(static_cast<double>(x) * y); }
inline float float_add(float x, float y) { return float_round(static_cast<double>(x) + y); }
inline float float_mad(float x, float y, float z) { return float_add(float_mul(x, y), z); }
inline float float_dot(const float* x, const float* y) {
  return float_add(float_add(float_mul(x[0], y[0]), float_mul(x[1], y[1])),
                   float_add(float_mul(x[2], y[2]), float_mul(x[3], y[3])));
}
inline float float_rcp(float x) { return x == 0 ? std::copysign(kGreatest, x) : float_round(1.0 / x); }
inline float float_rsq(float x) { return x <= 0 ? kGreatest : float_round(1.0 / std::sqrt(static_cast<double>(x))); }
inline float float_frac(float x) {
  const float fraction = float_round(static_cast<double>(x) - std::floor(static_cast<double>(x)));
  return fraction >= 1 ? 1 - 0x1p-24f : fraction;
}
inline float float_scale(float x, int power) { return float_round(std::ldexp(static_cast<double>(x), power)); }
inline float float_saturate(float x) { return x >= 1 ? 1.0f : x > 0 ? x : 0.0f; }
/// Which of the classes of conditions x is in: one bit of four.
inline unsigned float_class(float x) {
  return 1u << (x < 0    ? shader::kClassNegative
                : x == 0 ? shader::kClassZero
                : x < 1  ? shader::kClassFraction
                         : shader::kClassOneUp);
}
/// floor(x) as an index; 2^24 where it is none.
inline std::uint32_t float_index(float x) {
  constexpr std::uint32_t kNone = 1u << shader::kIndexBits;
  return x < 0 || x >= static_cast<float>(kNone) ? kNone : static_cast<std::uint32_t>(x);
}
inline float float_from_index(std::uint32_t index) { return static_cast<float>(index); }

}  // namespace retrace::golden
