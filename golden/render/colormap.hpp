// Perceptually uniform colour maps for heat maps: value in [0, 1] to sRGB-encoded colour in [0, 1].
// The maps are OpenImageIO's (golden/picture).
#pragma once
#include <glm/glm.hpp>

namespace retrace {

enum class ColorMap { kInferno, kViridis };

/// Values outside [0, 1] are clamped, NaN becomes 0.
glm::vec3 map_color(ColorMap map, float value);

/// A distinct, stable colour for an id (golden-angle hues), sRGB-encoded.
glm::vec3 id_color(unsigned id);

}  // namespace retrace
