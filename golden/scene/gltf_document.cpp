// Container, JSON, schema and resources of a glTF file.
#include "golden/scene/gltf_document.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>

#include "golden/scene/scene.hpp"

namespace retrace::gltf {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 64;                       // glTF itself needs about ten; deeper only in extras
constexpr std::uint64_t kMaxFile = 0xffffffffu;     // GLB's own limit
constexpr std::uint64_t kMaxUnsigned = 1ull << 53;  // what JSON can carry exactly

constexpr std::array kSupported = {"KHR_lights_punctual", "KHR_mesh_quantization", "KHR_materials_emissive_strength",
                                   "KHR_materials_pbrSpecularGlossiness", "KHR_materials_unlit"};

/// Nesting is bounded before anything recursive sees the document.
void check_depth(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxDepth) throw Error("JSON is nested deeper than " + std::to_string(kMaxDepth) + " levels");
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

// ------------------------------------------------------------------------------------------------------------ schema
// Each check takes the object, the key and the object's place in the file; an absent key passes unless it is required.

enum Presence { kOptional, kRequired };

[[noreturn]] void fail(const std::string& where, const std::string& what) { throw Error(where + ": " + what); }

std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 37) + "...";
  return text;
}

const json* find(const json& o, const char* key, Presence presence, const std::string& where) {
  const auto it = o.find(key);
  if (it != o.end()) return &*it;
  if (presence == kRequired) fail(where, std::string("'") + key + "' is missing");
  return nullptr;
}

void check_index_value(const json& value, const std::string& where, const std::string& key) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<std::int32_t>::max())
    fail(where, "'" + key + "' must be an index, is " + shown(value));
}

void check_index(const json& o, const char* key, const std::string& where, Presence presence = kOptional) {
  if (const json* value = find(o, key, presence, where)) check_index_value(*value, where, key);
}

void check_unsigned(const json& o, const char* key, const std::string& where, Presence presence = kOptional) {
  const json* value = find(o, key, presence, where);
  if (value && (!value->is_number_unsigned() || value->get<std::uint64_t>() > kMaxUnsigned))
    fail(where, std::string("'") + key + "' must be a non-negative integer, is " + shown(*value));
}

bool is_finite_number(const json& value) { return value.is_number() && std::isfinite(value.get<double>()); }

void check_number(const json& o, const char* key, const std::string& where, double lower, double upper,
                  Presence presence = kOptional) {
  const json* value = find(o, key, presence, where);
  if (!value) return;
  if (!is_finite_number(*value)) fail(where, std::string("'") + key + "' must be a number, is " + shown(*value));
  const double x = value->get<double>();
  if (!(x >= lower && x <= upper)) fail(where, std::string("'") + key + "' is out of range: " + shown(*value));
}

/// `count` 0: any number of them.
void check_numbers(const json& o, const char* key, std::size_t count, const std::string& where,
                   double limit = std::numeric_limits<double>::max()) {
  const json* value = find(o, key, kOptional, where);
  if (!value) return;
  const auto bad = [&] {
    fail(where, std::string("'") + key + "' must be " + (count ? std::to_string(count) + " " : "") + "numbers, is " +
                    shown(*value));
  };
  if (!value->is_array() || (count && value->size() != count)) bad();
  for (const json& x : *value)
    if (!is_finite_number(x) || std::abs(x.get<double>()) > limit) bad();
}

void check_indices(const json& o, const char* key, const std::string& where) {
  const json* value = find(o, key, kOptional, where);
  if (!value) return;
  if (!value->is_array()) fail(where, std::string("'") + key + "' must be an array of indices, is " + shown(*value));
  for (const json& x : *value) check_index_value(x, where, key);
}

void check_string(const json& o, const char* key, const std::string& where, Presence presence = kOptional) {
  const json* value = find(o, key, presence, where);
  if (value && !value->is_string()) fail(where, std::string("'") + key + "' must be a string, is " + shown(*value));
}

void check_boolean(const json& o, const char* key, const std::string& where) {
  const json* value = find(o, key, kOptional, where);
  if (value && !value->is_boolean())
    fail(where, std::string("'") + key + "' must be true or false, is " + shown(*value));
}

const json* check_object(const json& o, const char* key, const std::string& where, Presence presence = kOptional) {
  const json* value = find(o, key, presence, where);
  if (value && !value->is_object()) fail(where, std::string("'") + key + "' must be an object, is " + shown(*value));
  return value;
}

/// Name and extensions, which any object may have.
void check_common(const json& o, const std::string& where) {
  check_string(o, "name", where);
  if (const json* extensions = check_object(o, "extensions", where))
    for (const auto& [name, value] : extensions->items())
      if (!value.is_object()) fail(where, "extension" + quote_name(name) + " must be an object, is " + shown(value));
}

const json* extension(const json& o, const char* name) {
  const auto extensions = o.find("extensions");
  if (extensions == o.end()) return nullptr;
  const auto it = extensions->find(name);
  return it == extensions->end() ? nullptr : &*it;
}

constexpr double kFloatMax = std::numeric_limits<float>::max();

void check_texture_info(const json& o, const char* key, const std::string& where) {
  if (const json* info = check_object(o, key, where)) {
    const std::string place = where + " " + key;
    check_index(*info, "index", place, kRequired);
    check_index(*info, "texCoord", place);
    check_common(*info, place);
  }
}

void check_buffer(const json& o, const std::string& where) {
  check_unsigned(o, "byteLength", where, kRequired);
  check_string(o, "uri", where);
}

void check_buffer_view(const json& o, const std::string& where) {
  check_index(o, "buffer", where, kRequired);
  check_unsigned(o, "byteOffset", where);
  check_unsigned(o, "byteLength", where, kRequired);
  check_unsigned(o, "byteStride", where);
  check_index(o, "target", where);
  const std::uint64_t stride = o.value("byteStride", std::uint64_t{0});
  if (stride > 252 || stride % 4 != 0)
    fail(where, "'byteStride' must be a multiple of 4 up to 252, is " + std::to_string(stride));
}

void check_accessor(const json& o, const std::string& where) {
  check_index(o, "bufferView", where);
  check_unsigned(o, "byteOffset", where);
  check_boolean(o, "normalized", where);
  check_index(o, "componentType", where, kRequired);
  check_unsigned(o, "count", where, kRequired);
  check_string(o, "type", where, kRequired);
  // JSON has no infinity, but a double that overflows float is one to those who use the bounds; nobody here does.
  check_numbers(o, "min", 0, where);
  check_numbers(o, "max", 0, where);
  const int component = o["componentType"].get<int>();
  if (component < 5120 || component > 5126 || component == 5124)
    fail(where, "'componentType' " + std::to_string(component) + " does not exist");
  const std::string type = o["type"];
  if (type != "SCALAR" && type != "VEC2" && type != "VEC3" && type != "VEC4" && type != "MAT2" && type != "MAT3" &&
      type != "MAT4")
    fail(where, "'type'" + quote_name(type) + " does not exist");
  if (const json* sparse = check_object(o, "sparse", where)) {
    check_index(*sparse, "count", where + " sparse", kRequired);
    for (const char* part : {"indices", "values"}) {
      const json* inner = check_object(*sparse, part, where + " sparse", kRequired);
      check_index(*inner, "bufferView", where + " sparse " + part, kRequired);
      check_index(*inner, "byteOffset", where + " sparse " + part);
      if (part[0] == 'i') check_index(*inner, "componentType", where + " sparse " + part, kRequired);
    }
  }
}

void check_mesh(const json& o, const std::string& where) {
  const json* primitives = find(o, "primitives", kRequired, where);
  if (!primitives->is_array()) fail(where, "'primitives' must be an array, is " + shown(*primitives));
  check_numbers(o, "weights", 0, where);
  for (std::size_t i = 0; i < primitives->size(); ++i) {
    const std::string place = where + " primitive " + std::to_string(i);
    const json& p = (*primitives)[i];
    if (!p.is_object()) fail(place, "must be an object, is " + shown(p));
    check_common(p, place);
    check_index(p, "material", place);
    check_index(p, "mode", place);
    check_index(p, "indices", place);
    if (p.value("mode", 4) > 6) fail(place, "'mode' " + std::to_string(p.value("mode", 4)) + " does not exist");
    const json* attributes = check_object(p, "attributes", place, kRequired);
    for (const auto& [name, value] : attributes->items())
      check_index_value(value, place, "attributes" + quote_name(name));
  }
}

void check_node(const json& o, const std::string& where) {
  for (const char* key : {"mesh", "camera", "skin"}) check_index(o, key, where);
  check_indices(o, "children", where);
  check_numbers(o, "matrix", 16, where);
  check_numbers(o, "translation", 3, where);
  check_numbers(o, "rotation", 4, where);
  check_numbers(o, "scale", 3, where);
  check_numbers(o, "weights", 0, where);
  if (const json* light = extension(o, "KHR_lights_punctual")) check_index(*light, "light", where, kRequired);
}

void check_scene(const json& o, const std::string& where) { check_indices(o, "nodes", where); }

void check_material(const json& o, const std::string& where) {
  check_numbers(o, "emissiveFactor", 3, where, kFloatMax);
  check_string(o, "alphaMode", where);
  check_number(o, "alphaCutoff", where, 0, kFloatMax);
  check_boolean(o, "doubleSided", where);
  for (const char* key : {"normalTexture", "occlusionTexture", "emissiveTexture"}) check_texture_info(o, key, where);
  if (const json* pbr = check_object(o, "pbrMetallicRoughness", where)) {
    check_common(*pbr, where);
    check_numbers(*pbr, "baseColorFactor", 4, where, kFloatMax);
    check_number(*pbr, "metallicFactor", where, -kFloatMax, kFloatMax);
    check_number(*pbr, "roughnessFactor", where, -kFloatMax, kFloatMax);
    check_texture_info(*pbr, "baseColorTexture", where);
    check_texture_info(*pbr, "metallicRoughnessTexture", where);
  }
  if (const json* gloss = extension(o, "KHR_materials_pbrSpecularGlossiness")) {
    check_numbers(*gloss, "diffuseFactor", 4, where, kFloatMax);
    check_number(*gloss, "glossinessFactor", where, 0, 1);
    check_texture_info(*gloss, "diffuseTexture", where);
  }
  if (const json* emissive = extension(o, "KHR_materials_emissive_strength"))
    check_number(*emissive, "emissiveStrength", where, 0, kFloatMax);
}

void check_texture(const json& o, const std::string& where) {
  check_index(o, "source", where);
  check_index(o, "sampler", where);
}

void check_image(const json& o, const std::string& where) {
  check_string(o, "uri", where);
  check_string(o, "mimeType", where);
  check_index(o, "bufferView", where);
}

void check_sampler(const json& o, const std::string& where) {
  for (const char* key : {"magFilter", "minFilter", "wrapS", "wrapT"}) check_index(o, key, where);
}

void check_camera(const json& o, const std::string& where) {
  check_string(o, "type", where, kRequired);
  const std::string type = o["type"];
  if (type == "perspective") {
    const json* p = check_object(o, "perspective", where, kRequired);
    check_common(*p, where);
    check_number(*p, "yfov", where, 1e-6, 3.14159, kRequired);
    check_number(*p, "aspectRatio", where, 1e-6, 1e6);
    check_number(*p, "znear", where, 0, kFloatMax, kRequired);
    check_number(*p, "zfar", where, 0, std::numeric_limits<double>::max());
  } else if (type == "orthographic") {
    const json* p = check_object(o, "orthographic", where, kRequired);
    check_common(*p, where);
    for (const char* key : {"xmag", "ymag"}) {
      check_number(*p, key, where, -kFloatMax, kFloatMax, kRequired);
      if ((*p)[key].get<double>() == 0) fail(where, std::string("'") + key + "' must not be 0");
    }
    check_number(*p, "znear", where, -kFloatMax, kFloatMax, kRequired);
    check_number(*p, "zfar", where, -kFloatMax, std::numeric_limits<double>::max(), kRequired);
  } else {
    fail(where, "'type' must be perspective or orthographic, is" + quote_name(type));
  }
}

void check_lights(const json& root) {
  const json* punctual = extension(root, "KHR_lights_punctual");
  if (!punctual) return;
  const json* lights = find(*punctual, "lights", kRequired, "KHR_lights_punctual");
  if (!lights->is_array()) fail("KHR_lights_punctual", "'lights' must be an array, is " + shown(*lights));
  for (std::size_t i = 0; i < lights->size(); ++i) {
    const std::string where = "light " + std::to_string(i);
    const json& o = (*lights)[i];
    if (!o.is_object()) fail(where, "must be an object, is " + shown(o));
    check_common(o, where);
    check_string(o, "type", where, kRequired);
    const std::string type = o["type"];
    if (type != "directional" && type != "point" && type != "spot")
      fail(where, "'type' must be directional, point or spot, is" + quote_name(type));
    check_numbers(o, "color", 3, where, kFloatMax);
    check_number(o, "intensity", where, 0, kFloatMax);
    check_number(o, "range", where, 0, kFloatMax);
    if (const json* spot = check_object(o, "spot", where, type == "spot" ? kRequired : kOptional)) {
      check_common(*spot, where);
      check_number(*spot, "innerConeAngle", where, 0, 1.5708);
      check_number(*spot, "outerConeAngle", where, 0, 1.5708);
    }
  }
}

struct ArrayRule {
  const char* key;
  const char* singular;
  void (*check)(const json&, const std::string&);
};
constexpr ArrayRule kArrays[] = {
    {"buffers", "buffer", check_buffer},
    {"bufferViews", "bufferView", check_buffer_view},
    {"accessors", "accessor", check_accessor},
    {"meshes", "mesh", check_mesh},
    {"nodes", "node", check_node},
    {"scenes", "scene", check_scene},
    {"materials", "material", check_material},
    {"textures", "texture", check_texture},
    {"images", "image", check_image},
    {"samplers", "sampler", check_sampler},
    {"cameras", "camera", check_camera},
};

// --------------------------------------------------------------------------------------------------------- resources

Bytes decode_base64(std::string_view text) {
  static const std::array<std::int8_t, 256> table = [] {
    std::array<std::int8_t, 256> t;
    t.fill(-1);
    const std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < alphabet.size(); ++i)
      t[static_cast<std::uint8_t>(alphabet[i])] = static_cast<std::int8_t>(i);
    return t;
  }();
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  if (text.size() % 4 == 1) throw Error("data URI: base64 text is cut off");
  Bytes out;
  out.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = table[static_cast<std::uint8_t>(c)];  // NOLINT(bugprone-signed-char-misuse): -1 to 63
    if (digit < 0) throw Error("data URI: a character is not base64");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    if ((held += 6) >= 8) out.push_back(static_cast<std::uint8_t>(bits >> (held -= 8)));
  }
  return out;
}

std::string percent_decode(const std::string& text) {
  const auto hex = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex(text[i + 1]) >= 0 && hex(text[i + 2]) >= 0) {
      out += static_cast<char>(hex(text[i + 1]) * 16 + hex(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::uint32_t little_u32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | static_cast<std::uint32_t>(bytes[at + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 16 | static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

}  // namespace

bool is_supported_extension(const std::string& name) {
  for (const char* known : kSupported)
    if (name == known) return true;
  return false;
}

std::string quote_name(const std::string& name) {
  if (name.empty()) return {};
  std::string text = name.substr(0, 60);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return " '" + text + (name.size() > 60 ? "...'" : "'");
}

Bytes read_file(const std::filesystem::path& path) {
  std::error_code status;
  const auto kind = std::filesystem::status(path, status);
  if (status || !std::filesystem::exists(kind))
    throw Error(std::string("cannot be opened: ") + (status ? status.message() : "no such file"));
  // A pipe or device could block or never end.
  if (!std::filesystem::is_regular_file(kind)) throw Error("cannot be opened: not a regular file");
  const std::uint64_t size = std::filesystem::file_size(path, status);
  if (status) throw Error("cannot be read: " + status.message());
  if (size > kMaxFile) throw Error("is 4 GiB or larger");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(std::string("cannot be opened: ") + std::strerror(errno));
  Bytes bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(file.gcount()) != size) throw Error("cannot be read to its end");
  return bytes;
}

Document::Document(std::span<const std::uint8_t> bytes, std::optional<std::filesystem::path> folder)
    : folder_(std::move(folder)) {
  std::span<const std::uint8_t> text = bytes;
  if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
    if (bytes.size() < 20) throw Error("GLB header is cut off");
    if (const std::uint32_t version = little_u32(bytes, 4); version != 2)
      throw Error("GLB version " + std::to_string(version) + " is not supported (only 2 is)");
    const std::size_t length = little_u32(bytes, 8);
    if (length > bytes.size())
      throw Error("GLB says it has " + std::to_string(length) + " bytes, the file has " + std::to_string(bytes.size()));
    bool has_json = false;
    for (std::size_t at = 12, chunk = 0; at < length; ++chunk) {
      if (length - at < 8) throw Error("GLB chunk " + std::to_string(chunk) + ": header is cut off");
      const std::size_t size = little_u32(bytes, at);
      const std::uint32_t type = little_u32(bytes, at + 4);
      at += 8;
      if (size > length - at) throw Error("GLB chunk " + std::to_string(chunk) + ": is cut off");
      const auto content = bytes.subspan(at, size);
      at += size;
      if (chunk == 0) {
        if (type != 0x4E4F534A) throw Error("GLB chunk 0: is not JSON");
        text = content;
        has_json = true;
      } else if (type == 0x004E4942 && !has_bin_) {
        bin_ = content;
        has_bin_ = true;
      }
    }
    if (!has_json) throw Error("GLB has no JSON chunk");
  }

  const std::string_view characters(reinterpret_cast<const char*>(text.data()), text.size());
  check_depth(characters);
  try {
    json_ = json::parse(characters.begin(), characters.end());
  } catch (const json::exception& e) {
    // "[json.exception.parse_error.101] parse error at line 3, column 5: ..." : the part after the bracket is what
    // helps.
    const std::string what = e.what();
    const std::size_t bracket = what.find("] ");
    std::string message = "is not valid JSON: " + (bracket == std::string::npos ? what : what.substr(bracket + 2));
    for (char& c : message)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    if (message.size() > 300) message = message.substr(0, 297) + "...";
    throw Error(message);
  }
  check();
  buffers_.resize(size("buffers"));
}

std::size_t Document::size(const char* array) const {
  const auto it = json_.find(array);
  return it == json_.end() ? 0 : it->size();
}

void Document::check() const {
  if (!json_.is_object()) throw Error("the JSON is not an object");
  const json* asset = check_object(json_, "asset", "glTF", kRequired);
  check_string(*asset, "version", "asset", kRequired);
  const std::string version = (*asset)["version"];
  if (version.rfind("2.", 0) != 0)
    fail("asset", "glTF version" + quote_name(version) + " is not supported (only 2.x is)");
  check_common(*asset, "asset");
  check_common(json_, "glTF");

  for (const char* key : {"extensionsRequired", "extensionsUsed"}) {
    const json* list = find(json_, key, kOptional, "glTF");
    if (!list) continue;
    if (!list->is_array()) fail("glTF", std::string("'") + key + "' must be an array, is " + shown(*list));
    for (const json& name : *list) {
      if (!name.is_string()) fail("glTF", std::string("'") + key + "' must hold strings, holds " + shown(name));
      if (key == std::string("extensionsRequired") && !is_supported_extension(name))
        throw Error("requires the extension" + quote_name(name) + ", which is not supported");
    }
  }

  for (const ArrayRule& rule : kArrays) {
    const json* list = find(json_, rule.key, kOptional, "glTF");
    if (!list) continue;
    if (!list->is_array()) fail("glTF", std::string("'") + rule.key + "' must be an array, is " + shown(*list));
    for (std::size_t i = 0; i < list->size(); ++i) {
      const json& o = (*list)[i];
      std::string where = std::string(rule.singular) + " " + std::to_string(i);
      if (!o.is_object()) fail(where, "must be an object, is " + shown(o));
      check_common(o, where);
      if (o.contains("name")) where += quote_name(o["name"]);
      rule.check(o, where);
    }
  }
  check_index(json_, "scene", "glTF");
  check_lights(json_);
}

std::string Document::model_json() const {
  json model = json::object();
  for (const auto& [key, value] : json_.items())
    if (key != "buffers" && key != "images" && key != "animations" && key != "skins" && key != "extras")
      model[key] = value;
  if (model.contains("meshes"))
    for (json& mesh : model["meshes"])
      for (json& primitive : mesh["primitives"]) primitive.erase("targets");
  return model.dump();
}

Bytes Document::resolve(const std::string& uri) const {
  if (uri.rfind("data:", 0) == 0) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos || comma < 7 || uri.compare(comma - 7, 7, ";base64") != 0)
      throw Error("data URI: is not base64");
    return decode_base64(std::string_view(uri).substr(comma + 1));
  }
  if (!folder_) throw Error("external file" + quote_name(uri) + " cannot be opened when loading from memory");
  const std::string name = percent_decode(uri);
  const std::filesystem::path relative = std::filesystem::path(name).lexically_normal();
  if (name.empty() || name.find('\0') != std::string::npos)
    throw Error("URI" + quote_name(uri) + " is not a file name");
  if (name.find("://") != std::string::npos)
    throw Error("URI" + quote_name(uri) + ": only files and data URIs are supported");
  if (relative.is_absolute() || relative.begin() == relative.end() || *relative.begin() == "..")
    throw Error("file" + quote_name(name) + " lies outside the folder of the glTF file");
  try {
    return read_file(*folder_ / relative);
  } catch (const Error& e) {
    throw Error("file" + quote_name(name) + " " + e.what());
  }
}

std::span<const std::uint8_t> Document::buffer(std::size_t index) {
  if (index >= buffers_.size()) throw Error("there is no buffer " + std::to_string(index));
  Buffer& buffer = buffers_[index];
  if (buffer.loaded) return buffer.bytes;
  const json& o = at("buffers", index);
  const std::string where = "buffer " + std::to_string(index);
  const std::uint64_t length = o["byteLength"];
  if (o.contains("uri")) {
    try {
      buffer.storage = resolve(o["uri"]);
    } catch (const Error& e) {
      fail(where, e.what());
    }
    buffer.bytes = buffer.storage;
  } else if (index == 0 && has_bin_) {
    buffer.bytes = bin_;
  } else {
    fail(where, "has no URI, and the file has no binary chunk for it");
  }
  if (length > buffer.bytes.size())
    fail(where, "'byteLength' is " + std::to_string(length) + ", but there are " + std::to_string(buffer.bytes.size()) +
                    " bytes");
  buffer.bytes = buffer.bytes.first(length);
  buffer.loaded = true;
  return buffer.bytes;
}

std::span<const std::uint8_t> Document::view(std::size_t index) {
  if (index >= size("bufferViews")) throw Error("there is no bufferView " + std::to_string(index));
  const json& o = at("bufferViews", index);
  const std::string where = "bufferView " + std::to_string(index);
  const std::size_t target = o["buffer"];
  std::span<const std::uint8_t> bytes;
  try {
    bytes = buffer(target);
  } catch (const Error& e) {
    fail(where, e.what());
  }
  const std::uint64_t offset = o.value("byteOffset", std::uint64_t{0}), length = o["byteLength"];
  if (offset > bytes.size() || length > bytes.size() - offset)
    fail(where, std::to_string(length) + " bytes from " + std::to_string(offset) + " reach outside buffer " +
                    std::to_string(target) + " of " + std::to_string(bytes.size()) + " bytes");
  return bytes.subspan(offset, length);
}

std::span<const std::uint8_t> Document::image(std::size_t index, Bytes& storage) {
  const json& o = at("images", index);
  const bool has_uri = o.contains("uri"), has_view = o.contains("bufferView");
  if (has_uri == has_view) throw Error("must have either 'uri' or 'bufferView'");
  if (has_view) return view(o["bufferView"].get<std::size_t>());
  storage = resolve(o["uri"]);
  return storage;
}

}  // namespace retrace::gltf
