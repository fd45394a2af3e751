// Initialisation of a DRAM and read levelling against a model of the controller's registers, with byte lanes that answer late, early, in other
// windows, or never. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "tests/board/dram_registers.hpp"

namespace {

using namespace retrace;
using namespace retrace::cosim;

TEST(DramInit, EveryWindowIsFound) {
  const DramFacts& ddr3 = facts("ddr3");
  int tried = 0;
  for (std::uint32_t bitslip = 0; bitslip < ddr3.bitslips; ++bitslip)
    for (std::uint32_t first = 0; first < ddr3.delays; ++first)
      for (std::uint32_t last = first + kLeastWindow - 1; last < ddr3.delays; ++last) {
        // The other lane has another window.
        const std::vector<Lane> lanes{{bitslip, first, last}, {(bitslip + 1) % ddr3.bitslips, 2, 5}};
        DramRegisters model(ddr3, lanes, test_seed());
        const auto windows = initialise_dram(ddr3, model);
        ASSERT_EQ(model.fault, "");
        ASSERT_EQ(windows.size(), 2u);
        for (std::size_t lane = 0; lane < 2; ++lane) {
          ASSERT_EQ(windows[lane].first, lanes[lane].first);
          ASSERT_EQ(windows[lane].last, lanes[lane].last);
          ASSERT_EQ(model.slip(lane), lanes[lane].bitslip);
          ASSERT_EQ(model.delay(lane), (lanes[lane].first + lanes[lane].last) / 2);
        }
        EXPECT_EQ(model.of(ddr3.init_done), 1u);
        EXPECT_EQ(model.of(ddr3.init_error), 0u);
        EXPECT_EQ(model.of(ddr3.control), 1u);
        ++tried;
      }
  EXPECT_EQ(tried, 4 * 28);
}

TEST(DramInit, RaggedEdgesAreKeptAwayFrom) {
  const DramFacts& ddr3 = facts("ddr3");
  for (std::uint64_t i = 0; i < 100; ++i) {
    const std::vector<Lane> lanes{{1, 1, 6, 50}, {2, 0, 7, 80}};
    DramRegisters model(ddr3, lanes, test_seed() + i);
    initialise_dram(ddr3, model);
    for (std::size_t lane = 0; lane < 2; ++lane) {
      ASSERT_GT(model.delay(lane), lanes[lane].first) << "RETRACE_SEED " << test_seed();
      ASSERT_LT(model.delay(lane), lanes[lane].last);
    }
  }
}

TEST(DramInit, NoWindowIsAnErrorThatNamesTheLane) {
  const DramFacts& ddr3 = facts("ddr3");
  const auto refuses = [&](std::vector<Lane> lanes, const std::string& part) {
    DramRegisters model(ddr3, std::move(lanes), test_seed());
    try {
      initialise_dram(ddr3, model);
      FAIL() << part;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
    EXPECT_EQ(model.of(ddr3.init_error), 1u);
    EXPECT_EQ(model.of(ddr3.init_done), 0u);
  };
  refuses({{0, 9, 9}, {0, 1, 6}}, "finds no window for byte lane 0");
  refuses({{0, 1, 6}, {0, 3, 3}}, "finds no window for byte lane 1");  // one delay is no window
  refuses({{0, 1, 6}, {9, 1, 6}}, "finds no window for byte lane 1");
  refuses({{0, 1, 6}, {1, 1, 6, 0, false}}, "finds no window for byte lane 1");  // the PHY sees no strobes
  refuses({{0, 1, 6, 0, true, 20}, {0, 1, 6}}, "byte lane 0 does not hold at bitslip 0, delay 3");
}

TEST(DramInit, SequenceIsInOrderAndSdrNeedsNoLevelling) {
  DramRegisters ddr3(facts("ddr3"), {{0, 1, 6}, {0, 1, 6}}, test_seed());
  initialise_dram(facts("ddr3"), ddr3);
  EXPECT_EQ(ddr3.modes, (std::vector<std::uint32_t>{0x20200, 0x30000, 0x10006, 0x00320}));
  EXPECT_GE(ddr3.waited, 60000u);
  DramRegisters sdr(facts("sdr"), {}, test_seed());
  EXPECT_TRUE(initialise_dram(facts("sdr"), sdr).empty());
  EXPECT_EQ(sdr.fault, "");
  EXPECT_EQ(sdr.rows, 0u);
  EXPECT_EQ(sdr.of(facts("sdr").init_done), 1u);
}

}  // namespace
