#include "hls/stages/kd_descend.hpp"

#include <cmath>

#include "golden/engine/stages/kd_descend.hpp"
#include "stage_test.hpp"
#include "testbench/kit/reference.hpp"

namespace retrace {
namespace {

std::uint32_t descend(const contract::KdDescendInRecord& in) {
  return RETRACE_RUN_STAGE(KdDescendIn, kd_descend_in, KdDescendOut, kd_descend_out, kd_descend, in).node;
}

/// The values of one axis of a ray, as ray_setup gives them.
contract::KdDescendInRecord along(std::int32_t origin, std::int32_t direction) {
  contract::RaySetupInRecord ray;
  ray.direction = {direction, 0, 0};
  const auto state = reference::ray_setup(ray);
  contract::KdDescendInRecord in;
  in.origin = origin;
  in.reciprocal = state.reciprocal[0];
  in.shift = state.shift[0];
  in.zero = state.zero[0];
  in.negative = state.negative[0];
  in.child = 21;
  return in;
}

TEST(KdDescend, takes_golden_s_side_unless_t_is_within_the_bound_of_the_plane) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int decided = 0;
  for (int i = 0; i < 20000; ++i) {
    contract::RayRecord ray;
    ray.origin[0] = static_cast<std::int32_t>(random.integer(-(1 << 24), 1 << 24));
    ray.direction[0] = static_cast<std::int32_t>(random.integer(-(1 << 26), (1 << 26) - 1));
    auto in = along(ray.origin[0], ray.direction[0]);
    in.split = static_cast<std::int32_t>(random.integer(-(1 << 24), 1 << 24));
    in.t = static_cast<std::int32_t>(random.integer(0, 4 << 24));
    const auto state = golden::ray_setup(ray);
    const double plane = golden::t_plane(state, 0, in.split * 0x1p-24), t = in.t * 0x1p-24;
    // One code of t, and a relative 2^-25 from the reciprocal.
    if (std::abs(plane - t) <= 0x1p-24 + std::abs(plane) * 0x1p-25) continue;
    ++decided;
    ASSERT_EQ(descend(in), golden::kd_descend(state, 0, plane, 2 * in.child, t)) << "seed " << seed << " vector " << i;
  }
  EXPECT_GT(decided, 19000);
}

TEST(KdDescend, a_tie_goes_far) {
  auto in = along(0, 3 << 24);
  in.split = 1 << 22;
  const auto plane = [&] {
    return static_cast<std::int32_t>(reference::t_plane(in.split, in.origin, in.reciprocal, in.shift));
  };
  in.t = plane() - 1;
  EXPECT_EQ(descend(in), 2 * in.child);
  in.t = plane();
  EXPECT_EQ(descend(in), 2 * in.child + 1);
  in = along(0, -(3 << 24));
  in.split = -(1 << 22);
  in.t = plane() - 1;
  EXPECT_EQ(descend(in), 2 * in.child + 1);
  in.t = plane();
  EXPECT_EQ(descend(in), 2 * in.child);
}

TEST(KdDescend, a_zero_direction_decides_by_the_origin) {
  auto in = along(5, 0);
  in.split = 6;
  EXPECT_EQ(descend(in), 2 * in.child);
  in.split = 5;
  EXPECT_EQ(descend(in), 2 * in.child + 1);
  in.split = 4;
  EXPECT_EQ(descend(in), 2 * in.child + 1);
}

TEST(KdDescend, t_plane_is_monotone_in_the_plane_and_saturates) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  for (int i = 0; i < 2000; ++i) {
    const auto in = along(static_cast<std::int32_t>(random.integer(-(1 << 24), 1 << 24)),
                          static_cast<std::int32_t>(random.integer(1, 1 << (1 + random.below(25)))));
    const auto split = static_cast<std::int32_t>(random.integer(-(1 << 24), (1 << 24) - 2));
    const auto plane = [&](std::int32_t s) {
      return hls::t_plane(s, in.origin, hls::reciprocal_t(in.reciprocal), hls::recip_shift_t(in.shift)).to_int();
    };
    ASSERT_LE(plane(split), plane(split + 1)) << "seed " << seed << " vector " << i;
    ASSERT_LT(std::abs(static_cast<double>(plane(split))), 8.0 * (1 << 24) + 1);
  }
  const auto slow = along(-(1 << 24), 1);
  EXPECT_EQ(
      hls::t_plane(1 << 24, slow.origin, hls::reciprocal_t(slow.reciprocal), hls::recip_shift_t(slow.shift)).to_int(),
      (1 << (contract::kTBits - 1)) - 1);
}

}  // namespace
}  // namespace retrace
