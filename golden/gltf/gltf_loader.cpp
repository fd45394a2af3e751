// Second stage of the glTF loader: the checked document to a Scene. Everything that one part of the file says about
// another (indices, accessor ranges, counts, the hierarchy) is checked here, when it is used. What the chosen scene
// shows must be right; faults in the rest are noted.
#include "golden/gltf/gltf_loader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "golden/gltf/animation.hpp"
#include "golden/gltf/gltf_accessor.hpp"
#include "golden/gltf/gltf_document.hpp"
#include "golden/gltf/gltf_image.hpp"

namespace retrace {
namespace {

using gltf::Accessor;
using gltf::Accessors;
using gltf::Bytes;
using gltf::Document;
using gltf::extension;
using gltf::quote_name;
using nlohmann::json;

// Bounds on memory: few bytes can stand for much (shared or sparse accessors, instances).
constexpr std::size_t kMaxVertices = std::size_t{1} << 26;   // over all primitives
constexpr std::size_t kMaxTriangles = std::size_t{1} << 25;  // over all primitives
constexpr std::size_t kMaxInstances = std::size_t{1} << 20;  // of EXT_mesh_gpu_instancing, over all nodes

enum Mode { kTriangles = 4, kTriangleStrip, kTriangleFan };

std::string number(std::size_t n) { return std::to_string(n); }
std::string name_of(const json& o) { return o.value("name", std::string()); }

/// Where something is named in the JSON; kNone if it is not.
std::uint32_t index_of(const json& o, const char* key) {
  const auto it = o.find(key);
  return it == o.end() ? kNone : it->get<std::uint32_t>();
}

template <class Vec>
Vec vector_of(const json& o, const char* key, Vec absent) {
  if (const auto it = o.find(key); it != o.end())
    for (int c = 0; c < Vec::length(); ++c)
      absent[c] = static_cast<typename Vec::value_type>((*it)[static_cast<std::size_t>(c)].get<double>());
  return absent;
}

float float_of(const json& o, const char* key, double absent) { return static_cast<float>(o.value(key, absent)); }

class Loader {
 public:
  Loader(Document& document, const GltfOptions& options)
      : document_(document), accessors_(document), options_(options) {}

  Scene run() {
    load_cameras();
    load_lights();
    load_nodes();
    choose_scene();
    find_used();
    for (std::size_t i = 0; i < used_materials_.size(); ++i) {
      scene_.materials.emplace_back();
      strictly(used_materials_[i], [&] { scene_.materials[i] = load_material(i); });
    }
    note_left_out();
    for (std::size_t i = 0; i < used_meshes_.size(); ++i) {
      scene_.meshes.emplace_back();
      strictly(used_meshes_[i], [&] { scene_.meshes[i] = load_mesh(i); });
    }
    add_instances();
    check_transforms();
    if (options_.posed) {
      pose_at_rest(document_, accessors_, scene_);
    }
    return std::move(scene_);
  }

 private:
  void note(const std::string& text) { document_.note(text); }

  /// A fault is an error if the scene shows what has it, otherwise a note.
  template <class Load>
  void strictly(bool used, const Load& load) {
    try {
      load();
    } catch (const Error& e) {
      if (used) throw;
      note(std::string(e.what()) + "; it is not used");
    }
  }

  void find_used() {
    used_meshes_.resize(document_.size("meshes"));
    used_materials_.resize(document_.size("materials"));
    for (const std::uint32_t node : scene_.reachable())
      if (scene_.nodes[node].mesh != kNone) used_meshes_[scene_.nodes[node].mesh] = true;
    for (std::size_t i = 0; i < used_meshes_.size(); ++i)
      if (used_meshes_[i])
        for (const json& p : document_.use("meshes", i)["primitives"])
          if (const std::uint32_t m = index_of(p, "material"); m < used_materials_.size()) used_materials_[m] = true;
  }

  // ----------------------------------------------------------------------------------------------------------- meshes

  Mesh load_mesh(std::size_t index) {
    const json& source = document_.use("meshes", index);
    Mesh mesh;
    mesh.name = name_of(source);
    const std::string where = "mesh " + number(index) + quote_name(mesh.name);
    const json& primitives = source["primitives"];
    for (std::size_t p = 0; p < primitives.size(); ++p)
      mesh.primitives.push_back(load_primitive(primitives[p], where + " primitive " + number(p)));
    return mesh;
  }

  /// A primitive that has nothing to trace keeps its place, empty, so that indices stay those of the file.
  Primitive load_primitive(const json& source, const std::string& where) {
    Primitive out;
    out.material = index_of(source, "material");
    if (out.material != kNone && out.material >= scene_.materials.size())
      throw Error(where + ": there is no material " + number(out.material));
    const int mode = source.value("mode", static_cast<int>(kTriangles));
    if (mode < kTriangles) {
      note(where + ": points and lines are left out");
      return out;
    }
    const json& attributes = source["attributes"];
    if (!attributes.contains("POSITION")) {
      note(where + ": has no POSITION and is left out");
      return out;
    }
    const std::uint32_t position = index_of(attributes, "POSITION");
    if (extension(source, "KHR_draco_mesh_compression") && position < document_.size("accessors") &&
        !document_.use("accessors", position).contains("bufferView"))
      throw Error(where + ": is compressed (KHR_draco_mesh_compression), which is not supported");
    const Accessor positions = accessors_.open(position, where + ": POSITION");
    positions.expect(3, 3, gltf::kAnyShort);

    std::vector<std::uint32_t> corners = load_indices(source, positions.count, where);
    unroll(mode, corners, out, where);
    triangles_ += out.triangles.size();
    if (triangles_ > kMaxTriangles)
      throw Error(where + ": the file has more than " + number(kMaxTriangles) + " triangles");

    // Primitives often share one large vertex buffer: keep what this one uses.
    std::vector<std::uint32_t> used;
    const bool compact = source.contains("indices") && out.triangles.size() * 3 < positions.count / 2;
    if (compact) used = compact_vertices(out.triangles);
    const std::vector<std::uint32_t>* selection = compact ? &used : nullptr;
    vertices_ += compact ? used.size() : positions.count;
    if (vertices_ > kMaxVertices) throw Error(where + ": the file has more than " + number(kMaxVertices) + " vertices");

    out.positions = gltf::gather(positions, selection, glm::vec3(0.0f));
    for (const glm::uvec3& triangle : out.triangles)
      for (int c = 0; c < 3; ++c)
        if (const glm::vec3& p = out.positions[triangle[c]];
            !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
          throw Error(positions.where + ": vertex " + number(compact ? used[triangle[c]] : triangle[c]) +
                      " is not finite");

    const auto attribute = [&](const char* name, int low, int high, unsigned types) -> std::optional<Accessor> {
      if (!attributes.contains(name)) return std::nullopt;
      // As many as there are positions, so those bound what zeros may cost.
      Accessor a = accessors_.open(index_of(attributes, name), where + ": " + name, true);
      if (a.count != positions.count)
        throw Error(a.where + ": has " + number(a.count) + " elements, but there are " + number(positions.count) +
                    " positions");
      a.expect(low, high, types);
      return a;
    };
    if (const auto a = attribute("NORMAL", 3, 3, gltf::kFloats | gltf::kShortSigned))
      out.normals = gltf::gather(*a, selection, glm::vec3(0.0f));
    for (int set = 0; set < 2; ++set)
      if (const auto a = attribute(set ? "TEXCOORD_1" : "TEXCOORD_0", 2, 2, gltf::kAnyShort))
        out.texcoords[set] = gltf::gather(*a, selection, glm::vec2(0.0f));
    if (const auto a = attribute("COLOR_0", 3, 4, gltf::kFloats | gltf::kShortUnsigned))
      out.colors = gltf::gather(*a, selection, glm::vec4(1.0f));
    return out;
  }

  std::vector<std::uint32_t> load_indices(const json& source, std::size_t vertices, const std::string& where) {
    if (!source.contains("indices")) {
      if (vertices > kMaxVertices) throw Error(where + ": has more than " + number(kMaxVertices) + " vertices");
      std::vector<std::uint32_t> corners(vertices);
      for (std::size_t i = 0; i < vertices; ++i) corners[i] = static_cast<std::uint32_t>(i);
      return corners;
    }
    const Accessor view = accessors_.open(index_of(source, "indices"), where + ": indices");
    if (view.components != 1 || (gltf::kIndices & gltf::component_bit(view.component)) == 0 || view.normalized)
      throw Error(view.where + ": must be unsigned integer scalars");
    if (view.count > 3 * kMaxTriangles)
      throw Error(view.where + ": has more than " + number(3 * kMaxTriangles) + " indices");
    std::vector<std::uint32_t> corners(view.count);
    for (std::size_t i = 0; i < view.count; ++i) {
      corners[i] = view.index(i);
      if (corners[i] >= vertices)
        throw Error(view.where + ": index " + number(i) + " is " + number(corners[i]) + ", but there are " +
                    number(vertices) + " vertices");
    }
    return corners;
  }

  /// Topologies of glTF 2.0, section 3.7.2.1, whose windings these are.
  void unroll(int mode, const std::vector<std::uint32_t>& corners, Primitive& out, const std::string& where) {
    const std::size_t n = corners.size();
    if (mode == kTriangles) {
      if (n % 3 != 0)
        note(where + ": " + number(n) + " corners are no whole number of triangles; the rest is left out");
      out.triangles.resize(n / 3);
      for (std::size_t i = 0; i < n / 3; ++i)
        out.triangles[i] = {corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]};
      return;
    }
    if (n < 3) {
      note(where + ": " + number(n) + " corners are no triangle");
      return;
    }
    out.triangles.resize(n - 2);
    for (std::size_t i = 0; i + 2 < n; ++i)
      out.triangles[i] = mode == kTriangleStrip ? glm::uvec3(corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2])
                                                : glm::uvec3(corners[i + 1], corners[i + 2], corners[0]);
  }

  /// Renumbers the vertices in the order of their old numbers; returns the old numbers.
  static std::vector<std::uint32_t> compact_vertices(std::vector<glm::uvec3>& triangles) {
    std::vector<std::uint32_t> used;
    used.reserve(triangles.size() * 3);
    for (const glm::uvec3& t : triangles) used.insert(used.end(), {t.x, t.y, t.z});
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (glm::uvec3& t : triangles)
      for (int c = 0; c < 3; ++c)
        t[c] = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), t[c]) - used.begin());
    return used;
  }

  // -------------------------------------------------------------------------------------------------------- materials

  Material load_material(std::size_t index) {
    const json& source = document_.use("materials", index);
    Material m;
    m.name = name_of(source);
    const std::string where = "material " + number(index) + quote_name(m.name);
    static const json kNothing = json::object();
    const auto pbr_at = source.find("pbrMetallicRoughness");
    const json& pbr = pbr_at == source.end() ? kNothing : *pbr_at;
    const json *base = &pbr, *gloss = extension(source, "KHR_materials_pbrSpecularGlossiness");
    const char *factor = "baseColorFactor", *texture = "baseColorTexture";
    m.metallic = float_of(pbr, "metallicFactor", 1.0);
    m.roughness = float_of(pbr, "roughnessFactor", 1.0);
    if (gloss) {
      base = gloss, factor = "diffuseFactor", texture = "diffuseTexture";
      m.metallic = 0.0f;
      m.roughness = 1.0f - float_of(*gloss, "glossinessFactor", 1.0);
      if (gloss->contains("specularGlossinessTexture")) left_out("specular-glossiness textures", where);
    }
    m.base_color = vector_of(*base, factor, glm::vec4(1.0f));
    bind(*base, texture, gltf::Content::kColor, m.base_texture, m.base_texcoord, m.base_transform,
         where + " base colour");
    if (!gloss)
      bind(pbr, "metallicRoughnessTexture", gltf::Content::kData, m.surface_texture, m.surface_texcoord,
           m.surface_transform, where + " metallic roughness");
    m.emissive = vector_of(source, "emissiveFactor", glm::vec3(0.0f));
    if (const json* strength = extension(source, "KHR_materials_emissive_strength"))
      m.emissive *= float_of(*strength, "emissiveStrength", 1.0);
    if (glm::any(glm::lessThan(m.emissive, glm::vec3(0.0f)))) {
      note(where + ": emits less than nothing; nothing is taken");
      m.emissive = glm::max(m.emissive, 0.0f);
    }
    bind(source, "emissiveTexture", gltf::Content::kColor, m.emissive_texture, m.emissive_texcoord,
         m.emissive_transform, where + " emissive");
    if (source.contains("normalTexture")) left_out("normal textures", where);
    if (source.contains("occlusionTexture")) left_out("occlusion textures", where);
    m.unlit = extension(source, "KHR_materials_unlit") != nullptr;
    const std::string alpha = source.value("alphaMode", std::string("OPAQUE"));
    if (alpha == "MASK")
      m.alpha = Material::Alpha::kMask;
    else if (alpha == "BLEND")
      m.alpha = Material::Alpha::kBlend;
    else if (alpha != "OPAQUE")
      note(where + ": 'alphaMode' must be OPAQUE, MASK or BLEND, is" + quote_name(alpha) + "; OPAQUE is taken");
    m.alpha_cutoff = float_of(source, "alphaCutoff", 0.5);
    m.double_sided = source.value("doubleSided", false);
    return m;
  }

  /// Counts materials that use what is not supported, for one note a kind.
  void left_out(const char* what, const std::string& where) {
    auto& [first, count] = left_out_[what];
    if (count++ == 0) first = where;
  }
  void note_left_out() {
    for (const auto& [what, where] : left_out_)
      note(what + " are not supported and left out (" + where.first +
           (where.second > 1 ? " and " + number(where.second - 1) + " more)" : ")"));
  }

  /// A texture that cannot be used is left out with a note: the shape can be seen without it.
  void bind(const json& o, const char* key, gltf::Content content, std::uint32_t& slot, int& slot_set,
            TextureTransform& slot_transform, const std::string& where) {
    const auto it = o.find(key);
    if (it == o.end()) return;
    try {
      gltf::check_texture_info(o, key, where);
      std::uint32_t texture = index_of(*it, "index"), set = it->value("texCoord", 0u);
      if (texture >= document_.size("textures")) throw Error(where + ": there is no texture " + number(texture));
      if (const json* t = extension(*it, "KHR_texture_transform")) {
        slot_transform.offset = vector_of(*t, "offset", glm::vec2(0.0f));
        slot_transform.scale = vector_of(*t, "scale", glm::vec2(1.0f));
        slot_transform.rotation = float_of(*t, "rotation", 0.0);
        set = t->value("texCoord", set);
      }
      if (set > 1) throw Error(where + ": texture coordinates " + number(set) + " are not supported (0 and 1 are)");
      slot = load_texture(texture, content);
      slot_set = static_cast<int>(set);
    } catch (const Error& e) {
      note(std::string(e.what()) + "; the texture is left out");
    }
  }

  Texture::Wrap wrap(int mode, const std::string& where) {
    switch (mode) {
      case 33071:
        return Texture::Wrap::kClamp;
      case 33648:
        return Texture::Wrap::kMirror;
      default:
        note(where + ": wrap mode " + std::to_string(mode) + " does not exist; the texture repeats");
        [[fallthrough]];
      case 10497:
        return Texture::Wrap::kRepeat;
    }
  }

  std::uint32_t load_texture(std::size_t index, gltf::Content content) {
    const auto key = std::pair(index, content);
    if (const auto it = textures_.find(key); it != textures_.end()) return it->second;
    textures_[key] = kNone;
    if (!options_.textures) return kNone;
    const json& source = document_.use("textures", index);
    const std::string where = "texture " + number(index) + quote_name(name_of(source));
    Texture::Wrap wrap_u = Texture::Wrap::kRepeat, wrap_v = wrap_u;
    if (const std::uint32_t s = index_of(source, "sampler"); s != kNone) {
      try {
        if (s >= document_.size("samplers")) throw Error(where + ": there is no sampler " + number(s));
        const json& sampler = document_.use("samplers", s);
        wrap_u = wrap(sampler.value("wrapS", 10497), where);
        wrap_v = wrap(sampler.value("wrapT", 10497), where);
      } catch (const Error& e) {
        note(std::string(e.what()) + "; the texture repeats");
      }
    }
    const std::uint32_t image = index_of(source, "source");
    if (image == kNone) throw Error(where + ": has no image in a supported format");
    if (image >= document_.size("images")) throw Error(where + ": there is no image " + number(image));

    Texture texture;
    const auto image_key = std::pair(std::size_t{image}, content);
    if (const auto it = images_.find(image_key); it != images_.end()) {
      const Texture& first = scene_.textures[it->second];
      if (first.wrap_u == wrap_u && first.wrap_v == wrap_v) return textures_[key] = it->second;
      texture = first;
    } else {
      const json& raw = document_.use("images", image);
      const std::string name = name_of(raw);
      try {
        Bytes storage;
        texture = gltf::decode_image(document_.image(image, storage), options_.max_texels, content);
      } catch (const Error& e) {
        throw Error("image " + number(image) + quote_name(name) + ": " + e.what());
      }
      texture.name = name;
      images_[image_key] = static_cast<std::uint32_t>(scene_.textures.size());
    }
    texture.wrap_u = wrap_u;
    texture.wrap_v = wrap_v;
    scene_.textures.push_back(std::move(texture));
    texture_images_.push_back(image);
    fit_texels();
    return textures_[key] = static_cast<std::uint32_t>(scene_.textures.size() - 1);
  }

  /// Halves the largest textures until all fit into the bound.
  void fit_texels() {
    std::uint64_t total = 0;
    for (const Texture& t : scene_.textures) total += t.texels.size();
    while (total > options_.max_texels) {
      const auto largest =
          std::max_element(scene_.textures.begin(), scene_.textures.end(),
                           [](const Texture& a, const Texture& b) { return a.texels.size() < b.texels.size(); });
      if (largest->texels.size() <= 1) return;
      const std::uint32_t image = texture_images_[static_cast<std::size_t>(largest - scene_.textures.begin())];
      total -= largest->texels.size();
      gltf::halve(*largest);
      total += largest->texels.size();
      note("image " + number(image) + quote_name(largest->name) + ": is held at " + std::to_string(largest->width) +
           " x " + std::to_string(largest->height) + " pixels; the images of the file have more than " +
           number(options_.max_texels) + " in total");
    }
  }

  // ------------------------------------------------------------------------------------------------ cameras and lights

  void load_cameras() {
    for (std::size_t i = 0; i < document_.size("cameras"); ++i) {
      Camera camera;
      try {
        const json& source = document_.use("cameras", i);
        camera.name = name_of(source);
        const std::string where = "camera " + number(i) + quote_name(camera.name);
        camera.perspective = source["type"] == "perspective";
        const json& p = source[camera.perspective ? "perspective" : "orthographic"];
        if (camera.perspective) {
          camera.yfov = p["yfov"].get<double>();
          camera.aspect = p.value("aspectRatio", 0.0);
          if (p.contains("aspectRatio") && !(camera.aspect > 1e-6 && camera.aspect < 1e6)) {
            note(where + ": 'aspectRatio' is out of range: " + p["aspectRatio"].dump() +
                 "; that of the image is taken");
            camera.aspect = 0.0;
          }
        } else {
          camera.xmag = std::abs(p["xmag"].get<double>());
          camera.ymag = std::abs(p["ymag"].get<double>());
        }
        camera.znear = p.value("znear", 0.0);
        camera.zfar = p.value("zfar", camera.zfar);
        if (camera.znear < 0.0) {
          note(where + ": 'znear' is out of range: " + p["znear"].dump() + "; 0 is taken");
          camera.znear = 0.0;
        }
        if (!(camera.zfar > camera.znear)) {
          note(where + ": 'zfar' must be more than 'znear', is " + p["zfar"].dump() + "; neither clips");
          camera.znear = 0.0;
          camera.zfar = std::numeric_limits<double>::infinity();
        }
      } catch (const Error& e) {
        camera.fault = e.what();
        note(camera.fault + "; the camera is left out");
      }
      scene_.cameras.push_back(std::move(camera));
    }
  }

  void load_lights() {
    for (std::size_t i = 0; i < document_.size("lights"); ++i) {
      Light light;
      try {
        const json& source = document_.use("lights", i);
        light = load_light(source, "light " + number(i) + quote_name(name_of(source)));
      } catch (const Error& e) {
        note(std::string(e.what()) + "; the light is left out");
        light.intensity = 0.0f;
      }
      scene_.lights.push_back(std::move(light));
    }
  }

  Light load_light(const json& source, const std::string& where) {
    Light light;
    light.name = name_of(source);
    const std::string type = source["type"];
    light.type = type == "directional" ? Light::Type::kDirectional
                 : type == "spot"      ? Light::Type::kSpot
                                       : Light::Type::kPoint;
    light.color = vector_of(source, "color", glm::vec3(1.0f));
    light.intensity = float_of(source, "intensity", 1.0);
    if (light.intensity < 0.0f) throw Error(where + ": 'intensity' is out of range: " + source["intensity"].dump());
    light.range = float_of(source, "range", 0.0);
    if (light.range < 0.0f) {
      note(where + ": 'range' is out of range: " + source["range"].dump() + "; the light is not limited");
      light.range = 0.0f;
    }
    if (light.type != Light::Type::kSpot) return light;
    constexpr double kRightAngle = 1.5707963267948966;
    const json& spot = source["spot"];
    double inner = spot.value("innerConeAngle", 0.0), outer = spot.value("outerConeAngle", kRightAngle / 2);
    if (!(inner >= 0.0 && inner < outer && outer <= kRightAngle + 1e-4)) {
      note(where + ": the cone angles must be 0 <= inner < outer <= pi / 2, are " + json(inner).dump() + " and " +
           json(outer).dump() + "; the nearest that are right are taken");
      outer = std::clamp(outer, 0.0, kRightAngle);
      inner = std::clamp(inner, 0.0, outer);
    }
    light.inner_cone = static_cast<float>(inner);
    light.outer_cone = static_cast<float>(outer);
    return light;
  }

  // ------------------------------------------------------------------------------------------------------------ nodes

  std::string node_name(std::size_t i) const { return "node " + number(i) + quote_name(scene_.nodes[i].name); }

  void load_nodes() {
    const std::size_t count = document_.size("nodes");
    scene_.nodes.resize(count);
    node_faults_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      try {
        const json& source = document_.use("nodes", i);
        scene_.nodes[i].name = name_of(source);
        load_node(source, node_name(i), scene_.nodes[i]);
      } catch (const Error& e) {
        node_faults_[i] = e.what();
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!node_faults_[i].empty()) continue;
      const auto children = document_.at("nodes", i).find("children");
      if (children == document_.at("nodes", i).end()) continue;
      for (const json& value : *children) {
        const auto c = value.get<std::uint32_t>();
        if (c >= count) {
          node_faults_[i] = node_name(i) + ": there is no node " + number(c);
          break;
        }
        std::uint32_t& parent = scene_.nodes[c].parent;
        if (parent != kNone && node_faults_[c].empty())
          node_faults_[c] = node_name(c) + ": is a child of node " + number(parent) + " and of node " + number(i);
        if (parent == kNone) parent = static_cast<std::uint32_t>(i);
        scene_.nodes[i].children.push_back(c);
      }
    }
    // With one parent each, what cannot be reached from a node without parent hangs on a cycle.
    Scene forest;
    forest.nodes = scene_.nodes;
    for (std::size_t i = 0; i < count; ++i)
      if (scene_.nodes[i].parent == kNone) forest.roots.push_back(static_cast<std::uint32_t>(i));
    std::vector<bool> seen(count, false);
    for (const std::uint32_t node : forest.reachable()) seen[node] = true;
    for (std::size_t i = 0; i < count; ++i)
      if (!seen[i] && node_faults_[i].empty())
        node_faults_[i] = node_name(i) + ": is its own ancestor, or below one that is";
    trees_ = std::move(forest.roots);
  }

  void load_node(const json& source, const std::string& where, Node& node) {
    node.mesh = index_of(source, "mesh");
    if (node.mesh != kNone && node.mesh >= document_.size("meshes"))
      throw Error(where + ": there is no mesh " + number(node.mesh));
    const auto lesser = [&](std::uint32_t index, std::size_t count, const char* what) {
      if (index == kNone || index < count) return index;
      note(where + ": there is no " + what + " " + number(index) + "; the node has none");
      return kNone;
    };
    node.camera = lesser(index_of(source, "camera"), scene_.cameras.size(), "camera");
    if (const json* light = extension(source, "KHR_lights_punctual"))
      node.light = lesser(index_of(*light, "light"), scene_.lights.size(), "light");
    if (const auto matrix = source.find("matrix"); matrix != source.end()) {
      node.has_matrix = true;
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) node.matrix[c][r] = (*matrix)[static_cast<std::size_t>(4 * c + r)].get<double>();
      for (int c = 0; c < 4; ++c)
        if (std::abs(node.matrix[c][3] - (c == 3)) > 1e-6)
          throw Error(where + ": 'matrix' is not affine (last row is not 0 0 0 1)");
      for (int c = 0; c < 4; ++c) node.matrix[c][3] = c == 3;
      return;
    }
    node.translation = vector_of(source, "translation", glm::dvec3(0.0));
    node.scale = vector_of(source, "scale", glm::dvec3(1.0));
    const auto v = vector_of(source, "rotation", glm::dvec4(0, 0, 0, 1));
    const glm::dquat q(v.w, v.x, v.y, v.z);
    const double length = glm::length(q);
    if (length > 1e-6 && length < 1e6)
      node.rotation = q / length;
    else
      note(where + ": 'rotation' is not a unit quaternion; there is no rotation");
  }

  void choose_scene() {
    const std::size_t count = document_.size("scenes");
    const std::uint32_t named = index_of(document_.root(), "scene");
    if (options_.scene && *options_.scene >= count)
      throw Error("there is no scene " + number(*options_.scene) + "; the file has " + number(count));
    if (!options_.scene && named != kNone && named >= count)
      throw Error("'scene' is " + number(named) + ", but the file has " + number(count) + " scenes");
    if (count == 0) {
      if (!scene_.nodes.empty()) note("the file has no scene; all nodes are taken");
      for (const std::string& fault : node_faults_)
        if (!fault.empty()) throw Error(fault);
      scene_.roots = trees_;
      return;
    }
    const std::size_t index = options_.scene ? *options_.scene : named != kNone ? named : 0;
    const json& source = document_.use("scenes", index);
    const std::string where = "scene " + number(index) + quote_name(name_of(source));
    std::vector<bool> seen(scene_.nodes.size(), false);
    if (source.contains("nodes"))
      for (const json& root : source["nodes"]) {
        const auto node = root.get<std::uint32_t>();
        if (node >= scene_.nodes.size()) throw Error(where + ": there is no node " + number(node));
        if (!node_faults_[node].empty()) throw Error(node_faults_[node]);
        if (scene_.nodes[node].parent != kNone)
          throw Error(where + ": node " + number(node) + " is a root and a child of node " +
                      number(scene_.nodes[node].parent));
        if (!seen[node]) scene_.roots.push_back(node);
        seen[node] = true;
      }
    for (const std::uint32_t node : scene_.reachable()) {
      if (!node_faults_[node].empty()) throw Error(node_faults_[node]);
      seen[node] = true;
    }
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
      if (!seen[i] && !node_faults_[i].empty()) note(node_faults_[i] + "; it is not used");
  }

  /// EXT_mesh_gpu_instancing: a child for each instance, behind the nodes of the file.
  void add_instances() {
    std::size_t total = 0;
    for (const std::uint32_t n : scene_.reachable()) {
      const json& source = document_.at("nodes", n);
      const json* instancing = extension(source, "EXT_mesh_gpu_instancing");
      if (!instancing || scene_.nodes[n].mesh == kNone) continue;
      const std::string where = node_name(n) + " EXT_mesh_gpu_instancing";
      const auto attributes = instancing->find("attributes");
      if (source.contains("skin") || attributes == instancing->end() || attributes->empty()) {
        note(where + (source.contains("skin") ? ": a skinned mesh has no instances" : ": has no attributes") +
             "; the mesh is shown once");
        continue;
      }
      std::vector<Node> instances;
      bool first = true;
      for (const auto& [name, value] : attributes->items()) {
        const bool rotation = name == "ROTATION";
        if (!rotation && name != "TRANSLATION" && name != "SCALE") continue;  // of the application
        const Accessor a = accessors_.open(value.get<std::size_t>(), where + ": " + name);
        a.expect(rotation ? 4 : 3, rotation ? 4 : 3, rotation ? gltf::kFloats | gltf::kShortSigned : gltf::kAnyShort);
        if (first) {
          total += a.count;
          if (total > kMaxInstances)
            throw Error(where + ": the file has more than " + number(kMaxInstances) + " instances");
          instances.resize(a.count);
        } else if (a.count != instances.size()) {
          throw Error(a.where + ": has " + number(a.count) + " elements, but another attribute has " +
                      number(instances.size()));
        }
        first = false;
        const gltf::Numbers numbers = accessors_.numbers(a);
        for (std::size_t i = 0; i < instances.size(); ++i) {
          const double* x = numbers.values.data() + i * numbers.components;
          if (rotation) {
            const glm::dquat q(x[3], x[0], x[1], x[2]);
            const double length = glm::length(q);
            if (length > 1e-6)
              instances[i].rotation = q / length;
            else
              note(a.where + ": a rotation is not a unit quaternion; there is no rotation");
          } else {
            (name == "SCALE" ? instances[i].scale : instances[i].translation) = {x[0], x[1], x[2]};
          }
        }
      }
      for (Node& instance : instances) {
        instance.name = scene_.nodes[n].name;
        instance.source = instance.parent = n;
        instance.mesh = scene_.nodes[n].mesh;
        scene_.nodes[n].children.push_back(static_cast<std::uint32_t>(scene_.nodes.size()));
        scene_.nodes.push_back(std::move(instance));
      }
      if (!first) scene_.nodes[n].mesh = kNone;
    }
  }

  void check_transforms() {
    const std::vector<glm::dmat4> world = scene_.world_transforms();
    for (const std::uint32_t node : scene_.reachable())
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r)
          if (!std::isfinite(world[node][c][r])) throw Error(node_name(node) + ": the world transform is not finite");
  }

  Document& document_;
  Accessors accessors_;
  const GltfOptions& options_;
  Scene scene_;
  std::vector<std::string> node_faults_;
  std::vector<std::uint32_t> trees_;
  std::vector<bool> used_meshes_, used_materials_;
  std::map<std::pair<std::size_t, gltf::Content>, std::uint32_t> textures_, images_;
  std::vector<std::uint32_t> texture_images_;  ///< by Scene::textures: the image it shows
  std::map<std::string, std::pair<std::string, std::size_t>> left_out_;
  std::size_t vertices_ = 0, triangles_ = 0;
};

Scene load(std::span<const std::uint8_t> bytes, std::optional<std::filesystem::path> folder, const GltfOptions& options,
           const std::string& name, std::vector<std::string>* notes) {
  try {
    Document document(bytes, std::move(folder));
    Scene scene = Loader(document, options).run();
    if (notes)
      for (const std::string& note : document.take_notes()) notes->push_back(name + ": " + note);
    return scene;
  } catch (const Error& e) {
    throw Error(name + ": " + e.what());
  }
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options, std::vector<std::string>* notes) {
  Bytes bytes;
  try {
    bytes = gltf::read_file(path);
  } catch (const Error& e) {
    throw Error(path.string() + ": " + e.what());
  }
  Scene scene = load(bytes, path.has_parent_path() ? path.parent_path() : std::filesystem::path("."), options,
                     path.string(), notes);
  scene.name = path.filename().string();
  return scene;
}

Scene load_gltf_memory(std::span<const std::uint8_t> bytes, const GltfOptions& options,
                       std::vector<std::string>* notes) {
  Scene scene = load(bytes, std::nullopt, options, "memory", notes);
  scene.name = "memory";
  return scene;
}

std::vector<std::filesystem::path> gltf_files(const std::filesystem::path& path) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status)) return {};
  std::vector<std::filesystem::path> files = {path};
  try {
    const Bytes bytes = gltf::read_file(path);
    const Document document(bytes, path.has_parent_path() ? path.parent_path() : std::filesystem::path("."));
    for (std::filesystem::path& file : document.external_files()) files.push_back(std::move(file));
  } catch (const Error&) {  // load_gltf says what is wrong
  }
  return files;
}

}  // namespace retrace
