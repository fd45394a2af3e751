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
#include "golden/render/chip_frame.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_pixels.hpp"
#include "testbench/kit/brute_force.hpp"
#include "testbench/kit/test_pixels.hpp"

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
                 std::span<contract::HitRecord> hits) {
  const BruteForce all(image);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const BruteForce::Result result = all.trace(rays[i]);
    hits[i].status = static_cast<std::uint32_t>(result.hit ? contract::kStatusHit : contract::kStatusMiss);
    hits[i].t = result.t;
    hits[i].id = result.id;
  }
}

void expect_picture(const ChipScene& scene, const ViewCamera& view, const ChipOptions& options) {
  const Surfaces surfaces(scene.scene, scene.world, scene.grid);
  const auto camera = chip_camera(view, scene.grid, options.width, options.height);
  const auto frame = chip_frame(view, options);
  const auto materials = chip_materials(surfaces);
  PixelTotals totals;
  const auto expected = draw_golden(
      camera, frame, scene.grid.box, materials,
      [&](std::span<const contract::RayRecord> rays, std::span<contract::HitRecord> hits) {
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
    EXPECT_EQ(engine->totals().bad_samples, 0u);
    EXPECT_EQ(engine->totals().unknown, 0u);
  }
  EXPECT_GT(totals.rays, totals.samples / 8);
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
    // An image of a header alone: no more of it is read.
    contract::HeaderRecord header;
    header.magic = static_cast<std::uint32_t>(contract::kImageMagic);
    header.version = static_cast<std::uint32_t>(contract::kImageVersion);
    for (std::size_t f = 0; f < 6; ++f) header.box[f] = static_cast<std::uint32_t>(box[f]);
    alignas(16) std::array<std::uint64_t, contract::HeaderRecord::kWords> words{};
    header.pack(words.data());
    const auto kernel = raster_by_kernel(words, camera, frame);
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
  for (int i = 0; i < 50000; ++i) {
    const auto material = random_material(random);
    auto frame = random_frame(random, 8);
    const golden::Colour expected = golden::shade(material, frame);
    const contract::ShadeInRecord hit{.hit = 1};
    frame.width = frame.height = 1;
    frame.kind = frame.samples = 0;
    const auto pixel = shade_by_kernel(frame, std::span(&hit, 1), std::span(&material, 1));
    ASSERT_TRUE(pixel);
    ASSERT_EQ(pixel->at(0), golden::pack_colour(expected, 0)) << "seed " << test_seed();
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
  }
  // Without materials all that is hit looks like the background, and is counted.
  engine->draw(camera, good, {});
  EXPECT_GT(engine->totals().unknown, 0u);
}

}  // namespace
}  // namespace retrace
