// The RTL core of two levels (configuration saarcor) against the kernel in C simulation: scenes of instances, hits, statuses and work in every bit,
// whatever the memory does and however the image is damaged. Seed: RETRACE_SEED; rays of a frame, if not as many as each scene says: RETRACE_RAYS.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include "golden/tree/two_level_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/two_level_walk.hpp"
#include "testbench/kit/two_level_world.hpp"
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

constexpr const char* kConfiguration = "saarcor";

bool is_built(const char* configuration) {
  const auto& built = cosim::core_configurations();
  return std::find(built.begin(), built.end(), configuration) != built.end();
}

std::vector<GridRay> rays_at(const TwoLevelWorld& world, int count, bool any, Random& random) {
  std::vector<GridRay> rays;
  for (int i = 0; i < count; ++i) {
    const auto instance = static_cast<std::uint32_t>(random.below(world.placed.size()));
    GridRay ray;
    ray.record =
        make_world_ray(random_world_origin(world, random), random_world_target(world, instance, random), random);
    if (random.chance(8))
      ray.record.t_max = static_cast<std::uint32_t>(random.below(std::uint64_t{3} << contract::kTLimitFrac));
    if (random.chance(50)) ray.record.origin[0] = (1 << 24) + 1;  // outside of the root box
    if (any && random.chance(2)) ray.record.any = 1;
    rays.push_back(ray);
  }
  return rays;
}

struct Traced {
  std::vector<std::uint64_t> hits;
  WorkTotals work;
};

Traced kernel(std::span<const std::uint64_t> image, std::span<const GridRay> rays, const CoreMode& mode) {
  TraceOptions options;
  options.way_up = mode.parent_links ? WayUp::kParentLinks : WayUp::kFaceLinks;
  options.mailbox = mode.mailbox ? kCsimMailbox : 0;
  auto csim = make_csim_engine(image);
  std::vector<Hit> hits(rays.size());
  csim->trace(rays, hits, {}, options);
  const auto raw = csim->raw_hits();
  return {{raw.begin(), raw.end()}, csim->totals()};
}

constexpr CoreMode kModes[] = {{.parent_links = false, .mailbox = false},
                               {.parent_links = true, .mailbox = false},
                               {.parent_links = false, .mailbox = true},
                               {.parent_links = true, .mailbox = true}};

std::string name_of(const CoreMode& mode) {
  return std::string(mode.parent_links ? "parent links" : "face links") + (mode.mailbox ? ", mailbox" : "");
}

/// A core of two levels, driven directly.
class Core {
 public:
  explicit Core(const MemoryOptions& memory = {}, const char* configuration = kConfiguration)
      : device_({configuration, memory, "", test_seed()}), driver_(device_) {}
  Traced run(std::span<const std::uint64_t> image, std::span<const GridRay> rays, const CoreMode& mode) {
    driver_.load(image, rays.size());
    driver_.start(packed(rays), mode);
    driver_.wait(kPatience);
    Traced result{std::vector<std::uint64_t>(2 * rays.size()), driver_.counters()};
    driver_.hits(result.hits);
    return result;
  }
  SimulatedDevice& device() { return device_; }
  CoreDriver& driver() { return driver_; }

 private:
  SimulatedDevice device_;
  CoreDriver driver_;
};

void expect_equal_hits(const Traced& core, const Traced& expected) {
  int differ = 0;
  for (std::size_t i = 0; i < expected.hits.size() / 2; ++i) {
    if (std::equal(&core.hits[2 * i], &core.hits[2 * i] + 2, &expected.hits[2 * i])) continue;
    if (++differ > 3) continue;
    const auto a = contract::HitRecord::unpack(&core.hits[2 * i]),
               b = contract::HitRecord::unpack(&expected.hits[2 * i]);
    ADD_FAILURE() << "ray " << i << ": status " << a.status << " t " << a.t << " id " << a.id << ", kernel: status "
                  << b.status << " t " << b.t << " id " << b.id;
  }
  EXPECT_EQ(differ, 0) << "of " << expected.hits.size() / 2 << " rays";
}

struct Scene {
  std::size_t instances;
  int cells, rays;
};

class RtlTwoLevels : public testing::TestWithParam<Scene> {
 protected:
  void SetUp() override {
    if (!is_built(kConfiguration)) GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out " << kConfiguration;
  }
};

TEST_P(RtlTwoLevels, EqualTheKernelInEveryBitAndInTheirWork) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  const auto [instances, cells, least] = GetParam();
  const char* wanted = std::getenv("RETRACE_RAYS");
  const int count = wanted ? std::atoi(wanted) : least;
  const TwoLevelWorld world = make_two_level_world(random, instances, cells);
  const auto image = assemble_two_levels(world.scene);
  for (const bool any : {false, true}) {
    const auto rays = rays_at(world, count, any, random);
    for (const bool hostile : {false, true}) {
      Core core(hostile ? hostile_memory(test_seed()) : MemoryOptions{});
      for (const CoreMode& mode : kModes) {
        SCOPED_TRACE(name_of(mode) + (any ? ", any hit" : "") + (hostile ? ", hostile memory" : ""));
        const Traced expected = kernel(image, rays, mode), result = core.run(image, rays, mode);
        expect_equal_hits(result, expected);
        EXPECT_EQ(result.work.down, expected.work.down);
        EXPECT_EQ(result.work.up, expected.work.up);
        EXPECT_EQ(result.work.leaf, expected.work.leaf);
        if (any) {  // tests that are in flight when an any-hit ray gets its hit
          EXPECT_GE(result.work.tests, expected.work.tests);
        } else {
          EXPECT_EQ(result.work.tests, expected.work.tests);
          EXPECT_EQ(result.work.skipped, expected.work.skipped);
        }
        EXPECT_EQ(core.device().memory().outside(), 0u);
        const auto c = core.driver().counters();
        if (!any && mode.mailbox && !mode.parent_links) {
          TwoLevelWork walked;
          for (const GridRay& ray : rays) trace_two_levels(world.scene, ray.record, &walked);
          EXPECT_EQ(c.entries, walked.entries);
          EXPECT_EQ(c.entry_passed, walked.rejected);
        }
        if (!hostile && !any) {
          std::printf(
              "%zu instances, %s: %.2f clocks a ray, %.1f down, %.1f leaves, %.2f tests, %.0f bytes, %.2f entries, "
              "%.2f clocks of them refused, %.2f at their end\n",
              instances, name_of(mode).c_str(), double(c.clocks) / count, double(c.down) / count,
              double(c.leaf) / count, double(c.tests) / count, 8.0 * double(c.read_beats) / count,
              double(c.entries) / count, double(c.entry_refused) / count, double(c.entry_blocked) / count);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, RtlTwoLevels,
                         testing::Values(Scene{1, 4, 300}, Scene{12, 6, 400}, Scene{100, 4, 400}, Scene{300, 2, 400}),
                         [](const auto& info) { return std::to_string(info.param.instances); });

class RtlTwoLevel : public testing::Test {
 protected:
  void SetUp() override {
    if (!is_built(kConfiguration)) GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out " << kConfiguration;
  }
};

TEST_F(RtlTwoLevel, StepLimitEndsRaysWhereTheKernelEndsThem) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed() + 1);
  const TwoLevelWorld world = make_two_level_world(random, 40, 3);
  auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 60, true, random);
  auto header = contract::HeaderRecord::unpack(image.data());
  Core core;
  std::size_t limited = 0;
  for (std::uint32_t limit = 0; limit < 120; limit += 1 + limit / 16) {
    header.step_limit = limit;
    header.pack(image.data());
    const CoreMode& mode = kModes[limit % std::size(kModes)];
    SCOPED_TRACE("limit " + std::to_string(limit) + ", " + name_of(mode));
    const Traced expected = kernel(image, rays, mode);
    expect_equal_hits(core.run(image, rays, mode), expected);
    for (std::size_t i = 0; i < rays.size(); ++i)
      limited += status_of(expected.hits, i) == static_cast<std::uint32_t>(contract::kStatusStepLimit);
  }
  EXPECT_GT(limited, 200u);
}

TEST_F(RtlTwoLevel, CorruptImagesEndLikeTheKernel) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed() + 2);
  const TwoLevelWorld world = make_two_level_world(random, 24, 2);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 60, true, random);
  auto header = contract::HeaderRecord::unpack(image.data());
  header.step_limit = 2000;  // corrupt trees have long walks
  const std::uint64_t sections[] = {header.pair_offset,     header.leaf_offset,     header.list_offset,
                                    header.triangle_offset, header.instance_offset, header.lines};
  constexpr int kSections = 5;
  std::array<int, 16> statuses{};
  Core core;
  for (int round = 0; round < 100; ++round) {
    auto broken = image;
    header.pack(broken.data());
    const int section = round % kSections;
    const std::uint64_t begin = 8 * sections[section], end = 8 * sections[section + 1];
    if (end <= begin) continue;
    const std::uint64_t spots = 1 + (end - begin) / (round % 3 == 0 ? 2 : 16);
    for (std::uint64_t i = 0; i < spots; ++i) {
      std::uint64_t& word = broken[begin + random.below(end - begin)];
      word = random.chance(4) ? random.bits() : word ^ (1ull << random.below(64));
    }
    const CoreMode& mode = kModes[random.below(std::size(kModes))];
    SCOPED_TRACE("round " + std::to_string(round) + ", " + name_of(mode));
    const Traced expected = kernel(broken, rays, mode);
    expect_equal_hits(core.run(broken, rays, mode), expected);
    EXPECT_EQ(core.device().memory().outside(), 0u);
    for (std::size_t i = 0; i < rays.size(); ++i) ++statuses[status_of(expected.hits, i)];
  }
  for (const auto status : {contract::kStatusMiss, contract::kStatusHit, contract::kStatusBadIndex,
                            contract::kStatusBadRecord, contract::kStatusInvariant})
    EXPECT_GT(statuses[static_cast<std::size_t>(status)], 20) << status;
}

// Every kind of a leaf of every tree exchanged: triangles of the top tree, instances in an object, kinds that do not exist.
TEST_F(RtlTwoLevel, LeavesOfOtherKindsEndLikeTheKernel) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed() + 3);
  const TwoLevelWorld world = make_two_level_world(random, 12, 2);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 60, true, random);
  const auto header = contract::HeaderRecord::unpack(image.data());
  std::array<int, 16> statuses{};
  Core core;
  for (int round = 0; round < 24; ++round) {
    auto broken = image;
    for (std::uint32_t i = 0; i < header.leaf_count; ++i) {
      std::uint64_t* words = &broken[8 * (std::uint64_t{header.leaf_offset} + i)];
      auto leaf = contract::LeafRecord::unpack(words);
      if (random.chance(4)) leaf.kind = static_cast<std::uint32_t>(random.below(round % 4 == 0 ? 4 : 2));
      leaf.pack(words);
    }
    const CoreMode& mode = kModes[round % std::size(kModes)];
    SCOPED_TRACE("round " + std::to_string(round) + ", " + name_of(mode));
    const Traced expected = kernel(broken, rays, mode);
    expect_equal_hits(core.run(broken, rays, mode), expected);
    for (std::size_t i = 0; i < rays.size(); ++i) ++statuses[status_of(expected.hits, i)];
  }
  EXPECT_GT(statuses[static_cast<std::size_t>(contract::kStatusBadRecord)], 20);
  EXPECT_GT(statuses[static_cast<std::size_t>(contract::kStatusHit)], 20);
}

// An image of one level has no instances, so a leaf of them is a record that cannot be, to a core of two levels as well.
TEST(RtlLevels, LeavesOfOtherKindsInAnImageOfOneLevelEndLikeTheKernel) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed() + 9);
  const TwoLevelWorld world = make_two_level_world(random, 4, 3);
  const auto words = world.scene.objects[0].words();
  const auto header = world.scene.objects[0].header();
  const auto face = [&](int i) { return static_cast<std::int32_t>(header.box[static_cast<std::size_t>(i)]); };
  std::vector<GridRay> rays;
  for (int i = 0; i < 100; ++i) {
    GridRay ray;
    GridPoint origin;
    for (int axis = 0; axis < 3; ++axis)
      origin[axis] = static_cast<std::int32_t>(random.integer(face(2 * axis), face(2 * axis + 1)));
    ray.record = make_world_ray(
        origin, glm::dvec3(random.real(-0.5, 0.5), random.real(-0.5, 0.5), random.real(-0.5, 0.5)), random);
    rays.push_back(ray);
  }
  for (const char* configuration : {kConfiguration, "small"}) {
    if (!is_built(configuration)) continue;
    SCOPED_TRACE(configuration);
    Core core({}, configuration);
    std::array<int, 16> statuses{};
    for (int round = 0; round < 8; ++round) {
      std::vector<std::uint64_t> broken(words.begin(), words.end());
      for (std::uint32_t i = 0; round > 0 && i < header.leaf_count; ++i) {
        std::uint64_t* at = &broken[8 * (std::uint64_t{header.leaf_offset} + i)];
        auto leaf = contract::LeafRecord::unpack(at);
        if (random.chance(4)) leaf.kind = static_cast<std::uint32_t>(random.below(4));
        leaf.pack(at);
      }
      SCOPED_TRACE("round " + std::to_string(round));
      const CoreMode& mode = kModes[round % std::size(kModes)];
      const Traced expected = kernel(broken, rays, mode);
      expect_equal_hits(core.run(broken, rays, mode), expected);
      for (std::size_t i = 0; i < rays.size(); ++i) ++statuses[status_of(expected.hits, i)];
    }
    for (const auto status : {contract::kStatusHit, contract::kStatusBadRecord})
      EXPECT_GT(statuses[static_cast<std::size_t>(status)], 10) << status;
  }
}

// The same wall in two objects; that of the higher number has a spike towards the rays, so it is entered first, and at the same t the lower number wins.
// Objects of so few triangles are one leaf, which is the root: rays beside the wall leave it there.
TEST_F(RtlTwoLevel, ObjectsOfOneLeafAndTheLowerNumberAtTheSameT) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  constexpr std::int32_t kHalf = 1 << 23, kUp = 12 << 20, kPad = contract::kBoxPad;
  const GridPoint a(-kHalf, -kHalf, 0), b(kHalf, -kHalf, 0), c(kHalf, kHalf, 0), d(-kHalf, kHalf, 0);
  GridScene wall, spiked;
  wall.triangles = {{{a, b, c}, 0}, {{a, c, d}, 1}};
  wall.box = {-kHalf - kPad, kHalf + kPad, -kHalf - kPad, kHalf + kPad, -kPad, kPad};
  spiked = wall;
  spiked.triangles.push_back({{GridPoint(kHalf, 0, 0), GridPoint(kHalf, 1 << 18, kUp), GridPoint(kHalf, 0, kUp)}, 2});
  spiked.box[5] = kUp + kPad;
  const std::vector<GridScene> objects{wall, spiked};
  const Placement placement{glm::dmat3(0.5), glm::dvec3(0.0)};
  std::vector<PlacedObject> placed{{0, placement}, {1, placement}};
  placed.resize(32, {0, placement});
  const auto image = assemble_two_levels(build_two_levels(objects, placed));
  Random random(test_seed() + 10);
  std::vector<GridRay> rays(64);
  for (GridRay& ray : rays) {
    const bool beside = &ray - rays.data() >= 32;  // through the pad of the root box, past the wall
    ray.record.origin = {static_cast<std::int32_t>(random.integer(-kHalf / 2, kHalf / 2)),
                         static_cast<std::int32_t>(random.integer(-kHalf / 2, kHalf / 2)), 5 << 20};
    if (beside) ray.record.origin[0] = kHalf / 2 + static_cast<std::int32_t>(random.integer(100, 400));
    ray.record.direction = {0, 0, -(1 << 26)};
    ray.record.t_max = (1u << contract::kTLimitBits) - 1;
  }
  Core core;
  for (const CoreMode& mode : kModes) {
    SCOPED_TRACE(name_of(mode));
    const Traced expected = kernel(image, rays, mode), result = core.run(image, rays, mode);
    expect_equal_hits(result, expected);
    EXPECT_EQ(result.work.down, expected.work.down);
    EXPECT_EQ(result.work.up, expected.work.up);
    EXPECT_EQ(result.work.leaf, expected.work.leaf);
    EXPECT_EQ(result.work.skipped, expected.work.skipped);
  }
}

TEST_F(RtlTwoLevel, HeadersOfTwoLevelsAreChecked) {
  Random random(test_seed() + 4);
  const TwoLevelWorld world = make_two_level_world(random, 4, 2);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 20, false, random);
  const auto header = contract::HeaderRecord::unpack(image.data());
  Core core;
  const auto attempt = [&](const contract::HeaderRecord& bad) {
    auto words = image;
    bad.pack(words.data());
    const Traced result = core.run(words, rays, {});
    EXPECT_TRUE(std::all_of(result.hits.begin(), result.hits.end(),
                            [](std::uint64_t word) { return word == CoreDriver::kUnwritten; }));
    EXPECT_EQ(core.device().memory().outside(), 0u);
    return core.driver().status().image_fault;
  };
  auto bad = header;
  bad.version += 1;
  EXPECT_EQ(attempt(bad), 1);
  for (const auto field : {&contract::HeaderRecord::instance_offset, &contract::HeaderRecord::instance_count,
                           &contract::HeaderRecord::triangle_offset, &contract::HeaderRecord::leaf_count}) {
    bad = header;
    bad.*field = 0xffffffff;
    EXPECT_EQ(attempt(bad), 2);
    bad.*field = header.*field + header.lines;
    EXPECT_EQ(attempt(bad), 2);
  }
  expect_equal_hits(core.run(image, rays, {}), kernel(image, rays, {}));
  EXPECT_EQ(core.driver().status().image_fault, 0);
}

TEST_F(RtlTwoLevel, ReadErrorsEndOnlyTheRaysThatMeetThem) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed() + 5);
  const TwoLevelWorld world = make_two_level_world(random, 24, 2);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 60, false, random);
  const Traced expected = kernel(image, rays, {});
  const auto header = contract::HeaderRecord::unpack(image.data());
  Core core;
  std::size_t hurt = 0;
  for (int n = 0; n < 30; ++n) {
    cosim::ErrorInjection errors;
    core.driver().load(image, rays.size());
    if (n % 2 == 0) {  // one instance record
      const std::uint64_t record = header.instance_offset + random.below(header.instance_count);
      errors.bad_begin = core.driver().image_address() + 64 * record;
      errors.bad_end = errors.bad_begin + 64;
    } else {
      errors.read_burst = 4 + static_cast<std::int64_t>(random.below(400));
    }
    core.device().memory().arm(errors);
    core.driver().start(packed(rays), {});
    core.driver().wait(kPatience);
    std::vector<std::uint64_t> hits(2 * rays.size());
    core.driver().hits(hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (status_of(hits, i) == static_cast<std::uint32_t>(contract::kStatusBusError))
        ++hurt;
      else
        EXPECT_TRUE(std::equal(&hits[2 * i], &hits[2 * i] + 2, &expected.hits[2 * i])) << "ray " << i << " run " << n;
    }
  }
  EXPECT_GT(hurt, 20u);
  core.device().memory().arm({});
  expect_equal_hits(core.run(image, rays, {}), expected);
}

// Entries wait for launches and results behind a sink that takes nothing; then everything has to come.
TEST_F(RtlTwoLevel, ASinkThatTakesNothingHoldsUpEntriesAndNothingIsLost) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  constexpr std::uint64_t kSettle = 20000, kWatched = 20000;
  Random random(test_seed() + 6);
  const TwoLevelWorld world = make_two_level_world(random, 100, 3);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 400, true, random);
  MemoryOptions open, closed;
  open.seed = closed.seed = test_seed();
  for (const auto channel : {cosim::AxiChannel::kAw, cosim::AxiChannel::kW})
    closed.hold_off[static_cast<std::size_t>(channel)] = cosim::HoldOff::list({0});
  Core core(closed);
  core.driver().load(image, rays.size());
  core.driver().start(packed(rays), {});
  core.device().run(kSettle);
  const std::uint64_t before = core.device().memory().read_bursts();
  core.device().run(kWatched);
  EXPECT_EQ(core.device().memory().read_bursts(), before);
  EXPECT_TRUE(core.driver().status().busy);
  core.device().memory().set_options(open);
  core.driver().wait(kPatience);
  Traced result{std::vector<std::uint64_t>(2 * rays.size()), core.driver().counters()};
  core.driver().hits(result.hits);
  expect_equal_hits(result, kernel(image, rays, {}));
}

TEST(RtlOneLevel, RefusesAnImageOfTwoLevels) {
  if (!is_built("small")) GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out small";
  Random random(test_seed() + 7);
  const TwoLevelWorld world = make_two_level_world(random, 4, 2);
  const auto image = assemble_two_levels(world.scene);
  RtlOptions options;
  options.configuration = "small";
  try {
    make_rtl_engine(image, options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              "rtl engine: the image has instances and the configuration 'small' one level; saarcor has two");
  }
  SimulatedDevice device({"small", {}, "", test_seed()});
  CoreDriver driver(device);
  EXPECT_EQ(driver.identity().levels, 1);
  driver.load(image, 1);
  driver.start(std::vector<std::uint64_t>(4), {});
  driver.wait(kPatience);
  EXPECT_EQ(driver.status().image_fault, 1);
}

TEST_F(RtlTwoLevel, TheEngineTracesAnImageOfTwoLevels) {
  Random random(test_seed() + 8);
  const TwoLevelWorld world = make_two_level_world(random, 12, 3);
  const auto image = assemble_two_levels(world.scene);
  const auto rays = rays_at(world, 100, false, random);
  RtlOptions options;
  options.configuration = kConfiguration;
  auto rtl = make_rtl_engine(image, options);
  EXPECT_EQ(rtl->identity().levels, 2);
  std::vector<Hit> hits(rays.size());
  rtl->trace(rays, hits, {}, {});
  const auto expected = kernel(image, rays, {}).hits;
  const auto raw = rtl->raw_hits();
  EXPECT_TRUE(std::equal(raw.begin(), raw.end(), expected.begin(), expected.end()));
}

}  // namespace
