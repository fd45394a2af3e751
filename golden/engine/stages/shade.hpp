// shade, golden: from what became of a sample to a pixel. Exact integers.
//   l = light, or on an instance with a record floor(turn light 2^-10); material at id, or on such an instance at (id + its offset) mod 2^25
//   facing = min(|n . l| >> 8, 2^16 - 1), 0 in a shadow;  lit = min(256 ambient + (diffuse facing >> 8), 2^16 - 1)
//   strength = floor(sqrt(lit)), 255 where unlit;  component = colour (strength + 1) >> 8
// Colours are what a screen shows, which goes with the root of the light: so does the strength. A pixel is the mean of its samples, rounded down.
// Counterparts: hls/stages/shade.hpp, rtl/ray/rt_shade.sv.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "golden/contract/contract_records.hpp"
#include "golden/engine/shade_table.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

using Colour = std::array<std::uint32_t, 3>;

using LightDirection = std::array<std::int32_t, 3>;

inline Colour shade(const contract::MaterialRecord& material, const contract::FrameRecord& frame,
                    const LightDirection& light, bool shadow) {
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 3; ++i) dot += std::int64_t{material.normal[i]} * light[i];
  if (shadow) dot = 0;
  const std::uint32_t facing = static_cast<std::uint32_t>(std::min<std::int64_t>(std::abs(dot) >> 8, 0xffff));
  const std::uint32_t lit = std::min(256 * frame.ambient + (frame.diffuse * facing >> 8), 0xffffu);
  std::uint32_t strength = 0;
  while ((strength + 1) * (strength + 1) <= lit) ++strength;
  if (material.unlit != 0) strength = 255;
  Colour colour{};
  for (std::size_t i = 0; i < 3; ++i) colour[i] = material.colour[i] * (strength + 1) >> 8;
  return colour;
}

/// The light as an object sees it that is turned so.
inline LightDirection turned_light(const contract::InstanceShadeRecord& record, const LightDirection& light) {
  LightDirection turned{};
  for (std::size_t i = 0; i < 3; ++i) {
    std::int64_t sum = 0;
    for (std::size_t j = 0; j < 3; ++j) sum += std::int64_t{record.turn[3 * i + j]} * light[j];
    turned[i] = static_cast<std::int32_t>(sum >> contract::kTurnFrac);
  }
  return turned;
}

/// The colour of a sample: of the background where nothing is hit, or what is hit has no material.
inline Colour shade_sample(const contract::ShadeInRecord& sample, const ShadeTable& table,
                           const contract::FrameRecord& frame, bool* unknown = nullptr) {
  if (unknown != nullptr) *unknown = false;
  if (sample.hit == 0) return frame.background;
  LightDirection light = frame.light;
  std::uint32_t index = sample.id;
  if (sample.number < table.instances) {
    const auto record = contract::InstanceShadeRecord::unpack(
        &table.words[std::size_t{contract::InstanceShadeRecord::kWords} * sample.number]);
    light = turned_light(record, light);
    index = (index + record.material) & ((1u << contract::kMaterialIndexBits) - 1);
  }
  if (index >= table.size()) {
    if (unknown != nullptr) *unknown = true;
    return frame.background;
  }
  return shade(contract::MaterialRecord::unpack(&table.words[index]), frame, light, sample.shadow != 0);
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
