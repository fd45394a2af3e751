// What a memory image holds, counted.
#include <algorithm>

#include "kd_builder.hpp"
#include "memory_image_walk.hpp"

namespace retrace {

ImageStatistics describe(const MemoryImage& tree) {
  constexpr std::size_t kLeafSizes = 17;
  const contract::HeaderRecord& h = tree.header();
  const BuildOptions costs;
  ImageStatistics s;
  s.triangles = h.triangle_count;
  s.depth_histogram.resize(std::size_t{h.max_depth} + 1);
  s.leaf_size_histogram.resize(kLeafSizes);
  const auto area = [](const image::Cell& cell) {
    const double x = cell.bound[1] - cell.bound[0], y = cell.bound[3] - cell.bound[2],
                 z = cell.bound[5] - cell.bound[4];
    return x * y + y * z + z * x;
  };
  double total = 0, root_area = 0;
  image::walk(
      tree,
      [&](std::uint32_t node, const image::Side&, const image::Cell& cell) {
        ++s.interior;
        if (node == 0) root_area = area(cell);
        total += costs.traversal_cost * area(cell);
      },
      [&](std::uint32_t node, const image::Side& side, const image::Cell& cell) {
        const std::uint32_t count = tree.leaf(side.child).count;
        ++s.leaves;
        s.empty_leaves += count == 0;
        s.references += count;
        s.max_leaf = std::max(s.max_leaf, count);
        s.max_depth = std::max(s.max_depth, cell.depth);
        ++s.depth_histogram[cell.depth];
        ++s.leaf_size_histogram[std::min<std::size_t>(count, kLeafSizes - 1)];
        if (node == 0) root_area = area(cell);
        total += costs.intersection_cost * count * area(cell);
      });
  s.nodes = s.interior + s.leaves;
  s.sah_cost = total / root_area;
  s.references_per_triangle = s.triangles ? static_cast<double>(s.references) / static_cast<double>(s.triangles) : 0.0;
  s.references_per_leaf = static_cast<double>(s.references) / static_cast<double>(s.leaves);
  s.bytes = tree.bytes();
  s.pair_bytes = std::size_t{h.pair_count} * contract::kNodePairBytes;
  s.leaf_bytes = std::size_t{h.leaf_count} * contract::kLeafBytes;
  s.list_bytes = std::size_t{h.list_count} * 4;
  s.triangle_bytes = std::size_t{h.triangle_count} * contract::kTriangleBytes;
  return s;
}

}  // namespace retrace
