#include "hls/stages/kd_backtrack.hpp"

#include "golden/engine/stages/kd_backtrack.hpp"
#include "stage_test.hpp"

namespace retrace {
namespace {

contract::KdBacktrackOutRecord step(const contract::KdBacktrackInRecord& in) {
  return RETRACE_RUN_STAGE(KdBacktrackIn, kd_backtrack_in, KdBacktrackOut, kd_backtrack_out, kd_backtrack, in);
}

TEST(KdBacktrack, turns_where_golden_turns) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int matches = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto in = kd_backtrack_vector(random);
    const auto out = step(in);
    ASSERT_EQ(out.matched != 0, golden::kd_backtrack(static_cast<int>(in.face), in.plane, in.node,
                                                     static_cast<int>(in.parent_axis), in.parent_split))
        << "seed " << seed << " vector " << i;
    matches += out.matched;
  }
  EXPECT_GT(matches, 500);
}

TEST(KdBacktrack, each_condition_counts) {
  contract::KdBacktrackInRecord in;
  in.face = 3;  // leaving through the upper side of y
  in.plane = 77;
  in.node = 10;  // a left child
  in.parent = 4;
  in.parent_axis = 1;
  in.parent_split = 77;
  in.parent_child = 5;
  EXPECT_TRUE(step(in).matched);
  EXPECT_EQ(step(in).node, 11u);
  auto other = in;
  other.parent_split = 78;
  EXPECT_FALSE(step(other).matched);
  EXPECT_EQ(step(other).node, 4u);
  other = in;
  other.parent_axis = 0;
  EXPECT_FALSE(step(other).matched);
  other = in;
  other.node = 11;
  EXPECT_FALSE(step(other).matched);
  other.face = 2;  // leaving through the lower side: the right child is the near one
  EXPECT_TRUE(step(other).matched);
  EXPECT_EQ(step(other).node, 10u);
  other = in;
  other.parent = 0;
  EXPECT_FALSE(step(other).finished);
  other.parent_axis = 2;
  EXPECT_TRUE(step(other).finished);
  other.parent_axis = contract::kAxisLeaf;
  EXPECT_TRUE(step(other).bad);
}

}  // namespace
}  // namespace retrace
