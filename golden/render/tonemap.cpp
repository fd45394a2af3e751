// Tone map and transfer function, see tonemap.hpp.
#include "golden/render/tonemap.hpp"

#include <cmath>

namespace retrace {

glm::vec3 tone_map(const glm::vec3& radiance) {
  // sRGB to the working space of the curve and back, row vectors of the published matrices.
  const glm::vec3 c = glm::clamp(radiance, 0.0f, 1e6f);
  const glm::vec3 x{0.59719f * c.r + 0.35458f * c.g + 0.04823f * c.b, 0.07600f * c.r + 0.90834f * c.g + 0.01566f * c.b,
                    0.02840f * c.r + 0.13383f * c.g + 0.83777f * c.b};
  const glm::vec3 y = (x * (x + 0.0245786f) - 0.000090537f) / (x * (0.983729f * x + 0.4329510f) + 0.238081f);
  const glm::vec3 z{1.60475f * y.r - 0.53108f * y.g - 0.07367f * y.b, -0.10208f * y.r + 1.10813f * y.g - 0.00605f * y.b,
                    -0.00327f * y.r - 0.07276f * y.g + 1.07602f * y.b};
  return glm::clamp(z, 0.0f, 1.0f);
}

float srgb_encode(float linear) {
  const float x = linear > 0.0f ? std::fmin(linear, 1.0f) : 0.0f;
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

float srgb_decode(float encoded) {
  const float x = encoded > 0.0f ? std::fmin(encoded, 1.0f) : 0.0f;
  return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
}

}  // namespace retrace
