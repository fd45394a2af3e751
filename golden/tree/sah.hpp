// Where to split a node of a kd-tree, apart from the recursion that does it (kd_builder.cpp): the surface area heuristic in one sweep over sorted
// events (MacDonald & Booth 1990; Wald & Havran 2006, section 4.3), and two medians to compare it with.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "kd_builder.hpp"

namespace retrace::kd {

using Box = std::array<std::int32_t, 6>;  ///< by face

/// One end of a triangle's bounds on one axis, as a number that sorts: position, then ends before starts, then the
/// triangle. Ends come first because a triangle that ends at s is not right of it, and one that starts at s not left of
/// it.
using Event = std::uint64_t;
inline constexpr std::uint32_t kEventBias = 1u << 26;
constexpr Event make_event(std::int32_t position, bool start, std::uint32_t reference) {
  return (static_cast<Event>(static_cast<std::uint32_t>(position) + kEventBias) << 33) |
         (static_cast<Event>(start) << 32) | reference;
}
constexpr std::int32_t position_of(Event event) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(event >> 33) - kEventBias);
}
constexpr bool is_start(Event event) { return (event >> 32) & 1; }
constexpr std::uint32_t reference_of(Event event) { return static_cast<std::uint32_t>(event); }
constexpr Event with_reference(Event event, std::uint32_t reference) {
  return (event & ~Event{0xffffffffu}) | reference;
}

inline constexpr std::uint32_t kLeafAxis = contract::kAxisLeaf;

struct SplitChoice {
  double cost = std::numeric_limits<double>::infinity();
  std::uint32_t axis = kLeafAxis;  ///< kLeafAxis: no split
  std::int32_t position = 0;
};

// `sorted` holds the events of a node's triangles on `axis`, two a triangle, ascending. A split costs one unit of `allowance`, and one more for each
// triangle that stands on both sides.

/// The best split on one axis, of those that the allowance can pay for.
SplitChoice sah_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance,
                      const BuildOptions& options);
/// The middle of the box; no split for few triangles, where it lies on a side of the box, where it mostly duplicates triangles (coincident ones never
/// part), or where it costs more than the allowance.
SplitChoice spatial_median_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance);
/// The same at the median of the ends of the triangles' bounds.
SplitChoice object_median_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance);

int widest_axis(const Box& box);

}  // namespace retrace::kd
