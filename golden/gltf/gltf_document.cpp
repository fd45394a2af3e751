// Container, JSON, schema and resources of a glTF file.
#include "golden/gltf/gltf_document.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>

#include "golden/base/base64.hpp"
#include "golden/scene/scene.hpp"

namespace retrace::gltf {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 64;                       // glTF itself needs about ten; extras are skipped
constexpr std::uint64_t kMaxFile = 0xffffffffu;     // GLB's own limit
constexpr std::uint64_t kMaxUnsigned = 1ull << 53;  // what JSON can carry exactly
constexpr std::size_t kMaxNotes = 100;

constexpr std::array kSupported = {"KHR_lights_punctual",
                                   "KHR_mesh_quantization",
                                   "KHR_materials_emissive_strength",
                                   "KHR_materials_pbrSpecularGlossiness",
                                   "KHR_materials_unlit",
                                   "KHR_texture_transform",
                                   "EXT_mesh_gpu_instancing"};

/// Of extensions that change no shape: a file that requires one can be shown without it.
constexpr std::array kShadingPrefixes = {"KHR_materials_",   "KHR_texture_",   "KHR_xmp",     "KHR_technique",
                                         "EXT_texture_",     "EXT_materials_", "EXT_lights_", "MSFT_texture_",
                                         "ADOBE_materials_", "MSFT_packing_"};

bool is_shading_extension(const std::string& name) {
  return std::any_of(kShadingPrefixes.begin(), kShadingPrefixes.end(),
                     [&](const char* prefix) { return name.rfind(prefix, 0) == 0; });
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

/// Supported extensions, which any object may have, are objects; others are nobody's business.
void check_extensions(const json& o, const std::string& where) {
  if (const json* extensions = check_object(o, "extensions", where))
    for (const auto& [name, value] : extensions->items())
      if (!value.is_object() && is_supported_extension(name))
        fail(where, "extension" + quote_name(name) + " must be an object, is " + shown(value));
}

constexpr double kFloatMax = std::numeric_limits<float>::max(), kDoubleMax = std::numeric_limits<double>::max();

void check_buffer(const json& o, const std::string& where) {
  check_unsigned(o, "byteLength", where, kRequired);
  check_string(o, "uri", where);
}

void check_buffer_view(const json& o, const std::string& where) {
  check_index(o, "buffer", where, kRequired);
  check_unsigned(o, "byteOffset", where);
  check_unsigned(o, "byteLength", where, kRequired);
  check_unsigned(o, "byteStride", where);
}

void check_accessor(const json& o, const std::string& where) {
  check_index(o, "bufferView", where);
  check_unsigned(o, "byteOffset", where);
  check_boolean(o, "normalized", where);
  check_index(o, "componentType", where, kRequired);
  check_unsigned(o, "count", where, kRequired);
  check_string(o, "type", where, kRequired);
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
      check_unsigned(*inner, "byteOffset", where + " sparse " + part);
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
    check_extensions(p, place);
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
  if (const json* instancing = extension(o, "EXT_mesh_gpu_instancing"))
    if (const json* attributes = check_object(*instancing, "attributes", where))
      for (const auto& [name, value] : attributes->items())
        check_index_value(value, where, "attributes" + quote_name(name));
}

void check_scene(const json& o, const std::string& where) { check_indices(o, "nodes", where); }

void check_material(const json& o, const std::string& where) {
  check_numbers(o, "emissiveFactor", 3, where, kFloatMax);
  check_string(o, "alphaMode", where);
  check_number(o, "alphaCutoff", where, -kFloatMax, kFloatMax);
  check_boolean(o, "doubleSided", where);
  if (const json* pbr = check_object(o, "pbrMetallicRoughness", where)) {
    check_extensions(*pbr, where);
    check_numbers(*pbr, "baseColorFactor", 4, where, kFloatMax);
    check_number(*pbr, "metallicFactor", where, -kFloatMax, kFloatMax);
    check_number(*pbr, "roughnessFactor", where, -kFloatMax, kFloatMax);
  }
  if (const json* gloss = extension(o, "KHR_materials_pbrSpecularGlossiness")) {
    check_numbers(*gloss, "diffuseFactor", 4, where, kFloatMax);
    check_number(*gloss, "glossinessFactor", where, -kFloatMax, kFloatMax);
  }
  if (const json* emissive = extension(o, "KHR_materials_emissive_strength"))
    check_number(*emissive, "emissiveStrength", where, -kFloatMax, kFloatMax);
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
    check_number(*p, "yfov", where, 1e-6, 3.14159, kRequired);
    check_number(*p, "aspectRatio", where, -kFloatMax, kFloatMax);
    check_number(*p, "znear", where, -kFloatMax, kFloatMax);
    check_number(*p, "zfar", where, -kDoubleMax, kDoubleMax);
  } else if (type == "orthographic") {
    const json* p = check_object(o, "orthographic", where, kRequired);
    for (const char* key : {"xmag", "ymag"}) {
      check_number(*p, key, where, -kFloatMax, kFloatMax, kRequired);
      if ((*p)[key].get<double>() == 0) fail(where, std::string("'") + key + "' must not be 0");
    }
    check_number(*p, "znear", where, -kFloatMax, kFloatMax);
    check_number(*p, "zfar", where, -kDoubleMax, kDoubleMax);
  } else {
    fail(where, "'type' must be perspective or orthographic, is" + quote_name(type));
  }
}

void check_light(const json& o, const std::string& where) {
  check_string(o, "type", where, kRequired);
  const std::string type = o["type"];
  if (type != "directional" && type != "point" && type != "spot")
    fail(where, "'type' must be directional, point or spot, is" + quote_name(type));
  check_numbers(o, "color", 3, where, kFloatMax);
  check_number(o, "intensity", where, -kFloatMax, kFloatMax);
  check_number(o, "range", where, -kFloatMax, kFloatMax);
  if (const json* spot = check_object(o, "spot", where, type == "spot" ? kRequired : kOptional)) {
    check_number(*spot, "innerConeAngle", where, -kFloatMax, kFloatMax);
    check_number(*spot, "outerConeAngle", where, -kFloatMax, kFloatMax);
  }
}

/// Read by animation.cpp, which checks what it uses.
void check_nothing(const json&, const std::string&) {}

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
    {"lights", "light", check_light},
    {"skins", "skin", check_nothing},
    {"animations", "animation", check_nothing},
};

// --------------------------------------------------------------------------------------------------------- resources

std::string percent_decode(std::string_view text) {
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

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<std::uint8_t>(text[i]);
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xc2 ? 0
                               : lead < 0xe0 ? 2
                               : lead < 0xf0 ? 3
                               : lead < 0xf5 ? 4
                                             : 0;
    if (length == 0 || length > text.size() - i) return false;
    const auto second = length > 1 ? static_cast<std::uint8_t>(text[i + 1]) : std::uint8_t{0x80};
    // Overlong forms, surrogates and what lies beyond U+10FFFF.
    if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) || (lead == 0xf0 && second < 0x90) ||
        (lead == 0xf4 && second > 0x8f))
      return false;
    for (std::size_t k = 1; k < length; ++k)
      if ((static_cast<std::uint8_t>(text[i + k]) & 0xc0) != 0x80) return false;
    i += length;
  }
  return true;
}

std::uint32_t little_u32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | static_cast<std::uint32_t>(bytes[at + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 16 | static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

}  // namespace

void check_texture_info(const json& o, const char* key, const std::string& where) {
  if (const json* info = check_object(o, key, where)) {
    const std::string place = where + " " + key;
    check_index(*info, "index", place, kRequired);
    check_index(*info, "texCoord", place);
    check_extensions(*info, place);
    if (const json* transform = extension(*info, "KHR_texture_transform")) {
      check_numbers(*transform, "offset", 2, place, kFloatMax);
      check_numbers(*transform, "scale", 2, place, kFloatMax);
      check_number(*transform, "rotation", place, -kFloatMax, kFloatMax);
      check_index(*transform, "texCoord", place);
    }
  }
}

const json* extension(const json& o, const char* name) {
  const auto extensions = o.find("extensions");
  if (extensions == o.end() || !extensions->is_object()) return nullptr;
  const auto it = extensions->find(name);
  return it == extensions->end() ? nullptr : &*it;
}

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
  const bool binary = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
  parse(binary ? text_of_glb(bytes) : bytes);
  check();
  buffers_.resize(size("buffers"));
}

/// The JSON chunk; finds the binary chunk on the way. The file's size is what counts, whatever its header says.
std::span<const std::uint8_t> Document::text_of_glb(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 20) throw Error("GLB header is cut off");
  if (const std::uint32_t version = little_u32(bytes, 4); version != 2)
    throw Error("GLB version " + std::to_string(version) + " is not supported (only 2 is)");
  if (const std::size_t length = little_u32(bytes, 8); length != bytes.size())
    note("GLB says it has " + std::to_string(length) + " bytes, the file has " + std::to_string(bytes.size()));
  std::span<const std::uint8_t> text;
  for (std::size_t at = 12, chunk = 0; at < bytes.size(); ++chunk) {
    const std::string where = "GLB chunk " + std::to_string(chunk);
    if (bytes.size() - at < 8) {
      note("GLB: " + std::to_string(bytes.size() - at) + " bytes at the end belong to no chunk");
      break;
    }
    std::size_t size = little_u32(bytes, at);
    const std::uint32_t type = little_u32(bytes, at + 4);
    at += 8;
    if (size > bytes.size() - at) {
      // Of a binary chunk what is there may be all that is used.
      if (chunk == 0) throw Error(where + ": is cut off");
      note(where + ": says it has " + std::to_string(size) + " bytes, there are " + std::to_string(bytes.size() - at));
      size = bytes.size() - at;
    }
    const auto content = bytes.subspan(at, size);
    at += size;
    if (chunk == 0) {
      if (type != 0x4E4F534A) throw Error("GLB chunk 0: is not JSON");
      text = content;
    } else if (type == 0x004E4942 && !has_bin_) {
      bin_ = content;
      has_bin_ = true;
    }
  }
  return text;
}

void Document::parse(std::span<const std::uint8_t> text) {
  while (!text.empty() && text.back() == 0) text = text.first(text.size() - 1);  // padding of some writers
  std::string repaired;
  std::string_view characters(reinterpret_cast<const char*>(text.data()), text.size());
  if (!is_utf8(characters)) {
    note("the JSON is not UTF-8; it is read as Latin-1");
    for (const char c : characters) {
      const auto byte = static_cast<std::uint8_t>(c);
      if (byte < 0x80) {
        repaired += c;
      } else {
        repaired += static_cast<char>(0xc0 | byte >> 6);
        repaired += static_cast<char>(0x80 | (byte & 0x3f));
      }
    }
    characters = repaired;
  }
  // Extras are left out as they come, so that their nesting costs nothing. Depths count the containers around.
  int extras = -1;  // depth of the key "extras" whose value is being read
  const auto keep = [&](int depth, json::parse_event_t event, json& value) {
    using Event = json::parse_event_t;
    const bool end = event == Event::object_end || event == Event::array_end;
    if (extras >= 0 && (event == Event::key ? depth > extras : !(end && depth < extras))) return false;
    extras = -1;
    if (event == Event::key && value == "extras") {
      extras = depth;
      return false;
    }
    if (depth > kMaxDepth) throw Error("JSON is nested deeper than " + std::to_string(kMaxDepth) + " levels");
    return true;
  };
  try {
    json_ = json::parse(characters.begin(), characters.end(), keep);
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
}

std::size_t Document::size(const char* array) const {
  const auto it = json_.find(array);
  return it == json_.end() || !it->is_array() ? 0 : it->size();
}

void Document::use_array(const char* array) {
  if (const auto fault = faults_.find({array, kWholeArray}); fault != faults_.end()) {
    fault->second.used = true;
    throw Error(fault->second.message);
  }
}

const json& Document::use(const char* array, std::size_t i) {
  if (const auto fault = faults_.find({array, i}); fault != faults_.end()) {
    fault->second.used = true;  // whoever catches it says so
    throw Error(fault->second.message);
  }
  return at(array, i);
}

void Document::note(const std::string& text) {
  if (notes_.size() > kMaxNotes || std::find(notes_.begin(), notes_.end(), text) != notes_.end()) return;
  notes_.push_back(notes_.size() == kMaxNotes ? "more notes are left out" : text);
}

std::vector<std::string> Document::take_notes() {
  for (const auto& [place, fault] : faults_)
    if (!fault.used) note(fault.message + "; it is not used");
  return std::move(notes_);
}

/// Names and unknown extensions of another type than they should have are left out with a note: nobody needs them.
void Document::tidy(json& o, const std::string& where) {
  if (const auto name = o.find("name"); name != o.end() && !name->is_string()) {
    note(where + ": 'name' must be a string, is " + shown(*name) + "; it is left out");
    o.erase(name);
  }
  if (const auto extensions = o.find("extensions"); extensions != o.end() && extensions->is_object())
    for (const auto& [name, value] : extensions->items()) {
      if (is_supported_extension(name)) continue;
      if (value.is_object())
        note("extension" + quote_name(name) + " is not supported and left out");  // whether the file declares it or not
      else
        note(where + ": extension" + quote_name(name) + " must be an object, is " + shown(value));
    }
}

void Document::check_array(const char* key, const char* singular, void (*rule)(const json&, const std::string&)) {
  const auto list = json_.find(key);
  if (list == json_.end()) return;
  if (!list->is_array()) {
    faults_[{key, kWholeArray}] = {std::string("glTF: '") + key + "' must be an array, is " + shown(*list)};
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    json& o = (*list)[i];
    std::string where = std::string(singular) + " " + std::to_string(i);
    try {
      if (!o.is_object()) fail(where, "must be an object, is " + shown(o));
      tidy(o, where);
      if (o.contains("name")) where += quote_name(o["name"]);
      check_extensions(o, where);
      rule(o, where);
    } catch (const Error& e) {
      faults_[{key, i}] = {e.what()};
      continue;
    }
    if (rule == check_accessor)
      for (const char* bound : {"min", "max"}) {
        try {
          check_numbers(o, bound, 0, where);
        } catch (const Error& e) {
          note(std::string(e.what()) + "; bounds are not used");
        }
      }
    if (rule == check_buffer_view)
      if (const std::uint64_t stride = o.value("byteStride", std::uint64_t{0}); stride > 252 || stride % 4 != 0)
        note(where + ": 'byteStride' should be a multiple of 4 up to 252, is " + std::to_string(stride) +
             "; it is taken as it stands");
  }
}

void Document::check() {
  if (!json_.is_object()) throw Error("the JSON is not an object");
  const json* asset = check_object(json_, "asset", "glTF", kRequired);
  check_string(*asset, "version", "asset", kRequired);
  const std::string version = (*asset)["version"];
  if (version.rfind("2.", 0) != 0)
    fail("asset", "glTF version" + quote_name(version) + " is not supported (only 2.x is)");
  if (const auto least = asset->find("minVersion"); least != asset->end() && *least != "2.0")
    note("asset: 'minVersion' is " + shown(*least) + "; the file is read as glTF 2.0");
  check_extensions(json_, "glTF");

  for (const char* key : {"extensionsRequired", "extensionsUsed"}) {
    const json* list = find(json_, key, kOptional, "glTF");
    if (!list) continue;
    if (!list->is_array()) fail("glTF", std::string("'") + key + "' must be an array, is " + shown(*list));
    for (const json& name : *list) {
      if (!name.is_string()) fail("glTF", std::string("'") + key + "' must hold strings, holds " + shown(name));
      if (is_supported_extension(name)) continue;
      if (key == std::string("extensionsRequired") && !is_shading_extension(name))
        throw Error("requires the extension" + quote_name(name) + ", which is not supported");
      note("extension" + quote_name(name) + " is not supported and left out");
    }
  }

  json_.erase("lights");
  if (const json* punctual = extension(json_, "KHR_lights_punctual"); punctual && punctual->contains("lights")) {
    if (punctual->at("lights").is_array())
      json_["lights"] = json(punctual->at("lights"));
    else
      note("KHR_lights_punctual: 'lights' must be an array, is " + shown(punctual->at("lights")) +
           "; there are no lights");
  }
  for (const ArrayRule& rule : kArrays) check_array(rule.key, rule.singular, rule.check);
  for (const char* key : {"buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes"}) use_array(key);
  check_index(json_, "scene", "glTF");
}

namespace {

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && std::equal(end.begin(), end.end(), text.end() - end.size(), [](char e, char t) {
           return std::tolower(static_cast<unsigned char>(t)) == e;
         });
}

bool is_data_uri(std::string_view uri) { return ends_with(uri.substr(0, 5), "data:"); }

}  // namespace

/// RFC 2397.
Bytes Document::resolve(const std::string& uri) {
  if (!is_data_uri(uri)) return resolve_file(uri);
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos) throw Error("data URI: holds no data");
  const std::string_view payload = std::string_view(uri).substr(comma + 1);
  const bool escaped = payload.find('%') != std::string_view::npos;
  const std::string decoded = escaped ? percent_decode(payload) : std::string();
  const std::string_view content = escaped ? std::string_view(decoded) : payload;
  if (!ends_with(std::string_view(uri).substr(0, comma), ";base64")) return Bytes(content.begin(), content.end());
  try {
    return decode_base64(content);
  } catch (const Error& e) {
    throw Error(std::string("data URI: ") + e.what());
  }
}

/// A relative path, percent-escaped or not, with / or \, from at most kMaxFoldersUp folders above that of the glTF
/// file. The rule holds for the path as it is opened: escapes cannot hide dots or slashes.
std::filesystem::path Document::find_file(const std::string& uri) const {
  if (!folder_) throw Error("external file" + quote_name(uri) + " cannot be opened when loading from memory");
  const std::string decoded = percent_decode(uri);
  std::string turned = decoded;
  std::replace(turned.begin(), turned.end(), '\\', '/');
  const auto check_path = [&](const std::string& name) {
    if (name.empty() || name.find('\0') != std::string::npos)
      throw Error("URI" + quote_name(uri) + " is not a file name");
    if (name.find("://") != std::string::npos)
      throw Error("URI" + quote_name(uri) + ": only files and data URIs are supported");
    const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
    if (path.is_absolute()) throw Error("file" + quote_name(name) + ": absolute paths are not opened");
    int up = 0;
    for (const auto& part : path) up += part == "..";
    if (up > kMaxFoldersUp)
      throw Error("file" + quote_name(name) + " lies more than " + std::to_string(kMaxFoldersUp) +
                  " folders above that of the glTF file");
    return *folder_ / path;
  };
  std::filesystem::path path = check_path(decoded);
  std::error_code status;
  if (!std::filesystem::exists(path, status))
    for (const std::string& other : {uri, turned}) {
      if (other == decoded) continue;
      const std::filesystem::path candidate = check_path(other);
      if (!std::filesystem::exists(candidate, status)) continue;
      path = candidate;
      break;
    }
  return path;
}

Bytes Document::resolve_file(const std::string& uri) const {
  const std::filesystem::path path = find_file(uri);
  try {
    return read_file(path);
  } catch (const Error& e) {
    throw Error("file" + quote_name(percent_decode(uri)) + " " + e.what());
  }
}

std::vector<std::filesystem::path> Document::external_files() const {
  std::vector<std::filesystem::path> files;
  for (const char* array : {"buffers", "images"}) {
    for (std::size_t i = 0; i < size(array); ++i) {
      const json& o = at(array, i);
      if (!o.is_object() || !o.contains("uri") || !o["uri"].is_string()) continue;
      if (is_data_uri(o["uri"].get_ref<const std::string&>())) continue;
      try {
        std::filesystem::path file = find_file(o["uri"].get<std::string>());
        std::error_code status;
        if (std::filesystem::is_regular_file(file, status)) files.push_back(std::move(file));
      } catch (const Error&) {  // one that is never opened
      }
    }
  }
  return files;
}

std::span<const std::uint8_t> Document::buffer(std::size_t index) {
  if (index >= buffers_.size()) throw Error("there is no buffer " + std::to_string(index));
  Buffer& buffer = buffers_[index];
  if (buffer.loaded) return buffer.bytes;
  const json& o = use("buffers", index);
  const std::string where = "buffer " + std::to_string(index);
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
  const std::uint64_t length = o["byteLength"];
  if (length < buffer.bytes.size()) buffer.bytes = buffer.bytes.first(length);
  buffer.loaded = true;
  return buffer.bytes;
}

std::span<const std::uint8_t> Document::view(std::size_t index) {
  if (index >= size("bufferViews")) throw Error("there is no bufferView " + std::to_string(index));
  const json& o = use("bufferViews", index);
  const std::string where = "bufferView " + std::to_string(index);
  const std::size_t target = o["buffer"];
  std::span<const std::uint8_t> bytes;
  try {
    bytes = buffer(target);
  } catch (const Error& e) {
    if (extension(o, "EXT_meshopt_compression"))
      fail(where, "is compressed (EXT_meshopt_compression), which is not supported");
    fail(where, e.what());
  }
  const std::uint64_t offset = o.value("byteOffset", std::uint64_t{0}), length = o["byteLength"];
  if (offset > bytes.size() || length > bytes.size() - offset) {
    const std::uint64_t declared = at("buffers", target)["byteLength"];
    if (declared > bytes.size() && offset <= declared && length <= declared - offset)
      fail(where, "buffer " + std::to_string(target) + ": 'byteLength' is " + std::to_string(declared) +
                      ", but there are " + std::to_string(bytes.size()) + " bytes");
    fail(where, std::to_string(length) + " bytes from " + std::to_string(offset) + " reach outside buffer " +
                    std::to_string(target) + " of " + std::to_string(declared) + " bytes");
  }
  return bytes.subspan(offset, length);
}

std::span<const std::uint8_t> Document::image(std::size_t index, Bytes& storage) {
  const json& o = use("images", index);
  if (o.contains("bufferView")) return view(o["bufferView"].get<std::size_t>());
  if (!o.contains("uri")) throw Error("must have either 'uri' or 'bufferView'");
  storage = resolve(o["uri"]);
  return storage;
}

}  // namespace retrace::gltf
