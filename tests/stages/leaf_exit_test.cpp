#include "hls/stages/leaf_exit.hpp"

#include <cmath>

#include "golden/engine/stages/leaf_exit.hpp"
#include "stage_test.hpp"
#include "testbench/kit/reference.hpp"

namespace retrace {
namespace {

contract::LeafExitOutRecord exit_of(const contract::LeafExitInRecord& in) {
  return RETRACE_RUN_STAGE(LeafExitIn, leaf_exit_in, LeafExitOut, leaf_exit_out, leaf_exit, in);
}

contract::LeafExitInRecord cell(const contract::RayRecord& ray, const std::array<std::int32_t, 6>& bound) {
  contract::RaySetupInRecord setup;
  setup.origin = ray.origin;
  setup.direction = ray.direction;
  const auto state = reference::ray_setup(setup);
  contract::LeafExitInRecord in;
  in.bound = bound;
  in.origin = state.origin;
  in.reciprocal = state.reciprocal;
  in.shift = state.shift;
  in.zero = state.zero;
  in.negative = state.negative;
  return in;
}

TEST(LeafExit, is_within_the_bound_of_golden_for_rays_from_inside) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  for (int i = 0; i < 20000; ++i) {
    contract::RayRecord ray;
    std::array<std::int32_t, 6> bound{};
    std::array<double, 6> real{};
    for (int axis = 0; axis < 3; ++axis) {
      bound[2 * axis] = static_cast<std::int32_t>(random.integer(-(1 << 24), 1 << 24));
      bound[2 * axis + 1] = static_cast<std::int32_t>(random.integer(bound[2 * axis], 1 << 24));
      ray.origin[axis] = static_cast<std::int32_t>(random.integer(bound[2 * axis], bound[2 * axis + 1]));
      ray.direction[axis] = random.chance(8) ? 0 : static_cast<std::int32_t>(random.integer(-(1 << 26), (1 << 26) - 1));
      real[2 * axis] = bound[2 * axis] * 0x1p-24;
      real[2 * axis + 1] = bound[2 * axis + 1] * 0x1p-24;
    }
    if (ray.direction == std::array<std::int32_t, 3>{}) continue;
    const auto out = exit_of(cell(ray, bound));
    const auto state = golden::ray_setup(ray);
    const auto golden = golden::leaf_exit(state, real);
    const double t = out.t_exit * 0x1p-24;
    ASSERT_TRUE(out.exits);
    ASSERT_FALSE(out.broken);
    ASSERT_EQ(out.plane, bound[out.face]);
    if (golden.t_exit < 7.9) {
      ASSERT_NEAR(t, golden.t_exit, 0x1p-24 + golden.t_exit * 0x1p-25) << "seed " << seed << " vector " << i;
    }
    if (static_cast<int>(out.face) != golden.face) {  // then both planes are met at the same t, within the bound
      const double other = golden::t_plane(state, static_cast<int>(out.face) / 2, real[out.face]);
      ASSERT_NEAR(std::min(other, 8.0), std::min(golden.t_exit, 8.0), 0x1p-23 + other * 0x1p-24)
          << "seed " << seed << " vector " << i;
    }
  }
}

TEST(LeafExit, the_lowest_axis_wins_a_tie) {
  contract::RayRecord ray;
  ray.direction = {1 << 25, 1 << 25, -(1 << 25)};
  const auto out = exit_of(cell(ray, {-8, 8, -8, 8, -8, 8}));
  EXPECT_EQ(out.face, 1u);
  ray.direction = {0, 1 << 25, -(1 << 25)};
  EXPECT_EQ(exit_of(cell(ray, {-8, 8, -8, 8, -8, 8})).face, 3u);
}

TEST(LeafExit, says_when_the_cell_lies_behind) {
  contract::RayRecord ray;
  ray.direction = {1 << 25, 0, 0};
  auto in = cell(ray, {-8, 8, -8, 8, -8, 8});
  in.t = exit_of(in).t_exit;
  EXPECT_EQ(in.t, 15);  // 8 codes at half a length a unit; the reciprocal is rounded toward zero
  EXPECT_FALSE(exit_of(in).broken);
  in.t += 1;
  EXPECT_TRUE(exit_of(in).broken);
  ray.direction = {0, 0, 0};
  const auto still = exit_of(cell(ray, {-8, 8, -8, 8, -8, 8}));
  EXPECT_FALSE(still.exits);
  EXPECT_FALSE(still.broken);
}

}  // namespace
}  // namespace retrace
