#include "golden/render/colormap.hpp"

#include <OpenImageIO/imagebufalgo.h>

#include <array>
#include <cmath>
#include <cstddef>

#include "golden/base/error.hpp"
#include "golden/render/tonemap.hpp"

namespace retrace {
namespace {

constexpr int kSteps = 1024;
using Table = std::array<glm::vec3, kSteps + 1>;

Table make_table(const char* name) {
  OIIO::ImageBuf ramp(OIIO::ImageSpec(kSteps + 1, 1, 1, OIIO::TypeFloat));
  for (int i = 0; i <= kSteps; ++i) {
    const float value = static_cast<float>(i) / kSteps;
    ramp.setpixel(i, 0, &value);
  }
  const OIIO::ImageBuf mapped = OIIO::ImageBufAlgo::color_map(ramp, 0, name);
  if (mapped.has_error()) throw Error("colour map: " + mapped.geterror());
  Table table;
  for (int i = 0; i <= kSteps; ++i) {
    glm::vec3 linear;
    mapped.getpixel(i, 0, &linear.x, 3);
    table[static_cast<std::size_t>(i)] = srgb_encode(linear);
  }
  return table;
}

}  // namespace

glm::vec3 map_color(ColorMap map, float value) {
  static const Table viridis = make_table("viridis"), inferno = make_table("inferno");
  const float x = value > 0.0f ? std::fmin(value, 1.0f) : 0.0f;
  return (map == ColorMap::kViridis ? viridis : inferno)[static_cast<std::size_t>(std::lround(x * kSteps))];
}

glm::vec3 id_color(unsigned id) {
  const float hue =
      static_cast<float>(static_cast<double>(id) * 0.61803398874989485 - std::floor(id * 0.61803398874989485));
  const float value = 0.65f + 0.3f * static_cast<float>((id * 2654435761u) >> 24) / 255.0f;
  const auto channel = [&](float offset) {
    const float k = std::fmod(offset + hue * 6.0f, 6.0f);
    return value * (1.0f - 0.55f * glm::clamp(std::fmin(k, 4.0f - k), 0.0f, 1.0f));
  };
  return {channel(5.0f), channel(3.0f), channel(1.0f)};
}

}  // namespace retrace
