// The numbers of the shader unit: sign, 8 bits of exponent, 23 bits of fraction, as integer functions.
//   Rounding   to nearest, ties to even, once per operation (float_mad: twice, float_dot: once per product and sum).
//   Range      no subnormals: a result that rounds below 2^-126 is a zero of its sign; an exponent field of 0 reads as zero.
//              No infinity, no NaN: a result beyond the greatest number becomes it; an exponent field of 255 reads as the greatest number.
//   Products of zero, sums of zero: IEEE 754's signs. 1 / 0 is the greatest number of its sign; 1 / sqrt of 0 or of a negative number the greatest.
// Counterparts: golden/shader/float.hpp (host doubles, rounded once), rtl/shader/rt_float_*.sv.
#pragma once
#include "../include/pragmas.hpp"
#include "isa.hpp"

#include <ap_int.h>

namespace retrace::hls {

static const int kFloatBits = shader::kExponentBits + shader::kFractionBits + 1;
static const int kSignificandBits = shader::kFractionBits + 1;
static const int kExponentMax = (1 << shader::kExponentBits) - 2;  // of a number
static const int kExponentBias = (1 << (shader::kExponentBits - 1)) - 1;
static const int kGuardBits = 3;  // below the significand of a sum: two and a sticky one

typedef ap_uint<kFloatBits> float_t;
typedef ap_uint<kSignificandBits> significand_t;
typedef ap_uint<kSignificandBits + 1> rounded_t;
typedef ap_int<shader::kExponentBits + 3> float_exponent_t;
typedef ap_uint<2 * kSignificandBits> significand_product_t;
typedef ap_uint<kSignificandBits + kGuardBits + 1> significand_sum_t;

struct float_parts {
  ap_uint<1> negative;
  float_exponent_t exponent;  // biased
  significand_t significand;  // with its leading 1; 0 for zero
};

inline float_parts float_read(const float_t& x) {
  RT_INLINE
  float_parts parts;
  const ap_uint<shader::kExponentBits> exponent = x.range(kFloatBits - 2, shader::kFractionBits);
  const ap_uint<shader::kFractionBits> fraction = x.range(shader::kFractionBits - 1, 0);
  parts.negative = x[kFloatBits - 1];
  parts.exponent = exponent;
  parts.significand = fraction;
  parts.significand[shader::kFractionBits] = 1;
  if (exponent == 0) parts.significand = 0;
  if (exponent > kExponentMax) {
    parts.exponent = kExponentMax;
    parts.significand = (1 << kSignificandBits) - 1;
  }
  return parts;
}

inline float_t float_join(const ap_uint<1>& negative, const ap_uint<shader::kExponentBits>& exponent,
                          const ap_uint<shader::kFractionBits>& fraction) {
  RT_INLINE
  float_t x = 0;
  x.range(shader::kFractionBits - 1, 0) = fraction;
  x.range(kFloatBits - 2, shader::kFractionBits) = exponent;
  x[kFloatBits - 1] = negative;
  return x;
}

inline float_t float_greatest(const ap_uint<1>& negative) {
  RT_INLINE
  return float_join(negative, kExponentMax, (1 << shader::kFractionBits) - 1);
}

static const unsigned kFloatOne = unsigned(kExponentBias) << shader::kFractionBits;

// Rounds significand (leading 1 in its top bit), the bit below it and whether anything is below that; carries, flushes, saturates.
inline float_t float_round(const ap_uint<1>& negative, const float_exponent_t& exponent,
                           const significand_t& significand, const ap_uint<1>& half, const ap_uint<1>& rest) {
  RT_INLINE
  rounded_t rounded = significand;
  if (half == 1 && (rest == 1 || significand[0] == 1)) rounded += 1;
  float_exponent_t final = exponent;
  if (rounded[kSignificandBits] == 1) {
    rounded >>= 1;
    final += 1;
  }
  float_t x =
      float_join(negative, final.range(shader::kExponentBits - 1, 0), rounded.range(shader::kFractionBits - 1, 0));
  if (final <= 0) x = float_join(negative, 0, 0);
  if (final > kExponentMax) x = float_greatest(negative);
  return x;
}

// What is in the number's place: exponent fields of 0 and 255 become zero and the greatest number.
inline float_t float_canonical(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  float_t y = x;
  if (p.significand == 0) y = float_join(p.negative, 0, 0);
  if (x.range(kFloatBits - 2, shader::kFractionBits) > kExponentMax) y = float_greatest(p.negative);
  return y;
}

inline float_t float_negate(const float_t& x) {
  RT_INLINE
  float_t y = x;
  y[kFloatBits - 1] = !x[kFloatBits - 1];
  return y;
}

// x times 2^power, power from -1 to 2.
inline float_t float_scale(const float_t& x, const ap_int<3>& power) {
  RT_INLINE
  const float_parts p = float_read(x);
  float_exponent_t exponent = p.exponent;
  exponent += power;
  float_t y = float_round(p.negative, exponent, p.significand, 0, 0);
  if (p.significand == 0) y = float_join(p.negative, 0, 0);
  return y;
}

inline float_t float_mul(const float_t& x, const float_t& y) {
  RT_INLINE
  const float_parts a = float_read(x);
  const float_parts b = float_read(y);
  const ap_uint<1> negative = a.negative ^ b.negative;
  significand_product_t product = a.significand;
  product *= b.significand;
  float_exponent_t exponent = a.exponent;
  exponent += b.exponent;
  exponent -= kExponentBias;
  if (product[2 * kSignificandBits - 1] == 1) {
    exponent += 1;
  } else {
    product <<= 1;
  }
  const significand_t significand = product.range(2 * kSignificandBits - 1, kSignificandBits);
  const ap_uint<kSignificandBits - 1> rest = product.range(kSignificandBits - 2, 0);
  float_t z = float_round(negative, exponent, significand, product[kSignificandBits - 1], rest != 0);
  if (a.significand == 0 || b.significand == 0) z = float_join(negative, 0, 0);
  return z;
}

inline float_t float_add(const float_t& x, const float_t& y) {
  RT_INLINE
  const float_t cx = float_canonical(x);
  const float_t cy = float_canonical(y);
  const ap_uint<kFloatBits - 1> size_x = cx.range(kFloatBits - 2, 0);
  const ap_uint<kFloatBits - 1> size_y = cy.range(kFloatBits - 2, 0);
  float_parts a = float_read(cx);
  float_parts b = float_read(cy);
  if (size_x < size_y) {
    a = float_read(cy);
    b = float_read(cx);
  }
  const ap_uint<1> subtract = a.negative ^ b.negative;
  // The smaller one, aligned; what falls off stays as a sticky bit.
  const float_exponent_t difference = a.exponent - b.exponent;
  significand_sum_t small = b.significand;
  small <<= kGuardBits;
  ap_uint<1> sticky = 0;
ALIGN:
  for (int i = 0; i < shader::kExponentBits; ++i) {
    RT_UNROLL
    if (difference[i] == 1) {
      if ((1 << i) > kSignificandBits + kGuardBits) {
        if (small != 0) sticky = 1;
        small = 0;
      } else {
        significand_sum_t kept = small >> (1 << i);
        kept <<= 1 << i;
        if (kept != small) sticky = 1;
        small >>= 1 << i;
      }
    }
  }
  if (sticky == 1) small[0] = 1;
  significand_sum_t sum = a.significand;
  sum <<= kGuardBits;
  if (subtract == 1) {
    sum -= small;
  } else {
    sum += small;
  }
  float_exponent_t exponent = a.exponent;
  if (sum[kSignificandBits + kGuardBits] == 1) {
    const ap_uint<1> lost = sum[0];
    sum >>= 1;
    if (lost == 1) sum[0] = 1;
    exponent += 1;
  } else {
  NORMALISE:
    for (int i = 4; i >= 0; --i) {
      RT_UNROLL
      const significand_sum_t top = sum >> (kSignificandBits + kGuardBits - (1 << i));
      if (top == 0) {
        sum <<= 1 << i;
        exponent -= 1 << i;
      }
    }
  }
  const significand_t significand = sum.range(kSignificandBits + kGuardBits - 1, kGuardBits);
  const ap_uint<kGuardBits - 1> rest = sum.range(kGuardBits - 2, 0);
  float_t z = float_round(a.negative, exponent, significand, sum[kGuardBits - 1], rest != 0);
  if (sum == 0) z = float_join(a.negative & b.negative, 0, 0);
  return z;
}

inline float_t float_mad(const float_t& x, const float_t& y, const float_t& z) {
  RT_INLINE
  return float_add(float_mul(x, y), z);
}

// (x0 y0 + x1 y1) + (x2 y2 + x3 y3)
inline float_t float_dot(const float_t x[4], const float_t y[4]) {
  RT_INLINE
  const float_t low = float_add(float_mul(x[0], y[0]), float_mul(x[1], y[1]));
  const float_t high = float_add(float_mul(x[2], y[2]), float_mul(x[3], y[3]));
  return float_add(low, high);
}

// A quotient of 26 bits, restoring; its lowest bit is the one to round by: no quotient lies half way.
inline float_t float_rcp(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  ap_uint<kSignificandBits + 2> quotient = 0;
  ap_uint<kSignificandBits + 1> rest = 1;
  rest <<= kSignificandBits - 2;
DIVIDE:
  for (int i = 0; i < kSignificandBits + 2; ++i) {
    RT_UNROLL
    rest <<= 1;
    quotient <<= 1;
    if (rest >= p.significand) {
      rest -= p.significand;
      quotient[0] = 1;
    }
  }
  // 2^48 / significand: 2^25 for a power of two, else between 2^24 and 2^25.
  float_exponent_t exponent = 2 * kExponentBias;
  exponent -= p.exponent;
  if (quotient[kSignificandBits + 1] == 1) {
    quotient >>= 1;
  } else {
    exponent -= 1;
  }
  float_t y = float_round(p.negative, exponent, quotient.range(kSignificandBits, 1), quotient[0], 1);
  if (p.significand == 0) y = float_greatest(p.negative);
  return y;
}

// The largest r with r^2 significand <= 2^73 (odd exponents: 2^72), bit by bit. No root lies half way.
inline float_t float_rsq(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  const ap_uint<1> even = p.exponent[0];       // the bias is odd
  ap_uint<2 * kSignificandBits + 6> rest = 0;  // (2^73 - root^2 significand) / 4^place, below 2 product + significand
  ap_uint<2 * kSignificandBits + 4> product = 0;  // root significand
  ap_uint<kSignificandBits + 2> root = 0;
  rest[kSignificandBits - 4] = !even;
  rest[kSignificandBits - 3] = even;
ROOT:
  for (int i = 0; i < kSignificandBits + 2; ++i) {
    RT_UNROLL
    rest <<= 2;
    ap_uint<2 * kSignificandBits + 6> step = product;
    step <<= 2;
    step += p.significand;
    product <<= 1;
    root <<= 1;
    if (rest >= step) {
      rest -= step;
      product += p.significand;
      root[0] = 1;
    }
  }
  // Half of the exponent, from 2^((bias - exponent) / 2).
  float_exponent_t exponent = 3 * kExponentBias;
  exponent -= p.exponent;
  if (even == 0) exponent += 1;
  exponent >>= 1;
  if (root[kSignificandBits + 1] == 1) {
    root >>= 1;
  } else {
    exponent -= 1;
  }
  float_t y = float_round(0, exponent, root.range(kSignificandBits, 1), root[0], 1);
  if (p.significand == 0 || p.negative == 1) y = float_greatest(0);
  return y;
}

// x - floor(x), below 1.
inline float_t float_frac(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  // The fraction of |x|.
  significand_t fraction = p.significand;
  float_exponent_t exponent = p.exponent;
  const float_exponent_t whole = p.exponent - (kExponentBias - 1);  // bits before the point
  if (whole > 0) {
  DROP:
    for (int i = 0; i < kSignificandBits; ++i) {
      RT_UNROLL
      if (i < whole) fraction[kSignificandBits - 1 - i] = 0;
    }
  }
NORMALISE:
  for (int i = 4; i >= 0; --i) {
    RT_UNROLL
    const significand_t top = fraction >> (kSignificandBits - (1 << i));
    if (top == 0) {
      fraction <<= 1 << i;
      exponent -= 1 << i;
    }
  }
  float_t size =
      float_join(0, exponent.range(shader::kExponentBits - 1, 0), fraction.range(shader::kFractionBits - 1, 0));
  if (fraction == 0) size = 0;
  float_t y = size;
  if (p.negative == 1 && size != 0) y = float_add(kFloatOne, float_negate(size));
  if (y == kFloatOne) y = kFloatOne - 1;
  return y;
}

// Which of the classes of conditions x is in: one bit of four.
inline ap_uint<4> float_class(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  ap_uint<4> in = 1 << shader::kClassFraction;
  if (p.exponent >= kExponentBias) in = 1 << shader::kClassOneUp;
  if (p.negative == 1) in = 1 << shader::kClassNegative;
  if (p.significand == 0) in = 1 << shader::kClassZero;
  return in;
}

// x in [0, 1].
inline float_t float_saturate(const float_t& x) {
  RT_INLINE
  const ap_uint<4> in = float_class(x);
  float_t y = x;
  if (in[shader::kClassNegative] == 1 || in[shader::kClassZero] == 1) y = 0;
  if (in[shader::kClassOneUp] == 1) y = kFloatOne;
  return y;
}

// floor(x) as an index; 2^24 where it is none.
inline ap_uint<shader::kIndexBits + 1> float_index(const float_t& x) {
  RT_INLINE
  const float_parts p = float_read(x);
  const float_exponent_t whole = p.exponent - (kExponentBias - 1);
  ap_uint<shader::kIndexBits + 1> index = p.significand;
SHIFT:
  for (int i = 0; i < kSignificandBits; ++i) {
    RT_UNROLL
    if (i >= whole) index >>= 1;
  }
  if (p.significand != 0 && (p.negative == 1 || whole > shader::kIndexBits)) {
    index = 0;
    index[shader::kIndexBits] = 1;
  }
  return index;
}

// An index as a number, exact.
inline float_t float_from_index(const ap_uint<shader::kIndexBits>& index) {
  RT_INLINE
  significand_t significand = index;
  float_exponent_t exponent = kExponentBias + kSignificandBits - 1;
NORMALISE:
  for (int i = 4; i >= 0; --i) {
    RT_UNROLL
    const significand_t top = significand >> (kSignificandBits - (1 << i));
    if (top == 0) {
      significand <<= 1 << i;
      exponent -= 1 << i;
    }
  }
  float_t x =
      float_join(0, exponent.range(shader::kExponentBits - 1, 0), significand.range(shader::kFractionBits - 1, 0));
  if (index == 0) x = 0;
  return x;
}

}  // namespace retrace::hls
