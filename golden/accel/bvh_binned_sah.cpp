// I. Wald, On fast construction of SAH-based bounding volume hierarchies, IEEE Interactive Ray Tracing 2007: top-down,
// triangles sorted into bins by centroid, split where the surface area heuristic is least.
//
// Bins may peel off a few triangles at a time. Below a depth of kDeep + 2 log2 N, which no mesh reaches, nodes are cut
// at medians: every level costs O(N), so a build costs O(N log N).
#include <algorithm>
#include <cmath>
#include <numeric>

#include "bvh.hpp"

namespace retrace::accel {
namespace {

constexpr int kBins = 16;
constexpr double kTraversalCost = 1.0, kIntersectionCost = 1.5;  // as the kd builder's defaults
constexpr std::uint32_t kMaxLeaf = 8;
constexpr double kDeep = 64;

class Builder {
 public:
  Builder(const std::vector<Box>& boxes, std::uint32_t max_leaf, BuildSteps& steps)
      : boxes_(boxes), max_leaf_(max_leaf), steps_(steps) {
    const auto deepest =
        static_cast<int>(kDeep + 2.0 * std::log2(static_cast<double>(std::max<std::size_t>(boxes.size(), 1))));
    draft.order.resize(boxes.size());
    std::iota(draft.order.begin(), draft.order.end(), 0u);
    for (const Box& box : boxes) centers_.push_back(box.center());
    draft.nodes.emplace_back();
    std::vector<Task> todo{{0, 0, static_cast<std::uint32_t>(boxes.size()), 0}};
    while (!todo.empty()) {
      const Task task = todo.back();
      todo.pop_back();
      if (task.depth >= deepest) {
        cut_at_medians(draft, task.node, task.first, task.last, centers_, max_leaf, steps);
        continue;
      }
      const std::uint32_t middle = split(task.first, task.last);
      if (middle == task.first) {
        draft.nodes[task.node].first = task.first, draft.nodes[task.node].count = task.last - task.first;
        continue;
      }
      const auto left = static_cast<std::uint32_t>(draft.nodes.size());
      draft.nodes.resize(left + 2);
      draft.nodes[task.node].child = left;
      draft.nodes[left].sibling = left + 1;
      todo.push_back({left + 1, middle, task.last, task.depth + 1});
      todo.push_back({left, task.first, middle, task.depth + 1});
    }
  }
  BvhDraft draft;

 private:
  struct Task {
    std::uint32_t node, first, last;
    int depth;
  };
  struct Bin {
    Box box;
    std::uint32_t count = 0;
  };

  /// Partitions [first, last) and returns the middle, or `first` for a leaf.
  std::uint32_t split(std::uint32_t first, std::uint32_t last) {
    const std::uint32_t count = last - first;
    if (count <= 1) return first;
    steps_.steps += count;
    Box box, centers;
    for (std::uint32_t i = first; i < last; ++i) box.add(boxes_[draft.order[i]]), centers.add(centers_[draft.order[i]]);
    double best_cost = kInfinity;
    int best_axis = -1, best_bin = 0;
    for (int a = 0; a < 3; ++a) {
      if (!(centers.upper[a] > centers.lower[a])) continue;
      std::array<Bin, kBins> bins;
      for (std::uint32_t i = first; i < last; ++i) {
        Bin& bin = bins[bin_of(draft.order[i], a, centers)];
        bin.box.add(boxes_[draft.order[i]]);
        ++bin.count;
      }
      std::array<double, kBins> right{};
      Box sweep;
      std::uint32_t n = 0;
      for (int b = kBins - 1; b > 0; --b) {
        sweep.add(bins[b].box), n += bins[b].count;
        right[b] = n ? n * sweep.half_area() : 0.0;
      }
      sweep = {}, n = 0;
      for (int b = 0; b + 1 < kBins; ++b) {
        sweep.add(bins[b].box), n += bins[b].count;
        if (n == 0 || n == count) continue;
        const double cost = n * sweep.half_area() + right[b + 1];
        if (cost < best_cost) best_cost = cost, best_axis = a, best_bin = b;
      }
    }
    if (best_axis < 0) {  // all centroids coincide
      return count <= max_leaf_ ? first : first + count / 2;
    }
    const double area = box.half_area();
    const double split_cost = 2.0 * kTraversalCost + (area > 0.0 ? kIntersectionCost * best_cost / area : 0.0);
    if (count <= max_leaf_ && split_cost >= kIntersectionCost * count) return first;
    const auto middle = std::partition(draft.order.begin() + first, draft.order.begin() + last,
                                       [&](std::uint32_t t) { return bin_of(t, best_axis, centers) <= best_bin; });
    return static_cast<std::uint32_t>(middle - draft.order.begin());
  }
  int bin_of(std::uint32_t triangle, int axis, const Box& centers) const {
    const double x = (centers_[triangle][axis] - centers.lower[axis]) / (centers.upper[axis] - centers.lower[axis]);
    return std::min(kBins - 1, static_cast<int>(x * kBins));
  }

  const std::vector<Box>& boxes_;
  std::uint32_t max_leaf_;
  BuildSteps& steps_;
  std::vector<glm::dvec3> centers_;
};

}  // namespace

BvhDraft draft_binned_sah(const TriangleSet& set, BuildSteps& steps) {
  std::vector<Box> boxes;
  boxes.reserve(set.triangles.size());
  for (const Triangle& t : set.triangles) boxes.push_back(t.box());
  return draft_binned_sah(boxes, kMaxLeaf, steps);
}

BvhDraft draft_binned_sah(const std::vector<Box>& boxes, std::uint32_t max_leaf, BuildSteps& steps) {
  return Builder(boxes, max_leaf, steps).draft;
}

}  // namespace retrace::accel
