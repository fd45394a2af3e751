// OpenImageIO reads from memory; the format is told by the first bytes, since names and MIME types lie.
#include "golden/scene/gltf_image.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <array>
#include <cmath>
#include <cstring>

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

std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

}  // namespace

Texture decode_image(std::span<const std::uint8_t> bytes, std::uint64_t max_texels) {
  const char* format = format_of(bytes);
  if (!format) throw Error("is neither PNG nor JPEG");
  OIIO::Filesystem::IOMemReader reader(const_cast<std::uint8_t*>(bytes.data()), bytes.size());
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
  if (!input) throw Error("cannot be decoded: " + one_line(OIIO::geterror()));
  OIIO::ImageSpec config, spec;
  config.attribute("oiio:UnassociatedAlpha", 1);  // glTF's alpha is not premultiplied
  if (!input->set_ioproxy(&reader) || !input->open(std::string("memory.") + format, spec, config))
    throw Error("cannot be decoded: " + one_line(input->geterror()));
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.width > kMaxImageSide ||
      spec.height > kMaxImageSide)
    throw Error("is " + std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels; at most " +
                std::to_string(kMaxImageSide) + " on a side are supported");
  const std::size_t count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  if (count > max_texels) throw Error("the images of the file have too many pixels in total");

  const int channels = std::min(spec.nchannels, 4);
  const bool grey = channels < 3, alpha = channels == 2 || channels == 4;
  Texture texture;
  texture.width = spec.width;
  texture.height = spec.height;
  texture.texels.resize(count);
  const auto stride = static_cast<std::size_t>(channels);
  const auto fill = [&](const auto& raw, const auto& colour, const auto& opacity) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto* p = raw.data() + i * stride;
      const float r = colour(p[0]);
      texture.texels[i] = {r, grey ? r : colour(p[1]), grey ? r : colour(p[2]), alpha ? opacity(p[stride - 1]) : 1.0f};
    }
  };
  bool read = false;
  if (spec.format == OIIO::TypeDesc::UINT8) {
    static const std::array<float, 256> table = [] {
      std::array<float, 256> t;
      for (std::size_t i = 0; i < t.size(); ++i) t[i] = linear(static_cast<float>(i) / 255.0f);
      return t;
    }();
    std::vector<std::uint8_t> raw(count * stride);
    read = input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, raw.data());
    if (read)
      fill(
          raw, [&](std::uint8_t x) { return table[x]; }, [](std::uint8_t x) { return static_cast<float>(x) / 255.0f; });
  } else {
    std::vector<float> raw(count * stride);
    read = input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, raw.data());
    if (read)
      fill(
          raw, [](float x) { return linear(x); }, [](float x) { return x; });
  }
  if (!read) throw Error("cannot be decoded: " + one_line(input->geterror()));
  return texture;
}

}  // namespace retrace::gltf
