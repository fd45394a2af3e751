// Rasters, colour and files: what is written is what was meant, whole or not at all.
#include "golden/render/raster.hpp"

#include <gtest/gtest.h>
#include <OpenImageIO/imageio.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

#include "golden/render/tonemap.hpp"
#include "golden/scene/scene.hpp"
#include "tests/base/temporary_folder.hpp"

namespace retrace {
namespace {

namespace fs = std::filesystem;

using Files = TemporaryFolder;

Raster read(const fs::path& path) {
  auto in = OIIO::ImageInput::open(path.string());
  EXPECT_TRUE(in) << path;
  if (!in) return {};
  const OIIO::ImageSpec& spec = in->spec();
  Raster raster(spec.width, spec.height, spec.nchannels);
  EXPECT_TRUE(in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, raster.data.data()));
  return raster;
}

Raster gradient(int width, int height) {
  Raster raster(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) raster.set_rgb(x, y, {x / 255.0f, y / 255.0f, (x + y) / 510.0f});
  }
  return raster;
}

using RasterFiles = Files;

TEST_F(RasterFiles, PngHoldsEightBitColours) {
  const Raster raster = gradient(200, 100);
  save_raster(folder_ / "a.png", raster);
  const Raster back = read(folder_ / "a.png");
  ASSERT_EQ(back.width, 200);
  ASSERT_EQ(back.height, 100);
  ASSERT_EQ(back.channels, 3);
  for (std::size_t i = 0; i < raster.data.size(); ++i) ASSERT_NEAR(back.data[i], raster.data[i], 0.5 / 255 + 1e-6) << i;
  EXPECT_EQ(entries(), 1u);
}

TEST_F(RasterFiles, ExrHoldsFloatsExactly) {
  Raster raster(31, 17, 1);
  for (std::size_t i = 0; i < raster.data.size(); ++i)
    raster.data[i] = std::ldexp(static_cast<float>(i) - 200.0f, static_cast<int>(i % 60) - 30);
  raster.data[5] = std::numeric_limits<float>::infinity();
  OutputFile file(folder_ / "depth.exr");
  write_raster(file, raster, {"Z"});
  file.commit();
  const Raster back = read(folder_ / "depth.exr");
  ASSERT_EQ(back.data, raster.data);
  EXPECT_EQ(OIIO::ImageInput::open((folder_ / "depth.exr").string())->spec().channelnames[0], "Z");
}

TEST_F(RasterFiles, HdrHoldsLinearRadianceWithoutCoverage) {
  Raster raster(16, 9, 4);
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x) {
      raster.set_rgb(x, y, {0.25f * static_cast<float>(x), 8.0f, 100.0f});
      raster.at(x, y)[3] = 0.5f;
    }
  for (const char* name : {"a.hdr", "a.rgbe", "a.HDR", "a.exr"}) {
    EXPECT_TRUE(is_linear_format(name)) << name;
    check_raster(folder_ / name, 16, 9, 4);
    save_raster(folder_ / name, raster);
    const Raster back = read(folder_ / name);
    ASSERT_EQ(back.channels, std::string(name) == "a.exr" ? 4 : 3) << name;
    for (int y = 0; y < raster.height; ++y)
      for (int x = 0; x < raster.width; ++x)
        ASSERT_LT(glm::length(back.rgb(x, y) - raster.rgb(x, y)), 1.0f) << name << " " << x << " " << y;
  }
  EXPECT_EQ(entries(), 4u);
}

TEST_F(RasterFiles, EveryFormatComesBackAsItWas) {
  const Raster raster = gradient(120, 90);
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.bmp", "a.gif", "a.tga", "a.ppm", "a.webp", "a.jp2", "a.sgi",
                           "a.rla", "a.dpx", "a.ico", "a.fits", "a.heic", "a.iff"}) {
    check_raster(folder_ / name, 120, 90, 3);
    save_raster(folder_ / name, raster);
    const Raster back = read(folder_ / name);
    ASSERT_EQ(back.width, 120) << name;
    ASSERT_EQ(back.height, 90) << name;
    ASSERT_GE(back.channels, 3) << name;
    EXPECT_LT(glm::length(back.rgb(30, 20) - raster.rgb(30, 20)), 0.15f) << name;
  }
}

TEST_F(RasterFiles, AFileThatNobodyCanReadIsAnError) {
  // OpenJPEG refuses pictures of few pixels; the writer then leaves 77 bytes and reports success.
  EXPECT_THROW(save_raster(folder_ / "a.jp2", gradient(40, 30)), Error);
  EXPECT_EQ(entries(), 0u);
}

TEST_F(RasterFiles, ALimitOnTheSizeOfFilesIsAnErrorInEveryFormat) {
  Raster raster(200, 150, 3);
  std::uint32_t state = 1;
  for (float& value : raster.data) value = static_cast<float>((state = state * 1664525 + 1013904223) >> 24) / 255.0f;
  rlimit old;
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const rlimit little{4096, old.rlim_max};
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.gif", "a.jp2", "a.sgi", "a.rla", "a.ico", "a.heic", "a.exr"}) {
    write_file(folder_ / name, "old");
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
    std::string why;
    try {
      save_raster(folder_ / name, raster);
    } catch (const Error& error) {
      why = error.what();
    }
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
    EXPECT_EQ(why.find("cannot write " + (folder_ / name).string() + ": "), 0u) << name << ": " << why;
    EXPECT_EQ(text_of(folder_ / name), "old") << name;
  }
  ::signal(SIGXFSZ, handler);
  EXPECT_EQ(entries(), 10u);
}

TEST_F(RasterFiles, WhatAFormatCannotTakeIsKnownBefore) {
  EXPECT_THROW(check_raster("a.ico", 2000, 2000, 3), Error);
  EXPECT_THROW(check_raster("a.zfile", 10, 10, 3), Error);
  EXPECT_NO_THROW(check_raster("a.png", 16384, 16384, 3));
  EXPECT_NO_THROW(check_raster("a.exr", 16384, 16384, 4));
}

TEST_F(RasterFiles, IdsAreExact) {
  std::vector<std::uint32_t> ids = {0, 1, (1u << 24) - 1, 1u << 24, (1u << 24) + 1, 0xfffffffeu, 0xffffffffu, 7};
  OutputFile file(folder_ / "ids.exr");
  write_ids(file, 4, 2, ids, "id");
  file.commit();
  const auto in = OIIO::ImageInput::open((folder_ / "ids.exr").string());
  ASSERT_TRUE(in);
  EXPECT_EQ(in->spec().format, OIIO::TypeDesc::UINT32);
  EXPECT_EQ(in->spec().channelnames[0], "id");
  std::vector<std::uint32_t> back(8);
  ASSERT_TRUE(in->read_image(0, 0, 0, 1, OIIO::TypeDesc::UINT32, back.data()));
  EXPECT_EQ(back, ids);
}

TEST_F(RasterFiles, AStreamWithoutAnExtensionGetsPng) {
  EXPECT_FALSE(is_linear_format("/dev/stdout"));
  const fs::path path = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::string bytes;
  std::thread reader([&] { bytes = text_of(path); });
  save_raster(path, gradient(20, 10));
  reader.join();
  EXPECT_EQ(bytes, encode_raster("a.png", gradient(20, 10)));
}

TEST_F(RasterFiles, UnknownFormatIsOneError) {
  EXPECT_THROW(save_raster(folder_ / "a.null", gradient(2, 2)), Error);  // OpenImageIO's writers to nowhere
  EXPECT_THROW(save_raster(folder_ / "a.term", gradient(2, 2)), Error);
  EXPECT_THROW(save_raster(folder_ / "a.nonsense", gradient(2, 2)), Error);
  EXPECT_THROW(save_raster(folder_ / "a", gradient(2, 2)), Error);
  EXPECT_EQ(entries(), 0u);
  EXPECT_TRUE(is_linear_format("x.EXR"));
  EXPECT_FALSE(is_linear_format("x.png"));
}

// Table entries of the published maps: matplotlib's viridis and inferno at 0, 1/2 (entry 128) and 1.
TEST(ColorMaps, FollowThePublishedTables) {
  const auto near = [](const glm::vec3& a, const glm::vec3& b) { return glm::length(a - b) < 0.005f; };
  EXPECT_TRUE(near(map_color(ColorMap::kViridis, 0.0f), {0.267004f, 0.004874f, 0.329415f}));
  EXPECT_TRUE(near(map_color(ColorMap::kViridis, 128 / 255.0f), {0.127568f, 0.566949f, 0.550556f}));
  EXPECT_TRUE(near(map_color(ColorMap::kViridis, 1.0f), {0.993248f, 0.906157f, 0.143936f}));
  EXPECT_TRUE(near(map_color(ColorMap::kInferno, 0.0f), {0.001462f, 0.000466f, 0.013866f}));
  EXPECT_TRUE(near(map_color(ColorMap::kInferno, 1.0f), {0.988362f, 0.998364f, 0.644924f}));
}

TEST(ColorMaps, LightnessRises) {
  for (const ColorMap map : {ColorMap::kViridis, ColorMap::kInferno}) {
    float before = -1;
    for (int i = 0; i <= 64; ++i) {
      const float now = luminance(srgb_decode(map_color(map, static_cast<float>(i) / 64)));
      EXPECT_GT(now, before - 1e-4f) << i;
      before = now;
    }
  }
  EXPECT_EQ(map_color(ColorMap::kViridis, -3.0f), map_color(ColorMap::kViridis, 0.0f));
  EXPECT_EQ(map_color(ColorMap::kViridis, 9.0f), map_color(ColorMap::kViridis, 1.0f));
  EXPECT_EQ(map_color(ColorMap::kInferno, NAN), map_color(ColorMap::kInferno, 0.0f));
}

TEST(ToneMap, RisesAndStaysInRange) {
  float before = -1;
  for (float x = 0; x < 100; x = x * 1.2f + 1e-3f) {
    const glm::vec3 y = tone_map(glm::vec3(x));
    EXPECT_GE(y.g, before);
    EXPECT_LE(y.g, 1.0f);
    before = y.g;
  }
  EXPECT_GT(before, 0.99f);
  EXPECT_LT(tone_map(glm::vec3(0.0f)).g, 1e-3f);
  for (const float x : {std::numeric_limits<float>::infinity(), 1e30f, -5.0f}) {
    const glm::vec3 y = tone_map(glm::vec3(x));
    EXPECT_TRUE(y.r >= 0 && y.r <= 1);
  }
}

TEST(ToneMap, TransferFunctionIsThatOfSrgb) {
  EXPECT_NEAR(srgb_encode(0.21404114f), 0.5f, 1e-5);
  EXPECT_NEAR(srgb_encode(0.0031308f), 0.04045f, 1e-5);
  EXPECT_FLOAT_EQ(srgb_encode(7.0f), 1.0f);
  EXPECT_EQ(srgb_encode(NAN), 0.0f);
  for (int i = 0; i <= 100; ++i) EXPECT_NEAR(srgb_decode(srgb_encode(i / 100.0f)), i / 100.0f, 1e-5);
}

TEST(HeatMap, MapsValuesAndHasALegend) {
  Raster values(320, 40, 1, 2.0f);
  *values.at(0, 0) = 0.0f;
  for (int y = 0; y < 40; ++y) *values.at(319, y) = *values.at(318, y) = 8.0f;  // more than the outliers that are cut
  *values.at(5, 5) = NAN;
  const Raster map = heat_map(values, ColorMap::kInferno, "steps per ray");
  ASSERT_EQ(map.width, 320);
  ASSERT_GT(map.height, 40);
  EXPECT_EQ(map.rgb(0, 0), map_color(ColorMap::kInferno, 0.0f));
  EXPECT_EQ(map.rgb(319, 39), map_color(ColorMap::kInferno, 1.0f));
  EXPECT_EQ(map.rgb(100, 20), map_color(ColorMap::kInferno, 0.25f));
  EXPECT_EQ(map.rgb(5, 5), glm::vec3(0.16f));
  // The bar runs through the whole map, left to right; below it there is text.
  EXPECT_LT(luminance(map.rgb(8, 48)), 0.05f);
  EXPECT_GT(luminance(map.rgb(311, 48)), 0.6f);
  int ink = 0;
  for (int y = 52; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) ink += map.rgb(x, y) == glm::vec3(0.92f);
  }
  EXPECT_GT(ink, 100);
}

TEST(HeatMap, AFewOutliersDoNotDarkenTheRest) {
  Raster values(100, 50, 1);
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 100; ++x) *values.at(x, y) = static_cast<float>(x);
  }
  const Raster without = heat_map(values, ColorMap::kInferno, "x");
  *values.at(99, 0) = 10000.0f;
  const Raster with = heat_map(values, ColorMap::kInferno, "x");
  // The range ends at 98 or 99 either way, so colours stay; the outlier has the brightest one.
  for (int x = 0; x < 99; ++x) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(with.rgb(x, 20)[c], without.rgb(x, 20)[c], 0.04f) << x;
  }
  EXPECT_EQ(with.rgb(99, 0), with.rgb(99, 20));
}

TEST(HeatMap, SurvivesTinyAndEmptyRanges) {
  for (const int size : {1, 2, 7}) {
    const Raster map = heat_map(Raster(size, size, 1, NAN), ColorMap::kViridis, "a title that cannot fit");
    EXPECT_EQ(map.width, size);
  }
  const Raster flat = heat_map(Raster(64, 8, 1, 5.0f), ColorMap::kViridis, "x");
  EXPECT_EQ(flat.rgb(3, 3), map_color(ColorMap::kViridis, 0.0f));
  const Raster ranged = heat_map(Raster(64, 8, 1, 5.0f), ColorMap::kViridis, "x", 0.0, 10.0);
  EXPECT_EQ(ranged.rgb(3, 3), map_color(ColorMap::kViridis, 0.5f));
}

TEST(Text, IsClippedAtTheBorders) {
  Raster raster(20, 10, 3);
  draw_text(raster, -3, -3, "0123456789 abc", glm::vec3(1.0f), 2);
  draw_text(raster, 18, 8, "%", glm::vec3(1.0f), 3);
  draw_text(raster, 0, 0, "\x01\xff~", glm::vec3(1.0f));  // no glyph, nothing drawn
  EXPECT_EQ(text_width("abc"), 17);
}

}  // namespace
}  // namespace retrace
