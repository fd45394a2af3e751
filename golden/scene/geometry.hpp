// From a scene to what is traced: world triangles (flatten), and their snapping to the position grid, once (snap).
// Golden, hls and rtl all trace the snapped triangles. Number contract: scripts/contract/contract.toml.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

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

/// The scene on the position grid.
struct GridScene {
  GridTransform transform;
  std::vector<GridTriangle> triangles;  ///< those of non-zero area on the grid, ascending id
  std::uint32_t degenerate = 0;         ///< how many were dropped
  std::array<std::int32_t, 6> box{};    ///< root box by face (x lower, x upper, ...): box of the triangles and kBoxPad
};

/// The triangle of that id, or nullptr. `triangles` stand by ascending id, as in GridScene; ids may be missing.
template <class Triangles>
auto find_triangle(const Triangles& triangles, std::uint32_t id) {
  const auto found = std::ranges::lower_bound(triangles, id, {}, [](const auto& triangle) { return triangle.id; });
  return found != std::ranges::end(triangles) && found->id == id ? &*found : nullptr;
}

/// Scales uniformly so that the padded box lies inside [-1, 1]^3 and rounds every vertex to the grid, ties up.
/// With no triangle left the box is a small one about the centre. `side`: half the side of the cube that is used, at most 1.
GridScene snap(const WorldTriangles& world, double side = 1.0);

}  // namespace retrace
