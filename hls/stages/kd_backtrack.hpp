// kd_backtrack: one step up the parent links.
//   The parent is where to turn if its axis is the exit face's axis, its split equals the face's plane as an integer, and we are its
//   near child; then go down from its far child. Otherwise go on from the parent; past the root the ray has left the scene.
// No arithmetic, only comparisons: this replaces the box test that Foley & Sugerman make in every node.
// Counterparts: golden/engine/stages/kd_backtrack.hpp, rtl/walk/rt_kd_backtrack.sv. Source: Lee 2007, section 3; Foley & Sugerman 2005, section 3.2.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

inline kd_backtrack_out_record kd_backtrack(const kd_backtrack_in_record& in) {
  RT_INLINE
  const axis_t axis = in.face >> 1;
  const flag_t upper =
      in.face;  // low bit: we leave through an upper side, moving up the axis, so the near child is the left one
  const flag_t right = in.node;
  kd_backtrack_out_record out;
  out.bad = in.parent_axis == contract::kAxisLeaf;
  out.matched = in.parent_axis == axis && in.parent_split == in.plane && right != upper;
  out.finished = !out.matched && in.parent == 0;
  out.node = in.parent;
  if (out.matched) {
    out.node = in.parent_child;
    out.node <<= 1;
    const node_index_t side = upper;
    out.node |= side;
  }
  return out;
}

}  // namespace retrace::hls
