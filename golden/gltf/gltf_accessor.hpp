// The one reader of glTF accessors (2.0, section 3.6.2): dense, sparse, and those without data, which are zeros.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "golden/gltf/gltf_document.hpp"

namespace retrace::gltf {

enum Component { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

/// Sets of component types, by bit. What KHR_mesh_quantization adds is taken also where the file does not announce it.
constexpr unsigned component_bit(int type) { return 1u << (type - kByte); }
inline constexpr unsigned kFloats = component_bit(kFloat);
inline constexpr unsigned kShortUnsigned = component_bit(kUnsignedByte) | component_bit(kUnsignedShort);
inline constexpr unsigned kShortSigned = component_bit(kByte) | component_bit(kShort);
inline constexpr unsigned kAnyShort = kFloats | kShortUnsigned | kShortSigned;
inline constexpr unsigned kIndices = kShortUnsigned | component_bit(kUnsignedInt);

/// An accessor whose every element is known to lie inside the file.
struct Accessor {
  std::string where;
  std::size_t count = 0;
  int component = 0, components = 0;
  bool normalized = false;

  /// Bytes of an element; null: all components are 0.
  const std::uint8_t* element(std::size_t i) const;
  /// Integers are divided by their largest value where the accessor is normalised.
  double value(std::size_t i, int component_index) const;
  /// For unsigned integers.
  std::uint32_t index(std::size_t i) const;

  /// Throws Error unless there are `low` to `high` components of one of these types.
  void expect(int low, int high, unsigned component_types) const;

  const std::uint8_t* data = nullptr;  ///< null: zeros
  std::size_t stride = 0, element_size = 0;
  std::vector<std::uint32_t> sparse_indices;  ///< ascending
  const std::uint8_t* sparse_values = nullptr;
};

/// Numbers of an accessor.
struct Numbers {
  std::size_t count = 0, components = 0;
  std::vector<double> values;
};

/// Opens accessors of a document and bounds the memory that they may cost: few bytes can stand for much.
class Accessors {
 public:
  explicit Accessors(Document& document) : document_(document) {}

  /// `user` stands in front of messages. Zeros without data are charged unless the caller bounds them: `bounded`.
  Accessor open(std::size_t index, const std::string& user, bool bounded = false);

  /// All of it as finite numbers.
  Numbers numbers(const Accessor& accessor);

 private:
  std::span<const std::uint8_t> bytes(const nlohmann::json& o, const std::string& where);
  void add_sparse(Accessor& accessor, const nlohmann::json& sparse);

  Document& document_;
  std::size_t zeros_ = 0, values_ = 0;
};

/// The elements `used` (all, if null) as vectors. `fill` stands for components that the accessor lacks.
template <class Vec>
std::vector<Vec> gather(const Accessor& accessor, const std::vector<std::uint32_t>* used, Vec fill) {
  std::vector<Vec> out(used ? used->size() : accessor.count, fill);
  const int components = std::min<int>(accessor.components, Vec::length());
  for (std::size_t i = 0; i < out.size(); ++i)
    for (int c = 0; c < components; ++c)
      out[i][c] = static_cast<typename Vec::value_type>(accessor.value(used ? (*used)[i] : i, c));
  return out;
}

}  // namespace retrace::gltf
