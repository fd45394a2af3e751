// The streaming machine: both variants equal a plain model of them in every bit, and find what the grid of the lab finds; a grid image that is damaged
// is refused, and if a kernel sees it all the same, ends in a status.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "golden/accel/catalogue.hpp"
#include "golden/accel/grid_image.hpp"
#include "golden/accel/probe.hpp"
#include "golden/base/error.hpp"
#include "golden/compare/compare.hpp"
#include "golden/engine/stages/raster.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/stage_vectors.hpp"
#include "testbench/kit/test_pixels.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/streaming/grid_walk.hpp"
#include "testbench/streaming/stream_engine.hpp"
#include "testbench/streaming/stream_frame.hpp"

namespace retrace {
namespace {

using accel::GridImage;

/// Scenes for cameras are snapped with this reach, as those for pictures on the chip: a camera's record holds their box.
constexpr double kCameraReach = 7.0 / 8.0;

constexpr StreamVariant kVariants[] = {StreamVariant::kMultiPass, StreamVariant::kBranching};

struct Case {
  TracedScene traced;
  GridImage grid;
  std::vector<GridRay> rays;

  Case(const std::string& name, std::size_t count, std::uint64_t seed)
      : traced(prepare_scene(open_scene(name))), grid(GridImage::build(traced.grid)) {
    Random random(seed);
    rays = make_test_rays(traced.grid, traced.image, count, random);
  }
};

struct Outcome {
  std::vector<Hit> hits;
  std::vector<RayWork> work;
  std::vector<std::uint64_t> raw;
  StreamTotals totals;
};

Outcome run(std::span<const std::uint64_t> image, const std::array<std::int32_t, 6>& box, std::span<const GridRay> rays,
            StreamVariant variant) {
  const auto engine = make_stream_engine(image, box, variant);
  Outcome result;
  result.hits.resize(rays.size());
  result.work.resize(rays.size());
  engine->trace(rays, result.hits, result.work, {});
  result.raw.assign(engine->raw_hits().begin(), engine->raw_hits().end());
  result.totals = engine->totals();
  return result;
}

constexpr const char* kScenes[] = {"box",
                                   "sphere:cells=12",
                                   "knot:along=60,around=8",
                                   "field:count=24,cells=2",
                                   "needles:count=300",
                                   "slivers:count=300",
                                   "coincident:cells=6",
                                   "degenerate:count=120",
                                   "one",
                                   "none",
                                   "room:detail=0.03"};

TEST(Streaming, both_variants_give_the_bits_of_the_plain_model) {
  const std::uint64_t seed = test_seed();
  for (const char* name : kScenes) {
    const Case c(name, 900, seed);
    const Outcome runs[2] = {run(c.grid.words(), c.traced.grid.box, c.rays, kVariants[0]),
                             run(c.grid.words(), c.traced.grid.box, c.rays, kVariants[1])};
    std::uint64_t steps = 0;
    for (std::size_t i = 0; i < c.rays.size(); ++i) {
      if (c.rays[i].outside) continue;
      const GridWalk walk = walk_grid(c.grid, c.traced.grid.box, c.rays[i].record);
      std::array<std::uint64_t, contract::HitRecord::kWords> words;
      walk.hit.pack(words.data());
      for (const Outcome& r : runs) {
        ASSERT_TRUE(r.raw[2 * i] == words[0] && r.raw[2 * i + 1] == words[1])
            << name << " ray " << i << " seed " << seed << ": status " << r.hits[i].status << " id " << r.hits[i].id
            << ", the model has " << walk.hit.status << " and " << walk.hit.id;
        ASSERT_EQ(r.work[i].leaf, walk.voxels) << name << " ray " << i << " seed " << seed;
        ASSERT_EQ(r.work[i].tests, walk.tests) << name << " ray " << i << " seed " << seed;
      }
      steps += walk.voxels + walk.tests;
    }
    // The last step of a ray that leaves the grid or has its hit looks at no voxel.
    for (const Outcome& r : runs) {
      EXPECT_GE(r.totals.steps, steps) << name;
      EXPECT_LE(r.totals.steps, steps + r.totals.rays) << name;
      EXPECT_EQ(r.totals.voxels + r.totals.tests, steps) << name;
    }
    EXPECT_EQ(runs[0].totals.steps, runs[1].totals.steps) << name;
    EXPECT_EQ(runs[0].totals.slots, runs[0].totals.passes() * runs[0].totals.rays) << name;
    EXPECT_EQ(runs[1].totals.passes(), 0u);
  }
}

TEST(Streaming, finds_what_the_grid_of_the_lab_finds) {
  const std::uint64_t seed = test_seed();
  std::uint64_t hits = 0, same = 0, rays = 0, by_itself = 0;
  for (const char* name : kScenes) {
    const Case c(name, 3000, seed);
    const Outcome r = run(c.grid.words(), c.traced.grid.box, c.rays, StreamVariant::kMultiPass);
    std::vector<Hit> exact(c.rays.size());
    make_golden_engine(c.traced.grid, c.traced.image)->trace(c.rays, exact, {}, {});
    const accel::TriangleSet set = accel::from_grid(c.traced.grid);
    const auto grid = accel::make_grid(set, accel::GridDensity::kPharrExact);
    accel::Probe probe;
    const Comparator comparator(c.traced.grid);
    for (std::size_t i = 0; i < c.rays.size(); ++i) {
      const Verdict to_golden = comparator.compare(c.rays[i], exact[i], r.hits[i]);
      ASSERT_NE(to_golden.agreement, Agreement::kViolation)
          << name << " ray " << i << " seed " << seed << ": " << to_golden.reason << ", ids " << exact[i].id << " and "
          << r.hits[i].id;
      ASSERT_FALSE(to_golden.lost) << name << " ray " << i << " seed " << seed;
      Hit lab;
      if (!c.rays[i].outside) {
        const accel::Hit hit = grid->trace(accel::from_grid(c.rays[i]), probe);
        if (hit.hit()) lab = {contract::kStatusHit, hit.id, hit.t, hit.u, hit.v};
      }
      const Verdict to_lab = comparator.compare(c.rays[i], lab, r.hits[i]);
      ASSERT_FALSE(to_lab.lost) << name << " ray " << i << " seed " << seed;
      // The lab rounds t, so it may leave out a triangle on which the ray begins. Then the exact engine stands with the machine.
      if (to_lab.agreement == Agreement::kViolation) {
        ASSERT_EQ(to_golden.agreement, Agreement::kSame)
            << name << " ray " << i << " seed " << seed << ": " << to_lab.reason << ", ids " << lab.id << " and "
            << r.hits[i].id;
        ++by_itself;
      }
      same += to_lab.agreement == Agreement::kSame;
      hits += lab.hit();
      ++rays;
    }
  }
  EXPECT_LT(100 * by_itself, rays);
  std::printf("%llu rays, %llu hits, %llu the same as in the lab, %llu where the lab stands by itself\n",
              static_cast<unsigned long long>(rays), static_cast<unsigned long long>(hits),
              static_cast<unsigned long long>(same), static_cast<unsigned long long>(by_itself));
  EXPECT_GT(hits, rays / 3);
}

/// What of a damaged image's message must be in it.
void expect_refused(std::vector<std::uint64_t> words, const std::string& what) {
  auto header = contract::GridHeaderRecord::unpack(words.data());
  header.checksum = 0;
  header.pack(words.data());
  header.checksum = GridImage::checksum(words);
  header.pack(words.data());
  try {
    const GridImage image(std::move(words));
    ADD_FAILURE() << "accepted: " << what;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
  }
}

TEST(GridImage, a_damaged_one_is_refused_and_the_record_named) {
  const Case c("knot:along=24,around=6", 1, 1);
  const std::vector<std::uint64_t> good(c.grid.words().begin(), c.grid.words().end());
  const auto with_header = [&](const auto& change, const std::string& what) {
    std::vector<std::uint64_t> words = good;
    auto header = contract::GridHeaderRecord::unpack(words.data());
    change(header);
    header.pack(words.data());
    expect_refused(std::move(words), what);
  };
  using Header = contract::GridHeaderRecord;
  with_header([](Header& h) { ++h.magic; }, "no grid image");
  with_header([](Header& h) { ++h.version; }, "version");
  with_header([](Header& h) { ++h.lines; }, "lines");
  with_header([](Header& h) { h.resolution[1] = 0; }, "no voxels on axis 1");
  with_header([](Header& h) { h.side[2] = 0; }, "side 0 on axis 2");
  with_header([](Header& h) { h.side[0] = 1 << 25; }, "leaves the box of positions on axis 0");
  with_header([](Header& h) { ++h.list_offset; }, "overlap");
  with_header([](Header& h) { h.list_offset = 0; }, "overlap");
  with_header([](Header& h) { ++h.triangle_count; }, "overlap");
  with_header([](Header& h) { --h.step_limit; }, "step limit");
  const Header header = c.grid.header();
  const auto with_entry = [&](std::uint32_t offset, std::size_t i, std::uint32_t value, const std::string& what) {
    std::vector<std::uint64_t> words = good;
    std::uint64_t& word = words[offset * GridImage::kLineWords + i / 2];
    const int shift = static_cast<int>(32 * (i % 2));
    word = (word & ~(std::uint64_t{0xffffffff} << shift)) | (std::uint64_t{value} << shift);
    expect_refused(std::move(words), what);
  };
  with_entry(header.list_offset, 3, header.triangle_count, "list entry 3");
  with_entry(header.list_offset, header.list_count - 1, 0, "does not end");
  std::size_t full = 0;
  while (c.grid.voxel(full) == contract::kGridEmpty) ++full;
  with_entry(header.voxel_offset, full, 1, "voxel " + std::to_string(full));
  with_entry(header.voxel_offset, full, contract::kGridEmpty, "voxel ");
  std::vector<std::uint64_t> words = good;
  auto triangle = c.grid.triangle(2);
  triangle.exponent_v = triangle.exponent_u + 1;
  triangle.pack(&words[(header.triangle_offset + 2) * GridImage::kLineWords]);
  expect_refused(std::move(words), "triangle record 2");
  words = good;
  words[20] ^= 4;
  EXPECT_THROW(GridImage{std::move(words)}, Error);  // the checksum
  EXPECT_THROW(GridImage{std::vector<std::uint64_t>(7)}, Error);
  EXPECT_NO_THROW(GridImage{good});
}

TEST(Streaming, damaged_images_end_in_a_status_and_both_variants_agree) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const Case c("knot:along=24,around=6", 60, seed);
  std::array<int, 8> seen{};
  for (int n = 0; n < 120; ++n) {
    std::vector<std::uint64_t> words(c.grid.words().begin(), c.grid.words().end());
    for (int flips = 1 + static_cast<int>(random.below(4)); flips > 0; --flips) {
      // Half of the damage is in the header.
      const std::size_t word = n % 2 ? random.below(contract::GridHeaderRecord::kWords) : random.below(words.size());
      words[word] ^= std::uint64_t{1} << random.below(64);
    }
    const Outcome a = run(words, c.traced.grid.box, c.rays, kVariants[0]);
    const Outcome b = run(words, c.traced.grid.box, c.rays, kVariants[1]);
    ASSERT_EQ(a.raw, b.raw) << "damage " << n << " seed " << seed;
    for (const Hit& hit : a.hits) ++seen[hit.status];
  }
  EXPECT_GT(seen[contract::kStatusBadRecord], 0);
  EXPECT_GT(seen[contract::kStatusBadIndex], 0);
}

TEST(Streaming, a_ray_that_uses_up_the_step_limit_says_so) {
  const Case c("knot:along=24,around=6", 200, 3);
  std::vector<std::uint64_t> words(c.grid.words().begin(), c.grid.words().end());
  auto header = contract::GridHeaderRecord::unpack(words.data());
  header.step_limit = 5;
  header.pack(words.data());
  for (const StreamVariant variant : kVariants) {
    const Outcome r = run(words, c.traced.grid.box, c.rays, variant);
    int limited = 0;
    for (std::size_t i = 0; i < c.rays.size(); ++i) {
      EXPECT_LE(r.work[i].leaf + r.work[i].tests, 5u);
      limited += r.hits[i].status == contract::kStatusStepLimit;
    }
    EXPECT_GT(limited, 20);
  }
}

TEST(Streaming, eye_rays_are_those_of_the_golden_raster) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const GridImage image = GridImage::build(snap(flatten(open_scene("box")), kCameraReach));
  const auto& h = image.header();
  std::array<std::int32_t, 6> box;
  for (int a = 0; a < 3; ++a) {
    box[2 * a] = h.lower[a];
    box[2 * a + 1] = h.lower[a] + h.side[a] * static_cast<std::int32_t>(h.resolution[a]);
  }
  int active = 0;
  for (int n = 0; n < 40; ++n) {
    const contract::CameraRecord camera = random_camera(random, box);
    const contract::FrameRecord frame = random_frame(random, 20);
    const EyeRays made = eye_rays_by_kernel(image.words(), camera, frame, n % 4);
    for (std::uint32_t pixel = 0; pixel < frame.width * frame.height; ++pixel) {
      const auto golden = golden::raster(camera, frame, box, pixel % frame.width, pixel / frame.width, n % 4);
      const light_model::Note& note = made.notes[pixel];
      ASSERT_EQ(note.active, golden.enters != 0 && golden.bad == 0) << "frame " << n << " seed " << seed;
      ASSERT_EQ(note.pixel, pixel);
      if (!note.active) continue;
      ++active;
      ASSERT_EQ(made.rays[pixel].origin, golden.origin) << "frame " << n << " seed " << seed;
      ASSERT_EQ(made.rays[pixel].direction, golden.direction);
      ASSERT_EQ(made.rays[pixel].t_max, golden.t_max);
    }
  }
  EXPECT_GT(active, 100);
}

TEST(Streaming, shade_gives_the_bits_of_its_model) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const Case c("box", 1, 1);
  const auto& h = c.grid.header();
  std::array<std::int32_t, 3> upper;
  for (int a = 0; a < 3; ++a) upper[a] = h.lower[a] + h.side[a] * static_cast<std::int32_t>(h.resolution[a]);
  int shadows = 0, bounces = 0, direct = 0;
  for (int n = 0; n < 4000; ++n) {
    std::vector<contract::MaterialRecord> materials(1 + random.below(3));
    for (auto& material : materials) {
      material = directed_record<contract::MaterialRecord>(random);
      material.unlit = random.chance(8);
    }
    contract::RaySetupInRecord ray = directed_record<contract::RaySetupInRecord>(random);
    contract::HitRecord hit = directed_record<contract::HitRecord>(random);
    light_model::Light light;
    light.seed = static_cast<std::uint32_t>(random.below(std::uint64_t{1} << 32));
    // Half of them as a picture has them, half of them anything.
    const bool sound = n % 2 == 0;
    for (int a = 0; a < 3; ++a) {
      light.position[a] =
          static_cast<std::int32_t>(sound ? random.integer(h.lower[a], upper[a]) : directed_value(random, 27, true));
      light.colour[a] = static_cast<std::uint32_t>(random.below(256));
      if (sound) ray.origin[a] = static_cast<std::int32_t>(random.integer(h.lower[a], upper[a]));
      if (sound)
        for (auto& material : materials) material.normal[a] = static_cast<std::int32_t>(random.integer(-2300, 2300));
    }
    if (sound || random.chance(2)) hit.status = contract::kStatusHit;
    if (sound) hit.t = static_cast<std::uint32_t>(random.below(1 << 24));
    hit.id = static_cast<std::uint32_t>(random.below(materials.size() + (sound ? 0 : 1)));
    light_model::Note note = light_model::Note::unpack(random.below(std::uint64_t{1} << 63));
    if (sound) note.active = true;
    const light_model::Lit expected =
        light_model::light_hit(ray.origin, ray.direction, hit, note,
                               hit.id < materials.size() ? &materials[hit.id] : nullptr, h.lower, upper, light, 0);
    const light_model::Lit made = light_by_kernel(c.grid.words(), materials, ray, hit, note, light);
    ASSERT_EQ(made.direct.active, expected.direct.active) << "case " << n << " seed " << seed;
    ASSERT_EQ(made.shadow_note.active, expected.shadow_note.active) << "case " << n << " seed " << seed;
    ASSERT_EQ(made.bounce_note.active, expected.bounce_note.active) << "case " << n << " seed " << seed;
    // Notes and rays that do not count may hold anything.
    if (made.direct.active) ASSERT_EQ(made.direct, expected.direct) << "case " << n << " seed " << seed;
    if (made.shadow_note.active) {
      ASSERT_EQ(made.shadow_note, expected.shadow_note) << "case " << n << " seed " << seed;
      ASSERT_EQ(made.shadow, expected.shadow) << "case " << n << " seed " << seed;
    }
    if (made.bounce_note.active) {
      ASSERT_EQ(made.bounce_note, expected.bounce_note) << "case " << n << " seed " << seed;
      ASSERT_EQ(made.bounce, expected.bounce) << "case " << n << " seed " << seed;
    }
    // What is sent on is a ray that every engine takes: no longer than 1, from inside the grid.
    for (const auto& [sent, counts] :
         {std::pair{made.shadow, made.shadow_note.active}, {made.bounce, made.bounce_note.active}}) {
      if (!counts) continue;
      std::int64_t square = 0;
      for (int a = 0; a < 3; ++a) {
        square += std::int64_t{sent.direction[a]} * sent.direction[a];
        EXPECT_TRUE(sent.origin[a] >= h.lower[a] && sent.origin[a] <= upper[a]);
      }
      EXPECT_LE(square, std::int64_t{1} << 52) << "case " << n << " seed " << seed;
      EXPECT_GE(square, std::int64_t{1} << 48) << "case " << n << " seed " << seed;
    }
    shadows += made.shadow_note.active, bounces += made.bounce_note.active, direct += made.direct.active;
  }
  EXPECT_GT(shadows, 300);
  EXPECT_GT(bounces, 1000);
  EXPECT_GT(direct, 100);
}

TEST(Streaming, no_rays_are_no_passes) {
  const Case c("one", 1, 1);
  for (const StreamVariant variant : kVariants)
    EXPECT_EQ(run(c.grid.words(), c.traced.grid.box, {}, variant).totals.screens, 0u);
  EXPECT_THROW(stream_engine_kind().check("both"), UsageError);
}

}  // namespace
}  // namespace retrace
