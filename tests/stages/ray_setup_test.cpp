#include "hls/stages/ray_setup.hpp"

#include <cmath>

#include "golden/engine/stages/ray_setup.hpp"
#include "stage_test.hpp"

namespace retrace {
namespace {

contract::RaySetupOutRecord setup(const contract::RaySetupInRecord& in) {
  return RETRACE_RUN_STAGE(RaySetupIn, ray_setup_in, RaySetupOut, ray_setup_out, ray_setup, in);
}

TEST(RaySetup, reciprocals_are_within_a_relative_2_to_the_minus_25_of_golden) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  for (int i = 0; i < 20000; ++i) {
    const auto in = ray_setup_vector(random);
    const auto out = setup(in);
    contract::RayRecord ray;
    ray.origin = in.origin;
    ray.direction = in.direction;
    const auto golden = golden::ray_setup(ray);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(out.zero[axis] != 0, golden.zero[axis]);
      ASSERT_EQ(out.negative[axis] != 0, golden.negative[axis]);
      if (out.zero[axis]) continue;
      // (s - o) / d = (s - o) * R / 2^shift, so R / 2^shift is 1 / d.
      const double reciprocal = std::ldexp(out.reciprocal[axis], -static_cast<int>(out.shift[axis]));
      ASSERT_LE(std::abs(reciprocal), std::abs(golden.reciprocal[axis]));
      ASSERT_NEAR(reciprocal / golden.reciprocal[axis], 1.0, 0x1p-25) << "seed " << seed << " vector " << i;
    }
  }
}

TEST(RaySetup, every_power_of_two_and_its_neighbours) {
  for (int bit = 0; bit <= contract::kDirectionFrac; ++bit) {
    for (int delta = -1; delta <= 1; ++delta) {
      const std::int64_t magnitude = (std::int64_t{1} << bit) + delta;
      if (magnitude <= 0 || magnitude > std::int64_t{1} << contract::kDirectionFrac) continue;
      contract::RaySetupInRecord in;
      in.direction = {static_cast<std::int32_t>(-magnitude), 0, 0};
      const auto out = setup(in);
      const double reciprocal = std::ldexp(out.reciprocal[0], -static_cast<int>(out.shift[0]));
      EXPECT_NEAR(reciprocal * -static_cast<double>(magnitude) * 0x1p-26, 1.0, 0x1p-25) << magnitude;
      EXPECT_TRUE(out.valid);
      EXPECT_EQ(out.zero[1], 1u);
      EXPECT_EQ(out.reciprocal[1], 0);
    }
  }
}

TEST(RaySetup, a_zero_direction_and_an_origin_outside_the_box_are_invalid) {
  contract::RaySetupInRecord in;
  in.box = {-100, 100, -50, 50, -10, 10};
  EXPECT_FALSE(setup(in).valid);
  in.direction = {0, 1, 0};
  EXPECT_TRUE(setup(in).valid);
  for (int face = 0; face < 6; ++face) {
    auto at = in;
    at.origin[face / 2] = in.box[face];
    EXPECT_TRUE(setup(at).valid) << face;
    at.origin[face / 2] += face % 2 ? 1 : -1;
    EXPECT_FALSE(setup(at).valid) << face;
  }
}

}  // namespace
}  // namespace retrace
