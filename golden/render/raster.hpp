// A float image in memory, the few drawing operations that legends need, and writing it as a file.
#pragma once
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "golden/base/output_file.hpp"
#include "golden/render/colormap.hpp"

namespace retrace {

/// Rows top to bottom, `channels` interleaved floats a pixel.
struct Raster {
  int width = 0, height = 0, channels = 0;
  std::vector<float> data;

  Raster() = default;
  Raster(int w, int h, int c, float value = 0.0f);
  float* at(int x, int y) { return data.data() + (static_cast<std::size_t>(y) * width + x) * channels; }
  const float* at(int x, int y) const { return data.data() + (static_cast<std::size_t>(y) * width + x) * channels; }
  glm::vec3 rgb(int x, int y) const;
  void set_rgb(int x, int y, const glm::vec3& color);
};

/// Text in a 5 x 7 font of digits, lower-case letters and some signs (upper case is folded). `scale` is the size of a font pixel.
void draw_text(Raster& raster, int x, int y, std::string_view text, const glm::vec3& color, int scale = 1);
int text_width(std::string_view text, int scale = 1);
inline int text_height(int scale = 1) { return 7 * scale; }
void fill(Raster& raster, int x, int y, int width, int height, const glm::vec3& color);
/// Copies `source` (3 channels or more) into `target` with its corner at (x, y), clipped.
void blit(Raster& target, const Raster& source, int x, int y);

/// A heat map of a one-channel raster, sRGB-encoded, with a bar below it that shows the map, its range and `title`. NaN is drawn dark
/// grey. The range is [low, high]; if low >= high it is that of the finite values, up to their quantile 0.995 where the greatest lies far
/// beyond it; the legend then names the greatest as well.
Raster heat_map(const Raster& values, ColorMap map, const std::string& title, double low = 0.0, double high = 0.0);

/// Kinds of file by extension: .png, .jpg, .tif, ... hold encoded colours; .exr and .hdr (.rgbe) linear ones. Devices, FIFOs and
/// descriptors without an extension get .png. Throws Error for an extension that OpenImageIO cannot write.
bool is_linear_format(const std::filesystem::path& path);

/// Whether the format of `path` takes a picture of this size, before it is made. Throws Error.
void check_raster(const std::filesystem::path& path, int width, int height, int channels);

/// A raster as a file in the format of `path`: 8 bits a channel, or 32-bit float for linear formats, without the fourth channel where the
/// format has none. `channel_names` may be empty (R, G, B, A or Y). Throws Error that names the file.
std::string encode_raster(const std::filesystem::path& path, const Raster& raster,
                          const std::vector<std::string>& channel_names = {});
/// Whole numbers of 32 bits, one a pixel, as an OpenEXR file with the channel `channel`: a float holds them only up to 2^24.
void write_ids(OutputFile& output, int width, int height, const std::vector<std::uint32_t>& ids,
               const std::string& channel);
/// A raster as the contents of `output`.
void write_raster(OutputFile& output, const Raster& raster, const std::vector<std::string>& channel_names = {});

/// Writes one file whole. Throws Error.
void save_raster(const std::filesystem::path& path, const Raster& raster);

}  // namespace retrace
