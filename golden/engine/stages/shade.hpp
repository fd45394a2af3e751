// shade, golden: from what became of a sample to a pixel. Exact integers.
//   facing = min(|n . l| >> 8, 2^16 - 1);  lit = min(256 ambient + (diffuse facing >> 8), 2^16 - 1)
//   strength = floor(sqrt(lit)), 255 where unlit;  component = colour (strength + 1) >> 8
// Colours are what a screen shows, which goes with the root of the light: so does the strength. A pixel is the mean of its samples, rounded down.
// Counterparts: hls/stages/shade.hpp, rtl/ray/rt_shade.sv.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

using Colour = std::array<std::uint32_t, 3>;

inline Colour shade(const contract::MaterialRecord& material, const contract::FrameRecord& frame) {
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 3; ++i) dot += std::int64_t{material.normal[i]} * frame.light[i];
  const std::uint32_t facing = static_cast<std::uint32_t>(std::min<std::int64_t>(std::abs(dot) >> 8, 0xffff));
  const std::uint32_t lit = std::min(256 * frame.ambient + (frame.diffuse * facing >> 8), 0xffffu);
  std::uint32_t strength = 0;
  while ((strength + 1) * (strength + 1) <= lit) ++strength;
  if (material.unlit != 0) strength = 255;
  Colour colour{};
  for (std::size_t i = 0; i < 3; ++i) colour[i] = material.colour[i] * (strength + 1) >> 8;
  return colour;
}

/// The colour of a sample: of the background where nothing is hit, or what is hit has no material.
template <class Materials>
Colour shade_sample(const contract::ShadeInRecord& sample, const Materials& materials,
                    const contract::FrameRecord& frame) {
  if (sample.hit == 0 || sample.id >= materials.size()) return frame.background;
  return shade(materials[sample.id], frame);
}

inline std::uint32_t pack_colour(const Colour& sum, std::uint32_t samples_log2) {
  return sum[0] >> samples_log2 | (sum[1] >> samples_log2) << 8 | (sum[2] >> samples_log2) << 16 | 0xff000000u;
}

/// t along the camera's ray; all ones without a hit.
inline std::uint32_t camera_depth(const contract::ShadeInRecord& sample) {
  if (sample.hit == 0) return 0xffffffffu;
  constexpr int kStep = contract::kTFrac - contract::kEntryStartFrac;
  return static_cast<std::uint32_t>(((std::uint64_t{sample.start} << kStep) + sample.t) >> sample.scale);
}

/// 32-bit words of a pixel of that kind.
constexpr std::uint32_t pixel_words(std::uint32_t kind) {
  return kind == static_cast<std::uint32_t>(contract::kPixelHit) ? 2 : 1;
}

}  // namespace retrace::golden
