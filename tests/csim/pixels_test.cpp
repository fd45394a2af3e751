// Pictures by the kernels alone (hls/top/pixels.cpp) against the golden model: rays and shading on random cameras, frames and materials in every bit, whole
// pictures with hits by brute force over all triangles.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "golden/engine/pixels.hpp"
#include "golden/engine/stages/raster.hpp"
#include "golden/engine/stages/shade.hpp"
#include "golden/engine/stages/shadow.hpp"
#include "golden/render/chip_frame.hpp"
#include "golden/tree/kd_builder.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_pixels.hpp"
#include "testbench/kit/brute_force.hpp"
#include "testbench/kit/test_pixels.hpp"
#include "testbench/kit/two_level_walk.hpp"
#include "testbench/kit/two_level_world.hpp"

namespace retrace {
namespace {

/// A scene as it is prepared for pictures on the chip.
struct ChipScene {
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  MemoryImage image;

  explicit ChipScene(const std::string& name)
      : scene(open_scene(name)), world(flatten(scene)), grid(snap(world, kChipReach)) {
    image = build_kd(grid);
  }
};

void brute_force(const MemoryImage& image, std::span<const contract::RayRecord> rays,
                 std::span<contract::PlacedHitRecord> hits) {
  const BruteForce all(image);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const BruteForce::Result result = all.trace(rays[i]);
    hits[i].status = static_cast<std::uint32_t>(result.hit ? contract::kStatusHit : contract::kStatusMiss);
    hits[i].t = result.t;
    hits[i].id = result.id;
  }
}

/// An image of a header alone: no more of it is read.
struct alignas(16) HeaderImage : std::array<std::uint64_t, contract::HeaderRecord::kWords> {};
HeaderImage header_image(const std::array<std::int32_t, 6>& box) {
  contract::HeaderRecord header;
  header.magic = static_cast<std::uint32_t>(contract::kImageMagic);
  header.version = static_cast<std::uint32_t>(contract::kImageVersion);
  for (std::size_t f = 0; f < 6; ++f) header.box[f] = static_cast<std::uint32_t>(box[f]);
  HeaderImage words{};
  header.pack(words.data());
  return words;
}

void expect_picture(const ChipScene& scene, const ViewCamera& view, const ChipOptions& options) {
  const Surfaces surfaces(scene.scene, scene.world, scene.grid);
  const auto camera = chip_camera(view, scene.grid, options.width, options.height);
  const auto frame = chip_frame(view, options);
  const auto materials = chip_shading(surfaces);
  PixelTotals totals;
  const auto expected = draw_golden(
      camera, frame, scene.grid.box, materials,
      [&](std::span<const contract::RayRecord> rays, std::span<contract::PlacedHitRecord> hits) {
        brute_force(scene.image, rays, hits);
      },
      &totals);
  const auto engine = make_csim_pixels(scene.image.words(), materials);
  for (const WayUp way_up : {WayUp::kFaceLinks, WayUp::kParentLinks}) {
    const auto drawn = engine->draw(camera, frame, {.way_up = way_up});
    ASSERT_EQ(drawn.size(), expected.size());
    std::size_t differ = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) differ += drawn[i] != expected[i];
    EXPECT_EQ(differ, 0u);
    EXPECT_EQ(engine->totals().samples, totals.samples);
    EXPECT_EQ(engine->totals().rays, totals.rays);
    EXPECT_EQ(engine->totals().shadow_rays, totals.shadow_rays);
    EXPECT_EQ(engine->totals().bad_samples, 0u);
    EXPECT_EQ(engine->totals().unknown, 0u);
  }
  EXPECT_GT(totals.rays, totals.samples / 8);
  EXPECT_EQ(totals.shadow_rays > 0, options.shadows);
}

TEST(CsimPixels, KnotAndRoomAreTheGoldenModels) {
  for (const char* name : {"knot", "room:detail=0.1"}) {
    SCOPED_TRACE(name);
    const ChipScene scene(name);
    const ViewCamera view = default_view(scene.scene, scene.world);
    for (const int kind : {contract::kPixelColour, contract::kPixelDepth, contract::kPixelId, contract::kPixelHit})
      expect_picture(scene, view, {.width = 21, .height = 15, .kind = static_cast<std::uint32_t>(kind)});
    expect_picture(scene, view, {.width = 14, .height = 20, .samples = 2});
    expect_picture(scene, view, {.width = 20, .height = 14, .samples = 4});
    expect_picture(scene, view, {.width = 21, .height = 15, .shadows = true});
    expect_picture(scene, view, {.width = 14, .height = 10, .samples = 4, .shadows = true});
  }
}

// The eye far outside, close by, inside and beside; orthographic.
TEST(CsimPixels, CamerasAnywhere) {
  const ChipScene scene("knot");
  Random random(test_seed());
  const ViewCamera view = default_view(scene.scene, scene.world);
  const glm::dvec3 middle = scene.grid.transform.center;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    ViewCamera moved = view;
    moved.zfar = std::numeric_limits<double>::infinity();
    const double factor = std::exp2(random.real(-3, 8));
    moved.world[3] = glm::dvec4(middle + glm::dvec3(view.world[2]) * (glm::length(view.eye() - middle) * factor), 1.0);
    moved.yfov = std::min(view.yfov / factor, 2.5);
    moved.perspective = i % 3 != 0;
    moved.xmag = moved.ymag = 1.2 / scene.grid.transform.scale;
    expect_picture(scene, moved, {.width = 16, .height = 12, .kind = contract::kPixelHit});
    if (HasFailure()) return;
  }
}

// What a picture shows is where it is: the depth of a pixel, along its ray in doubles, is the triangle that the ray hits there.
TEST(CsimPixels, DepthsAreThoseOfTheView) {
  const ChipScene scene("knot");
  const ViewCamera view = default_view(scene.scene, scene.world);
  constexpr int kWidth = 40, kHeight = 30;
  const auto camera = chip_camera(view, scene.grid, kWidth, kHeight);
  const auto frame = chip_frame(view, {.width = kWidth, .height = kHeight, .kind = contract::kPixelHit});
  const auto pixels = make_csim_pixels(scene.image.words(), {})->draw(camera, frame, {});
  const Surfaces surfaces(scene.scene, scene.world, scene.grid);
  double unit = 0.0;  // grid units along the view at t = 1
  for (std::size_t i = 0; i < 3; ++i) {
    const double ahead =
        std::ldexp(camera.m[3 * i + 2], static_cast<int>(camera.e[i]) - contract::kInstanceCoefficientFrac);
    unit += ahead * ahead / 4;
  }
  unit = std::sqrt(unit);
  std::size_t seen = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto at = static_cast<std::size_t>(2 * (y * kWidth + x));
      if (pixels[at + 1] == contract::kNoTriangle) continue;
      ++seen;
      const WorldRay ray = view.ray(x + 0.5, y + 0.5, kWidth, kHeight);
      const double depth = std::ldexp(pixels[at], -contract::kTFrac) * unit / scene.grid.transform.scale;
      const double along = depth / -glm::dot(ray.direction, glm::dvec3(view.world[2]));
      const glm::dvec3 point = ray.origin + ray.direction * along - scene.grid.transform.center;
      const glm::dvec3 corner = surfaces.vertex(pixels[at + 1], 0), normal = surfaces.front(pixels[at + 1]);
      EXPECT_LT(std::abs(glm::dot(point - corner, normal)) * scene.grid.transform.scale, 1e-5) << x << ' ' << y;
    }
  EXPECT_GT(seen, 100u);
}

TEST(CsimPixels, RaysOfRandomCamerasAndFrames) {
  Random random(test_seed());
  std::size_t enter = 0, pass = 0, bad = 0;
  for (int i = 0; i < 300; ++i) {
    const auto box = random_box(random);
    auto camera = random_camera(random, box);
    if (random.chance(4)) camera.e[random.below(3)] = static_cast<std::uint32_t>(random.below(32));
    if (random.chance(4)) camera.m[random.below(9)] = static_cast<std::int32_t>(random.bits());
    const auto frame = random_frame(random, 14);
    const auto kernel = raster_by_kernel(header_image(box), camera, frame);
    ASSERT_TRUE(kernel);
    const std::vector<contract::RasterOutRecord>& drawn = *kernel;
    std::size_t next = 0;
    golden::for_each_pixel(frame, [&](std::uint32_t x, std::uint32_t y) {
      for (std::uint32_t s = 0; s < 1u << frame.samples; ++s) {
        const auto expected = golden::raster(camera, frame, box, x, y, s);
        ASSERT_LT(next, drawn.size());
        std::array<std::uint64_t, contract::RasterOutRecord::kWords> a{}, b{};
        expected.pack(a.data());
        drawn[next++].pack(b.data());
        ASSERT_EQ(a, b) << "frame " << i << " pixel " << x << ' ' << y << ", seed " << test_seed();
        ++(expected.bad != 0 ? bad : expected.enters != 0 ? enter : pass);
      }
    });
    ASSERT_EQ(next, drawn.size());
  }
  EXPECT_GT(enter, 1000u);
  EXPECT_GT(pass, 1000u);
  EXPECT_GT(bad, 100u);
}

TEST(CsimPixels, ShadesOfRandomMaterials) {
  Random random(test_seed());
  std::size_t known = 0, unknown = 0;
  for (int i = 0; i < 50000; ++i) {
    const auto material = random_material(random);
    auto frame = random_frame(random, 8);
    contract::ShadeInRecord hit{.hit = 1, .shadow = random.chance(4)};
    // Random bits in the records of instances, too; their materials are wherever those point.
    std::vector<contract::InstanceShadeRecord> placed(random.below(3));
    for (auto& record : placed) record = random_instance_shade(random);
    std::vector<contract::MaterialRecord> materials(1 + random.below(3), material);
    hit.id = static_cast<std::uint32_t>(random.below(4));
    hit.number = static_cast<std::uint32_t>(random.below(4));
    if (!placed.empty() && random.chance(2)) {
      auto& record = placed[random.below(placed.size())];
      record.material = (2 * static_cast<std::uint32_t>(placed.size()) - hit.id) & ((1u << 25) - 1);
    }
    const ShadeTable table(placed, materials);
    bool none = false;
    const golden::Colour expected = golden::shade_sample(hit, table, frame, &none);
    ++(none ? unknown : known);
    frame.width = frame.height = 1;
    frame.kind = frame.samples = 0;
    std::uint64_t odd = 0;
    const auto pixel = shade_by_kernel(frame, std::span(&hit, 1), table, &odd);
    ASSERT_TRUE(pixel);
    ASSERT_EQ(pixel->at(0), golden::pack_colour(expected, 0)) << "seed " << test_seed();
    ASSERT_EQ(odd, none ? 1u : 0u);
  }
  EXPECT_GT(known, 5000u);
  EXPECT_GT(unknown, 5000u);
}

// Rays towards the light from hits that no image has: far away, at t = 0, with lights along an axis, of 0 and of the largest codes.
TEST(CsimPixels, ShadowRaysOfRandomHits) {
  Random random(test_seed());
  std::size_t made = 0, passed = 0;
  for (int i = 0; i < 200; ++i) {
    const auto box = random_box(random);
    const auto header = header_image(box);
    auto frame = random_frame(random, 12);
    frame.kind = 0;
    frame.shadows = 1;
    if (random.chance(8)) frame.light = {};
    if (random.chance(4)) frame.light[random.below(3)] = random.chance(2) ? 0 : -4096;
    const std::size_t count = std::size_t{frame.width} * frame.height << frame.samples;
    std::vector<contract::RasterOutRecord> samples(count);
    std::vector<contract::ShadeInRecord> hits(count);
    for (std::size_t s = 0; s < count; ++s) {
      for (std::size_t a = 0; a < 3; ++a) {
        samples[s].origin[a] =
            static_cast<std::int32_t>(random.integer(-(1 << 26), (1 << 26) - 1)) >> (random.chance(2) ? 0 : 3);
        samples[s].direction[a] = static_cast<std::int32_t>(random.integer(-(1 << 26), (1 << 26) - 1));
      }
      samples[s].pixel = static_cast<std::uint32_t>(s);
      hits[s].hit = !random.chance(4);
      hits[s].t = static_cast<std::uint32_t>(random.bits() >> 37) >> random.below(20);
    }
    const auto rays = shadows_by_kernel(header, frame, samples, hits);
    ASSERT_TRUE(rays);
    for (std::size_t s = 0; s < count; ++s) {
      const auto expected = golden::shadow(samples[s], hits[s].t, frame, box);
      const auto& ray = (*rays)[s];
      ASSERT_EQ(ray.enters, expected.enters & hits[s].hit) << "seed " << test_seed();
      ++(expected.enters != 0 ? made : passed);
      if (expected.enters == 0) continue;
      ASSERT_EQ(ray.origin, expected.origin) << "seed " << test_seed();
      ASSERT_EQ(ray.direction, expected.direction);
      ASSERT_EQ(ray.t_max, expected.t_max);
    }
  }
  EXPECT_GT(made, 2000u);
  EXPECT_GT(passed, 2000u);
}

// What a triangle looks like does not depend on whether it is an instance's, turned, mirrored or stretched: its colour on the object's records is that of
// its record in the world.
TEST(ChipShading, InstancesLookAsTheyDoInOneLevel) {
  const TracedScene flat = snap_scene(open_scene("field:count=60"), TwoLevels::kOff, kChipReach),
                    two = snap_scene(open_scene("field:count=60"), TwoLevels::kOn, kChipReach);
  const ShadeTable one = chip_shading(Surfaces(flat.scene, flat.world, flat.grid)),
                   placed = chip_shading(Surfaces(two.scene, two.world, two.grid));
  ASSERT_EQ(placed.instances, two.grid.instances.size());
  EXPECT_LT(placed.size(), one.size() / 2);
  Random random(test_seed());
  std::size_t seen = 0;
  for (std::uint32_t number = 0; number < placed.instances; ++number) {
    const contract::InstanceRecord& record = two.grid.instances[number].record;
    for (const GridTriangle& triangle : two.grid.objects[record.root].triangles) {
      auto frame = random_frame(random, 8);
      frame.ambient = 20;
      frame.diffuse = 230;
      const glm::dvec3 light = glm::normalize(glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)) +
                                              glm::dvec3(0, 0, 1e-9));
      for (int a = 0; a < 3; ++a) frame.light[static_cast<std::size_t>(a)] = static_cast<std::int32_t>(light[a] * 4095);
      contract::ShadeInRecord hit{.id = record.first_id + triangle.id, .number = number, .hit = 1};
      bool unknown = false;
      const golden::Colour turned = golden::shade_sample(hit, placed, frame, &unknown);
      ASSERT_FALSE(unknown);
      if (!find_triangle(flat.grid.triangles, hit.id)) continue;
      hit.number = contract::kNoTriangle;
      const golden::Colour world = golden::shade_sample(hit, one, frame);
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_NEAR(static_cast<int>(turned[c]), static_cast<int>(world[c]), 3)
            << "instance " << number << " triangle " << triangle.id << ", seed " << test_seed();
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000u);
}

// Scenes of two levels: the pictures of the walk in integers, with random records for shading and every frame.
TEST(CsimPixels, TwoLevelsAreTheGoldenModel) {
  Random random(test_seed());
  const TwoLevelWorld world = make_two_level_world(random, 12, 8);
  const MemoryImage image = make_two_level_image(world.scene);
  std::vector<contract::InstanceShadeRecord> placed(world.scene.instances.size());
  for (auto& record : placed) record = random_instance_shade(random);
  std::vector<contract::MaterialRecord> materials(2000);
  for (auto& material : materials) material = random_material(random);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const std::uint64_t first = 2 * placed.size() + random.below(1500);
    placed[i].material = (static_cast<std::uint32_t>(first) - world.scene.instances[i].first_id) &
                         ((1u << contract::kMaterialIndexBits) - 1);
  }
  const ShadeTable table(placed, materials);
  std::array<std::int32_t, 6> box{};
  for (std::size_t f = 0; f < 6; ++f) box[f] = static_cast<std::int32_t>(image.header().box[f]);
  const auto engine = make_csim_pixels(image.words(), table);
  std::uint64_t shadowed = 0, seen = 0;
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(i);
    const auto camera = random_camera(random, box);
    auto frame = random_frame(random, 16);
    frame.shadows = i % 3 != 0;
    PixelTotals totals;
    const auto expected = draw_golden(
        camera, frame, box, table,
        [&](std::span<const contract::RayRecord> rays, std::span<contract::PlacedHitRecord> hits) {
          for (std::size_t r = 0; r < rays.size(); ++r) {
            std::uint32_t status = 0;
            const TwoLevelHit hit = trace_two_levels(world.scene, rays[r], nullptr, &status, nullptr, true);
            hits[r].status = status;
            if (!hit.hit) continue;
            hits[r].t = hit.t;
            hits[r].id = world.scene.instances[hit.instance].first_id + hit.id;
            hits[r].number = hit.instance;
            ++(rays[r].any != 0 ? shadowed : seen);
          }
        },
        &totals);
    const auto drawn = engine->draw(camera, frame, {.way_up = i % 2 != 0 ? WayUp::kParentLinks : WayUp::kFaceLinks});
    ASSERT_EQ(drawn.size(), expected.size());
    for (std::size_t p = 0; p < drawn.size(); ++p)
      ASSERT_EQ(drawn[p], expected[p]) << "word " << p << " of kind " << frame.kind << ", seed " << test_seed();
    EXPECT_EQ(engine->totals().rays, totals.rays);
    EXPECT_EQ(engine->totals().shadow_rays, totals.shadow_rays);
    EXPECT_EQ(engine->totals().unknown, totals.unknown);
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 200u);
  EXPECT_GT(shadowed, 20u);
}

// The engine golden, whose hits are those of doubles: the kernels' picture in every byte but where two triangles are equally far, at an edge that they share, and
// the kernels' rounding chooses the other one.
TEST(GoldenPixels, DrawsTheKernelsPictures) {
  // Codes: 2^-18 of the grid. Rays graze the floor, where the rounding of a ray is as much along it.
  constexpr double kDepths = 64;
  for (const auto& [name, levels] : {std::pair{"knot", TwoLevels::kOff}, std::pair{"room:detail=0.1", TwoLevels::kOff},
                                     std::pair{"field:count=60", TwoLevels::kAuto}}) {
    SCOPED_TRACE(name);
    const TracedScene traced = snap_scene(open_scene(name), levels, kChipReach);
    const MemoryImage image = build_image(traced.grid);
    ASSERT_EQ(image.two_levels(), levels != TwoLevels::kOff);
    const ViewCamera view = default_view(traced.scene, traced.world);
    const ShadeTable table = chip_shading(Surfaces(traced.scene, traced.world, traced.grid));
    const auto golden = make_golden_pixels(traced.grid, image, table);
    const auto csim = make_csim_pixels(image.words(), table);
    for (const bool shadows : {false, true}) {
      SCOPED_TRACE(shadows);
      const ChipOptions options{.width = 64, .height = 48, .shadows = shadows};
      const auto camera = chip_camera(view, traced.grid, options.width, options.height);
      const auto frame = chip_frame(view, options);
      for (const WayUp way_up : {WayUp::kFaceLinks, WayUp::kParentLinks}) {
        const auto expected = golden->draw(camera, frame, {.way_up = way_up}),
                   drawn = csim->draw(camera, frame, {.way_up = way_up});
        EXPECT_EQ(golden->totals().rays, csim->totals().rays);
        EXPECT_EQ(golden->totals().unknown, 0u);
        EXPECT_EQ(golden->totals().shadow_rays > 0, shadows);
        // Depth and id of each pixel.
        auto hits = frame;
        hits.kind = static_cast<std::uint32_t>(contract::kPixelHit);
        const auto exact = golden->draw(camera, hits, {.way_up = way_up}),
                   rounded = csim->draw(camera, hits, {.way_up = way_up});
        ASSERT_EQ(expected.size(), drawn.size());
        ASSERT_EQ(exact.size(), rounded.size());
        std::size_t others = 0;
        for (std::size_t i = 0; i < drawn.size(); ++i) {
          const bool same = exact[2 * i + 1] == rounded[2 * i + 1];
          others += !same;
          EXPECT_LE(std::abs(static_cast<double>(exact[2 * i]) - rounded[2 * i]), kDepths) << "pixel " << i;
          if (same) {
            EXPECT_EQ(expected[i], drawn[i]) << "pixel " << i;
          }
        }
        EXPECT_LE(others, drawn.size() / 256);
      }
    }
  }
}

TEST(CsimPixels, FramesThatCannotBeDrawnAreRefused) {
  const ChipScene scene("knot");
  const ViewCamera view = default_view(scene.scene, scene.world);
  const auto camera = chip_camera(view, scene.grid, 8, 8);
  const auto good = chip_frame(view, {.width = 8, .height = 8});
  const auto engine = make_csim_pixels(scene.image.words(), {});
  std::vector<contract::FrameRecord> bad(7, good);
  bad[0].width = 0;
  bad[1].height = 0;
  bad[2].width = 4097;
  bad[3].width = 4096, bad[3].height = 2049;
  bad[4].samples = 3;
  bad[5].kind = 4;
  bad[6].kind = contract::kPixelDepth, bad[6].samples = 1;
  for (const auto& frame : bad) {
    EXPECT_THROW(engine->draw(camera, frame, {}), Error);
    EXPECT_FALSE(raster_by_kernel(scene.image.words(), camera, frame));
    EXPECT_FALSE(shade_by_kernel(frame, {}, {}));
    EXPECT_FALSE(shadows_by_kernel(scene.image.words(), frame, {}, {}));
  }
  // Without materials all that is hit looks like the background, and is counted.
  engine->draw(camera, good, {});
  EXPECT_GT(engine->totals().unknown, 0u);
}

}  // namespace
}  // namespace retrace
