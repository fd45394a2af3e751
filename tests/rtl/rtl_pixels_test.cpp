// rt_raster and rt_shade against the golden model in every bit of every ray and pixel (testbench/sim/sv/tb_pixels.sv). The core between them is played
// here: hits come in any order, after any time. Without stalls, with stalls at random on every port, and with each stream held for long.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <vector>

#include "golden/engine/pixels.hpp"
#include "golden/engine/stages/raster.hpp"
#include "golden/engine/stages/shade.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/kit/test_pixels.hpp"
#include "testbench/sim/clocked.hpp"
#include "Vtb_pixels_b128.h"
#include "Vtb_pixels_b64.h"
#include "Vtb_pixels_g64.h"

namespace retrace {
namespace {

using cosim::Clocked;
constexpr std::uint64_t kBase = 0x3fffff'ffc0;  // crosses a page, needs all address bits
constexpr unsigned kMaterials = 100;
constexpr unsigned kBroken = 56;  // begins a granule
constexpr unsigned kPlaced = 12;
constexpr unsigned kBrokenPlaced = 8;

struct Traffic {
  const char* name;
  unsigned ray = 100, hit = 100, fetch = 100, fill = 100,
           pixel = 100;  // percent of the clocks in which the port is active
  bool any_order = false;
  unsigned most = 64;  // rays in the core
  unsigned hold = 0;   // clocks for which rays, then hits, then answers, then pixels are held, in turn
};
constexpr Traffic kTraffic[] = {
    {.name = "free"},
    {.name = "random", .ray = 40, .hit = 50, .fetch = 30, .fill = 40, .pixel = 50, .any_order = true},
    {.name = "slow memory", .fetch = 5, .fill = 5, .any_order = true},
    {.name = "slow sink", .pixel = 3},
    {.name = "slow core", .ray = 5, .hit = 90, .any_order = true},
    {.name = "a deep core", .hit = 20, .any_order = true, .most = 4000},
    {.name = "held in turn", .any_order = true, .hold = 700},
};

template <typename Model>
constexpr unsigned kBusBytes = std::is_same_v<Model, Vtb_pixels_b128> ? 16 : 8;
template <typename Model>
constexpr bool kLevels = !std::is_same_v<Model, Vtb_pixels_b128>;
template <typename Model>
constexpr unsigned kGranule = std::is_same_v<Model, Vtb_pixels_g64> ? 64 : kBusBytes<Model>;

template <typename Model>
class Pixels : public testing::Test {
 protected:
  Pixels() : random_(test_seed()), bench_(test_seed()) {
    std::vector<contract::MaterialRecord> materials(kMaterials - 2 * kPlaced);
    for (auto& material : materials) material = random_material(random_);
    std::vector<contract::InstanceShadeRecord> placed(kPlaced);
    for (auto& record : placed) {
      record = random_instance_shade(random_);
      if (!random_.chance(4))
        record.material =
            static_cast<std::uint32_t>(random_.integer(-40, 80)) & ((1u << contract::kMaterialIndexBits) - 1);
    }
    table_ = ShadeTable(placed, materials);
    if (!kLevels<Model>) table_.instances = 0;
    bench_->start_i = bench_->hit_valid_i = bench_->fill_valid_i = 0;
    bench_->base_i = kBase;
    bench_->count_i = kMaterials;
    bench_->placed_i = kPlaced;
    bench_.reset();
  }
  ~Pixels() override { EXPECT_FALSE(bench_.failed()) << "an assertion of the RTL; seed " << test_seed(); }

  static bool holds(const Traffic& traffic, std::uint64_t clock, unsigned port) {
    return traffic.hold != 0 && clock / traffic.hold % 5 == port;
  }

  /// Hit of a sample: none, one with a material, one beyond the materials, an error.
  contract::PlacedHitRecord random_hit() {
    contract::PlacedHitRecord hit;
    hit.id = contract::kNoTriangle;
    hit.status = static_cast<std::uint32_t>(random_.chance(16) ? 2 + random_.below(6) : random_.below(5) != 0);
    if (hit.status != static_cast<std::uint32_t>(contract::kStatusHit)) return hit;
    hit.t = static_cast<std::uint32_t>(random_.bits() >> 37) >> random_.below(16);
    // Often the triangle of the sample before.
    if (!random_.chance(3))
      last_id_ = static_cast<std::uint32_t>(random_.chance(20) ? random_.bits() : random_.below(kMaterials));
    hit.id = last_id_;
    if (!random_.chance(3)) last_number_ = static_cast<std::uint32_t>(random_.below(kPlaced + 2));
    hit.number = last_number_;
    return hit;
  }

  void run(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
           const std::array<std::int32_t, 6>& box, const Traffic& traffic) {
    // What each pixel has to become: the golden model, with hits drawn here.
    using Traced = std::pair<contract::RayRecord, contract::PlacedHitRecord>;
    std::map<std::uint32_t, std::vector<Traced>> expected;  // by pixel
    std::vector<Traced> towards;                            // the light, in any order
    std::size_t traced = 0;
    std::vector<std::uint32_t> order;  // pixels of the camera's rays
    PixelTotals totals;
    materials_ = table_;
    if (broken_) {
      // Without its record an instance has no material.
      for (std::uint32_t number = kBrokenPlaced; number < table_.instances; ++number) {
        contract::InstanceShadeRecord record;
        record.material = 1u << (contract::kMaterialIndexBits - 1);
        record.pack(&materials_.words[2 * number]);
      }
    }
    ShadeTable seen = materials_;
    if (broken_) seen.words.resize(kBroken);
    const std::vector<std::uint32_t> pixels = draw_golden(
        camera, frame, box, seen,
        [&](std::span<const contract::RayRecord> rays, std::span<contract::PlacedHitRecord> hits) {
          std::size_t next = 0;
          if (traced != 0) {
            for (std::size_t i = 0; i < rays.size(); ++i) {
              // Rays of several samples may be the same, so what becomes of one is in its bits.
              const std::uint32_t bits = static_cast<std::uint32_t>(rays[i].origin[0]) * 2654435761u ^
                                         static_cast<std::uint32_t>(rays[i].origin[1]) * 2246822519u;
              hits[i].status = static_cast<std::uint32_t>(bits >> 28 == 0 ? 2 + (bits >> 24 & 5) : bits >> 27 & 1);
              towards.push_back({rays[i], hits[i]});
              ++shadow_rays_;
              shadows_ += hits[i].status == static_cast<std::uint32_t>(contract::kStatusHit);
            }
            return;
          }
          golden::for_each_pixel(frame, [&](std::uint32_t x, std::uint32_t y) {
            for (std::uint32_t s = 0; s < 1u << frame.samples; ++s) {
              const auto made = golden::raster(camera, frame, box, x, y, s);
              if (made.enters == 0) continue;
              hits[next] = random_hit();
              expected[made.pixel].push_back({rays[next], hits[next]});
              order.push_back(made.pixel);
              ++next;
            }
          });
          ASSERT_EQ(next, rays.size());
          traced = next;
        },
        &totals);

    std::array<std::uint64_t, contract::CameraRecord::kWords> camera_words{};
    std::array<std::uint64_t, contract::FrameRecord::kWords> frame_words{};
    camera.pack(camera_words.data());
    frame.pack(frame_words.data());
    for (std::size_t i = 0; i < 16; ++i)
      bench_->camera_i[i] = static_cast<std::uint32_t>(camera_words[i / 2] >> 32 * (i % 2));
    for (std::size_t i = 0; i < 8; ++i)
      bench_->frame_i[i] = static_cast<std::uint32_t>(frame_words[i / 2] >> 32 * (i % 2));
    for (std::size_t f = 0; f < 6; ++f) bench_->box_i[f] = static_cast<std::uint32_t>(box[f]);

    struct Flying {
      std::uint32_t tag;
      contract::PlacedHitRecord hit;
    };
    std::vector<Flying> flying;
    std::array<std::deque<std::pair<std::uint64_t, unsigned>>, 2>
        reads;  // of materials and instances: address, beats left
    std::vector<std::uint32_t> drawn(pixels.size(), 0xdeadbeef);
    std::vector<bool> done(pixels.size());
    std::map<std::uint32_t, std::size_t> made;
    std::size_t rays = 0, finished = 0, unknown = 0, bad = 0;
    const std::uint32_t words = golden::pixel_words(frame.kind);
    const std::size_t count = std::size_t{frame.width} * frame.height;
    bool offers_hit = false, offers_fill = false;
    std::size_t hit_at = 0;
    const std::uint64_t first = bench_.clock(), limit = first + 20000 + 3000 * (count << frame.samples);
    bool started = false;
    while (bench_.clock() < limit && !bench_.failed()) {
      const std::uint64_t clock = bench_.clock() - first;
      bench_->start_i = !started;
      bench_->ray_ready_i =
          random_.below(100) < traffic.ray && !holds(traffic, clock, 0) && flying.size() < traffic.most;
      bench_->fetch_ready_i = random_.below(100) < traffic.fetch && !holds(traffic, clock, 2);
      bench_->pixel_ready_i = random_.below(100) < traffic.pixel && !holds(traffic, clock, 3);
      if (!offers_hit && !flying.empty() && random_.below(100) < traffic.hit && !holds(traffic, clock, 1)) {
        offers_hit = true;
        hit_at = traffic.any_order ? random_.below(flying.size()) : 0;
        bench_->hit_tag_i = flying[hit_at].tag;
        bench_->hit_status_i = static_cast<std::uint8_t>(flying[hit_at].hit.status);
        bench_->hit_id_i = flying[hit_at].hit.id;
        bench_->hit_t_i = flying[hit_at].hit.t;
        bench_->hit_number_i = flying[hit_at].hit.number;
      }
      bench_->hit_valid_i = offers_hit;
      const std::size_t reader = reads[0].empty() || (!reads[1].empty() && random_.chance(2)) ? 1 : 0;
      offers_fill = !reads[reader].empty() && random_.below(100) < traffic.fill && !holds(traffic, clock, 2);
      bench_->fill_valid_i = static_cast<std::uint8_t>(offers_fill ? 1u << reader : 0u);
      if (offers_fill) fill(reads[reader].front().first, reader);
      bench_.settle();
      const bool ray = bench_->ray_valid_o && bench_->ray_ready_i, hit = offers_hit && bench_->hit_ready_o;
      if (ray) {
        const std::uint32_t tag = bench_->ray_tag_o, pixel = tag & ((1u << contract::kFramePixelsLog2) - 1);
        contract::RayRecord got;
        for (std::size_t a = 0; a < 3; ++a) {
          got.origin[a] = static_cast<std::int32_t>(bench_->ray_origin_o[a]);
          got.direction[a] = static_cast<std::int32_t>(bench_->ray_direction_o[a]);
        }
        got.t_max = bench_->ray_t_max_o;
        got.any = bench_->ray_any_o;
        const auto same = [&](const Traced& one) {
          return one.first.origin == got.origin && one.first.direction == got.direction &&
                 one.first.t_max == got.t_max && one.first.any == got.any;
        };
        ASSERT_FALSE(bench_->ray_error_o);
        if (got.any != 0) {
          const auto found = std::ranges::find_if(towards, same);
          ASSERT_NE(found, towards.end()) << "a ray that nobody wants, pixel " << pixel << ", seed " << test_seed();
          flying.push_back({tag, found->second});
          towards.erase(found);
        } else {
          const std::size_t sample = made[pixel]++;
          ASSERT_LT(rays, order.size());
          ASSERT_EQ(pixel, order[rays]) << "seed " << test_seed();
          ++rays;
          ASSERT_LT(sample, expected[pixel].size()) << "a ray too many, pixel " << pixel << ", seed " << test_seed();
          ASSERT_TRUE(same(expected[pixel][sample])) << "pixel " << pixel << ", seed " << test_seed();
          flying.push_back({tag, expected[pixel][sample].second});
        }
      }
      for (std::size_t r = 0; r < 2; ++r) {
        if ((bench_->fetch_valid_o >> r & 1) == 0 || !bench_->fetch_ready_i) continue;
        const unsigned bytes = r == 0 ? kGranule<Model> : std::max(kGranule<Model>, 16u);
        ASSERT_EQ(bench_->fetch_addr_o[r] % bytes, 0u);
        ASSERT_EQ((bench_->fetch_len_o[r] + 1u) * kBusBytes<Model>, bytes);
        reads[r].emplace_back(bench_->fetch_addr_o[r], bench_->fetch_len_o[r] + 1u);
      }
      if (bench_->pixel_valid_o && bench_->pixel_ready_i) {
        const std::uint32_t pixel = bench_->pixel_tag_o;
        ASSERT_LT(pixel, count);
        ASSERT_FALSE(done[pixel]) << "a pixel twice, " << pixel << ", seed " << test_seed();
        done[pixel] = true;
        drawn[words * pixel] = static_cast<std::uint32_t>(bench_->pixel_data_o);
        if (words == 2) drawn[words * pixel + 1] = static_cast<std::uint32_t>(bench_->pixel_data_o >> 32);
        ++finished;
      }
      unknown += bench_->unknown_o;
      bad += bench_->bad_o;
      const bool over = started && bench_->source_done_o && bench_->idle_o && flying.empty();
      bench_.rise();
      if (hit) {
        flying.erase(flying.begin() + static_cast<std::ptrdiff_t>(hit_at));
        offers_hit = false;
      }
      if (offers_fill) {
        reads[reader].front().first += kBusBytes<Model>;
        if (--reads[reader].front().second == 0) reads[reader].pop_front();
      }
      started = true;
      if (over) break;
    }
    EXPECT_EQ(finished, count) << "seed " << test_seed();
    EXPECT_EQ(rays, traced);
    EXPECT_TRUE(towards.empty());
    EXPECT_TRUE(reads[0].empty() && reads[1].empty());
    // A material that cannot be read is reported once for all samples in a row that want it.
    if (broken_) {
      EXPECT_LE(unknown, totals.unknown);
      EXPECT_EQ(unknown != 0, totals.unknown != 0);
    } else {
      EXPECT_EQ(unknown, totals.unknown);
    }
    EXPECT_EQ(bad, totals.bad_samples);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (drawn[i] == pixels[i]) continue;
      if (differ++ == 0)
        ADD_FAILURE() << "word " << i << " is " << std::hex << drawn[i] << ", expected " << pixels[i] << ", seed "
                      << std::dec << test_seed();
    }
    EXPECT_EQ(differ, 0u);
  }

  void fill(std::uint64_t address, std::size_t reader) {
    std::array<std::uint64_t, 2> words{};
    for (unsigned i = 0; i < kBusBytes<Model> / 8; ++i) {
      const std::uint64_t at = (address - kBase) / 8 + i;  // granules may begin before, or end behind
      words[i] = at < table_.size() ? (reader == 0 ? materials_ : table_).words[at] : random_.bits();
    }
    if constexpr (kBusBytes<Model> == 16) {
      for (unsigned i = 0; i < 4; ++i)
        bench_->fill_data_i[i] = static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2));
    } else {
      bench_->fill_data_i = words[0];
    }
    // Of several beats only the first: it has to be remembered.
    const std::uint64_t first =
        kBase + (reader == 0 ? kBroken * contract::kMaterialBytes : kBrokenPlaced * contract::kInstanceShadeBytes);
    bench_->fill_error_i =
        broken_ && address >= first && address % std::max(kGranule<Model>, reader == 0 ? 8u : 16u) == 0;
  }

  Random random_;
  Clocked<Model> bench_;
  ShadeTable table_, materials_;  // the table, and what reads of materials see of it
  std::uint32_t last_id_ = 0, last_number_ = 0;
  std::size_t shadow_rays_ = 0, shadows_ = 0;
  bool broken_ = false;  // materials kBroken and up cannot be read
};

struct Name {
  template <typename Model>
  static std::string GetName(int) {
    if (std::is_same_v<Model, Vtb_pixels_b64>) return "Bus64";
    return std::is_same_v<Model, Vtb_pixels_b128> ? "Bus128" : "Granule64";
  }
};
using Models = testing::Types<Vtb_pixels_b64, Vtb_pixels_b128, Vtb_pixels_g64>;
TYPED_TEST_SUITE(Pixels, Models, Name);

TYPED_TEST(Pixels, FramesAreTheGoldenModels) {
  for (const Traffic& traffic : kTraffic) {
    SCOPED_TRACE(traffic.name);
    for (int i = 0; i < 12; ++i) {
      SCOPED_TRACE(i);
      const auto box = random_box(this->random_);
      const auto camera = random_camera(this->random_, box);
      // More pixels than slots now and then.
      auto frame = random_frame(this->random_, i % 6 == 5 ? 40 : 12);
      if (i % 6 == 5) frame.width = frame.height = 36;
      if (i % 6 == 3) frame.light[this->random_.below(3)] = -4096;
      if (i % 6 == 4) frame.light = {};
      if (i % 3 == 0) frame.kind = contract::kPixelColour, frame.shadows = 1;
      this->run(camera, frame, box, traffic);
      if (this->HasFailure()) return;
    }
  }
  EXPECT_GT(this->shadow_rays_, 300u);
  EXPECT_GT(this->shadows_, 100u);
}

// Answers with errors: what cannot be read looks like the background, and is reported; what comes after it is as good as ever.
TYPED_TEST(Pixels, MaterialsThatCannotBeRead) {
  this->broken_ = true;
  for (int i = 0; i < 12; ++i) {
    const auto box = random_box(this->random_);
    auto frame = random_frame(this->random_, 12);
    frame.kind = contract::kPixelColour;
    this->run(random_camera(this->random_, box), frame, box, kTraffic[i % 2]);
    if (this->HasFailure()) return;
  }
}

// Cameras of random bits: samples are misses, some of them marked, and every pixel is drawn.
TYPED_TEST(Pixels, CamerasThatNobodyWrites) {
  std::size_t bad = 0;
  for (int i = 0; i < 40; ++i) {
    contract::CameraRecord camera = random_camera(this->random_, random_box(this->random_));
    for (std::size_t k = this->random_.below(4); k-- > 0;)
      camera.e[this->random_.below(3)] = static_cast<std::uint32_t>(this->random_.below(32));
    for (std::size_t k = this->random_.below(4); k-- > 0;)
      camera.m[this->random_.below(9)] = static_cast<std::int32_t>(this->random_.bits());
    if (this->random_.chance(3)) camera.m = {};
    this->run(camera, random_frame(this->random_, 8), random_box(this->random_), kTraffic[i % 2]);
    if (this->HasFailure()) return;
    bad += golden::raster(camera, {.width = 1, .height = 1}, {}, 0, 0, 0).bad;
  }
  EXPECT_GT(bad, 5u);
}

// Frames that cannot be drawn: a fault, no sample, nothing hangs; the next frame is as good as any.
TYPED_TEST(Pixels, FramesThatCannotBeDrawn) {
  const auto box = random_box(this->random_);
  const auto camera = random_camera(this->random_, box);
  const contract::FrameRecord good = random_frame(this->random_, 6);
  std::vector<contract::FrameRecord> bad(8, good);
  bad[0].width = 0;
  bad[1].height = 0;
  bad[2].width = 4097;
  bad[3].height = 8191;
  bad[4].width = 4096, bad[4].height = 2049;
  bad[5].samples = 3, bad[5].kind = contract::kPixelColour;
  bad[6].kind = 4;
  bad[7].kind = contract::kPixelId, bad[7].samples = 1;
  for (const contract::FrameRecord& frame : bad) {
    ASSERT_FALSE(golden::frame_fits(frame));
    std::array<std::uint64_t, contract::FrameRecord::kWords> words{};
    frame.pack(words.data());
    for (std::size_t i = 0; i < 8; ++i)
      this->bench_->frame_i[i] = static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2));
    this->bench_->ray_ready_i = 1;
    this->bench_->pixel_ready_i = 1;
    unsigned faults = 0, moved = 0;
    for (int i = 0; i < 2000; ++i) {
      this->bench_->start_i = i == 0;
      this->bench_.settle();
      faults += this->bench_->fault_o;
      moved += this->bench_->ray_valid_o + this->bench_->pixel_valid_o + this->bench_->fetch_valid_o;
      if (i == 1) EXPECT_FALSE(this->bench_->source_done_o);
      this->bench_.rise();
    }
    EXPECT_EQ(faults, 1u);
    EXPECT_EQ(moved, 0u);
    EXPECT_TRUE(this->bench_->source_done_o);
    EXPECT_TRUE(this->bench_->idle_o);
    this->run(camera, good, box, kTraffic[0]);
    if (this->HasFailure()) return;
  }
}

}  // namespace
}  // namespace retrace
