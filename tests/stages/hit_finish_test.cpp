#include "hls/stages/hit_finish.hpp"

#include <cmath>

#include "stage_test.hpp"

namespace retrace {
namespace {

contract::HitRecord finish(const contract::HitFinishInRecord& in) {
  return RETRACE_RUN_STAGE(HitFinishIn, hit_finish_in, Hit, hit, hit_finish, in);
}

TEST(HitFinish, quotients_are_those_of_real_numbers_rounded_toward_zero) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto in = hit_finish_vector(random);
    if (in.status != static_cast<std::uint32_t>(contract::kStatusHit)) continue;
    const auto out = finish(in);
    ASSERT_EQ(out.status, in.status);
    ASSERT_EQ(out.t, in.t);
    ASSERT_EQ(out.id, in.id);
    // long double holds the quotient to 2^-63, so only quotients next to an integer code could round otherwise.
    const long double u =
        std::ldexp(static_cast<long double>(in.edge_u), static_cast<int>(in.exponent_u) - contract::kExponentBias) /
        in.dz;
    const long double expected = std::clamp(std::floor(u), 0.0L, 0x1p24L);
    ASSERT_NEAR(static_cast<double>(out.u), static_cast<double>(expected),
                std::abs(u - std::round(u)) < 1e-6L ? 1.0 : 0.0)
        << "seed " << seed << " vector " << i;
    inside += out.u > 0 && out.u < 1u << 24;
  }
  EXPECT_GT(inside, 300);
}

TEST(HitFinish, anything_but_a_hit_is_an_empty_record) {
  for (const int status :
       {contract::kStatusMiss, contract::kStatusBadRay, contract::kStatusStepLimit, contract::kStatusBusError}) {
    contract::HitFinishInRecord in;
    in.status = static_cast<std::uint32_t>(status);
    in.t = 77;
    in.id = 5;
    in.edge_u = 123;
    in.dz = 1;
    contract::HitRecord expected;
    expected.status = in.status;
    expected.id = contract::kNoTriangle;
    EXPECT_EQ(finish(in), expected);
  }
}

}  // namespace
}  // namespace retrace
