// Colour maps, see colormap.hpp for the source of the coefficients.
#include "golden/render/colormap.hpp"

#include <array>
#include <cmath>

namespace retrace {
namespace {

using Polynomial = std::array<glm::vec3, 7>;

const Polynomial kViridisFit = {{{0.2777273272f, 0.0054073445f, 0.3340998053f},
                                 {0.1050930431f, 1.4046135299f, 1.3845901626f},
                                 {-0.3308618287f, 0.2148475595f, 0.0950951630f},
                                 {-4.6342304990f, -5.7991009734f, -19.3324409563f},
                                 {6.2282699363f, 14.1799333668f, 56.6905526007f},
                                 {4.7763849977f, -13.7451453777f, -65.3530326334f},
                                 {-5.4354558559f, 4.6458526122f, 26.3124352496f}}};
const Polynomial kInfernoFit = {{{0.0002189404f, 0.0016510046f, -0.0194808984f},
                                 {0.1065134195f, 0.5639564368f, 3.9327123889f},
                                 {11.6024930825f, -3.9728539657f, -15.9423941063f},
                                 {-41.7039961314f, 17.4363988821f, 44.3541451987f},
                                 {77.1629356994f, -33.4023589421f, -81.8073092574f},
                                 {-71.3194282450f, 32.6260642640f, 73.2095198580f},
                                 {25.1311262248f, -12.2426689524f, -23.0703250029f}}};

}  // namespace

glm::vec3 map_color(ColorMap map, float value) {
  const float x = value > 0.0f ? std::fmin(value, 1.0f) : 0.0f;
  const Polynomial& c = map == ColorMap::kViridis ? kViridisFit : kInfernoFit;
  glm::vec3 color = c[6];
  for (int i = 5; i >= 0; --i) color = color * x + c[static_cast<std::size_t>(i)];
  return glm::clamp(color, 0.0f, 1.0f);
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
