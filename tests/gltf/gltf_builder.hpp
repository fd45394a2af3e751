// Small glTF files for the loader's tests: JSON to be changed at will and a buffer, as .gltf with a data URI or as
// .glb.
#pragma once
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "golden/base/base64.hpp"

namespace retrace::test {

using Bytes = std::vector<std::uint8_t>;
using nlohmann::json;

inline std::string base64(const Bytes& bytes) { return encode_base64(bytes); }

class GltfBuilder {
 public:
  json root = {{"asset", {{"version", "2.0"}}}};
  Bytes buffer;

  static constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
                       kFloat = 5126;

  template <class T>
  int view(const std::vector<T>& values, int stride = 0) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    json v = {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", values.size() * sizeof(T)}};
    if (stride) v["byteStride"] = stride;
    const auto* raw = reinterpret_cast<const std::uint8_t*>(values.data());
    buffer.insert(buffer.end(), raw, raw + values.size() * sizeof(T));
    return add("bufferViews", std::move(v));
  }

  int accessor(int view, int component, std::size_t count, const char* type, std::size_t offset = 0) {
    json a = {{"componentType", component}, {"count", count}, {"type", type}};
    if (view >= 0) a["bufferView"] = view;
    if (offset) a["byteOffset"] = offset;
    return add("accessors", std::move(a));
  }

  /// Values in a view of their own.
  template <class T>
  int values(const std::vector<T>& v, int component, const char* type) {
    const std::string t = type;
    const std::size_t components = t == "SCALAR" ? 1 : static_cast<std::size_t>(t[3] - '0');
    return accessor(view(v), component, v.size() / components, type);
  }
  int floats(const std::vector<float>& v, const char* type) { return values(v, kFloat, type); }

  int add(const char* array, json o) {
    root[array].push_back(std::move(o));
    return static_cast<int>(root[array].size()) - 1;
  }

  /// A mesh of one primitive.
  int mesh(json attributes, int indices = -1, int mode = 4) {
    json p = {{"attributes", std::move(attributes)}, {"mode", mode}};
    if (indices >= 0) p["indices"] = indices;
    return add("meshes", {{"primitives", json::array({p})}});
  }

  /// A node that is a root of scene 0.
  int root_node(json node) {
    const int index = add("nodes", std::move(node));
    if (!root.contains("scenes")) root["scenes"] = json::array({json::object()});
    root["scenes"][0]["nodes"].push_back(index);
    return index;
  }

  /// A whole file: one triangle, mesh 0, node 0, accessor 0 POSITION, accessor 1 indices.
  static GltfBuilder triangle() {
    GltfBuilder b;
    const int positions = b.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int indices = b.values(std::vector<std::uint16_t>{0, 1, 2}, kUnsignedShort, "SCALAR");
    b.root_node({{"mesh", b.mesh({{"POSITION", positions}}, indices)}});
    return b;
  }

  json& primitive() { return root["meshes"][0]["primitives"][0]; }

  Bytes gltf() const {
    json r = root;
    if (!buffer.empty() && !r.contains("buffers"))
      r["buffers"] = json::array(
          {{{"byteLength", buffer.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer)}}});
    const std::string text = r.dump();
    return Bytes(text.begin(), text.end());
  }

  Bytes glb() const {
    json r = root;
    if (!buffer.empty() && !r.contains("buffers")) r["buffers"] = json::array({{{"byteLength", buffer.size()}}});
    return glb(r.dump(), buffer);
  }

  static Bytes glb(std::string text, Bytes bin) {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    bin.resize((bin.size() + 3) / 4 * 4);
    Bytes out;
    const auto word = [&](std::size_t x) {
      for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(x >> (8 * i)));
    };
    word(0x46546C67);
    word(2);
    word(20 + text.size() + (bin.empty() ? 0 : 8 + bin.size()));
    word(text.size());
    word(0x4E4F534A);
    out.insert(out.end(), text.begin(), text.end());
    if (!bin.empty()) {
      word(bin.size());
      word(0x004E4942);
      out.insert(out.end(), bin.begin(), bin.end());
    }
    return out;
  }
};

}  // namespace retrace::test
