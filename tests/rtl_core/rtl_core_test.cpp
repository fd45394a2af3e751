// The RTL core against the kernel in C simulation: every hit of every frame in every byte, whatever the memory does; faults of the bus, of the
// image and of the rays end in the status they should; soft reset at any moment. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "rtl/shell/rt_regs.h"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/sim/core/rtl_engine.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "tests/rtl_core/frames.hpp"

namespace {

using namespace retrace;
using namespace retrace::rtl_core_test;
using cosim::CoreDriver;
using cosim::CoreMode;
using cosim::MemoryOptions;
using cosim::SimulatedDevice;

// ------------------------------------------------------------------------------------------------ frames

struct Frame {
  const char* scene;
  const char* configuration;
  WayUp way_up;
  bool mailbox, hostile;
};

class RtlFrame : public testing::TestWithParam<Frame> {};

TEST_P(RtlFrame, EqualsKernelInEveryByte) {
  const Frame& frame = GetParam();
  const auto& built = cosim::core_configurations();
  if (std::find(built.begin(), built.end(), frame.configuration) == built.end())
    GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out " << frame.configuration;
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  const Prepared& p = prepared(frame.scene);
  RtlOptions options;
  options.configuration = frame.configuration;
  options.seed = test_seed();
  options.memory.seed = test_seed();
  if (frame.hostile) options.memory = hostile_memory(test_seed());
  auto rtl = make_rtl_engine(p.image, options);
  TraceOptions trace;
  trace.way_up = frame.way_up;
  trace.mailbox = frame.mailbox ? kCsimMailbox : 0;
  for (const auto* rays : {&p.primary, &p.awkward}) {
    rtl->set_ray_row(rays == &p.primary ? kWidth : 0);
    const auto expected = csim_hits(p.image.words(), *rays, trace);
    std::vector<Hit> hits(rays->size());
    rtl->trace(*rays, hits, {}, trace);
    const auto raw = rtl->raw_hits();
    std::size_t differ = 0;
    for (std::size_t i = 0; i < rays->size(); ++i) {
      if (raw[2 * i] == expected[2 * i] && raw[2 * i + 1] == expected[2 * i + 1]) continue;
      if (++differ <= 3)
        ADD_FAILURE() << "ray " << i << ": " << std::hex << raw[2 * i] << ' ' << raw[2 * i + 1] << ", kernel "
                      << expected[2 * i] << ' ' << expected[2 * i + 1];
    }
    EXPECT_EQ(differ, 0u);
    const auto status = rtl->status();
    EXPECT_TRUE(status.done);
    EXPECT_FALSE(status.write_fault);
    EXPECT_EQ(status.ray_fault,
              std::any_of(hits.begin(), hits.end(), [](const Hit& h) { return h.status > contract::kStatusHit; }));
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, RtlFrame,
                         testing::Values(Frame{"room:detail=0.02", "ecp5", WayUp::kFaceLinks, false, false},
                                         Frame{"room:detail=0.02", "ecp5", WayUp::kParentLinks, true, true},
                                         Frame{"room:detail=0.02", "small", WayUp::kFaceLinks, true, true},
                                         Frame{"room:detail=0.02", "wide", WayUp::kParentLinks, false, true},
                                         Frame{"knot", "small", WayUp::kParentLinks, false, true},
                                         Frame{"knot", "ecp5x128", WayUp::kFaceLinks, false, true},
                                         Frame{"knot", "wide", WayUp::kFaceLinks, true, false},
                                         Frame{"needles", "ecp5", WayUp::kFaceLinks, false, true},
                                         Frame{"slivers", "ecp5", WayUp::kParentLinks, false, true},
                                         Frame{"coincident", "wide", WayUp::kFaceLinks, false, true},
                                         Frame{"coincident", "ecp5", WayUp::kParentLinks, true, true},
                                         Frame{"degenerate", "small", WayUp::kFaceLinks, false, true},
                                         Frame{"one", "ecp5", WayUp::kParentLinks, false, true},
                                         Frame{"none", "ecp5", WayUp::kFaceLinks, false, true}),
                         [](const auto& info) {
                           const Frame& f = info.param;
                           std::string name = std::string(f.scene).substr(0, std::string(f.scene).find(':')) + "_" +
                                              f.configuration +
                                              (f.way_up == WayUp::kParentLinks ? "_parent" : "_face") +
                                              (f.mailbox ? "_mailbox" : "") + (f.hostile ? "_hostile" : "");
                           return name;
                         });

// ------------------------------------------------------------------------------------------------ the device by itself

/// A small core with a scene loaded, driven directly.
class RtlCore : public testing::Test {
 protected:
  explicit RtlCore(const std::string& configuration = "small", const MemoryOptions& memory = {})
      : scene_(prepared("room:detail=0.02")), device_({configuration, memory, "", test_seed()}), driver_(device_) {
    rays_ = only_inside(scene_.primary);
    rays_.resize(std::min<std::size_t>(rays_.size(), 400));
    expected_ = csim_hits(scene_.image.words(), rays_, {});
  }
  std::vector<std::uint64_t> run(std::span<const GridRay> rays, const CoreMode& mode = {}) {
    driver_.start(packed(rays), mode);
    driver_.wait(kPatience);
    return hits(rays.size());
  }
  std::vector<std::uint64_t> hits(std::size_t count) {
    std::vector<std::uint64_t> words(2 * count);
    driver_.hits(words);
    return words;
  }

  /// The line of 64 bytes that the hit of a ray lies in, and how many lines the hits of the first rays lie in.
  std::uint64_t line_of(std::uint64_t ray) const { return (driver_.hit_address() + contract::kHitBytes * ray) / 64; }
  std::uint64_t lines_of(std::uint64_t rays) const { return line_of(rays - 1) - line_of(0) + 1; }
  /// A write that fails loses hits of one line, the first of which is the ray that the core names, and no other.
  void expect_a_line_lost(std::span<const std::uint64_t> result, std::span<const std::uint64_t> expected,
                          std::uint64_t named) const {
    std::vector<std::size_t> lost;
    for (std::size_t i = 0; i < result.size() / 2; ++i) {
      if (result[2 * i] == CoreDriver::kUnwritten)
        lost.push_back(i);
      else
        EXPECT_TRUE(std::equal(&result[2 * i], &result[2 * i] + 2, &expected[2 * i])) << "ray " << i;
    }
    ASSERT_FALSE(lost.empty());
    EXPECT_EQ(lost.front(), named);
    EXPECT_EQ(line_of(lost.back()), line_of(named));
  }

  const Prepared& scene_;
  SimulatedDevice device_;
  CoreDriver driver_;
  std::vector<GridRay> rays_;
  std::vector<std::uint64_t> expected_;
};

TEST_F(RtlCore, SaysWhatItIs) {
  EXPECT_EQ(driver_.identity().lanes, 1);
  EXPECT_EQ(driver_.identity().contexts, 64);
  EXPECT_EQ(driver_.identity().data_bytes, 8);
  EXPECT_EQ(driver_.identity().mail_entries, kCsimMailbox);
  EXPECT_FALSE(driver_.status().busy);
  EXPECT_FALSE(driver_.status().done);
  EXPECT_FALSE(device_.interrupt());
}

TEST_F(RtlCore, AnyNumberOfRaysAtAnyAddress) {
  for (const std::uint64_t offset : {0, 1, 3, 126}) {
    driver_.load(scene_.image.words(), rays_.size(), offset);
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{5}, std::size_t{131}}) {
      const auto result = run(std::span(rays_).first(count));
      EXPECT_TRUE(std::equal(result.begin(), result.end(), expected_.begin())) << count << " rays at offset " << offset;
    }
  }
}

TEST_F(RtlCore, RowsOfAnyLengthVisitEveryRayOnce) {
  driver_.load(scene_.image.words(), rays_.size(), 1);
  for (const std::uint32_t row : {1u, 3u, 8u, 19u, 100u, 399u, 400u, 401u, 0x80000000u, 0xffffffffu}) {
    CoreMode mode;
    mode.ray_row = row;
    EXPECT_EQ(run(rays_, mode), expected_) << "rows of " << row;
    EXPECT_EQ(driver_.counters().rays, rays_.size());
  }
}

TEST_F(RtlCore, CountersAddUp) {
  driver_.load(scene_.image.words(), rays_.size());
  run(rays_);
  const auto c = driver_.counters();
  auto csim = make_csim_engine(scene_.image);
  std::vector<Hit> hits(rays_.size());
  csim->trace(rays_, hits, {}, {});
  EXPECT_EQ(c.rays, rays_.size());
  EXPECT_EQ(c.faults, 0u);
  EXPECT_EQ(c.down, csim->totals().down);
  EXPECT_EQ(c.up, 0u);
  EXPECT_EQ(c.leaf, csim->totals().leaf);
  EXPECT_GE(c.tests, csim->totals().tests);  // an any-hit ray may have tests in flight when it gets its hit
  for (const auto* unit : {&c.lanes, &c.leaf_unit, &c.references, &c.tri_test, &c.bus})
    EXPECT_NEAR(static_cast<double>(unit->busy + unit->starved + unit->blocked), static_cast<double>(c.clocks), 4.0);
  // Hits are combined into lines: a beat more or less, a burst for each line and for some of them two.
  EXPECT_GE(c.write_beats, 2 * rays_.size());
  EXPECT_LE(c.write_beats, 2 * rays_.size() + rays_.size() / 4);
  EXPECT_LE(device_.memory().write_bursts(), rays_.size() / 2);
  EXPECT_EQ(c.read_beats * 8, device_.memory().read_bytes());
  EXPECT_EQ(device_.memory().outside(), 0u);
}

TEST_F(RtlCore, CountersCannotBeWritten) {
  driver_.load(scene_.image.words(), rays_.size());
  run(rays_);
  device_.write_register(offsetof(rt_regs_t, counters.rays), 0);  // the bus answers
  device_.write_register(offsetof(rt_regs_t, counters.context_clocks), 0xffffffff);
  EXPECT_EQ(driver_.counters().rays, rays_.size());
  EXPECT_EQ(run(rays_), expected_);
  EXPECT_EQ(driver_.counters().rays, rays_.size());
}

TEST_F(RtlCore, RaysThatCannotBeTraced) {
  driver_.load(scene_.image.words(), rays_.size());
  auto rays = rays_;
  rays[7].record.direction[0] = rays[7].record.direction[1] = rays[7].record.direction[2] = 0;
  rays[9].record.origin[1] = scene_.grid.box[3] + 1;
  const auto result = run(rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i == 7 || i == 9)
      EXPECT_EQ(status_of(result, i), static_cast<std::uint32_t>(contract::kStatusBadRay));
    else
      EXPECT_TRUE(std::equal(&result[2 * i], &result[2 * i] + 2, &expected_[2 * i])) << "ray " << i;
  }
  const auto status = driver_.status();
  EXPECT_TRUE(status.ray_fault);
  EXPECT_EQ(status.first_fault, static_cast<std::uint32_t>(contract::kStatusBadRay));
  EXPECT_TRUE(status.fault_ray == 7 || status.fault_ray == 9);
}

TEST_F(RtlCore, StepLimit) {
  driver_.load(scene_.image.words(), rays_.size());
  CoreMode mode;
  mode.own_step_limit = true;
  mode.step_limit = 25;
  const auto result = run(rays_, mode);
  // The kernel with the same limit in the header.
  std::vector<std::uint64_t> words(scene_.image.words().begin(), scene_.image.words().end());
  auto header = scene_.image.header();
  header.step_limit = mode.step_limit;
  header.pack(words.data());
  EXPECT_EQ(result, csim_hits(words, rays_, {}));
  EXPECT_EQ(driver_.status().first_fault, static_cast<std::uint32_t>(contract::kStatusStepLimit));
  EXPECT_EQ(run(rays_), expected_);
  EXPECT_FALSE(driver_.status().ray_fault);
}

// A sink that takes nothing holds up every result, so whoever is inside has nothing to read for: a context that looked up again and again for a stage
// that cannot take it would fetch its line anew each time that another one has taken its place.
TEST(RtlCoreSink, NothingIsReadWhileNoHitIsTaken) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  constexpr std::uint64_t kSettle = 20000, kWatched = 20000;
  const auto& built = cosim::core_configurations();
  for (const char* configuration : {"small", "ecp5"}) {
    if (std::find(built.begin(), built.end(), configuration) == built.end()) continue;
    for (const char* scene : {"knot", "needles", "room:detail=0.02"}) {
      SCOPED_TRACE(std::string(configuration) + ", " + scene);
      const Prepared& p = prepared(scene);
      auto rays = only_inside(p.primary);
      const auto more = only_inside(p.awkward);
      rays.insert(rays.end(), more.begin(), more.end());
      MemoryOptions free, closed;
      free.seed = closed.seed = test_seed();
      for (const auto channel : {cosim::AxiChannel::kAw, cosim::AxiChannel::kW})
        closed.hold_off[static_cast<std::size_t>(channel)] = cosim::HoldOff::list({0});
      SimulatedDevice device({configuration, closed, "", test_seed()});
      CoreDriver driver(device);
      driver.load(p.image.words(), rays.size());
      driver.start(packed(rays), {});
      device.run(kSettle);
      const std::uint64_t before = device.memory().read_bursts();
      device.run(kWatched);
      EXPECT_EQ(device.memory().read_bursts(), before) << "of " << before << " in the clocks before";
      EXPECT_TRUE(driver.status().busy);
      device.memory().set_options(free);
      driver.wait(kPatience);
      std::vector<std::uint64_t> hits(2 * rays.size());
      driver.hits(hits);
      EXPECT_EQ(hits, csim_hits(p.image.words(), rays, {}));
    }
  }
}

// ------------------------------------------------------------------------------------------------ faults

constexpr int kHeaderBursts = contract::kHeaderBytes / 64;  // the first of every run, one line each

TEST_F(RtlCore, HeaderThatCannotBeUsed) {
  const auto header = scene_.image.header();
  const auto attempt = [&](const contract::HeaderRecord& bad, std::size_t lines) {
    std::vector<std::uint64_t> words(scene_.image.words().begin(), scene_.image.words().end());
    bad.pack(words.data());
    driver_.load(std::span(words).first(lines * 8), rays_.size());
    const auto result = run(rays_);
    EXPECT_TRUE(std::all_of(result.begin(), result.end(), [](std::uint64_t w) { return w == CoreDriver::kUnwritten; }));
    EXPECT_TRUE(driver_.status().done);
    EXPECT_EQ(device_.memory().outside(), 0u);
    const auto fault = driver_.status().image_fault;
    driver_.load(scene_.image.words(), rays_.size());
    EXPECT_EQ(run(rays_), expected_) << "the frame after";
    return fault;
  };
  auto bad = header;
  bad.magic ^= 1;
  EXPECT_EQ(attempt(bad, header.lines), 1);
  bad = header;
  bad.version += 1;
  EXPECT_EQ(attempt(bad, header.lines), 1);
  for (auto field : {&contract::HeaderRecord::pair_offset, &contract::HeaderRecord::leaf_offset,
                     &contract::HeaderRecord::list_offset, &contract::HeaderRecord::triangle_offset,
                     &contract::HeaderRecord::pair_count, &contract::HeaderRecord::leaf_count,
                     &contract::HeaderRecord::list_count, &contract::HeaderRecord::triangle_count}) {
    bad = header;
    bad.*field = 0xffffffff;
    EXPECT_EQ(attempt(bad, header.lines), 2);
  }
  EXPECT_EQ(attempt(header, header.lines - 1), 2);
  EXPECT_EQ(attempt(header, 1), 2);
  driver_.load(scene_.image.words(), rays_.size());
  EXPECT_EQ(run(rays_), expected_);
  EXPECT_EQ(driver_.status().image_fault, 0);
}

TEST_F(RtlCore, CorruptImagesEndLikeTheKernel) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  auto header = scene_.image.header();
  header.step_limit = 300;  // corrupt trees have long walks
  std::size_t faults = 0;
  const std::span<const GridRay> rays = std::span(rays_).first(150);
  for (int round = 0; round < 24; ++round) {
    std::vector<std::uint64_t> words(scene_.image.words().begin(), scene_.image.words().end());
    header.pack(words.data());
    // Whole sections and single words, random bits and bit flips; the lower parts of the tree are as likely to be met as the upper ones.
    const std::uint64_t sections[] = {header.pair_offset, header.leaf_offset, header.list_offset,
                                      header.triangle_offset, header.lines};
    const int section = round % 4;
    const std::uint64_t begin = 8 * sections[section], end = 8 * sections[section + 1];
    if (end <= begin) continue;
    const int spots = round < 8 ? 20000 : 2000;
    for (int i = 0; i < spots; ++i) {
      std::uint64_t& word = words[begin + random.below(end - begin)];
      word = random.chance(2) ? random.bits() : word ^ (1ull << random.below(64));
    }
    TraceOptions options;
    CoreMode mode;
    mode.parent_links = round % 3 == 1;
    mode.mailbox = round % 5 == 1;
    options.way_up = mode.parent_links ? WayUp::kParentLinks : WayUp::kFaceLinks;
    options.mailbox = mode.mailbox ? kCsimMailbox : 0;
    driver_.load(words, rays_.size());
    const auto result = run(rays, mode);
    EXPECT_EQ(result, csim_hits(words, rays, options)) << "round " << round;
    EXPECT_EQ(device_.memory().outside(), 0u);
    const auto status = driver_.status();
    std::size_t marked = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) marked += status_of(result, i) > contract::kStatusHit;
    EXPECT_EQ(status.ray_fault, marked > 0) << "round " << round;
    if (status.ray_fault) EXPECT_EQ(status_of(result, status.fault_ray), status.first_fault) << "round " << round;
    faults += driver_.counters().faults;
    driver_.load(scene_.image.words(), rays_.size());
    EXPECT_EQ(run(rays_), expected_) << "after round " << round;
  }
  EXPECT_GT(faults, 100u);
}

TEST_F(RtlCore, ReadErrorsEndOnlyTheRaysThatMeetThem) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  driver_.load(scene_.image.words(), rays_.size());
  const std::span<const GridRay> rays = std::span(rays_).first(100);
  Random random(test_seed());
  std::size_t hurt_frames = 0;
  for (int n = 0; n < 60; ++n) {
    cosim::ErrorInjection errors;
    errors.read_burst = n < 30 ? n : static_cast<std::int64_t>(random.below(400));
    errors.read_beat = n % 3 == 0 ? -1 : static_cast<int>(random.below(6));
    errors.decode_error = n % 2 == 0;
    device_.memory().arm(errors);
    const auto result = run(rays);
    const auto status = driver_.status();
    if (n < kHeaderBursts) {
      EXPECT_EQ(status.image_fault, 3);
      continue;
    }
    std::size_t hurt = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (status_of(result, i) == static_cast<std::uint32_t>(contract::kStatusBusError))
        ++hurt;
      else
        EXPECT_TRUE(std::equal(&result[2 * i], &result[2 * i] + 2, &expected_[2 * i]))
            << "burst " << errors.read_burst << " ray " << i;
    }
    EXPECT_EQ(status.ray_fault, hurt > 0);
    if (hurt > 0) {
      ++hurt_frames;
      EXPECT_EQ(status.first_fault, static_cast<std::uint32_t>(contract::kStatusBusError));
      EXPECT_EQ(status_of(result, status.fault_ray), static_cast<std::uint32_t>(contract::kStatusBusError));
    }
  }
  EXPECT_GT(hurt_frames, 30u);
  device_.memory().arm({});
  EXPECT_EQ(run(rays_), expected_);
}

// A frame of few rays, so that an error can be put into every beat of every read burst, and every write, one at a time. The memory answers in a
// fixed order here: position n is the same burst in each frame. After each of them a frame without errors has to be right.
TEST_F(RtlCore, EveryPositionOfAnError) {
  constexpr std::size_t kRays = 8;
  constexpr int kBeats = 8;  // a longer burst does not exist
  driver_.load(scene_.image.words(), rays_.size());
  std::vector<GridRay> rays;
  for (std::size_t i = 0; i < kRays; ++i) rays.push_back(rays_[i * rays_.size() / kRays]);
  const auto expected = csim_hits(scene_.image.words(), rays, {});
  // A start empties the caches, so every frame without errors asks for the same bursts.
  const auto bursts = [&] {
    const std::uint64_t before = device_.memory().read_bursts();
    EXPECT_EQ(run(rays), expected);
    return static_cast<std::int64_t>(device_.memory().read_bursts() - before);
  };
  const std::int64_t reads = bursts();
  ASSERT_EQ(bursts(), reads);
  std::size_t positions = 0, hurt_rays = 0, image_faults = 0;
  for (std::int64_t burst = 0; burst < reads; ++burst) {
    for (int beat = 0; beat < kBeats; ++beat) {
      SCOPED_TRACE("read burst " + std::to_string(burst) + " beat " + std::to_string(beat));
      cosim::ErrorInjection errors;
      errors.read_burst = burst;
      errors.read_beat = beat;
      errors.decode_error = (burst + beat) % 2 == 0;
      device_.memory().arm(errors);
      const std::uint64_t hurt_before = device_.memory().hurt_beats();
      const auto result = run(rays);
      const auto status = driver_.status();
      ASSERT_TRUE(status.done);
      if (device_.memory().hurt_beats() == hurt_before) {  // beyond the burst's end
        ASSERT_EQ(result, expected);
        break;
      }
      if (status.image_fault != 0) {
        EXPECT_EQ(status.image_fault, 3);
        EXPECT_TRUE(
            std::all_of(result.begin(), result.end(), [](std::uint64_t w) { return w == CoreDriver::kUnwritten; }));
        ++image_faults;
      } else {
        std::size_t hurt = 0;
        for (std::size_t i = 0; i < kRays; ++i) {
          if (status_of(result, i) == static_cast<std::uint32_t>(contract::kStatusBusError))
            ++hurt;
          else
            EXPECT_TRUE(std::equal(&result[2 * i], &result[2 * i] + 2, &expected[2 * i])) << "ray " << i;
        }
        EXPECT_EQ(status.ray_fault, hurt > 0);
        if (hurt > 0) {
          EXPECT_EQ(status.first_fault, static_cast<std::uint32_t>(contract::kStatusBusError));
          EXPECT_EQ(status_of(result, status.fault_ray), static_cast<std::uint32_t>(contract::kStatusBusError));
        }
        positions += hurt > 0;
        hurt_rays += hurt;
      }
      device_.memory().arm({});
      ASSERT_EQ(run(rays), expected) << "the frame after";
      ASSERT_FALSE(driver_.status().ray_fault || driver_.status().image_fault != 0);
    }
  }
  const std::size_t writes = lines_of(kRays);
  for (std::size_t write = 0; write < writes; ++write) {
    SCOPED_TRACE("write " + std::to_string(write));
    cosim::ErrorInjection errors;
    errors.write_burst = static_cast<std::int64_t>(write);
    errors.decode_error = write % 2 == 0;
    device_.memory().arm(errors);
    const auto result = run(rays);
    const auto status = driver_.status();
    EXPECT_TRUE(status.done && status.write_fault);
    expect_a_line_lost(result, expected, status.write_fault_ray);
    device_.memory().arm({});
    ASSERT_EQ(run(rays), expected) << "the frame after";
    ASSERT_FALSE(driver_.status().write_fault);
  }
  std::printf("%lld read bursts: %zu beats that hurt %zu rays, %zu that hurt the header; %zu writes\n",
              static_cast<long long>(reads), positions, hurt_rays, image_faults, writes);
  EXPECT_GT(positions, static_cast<std::size_t>(reads));  // bursts of more than one beat
  EXPECT_EQ(image_faults, static_cast<std::size_t>(kHeaderBursts) * kBeats);
}

TEST_F(RtlCore, WriteErrorsNameTheRay) {
  driver_.load(scene_.image.words(), rays_.size());
  cosim::ErrorInjection errors;
  errors.write_burst = 17;
  device_.memory().arm(errors);
  const auto result = run(rays_);
  const auto status = driver_.status();
  ASSERT_TRUE(status.write_fault);
  expect_a_line_lost(result, expected_, status.write_fault_ray);
  device_.memory().arm({});
  EXPECT_EQ(run(rays_), expected_);
  EXPECT_FALSE(driver_.status().write_fault);
}

class RtlCoreHostile : public RtlCore {
 protected:
  RtlCoreHostile() : RtlCore("ecp5", hostile_memory(test_seed())) {}
};

TEST_F(RtlCoreHostile, SoftResetAtAnyMoment) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  driver_.load(scene_.image.words(), rays_.size());
  for (int n = 0; n < 25; ++n) {
    driver_.start(packed(rays_), {});
    device_.run(n < 10 ? 20 * n : random.below(12000));
    driver_.soft_reset();
    EXPECT_TRUE(device_.memory().idle());
    const auto status = driver_.status();
    EXPECT_FALSE(status.busy || status.done || status.ray_fault);
    if (n % 5 == 4) EXPECT_EQ(run(rays_), expected_) << "after reset " << n;
  }
}

// Errors in any burst while the memory answers late, in any order and with stalls: positions cannot be counted, but nothing may hang.
TEST_F(RtlCoreHostile, ErrorsAnywhere) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  driver_.load(scene_.image.words(), rays_.size());
  std::size_t hurt_frames = 0;
  for (int n = 0; n < 40; ++n) {
    cosim::ErrorInjection errors;
    errors.read_burst = static_cast<std::int64_t>(random.below(n % 4 == 0 ? 8 : 1200));
    errors.read_beat = n % 2 == 0 ? -1 : static_cast<int>(random.below(6));
    errors.write_burst = n % 3 == 0 ? static_cast<std::int64_t>(random.below(rays_.size() / 4)) : -1;
    errors.decode_error = random.chance(2);
    device_.memory().arm(errors);
    const auto result = run(rays_);
    const auto status = driver_.status();
    ASSERT_TRUE(status.done);
    if (status.image_fault != 0) {
      EXPECT_EQ(status.image_fault, 3);
    } else {
      std::size_t hurt = 0;
      for (std::size_t i = 0; i < rays_.size(); ++i) {
        if (status.write_fault && line_of(i) == line_of(status.write_fault_ray)) continue;
        if (status_of(result, i) == static_cast<std::uint32_t>(contract::kStatusBusError))
          ++hurt;
        else
          EXPECT_TRUE(std::equal(&result[2 * i], &result[2 * i] + 2, &expected_[2 * i]))
              << "frame " << n << " ray " << i;
      }
      EXPECT_EQ(status.write_fault, errors.write_burst >= 0);
      if (hurt > 0) EXPECT_TRUE(status.ray_fault);
      hurt_frames += hurt > 0;
    }
    if (n % 4 == 3) {
      device_.memory().arm({});
      EXPECT_EQ(run(rays_), expected_) << "after frame " << n;
    }
  }
  EXPECT_GT(hurt_frames, 15u);
}

}  // namespace
