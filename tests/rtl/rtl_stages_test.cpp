// Every RTL stage against its HLS function, bit for bit, under three patterns of stalls; latency and interval as the
// package says. RETRACE_VECTORS sets the vectors a stage (10^6).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/sim/clocked.hpp"
#include "testbench/stages/scene_vectors.hpp"
#include "testbench/stages/stage_bench.hpp"
#include "Vtb_lib.h"

namespace retrace::cosim {
namespace {

std::uint64_t vectors_per_stage() {
  const char* text = std::getenv("RETRACE_VECTORS");
  return text ? std::strtoull(text, nullptr, 0) : 1'000'000;
}

class RtlStages : public testing::TestWithParam<std::string> {
 protected:
  RtlStages() : package_(1) { package_.settle(); }

  std::uint64_t stated_latency() { return static_cast<std::uint64_t>(package_->stage_latency_o[index()]); }
  std::uint64_t stated_interval() { return static_cast<std::uint64_t>(package_->stage_interval_o[index()]); }

  StageResult run(StallMode mode) {
    const StageRun run{GetParam(), mode, test_seed() + static_cast<std::uint64_t>(mode), vectors_per_stage() / 3 + 1};
    const StageResult result = run_stage(run);
    EXPECT_EQ(result.failure, "");
    EXPECT_EQ(result.vectors, run.vectors) << command_of(run);
    return result;
  }

 private:
  static std::size_t index() {
    return static_cast<std::size_t>(std::find(stage_names().begin(), stage_names().end(), GetParam()) -
                                    stage_names().begin());
  }

  Clocked<Vtb_lib> package_;  // shows rt_stage_pkg
};

TEST_P(RtlStages, EqualHlsWithoutStallsAtTheStatedLatencyAndInterval) {
  const auto result = run(StallMode::kNone);
  EXPECT_EQ(result.latency, stated_latency());
  EXPECT_EQ(result.interval, static_cast<double>(stated_interval()));
}

TEST_P(RtlStages, EqualHlsUnderRandomStalls) { run(StallMode::kRandom); }

TEST_P(RtlStages, EqualHlsUnderFullBackPressure) {
  const auto result = run(StallMode::kBackPressure);
  EXPECT_TRUE(result.refused) << "the stage never filled up";
  if (stated_interval() == 1) {
    EXPECT_EQ(result.bubbles, 0u) << "a stall cost more than its own clocks";
  }
}

// Rays that look for trouble, through scenes that make it.
TEST_P(RtlStages, EqualHlsOnWalksThroughAdversarialScenes) {
  static const SceneVectors walks = [] {
    SceneVectors vectors;
    Random random(test_seed());
    for (const char* name :
         {"needles", "slivers", "coincident", "degenerate", "one", "none", "sphere:cells=12", "box"}) {
      const GridScene scene = snap(flatten(open_scene(name)));
      const MemoryImage image = build_kd(scene);
      record_walks(image, make_test_rays(scene, image, 400, random), vectors);
    }
    return vectors;
  }();
  const std::uint64_t count = vectors_of(walks, GetParam());
  ASSERT_GT(count, 1000u);
  for (const auto mode : {StallMode::kNone, StallMode::kRandom, StallMode::kBackPressure}) {
    const StageResult result = run_stage({GetParam(), mode, test_seed(), count, &walks});
    EXPECT_EQ(result.failure, "");
    EXPECT_EQ(result.vectors, count);
  }
}

INSTANTIATE_TEST_SUITE_P(All, RtlStages, testing::ValuesIn(stage_names()), [](const auto& info) { return info.param; });

}  // namespace
}  // namespace retrace::cosim
