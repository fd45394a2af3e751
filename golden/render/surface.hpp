// From a hit to a point that can be shaded: position, normals, material with textures. Everything that does not depend on an engine.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/scene/geometry.hpp"
#include "golden/scene/scene.hpp"
#include "golden/tree/instance.hpp"

namespace retrace {

/// How far secondary rays start from the surface they leave, along its geometric normal, in grid units. More than what the position of
/// the point (2^-24 of the grid, 2^-24 of the barycentrics) and the origin of the quantised ray (2^-25) may be off, plus the depth
/// bound of the triangle test, with room to spare; a millionth of the scene, so nothing is seen of it.
inline constexpr double kSurfaceOffset = 0x1p-18;

/// Bilinear lookup, (0, 0) at the top left of the image, texel centres at half integers, wrapped as the sampler says.
glm::vec4 sample_texture(const Texture& texture, glm::vec2 uv);

struct SurfacePoint {
  std::uint32_t id = kNone;   ///< triangle
  glm::dvec3 position{0.0};   ///< relative to the centre of the grid, on the snapped triangle
  glm::dvec3 geometric{0.0};  ///< unit normal of the triangle on the side that the ray came from
  glm::dvec3 normal{0.0};     ///< interpolated unit normal on that side
  glm::vec2 texcoord{0.0f};
  glm::vec4 base{1.0f};      ///< base colour, linear; alpha is 1 for opaque materials, 0 or 1 for masked ones
  glm::vec3 emissive{0.0f};  ///< 0 on the back of a single-sided material
  float metallic = 0.0f, roughness = 1.0f;
  bool unlit = false;  ///< shows its base colour
};

/// Scene, world triangles and snapped triangles as shading needs them: by triangle id. Positions are in world units
/// relative to the centre of the grid, so that they are as fine as the grid wherever the scene lies. Triangles of
/// instances are where the instance records have them.
class Surfaces {
 public:
  /// The three must outlive this.
  Surfaces(const Scene& scene, const WorldTriangles& world, const GridScene& grid);

  /// The point that a ray with this world direction hit. Back faces are not culled: normals turn towards the ray.
  /// Throws Error if the engine reported a triangle that does not exist.
  SurfacePoint at(const Hit& hit, const glm::dvec3& direction) const;
  /// Barycentrics of the three vertices in the order of the file.
  glm::dvec3 file_barycentrics(const Hit& hit) const;
  /// Vertex of a snapped triangle, relative to the centre of the grid.
  glm::dvec3 vertex(std::uint32_t id, int corner) const;
  /// Unit normal of the side that glTF calls the front: counter-clockwise, the other way round where the node mirrors.
  glm::dvec3 front(std::uint32_t id) const;
  /// Whether any material may let a ray through.
  bool transparent() const { return transparent_; }
  bool transparent(std::uint32_t id) const;

  const Scene& scene() const { return scene_; }
  const WorldTriangles& world() const { return world_; }
  const GridScene& grid() const { return grid_; }
  /// Whether engines can report this id: a triangle with an area on its grid.
  bool exists(std::uint32_t id) const { return locate(id).has_value(); }
  /// Calls `body(id)` for each of those.
  template <class Body>
  void for_each_triangle(Body body) const {
    for (const GridTriangle& triangle : grid_.triangles) body(triangle.id);
    for (const GridInstance& instance : grid_.instances)
      for (const GridTriangle& triangle : grid_.objects[instance.record.root].triangles)
        body(instance.record.first_id + triangle.id);
  }
  /// A world position relative to the centre of the grid.
  glm::dvec3 from_world(const glm::dvec3& world) const { return world - grid_.transform.center; }
  /// kSurfaceOffset in world units.
  double offset() const { return kSurfaceOffset / grid_.transform.scale; }
  const Primitive& primitive(std::uint32_t id) const;
  /// A ray that leaves the point towards a unit direction, for at most `distance` world units. It starts kSurfaceOffset off the surface.
  WorldRay leave(const SurfacePoint& point, const glm::dvec3& direction, double distance) const;

 private:
  /// Triangles of one grid, by their ids there.
  struct Lookup {
    std::vector<std::uint32_t> index;  ///< id to index into the grid's triangles
    std::vector<std::uint8_t> order;   ///< by that index: file vertices of the record's vertices 1 and 2, two bits each
  };
  struct Located {
    const GridScene& grid;
    const Lookup& lookup;
    std::uint32_t index;
    const Placement* to_world;  ///< of an instance's object
  };
  static Lookup make_lookup(const GridScene& grid, std::size_t ids);
  std::optional<Located> locate(std::uint32_t id) const;
  static glm::dvec3 place(const Located& at, double scale, int corner);

  const Scene& scene_;
  const WorldTriangles& world_;
  const GridScene& grid_;
  std::vector<Lookup> lookups_;            ///< of the scene, or of each object
  std::vector<Placement> to_world_;        ///< by instance: from the object's grid to the world's
  std::vector<glm::dmat3> normal_matrix_;  ///< by node
  std::vector<std::uint8_t> mirrors_;      ///< by node
  bool transparent_ = false;
};

}  // namespace retrace
