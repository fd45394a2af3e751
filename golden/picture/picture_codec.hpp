// Pictures as files in memory, through OpenImageIO. Its package brings some 250 shared libraries, which take a quarter of a second to bind, so it
// lies in a module of its own (oiio_codec.cpp) that is loaded with the first picture: what reads and writes none does not wait for it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace retrace {

/// What a sample of a pixel is: 8 bits, 32 bits, or a float of 32 bits.
enum class Sample { kByte, kWord, kFloat };

/// A picture that is to become a file.
struct PictureFile {
  std::filesystem::path path;  ///< for messages, and what a format without files in memory writes
  std::string format;          ///< of `writer_of`
  int width = 0, height = 0, channels = 0;
  Sample sample = Sample::kByte;           ///< in the file
  bool linear = false;                     ///< colours; otherwise sRGB
  std::vector<std::string> channel_names;  ///< may be empty: R, G, B, A or Y
};

/// A decoded picture: rows top to bottom, channels interleaved, kByte or kFloat.
struct DecodedPicture {
  int width = 0, height = 0, channels = 0;
  Sample sample = Sample::kByte;
  std::vector<std::uint8_t> bytes;
  std::vector<float> floats;
};

class PictureCodec {
 public:
  virtual ~PictureCodec() = default;
  /// The format that writes files of this extension (".png"); empty if there is none.
  virtual std::string writer_of(const std::string& extension) const = 0;
  /// The file of `pixels`, samples of kind `given`. Without pixels: only whether the format takes such a picture. Throws Error that names the file.
  virtual std::string encode(const PictureFile& file, Sample given, const void* pixels) const = 0;
  /// A PNG of 8 bits a channel, with attributes of OpenImageIO's writer. Throws Error that says why.
  virtual std::vector<std::uint8_t> encode_png(int width, int height, int channels, const std::uint8_t* pixels,
                                               const std::vector<std::pair<std::string, int>>& attributes) const = 0;
  /// Decodes a file of `format`, its first four channels at most, alpha not multiplied in. `admit` sees width, height and channels before the
  /// pixels are read, and throws what speaks against them. Throws Error that says why.
  virtual DecodedPicture decode(const std::string& format, std::span<const std::uint8_t> file,
                                const std::function<void(int, int, int)>& admit) const = 0;
  /// The linear colours of a map ("viridis") at `values` from 0 to 1. Throws Error.
  virtual std::vector<glm::vec3> color_map(const std::string& name, std::span<const float> values) const = 0;
};

/// Loads the module at the first call. Throws Error if it cannot be loaded.
const PictureCodec& picture_codec();

}  // namespace retrace
