// See hit_codec.hpp.
#include "hit_codec.hpp"

#include <algorithm>

namespace retrace {

std::vector<std::size_t> rays_inside(std::span<const GridRay> rays) {
  std::vector<std::size_t> places;
  places.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (!rays[i].outside) places.push_back(i);
  return places;
}

std::vector<std::uint64_t> pack_rays(std::span<const GridRay> rays, std::span<const std::size_t> places) {
  std::vector<std::uint64_t> words(kRayWords * places.size());
  for (std::size_t i = 0; i < places.size(); ++i) rays[places[i]].record.pack(&words[kRayWords * i]);
  return words;
}

Hit unpack_hit(std::span<const std::uint64_t, kHitWords> words) {
  constexpr double kTUnit = 1.0 / (1 << contract::kTLimitFrac),
                   kBarycentricUnit = 1.0 / (1 << contract::kBarycentricFrac);
  const auto record = contract::HitRecord::unpack(words.data());
  Hit hit;
  hit.status = record.status;
  hit.id = record.id;
  hit.t = record.t * kTUnit;
  hit.u = record.u * kBarycentricUnit;
  hit.v = record.v * kBarycentricUnit;
  return hit;
}

void unpack_hits(std::span<const std::uint64_t> words, std::span<const std::size_t> places, std::span<Hit> hits,
                 std::span<std::uint64_t> raw) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto record = words.subspan(kHitWords * i).first<kHitWords>();
    hits[places[i]] = unpack_hit(record);
    std::copy(record.begin(), record.end(), raw.begin() + static_cast<std::ptrdiff_t>(kHitWords * places[i]));
  }
}

void unpack_work(std::span<const std::uint64_t> words, std::span<const std::size_t> places, std::span<RayWork> work) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto record = contract::WorkRecord::unpack(&words[kWorkWords * i]);
    work[places[i]] = {record.down, record.up, record.leaf, record.tests, record.skipped};
  }
}

}  // namespace retrace
