// A tree of a memory image, walked depth first with the cell of each node. For the sources of this folder.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "memory_image.hpp"

namespace retrace::image {

/// One side of a node pair.
struct Side {
  std::int32_t split;
  std::uint32_t axis, child;
  bool leaf() const { return axis == static_cast<std::uint32_t>(contract::kAxisLeaf); }
};
inline Side side_of(const contract::NodePairRecord& pair, bool right) {
  return right ? Side{pair.right_split, pair.right_axis, pair.right_child}
               : Side{pair.left_split, pair.left_axis, pair.left_child};
}

/// Where a walk down the tree stands: the cell of the current node, and by face the far child of the ancestor that made
/// it.
struct Cell {
  std::array<std::int32_t, 6> bound;
  std::array<std::uint32_t, 6> link{};
  std::uint32_t parent = 0, depth = 0;
};

/// Cell of the root of an image: of its one tree, or of the top level.
inline std::array<std::int32_t, 6> root_box(const contract::HeaderRecord& header) {
  std::array<std::int32_t, 6> box;
  for (std::size_t face = 0; face < 6; ++face) box[face] = static_cast<std::int32_t>(header.box[face]);
  return box;
}

/// Walks the tree under `root`, an even node, depth first. `on_interior(node, side, cell)` must throw unless `side.child` is a pair that was not
/// reached before and the split lies inside the cell; `on_leaf(node, side, cell)`. No recursion: the stack undoes what
/// the way down changed.
template <typename OnInterior, typename OnLeaf>
void walk(const MemoryImage& image, std::uint32_t root, const std::array<std::int32_t, 6>& box,
          OnInterior&& on_interior, OnLeaf&& on_leaf) {
  struct Frame {
    std::uint32_t node;
    std::uint32_t parent;     ///< its parent, restored on the way up
    std::int32_t bound;       ///< what the child on the way changed, restored on the way up
    std::uint32_t link : 31;  ///< 24 bits
    std::uint32_t right : 1;  ///< which child is on the way
  };
  std::vector<Frame> stack;
  Cell cell;
  cell.bound = box;
  cell.parent = root;
  std::uint32_t node = root;
  for (;;) {
    for (;;) {
      const Side side = side_of(image.pair(node >> 1), node & 1);
      if (side.leaf()) {
        on_leaf(node, side, cell);
        break;
      }
      on_interior(node, side, cell);
      const int upper = static_cast<int>(2 * side.axis + 1);
      stack.push_back({node, cell.parent, cell.bound[upper], cell.link[upper], 0});
      cell.bound[upper] = side.split;
      cell.link[upper] = 2 * side.child + 1;
      cell.parent = node;
      ++cell.depth;
      node = 2 * side.child;
    }
    for (;;) {
      if (stack.empty()) return;
      Frame& frame = stack.back();
      const Side side = side_of(image.pair(frame.node >> 1), frame.node & 1);
      const int lower = static_cast<int>(2 * side.axis), upper = lower + 1;
      if (frame.right == 0) {
        cell.bound[upper] = frame.bound;
        cell.link[upper] = frame.link;
        frame.bound = cell.bound[lower];
        frame.link = cell.link[lower];
        frame.right = 1;
        cell.bound[lower] = side.split;
        cell.link[lower] = 2 * side.child;
        cell.parent = frame.node;
        node = 2 * side.child + 1;
        break;
      }
      cell.bound[lower] = frame.bound;
      cell.link[lower] = frame.link;
      cell.parent = frame.parent;
      --cell.depth;
      stack.pop_back();
    }
  }
}

}  // namespace retrace::image
