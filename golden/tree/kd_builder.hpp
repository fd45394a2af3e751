// kd-tree with the surface area heuristic (MacDonald & Booth 1990), perfect splits, O(N log N) (Wald & Havran 2006), parallel on
// oneTBB, deterministic for any number of threads. Emits the memory image.
#pragma once
#include <functional>

#include "golden/scene/geometry.hpp"
#include "memory_image.hpp"

namespace retrace {

/// The deepest tree that is built.
inline constexpr int kMaxTreeDepth = 192;

struct BuildOptions {
  enum class Split { kSah, kSpatialMedian, kObjectMedian };
  Split split = Split::kSah;
  double traversal_cost = 1.0;           ///< cost of an interior step
  double intersection_cost = 0.75;       ///< cost of a triangle test (measured choice, see docs/memory-image.md)
  double empty_bonus = 0.9;              ///< factor on the cost of a split that cuts off empty space
  bool clip = true;                      ///< triangles to their cells; false: a triangle counts as its bounding box
  int max_depth = 0;                     ///< 0: 6 + 1.2 log2(N) (measured choice); kMaxTreeDepth at most
  double budget = 16;                    ///< splits and duplicated references, at most, in multiples of N
  std::function<void(double)> progress;  ///< fraction done, from any thread; may be empty
};

/// What a build did, for tests of its complexity. All counts are the same for any number of threads, unless `limited`:
/// how far the first pass comes then depends on the order of its nodes.
struct BuildWork {
  std::uint64_t candidates = 0;    ///< ends of bounds that were weighed as a split
  std::uint64_t moved_events = 0;  ///< ends of bounds that were handed from a node to its children
  std::uint64_t clipped = 0;       ///< triangles clipped to a cell
  bool limited = false;            ///< the budget was exceeded; the tree is that of the second pass
};

/// Builds the image of a snapped scene. A triangle is referenced from every leaf whose box, widened by kWiden, it touches
/// (docs/memory-image.md). Throws Error when an index type is too small.
/// The tree has at most budget * N splits, and at most N + budget * N references, together N + budget * N.
MemoryImage build_kd(const GridScene& scene, const BuildOptions& options = {}, BuildWork* counters = nullptr);

/// Coefficients of the unit-triangle test for one triangle. `order` receives the file index (0..2) of the record's vertices 0, 1, 2:
/// vertex 0 has the smallest height, vertex 2 the largest (ties: by the file's order), so u belongs to order[1] and v to order[2].
contract::TriangleRecord make_unit_triangle(const GridTriangle& triangle, std::array<int, 3>* order = nullptr);

}  // namespace retrace
