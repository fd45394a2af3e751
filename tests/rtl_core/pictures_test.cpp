// Pictures made by the core from a camera, of scenes of one level and with instances: whole frames equal to the kernels' in every byte (which equal the golden model, tests/csim/pixels_test.cpp), in two
// buffers by turns; rays in memory before and after; whatever the registers hold, a run ends and the next one is good. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>

#include "golden/engine/stages/shade.hpp"
#include "golden/render/chip_frame.hpp"
#include "golden/tree/traced_scene.hpp"
#include "rtl/shell/rt_regs.h"
#include "testbench/csim/csim_pixels.hpp"
#include "testbench/kit/test_pixels.hpp"
#include "testbench/sim/core/rtl_pixels.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "tests/rtl_core/frames.hpp"

namespace {

using namespace retrace;
using namespace retrace::rtl_core_test;
using cosim::CoreDriver;
using cosim::CoreMode;
using cosim::SimulatedDevice;

constexpr std::size_t kMost = 64 * 64 * 2;  // words of a frame buffer of these tests

/// A configuration, and scenes that it draws; those of saarcor are instances.
struct Chip {
  const char* configuration;
  std::array<const char*, 2> scenes;
  bool two_levels;
};
constexpr Chip kChips[] = {{"chip", {"knot", "room:detail=0.1"}, false}, {"saarcor", {"field:count=60", "knot"}, true}};

struct ChipScene {
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  MemoryImage image;
  ViewCamera view;
  ShadeTable table;

  ChipScene(const std::string& name, bool two_levels) {
    TracedScene traced = snap_scene(open_scene(name), two_levels ? TwoLevels::kAuto : TwoLevels::kOff, kChipReach);
    scene = std::move(traced.scene);
    world = std::move(traced.world);
    grid = std::move(traced.grid);
    image = build_image(grid);
    view = default_view(scene, world);
    table = chip_shading(Surfaces(scene, world, grid));
  }
};

const ChipScene& chip_scene(const std::string& name, bool two_levels) {
  static std::map<std::pair<std::string, bool>, std::unique_ptr<ChipScene>> cache;
  auto& scene = cache[{name, two_levels}];
  if (!scene) scene = std::make_unique<ChipScene>(name, two_levels);
  return *scene;
}

class RtlPictures : public testing::TestWithParam<Chip> {
 protected:
  void SetUp() override {
    const auto& built = cosim::core_configurations();
    if (std::find(built.begin(), built.end(), GetParam().configuration) == built.end())
      GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out " << GetParam().configuration;
  }

  void make(const std::string& name, const cosim::MemoryOptions& memory) {
    scene_ = &chip_scene(name, GetParam().two_levels);
    device_ =
        std::make_unique<SimulatedDevice>(SimulatedDevice::Options{GetParam().configuration, memory, "", test_seed()});
    driver_ = std::make_unique<CoreDriver>(*device_);
    ASSERT_TRUE(driver_->identity().pixels);
    driver_->load_pictures(scene_->image.words(), scene_->table, 4 * kMost);
    csim_ = make_csim_pixels(scene_->image.words(), scene_->table);
  }
  contract::CameraRecord camera(int width, int height) const {
    return chip_camera(scene_->view, scene_->grid, width, height);
  }

  /// Draws, and compares every byte of the buffer: pixels are the kernels', what is behind them is as before.
  void draw(const contract::CameraRecord& camera, const contract::FrameRecord& frame, const CoreMode& mode = {}) {
    TraceOptions options;
    if (mode.parent_links) options.way_up = WayUp::kParentLinks;
    const std::vector<std::uint32_t> expected = csim_->draw(camera, frame, options);
    const int front = driver_->status().front;
    device_->memory().watch_writes(driver_->frame_address(1 - front), driver_->frame_address(1 - front) + 4 * kMost);
    driver_->start_picture(camera, frame, mode);
    driver_->wait(kPatience);
    device_->check_idle();
    const cosim::CoreStatus status = driver_->status();
    EXPECT_TRUE(status.done);
    EXPECT_EQ(status.front, 1 - front);
    EXPECT_FALSE(status.frame_fault);
    EXPECT_FALSE(status.write_fault);
    EXPECT_EQ(status.image_fault, 0);
    EXPECT_EQ(status.camera_fault, csim_->totals().bad_samples != 0);
    EXPECT_EQ(status.material_fault, csim_->totals().unknown != 0);
    EXPECT_EQ(driver_->counters().rays, csim_->totals().rays);
    EXPECT_EQ(device_->memory().stray_writes(), 0u);
    std::vector<std::uint64_t> words(kMost / 2);
    driver_->picture(words);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < kMost; ++i) {
      const auto word = static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2));
      const std::uint32_t wanted =
          i < expected.size() ? expected[i] : static_cast<std::uint32_t>(CoreDriver::kUnwritten);
      if (word != wanted && differ++ == 0)
        ADD_FAILURE() << "word " << i << " is " << std::hex << word << ", expected " << wanted;
    }
    EXPECT_EQ(differ, 0u) << "seed " << test_seed();
    // Each byte once: nothing is drawn twice.
    const auto times = device_->memory().written_times();
    for (std::size_t i = 0; i < 4 * expected.size(); ++i) ASSERT_EQ(times[i], 1) << i;
  }

  const ChipScene* scene_ = nullptr;
  std::unique_ptr<SimulatedDevice> device_;
  std::unique_ptr<CoreDriver> driver_;
  std::unique_ptr<PixelEngine> csim_;
};

TEST_P(RtlPictures, FramesAreTheKernelsInEveryByte) {
  for (const char* name : GetParam().scenes) {
    SCOPED_TRACE(name);
    make(name, {});
    EXPECT_EQ(scene_->image.two_levels(), GetParam().two_levels && name == GetParam().scenes[0]);
    draw(camera(48, 36), chip_frame(scene_->view, {.width = 48, .height = 36}));
    for (const int kind : {contract::kPixelDepth, contract::kPixelId, contract::kPixelHit}) {
      SCOPED_TRACE(kind);
      draw(camera(30, 21),
           chip_frame(scene_->view, {.width = 30, .height = 21, .kind = static_cast<std::uint32_t>(kind)}));
    }
    draw(camera(24, 16), chip_frame(scene_->view, {.width = 24, .height = 16, .samples = 4}));
    draw(camera(16, 24), chip_frame(scene_->view, {.width = 16, .height = 24, .samples = 2}),
         {.parent_links = true, .mailbox = true});
    draw(camera(40, 30), chip_frame(scene_->view, {.width = 40, .height = 30, .shadows = true}));
    EXPECT_GT(csim_->totals().shadow_rays, 100u);
    draw(camera(20, 14), chip_frame(scene_->view, {.width = 20, .height = 14, .samples = 4, .shadows = true}),
         {.mailbox = true});
    if (HasFailure()) return;
  }
}

TEST_P(RtlPictures, HostileMemoryAndFrames) {
  make(GetParam().scenes[0], hostile_memory(test_seed()));
  Random random(test_seed());
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(i);
    auto frame = random_frame(random, 20);
    auto eye = i % 2 == 0 ? camera(static_cast<int>(frame.width), static_cast<int>(frame.height))
                          : random_camera(random, scene_->grid.box);
    if (i % 4 == 3) eye.e[random.below(3)] = static_cast<std::uint32_t>(random.below(32));
    draw(eye, frame);
    if (HasFailure()) return;
  }
}

// Rays in memory and pictures in turn, on one core.
TEST_P(RtlPictures, RaysInMemoryBetweenPictures) {
  make(GetParam().scenes[0], hostile_memory(test_seed()));
  const auto frame = chip_frame(scene_->view, {.width = 20, .height = 15, .shadows = true});
  std::vector<GridRay> rays;
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 16; ++x)
      rays.push_back(
          quantise(scene_->view.ray(x + 0.5, y + 0.5, 16, 12), scene_->grid.transform, scene_->grid.box, false));
  rays = only_inside(rays);
  ASSERT_GT(rays.size(), 20u);
  const auto expected = csim_hits(scene_->image.words(), rays, {});
  for (int turn = 0; turn < 3; ++turn) {
    driver_->load_pictures(scene_->image.words(), scene_->table, 4 * kMost);
    draw(camera(20, 15), frame);
    const int front = driver_->status().front;
    driver_->load_at(scene_->image.words(), rays.size(), {.hits = 16u * static_cast<unsigned>(turn)});
    driver_->start(packed(rays), {});
    driver_->wait(kPatience);
    std::vector<std::uint64_t> hits(2 * rays.size());
    driver_->hits(hits);
    EXPECT_EQ(hits, expected);
    EXPECT_EQ(driver_->status().front, front);
    if (HasFailure()) return;
  }
}

TEST_P(RtlPictures, FramesThatCannotBeDrawn) {
  make(GetParam().scenes[0], {});
  const auto eye = camera(16, 12);
  const auto good = chip_frame(scene_->view, {.width = 16, .height = 12});
  std::vector<contract::FrameRecord> bad(7, good);
  bad[0].width = 0;
  bad[1].height = 0;
  bad[2].width = 8191;
  bad[3].width = 4096, bad[3].height = 4096;
  bad[4].samples = 3;
  bad[5].kind = 7;
  bad[6].kind = contract::kPixelHit, bad[6].samples = 2;
  for (const contract::FrameRecord& frame : bad) {
    const int front = driver_->status().front;
    const std::uint64_t bursts = device_->memory().write_bursts();
    driver_->start_picture(eye, frame, {});
    driver_->wait(100000);
    const cosim::CoreStatus status = driver_->status();
    EXPECT_TRUE(status.done);
    EXPECT_TRUE(status.frame_fault);
    EXPECT_EQ(status.front, front);
    EXPECT_EQ(device_->memory().write_bursts(), bursts);
    EXPECT_EQ(driver_->counters().rays, 0u);
    draw(eye, good);  // and the fault is gone
    if (HasFailure()) return;
  }
}

// Addresses outside of the memory: sticky faults, an end, and the next picture is good.
TEST_P(RtlPictures, BuffersAndMaterialsOutsideMemory) {
  make(GetParam().scenes[0], {});
  const auto eye = camera(16, 12);
  const auto frame = chip_frame(scene_->view, {.width = 16, .height = 12});
  const auto write = [&](std::uint32_t offset, std::uint32_t value) { device_->write_register(offset, value); };
  constexpr auto kControl = static_cast<std::uint32_t>(offsetof(rt_regs_t, control));
  constexpr std::uint32_t kStart =
      RT_REGS__CONTROL__START_bm | RT_REGS__CONTROL__IRQ_ENABLE_bm | RT_REGS__CONTROL__ON_CHIP_bm;
  draw(eye, frame);
  // Written once by hand: start_picture() would put the good addresses back.
  for (const std::uint32_t register_hi : {static_cast<std::uint32_t>(offsetof(rt_regs_t, pictures.frame_base_0_hi)),
                                          static_cast<std::uint32_t>(offsetof(rt_regs_t, pictures.frame_base_1_hi))}) {
    write(register_hi, 0xff);
  }
  write(kControl, kStart);
  driver_->wait(kPatience);
  EXPECT_TRUE(driver_->status().write_fault);
  EXPECT_TRUE(driver_->status().done);
  draw(eye, frame);
  write(static_cast<std::uint32_t>(offsetof(rt_regs_t, pictures.material_base_hi)), 0xff);
  write(kControl, kStart);
  driver_->wait(kPatience);
  EXPECT_TRUE(driver_->status().material_fault);
  EXPECT_FALSE(driver_->status().write_fault);
  draw(eye, frame);
}

// Registers of a picture while it is drawn: answered, ignored. A soft reset at any moment; the next picture is whole.
TEST_P(RtlPictures, WritesWhileBusyAndSoftResets) {
  make(GetParam().scenes[0], hostile_memory(test_seed()));
  Random random(test_seed());
  const auto eye = camera(16, 12);
  const auto frame = chip_frame(scene_->view, {.width = 16, .height = 12, .samples = 4, .shadows = true});
  const auto expected = csim_->draw(eye, frame, {});
  driver_->start_picture(eye, frame, {});
  for (std::uint32_t offset = offsetof(rt_regs_t, pictures); offset < offsetof(rt_regs_t, counters); offset += 4)
    device_->write_register(offset, static_cast<std::uint32_t>(random.bits()));
  EXPECT_TRUE(driver_->status().busy);
  driver_->wait(kPatience);
  std::vector<std::uint64_t> words(expected.size() / 2);
  driver_->picture(words);
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_EQ(static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2)), expected[i]) << i;
  for (int i = 0; i < 8; ++i) {
    driver_->start_picture(eye, frame, {});
    device_->run(random.below(i < 4 ? 3000 : 12000));
    driver_->soft_reset();
    device_->check_idle();
    draw(eye, frame);
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Chips, RtlPictures, testing::ValuesIn(kChips),
                         [](const auto& info) { return std::string(info.param.configuration); });

}  // namespace
