// GLB: glTF 2.0 specification, section 4.
#include "golden/gltf/glb_writer.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "golden/picture/picture_codec.hpp"

namespace retrace {
namespace {

using json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962, kElementBuffer = 34963;

std::uint8_t to_srgb(float x) {
  const float v = std::clamp(x, 0.0f, 1.0f);
  const float s = v <= 0.0031308f ? v * 12.92f : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(s * 255.0f));
}

Bytes encode_png(const Texture& texture) {
  bool opaque = true;
  for (const glm::vec4& t : texture.texels) opaque = opaque && t.a >= 1.0f;
  const int channels = opaque ? 3 : 4;
  Bytes raw;
  raw.reserve(texture.texels.size() * static_cast<std::size_t>(channels));
  for (const glm::vec4& t : texture.texels) {
    raw.insert(raw.end(), {to_srgb(t.r), to_srgb(t.g), to_srgb(t.b)});
    if (!opaque) raw.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(t.a, 0.0f, 1.0f) * 255.0f)));
  }
  try {
    return picture_codec().encode_png(texture.width, texture.height, channels, raw.data(),
                                      {{"oiio:UnassociatedAlpha", 1}, {"png:compressionLevel", 6}});
  } catch (const Error& error) {
    throw Error("texture '" + texture.name + "' cannot be encoded: " + error.what());
  }
}

/// JSON of a float: the double whose shortest text is the float's shortest text.
double shortest(float x) {
  char text[40];
  const auto [end, status] = std::to_chars(text, text + sizeof text, x);
  double value = 0;
  std::from_chars(text, end, value);
  return value;
}

template <class Vec>
json numbers(const Vec& v) {
  json out = json::array();
  for (int i = 0; i < Vec::length(); ++i) out.push_back(shortest(static_cast<float>(v[i])));
  return out;
}

json exact(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

class Writer {
 public:
  explicit Writer(const Scene& scene) : scene_(scene) {}

  Bytes run() {
    root_["asset"] = {{"version", "2.0"}, {"generator", "Retrace"}};
    root_["scene"] = 0;
    root_["scenes"] = json::array({json::object()});
    if (!scene_.roots.empty()) root_["scenes"][0]["nodes"] = scene_.roots;
    for (const Node& node : scene_.nodes) root_["nodes"].push_back(write_node(node));
    for (const Mesh& mesh : scene_.meshes) root_["meshes"].push_back(write_mesh(mesh));
    for (const Material& material : scene_.materials) root_["materials"].push_back(write_material(material));
    for (const Texture& texture : scene_.textures) write_texture(texture);
    for (const Camera& camera : scene_.cameras) root_["cameras"].push_back(write_camera(camera));
    json lights = json::array();
    for (const Light& light : scene_.lights) lights.push_back(write_light(light));
    if (!lights.empty()) {
      extensions_.insert("KHR_lights_punctual");
      root_["extensions"]["KHR_lights_punctual"]["lights"] = lights;
    }
    if (!extensions_.empty()) root_["extensionsUsed"] = extensions_;
    if (!data_.empty()) root_["buffers"].push_back({{"byteLength", data_.size()}});
    return assemble();
  }

 private:
  json write_node(const Node& node) {
    json o = json::object();
    if (!node.name.empty()) o["name"] = node.name;
    if (!node.children.empty()) o["children"] = node.children;
    if (node.has_matrix) {
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) o["matrix"].push_back(node.matrix[c][r]);
    } else {
      if (node.translation != glm::dvec3(0.0)) o["translation"] = exact(node.translation);
      if (node.rotation != glm::dquat(1.0, 0.0, 0.0, 0.0))
        o["rotation"] = {node.rotation.x, node.rotation.y, node.rotation.z, node.rotation.w};
      if (node.scale != glm::dvec3(1.0)) o["scale"] = exact(node.scale);
    }
    if (node.mesh != kNone) o["mesh"] = node.mesh;
    if (node.camera != kNone) o["camera"] = node.camera;
    if (node.light != kNone) o["extensions"]["KHR_lights_punctual"]["light"] = node.light;
    return o;
  }

  json write_mesh(const Mesh& mesh) {
    json o = json::object();
    if (!mesh.name.empty()) o["name"] = mesh.name;
    o["primitives"] = json::array();
    for (const Primitive& p : mesh.primitives) {
      if (p.positions.empty()) throw Error("mesh '" + mesh.name + "': glTF has no empty primitives");
      json q = json::object();
      q["attributes"]["POSITION"] = write_vectors(p.positions, true);
      if (!p.normals.empty()) q["attributes"]["NORMAL"] = write_vectors(p.normals, false);
      for (int set = 0; set < 2; ++set)
        if (!p.texcoords[set].empty())
          q["attributes"]["TEXCOORD_" + std::to_string(set)] = write_vectors(p.texcoords[set], false);
      if (!p.colors.empty()) q["attributes"]["COLOR_0"] = write_vectors(p.colors, false);
      q["indices"] = write_indices(p);
      if (p.material != kNone) q["material"] = p.material;
      o["primitives"].push_back(std::move(q));
    }
    return o;
  }

  std::size_t add_view(const void* data, std::size_t size, int target) {
    data_.resize((data_.size() + 3) / 4 * 4);
    json view = {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", size}};
    if (target) view["target"] = target;
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    data_.insert(data_.end(), bytes, bytes + size);
    root_["bufferViews"].push_back(std::move(view));
    return root_["bufferViews"].size() - 1;
  }

  std::size_t add_accessor(std::size_t view, int component, std::size_t count, const char* type) {
    root_["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    return root_["accessors"].size() - 1;
  }

  template <class Vec>
  std::size_t write_vectors(const std::vector<Vec>& values, bool bounds) {
    static_assert(sizeof(Vec) == static_cast<std::size_t>(Vec::length()) * sizeof(float));
    constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const std::size_t view = add_view(values.data(), values.size() * sizeof(Vec), kArrayBuffer);
    const std::size_t accessor = add_accessor(view, kFloat, values.size(), kTypes[Vec::length()]);
    if (bounds) {  // required for positions
      Vec lower = values[0], upper = values[0];
      for (const Vec& v : values) {
        for (int i = 0; i < Vec::length(); ++i)
          if (!std::isfinite(v[i])) throw Error("a position is not finite");
        lower = glm::min(lower, v);
        upper = glm::max(upper, v);
      }
      root_["accessors"][accessor]["min"] = numbers(lower);
      root_["accessors"][accessor]["max"] = numbers(upper);
    }
    return accessor;
  }

  std::size_t write_indices(const Primitive& p) {
    const std::size_t count = p.triangles.size() * 3;
    if (p.positions.size() > 65535) {
      const std::size_t view = add_view(p.triangles.data(), count * 4, kElementBuffer);
      return add_accessor(view, kUnsignedInt, count, "SCALAR");
    }
    std::vector<std::uint16_t> narrow;
    narrow.reserve(count);
    for (const glm::uvec3& t : p.triangles)
      for (int c = 0; c < 3; ++c) narrow.push_back(static_cast<std::uint16_t>(t[c]));
    return add_accessor(add_view(narrow.data(), count * 2, kElementBuffer), kUnsignedShort, count, "SCALAR");
  }

  json write_material(const Material& m) {
    json o = json::object();
    if (!m.name.empty()) o["name"] = m.name;
    json& pbr = o["pbrMetallicRoughness"];
    pbr = json::object();
    if (m.base_color != glm::vec4(1.0f)) pbr["baseColorFactor"] = numbers(m.base_color);
    if (m.base_texture != kNone) pbr["baseColorTexture"] = texture_info(m.base_texture, m.base_texcoord);
    if (m.metallic != 1.0f) pbr["metallicFactor"] = shortest(m.metallic);
    if (m.roughness != 1.0f) pbr["roughnessFactor"] = shortest(m.roughness);
    // Core glTF stops at 1; what is brighter carries its strength apart.
    const float strength = std::max({m.emissive.r, m.emissive.g, m.emissive.b});
    if (strength > 0) o["emissiveFactor"] = numbers(strength > 1 ? m.emissive / strength : m.emissive);
    if (strength > 1) {
      extensions_.insert("KHR_materials_emissive_strength");
      o["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = shortest(strength);
    }
    if (m.emissive_texture != kNone) o["emissiveTexture"] = texture_info(m.emissive_texture, m.emissive_texcoord);
    if (m.alpha == Material::Alpha::kMask) o["alphaMode"] = "MASK";
    if (m.alpha == Material::Alpha::kBlend) o["alphaMode"] = "BLEND";
    if (m.alpha == Material::Alpha::kMask && m.alpha_cutoff != 0.5f) o["alphaCutoff"] = shortest(m.alpha_cutoff);
    if (m.double_sided) o["doubleSided"] = true;
    return o;
  }

  static json texture_info(std::uint32_t texture, int set) {
    json o = {{"index", texture}};
    if (set) o["texCoord"] = set;
    return o;
  }

  void write_texture(const Texture& texture) {
    const Bytes png = encode_png(texture);
    json image = json::object();
    if (!texture.name.empty()) image["name"] = texture.name;
    image["mimeType"] = "image/png";
    image["bufferView"] = add_view(png.data(), png.size(), 0);
    const std::size_t index = root_["images"].size();
    root_["images"].push_back(std::move(image));
    constexpr int kWrap[] = {10497, 33071, 33648};
    root_["samplers"].push_back(
        {{"wrapS", kWrap[static_cast<int>(texture.wrap_u)]}, {"wrapT", kWrap[static_cast<int>(texture.wrap_v)]}});
    root_["textures"].push_back({{"sampler", index}, {"source", index}});
  }

  static json write_camera(const Camera& camera) {
    json o = json::object();
    if (!camera.name.empty()) o["name"] = camera.name;
    if (camera.perspective) {
      o["type"] = "perspective";
      json& p = o["perspective"];
      p["yfov"] = camera.yfov;
      if (camera.aspect > 0) p["aspectRatio"] = camera.aspect;
      p["znear"] = camera.znear;
    } else {
      o["type"] = "orthographic";
      o["orthographic"] = {
          {"xmag", camera.xmag}, {"ymag", camera.ymag}, {"znear", camera.znear}, {"zfar", camera.znear + 1e4}};
    }
    return o;
  }

  static json write_light(const Light& light) {
    json o = json::object();
    if (!light.name.empty()) o["name"] = light.name;
    o["type"] = light.type == Light::Type::kDirectional ? "directional"
                : light.type == Light::Type::kSpot      ? "spot"
                                                        : "point";
    o["color"] = numbers(light.color);
    o["intensity"] = shortest(light.intensity);
    if (light.range > 0) o["range"] = shortest(light.range);
    if (light.type == Light::Type::kSpot)
      o["spot"] = {{"innerConeAngle", shortest(light.inner_cone)}, {"outerConeAngle", shortest(light.outer_cone)}};
    return o;
  }

  Bytes assemble() const {
    std::string text = root_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t body = (data_.size() + 3) / 4 * 4;
    const std::size_t total = 12 + 8 + text.size() + (body ? 8 + body : 0);
    if (total > 0xffffffffu) throw Error("the scene needs 4 GiB or more, which a GLB file cannot hold");
    Bytes out;
    out.reserve(total);
    const auto word = [&](std::size_t x) {
      for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(x >> (8 * i)));
    };
    word(0x46546C67);  // "glTF"
    word(2);
    word(total);
    word(text.size());
    word(0x4E4F534A);  // "JSON"
    out.insert(out.end(), text.begin(), text.end());
    if (body) {
      word(body);
      word(0x004E4942);  // "BIN"
      out.insert(out.end(), data_.begin(), data_.end());
      out.resize(total, 0);
    }
    return out;
  }

  const Scene& scene_;
  json root_;
  Bytes data_;
  std::set<std::string> extensions_;
};

}  // namespace

std::vector<std::uint8_t> to_glb(const Scene& scene) { return Writer(scene).run(); }

}  // namespace retrace
