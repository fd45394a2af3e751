// Between the engines' records and the words of a core's memory: rays on their way in, hits and work on their way out (docs/number-contract.md).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine.hpp"

namespace retrace {

inline constexpr std::size_t kRayWords = contract::RayRecord::kWords;  ///< 64-bit words of a ray
inline constexpr std::size_t kHitWords = contract::HitRecord::kWords;  ///< of a hit
inline constexpr std::size_t kWorkWords = contract::WorkRecord::kWords;

/// Indices of the rays that are traced at all: those not marked `outside`.
std::vector<std::size_t> rays_inside(std::span<const GridRay> rays);
/// Records of the rays at `places`, one after the other.
std::vector<std::uint64_t> pack_rays(std::span<const GridRay> rays, std::span<const std::size_t> places);

/// The hit of one record; t, u and v are the codes as reals.
Hit unpack_hit(std::span<const std::uint64_t, kHitWords> words);
/// Record i becomes hits[places[i]], and its words those of ray places[i] in `raw`. Other hits stay as they are.
void unpack_hits(std::span<const std::uint64_t> words, std::span<const std::size_t> places, std::span<Hit> hits,
                 std::span<std::uint64_t> raw);
/// Record i becomes work[places[i]].
void unpack_work(std::span<const std::uint64_t> words, std::span<const std::size_t> places, std::span<RayWork> work);

}  // namespace retrace
