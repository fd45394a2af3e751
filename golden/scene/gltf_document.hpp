// First stage of the glTF loader: bytes to a JSON document whose every property that the loader (or tinygltf) reads has
// the right type and range, plus the file's resources. tinygltf checks little of this and touches memory on its word,
// so it only ever sees a document that has passed here, without buffers and images, which are resolved here instead.
// glTF 2.0 specification, sections 3 (concepts), 4 (GLB), 5 (properties reference).
#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace retrace::gltf {

using Bytes = std::vector<std::uint8_t>;

/// The extensions that change what is traced or shaded and are supported.
bool is_supported_extension(const std::string& name);

/// A name out of a file, fit to stand in a one-line message: " 'name'", shortened, without control characters; empty
/// for none.
std::string quote_name(const std::string& name);

/// Whole regular file. Throws Error (without a location) if it cannot be read or is 4 GiB or more.
Bytes read_file(const std::filesystem::path& path);

class Document {
 public:
  /// Parses and checks. `folder` is where relative URIs are looked up; none: no external file may be opened.
  /// `bytes` must outlive the document. Throws Error that says what is wrong and where inside the file.
  Document(std::span<const std::uint8_t> bytes, std::optional<std::filesystem::path> folder);

  std::size_t size(const char* array) const;
  const nlohmann::json& at(const char* array, std::size_t i) const { return json_.at(array).at(i); }

  /// JSON text for tinygltf: buffers, images, animations, skins, morph targets and extras left out.
  std::string model_json() const;

  /// Bytes of a buffer view; resolves its buffer on first use.
  std::span<const std::uint8_t> view(std::size_t index);
  /// Bytes of an encoded image (file, data URI or buffer view); `storage` keeps them where nothing else does.
  std::span<const std::uint8_t> image(std::size_t index, Bytes& storage);

 private:
  std::span<const std::uint8_t> buffer(std::size_t index);
  Bytes resolve(const std::string& uri) const;
  void check() const;

  nlohmann::json json_;
  std::span<const std::uint8_t> bin_;
  bool has_bin_ = false;
  std::optional<std::filesystem::path> folder_;
  struct Buffer {
    bool loaded = false;
    Bytes storage;
    std::span<const std::uint8_t> bytes;
  };
  std::vector<Buffer> buffers_;
};

}  // namespace retrace::gltf
