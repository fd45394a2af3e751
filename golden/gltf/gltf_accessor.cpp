#include "golden/gltf/gltf_accessor.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "golden/scene/scene.hpp"

namespace retrace::gltf {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxZeros = std::size_t{1} << 22;   // elements without data, over the file
constexpr std::size_t kMaxValues = std::size_t{1} << 26;  // numbers handed out, over the file

std::string number(std::size_t n) { return std::to_string(n); }

std::size_t component_size(int type) {
  return type == kByte || type == kUnsignedByte ? 1 : type == kShort || type == kUnsignedShort ? 2 : 4;
}

const char* component_name(int type) {
  switch (type) {
    case kByte:
      return "BYTE";
    case kUnsignedByte:
      return "UNSIGNED_BYTE";
    case kShort:
      return "SHORT";
    case kUnsignedShort:
      return "UNSIGNED_SHORT";
    case kUnsignedInt:
      return "UNSIGNED_INT";
    default:
      return "FLOAT";
  }
}

int components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  const int side = type[3] - '0';  // VEC2 to VEC4, MAT4: checked by the document
  return type[0] == 'V' ? side : side * side;
}

template <class T>
T load_as(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof value);  // glTF and every supported host are little endian; alignment is not promised
  return value;
}

std::uint32_t index_value(const std::uint8_t* p, int type) {
  return type == kUnsignedByte ? *p : type == kUnsignedShort ? load_as<std::uint16_t>(p) : load_as<std::uint32_t>(p);
}

/// Start of `count` elements inside `bytes`.
const std::uint8_t* range(std::span<const std::uint8_t> bytes, std::size_t offset, std::size_t count,
                          std::size_t stride, std::size_t size, const std::string& where) {
  if (count == 0) return bytes.data();
  // offset + (count - 1) * stride + size <= bytes.size(), arranged so that nothing can overflow.
  if (offset > bytes.size() || size > bytes.size() - offset || (count - 1) > (bytes.size() - offset - size) / stride)
    throw Error(where + ": " + number(count) + " elements from byte " + number(offset) +
                " reach outside the bufferView of " + number(bytes.size()) + " bytes");
  return bytes.data() + offset;
}

}  // namespace

const std::uint8_t* Accessor::element(std::size_t i) const {
  if (!sparse_indices.empty()) {
    const auto it = std::lower_bound(sparse_indices.begin(), sparse_indices.end(), i);
    if (it != sparse_indices.end() && *it == i)
      return sparse_values + static_cast<std::size_t>(it - sparse_indices.begin()) * element_size;
  }
  return data ? data + i * stride : nullptr;
}

double Accessor::value(std::size_t i, int component_index) const {
  const std::uint8_t* p = element(i);
  if (!p) return 0.0;
  p += static_cast<std::size_t>(component_index) * component_size(component);
  // glTF 2.0, section 3.6.2.2.
  switch (component) {
    case kByte:
      return normalized ? std::max(load_as<std::int8_t>(p) / 127.0, -1.0) : load_as<std::int8_t>(p);
    case kUnsignedByte:
      return *p / (normalized ? 255.0 : 1.0);
    case kShort:
      return normalized ? std::max(load_as<std::int16_t>(p) / 32767.0, -1.0) : load_as<std::int16_t>(p);
    case kUnsignedShort:
      return load_as<std::uint16_t>(p) / (normalized ? 65535.0 : 1.0);
    case kUnsignedInt:
      return load_as<std::uint32_t>(p);
    default:
      return load_as<float>(p);
  }
}

std::uint32_t Accessor::index(std::size_t i) const {
  const std::uint8_t* p = element(i);
  return p ? index_value(p, component) : 0;
}

void Accessor::expect(int low, int high, unsigned component_types) const {
  if (components < low || components > high)
    throw Error(where + ": must have " + std::to_string(low) + (low == high ? "" : " or " + std::to_string(high)) +
                " components, has " + std::to_string(components));
  if ((component_types & component_bit(component)) == 0)
    throw Error(where + ": component type " + component_name(component) + " is not allowed");
}

std::span<const std::uint8_t> Accessors::bytes(const json& o, const std::string& where) {
  try {
    return document_.view(o.at("bufferView").get<std::size_t>());
  } catch (const Error& e) {
    throw Error(where + ": " + e.what());
  }
}

Accessor Accessors::open(std::size_t index, const std::string& user, bool bounded) {
  Accessor out;
  out.where = user + " accessor " + number(index);
  if (index >= document_.size("accessors")) throw Error(out.where + ": there is no such accessor");
  const json& a = document_.use("accessors", index);
  out.component = a["componentType"].get<int>();
  const std::string type = a["type"];
  if (type == "MAT2" || type == "MAT3") throw Error(out.where + ": matrices cannot stand here");
  out.components = components_of(type);
  out.normalized = a.value("normalized", false);
  const std::uint64_t count = a["count"].get<std::uint64_t>();
  if (count > std::numeric_limits<std::uint32_t>::max()) throw Error(out.where + ": 'count' is too large");
  out.count = count;
  out.element_size = component_size(out.component) * static_cast<std::size_t>(out.components);
  if (a.contains("bufferView")) {
    const auto content = bytes(a, out.where);
    const json& view = document_.use("bufferViews", a["bufferView"].get<std::size_t>());
    const std::size_t declared = view.value("byteStride", std::size_t{0});
    out.stride = declared ? declared : out.element_size;
    if (out.stride < out.element_size)
      throw Error(out.where + ": 'byteStride' of bufferView " + a["bufferView"].dump() + " is " + number(out.stride) +
                  ", less than an element of " + number(out.element_size) + " bytes");
    out.data =
        range(content, a.value("byteOffset", std::size_t{0}), out.count, out.stride, out.element_size, out.where);
  } else if (!bounded) {
    zeros_ += out.count;
    if (zeros_ > kMaxZeros) throw Error(out.where + ": too many elements without a bufferView");
  }
  if (a.contains("sparse")) add_sparse(out, a["sparse"]);
  return out;
}

void Accessors::add_sparse(Accessor& accessor, const json& sparse) {
  const std::string where = accessor.where + " sparse";
  const auto count = sparse["count"].get<std::size_t>();
  if (count > accessor.count) throw Error(where + ": more values than the accessor has elements");
  const json &at = sparse["indices"], &values = sparse["values"];
  const int type = at["componentType"].get<int>();
  if (type < kByte || type > kFloat || (kIndices & component_bit(type)) == 0)
    throw Error(where + " indices: component type " + component_name(type) + " is not allowed");
  const std::size_t size = component_size(type);
  const std::uint8_t* indices = range(bytes(at, where + " indices"), at.value("byteOffset", std::size_t{0}), count,
                                      size, size, where + " indices");
  accessor.sparse_values = range(bytes(values, where + " values"), values.value("byteOffset", std::size_t{0}), count,
                                 accessor.element_size, accessor.element_size, where + " values");
  accessor.sparse_indices.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t value = index_value(indices + i * size, type);
    if (value >= accessor.count || (i > 0 && value <= accessor.sparse_indices[i - 1]))
      throw Error(where + " indices: index " + number(i) + " is " + number(value) +
                  (value >= accessor.count ? ", out of range" : ", not ascending"));
    accessor.sparse_indices[i] = value;
  }
}

Numbers Accessors::numbers(const Accessor& accessor) {
  Numbers out;
  out.count = accessor.count;
  out.components = static_cast<std::size_t>(accessor.components);
  const std::size_t total = out.count * out.components;
  values_ += total;
  if (values_ > kMaxValues) throw Error(accessor.where + ": 'count' is too large, or too many accessors are used");
  out.values.resize(total);
  for (std::size_t i = 0; i < out.count; ++i)
    for (int c = 0; c < accessor.components; ++c) {
      const double value = accessor.value(i, c);
      if (!std::isfinite(value)) throw Error(accessor.where + ": element " + number(i) + " is not finite");
      out.values[i * out.components + static_cast<std::size_t>(c)] = value;
    }
  return out;
}

}  // namespace retrace::gltf
