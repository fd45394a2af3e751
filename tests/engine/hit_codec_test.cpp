// Rays, hits and work between engines and the words of a core's memory.
#include "golden/engine/hit_codec.hpp"

#include <gtest/gtest.h>

#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

std::int64_t code(double value, int frac) { return static_cast<std::int64_t>(value * static_cast<double>(1 << frac)); }

TEST(HitCodec, RaysInsideAreThoseNotMarked) {
  std::vector<GridRay> rays(5);
  EXPECT_EQ(rays_inside({}), std::vector<std::size_t>{});
  EXPECT_EQ(rays_inside(rays), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  rays[0].outside = rays[3].outside = true;
  EXPECT_EQ(rays_inside(rays), (std::vector<std::size_t>{1, 2, 4}));
}

TEST(HitCodec, RecordsArriveWhereTheirRaysAre) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  constexpr std::size_t kRays = 200;
  std::vector<GridRay> rays(kRays);
  for (std::size_t i = 0; i < kRays; ++i) {
    rays[i].record.t_max = static_cast<std::uint32_t>(i + 1);
    rays[i].outside = random.chance(3);
  }
  const std::vector<std::size_t> places = rays_inside(rays);
  const std::vector<std::uint64_t> ray_words = pack_rays(rays, places);
  ASSERT_EQ(ray_words.size(), kRayWords * places.size());

  std::vector<std::uint64_t> hit_words(kHitWords * places.size()), work_words(kWorkWords * places.size());
  std::vector<contract::HitRecord> records(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(contract::RayRecord::unpack(&ray_words[kRayWords * i]).t_max, places[i] + 1);
    contract::HitRecord& hit = records[i];
    hit.status = contract::kStatusHit;
    hit.id = static_cast<std::uint32_t>(places[i]);
    hit.t = static_cast<std::uint32_t>(random.below(1u << 24));
    hit.u = static_cast<std::uint32_t>(random.below(1u << 16));
    hit.v = static_cast<std::uint32_t>(random.below(1u << 16));
    hit.pack(&hit_words[kHitWords * i]);
    contract::WorkRecord work;
    work.down = static_cast<std::uint32_t>(places[i]), work.skipped = 3;
    work.pack(&work_words[kWorkWords * i]);
  }
  std::vector<Hit> hits(kRays);
  std::vector<RayWork> work(kRays);
  std::vector<std::uint64_t> raw(kHitWords * kRays);
  unpack_hits(hit_words, places, hits, raw);
  unpack_work(work_words, places, work);
  for (std::size_t ray = 0, i = 0; ray < kRays; ++ray) {
    if (rays[ray].outside) {
      EXPECT_FALSE(hits[ray].hit());
      EXPECT_EQ(work[ray], RayWork{});
      for (std::size_t k = 0; k < kHitWords; ++k) EXPECT_EQ(raw[kHitWords * ray + k], 0u);
      continue;
    }
    EXPECT_EQ(hits[ray].id, ray);
    EXPECT_EQ(code(hits[ray].t, contract::kTLimitFrac), records[i].t);
    EXPECT_EQ(code(hits[ray].u, contract::kBarycentricFrac), records[i].u);
    EXPECT_EQ(code(hits[ray].v, contract::kBarycentricFrac), records[i].v);
    EXPECT_EQ(work[ray].down, ray);
    EXPECT_EQ(work[ray].skipped, 3u);
    for (std::size_t k = 0; k < kHitWords; ++k) EXPECT_EQ(raw[kHitWords * ray + k], hit_words[kHitWords * i + k]);
    ++i;
  }
}

TEST(WalkWork, AddsEveryCounter) {
  WorkTotals sum;
  for (std::uint32_t i = 1; i <= 3; ++i) sum.add(RayWork{i, 10 * i, 100 * i, 1000 * i, 10000 * i});
  EXPECT_EQ(static_cast<const WalkWork<std::uint64_t>&>(sum), (WalkWork<std::uint64_t>{6, 60, 600, 6000, 60000}));
  EXPECT_EQ(sum.visits(), 666u);
}

}  // namespace
}  // namespace retrace
