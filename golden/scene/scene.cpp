// Node hierarchy of a scene: local and world transforms, reachability. Iterative, so that a deep hierarchy cannot
// exhaust the stack.
#include "golden/scene/scene.hpp"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

namespace retrace {

glm::dmat4 Node::local() const {
  if (has_matrix) return matrix;
  return glm::translate(glm::dmat4(1.0), translation) * glm::mat4_cast(rotation) * glm::scale(glm::dmat4(1.0), scale);
}

std::vector<std::uint32_t> Scene::reachable() const {
  std::vector<std::uint32_t> order, pending(roots.rbegin(), roots.rend());
  std::vector<bool> seen(nodes.size(), false);
  while (!pending.empty()) {
    const std::uint32_t node = pending.back();
    pending.pop_back();
    if (node >= nodes.size() || seen[node]) continue;  // a scene made by hand may name a node twice
    seen[node] = true;
    order.push_back(node);
    pending.insert(pending.end(), nodes[node].children.rbegin(), nodes[node].children.rend());
  }
  return order;
}

std::vector<glm::dmat4> Scene::world_transforms() const {
  std::vector<glm::dmat4> world(nodes.size(), glm::dmat4(1.0));
  std::vector<bool> done(nodes.size(), false);
  for (const std::uint32_t node : reachable()) {
    const std::uint32_t parent = nodes[node].parent;
    const bool below = parent < nodes.size() && done[parent];
    world[node] = below ? world[parent] * nodes[node].local() : nodes[node].local();
    done[node] = true;
  }
  return world;
}

}  // namespace retrace
