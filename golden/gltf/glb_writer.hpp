// Scene to binary glTF 2.0 (.glb): one file, one buffer, images embedded as PNG. The same scene gives the same bytes
// (textures: the same bytes for the same version of the PNG encoder).
#pragma once
#include <cstdint>
#include <vector>

#include "golden/scene/scene.hpp"

namespace retrace {

/// What the loader makes of these bytes is the scene again (texels rounded to 8 bits of sRGB). Throws Error for a
/// non-finite position and a file of 4 GiB or more.
std::vector<std::uint8_t> to_glb(const Scene& scene);

}  // namespace retrace
