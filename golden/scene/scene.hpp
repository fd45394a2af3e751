// A scene as glTF describes it: meshes in object space, a node hierarchy, materials, cameras, lights.
// Instanced meshes are held once. `flatten` (geometry.hpp) turns a scene into world triangles; the two-level structures of
// golden/accel use meshes and nodes as they stand.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "golden/base/error.hpp"

namespace retrace {

inline constexpr std::uint32_t kNone = 0xffffffffu;  ///< "no such index" everywhere on the host

/// Decoded image; rows top to bottom, 4 channels, float.
struct Texture {
  std::string name;
  int width = 0, height = 0;
  std::vector<glm::vec4> texels;  ///< width * height, values in [0, 1]; colours linearised, data (roughness) as stored
  enum class Wrap { kRepeat, kClamp, kMirror };
  Wrap wrap_u = Wrap::kRepeat, wrap_v = Wrap::kRepeat;
};

/// KHR_texture_transform: scale, then rotation, then offset.
struct TextureTransform {
  glm::vec2 offset{0.0f}, scale{1.0f};
  float rotation = 0.0f;  ///< radians, counter-clockwise in the image
  glm::vec2 apply(glm::vec2 uv) const;
};

struct Material {
  enum class Alpha { kOpaque, kMask, kBlend };
  std::string name;
  glm::vec4 base_color{1.0f};
  std::uint32_t base_texture = kNone;  ///< index into Scene::textures
  int base_texcoord = 0;
  TextureTransform base_transform;
  glm::vec3 emissive{0.0f};
  std::uint32_t emissive_texture = kNone;
  int emissive_texcoord = 0;
  TextureTransform emissive_transform;
  float metallic = 1.0f, roughness = 1.0f;
  std::uint32_t surface_texture = kNone;  ///< factors on roughness (green) and metallic (blue)
  int surface_texcoord = 0;
  TextureTransform surface_transform;
  bool unlit = false;  ///< KHR_materials_unlit: shows its base colour whatever the light
  Alpha alpha = Alpha::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
};

/// Triangles of one glTF primitive, indexed. Strips and fans are already unrolled, in the winding glTF prescribes.
struct Primitive {
  std::vector<glm::vec3> positions;     ///< object space, as the file stores them
  std::vector<glm::vec3> normals;       ///< empty, or one a position
  std::vector<glm::vec2> texcoords[2];  ///< each empty, or one a position
  std::vector<glm::vec4> colors;        ///< empty, or one a position (COLOR_0)
  std::vector<glm::uvec3> triangles;
  std::uint32_t material = kNone;
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
  std::uint32_t source = kNone;  ///< mesh of the file that this is a posed copy of; kNone: it is that mesh itself
};

struct Camera {
  std::string name;
  bool perspective = true;
  double yfov = 0.8;              ///< radians, perspective
  double aspect = 0.0;            ///< width / height; 0: follow the image
  double xmag = 1.0, ymag = 1.0;  ///< half extents, orthographic
  double znear = 0.0;
  double zfar = std::numeric_limits<double>::infinity();
  std::string fault;  ///< why it cannot be used; empty if it can
};

/// KHR_lights_punctual.
struct Light {
  enum class Type { kDirectional, kPoint, kSpot };
  std::string name;
  Type type = Type::kPoint;
  glm::vec3 color{1.0f};
  float intensity = 1.0f;                            ///< candela (point, spot) or lux (directional)
  float range = 0.0f;                                ///< 0: unlimited
  float inner_cone = 0.0f, outer_cone = 0.7853982f;  ///< radians, spot
};

struct Node {
  std::string name;
  std::uint32_t parent = kNone;
  std::vector<std::uint32_t> children;
  bool has_matrix = false;
  glm::dmat4 matrix{1.0};  ///< local transform, if has_matrix
  glm::dvec3 translation{0.0}, scale{1.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  std::uint32_t mesh = kNone, camera = kNone, light = kNone;
  std::uint32_t source = kNone;  ///< node of the file that this is an instance of; kNone: it is that node itself
  /// Of a posed skin: takes the place of the node's world transform, which does not apply to skinned meshes.
  std::optional<glm::dmat4> mesh_frame;

  /// Local transform: matrix, or T * R * S.
  glm::dmat4 local() const;
};

struct Scene {
  std::string name;  ///< file name without folder
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;
  std::vector<std::uint32_t> roots;  ///< nodes of the chosen glTF scene
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Camera> cameras;
  std::vector<Light> lights;

  /// World transform of every node that is reachable from `roots` (identity elsewhere); index by node.
  std::vector<glm::dmat4> world_transforms() const;
  /// The same for what meshes are placed with: Node::mesh_frame where there is one.
  std::vector<glm::dmat4> mesh_transforms() const;
  /// Nodes reachable from `roots`, parents before children, in file order.
  std::vector<std::uint32_t> reachable() const;
};

}  // namespace retrace
