// hit_finish: barycentric coordinates of the best hit, once a ray.
//   u = U 2^eu / d'z, rounded toward zero and saturated to [0, 1]; v likewise. Anything but status_hit gives an empty record.
// Two exact divisions. Counterparts: golden/engine/stages/hit_finish.hpp, rtl/isect/rt_hit_finish.sv. Source: Woop et al. 2005, section 3.2.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

static const int kBarycentricNumeratorBits = contract::kRowDirectionBits + contract::kBarycentricFrac + 1;

// floor(edge * 2^(exponent - bias) / dz) in UQ1.24: U has 24 more fraction bits than d'z, as many as the quotient wants.
inline barycentric_t barycentric(const edge_t& edge, const exponent_t& exponent, const row_direction_t& dz) {
  RT_INLINE
  const barycentric_t one = 1 << contract::kBarycentricFrac;
  if (edge <= 0) return barycentric_t(0);
  ap_uint<kBarycentricNumeratorBits + 1> limit = dz;  // quotients from here on saturate
  limit <<= contract::kBarycentricFrac + contract::kExponentBias;
  if (exponent >= kBarycentricNumeratorBits) return one;
  const ap_uint<6> room = ap_uint<6>(kBarycentricNumeratorBits) - exponent;
  edge_t lost = edge;
  lost >>= room;
  if (lost != 0) return one;
  ap_uint<kBarycentricNumeratorBits + 1> numerator = edge;
  numerator <<= exponent;
  if (numerator >= limit) return one;
  ap_uint<contract::kRowDirectionBits + 1> denominator = dz;
  denominator <<= contract::kExponentBias;
  return barycentric_t(numerator / denominator);
}

inline hit_record hit_finish(const hit_finish_in_record& in) {
  RT_INLINE
  hit_record out;
  out.status = in.status;
  out.reserved = 0;
  out.t = 0;
  out.id = contract::kNoTriangle;
  out.u = 0;
  out.v = 0;
  if (in.status == contract::kStatusHit) {
    out.t = in.t;
    out.id = in.id;
    out.u = barycentric(in.edge_u, in.exponent_u, in.dz);
    out.v = barycentric(in.edge_v, in.exponent_v, in.dz);
  }
  return out;
}

}  // namespace retrace::hls
