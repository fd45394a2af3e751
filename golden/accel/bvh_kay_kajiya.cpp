// T. Kay, J. Kajiya, Ray tracing complex scenes, SIGGRAPH 1986, section 3: top-down median cut. The triangles are
// halved by their centres along x, the halves along y, then z, then x again, down to one triangle a leaf.
#include <algorithm>
#include <numeric>

#include "bvh.hpp"

namespace retrace::accel {

BvhDraft draft_kay_kajiya(const TriangleSet& set) {
  struct Task {
    std::uint32_t node, first, last;
    int axis;
  };
  BvhDraft draft;
  draft.order.resize(set.triangles.size());
  std::iota(draft.order.begin(), draft.order.end(), 0u);
  std::vector<glm::dvec3> centers;
  for (const Triangle& t : set.triangles) centers.push_back(t.box().center());
  draft.nodes.emplace_back();
  std::vector<Task> todo{{0, 0, static_cast<std::uint32_t>(set.triangles.size()), 0}};
  while (!todo.empty()) {
    const Task task = todo.back();
    todo.pop_back();
    if (task.last - task.first <= 1) {
      draft.nodes[task.node].first = task.first, draft.nodes[task.node].count = task.last - task.first;
      continue;
    }
    const std::uint32_t middle = task.first + (task.last - task.first) / 2;
    const auto begin = draft.order.begin();
    std::nth_element(begin + task.first, begin + middle, begin + task.last, [&](std::uint32_t a, std::uint32_t b) {
      return centers[a][task.axis] < centers[b][task.axis] || (centers[a][task.axis] == centers[b][task.axis] && a < b);
    });
    const auto left = static_cast<std::uint32_t>(draft.nodes.size());
    draft.nodes.resize(left + 2);
    draft.nodes[task.node].child = left;
    draft.nodes[left].sibling = left + 1;
    todo.push_back({left + 1, middle, task.last, (task.axis + 1) % 3});
    todo.push_back({left, task.first, middle, (task.axis + 1) % 3});
  }
  return draft;
}

}  // namespace retrace::accel
