// The format is told by the first bytes, since names and MIME types lie.
// PNG: W3C Recommendation, second edition, section 5. Only its critical chunks and transparency reach the decoder: glTF
// says that colour spaces in images are to be ignored, libpng complains about many of them on standard error, and a
// file that is cut off makes it jump over destructors.
#include "golden/gltf/gltf_image.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "golden/picture/picture_codec.hpp"

namespace retrace::gltf {
namespace {

/// IEC 61966-2-1.
float linear(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

const char* format_of(std::span<const std::uint8_t> bytes) {
  const auto begins = [&](std::initializer_list<int> magic) {
    return bytes.size() >= magic.size() &&
           std::equal(magic.begin(), magic.end(), bytes.begin(), [](int a, std::uint8_t b) { return a == b; });
  };
  if (begins({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'})) return "png";
  if (begins({0xff, 0xd8, 0xff})) return "jpeg";
  return nullptr;
}

/// Names what else is found in glTF files.
std::string foreign(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 16));
  if (text.substr(0, 4) == "RIFF" && text.size() >= 12 && text.substr(8, 4) == "WEBP") return " (but WebP)";
  if (text.substr(0, 4) == "GIF8") return " (but GIF)";
  if (text.substr(0, 2) == "BM") return " (but BMP)";
  if (text.substr(0, 4) == "DDS ") return " (but DDS)";
  if (text.size() >= 8 && text.substr(1, 4) == "KTX ") return " (but KTX)";
  return "";
}

void check_size(std::uint64_t width, std::uint64_t height, std::uint64_t max_texels) {
  if (width == 0 || height == 0 || width > kMaxImageSide || height > kMaxImageSide)
    throw Error("is " + std::to_string(width) + " x " + std::to_string(height) + " pixels; 1 to " +
                std::to_string(kMaxImageSide) + " on a side are supported");
  if (width * height > max_texels) throw Error("has more than " + std::to_string(max_texels) + " pixels");
}

/// The chunks that matter, whole and with the right checksums.
std::vector<std::uint8_t> plain_png(std::span<const std::uint8_t> bytes, std::uint64_t max_texels) {
  constexpr std::size_t kSignature = 8, kFrame = 12;  // of a chunk: length, type, checksum
  std::vector<std::uint8_t> out(bytes.begin(), bytes.begin() + kSignature);
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint32_t>(bytes[at]) << 24 | static_cast<std::uint32_t>(bytes[at + 1]) << 16 |
           static_cast<std::uint32_t>(bytes[at + 2]) << 8 | static_cast<std::uint32_t>(bytes[at + 3]);
  };
  for (std::size_t at = kSignature;;) {
    if (bytes.size() - at < kFrame || word(at) > bytes.size() - at - kFrame)
      throw Error("cannot be decoded: is cut off");
    const std::size_t length = word(at);
    const auto chunk = bytes.subspan(at, length + kFrame);
    const std::string_view type(reinterpret_cast<const char*>(chunk.data() + 4), 4);
    if (::crc32(0, chunk.data() + 4, static_cast<uInt>(length + 4)) != word(at + 8 + length))
      throw Error("cannot be decoded: the checksum of a chunk is wrong");
    const bool header = type == "IHDR";
    if (header != (at == kSignature)) throw Error("cannot be decoded: the header is not where it should be");
    if (header) {
      if (length != 13) throw Error("cannot be decoded: the header is malformed");
      check_size(word(at + 8), word(at + 12), max_texels);
    }
    if (header || type == "PLTE" || type == "tRNS" || type == "IDAT" || type == "IEND")
      out.insert(out.end(), chunk.begin(), chunk.end());
    if (type == "IEND") return out;
    at += chunk.size();
  }
}

}  // namespace

Texture decode_image(std::span<const std::uint8_t> bytes, std::uint64_t max_texels, Content content) {
  const char* format = format_of(bytes);
  if (!format) throw Error("is neither PNG nor JPEG" + foreign(bytes));
  std::vector<std::uint8_t> plain;
  if (format[0] == 'p') {
    plain = plain_png(bytes, max_texels);
    bytes = plain;
  }
  const DecodedPicture picture = picture_codec().decode(format, bytes, [&](int width, int height, int channels) {
    if (channels <= 0) throw Error("has no channels");
    check_size(static_cast<std::uint64_t>(std::max(width, 0)), static_cast<std::uint64_t>(std::max(height, 0)),
               max_texels);
  });
  const std::size_t count = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);

  const int channels = picture.channels;
  const bool grey = channels < 3, alpha = channels == 2 || channels == 4;
  Texture texture;
  texture.width = picture.width;
  texture.height = picture.height;
  texture.texels.resize(count);
  const auto stride = static_cast<std::size_t>(channels);
  const auto fill = [&](const auto& raw, const auto& colour, const auto& opacity) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto* p = raw.data() + i * stride;
      const float r = colour(p[0]);
      texture.texels[i] = {r, grey ? r : colour(p[1]), grey ? r : colour(p[2]), alpha ? opacity(p[stride - 1]) : 1.0f};
    }
  };
  if (picture.sample == Sample::kByte) {
    static const std::array<float, 256> table = [] {
      std::array<float, 256> t;
      for (std::size_t i = 0; i < t.size(); ++i) t[i] = linear(static_cast<float>(i) / 255.0f);
      return t;
    }();
    static const std::array<float, 256> plain_table = [] {
      std::array<float, 256> t;
      for (std::size_t i = 0; i < t.size(); ++i) t[i] = static_cast<float>(i) / 255.0f;
      return t;
    }();
    const auto& colour = content == Content::kColor ? table : plain_table;
    fill(
        picture.bytes, [&](std::uint8_t x) { return colour[x]; },
        [](std::uint8_t x) { return static_cast<float>(x) / 255.0f; });
  } else {
    fill(
        picture.floats, [&](float x) { return content == Content::kColor ? linear(x) : x; }, [](float x) { return x; });
  }
  return texture;
}

void halve(Texture& texture) {
  const int width = std::max(texture.width / 2, 1), height = std::max(texture.height / 2, 1);
  const auto texel = [&](int x, int y) {
    return texture
        .texels[static_cast<std::size_t>(std::min(y, texture.height - 1)) * static_cast<std::size_t>(texture.width) +
                static_cast<std::size_t>(std::min(x, texture.width - 1))];
  };
  std::vector<glm::vec4> texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          0.25f *
          (texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1));
  texture.width = width;
  texture.height = height;
  texture.texels = std::move(texels);
}

}  // namespace retrace::gltf
