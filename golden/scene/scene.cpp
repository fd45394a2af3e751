// Node hierarchy of a scene: local and world transforms, reachability. Iterative, so that a deep hierarchy cannot
// exhaust the stack.
#include "golden/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace retrace {

glm::dmat4 Node::local() const {
  if (has_matrix) return matrix;
  return glm::translate(glm::dmat4(1.0), translation) * glm::mat4_cast(rotation) * glm::scale(glm::dmat4(1.0), scale);
}

glm::vec2 TextureTransform::apply(glm::vec2 uv) const {
  const float c = std::cos(rotation), s = std::sin(rotation);
  const glm::vec2 scaled = uv * scale;
  return offset + glm::vec2(c * scaled.x + s * scaled.y, -s * scaled.x + c * scaled.y);
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

std::vector<glm::dmat4> Scene::mesh_transforms() const {
  std::vector<glm::dmat4> world = world_transforms();
  for (std::size_t node = 0; node < nodes.size(); ++node)
    if (nodes[node].mesh_frame) world[node] = *nodes[node].mesh_frame;
  return world;
}

}  // namespace retrace
