// kd_descend: one interior node on the way down.
//   near if t < t_plane(split), else far; a tie goes far. A direction of zero: near (left) if origin < split.
//   The near child is the left one, or the right one if the direction is negative.
// One multiplication. Counterparts: golden/engine/stages/kd_descend.hpp, rtl/walk/rt_kd_descend.sv.
// Source: Lee 2007, section 3; Foley & Sugerman 2005, section 3.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

inline kd_descend_out_record kd_descend(const kd_descend_in_record& in) {
  RT_INLINE
  const t_t plane = t_plane(in.split, in.origin, in.reciprocal, in.shift);
  flag_t near = in.t < plane;
  if (in.zero) near = in.origin < in.split;
  const node_index_t side = near == in.negative ? 1 : 0;
  kd_descend_out_record out;
  out.node = in.child;
  out.node <<= 1;
  out.node |= side;
  return out;
}

}  // namespace retrace::hls
