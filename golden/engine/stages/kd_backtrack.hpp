// kd_backtrack, golden: is this parent the place to turn? Planes are compared as integers, as everywhere.
// Counterparts: hls/stages/kd_backtrack.hpp, rtl/walk/rt_kd_backtrack.sv. Source: Lee 2007, section 3; Foley & Sugerman 2005, section 3.2.
#pragma once
#include <cstdint>

namespace retrace::golden {

/// `node` is where we are, `parent_axis` and `parent_split` (a code) belong to its parent; `plane` is the code of the exit face.
inline bool kd_backtrack(int face, std::int32_t plane, std::uint32_t node, int parent_axis, std::int32_t parent_split) {
  const bool right = node & 1u, upper = face & 1;
  return parent_axis == face / 2 && parent_split == plane && right != upper;
}

}  // namespace retrace::golden
