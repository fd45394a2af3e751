// T. Kay, J. Kajiya, Ray tracing complex scenes, SIGGRAPH 1986, section 3: top-down median cut. The triangles are
// halved by their centres along x, the halves along y, then z, then x again, down to one triangle a leaf.
#include <algorithm>
#include <numeric>

#include "bvh.hpp"

namespace retrace::accel {

void cut_at_medians(BvhDraft& draft, std::uint32_t node, std::uint32_t first, std::uint32_t last,
                    const std::vector<glm::dvec3>& centers, std::uint32_t max_leaf, BuildSteps& steps) {
  struct Task {
    std::uint32_t node, first, last;
    int axis;
  };
  std::vector<Task> todo{{node, first, last, 0}};
  while (!todo.empty()) {
    const Task task = todo.back();
    todo.pop_back();
    if (task.last - task.first <= max_leaf) {
      draft.nodes[task.node].first = task.first, draft.nodes[task.node].count = task.last - task.first;
      continue;
    }
    steps.steps += task.last - task.first;
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
}

BvhDraft draft_kay_kajiya(const TriangleSet& set, BuildSteps& steps) {
  BvhDraft draft;
  draft.order.resize(set.triangles.size());
  std::iota(draft.order.begin(), draft.order.end(), 0u);
  std::vector<glm::dvec3> centers;
  for (const Triangle& t : set.triangles) centers.push_back(t.box().center());
  draft.nodes.emplace_back();
  cut_at_medians(draft, 0, 0, static_cast<std::uint32_t>(set.triangles.size()), centers, 1, steps);
  return draft;
}

}  // namespace retrace::accel
