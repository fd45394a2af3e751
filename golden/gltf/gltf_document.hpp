// First stage of the glTF loader: bytes to a JSON document whose every property that the loader reads has the right
// type, plus the file's resources. A fault in one object is kept with the object and thrown when somebody uses it; what
// nobody uses refuses no file. glTF 2.0 specification, sections 2.8 (URIs), 3 (concepts), 4 (GLB), 5 (properties).
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace retrace::gltf {

using Bytes = std::vector<std::uint8_t>;

/// Folders above that of the glTF file from which a relative URI may take a file.
inline constexpr int kMaxFoldersUp = 2;

/// The extensions that change what is traced or shaded and are supported.
bool is_supported_extension(const std::string& name);

/// A name out of a file, fit to stand in a one-line message: " 'name'", shortened, without control characters; empty
/// for none.
std::string quote_name(const std::string& name);

/// An extension of an object, null if it has none of that name.
const nlohmann::json* extension(const nlohmann::json& o, const char* name);

/// Throws Error if a texture info of an object has a property of the wrong type. Documents leave that to the user, who
/// can do without a texture.
void check_texture_info(const nlohmann::json& o, const char* key, const std::string& where);

/// Whole regular file. Throws Error (without a location) if it cannot be read or is 4 GiB or more.
Bytes read_file(const std::filesystem::path& path);

class Document {
 public:
  /// Parses and checks. `folder` is where relative URIs are looked up; none: no external file may be opened.
  /// `bytes` must outlive the document. Throws Error that says what is wrong and where inside the file.
  Document(std::span<const std::uint8_t> bytes, std::optional<std::filesystem::path> folder);

  /// Arrays of the root object; "lights" are those of KHR_lights_punctual.
  std::size_t size(const char* array) const;
  /// Unchecked.
  const nlohmann::json& at(const char* array, std::size_t i) const { return json_.at(array).at(i); }
  /// An object all of whose known properties have the right type. Throws Error if it has not.
  const nlohmann::json& use(const char* array, std::size_t i);
  /// Throws Error if the root object has something else than an array under this name.
  void use_array(const char* array);
  const nlohmann::json& root() const { return json_; }

  /// Bytes of a buffer view; resolves its buffer on first use.
  std::span<const std::uint8_t> view(std::size_t index);
  /// Bytes of an encoded image (file, data URI or buffer view); `storage` keeps them where nothing else does.
  std::span<const std::uint8_t> image(std::size_t index, Bytes& storage);

  /// The files beside it that buffers and images name and that are there, used or not.
  std::vector<std::filesystem::path> external_files() const;

  /// One line for the user about something that is left out or taken otherwise; the same line only once.
  void note(const std::string& text);
  /// All notes, with one for each fault in an object that nobody used.
  std::vector<std::string> take_notes();

 private:
  std::span<const std::uint8_t> text_of_glb(std::span<const std::uint8_t> bytes);
  void parse(std::span<const std::uint8_t> text);
  std::span<const std::uint8_t> buffer(std::size_t index);
  Bytes resolve(const std::string& uri);
  Bytes resolve_file(const std::string& uri) const;
  std::filesystem::path find_file(const std::string& uri) const;
  void check();
  void check_array(const char* key, const char* singular, void (*rule)(const nlohmann::json&, const std::string&));
  void tidy(nlohmann::json& o, const std::string& where);

  nlohmann::json json_;
  std::span<const std::uint8_t> bin_;
  bool has_bin_ = false;
  std::optional<std::filesystem::path> folder_;
  static constexpr std::size_t kWholeArray = static_cast<std::size_t>(-1);
  struct Fault {
    std::string message;
    bool used = false;
  };
  std::map<std::pair<std::string, std::size_t>, Fault> faults_;  ///< by array and index
  std::vector<std::string> notes_;
  struct Buffer {
    bool loaded = false;
    Bytes storage;
    std::span<const std::uint8_t> bytes;
  };
  std::vector<Buffer> buffers_;
};

}  // namespace retrace::gltf
