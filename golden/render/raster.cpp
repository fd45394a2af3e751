// Rasters, legends and files of pictures, see raster.hpp.
#include "golden/render/raster.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>

#include "golden/picture/picture_codec.hpp"
#include "golden/scene/scene.hpp"

namespace retrace {
namespace {

struct Glyph {
  char character;
  std::array<std::uint8_t, 7> rows;  // five bits a row, the leftmost pixel is the highest bit
};

constexpr Glyph kFont[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},    {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {14, 17, 1, 6, 1, 17, 14}},    {'4', {2, 6, 10, 18, 31, 2, 2}},   {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 4, 4, 4}},     {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},   {'a', {0, 0, 14, 1, 15, 17, 15}},  {'b', {16, 16, 30, 17, 17, 17, 30}},
    {'c', {0, 0, 15, 16, 16, 16, 15}},   {'d', {1, 1, 15, 17, 17, 17, 15}}, {'e', {0, 0, 14, 17, 31, 16, 15}},
    {'f', {6, 9, 8, 28, 8, 8, 8}},       {'g', {0, 0, 15, 17, 15, 1, 14}},  {'h', {16, 16, 30, 17, 17, 17, 17}},
    {'i', {4, 0, 12, 4, 4, 4, 14}},      {'j', {2, 0, 6, 2, 2, 18, 12}},    {'k', {16, 16, 18, 20, 24, 20, 18}},
    {'l', {12, 4, 4, 4, 4, 4, 14}},      {'m', {0, 0, 26, 21, 21, 21, 21}}, {'n', {0, 0, 30, 17, 17, 17, 17}},
    {'o', {0, 0, 14, 17, 17, 17, 14}},   {'p', {0, 0, 30, 17, 30, 16, 16}}, {'q', {0, 0, 15, 17, 15, 1, 1}},
    {'r', {0, 0, 22, 25, 16, 16, 16}},   {'s', {0, 0, 15, 16, 14, 1, 30}},  {'t', {8, 8, 28, 8, 8, 9, 6}},
    {'u', {0, 0, 17, 17, 17, 17, 15}},   {'v', {0, 0, 17, 17, 17, 10, 4}},  {'w', {0, 0, 17, 17, 21, 21, 10}},
    {'x', {0, 0, 17, 10, 4, 10, 17}},    {'y', {0, 0, 17, 17, 15, 1, 14}},  {'z', {0, 0, 31, 2, 4, 8, 31}},
    {'.', {0, 0, 0, 0, 0, 12, 12}},      {',', {0, 0, 0, 0, 12, 4, 8}},     {':', {0, 12, 12, 0, 12, 12, 0}},
    {'-', {0, 0, 0, 31, 0, 0, 0}},       {'+', {0, 4, 4, 31, 4, 4, 0}},     {'/', {1, 1, 2, 4, 8, 16, 16}},
    {'(', {2, 4, 8, 8, 8, 4, 2}},        {')', {8, 4, 2, 2, 2, 4, 8}},      {'%', {25, 26, 2, 4, 8, 11, 19}},
    {'_', {0, 0, 0, 0, 0, 0, 31}},       {'=', {0, 0, 31, 0, 31, 0, 0}},
};

const Glyph* find_glyph(char c) {
  const char folded = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const Glyph& glyph : kFont) {
    if (glyph.character == folded) return &glyph;
  }
  return nullptr;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace

Raster::Raster(int w, int h, int c, float value)
    : width(w), height(h), channels(c), data(static_cast<std::size_t>(w) * h * c, value) {}

glm::vec3 Raster::rgb(int x, int y) const {
  const float* p = at(x, y);
  return channels >= 3 ? glm::vec3(p[0], p[1], p[2]) : glm::vec3(p[0]);
}

void Raster::set_rgb(int x, int y, const glm::vec3& color) {
  float* p = at(x, y);
  p[0] = color.r;
  if (channels >= 3) {
    p[1] = color.g;
    p[2] = color.b;
  }
}

void fill(Raster& raster, int x, int y, int width, int height, const glm::vec3& color) {
  for (int py = std::max(y, 0); py < std::min(y + height, raster.height); ++py) {
    for (int px = std::max(x, 0); px < std::min(x + width, raster.width); ++px) raster.set_rgb(px, py, color);
  }
}

int text_width(std::string_view text, int scale) {
  return text.empty() ? 0 : static_cast<int>(text.size()) * 6 * scale - scale;
}

void draw_text(Raster& raster, int x, int y, std::string_view text, const glm::vec3& color, int scale) {
  for (const char c : text) {
    if (const Glyph* glyph = find_glyph(c)) {
      for (int row = 0; row < 7; ++row) {
        for (int column = 0; column < 5; ++column) {
          if (glyph->rows[static_cast<std::size_t>(row)] >> (4 - column) & 1) {
            fill(raster, x + column * scale, y + row * scale, scale, scale, color);
          }
        }
      }
    }
    x += 6 * scale;
  }
}

void blit(Raster& target, const Raster& source, int x, int y) {
  for (int py = 0; py < source.height; ++py) {
    for (int px = 0; px < source.width; ++px) {
      if (x + px < 0 || y + py < 0 || x + px >= target.width || y + py >= target.height) continue;
      target.set_rgb(x + px, y + py, source.rgb(px, py));
    }
  }
}

namespace {
// A few rays that take many times the work of all others would leave the picture dark.
constexpr double kHeatQuantile = 0.995;
constexpr double kHeatOutlier = 1.25;
}  // namespace

Raster heat_map(const Raster& values, ColorMap map, const std::string& title, double low, double high) {
  std::string beyond;  // what the legend says of values above the range
  if (!(low < high)) {
    std::vector<double> finite;
    for (int y = 0; y < values.height; ++y) {
      for (int x = 0; x < values.width; ++x) {
        if (std::isfinite(*values.at(x, y))) finite.push_back(*values.at(x, y));
      }
    }
    low = high = 0.0;
    if (!finite.empty()) {
      const auto [least, greatest] = std::minmax_element(finite.begin(), finite.end());
      low = *least;
      high = *greatest;
      const auto place =
          finite.begin() + static_cast<std::ptrdiff_t>(kHeatQuantile * static_cast<double>(finite.size() - 1));
      std::nth_element(finite.begin(), place, finite.end());
      if (*place > low && high - low > kHeatOutlier * (*place - low)) {
        beyond = ", max " + short_number(high);
        high = *place;
      }
    }
  }
  const double span = high > low ? high - low : 1.0;
  // Small pictures get a small legend; below that of two lines of text there is none that could be read.
  const int scale = std::clamp(values.width / 320, 1, 8);
  const int margin = 4 * scale, bar = 8 * scale;
  const int legend = 2 * margin + bar + text_height(scale) + 3 * scale;
  const glm::vec3 ground(0.09f), ink(0.92f), missing(0.16f);

  Raster image(values.width, values.height + legend, 3);
  for (int y = 0; y < values.height; ++y) {
    for (int x = 0; x < values.width; ++x) {
      const double v = *values.at(x, y);
      image.set_rgb(x, y, std::isfinite(v) ? map_color(map, static_cast<float>((v - low) / span)) : missing);
    }
  }
  const int top = values.height;
  fill(image, 0, top, image.width, legend, ground);
  const int bar_width = image.width - 2 * margin;
  for (int x = 0; x < bar_width; ++x) {
    fill(image, margin + x, top + margin, 1, bar,
         map_color(map, (static_cast<float>(x) + 0.5f) / static_cast<float>(bar_width)));
  }
  const int line = top + margin + bar + 3 * scale;
  const std::string left = short_number(low), right = short_number(high) + beyond;
  draw_text(image, margin, line, left, ink, scale);
  draw_text(image, image.width - margin - text_width(right, scale), line, right, ink, scale);
  const int room = image.width - 2 * margin - text_width(left, scale) - text_width(right, scale) - 12 * scale;
  if (text_width(title, scale) <= room) {
    draw_text(image, (image.width - text_width(title, scale)) / 2, line, title, ink, scale);
  }
  return image;
}

namespace {

/// How a picture becomes a file.
struct Format {
  std::string name;
  bool linear = false;
  int most_channels = 4;
};

Format format_of(const std::filesystem::path& path) {
  std::string extension = extension_of(path);
  if (extension.empty() && is_written_through(path)) extension = ".png";
  if (extension.empty())
    throw Error("cannot write " + path.string() + ": the name needs an extension such as .png or .exr");
  Format format;
  format.name = picture_codec().writer_of(extension);
  if (format.name.empty())
    throw Error("cannot write " + path.string() + ": no image format is known for '" + extension + "'");
  format.linear = format.name == "openexr" || format.name == "hdr";
  if (format.name == "hdr") format.most_channels = 3;
  return format;
}

PictureFile file_of(const std::filesystem::path& path, const Format& format, int width, int height, int channels) {
  PictureFile file;
  file.path = path;
  file.format = format.name;
  file.width = width;
  file.height = height;
  file.channels = std::min(channels, format.most_channels);
  file.sample = format.linear ? Sample::kFloat : Sample::kByte;
  file.linear = format.linear;
  return file;
}

}  // namespace

bool is_linear_format(const std::filesystem::path& path) { return format_of(path).linear; }

void check_raster(const std::filesystem::path& path, int width, int height, int channels) {
  const Format format = format_of(path);
  if (format.name == "png") return;  // takes all, and libpng complains on standard error about a file without pixels
  (void)picture_codec().encode(file_of(path, format, width, height, channels), Sample::kFloat, nullptr);
}

std::string encode_raster(const std::filesystem::path& path, const Raster& raster,
                          const std::vector<std::string>& channel_names) {
  PictureFile file = file_of(path, format_of(path), raster.width, raster.height, raster.channels);
  file.channel_names = channel_names;
  if (file.channels == raster.channels) return picture_codec().encode(file, Sample::kFloat, raster.data.data());
  std::vector<float> pixels;
  pixels.reserve(raster.data.size());
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x)
      pixels.insert(pixels.end(), raster.at(x, y), raster.at(x, y) + file.channels);
  return picture_codec().encode(file, Sample::kFloat, pixels.data());
}

void write_ids(OutputFile& output, int width, int height, const std::vector<std::uint32_t>& ids,
               const std::string& channel) {
  PictureFile file = file_of(output.path(), {"openexr", true, 1}, width, height, 1);
  file.sample = Sample::kWord;
  file.channel_names = {channel};
  output.write(picture_codec().encode(file, Sample::kWord, ids.data()));
}

void write_raster(OutputFile& output, const Raster& raster, const std::vector<std::string>& channel_names) {
  output.write(encode_raster(output.path(), raster, channel_names));
}

void save_raster(const std::filesystem::path& path, const Raster& raster) {
  OutputFile output(path);
  write_raster(output, raster);
  output.commit();
}

}  // namespace retrace
