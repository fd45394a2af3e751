// Hits to shading points, see surface.hpp.
#include "golden/render/surface.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "golden/tree/kd_builder.hpp"

namespace retrace {
namespace {

int wrap_index(int i, int size, Texture::Wrap wrap) {
  switch (wrap) {
    case Texture::Wrap::kClamp:
      return std::clamp(i, 0, size - 1);
    case Texture::Wrap::kMirror: {
      const int period = ((i % (2 * size)) + 2 * size) % (2 * size);
      return period < size ? period : 2 * size - 1 - period;
    }
    default:
      return ((i % size) + size) % size;
  }
}

/// Texel coordinate as an integer and a fraction. Far coordinates are folded first, so that the integer exists.
int split(float coordinate, int size, Texture::Wrap wrap, float& fraction) {
  double x = std::isfinite(coordinate) ? coordinate : 0.0;
  if (wrap == Texture::Wrap::kClamp) {
    x = std::clamp(x, -1.0, 2.0);
  } else {
    x -= 2.0 * std::floor(x / 2.0);  // a mirrored texture repeats every two
  }
  x = x * size - 0.5;
  const double whole = std::floor(x);
  fraction = static_cast<float>(x - whole);
  return static_cast<int>(whole);
}

template <class T>
T blend(const std::vector<T>& values, const glm::uvec3& corners, const glm::dvec3& b) {
  return values[corners.x] * static_cast<float>(b.x) + values[corners.y] * static_cast<float>(b.y) +
         values[corners.z] * static_cast<float>(b.z);
}

const Material& material_of(const Scene& scene, const Primitive& primitive) {
  // glTF's default material is a fully metallic white, which looks black without surroundings to reflect; a neutral matt grey shows form.
  static const Material fallback = [] {
    Material m;
    m.base_color = {0.8f, 0.8f, 0.8f, 1.0f};
    m.metallic = 0.0f;
    m.roughness = 0.7f;
    m.double_sided = true;
    return m;
  }();
  return primitive.material < scene.materials.size() ? scene.materials[primitive.material] : fallback;
}

glm::vec2 texcoord_of(const Primitive& primitive, int set, const glm::uvec3& corners, const glm::dvec3& b) {
  if (set < 0 || set > 1 || primitive.texcoords[set].empty()) return glm::vec2(0.0f);
  return blend(primitive.texcoords[set], corners, b);
}

}  // namespace

glm::vec4 sample_texture(const Texture& texture, glm::vec2 uv) {
  if (texture.width <= 0 || texture.height <= 0) return glm::vec4(1.0f);
  float fx = 0, fy = 0;
  const int x = split(uv.x, texture.width, texture.wrap_u, fx), y = split(uv.y, texture.height, texture.wrap_v, fy);
  const int x0 = wrap_index(x, texture.width, texture.wrap_u), x1 = wrap_index(x + 1, texture.width, texture.wrap_u);
  const int y0 = wrap_index(y, texture.height, texture.wrap_v), y1 = wrap_index(y + 1, texture.height, texture.wrap_v);
  const auto texel = [&](int tx, int ty) { return texture.texels[static_cast<std::size_t>(ty) * texture.width + tx]; };
  return glm::mix(glm::mix(texel(x0, y0), texel(x1, y0), fx), glm::mix(texel(x0, y1), texel(x1, y1), fx), fy);
}

Surfaces::Lookup Surfaces::make_lookup(const GridScene& grid, std::size_t ids) {
  Lookup lookup;
  lookup.index.assign(ids, kNone);
  lookup.order.resize(grid.triangles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, grid.triangles.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      std::array<int, 3> order{};
      make_unit_triangle(grid.triangles[i], &order);
      lookup.order[i] = static_cast<std::uint8_t>(order[1] | order[2] << 2);
      lookup.index[grid.triangles[i].id] = static_cast<std::uint32_t>(i);
    }
  });
  return lookup;
}

Surfaces::Surfaces(const Scene& scene, const WorldTriangles& world, const GridScene& grid)
    : scene_(scene), world_(world), grid_(grid) {
  if (!grid.two_levels) lookups_.push_back(make_lookup(grid, world.vertices.size()));
  for (const GridScene& object : grid.objects)
    lookups_.push_back(make_lookup(object, object.triangles.empty() ? 0 : object.triangles.back().id + std::size_t{1}));
  for (const GridInstance& instance : grid.instances) {
    const Placement to_object = object_from_world(instance.record);
    Placement& to_world = to_world_.emplace_back();
    to_world.linear = glm::inverse(to_object.linear);
    to_world.offset = -(to_world.linear * to_object.offset);
  }
  for (const glm::dmat4& matrix : scene.mesh_transforms()) {
    const glm::dmat3 linear(matrix);
    // A singular transform has no normal matrix; its triangles keep their geometric normals.
    mirrors_.push_back(glm::determinant(linear) < 0.0);
    normal_matrix_.push_back(glm::determinant(linear) != 0.0 ? glm::transpose(glm::inverse(linear)) : glm::dmat3(0.0));
  }
  for (const Material& material : scene.materials)
    transparent_ = transparent_ || material.alpha != Material::Alpha::kOpaque;
}

glm::dvec3 Surfaces::front(std::uint32_t id) const {
  const glm::dvec3 p0 = vertex(id, 0);
  const glm::dvec3 n = glm::normalize(glm::cross(vertex(id, 1) - p0, vertex(id, 2) - p0));
  return mirrors_[world_.sources[id].node] ? -n : n;
}

const Primitive& Surfaces::primitive(std::uint32_t id) const {
  const TriangleSource& source = world_.sources[id];
  return scene_.meshes[source.mesh].primitives[source.primitive];
}

bool Surfaces::transparent(std::uint32_t id) const {
  return transparent_ && material_of(scene_, primitive(id)).alpha != Material::Alpha::kOpaque;
}

std::optional<Surfaces::Located> Surfaces::locate(std::uint32_t id) const {
  if (!grid_.two_levels) {
    const Lookup& lookup = lookups_[0];
    if (id >= lookup.index.size() || lookup.index[id] == kNone) return std::nullopt;
    return Located{grid_, lookup, lookup.index[id], nullptr};
  }
  const auto next = std::ranges::upper_bound(grid_.instances, id, {},
                                             [](const GridInstance& instance) { return instance.record.first_id; });
  if (next == grid_.instances.begin()) return std::nullopt;
  const auto instance = static_cast<std::size_t>(next - grid_.instances.begin()) - 1;
  const contract::InstanceRecord& record = grid_.instances[instance].record;
  const Lookup& lookup = lookups_[record.root];
  const std::uint32_t local = id - record.first_id;
  if (local >= lookup.index.size() || lookup.index[local] == kNone) return std::nullopt;
  return Located{grid_.objects[record.root], lookup, lookup.index[local], &to_world_[instance]};
}

glm::dvec3 Surfaces::place(const Located& at, double scale, int corner) {
  const GridPoint& p = at.grid.triangles[at.index].vertices[static_cast<std::size_t>(corner)];
  const glm::dvec3 on_grid = glm::dvec3(p) * (1.0 / (1 << contract::kPositionFrac));
  return (at.to_world ? at.to_world->linear * on_grid + at.to_world->offset : on_grid) / scale;
}

glm::dvec3 Surfaces::vertex(std::uint32_t id, int corner) const {
  return place(*locate(id), grid_.transform.scale, corner);
}

glm::dvec3 Surfaces::file_barycentrics(const Hit& hit) const {
  const auto at = locate(hit.id);
  if (!at) throw Error("the engine reported triangle " + std::to_string(hit.id) + ", which is not in the scene");
  const int first = at->lookup.order[at->index] & 3, second = at->lookup.order[at->index] >> 2;
  glm::dvec3 b(0.0);
  b[3 - first - second] = 1.0 - hit.u - hit.v;
  b[first] = hit.u;
  b[second] = hit.v;
  return b;
}

WorldRay Surfaces::leave(const SurfacePoint& point, const glm::dvec3& direction, double distance) const {
  WorldRay ray;
  ray.origin = point.position + point.geometric * offset();
  ray.center = grid_.transform.center;
  ray.direction = direction;
  ray.t_max = distance;
  return ray;
}

SurfacePoint Surfaces::at(const Hit& hit, const glm::dvec3& direction) const {
  const glm::dvec3 b = file_barycentrics(hit);
  const TriangleSource& source = world_.sources[hit.id];
  const Primitive& shape = primitive(hit.id);
  const glm::uvec3& corners = shape.triangles[source.triangle];
  const Material& material = material_of(scene_, shape);

  SurfacePoint point;
  point.id = hit.id;
  const glm::dvec3 p0 = vertex(hit.id, 0), p1 = vertex(hit.id, 1), p2 = vertex(hit.id, 2);
  point.position = p0 * b.x + p1 * b.y + p2 * b.z;
  point.geometric = glm::normalize(glm::cross(p1 - p0, p2 - p0));
  const bool turned = glm::dot(point.geometric, direction) > 0;
  if (turned) point.geometric = -point.geometric;
  point.normal = point.geometric;
  if (!shape.normals.empty()) {
    const glm::dvec3 n = normal_matrix_[source.node] * glm::dvec3(blend(shape.normals, corners, b));
    const double length = glm::length(n);
    if (length > 0 && std::isfinite(length)) point.normal = n / length;
    if (glm::dot(point.normal, point.geometric) < 0) point.normal = -point.normal;
  }

  point.base = material.base_color;
  point.texcoord = texcoord_of(shape, material.base_texcoord, corners, b);
  if (material.base_texture < scene_.textures.size()) {
    point.base *= sample_texture(scene_.textures[material.base_texture], material.base_transform.apply(point.texcoord));
  }
  if (!shape.colors.empty()) point.base *= blend(shape.colors, corners, b);
  if (material.alpha == Material::Alpha::kOpaque) {
    point.base.a = 1.0f;
  } else if (material.alpha == Material::Alpha::kMask) {
    point.base.a = point.base.a < material.alpha_cutoff ? 0.0f : 1.0f;
  }
  point.base = glm::clamp(point.base, 0.0f, 1.0f);
  const bool back = turned != (mirrors_[source.node] != 0);
  point.emissive = back && !material.double_sided ? glm::vec3(0.0f) : material.emissive;
  if (material.emissive_texture < scene_.textures.size()) {
    point.emissive *= glm::vec3(
        sample_texture(scene_.textures[material.emissive_texture],
                       material.emissive_transform.apply(texcoord_of(shape, material.emissive_texcoord, corners, b))));
  }
  point.metallic = material.metallic;
  point.roughness = material.roughness;
  if (material.surface_texture < scene_.textures.size()) {
    const glm::vec4 factors =
        sample_texture(scene_.textures[material.surface_texture],
                       material.surface_transform.apply(texcoord_of(shape, material.surface_texcoord, corners, b)));
    point.roughness *= factors.g;
    point.metallic *= factors.b;
  }
  point.metallic = glm::clamp(point.metallic, 0.0f, 1.0f);
  point.roughness = glm::clamp(point.roughness, 0.0f, 1.0f);
  point.unlit = material.unlit;
  if (point.unlit) point.emissive = glm::vec3(0.0f);
  return point;
}

}  // namespace retrace
