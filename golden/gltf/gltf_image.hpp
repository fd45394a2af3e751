// Encoded images (PNG, JPEG) to linear textures.
#pragma once
#include <cstdint>
#include <span>

#include "golden/scene/scene.hpp"

namespace retrace::gltf {

inline constexpr int kMaxImageSide = 16384;

enum class Content { kColor, kData };

/// Decodes an image of at most `max_texels` texels, and linearises colour (alpha and data are linear as stored). Throws
/// Error (without a location) if it is of another format, broken or too large.
Texture decode_image(std::span<const std::uint8_t> bytes, std::uint64_t max_texels, Content content);

/// Halves both sides, by the mean of four texels.
void halve(Texture& texture);

}  // namespace retrace::gltf
