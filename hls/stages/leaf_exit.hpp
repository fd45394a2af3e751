// leaf_exit: where a ray leaves a leaf's cell.
//   (t_exit, face) = min over the axes of t_plane(bound on the exit side); the lowest axis wins a tie; axes of direction zero do not exit.
// Three multiplications. `broken` says t_exit < t: a walk over a checked image never shows it, a corrupt one ends in an error.
// Counterparts: golden/engine/stages/leaf_exit.hpp, rtl/leaf/rt_leaf_exit.sv. Source: Lee 2007, section 3; Kay & Kajiya 1986 (slabs).
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

inline leaf_exit_out_record leaf_exit(const leaf_exit_in_record& in) {
  RT_INLINE
  leaf_exit_out_record out;
  out.t_exit = 0;
  out.face = 0;
  out.plane = 0;
  out.exits = 0;
AXES:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    const flag_t upper = !in.negative[axis];
    position_t plane = in.bound[2 * axis];
    if (upper) plane = in.bound[2 * axis + 1];
    const t_t t = t_plane(plane, in.origin[axis], in.reciprocal[axis], in.shift[axis]);
    if (!in.zero[axis] && (!out.exits || t < out.t_exit)) {
      out.t_exit = t;
      out.face = 2 * axis;
      out.face += upper;
      out.plane = plane;
      out.exits = 1;
    }
  }
  out.broken = out.exits && out.t_exit < in.t;
  return out;
}

}  // namespace retrace::hls
