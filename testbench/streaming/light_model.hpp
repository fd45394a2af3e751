// What kernel shade must give (hls/streaming/light.hpp), in plain integers.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"

namespace retrace::light_model {

struct Note {
  std::uint32_t pixel = 0;
  std::array<std::uint32_t, 3> weight{};
  bool active = false;

  std::uint64_t pack() const {
    return pixel | std::uint64_t{weight[0]} << 23 | std::uint64_t{weight[1]} << 36 | std::uint64_t{weight[2]} << 49 |
           std::uint64_t{active} << 62;
  }
  static Note unpack(std::uint64_t word) {
    const auto bits = [&](int lsb, int width) {
      return static_cast<std::uint32_t>(word >> lsb & ((std::uint64_t{1} << width) - 1));
    };
    return {bits(0, 23), {bits(23, 13), bits(36, 13), bits(49, 13)}, bits(62, 1) != 0};
  }
  friend bool operator==(const Note&, const Note&) = default;
};

struct Light {
  std::array<std::int32_t, 3> position{};
  std::array<std::uint32_t, 3> colour{};
  std::uint32_t seed = 0;
};

struct Lit {
  contract::RaySetupInRecord shadow, bounce;
  Note direct, shadow_note, bounce_note;
};

inline std::int64_t root(std::int64_t square) {
  std::int64_t root = 0;
  for (std::int64_t bit = std::int64_t{1} << 20; bit > 0; bit /= 2)
    if ((root + bit) * (root + bit) <= square) root += bit;
  return root;
}

inline std::uint32_t mix(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}

/// `material`: of the hit triangle, or nullptr where there is none. `lower`, `upper`: of the grid.
inline Lit light_hit(const std::array<std::int32_t, 3>& origin, const std::array<std::int32_t, 3>& direction,
                     const contract::HitRecord& hit, const Note& in, const contract::MaterialRecord* material,
                     const std::array<std::int32_t, 3>& lower, const std::array<std::int32_t, 3>& upper,
                     const Light& light, std::uint32_t number) {
  const contract::MaterialRecord none;
  const bool hits = in.active && material != nullptr && hit.status == static_cast<std::uint32_t>(contract::kStatusHit);
  const contract::MaterialRecord& m = material != nullptr ? *material : none;
  Lit out;
  out.direct = out.shadow_note = out.bounce_note = in;
  out.direct.active = hits && m.unlit != 0;
  out.shadow_note.active = out.bounce_note.active = hits && m.unlit == 0;
  std::int64_t along = 0, facing = 0, square = 0, largest = 0;
  for (int a = 0; a < 3; ++a) along += std::int64_t{m.normal[a]} * direction[a];
  std::array<std::int64_t, 3> normal, point, way, to_light;
  for (int a = 0; a < 3; ++a) {
    const auto weight = static_cast<std::uint32_t>(std::uint64_t{in.weight[a]} * (m.colour[a] + 1) / 256);
    out.direct.weight[a] = out.shadow_note.weight[a] = out.bounce_note.weight[a] = weight;
    normal[a] = along > 0 ? -m.normal[a] : m.normal[a];
    const std::int64_t free = origin[a] + ((std::int64_t{hit.t} * direction[a]) >> 26) + (normal[a] >> 1);
    point[a] = std::clamp<std::int64_t>(free, lower[a], upper[a]);
    out.shadow.origin[a] = out.bounce.origin[a] = static_cast<std::int32_t>(point[a]);
    for (contract::RaySetupInRecord* ray : {&out.shadow, &out.bounce}) {
      ray->box[2 * a] = lower[a];
      ray->box[2 * a + 1] = upper[a];
    }
    to_light[a] = light.position[a] - point[a];
    largest = std::max(largest, std::abs(to_light[a]));
  }
  int up = 0;
  while (largest != 0 && (largest << up) < 1 << 24) ++up;
  if (largest == 0 || largest >= 1 << 25) out.shadow_note.active = false;
  for (int a = 0; a < 3; ++a) {
    const std::int64_t d = to_light[a] * (std::int64_t{1} << up);
    // Codes of 27 bits: what does not fit belongs to a ray that does not count.
    out.shadow.direction[a] = static_cast<std::int32_t>(static_cast<std::uint32_t>(d) << 5) >> 5;
    facing += normal[a] * d;
    square += d * d;
  }
  const std::int64_t length = root(static_cast<std::uint32_t>(square >> 20));
  std::int64_t cosine = 0;
  if (facing <= 0 || length == 0) {
    out.shadow_note.active = false;
  } else {
    cosine = std::min<std::int64_t>((facing >> 10) / length, 4096);
  }
  for (int a = 0; a < 3; ++a)
    out.shadow_note.weight[a] =
        static_cast<std::uint32_t>(out.shadow_note.weight[a] * cosine * (light.colour[a] + 1) >> 20) & 0x1fff;
  out.shadow.t_max = (1u << 26) >> up;
  out.shadow.any = 1;

  const std::uint32_t key = (in.pixel * 0x9e3779b1u + number) ^ light.seed;
  way = normal;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t hash = mix(key + 0x632be5abu * i);
    const std::array<std::int64_t, 3> r{std::int64_t{hash & 1023} - 512, std::int64_t{hash >> 10 & 1023} - 512,
                                        std::int64_t{hash >> 20 & 1023} - 512};
    if (r[0] * r[0] + r[1] * r[1] + r[2] * r[2] < 512 * 512) {
      for (int a = 0; a < 3; ++a) way[a] += 8 * r[a];
      break;
    }
  }
  const std::int64_t way_length = root(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
  std::int64_t inverse = 0;
  if (way_length < 64) {
    out.bounce_note.active = false;
  } else {
    inverse = 1077524023705 / way_length;
  }
  for (int a = 0; a < 3; ++a) out.bounce.direction[a] = static_cast<std::int32_t>((way[a] * inverse) >> 14);
  out.bounce.t_max = (1u << contract::kTLimitBits) - 1;
  out.bounce.any = 0;
  return out;
}

}  // namespace retrace::light_model
