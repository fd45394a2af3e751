// From a scene to a GridScene of two levels: each mesh an object on a grid of its own, each node that shows it an instance.
//
// A placement that no instance record can hold (golden/tree/instance.hpp: a mesh squashed flat, stretched much more on one axis than on another,
// or far smaller than the world) gets an object of its own, of its triangles where they stand in the world. That object's grid is as fine as its
// size allows, but 2^14 times finer than the world's at most.
#pragma once
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "golden/scene/geometry.hpp"
#include "golden/scene/scene.hpp"

namespace retrace {

class InstancedScene {
 public:
  /// The boxes of all instances lie in [-side, side]^3 of the world's grid. Throws Error that names a node whose place in the world is not finite.
  explicit InstancedScene(const Scene& scene, double side = 1.0);
  const GridScene& grid() const { return grid_; }
  GridScene release() && { return std::move(grid_); }

  /// The scene where it stands now: the same meshes and nodes; `deforms(node)`: whether the node's mesh has other vertices than before. Returns the
  /// numbers of the objects that changed, for TwoLevelImage::update().
  std::vector<std::uint32_t> update(const Scene& scene, const std::function<bool(std::uint32_t)>& deforms);
  /// Instances with objects of their own.
  std::size_t flattened() const { return flattened_; }

 private:
  /// An object: a mesh, or what one node shows of it.
  struct Key {
    std::uint32_t mesh, node = kNone;
    friend bool operator==(const Key&, const Key&) = default;
    friend bool operator<(const Key& a, const Key& b) { return a.mesh != b.mesh ? a.mesh < b.mesh : a.node < b.node; }
  };
  struct Held {
    GridScene grid;
    glm::dmat4 place{1.0};  ///< of an object of one node
    double world_scale = 0.0;
  };
  void place(const Scene& scene, const std::function<bool(std::uint32_t)>& deforms);

  GridScene grid_;
  double side_;
  std::vector<Key> keys_;     ///< by object
  std::map<Key, Held> held_;  ///< grids of the objects are in grid_
  std::vector<std::uint32_t> changed_;
  std::size_t flattened_ = 0;
};

/// Whether instances show at least twice as many triangles as their meshes hold, so that two levels save memory.
bool has_instances(const Scene& scene);

}  // namespace retrace
