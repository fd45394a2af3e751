// Second stage of the glTF loader: the checked document, parsed by tinygltf, to a Scene. Everything that one part of
// the file says about another (indices, accessor ranges, counts, the hierarchy) is checked here, when it is used.
#include "golden/scene/gltf_loader.hpp"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "golden/scene/gltf_document.hpp"
#include "golden/scene/gltf_image.hpp"

namespace retrace {
namespace {

using gltf::Bytes;
using gltf::Document;
using gltf::quote_name;
using nlohmann::json;

// Bounds on memory: few bytes can stand for much (shared or sparse accessors, compressed images).
constexpr std::size_t kMaxVertices = std::size_t{1} << 26;     // over all primitives
constexpr std::size_t kMaxTriangles = std::size_t{1} << 25;    // over all primitives
constexpr std::size_t kMaxSparseZeros = std::size_t{1} << 22;  // elements of accessors without a buffer view
constexpr std::uint64_t kMaxTexels = std::uint64_t{1} << 27;   // over all images
constexpr std::size_t kMaxWarnings = 100;

/// An accessor whose every element is known to lie inside the file.
struct AccessorView {
  std::string where;
  const std::uint8_t* data = nullptr;  // null: zeros
  std::size_t stride = 0, count = 0;
  int component = 0, components = 0;
  bool normalized = false;
  std::vector<std::uint32_t> sparse_indices;  // ascending
  const std::uint8_t* sparse_values = nullptr;
  std::size_t element_size = 0;

  /// Bytes of an element; null: all components are 0.
  const std::uint8_t* element(std::size_t i) const {
    if (!sparse_indices.empty()) {
      const auto it = std::lower_bound(sparse_indices.begin(), sparse_indices.end(), i);
      if (it != sparse_indices.end() && *it == i)
        return sparse_values + static_cast<std::size_t>(it - sparse_indices.begin()) * element_size;
    }
    return data ? data + i * stride : nullptr;
  }
};

std::size_t component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    default:
      return 4;
  }
}

const char* component_name(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return "BYTE";
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return "UNSIGNED_BYTE";
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return "SHORT";
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return "UNSIGNED_SHORT";
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return "UNSIGNED_INT";
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return "FLOAT";
    default:
      return "unknown";
  }
}

template <class T>
T load_as(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof value);  // glTF and every supported host are little endian; alignment is not promised
  return value;
}

/// glTF 2.0, 3.6.2.2 and "Animations": normalised integers to [0, 1] or [-1, 1]; otherwise the integer's value.
float component_value(const std::uint8_t* p, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const float x = load_as<std::int8_t>(p);
      return normalized ? std::max(x / 127.0f, -1.0f) : x;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p / (normalized ? 255.0f : 1.0f);
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const float x = load_as<std::int16_t>(p);
      return normalized ? std::max(x / 32767.0f, -1.0f) : x;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load_as<std::uint16_t>(p) / (normalized ? 65535.0f : 1.0f);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return static_cast<float>(load_as<std::uint32_t>(p));
    default:
      return load_as<float>(p);
  }
}

std::uint32_t index_value(const std::uint8_t* p, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load_as<std::uint16_t>(p);
    default:
      return load_as<std::uint32_t>(p);
  }
}

// Component types by bit, relative to BYTE. What KHR_mesh_quantization adds is taken also where the file does not
// announce it.
constexpr unsigned bit(int type) { return 1u << (type - TINYGLTF_COMPONENT_TYPE_BYTE); }
constexpr unsigned kFloat = bit(TINYGLTF_COMPONENT_TYPE_FLOAT);
constexpr unsigned kUnsigned = bit(TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) | bit(TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
constexpr unsigned kSigned = bit(TINYGLTF_COMPONENT_TYPE_BYTE) | bit(TINYGLTF_COMPONENT_TYPE_SHORT);
constexpr unsigned kPositionTypes = kFloat | kUnsigned | kSigned;
constexpr unsigned kNormalTypes = kFloat | kSigned;
constexpr unsigned kColorTypes = kFloat | kUnsigned;

std::string number(std::size_t n) { return std::to_string(n); }

const json* extension(const json& o, const char* name) {
  const auto extensions = o.find("extensions");
  if (extensions == o.end()) return nullptr;
  const auto it = extensions->find(name);
  return it == extensions->end() ? nullptr : &*it;
}

class Loader {
 public:
  Loader(Document& document, const GltfOptions& options, std::vector<std::string>& warnings)
      : document_(document), options_(options), warnings_(warnings) {}

  Scene run() {
    tinygltf::TinyGLTF parser;
    const std::string text = document_.model_json();
    std::string error, warning;
    bool parsed = false;
    try {
      parsed =
          parser.LoadASCIIFromString(&model_, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "");
    } catch (const std::exception& e) {
      error = e.what();
    }
    if (!parsed || !error.empty()) {
      if (error.empty()) error = "is not a glTF file";
      throw Error(error.substr(0, std::min<std::size_t>(error.find('\n'), 300)));
    }

    for (const std::string& name : model_.extensionsUsed)
      if (!gltf::is_supported_extension(name)) warn("extension" + quote_name(name) + " is not supported and left out");
    load_materials();
    for (std::size_t i = 0; i < model_.meshes.size(); ++i) load_mesh(i);
    load_cameras();
    load_lights();
    load_nodes();
    choose_scene();
    check_transforms();
    return std::move(scene_);
  }

 private:
  void warn(const std::string& text) {
    if (warnings_.size() < kMaxWarnings)
      warnings_.push_back(text);
    else if (warnings_.size() == kMaxWarnings)
      warnings_.push_back("more warnings are left out");
  }

  // -------------------------------------------------------------------------------------------------------- accessors

  AccessorView accessor(int index, const std::string& user) {
    AccessorView view;
    view.where = user + " accessor " + std::to_string(index);
    if (static_cast<std::size_t>(index) >= model_.accessors.size())
      throw Error(view.where + ": there is no such accessor");
    const tinygltf::Accessor& a = model_.accessors[static_cast<std::size_t>(index)];
    view.component = a.componentType;
    view.components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(a.type));
    view.normalized = a.normalized;
    view.count = a.count;
    if (a.type > 4 && a.type != TINYGLTF_TYPE_SCALAR) throw Error(view.where + ": matrices cannot stand here");
    if (a.count > std::numeric_limits<std::uint32_t>::max()) throw Error(view.where + ": 'count' is too large");
    view.element_size = component_size(a.componentType) * static_cast<std::size_t>(view.components);
    if (a.bufferView >= 0) {
      const auto bytes = view_bytes(a.bufferView, view.where);
      const std::size_t declared = model_.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
      view.stride = declared ? declared : view.element_size;
      if (view.stride < view.element_size)
        throw Error(view.where + ": 'byteStride' of bufferView " + std::to_string(a.bufferView) + " is " +
                    number(view.stride) + ", less than an element of " + number(view.element_size) + " bytes");
      view.data = range(bytes, a.byteOffset, view.count, view.stride, view.element_size, view.where);
    } else if (!a.sparse.isSparse) {
      throw Error(view.where + ": has neither a bufferView nor sparse values");
    } else {
      zeros_ += view.count;
      if (zeros_ > kMaxSparseZeros) throw Error(view.where + ": too many elements without a bufferView");
    }
    if (a.sparse.isSparse) add_sparse(view, a);
    return view;
  }

  void add_sparse(AccessorView& view, const tinygltf::Accessor& a) {
    const std::string where = view.where + " sparse";
    const auto count = static_cast<std::size_t>(a.sparse.count);
    if (count > view.count) throw Error(where + ": more values than the accessor has elements");
    const int type = a.sparse.indices.componentType;
    if (!is_index_type(type))
      throw Error(where + " indices: component type " + component_name(type) + " is not allowed");
    const std::uint8_t* indices = range(view_bytes(a.sparse.indices.bufferView, where + " indices"),
                                        static_cast<std::size_t>(a.sparse.indices.byteOffset), count,
                                        component_size(type), component_size(type), where + " indices");
    view.sparse_values = range(view_bytes(a.sparse.values.bufferView, where + " values"),
                               static_cast<std::size_t>(a.sparse.values.byteOffset), count, view.element_size,
                               view.element_size, where + " values");
    view.sparse_indices.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t value = index_value(indices + i * component_size(type), type);
      if (value >= view.count || (i > 0 && value <= view.sparse_indices[i - 1]))
        throw Error(where + " indices: index " + number(i) + " is " + number(value) +
                    (value >= view.count ? ", out of range" : ", not ascending"));
      view.sparse_indices[i] = value;
    }
  }

  std::span<const std::uint8_t> view_bytes(int index, const std::string& where) {
    try {
      return document_.view(static_cast<std::size_t>(index));
    } catch (const Error& e) {
      throw Error(where + ": " + e.what());
    }
  }

  static const std::uint8_t* range(std::span<const std::uint8_t> bytes, std::size_t offset, std::size_t count,
                                   std::size_t stride, std::size_t size, const std::string& where) {
    if (count == 0) return bytes.data();
    // offset + (count - 1) * stride + size <= bytes.size(), arranged so that nothing can overflow.
    if (offset > bytes.size() || size > bytes.size() - offset || (count - 1) > (bytes.size() - offset - size) / stride)
      throw Error(where + ": " + number(count) + " elements from byte " + number(offset) +
                  " reach outside the bufferView of " + number(bytes.size()) + " bytes");
    return bytes.data() + offset;
  }

  static bool is_index_type(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  }

  /// The elements `used` (all, if null) of an accessor as vectors. `fill` stands for components that the accessor
  /// lacks.
  template <class Vec>
  std::vector<Vec> gather(const AccessorView& view, const std::vector<std::uint32_t>* used, Vec fill) {
    std::vector<Vec> out(used ? used->size() : view.count, fill);
    const std::size_t size = component_size(view.component);
    const int components = std::min<int>(view.components, Vec::length());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::uint8_t* element = view.element(used ? (*used)[i] : i);
      for (int c = 0; c < components; ++c)
        out[i][c] = element
                        ? component_value(element + static_cast<std::size_t>(c) * size, view.component, view.normalized)
                        : 0.0f;
    }
    return out;
  }

  // ----------------------------------------------------------------------------------------------------------- meshes

  void load_mesh(std::size_t index) {
    const tinygltf::Mesh& source = model_.meshes[index];
    const json& raw = document_.at("meshes", index);
    const std::string where = "mesh " + number(index) + quote_name(source.name);
    Mesh mesh;
    mesh.name = source.name;
    for (std::size_t p = 0; p < source.primitives.size(); ++p) {
      const std::string place = where + " primitive " + number(p);
      if (raw["primitives"][p].contains("targets"))
        warn(place + ": morph targets are not supported; the base shape is used");
      mesh.primitives.push_back(load_primitive(source.primitives[p], place));
    }
    scene_.meshes.push_back(std::move(mesh));
  }

  /// A primitive that has nothing to trace keeps its place, empty, so that indices stay those of the file.
  Primitive load_primitive(const tinygltf::Primitive& source, const std::string& where) {
    Primitive out;
    if (source.material >= 0) {
      if (static_cast<std::size_t>(source.material) >= scene_.materials.size())
        throw Error(where + ": there is no material " + std::to_string(source.material));
      out.material = static_cast<std::uint32_t>(source.material);
    }
    if (source.mode < TINYGLTF_MODE_TRIANGLES) {
      warn(where + ": points and lines are left out");
      return out;
    }
    const auto position = source.attributes.find("POSITION");
    if (position == source.attributes.end()) {
      warn(where + ": has no POSITION and is left out");
      return out;
    }
    const AccessorView positions = accessor(position->second, where + ": POSITION");
    expect(positions, TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC3, kPositionTypes);

    std::vector<std::uint32_t> corners = load_indices(source, positions.count, where);
    unroll(source.mode, corners, out, where);
    triangles_ += out.triangles.size();
    if (triangles_ > kMaxTriangles)
      throw Error(where + ": the file has more than " + number(kMaxTriangles) + " triangles");

    // Primitives often share one large vertex buffer: keep what this one uses.
    std::vector<std::uint32_t> used;
    const bool compact = source.indices >= 0 && out.triangles.size() * 3 < positions.count / 2;
    if (compact) used = compact_vertices(out.triangles);
    const std::vector<std::uint32_t>* selection = compact ? &used : nullptr;
    vertices_ += compact ? used.size() : positions.count;
    if (vertices_ > kMaxVertices) throw Error(where + ": the file has more than " + number(kMaxVertices) + " vertices");

    out.positions = gather(positions, selection, glm::vec3(0.0f));
    for (const glm::uvec3& triangle : out.triangles)
      for (int c = 0; c < 3; ++c)
        if (const glm::vec3& p = out.positions[triangle[c]];
            !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
          throw Error(positions.where + ": vertex " + number(compact ? used[triangle[c]] : triangle[c]) +
                      " is not finite");

    if (const AccessorView* view = attribute(source, "NORMAL", positions, where)) {
      expect(*view, TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC3, kNormalTypes);
      out.normals = gather(*view, selection, glm::vec3(0.0f));
    }
    for (int set = 0; set < 2; ++set)
      if (const AccessorView* view = attribute(source, set ? "TEXCOORD_1" : "TEXCOORD_0", positions, where)) {
        expect(*view, TINYGLTF_TYPE_VEC2, TINYGLTF_TYPE_VEC2, kPositionTypes);
        out.texcoords[set] = gather(*view, selection, glm::vec2(0.0f));
      }
    if (const AccessorView* view = attribute(source, "COLOR_0", positions, where)) {
      expect(*view, TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4, kColorTypes);
      out.colors = gather(*view, selection, glm::vec4(1.0f));
    }
    return out;
  }

  static void expect(const AccessorView& view, int type, int other_type, unsigned component_types) {
    // For vectors tinygltf's type code is the number of components.
    if (view.components != type && view.components != other_type)
      throw Error(view.where + ": must have " + std::to_string(type) +
                  (type == other_type ? "" : " or " + std::to_string(other_type)) + " components, has " +
                  std::to_string(view.components));
    if ((component_types & bit(view.component)) == 0)
      throw Error(view.where + ": component type " + component_name(view.component) + " is not allowed");
  }

  const AccessorView* attribute(const tinygltf::Primitive& source, const char* name, const AccessorView& positions,
                                const std::string& where) {
    const auto it = source.attributes.find(name);
    if (it == source.attributes.end()) return nullptr;
    attribute_ = accessor(it->second, where + ": " + name);
    if (attribute_.count != positions.count)
      throw Error(attribute_.where + ": has " + number(attribute_.count) + " elements, but there are " +
                  number(positions.count) + " positions");
    return &attribute_;
  }

  std::vector<std::uint32_t> load_indices(const tinygltf::Primitive& source, std::size_t vertices,
                                          const std::string& where) {
    if (source.indices < 0) {
      if (vertices > kMaxVertices) throw Error(where + ": has more than " + number(kMaxVertices) + " vertices");
      std::vector<std::uint32_t> corners(vertices);
      for (std::size_t i = 0; i < vertices; ++i) corners[i] = static_cast<std::uint32_t>(i);
      return corners;
    }
    const AccessorView view = accessor(source.indices, where + ": indices");
    if (view.components != 1 || !is_index_type(view.component) || view.normalized)
      throw Error(view.where + ": must be unsigned integer scalars");
    if (view.count > 3 * kMaxTriangles)
      throw Error(view.where + ": has more than " + number(3 * kMaxTriangles) + " indices");
    std::vector<std::uint32_t> corners(view.count);
    for (std::size_t i = 0; i < view.count; ++i) {
      const std::uint8_t* element = view.element(i);
      corners[i] = element ? index_value(element, view.component) : 0;
      if (corners[i] >= vertices)
        throw Error(view.where + ": index " + number(i) + " is " + number(corners[i]) + ", but there are " +
                    number(vertices) + " vertices");
    }
    return corners;
  }

  /// Topologies of glTF 2.0, section 3.7.2.1, whose windings these are.
  void unroll(int mode, const std::vector<std::uint32_t>& corners, Primitive& out, const std::string& where) {
    const std::size_t n = corners.size();
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      if (n % 3 != 0)
        warn(where + ": " + number(n) + " corners are no whole number of triangles; the rest is left out");
      out.triangles.resize(n / 3);
      for (std::size_t i = 0; i < n / 3; ++i)
        out.triangles[i] = {corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]};
      return;
    }
    if (n < 3) {
      warn(where + ": " + number(n) + " corners are no triangle");
      return;
    }
    out.triangles.resize(n - 2);
    for (std::size_t i = 0; i + 2 < n; ++i)
      out.triangles[i] = mode == TINYGLTF_MODE_TRIANGLE_STRIP
                             ? glm::uvec3(corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2])
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

  void load_materials() {
    for (std::size_t i = 0; i < model_.materials.size(); ++i) {
      const tinygltf::Material& source = model_.materials[i];
      const json& raw = document_.at("materials", i);
      const std::string where = "material " + number(i) + quote_name(source.name);
      Material m;
      m.name = source.name;
      const auto& pbr = source.pbrMetallicRoughness;
      if (pbr.baseColorFactor.size() == 4)
        for (int c = 0; c < 4; ++c)
          m.base_color[c] = static_cast<float>(pbr.baseColorFactor[static_cast<std::size_t>(c)]);
      m.metallic = static_cast<float>(pbr.metallicFactor);
      m.roughness = static_cast<float>(pbr.roughnessFactor);
      int base = pbr.baseColorTexture.index,
          base_set = pbr.baseColorTexture.index >= 0 ? pbr.baseColorTexture.texCoord : 0;
      if (const json* gloss = extension(raw, "KHR_materials_pbrSpecularGlossiness")) {
        const auto factor = gloss->find("diffuseFactor");
        for (int c = 0; c < 4; ++c)
          m.base_color[c] =
              factor == gloss->end() ? 1.0f : static_cast<float>((*factor)[static_cast<std::size_t>(c)].get<double>());
        m.metallic = 0.0f;
        m.roughness = 1.0f - static_cast<float>(gloss->value("glossinessFactor", 1.0));
        base = -1;
        base_set = 0;
        if (const auto texture = gloss->find("diffuseTexture"); texture != gloss->end()) {
          base = texture->at("index").get<int>();
          base_set = texture->value("texCoord", 0);
        }
      }
      if (base >= 0) assign_texture(base, base_set, m.base_texture, m.base_texcoord, where + " base colour");
      for (int c = 0; c < 3; ++c)
        m.emissive[c] = static_cast<float>(source.emissiveFactor[static_cast<std::size_t>(c)]);
      if (const json* strength = extension(raw, "KHR_materials_emissive_strength"))
        m.emissive *= static_cast<float>(strength->value("emissiveStrength", 1.0));
      if (source.emissiveTexture.index >= 0)
        assign_texture(source.emissiveTexture.index, source.emissiveTexture.texCoord, m.emissive_texture,
                       m.emissive_texcoord, where + " emissive");
      if (source.alphaMode == "MASK")
        m.alpha = Material::Alpha::kMask;
      else if (source.alphaMode == "BLEND")
        m.alpha = Material::Alpha::kBlend;
      else if (source.alphaMode != "OPAQUE")
        throw Error(where + ": 'alphaMode' must be OPAQUE, MASK or BLEND, is" + quote_name(source.alphaMode));
      m.alpha_cutoff = static_cast<float>(source.alphaCutoff);
      m.double_sided = source.doubleSided;
      scene_.materials.push_back(std::move(m));
    }
  }

  void assign_texture(int texture, int set, std::uint32_t& slot, int& slot_set, const std::string& where) {
    if (static_cast<std::size_t>(texture) >= model_.textures.size())
      throw Error(where + ": there is no texture " + std::to_string(texture));
    if (set > 1) {
      warn(where + ": texture coordinates " + std::to_string(set) +
           " are not supported (0 and 1 are); the texture is left out");
      return;
    }
    const std::uint32_t loaded = load_texture(static_cast<std::size_t>(texture));
    if (loaded == kNone) return;
    slot = loaded;
    slot_set = set;
  }

  static Texture::Wrap wrap(int mode, const std::string& where) {
    switch (mode) {
      case TINYGLTF_TEXTURE_WRAP_REPEAT:
        return Texture::Wrap::kRepeat;
      case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
        return Texture::Wrap::kClamp;
      case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
        return Texture::Wrap::kMirror;
      default:
        throw Error(where + ": wrap mode " + std::to_string(mode) + " does not exist");
    }
  }

  std::uint32_t load_texture(std::size_t index) {
    if (const auto it = textures_.find(index); it != textures_.end()) return it->second;
    std::uint32_t& result = textures_[index];
    result = kNone;
    const tinygltf::Texture& source = model_.textures[index];
    const std::string where = "texture " + number(index) + quote_name(source.name);
    Texture texture;
    if (source.sampler >= 0) {
      if (static_cast<std::size_t>(source.sampler) >= model_.samplers.size())
        throw Error(where + ": there is no sampler " + std::to_string(source.sampler));
      const tinygltf::Sampler& sampler = model_.samplers[static_cast<std::size_t>(source.sampler)];
      texture.wrap_u = wrap(sampler.wrapS, where);
      texture.wrap_v = wrap(sampler.wrapT, where);
    }
    if (source.source < 0) {
      warn(where + ": has no image in a supported format and is left out");
      return kNone;
    }
    const auto image = static_cast<std::size_t>(source.source);
    if (image >= document_.size("images")) throw Error(where + ": there is no image " + number(image));
    if (!options_.textures) return kNone;

    if (const auto it = images_.find(image); it != images_.end()) {
      const Texture& first = scene_.textures[it->second];
      if (first.wrap_u == texture.wrap_u && first.wrap_v == texture.wrap_v) return result = it->second;
      charge_texels(first.texels.size(), where);
      texture.name = first.name;
      texture.width = first.width;
      texture.height = first.height;
      texture.texels = first.texels;
    } else {
      const json& raw = document_.at("images", image);
      const std::string name = raw.value("name", std::string());
      const std::string place = "image " + number(image) + quote_name(name);
      try {
        Bytes storage;
        Texture decoded = gltf::decode_image(document_.image(image, storage), kMaxTexels - texels_);
        decoded.wrap_u = texture.wrap_u;
        decoded.wrap_v = texture.wrap_v;
        texture = std::move(decoded);
      } catch (const Error& e) {
        throw Error(place + ": " + e.what());
      }
      charge_texels(texture.texels.size(), place);
      texture.name = name;
      images_[image] = static_cast<std::uint32_t>(scene_.textures.size());
    }
    result = static_cast<std::uint32_t>(scene_.textures.size());
    scene_.textures.push_back(std::move(texture));
    return result;
  }

  void charge_texels(std::size_t count, const std::string& where) {
    texels_ += count;
    if (texels_ > kMaxTexels) throw Error(where + ": the images of the file have too many pixels in total");
  }

  // ------------------------------------------------------------------------------------------------ cameras and lights

  void load_cameras() {
    for (const tinygltf::Camera& source : model_.cameras) {
      Camera camera;
      camera.name = source.name;
      camera.perspective = source.type == "perspective";
      if (camera.perspective) {
        camera.yfov = source.perspective.yfov;
        camera.aspect = source.perspective.aspectRatio;
        camera.znear = source.perspective.znear;
      } else {
        camera.xmag = std::abs(source.orthographic.xmag);
        camera.ymag = std::abs(source.orthographic.ymag);
        camera.znear = source.orthographic.znear;
      }
      scene_.cameras.push_back(std::move(camera));
    }
  }

  void load_lights() {
    for (std::size_t i = 0; i < model_.lights.size(); ++i) {
      const tinygltf::Light& source = model_.lights[i];
      Light light;
      light.name = source.name;
      light.type = source.type == "directional" ? Light::Type::kDirectional
                   : source.type == "spot"      ? Light::Type::kSpot
                                                : Light::Type::kPoint;
      if (source.color.size() == 3)
        for (int c = 0; c < 3; ++c) light.color[c] = static_cast<float>(source.color[static_cast<std::size_t>(c)]);
      light.intensity = static_cast<float>(source.intensity);
      light.range = static_cast<float>(source.range);
      if (light.type == Light::Type::kSpot) {
        light.inner_cone = static_cast<float>(source.spot.innerConeAngle);
        light.outer_cone = static_cast<float>(source.spot.outerConeAngle);
        if (!(light.inner_cone < light.outer_cone))
          throw Error("light " + number(i) + quote_name(source.name) +
                      ": 'innerConeAngle' must be less than 'outerConeAngle'");
      }
      scene_.lights.push_back(std::move(light));
    }
  }

  // ------------------------------------------------------------------------------------------------------------ nodes

  static glm::dvec3 vec3(const std::vector<double>& v, const glm::dvec3& absent) {
    return v.size() == 3 ? glm::dvec3(v[0], v[1], v[2]) : absent;
  }

  std::string node_name(std::size_t i) const { return "node " + number(i) + quote_name(model_.nodes[i].name); }

  static std::uint32_t reference(int index, std::size_t count, const char* what, const std::string& where) {
    if (index < 0) return kNone;
    if (static_cast<std::size_t>(index) >= count)
      throw Error(where + ": there is no " + what + " " + std::to_string(index));
    return static_cast<std::uint32_t>(index);
  }

  void load_nodes() {
    const std::size_t count = model_.nodes.size();
    scene_.nodes.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const tinygltf::Node& source = model_.nodes[i];
      const std::string where = node_name(i);
      Node& node = scene_.nodes[i];
      node.name = source.name;
      node.mesh = reference(source.mesh, scene_.meshes.size(), "mesh", where);
      node.camera = reference(source.camera, scene_.cameras.size(), "camera", where);
      if (const json* light = extension(document_.at("nodes", i), "KHR_lights_punctual"))
        node.light = reference(light->at("light").get<int>(), scene_.lights.size(), "light", where);
      if (source.skin >= 0) warn(where + ": skins are not supported; the mesh stays in its bind pose");
      if (source.matrix.size() == 16) {
        node.has_matrix = true;
        for (int c = 0; c < 4; ++c)
          for (int r = 0; r < 4; ++r) node.matrix[c][r] = source.matrix[static_cast<std::size_t>(4 * c + r)];
        for (int c = 0; c < 4; ++c)
          if (std::abs(node.matrix[c][3] - (c == 3)) > 1e-6)
            throw Error(where + ": 'matrix' is not affine (last row is not 0 0 0 1)");
        for (int c = 0; c < 4; ++c) node.matrix[c][3] = c == 3;
      } else {
        node.translation = vec3(source.translation, glm::dvec3(0.0));
        node.scale = vec3(source.scale, glm::dvec3(1.0));
        if (source.rotation.size() == 4) {
          const glm::dquat q(source.rotation[3], source.rotation[0], source.rotation[1], source.rotation[2]);
          const double length = glm::length(q);
          if (!(length > 1e-6 && length < 1e6)) throw Error(where + ": 'rotation' is not a unit quaternion");
          node.rotation = q / length;
        }
      }
      for (const int child : source.children) {
        const std::uint32_t c = reference(child, count, "node", where);
        std::uint32_t& parent = scene_.nodes[c].parent;
        if (parent != kNone)
          throw Error(node_name(c) + ": is a child of node " + number(parent) + " and of node " + number(i));
        parent = static_cast<std::uint32_t>(i);
        node.children.push_back(c);
      }
    }
    // With one parent each, what cannot be reached from a node without parent hangs on a cycle.
    Scene forest;
    forest.nodes = scene_.nodes;
    for (std::size_t i = 0; i < count; ++i)
      if (scene_.nodes[i].parent == kNone) forest.roots.push_back(static_cast<std::uint32_t>(i));
    std::vector<bool> seen(count, false);
    for (const std::uint32_t node : forest.reachable()) seen[node] = true;
    const auto first = std::find(seen.begin(), seen.end(), false);
    if (first != seen.end())
      throw Error(node_name(static_cast<std::size_t>(first - seen.begin())) +
                  ": is its own ancestor, or below one that is");
    trees_ = std::move(forest.roots);
  }

  void choose_scene() {
    const std::size_t count = model_.scenes.size();
    if (options_.scene && *options_.scene >= count)
      throw Error("there is no scene " + number(*options_.scene) + "; the file has " + number(count));
    if (!options_.scene && model_.defaultScene >= 0 && static_cast<std::size_t>(model_.defaultScene) >= count)
      throw Error("'scene' is " + std::to_string(model_.defaultScene) + ", but the file has " + number(count) +
                  " scenes");
    if (count == 0) {
      if (!model_.nodes.empty()) warn("the file has no scene; all nodes are taken");
      scene_.roots = trees_;
      return;
    }
    const std::size_t index =
        options_.scene ? *options_.scene : static_cast<std::size_t>(std::max(model_.defaultScene, 0));
    const std::string where = "scene " + number(index) + quote_name(model_.scenes[index].name);
    std::vector<bool> seen(model_.nodes.size(), false);
    for (const int root : model_.scenes[index].nodes) {
      const std::uint32_t node = reference(root, model_.nodes.size(), "node", where);
      if (scene_.nodes[node].parent != kNone)
        throw Error(where + ": node " + number(node) + " is a root and a child of node " +
                    number(scene_.nodes[node].parent));
      if (!seen[node]) scene_.roots.push_back(node);
      seen[node] = true;
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
  const GltfOptions& options_;
  std::vector<std::string>& warnings_;
  tinygltf::Model model_;
  Scene scene_;
  AccessorView attribute_;
  std::vector<std::uint32_t> trees_;
  std::map<std::size_t, std::uint32_t> textures_, images_;
  std::size_t zeros_ = 0, vertices_ = 0, triangles_ = 0;
  std::uint64_t texels_ = 0;
};

Scene load(std::span<const std::uint8_t> bytes, std::optional<std::filesystem::path> folder, const GltfOptions& options,
           std::vector<std::string>* warnings) {
  Document document(bytes, std::move(folder));
  std::vector<std::string> collected;
  Scene scene = Loader(document, options, collected).run();
  if (warnings) warnings->insert(warnings->end(), collected.begin(), collected.end());
  return scene;
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options, std::vector<std::string>* warnings) {
  const std::size_t before = warnings ? warnings->size() : 0;
  try {
    const Bytes bytes = gltf::read_file(path);
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    Scene scene = load(bytes, folder, options, warnings);
    scene.name = path.filename().string();
    if (warnings)
      for (std::size_t i = before; i < warnings->size(); ++i) (*warnings)[i] = path.string() + ": " + (*warnings)[i];
    return scene;
  } catch (const Error& e) {
    throw Error(path.string() + ": " + e.what());
  }
}

Scene load_gltf_memory(std::span<const std::uint8_t> bytes, const GltfOptions& options) {
  try {
    Scene scene = load(bytes, std::nullopt, options, nullptr);
    scene.name = "memory";
    return scene;
  } catch (const Error& e) {
    throw Error(std::string("memory: ") + e.what());
  }
}

}  // namespace retrace
