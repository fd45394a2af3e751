// What a memory image holds, counted.
#include <algorithm>
#include <map>

#include "kd_builder.hpp"
#include "memory_image_layout.hpp"
#include "memory_image_walk.hpp"

namespace retrace {

namespace {

constexpr std::size_t kLeafSizes = 17;

double area(const std::array<std::int32_t, 6>& bound) {
  const double x = bound[1] - bound[0], y = bound[3] - bound[2], z = bound[5] - bound[4];
  return x * y + y * z + z * x;
}

/// Adds the tree under `root` to the counts. `cost_of(reference)`: of what a leaf refers to. Returns the heuristic's cost of the tree.
template <typename Cost>
double add_tree(const MemoryImage& image, std::uint32_t root, const std::array<std::int32_t, 6>& box, Cost cost_of,
                ImageStatistics& s) {
  const BuildOptions costs;
  double total = 0;
  image::walk(
      image, root, box,
      [&](std::uint32_t, const image::Side&, const image::Cell& cell) {
        ++s.interior;
        total += costs.traversal_cost * area(cell.bound);
      },
      [&](std::uint32_t, const image::Side& side, const image::Cell& cell) {
        const auto leaf = image.leaf(side.child);
        ++s.leaves;
        s.empty_leaves += leaf.count == 0;
        s.references += leaf.count;
        s.max_leaf = std::max(s.max_leaf, leaf.count);
        s.max_depth = std::max(s.max_depth, cell.depth);
        if (s.depth_histogram.size() <= cell.depth) s.depth_histogram.resize(std::size_t{cell.depth} + 1);
        ++s.depth_histogram[cell.depth];
        ++s.leaf_size_histogram[std::min<std::size_t>(leaf.count, kLeafSizes - 1)];
        total += cost_of(leaf) * area(cell.bound);
      });
  return total / area(box);
}

}  // namespace

ImageStatistics describe(const MemoryImage& tree) {
  const contract::HeaderRecord& h = tree.header();
  const BuildOptions costs;
  ImageStatistics s;
  s.triangles = h.triangle_count;
  s.instances = h.instance_count;
  s.leaf_size_histogram.resize(kLeafSizes);
  s.depth_histogram.resize(std::size_t{h.max_depth} + 1);
  const auto tests = [&](const contract::LeafRecord& leaf) { return costs.intersection_cost * leaf.count; };
  if (!tree.two_levels()) {
    s.sah_cost = add_tree(tree, 0, image::root_box(h), tests, s);
  } else {
    struct Object {
      double cost = 0;
      std::uint64_t triangles = 0;
    };
    std::map<std::uint32_t, Object> objects;
    std::vector<double> cost(h.instance_count);
    for (std::uint32_t i = 0; i < h.instance_count; ++i) {
      const std::uint32_t root = tree.instance(i).root;
      const auto [found, fresh] = objects.try_emplace(root);
      if (fresh) {
        std::vector<std::uint32_t> named;
        const auto count = [&](const contract::LeafRecord& leaf) {
          for (std::uint32_t r = 0; r < leaf.count; ++r) named.push_back(tree.reference(leaf, r));
          return tests(leaf);
        };
        found->second.cost = add_tree(tree, 2 * root, image::outermost_box(tree, root), count, s);
        std::sort(named.begin(), named.end());
        found->second.triangles = static_cast<std::uint64_t>(std::unique(named.begin(), named.end()) - named.begin());
      }
      cost[i] = found->second.cost;
      s.instanced_triangles += found->second.triangles;
    }
    s.objects = objects.size();
    const std::uint64_t below = s.references;
    const auto entries = [&](const contract::LeafRecord& leaf) {
      double sum = 0;
      for (std::uint32_t r = 0; r < leaf.count; ++r) sum += cost[tree.reference(leaf, r)];
      return sum;
    };
    s.sah_cost = add_tree(tree, 0, image::root_box(h), entries, s);
    s.instance_references = s.references - below;
  }
  s.nodes = s.interior + s.leaves;
  const auto triangle_references = static_cast<double>(s.references - s.instance_references);
  s.references_per_triangle = s.triangles ? triangle_references / static_cast<double>(s.triangles) : 0.0;
  s.references_per_leaf = static_cast<double>(s.references) / static_cast<double>(s.leaves);
  s.bytes = tree.bytes();
  s.pair_bytes = std::size_t{h.pair_count} * contract::kNodePairBytes;
  s.leaf_bytes = std::size_t{h.leaf_count} * contract::kLeafBytes;
  s.list_bytes = std::size_t{h.list_count} * 4;
  s.triangle_bytes = std::size_t{h.triangle_count} * contract::kTriangleBytes;
  s.instance_bytes = std::size_t{h.instance_count} * contract::kInstanceBytes;
  return s;
}

}  // namespace retrace
