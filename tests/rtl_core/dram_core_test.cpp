// The core on the DRAM of a board: LiteDRAM's controller and model behind rt_dram_port, image, rays and hits through the same port. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include "golden/base/error.hpp"
#include "testbench/driver/core_driver.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "testbench/sim/dram/dram_model.hpp"
#include "tests/rtl_core/frames.hpp"

namespace {

using namespace retrace;
using namespace retrace::rtl_core_test;
using cosim::CoreDriver;
using cosim::CoreMode;
using cosim::SimulatedDevice;

SimulatedDevice::Options on(const std::string& dram) {
  SimulatedDevice::Options options;
  options.configuration = "small";
  options.memory.dram = dram;
  options.seed = test_seed();
  return options;
}

class CoreOnDram : public testing::TestWithParam<std::string> {};

TEST_P(CoreOnDram, EqualsKernelInEveryByte) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  constexpr std::size_t kRays = 300;
  const Prepared& scene = prepared("room:detail=0.02");
  std::vector<GridRay> rays = only_inside(scene.primary);
  rays.resize(kRays);
  const std::vector<GridRay> awkward = only_inside(scene.awkward);
  rays.insert(rays.end(), awkward.begin(), awkward.end());
  SimulatedDevice device(on(GetParam()));
  CoreDriver driver(device);
  driver.load(scene.image.words(), rays.size());
  for (const bool parent_links : {false, true}) {
    TraceOptions options;
    options.way_up = parent_links ? WayUp::kParentLinks : WayUp::kFaceLinks;
    CoreMode mode;
    mode.parent_links = parent_links;
    driver.start(packed(rays), mode);
    driver.wait(kPatience);
    std::vector<std::uint64_t> hits(2 * rays.size());
    driver.hits(hits);
    EXPECT_EQ(hits, csim_hits(scene.image.words(), rays, options));
    EXPECT_FALSE(driver.status().ray_fault || driver.status().write_fault);
    device.check_idle();
  }
}

/// What a host writes it reads again, whatever the alignment and the length; the words around it stay.
TEST_P(CoreOnDram, MemoryHoldsWhatIsWritten) {
  Random random(test_seed());
  SimulatedDevice device(on(GetParam()));
  const std::uint64_t base = device.bus_memory().base();
  constexpr std::size_t kWords = 3000;
  std::vector<std::uint64_t> expected(kWords), read(kWords);
  for (auto& word : expected) word = random.bits();
  device.write_memory(base, expected);
  for (int i = 0; i < 40; ++i) {
    const std::size_t first = random.below(kWords), count = random.below(kWords - first + 1);
    for (std::size_t k = first; k < first + count; ++k) expected[k] = random.bits();
    device.write_memory(base + 8 * first, std::span(expected).subspan(first, count));
  }
  device.read_memory(base, read);
  EXPECT_EQ(read, expected) << "seed " << test_seed();
}

TEST_P(CoreOnDram, ImageLargerThanTheMemory) {
  SimulatedDevice device(on(GetParam()));
  try {
    device.allocate(std::uint64_t{1} << 30);
    FAIL() << "a gigabyte fits";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("need 1073741824 bytes, the memory has 33554432"), std::string::npos)
        << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Memories, CoreOnDram, testing::ValuesIn(cosim::dram_names()),
                         [](const auto& info) { return info.param; });

TEST(CoreOnDramOfAnotherWidth, IsRefused) {
  for (const std::string& name : cosim::core_configurations()) {
    if (name != "wide" && name != "ecp5x128") continue;
    SimulatedDevice::Options options = on("ddr3");
    options.configuration = name;
    EXPECT_THROW(SimulatedDevice{options}, Error) << name;
  }
}

}  // namespace
