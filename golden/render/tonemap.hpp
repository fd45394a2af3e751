// From linear radiance to what a screen shows.
#pragma once
#include <glm/glm.hpp>

namespace retrace {

/// Filmic curve: S. Hill's fit of the ACES reference and sRGB output transforms (M. Pettineo, BakingLab, ACES.hlsl). Linear in and out,
/// out in [0, 1].
glm::vec3 tone_map(const glm::vec3& radiance);

/// sRGB transfer function, IEC 61966-2-1. [0, 1] in and out.
float srgb_encode(float linear);
float srgb_decode(float encoded);
inline glm::vec3 srgb_encode(const glm::vec3& c) { return {srgb_encode(c.r), srgb_encode(c.g), srgb_encode(c.b)}; }
inline glm::vec3 srgb_decode(const glm::vec3& c) { return {srgb_decode(c.r), srgb_decode(c.g), srgb_decode(c.b)}; }

inline float luminance(const glm::vec3& c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

}  // namespace retrace
