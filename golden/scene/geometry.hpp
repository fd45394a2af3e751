// From a scene to what is traced: world triangles (flatten), and their snapping to the position grid, once (snap).
// Golden, hls and rtl all trace the snapped triangles. Number contract: scripts/contract/contract.toml.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "golden/contract/contract_records.hpp"
#include "scene.hpp"

namespace retrace {

/// Where a world triangle came from.
struct TriangleSource {
  std::uint32_t node;  ///< glTF node (the instance)
  std::uint32_t mesh;
  std::uint32_t primitive;  ///< within the mesh
  std::uint32_t triangle;   ///< within the primitive
};

/// World triangles; the index is the triangle id that engines report. Degenerate ones keep their id.
struct WorldTriangles {
  std::vector<std::array<glm::dvec3, 3>> vertices;  ///< in file order
  std::vector<TriangleSource> sources;
};

/// Twice what a memory image can hold (2^24 triangle records); a bound on memory, since instances make many triangles of few bytes.
inline constexpr std::size_t kMaxWorldTriangles = std::size_t{1} << 25;

/// Triangles of all nodes reachable from the scene's roots, nodes in `Scene::reachable()` order, primitives and triangles in file
/// order. Throws Error for a non-finite vertex, naming node, mesh, primitive and vertex, and for more than kMaxWorldTriangles.
WorldTriangles flatten(const Scene& scene);

/// Uniform map between world and grid: position = (world - center) * scale, code = round(position * 2^24).
struct GridTransform {
  double scale = 1.0;
  glm::dvec3 center{0.0};

  glm::dvec3 to_grid(const glm::dvec3& world) const { return (world - center) * scale; }
  glm::dvec3 to_world(const glm::dvec3& grid) const { return grid / scale + center; }
};

using GridPoint = glm::ivec3;  ///< position codes, Q3.24

struct GridTriangle {
  std::array<GridPoint, 3> vertices;  ///< in file order
  std::uint32_t id;                   ///< index into WorldTriangles
};

/// An object of a scene of two levels where it stands in the world.
struct GridInstance {
  std::uint32_t node = kNone;  ///< glTF node
  contract::InstanceRecord
      record;  ///< its root is the number of the object; first_id: the id of the object's triangle 0 in the world
};

/// The scene on the position grid. A scene of two levels has its triangles in objects, each on a grid of its own.
struct GridScene {
  GridTransform transform;
  std::vector<GridTriangle> triangles;  ///< those of non-zero area on the grid, ascending id
  std::uint32_t degenerate = 0;         ///< how many were dropped
  std::array<std::int32_t, 6> box{};    ///< root box by face (x lower, x upper, ...): box of the triangles and kBoxPad

  bool two_levels = false;
  std::vector<GridScene> objects;       ///< ids count from 0 in each; their transforms are those of their meshes
  std::vector<GridInstance> instances;  ///< ascending first_id
};

/// The triangle of that id, or nullptr. `triangles` stand by ascending id, as in GridScene; ids may be missing.
template <class Triangles>
auto find_triangle(const Triangles& triangles, std::uint32_t id) {
  const auto found = std::ranges::lower_bound(triangles, id, {}, [](const auto& triangle) { return triangle.id; });
  return found != std::ranges::end(triangles) && found->id == id ? &*found : nullptr;
}

/// A triangle of the world: one of the scene's own, or one of an instance's object.
struct PlacedTriangle {
  const GridTriangle* triangle;         ///< on the object's grid, its id counts within the object
  std::optional<std::size_t> instance;  ///< place in GridScene::instances
};
/// Finds a triangle by the id that engines report; nothing where there is none.
std::optional<PlacedTriangle> find_placed(const GridScene& scene, std::uint32_t id);

/// Triangles with an area on their grid, each instance's counted.
std::uint64_t placed_triangles(const GridScene& scene);

/// Scales uniformly so that the padded box lies inside [-reach, reach]^3, but by no more than `most`, and rounds every vertex to the grid, ties up.
/// With no triangle left the box is a small one about the centre.
GridScene snap(const WorldTriangles& world, double reach = 1.0, double most = std::numeric_limits<double>::infinity());

}  // namespace retrace
