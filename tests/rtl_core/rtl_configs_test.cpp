// Every shipped configuration of rtl/targets/core.toml as a core: a small frame in bits and in clocks, and once more with a hostile memory.
// Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <set>

#include "testbench/driver/core_driver.hpp"
#include "testbench/sim/core/core_description.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "tests/rtl_core/frames.hpp"

namespace {

using namespace retrace;
using namespace retrace::rtl_core_test;
using cosim::CoreDriver;
using cosim::CoreMode;
using cosim::SimulatedDevice;

/// `clocks` of the frame at a latency of 40 clocks: the simulation repeats itself in every clock, so more of them are a loss of speed.
struct Shipped {
  const char* name;
  std::uint64_t clocks;
};
void PrintTo(const Shipped& shipped, std::ostream* out) { *out << shipped.name; }
constexpr Shipped kShipped[] = {
    {"small", 14739},   {"ecp5", 11704},    {"fast", 11302}, {"ecp5l1", 18908},  {"ecp5l2", 13336}, {"ecp5l6", 10524},
    {"ecp5g64", 13267}, {"ecp5x128", 8187}, {"wide", 8275},  {"saarcor", 13411}, {"chip", 11791},
};
constexpr std::size_t kRays = 300;
constexpr std::uint64_t kSlack =
    5;  // percent; the start and the last rays weigh more in so small a frame than in a whole one

bool is_built(const std::string& name) {
  const auto& built = cosim::core_configurations();
  const auto& quick = cosim::quick_core_configurations();
  return std::find(built.begin(), built.end(), name) != built.end() ||
         std::find(quick.begin(), quick.end(), name) != quick.end();
}

class RtlConfiguration : public testing::TestWithParam<Shipped> {};

TEST_P(RtlConfiguration, EqualsKernelInEveryByteAndIsNotSlower) {
  const Shipped& shipped = GetParam();
  if (!is_built(shipped.name)) GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out " << shipped.name;
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  const Prepared& scene = prepared("room:detail=0.02");
  std::vector<GridRay> rays = only_inside(scene.primary);
  ASSERT_GE(rays.size(), kRays);
  rays.resize(kRays);
  const auto expected = csim_hits(scene.image.words(), rays, {});
  const auto run = [&](const cosim::MemoryOptions& memory) {
    SimulatedDevice device({shipped.name, memory, "", test_seed()});
    CoreDriver driver(device);
    driver.load(scene.image.words(), rays.size());
    CoreMode mode;
    mode.ray_row = kWidth;
    driver.start(packed(rays), mode);
    driver.wait(kPatience);
    std::vector<std::uint64_t> hits(2 * rays.size());
    driver.hits(hits);
    EXPECT_EQ(hits, expected);
    EXPECT_FALSE(driver.status().ray_fault || driver.status().write_fault);
    return driver.counters().clocks;
  };
  const std::uint64_t clocks = run({});
  std::printf("%s: %llu clocks\n", shipped.name, static_cast<unsigned long long>(clocks));
  EXPECT_LE(clocks * 100, shipped.clocks * (100 + kSlack)) << "clocks of the frame; it took " << shipped.clocks;
  run(hostile_memory(test_seed()));
}

INSTANTIATE_TEST_SUITE_P(Shipped, RtlConfiguration, testing::ValuesIn(kShipped),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(RtlConfigurations, NoneIsLeftOut) {
  const std::set<std::string> stated(cosim::kShippedConfigurations.begin(), cosim::kShippedConfigurations.end());
  std::set<std::string> tested;
  for (const Shipped& shipped : kShipped) tested.insert(shipped.name);
  EXPECT_EQ(stated, tested);
}

}  // namespace
