#include "golden/tree/instanced_scene.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "golden/scene/bounds.hpp"
#include "golden/tree/instance.hpp"
#include "golden/tree/two_level_scene.hpp"
#include "hls/include/contract.hpp"

namespace retrace {
namespace {

/// The boxes of all instances, padded twice over, stay inside the world.
constexpr double kWorldReach = 1.0 - 0x1p-12;
constexpr double kFinest = 0x1p14;

std::size_t triangle_count(const Mesh& mesh) {
  std::size_t count = 0;
  for (const Primitive& primitive : mesh.primitives) count += primitive.triangles.size();
  return count;
}

/// A node that shows triangles.
struct Shown {
  std::uint32_t node, mesh, first_id;
};

std::vector<Shown> shown_by(const Scene& scene) {
  std::vector<Shown> shown;
  std::uint64_t first_id = 0;
  for (const std::uint32_t node : scene.reachable()) {
    const std::uint32_t mesh = scene.nodes[node].mesh;
    if (mesh >= scene.meshes.size()) continue;
    const std::size_t count = triangle_count(scene.meshes[mesh]);
    if (count == 0) continue;
    shown.push_back({node, mesh, static_cast<std::uint32_t>(first_id)});
    first_id += count;
    if (first_id >= contract::kNoTriangle) throw Error(scene.name + ": 2^32 instanced triangles or more");
  }
  return shown;
}

/// The mesh's triangles, numbered as flatten() numbers those of a node; moved by `place`.
WorldTriangles triangles_of(const Mesh& mesh, const glm::dmat4& place) {
  WorldTriangles triangles;
  triangles.vertices.reserve(triangle_count(mesh));
  for (const Primitive& primitive : mesh.primitives) {
    for (const glm::uvec3& corners : primitive.triangles) {
      auto& vertices = triangles.vertices.emplace_back();
      for (int c = 0; c < 3; ++c)
        vertices[static_cast<std::size_t>(c)] =
            glm::dvec3(place * glm::dvec4(glm::dvec3(primitive.positions[corners[c]]), 1.0));
    }
  }
  return triangles;
}

/// Where the root box of an object lies.
void enclose(Bounds& bounds, const GridScene& object, const glm::dmat4& place) {
  bounds.add_corners(object.box, [&](const glm::dvec3& corner) {
    return glm::dvec3(place * glm::dvec4(object.transform.to_world(corner), 1.0));
  });
}

bool finite(const glm::dmat4& m) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      if (!std::isfinite(m[column][row])) return false;
  return true;
}

/// From the grid of the object to that of the world.
Placement placement_of(const GridTransform& object, const GridTransform& world, const glm::dmat4& place) {
  Placement result;
  result.linear = glm::dmat3(place) * (world.scale / object.scale);
  result.offset = world.to_grid(glm::dvec3(place * glm::dvec4(object.center, 1.0)));
  return result;
}

}  // namespace

bool has_instances(const Scene& scene) {
  std::set<std::uint32_t> meshes;
  std::size_t held = 0, instanced = 0;
  for (const Shown& one : shown_by(scene)) {
    const std::size_t count = triangle_count(scene.meshes[one.mesh]);
    instanced += count;
    if (meshes.insert(one.mesh).second) held += count;
  }
  return instanced > 0 && instanced >= 2 * held;
}

InstancedScene::InstancedScene(const Scene& scene, double side) : side_(side) {
  grid_.two_levels = true;
  place(scene, [](std::uint32_t) { return true; });
}

std::vector<std::uint32_t> InstancedScene::update(const Scene& scene,
                                                  const std::function<bool(std::uint32_t)>& deforms) {
  place(scene, deforms);
  return changed_;
}

void InstancedScene::place(const Scene& scene, const std::function<bool(std::uint32_t)>& deforms) {
  const std::vector<Shown> shown = shown_by(scene);
  const std::vector<glm::dmat4> places = scene.mesh_transforms();
  // Grids go back to where they are found by their keys.
  for (std::size_t i = 0; i < keys_.size(); ++i) held_[keys_[i]].grid = std::move(grid_.objects[i]);
  const std::vector<Key> before = std::exchange(keys_, {});
  grid_.objects.clear();
  grid_.instances.clear();
  std::set<Key> fresh;

  Bounds bounds;
  for (const Shown& one : shown) {
    const glm::dmat4& matrix = places[one.node];
    if (!finite(matrix))
      throw Error(scene.name + ": node " + std::to_string(one.node) + ": its place in the world is not finite");
    const Key key{one.mesh};
    const auto [held, first] = held_.try_emplace(key);
    if (first || (deforms(one.node) && !fresh.contains(key))) {
      held->second.grid = snap(triangles_of(scene.meshes[one.mesh], glm::dmat4(1.0)), kObjectReach);
      fresh.insert(key);
    }
    if (!held->second.grid.triangles.empty()) enclose(bounds, held->second.grid, matrix);
  }
  grid_.transform = {};
  if (!bounds.empty()) {
    grid_.transform.center = bounds.lower * 0.5 + bounds.upper * 0.5;
    const glm::dvec3 half = bounds.upper * 0.5 - bounds.lower * 0.5;
    const double scale = std::min(side_, kWorldReach) / std::max({half.x, half.y, half.z});
    grid_.transform.scale = std::isfinite(scale) && scale > 0 ? scale : 1.0;
  }

  std::map<Key, std::uint32_t> numbers;
  flattened_ = 0;
  grid_.degenerate = 0;
  for (const Shown& one : shown) {
    const glm::dmat4& matrix = places[one.node];
    const auto add = [&](const Key& key, const glm::dmat4& to_world) {
      const GridScene& object = held_.at(key).grid;
      const auto found = numbers.find(key);
      const std::uint32_t number = found != numbers.end() ? found->second : static_cast<std::uint32_t>(keys_.size());
      const auto record =
          make_instance(placement_of(object.transform, grid_.transform, to_world), object.box, number, one.first_id);
      if (!record) return false;
      if (found == numbers.end()) {
        numbers.emplace(key, number);
        keys_.push_back(key);
      }
      grid_.instances.push_back({one.node, *record});
      grid_.degenerate += object.degenerate;
      return true;
    };
    if (held_.at({one.mesh}).grid.triangles.empty()) {
      grid_.degenerate += static_cast<std::uint32_t>(triangle_count(scene.meshes[one.mesh]));
      continue;
    }
    if (add({one.mesh}, matrix)) continue;
    ++flattened_;
    const Key key{one.mesh, one.node};
    const auto [held, first] = held_.try_emplace(key);
    if (first || fresh.contains({one.mesh}) || held->second.place != matrix ||
        held->second.world_scale != grid_.transform.scale || deforms(one.node)) {
      held->second = {snap(triangles_of(scene.meshes[one.mesh], matrix), kObjectReach, grid_.transform.scale * kFinest),
                      matrix, grid_.transform.scale};
      fresh.insert(key);
    }
    if (held->second.grid.triangles.empty()) {
      grid_.degenerate += held->second.grid.degenerate;
    } else if (!add(key, glm::dmat4(1.0))) {
      throw Error(scene.name + ": node " + std::to_string(one.node) + ": no instance record can place it");
    }
  }

  changed_.clear();
  for (std::uint32_t i = 0; i < keys_.size(); ++i) {
    grid_.objects.push_back(std::move(held_.at(keys_[i]).grid));
    if (i >= before.size() || before[i] != keys_[i] || fresh.contains(keys_[i])) changed_.push_back(i);
  }
  grid_.box = top_level_box(grid_.objects, grid_.instances);
}

}  // namespace retrace
