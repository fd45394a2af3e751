// tri_test: unit-triangle test without a division until something is hit.
//   o' = M o + m,  d' = M d; signs flipped so that d'z > 0; o'z must be <= 0
//   U = o'u d'z - o'z d'u,  V = o'v d'z - o'z d'v,  W = (d'z >> eu) - U - (V >> (eu - ev))
//   hit if -eps_uv <= U <= (d'z >> eu) + eps_uv, -eps_uv <= V <= (d'z >> ev) + eps_uv, W >= -eps_w;  t = floor(-o'z /
//   d'z)
// The upper bounds follow from the lower ones but for the tolerance: without them the three strips of width eps beside
// the edges of a needle would meet far beyond its tips. 22 multiplications of 27 x 27 bits and one exact division. The
// error of U, V, W is below their eps for every checked image and every ray from inside the box, also at grazing
// angles, so that no ray slips between two triangles that share an edge: docs/error-bounds.md. Counterparts:
// golden/engine/stages/tri_test.hpp, rtl/isect/rt_tri_test.sv. Source: Arenberg 1988; Woop 2004 and Woop et al. 2005,
// section 3.2 (unit triangle); Schmittler et al. 2004 (transformation unit).
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

inline tri_test_out_record tri_test(const tri_test_in_record& in) {
  RT_INLINE
  row_sum_t offset_u = in.offset_u;
  row_sum_t offset_v = in.offset_v;
  row_sum_t offset_n = in.offset_n;
  offset_u <<= kOffsetShift;
  offset_v <<= kOffsetShift;
  offset_n <<= kOffsetShift;
  const row_sum_t no_offset = 0;
  const row_position_t origin_u = row_product(in.u, in.origin, offset_u);
  const row_position_t origin_v = row_product(in.v, in.origin, offset_v);
  row_position_t origin_z = row_product(in.n, in.origin, offset_n);
  const row_direction_t direction_u = row_product(in.u, in.direction, no_offset);
  const row_direction_t direction_v = row_product(in.v, in.direction, no_offset);
  row_direction_t direction_z = row_product(in.n, in.direction, no_offset);
  if (direction_z < 0) {
    direction_z = -direction_z;
    origin_z = -origin_z;
  }

  edge_t edge_u = multiply(origin_u, direction_z);
  edge_u -= multiply(origin_z, direction_u);
  edge_t edge_v = multiply(origin_v, direction_z);
  edge_v -= multiply(origin_z, direction_v);

  exponent_t difference = in.exponent_u;
  difference -= in.exponent_v;
  edge_t aligned_v = edge_v;
  aligned_v >>= difference;
  edge_sum_t one_u = direction_z;  // U and V where u and v are 1
  one_u <<= contract::kPositionFrac + contract::kExponentBias;
  edge_sum_t one_v = one_u;
  one_u >>= in.exponent_u;
  one_v >>= in.exponent_v;
  edge_sum_t edge_w = one_u;
  edge_w -= edge_u;
  edge_w -= aligned_v;

  const edge_t lowest_uv = -contract::kEpsUv;
  edge_sum_t highest_u = contract::kEpsUv;
  edge_sum_t highest_v = contract::kEpsUv;
  highest_u += one_u;
  highest_v += one_v;
  const edge_sum_t lowest_w = -contract::kEpsW;
  ap_uint<contract::kRowPositionBits> height = 0;     // -o'z, where it counts
  ap_uint<contract::kRowPositionBits + 1> reach = 0;  // 2 d'z: t < 8 as long as -o'z is below it
  flag_t hit = direction_z > 0 && origin_z <= 0 && edge_u >= lowest_uv && edge_v >= lowest_uv && edge_w >= lowest_w &&
               edge_u <= highest_u && edge_v <= highest_v;
  if (hit) {
    height = -origin_z;
    reach = direction_z;
    reach <<= 1;
    hit = height < reach;
  }

  tri_test_out_record out;
  out.hit = hit;
  out.t = 0;
  out.id = in.id;
  out.edge_u = 0;
  out.edge_v = 0;
  out.dz = 0;
  out.exponent_u = 0;
  out.exponent_v = 0;
  if (hit) {
    ap_uint<2 * contract::kRowPositionBits> numerator = height;
    numerator <<= contract::kCoefficientFrac;
    const ap_uint<contract::kRowPositionBits> denominator = direction_z;
    out.t = numerator / denominator;
    out.edge_u = edge_u;
    out.edge_v = edge_v;
    out.dz = direction_z;
    out.exponent_u = in.exponent_u;
    out.exponent_v = in.exponent_v;
  }
  return out;
}

// Does a candidate replace the best hit so far? The nearer one wins, on equal t the lower id.
inline flag_t is_nearer(const t_limit_t& t, const triangle_id_t& id, const t_limit_t& best_t,
                        const triangle_id_t& best_id) {
  RT_INLINE
  return flag_t(t < best_t || (t == best_t && id < best_id));
}

}  // namespace retrace::hls
