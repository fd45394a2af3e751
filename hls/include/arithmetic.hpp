// The arithmetic that several stages share: exact products, distance to an axis-aligned plane, products with a triangle row.
// Counterparts: rtl/, golden/engine/stages. Certified bounds: docs/error-bounds.md.
#pragma once
#include "contract_types.hpp"
#include "pragmas.hpp"

namespace retrace::hls {

typedef ap_int<2 * contract::kPositionBits> product_t;      // exact product of two 27-bit codes
typedef ap_int<2 * contract::kPositionBits + 4> row_sum_t;  // three products, an offset and a rounding constant
static const int kRowShift = contract::kCoefficientFrac;    // both row sums lose the fraction bits of the coefficient
static const int kOffsetShift = contract::kCoefficientFrac + contract::kPositionFrac - contract::kOffsetFrac;

// Exact product. Written with *= because open ap_int headers form a product of two n-bit numbers 2n x 2n bits wide.
inline product_t multiply(const ap_int<contract::kPositionBits>& a, const ap_int<contract::kPositionBits>& b) {
  RT_INLINE
  product_t product = a;
  product *= b;
  return product;
}

// t_plane = floor((plane - origin) * reciprocal / 2^shift), saturated to the format of t. Monotone in `plane`.
// plane - origin wraps for codes outside [-1, 1], which no checked image holds.
inline t_t t_plane(const position_t& plane, const position_t& origin, const reciprocal_t& reciprocal,
                   const recip_shift_t& shift) {
  RT_INLINE
  const position_t distance = plane - origin;
  product_t t = multiply(distance, reciprocal);
  t >>= shift;
  const product_t highest = (1LL << (contract::kTBits - 1)) - 1;
  const product_t lowest = -(1LL << (contract::kTBits - 1));
  if (t > highest) t = highest;
  if (t < lowest) t = lowest;
  return t_t(t);
}

// row . point + offset, rounded to nearest, ties up, wrapped to the row's 27 bits. `offset` is aligned to the product's fraction.
inline ap_int<contract::kRowPositionBits> row_product(const coefficient_t row[3],
                                                      const ap_int<contract::kPositionBits> point[3],
                                                      const row_sum_t& offset) {
  RT_INLINE
  const product_t x = multiply(row[0], point[0]);
  const product_t y = multiply(row[1], point[1]);
  const product_t z = multiply(row[2], point[2]);
  row_sum_t sum = 1LL << (kRowShift - 1);
  sum += offset;
  sum += x;
  sum += y;
  sum += z;
  sum >>= kRowShift;
  return ap_int<contract::kRowPositionBits>(sum);
}

}  // namespace retrace::hls
