#include "golden/render/colormap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "golden/picture/picture_codec.hpp"
#include "golden/render/tonemap.hpp"

namespace retrace {
namespace {

constexpr int kSteps = 1024;
using Table = std::array<glm::vec3, kSteps + 1>;

Table make_table(const char* name) {
  std::array<float, kSteps + 1> values;
  for (int i = 0; i <= kSteps; ++i) values[static_cast<std::size_t>(i)] = static_cast<float>(i) / kSteps;
  const std::vector<glm::vec3> colors = picture_codec().color_map(name, values);
  Table table;
  std::transform(colors.begin(), colors.end(), table.begin(),
                 [](const glm::vec3& linear) { return srgb_encode(linear); });
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
