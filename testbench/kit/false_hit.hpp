// Proof, in integers, that a hit which brute force reports and a walk does not is one that only the tolerance of tri_test makes, and that the
// walk had no cell in which to find it:
//   1. the ray passes outside the triangle, or the triangle lies behind its origin, and by no more than the certified bound;
//   2. no leaf that the walk visited lists the triangle, and none of their cells touches it (separating axes);
//   3. the ray passes no cell whose leaf lists it, up to where it is hit.
// 1 makes it a false hit, 2 and 3 say why it is seen by brute force alone. What lacks a part of the proof is a fault of walk, tree or test.
// In a scene of two levels 2 and 3 may hold for the top level instead: with the instance for the triangle, and its box for what it touches.
// Bounds: docs/error-bounds.md, "False hits".
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "golden/scene/geometry.hpp"
#include "golden/tree/memory_image.hpp"
#include "two_level_walk.hpp"

namespace retrace {

/// The range of codes between two faces on each axis, by face.
using Cell = std::array<std::int32_t, 6>;

/// Do the closed triangle and the closed cell have a point in common?
bool touches(const GridTriangle& triangle, const Cell& cell);

/// Does the ray have a point in the closed cell at 0 <= t <= t_end (code)?
bool passes(const contract::RayRecord& ray, const Cell& cell, std::uint32_t t_end);

enum class FalseHit : std::uint8_t {
  kProved,
  kTrueHit,     ///< the ray meets the triangle
  kBeyondBand,  ///< it passes farther outside than the test is bound to
  kListed,      ///< a visited leaf lists the triangle
  kNotListed,   ///< a visited cell touches the triangle, and its leaf does not list it
  kPassedBy,    ///< the ray passes a cell whose leaf lists it, and the walk was not there
};
const char* to_string(FalseHit verdict);

/// Part 1. `unit_direction`: bands are those of a ray of the world, which divide by |d|; else by 1, as for the ray of an instance's object.
FalseHit outside_within_band(const contract::RayRecord& ray, const GridTriangle& triangle, bool unit_direction);

/// All three parts, for the tree of one level; `t` is where brute force has the hit, `visits` what walk_one_level() visited.
FalseHit prove_false_hit(const GridScene& scene, const MemoryImage& image, const contract::RayRecord& ray,
                         std::uint32_t id, std::uint32_t t, std::span<const std::uint32_t> visits);

/// And for two levels; `top` says whether it was the top level in whose cells the walk did not meet the instance.
FalseHit prove_false_hit(std::span<const GridScene> objects, const TwoLevelScene& scene, const contract::RayRecord& ray,
                         const TwoLevelHit& hit, const TwoLevelVisits& visits, bool& top);

}  // namespace retrace
