#include "hls/stages/instance_enter.hpp"

#include <cmath>

#include "golden/contract/certified_bounds.hpp"
#include "golden/engine/stages/instance_enter.hpp"
#include "golden/tree/instance.hpp"
#include "stage_test.hpp"
#include "testbench/kit/test_instances.hpp"

namespace retrace {
namespace {

using Real = long double;
using Vector = std::array<Real, 3>;

contract::InstanceEnterOutRecord enter(const contract::InstanceEnterInRecord& in) {
  return RETRACE_RUN_STAGE(InstanceEnterIn, instance_enter_in, InstanceEnterOut, instance_enter_out, instance_enter,
                           in);
}

Vector scaled(const std::array<std::int32_t, 3>& codes, int frac) {
  return {std::ldexp(Real(codes[0]), -frac), std::ldexp(Real(codes[1]), -frac), std::ldexp(Real(codes[2]), -frac)};
}

Real norm(const Vector& x) { return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/// The world's ray in the object, unrounded: with t counted as the entry counts it.
struct ExactRay {
  Vector origin, direction;
};
ExactRay exact_ray(const contract::InstanceEnterInRecord& in, int scale) {
  ExactRay ray{golden::transform_exactly(in, in.origin, contract::kPositionFrac, true),
               golden::transform_exactly(in, in.direction, contract::kDirectionFrac, false)};
  for (Real& x : ray.direction) x = std::ldexp(x, -scale);
  return ray;
}

/// Where the ray is inside the box; empty if first > last.
struct Span {
  Real first = 0.0L, last = 1e30L;
};
Span cut(const ExactRay& ray, const std::array<std::int32_t, 6>& box, Real grow) {
  Span span;
  for (std::size_t i = 0; i < 3; ++i) {
    const Real lower = std::ldexp(Real(box[2 * i]), -contract::kBoxFaceFrac) - grow - ray.origin[i];
    const Real upper = std::ldexp(Real(box[2 * i + 1]), -contract::kBoxFaceFrac) + grow - ray.origin[i];
    if (ray.direction[i] == 0) {
      if (lower > 0 || upper < 0) return {1, 0};
      continue;
    }
    const Real one = lower / ray.direction[i], two = upper / ray.direction[i];
    span.first = std::max(span.first, std::min(one, two));
    span.last = std::min(span.last, std::max(one, two));
  }
  return span;
}

TEST(InstanceEnter, the_ray_of_the_object_lies_on_that_of_the_world) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  Real origin_worst = 0, direction_worst = 0, ray_worst = 0, shortest = 2, longest = 0, farthest = 0;
  int entered = 0;
  for (int i = 0; i < 200000; ++i) {
    const auto in = instance_enter_vector(random);
    const auto out = enter(in);
    if (!out.enters || norm(scaled(in.direction, contract::kDirectionFrac)) < 0.9L) continue;
    bool legal = true;  // the record of some instance: flipped exponents and random bits need not be
    for (std::size_t face = 0; face < 6; ++face) legal = legal && std::abs(in.box[face]) <= 112;
    for (const auto o : in.origin) legal = legal && std::abs(o) <= 1 << contract::kPositionFrac;
    if (!legal) continue;
    ++entered;
    const ExactRay exact = exact_ray(in, static_cast<int>(out.scale));
    const Vector origin = scaled(out.origin, contract::kPositionFrac);
    const Vector direction = scaled(out.direction, contract::kDirectionFrac);
    const Real start = std::ldexp(Real(out.start), -contract::kEntryStartFrac);
    Vector apart_origin, apart_direction, apart;
    const Real t = 7;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      apart_origin[axis] = origin[axis] - exact.origin[axis] - start * exact.direction[axis];
      apart_direction[axis] = direction[axis] - exact.direction[axis];
      apart[axis] = apart_origin[axis] + t * apart_direction[axis];
      origin_worst = std::max(origin_worst, std::abs(apart_origin[axis]));
      direction_worst = std::max(direction_worst, std::abs(apart_direction[axis]));
      farthest = std::max(farthest, std::abs(origin[axis]));
      ASSERT_LT(std::abs(origin[axis]), 1.0L) << "seed " << seed << " vector " << i;
    }
    ray_worst = std::max(ray_worst, norm(apart));
    shortest = std::min(shortest, norm(direction));
    longest = std::max(longest, norm(direction));
    ASSERT_LE(out.t_max, (1u << contract::kTLimitBits) - 1);
  }
  const auto check = [&](const char* name, Real measured, double bound, double least) {
    std::printf("%-20s measured / bound %.3Lf\n", name, measured / bound);
    EXPECT_LE(measured, bound) << name << " seed " << seed;
    EXPECT_GE(measured, bound * least) << name << ": the bound says little";
  };
  std::printf("%d entered; |d'| from %.4Lf to %.8Lf; |o'| up to %.4Lf\n", entered, shortest, longest, farthest);
  EXPECT_GT(entered, 40000);
  check("origin", origin_worst, certified::kInstanceOrigin, 0.9);
  check("direction", direction_worst, certified::kInstanceDirection, 0.9);
  EXPECT_GE(shortest, certified::kInstanceShortest);
  EXPECT_LE(longest, 1.0L + 0x1p-25L);
}

TEST(InstanceEnter, a_ray_through_the_box_is_let_in_and_one_well_beside_is_not) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int through = 0, beside = 0, late = 0;
  for (int i = 0; i < 200000; ++i) {
    const auto in = instance_enter_vector(random);
    const auto out = enter(in);
    if (out.bad || norm(scaled(in.direction, contract::kDirectionFrac)) < 0.9L) continue;
    if (in.box[0] > in.box[1] || in.box[2] > in.box[3] || in.box[4] > in.box[5]) continue;
    // k and s of the entry, from a box and a reach that let everything in.
    auto open = in;
    for (std::size_t face = 0; face < 6; ++face) open.box[face] = face % 2 ? 127 : -128;
    open.reach = 1u << (contract::kTReachBits - 1);
    const Vector place = golden::transform_exactly(in, in.origin, contract::kPositionFrac, true);
    const Real far_out = std::max({std::abs(place[0]), std::abs(place[1]), std::abs(place[2]), 2.0L});
    const Real unit = far_out * 0x1p-24L;  // at least 2^(spread - 24)
    const auto wide = enter(open);
    if (!wide.enters) {
      ASSERT_FALSE(out.enters) << "seed " << seed << " vector " << i;
      continue;
    }
    const ExactRay exact = exact_ray(in, static_cast<int>(wide.scale));
    const Real reach = std::ldexp(Real(in.reach), static_cast<int>(wide.scale) - contract::kTFrac);
    const Span inner = cut(exact, in.box, 0.0L), outer = cut(exact, in.box, 32 * unit);
    if (inner.first <= inner.last && inner.first < reach - 0x1p-20L) {
      ++through;
      ASSERT_TRUE(out.enters) << "seed " << seed << " vector " << i;
      const Real start = std::ldexp(Real(out.start), -contract::kEntryStartFrac);
      ASSERT_LE(start, inner.first) << "seed " << seed << " vector " << i;
    } else if (outer.first > outer.last) {
      ++beside;
      ASSERT_FALSE(out.enters) << "seed " << seed << " vector " << i;
    } else if (outer.first > reach + 1) {
      ++late;
      ASSERT_FALSE(out.enters) << "seed " << seed << " vector " << i;
    }
  }
  std::printf("%d through the box, %d beside it, %d beyond the reach\n", through, beside, late);
  EXPECT_GT(through, 50000);
  EXPECT_GT(beside, 10000);
  EXPECT_GT(late, 1000);
}

TEST(InstanceEnter, what_is_left_of_the_reach_counts_the_same_hits_as_the_reach) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int entered = 0;
  for (int i = 0; i < 50000; ++i) {
    const auto in = instance_enter_vector(random);
    const auto out = enter(in);
    if (!out.enters) continue;
    ++entered;
    for (int k = 0; k < 8; ++k) {
      const std::uint32_t most = (1u << contract::kTLimitBits) - 1;
      const auto t = static_cast<std::uint32_t>(
          k < 3 ? std::clamp<std::int64_t>(std::int64_t{out.t_max} + k - 1, 0, most) : random.below(most + 1ull));
      const hls::t_limit_t world = hls::world_t(t, out.start, out.scale);
      const std::uint32_t exact = golden::world_t(t, out.start, out.scale);
      ASSERT_EQ(t <= out.t_max, exact < in.reach) << "seed " << seed << " vector " << i << " t " << t;
      if (exact < in.reach) {
        ASSERT_EQ(world.to_uint(), exact);
      }
    }
  }
  EXPECT_GT(entered, 10000);
}

TEST(InstanceEnter, records_that_no_host_writes_are_bad) {
  contract::InstanceEnterInRecord in;
  const auto make = [&] {
    in = {};
    for (std::size_t i = 0; i < 3; ++i) {
      in.m[4 * i] = 1 << 30;  // the object is as large as the world
      in.e[i] = 1;
      in.box[2 * i] = -64;
      in.box[2 * i + 1] = 64;
    }
    in.origin = {-(1 << 24), 0, 0};
    in.direction = {(1 << 26) - 1, 0, 0};
    in.reach = 4 << contract::kTLimitFrac;
  };
  make();
  EXPECT_TRUE(enter(in).enters);
  EXPECT_FALSE(enter(in).bad);
  in.reach = 0;
  EXPECT_FALSE(enter(in).enters);
  make();
  in.e[2] = contract::kRowExponentMax + 1;  // even where nothing depends on it
  EXPECT_TRUE(enter(in).bad);
  make();
  in.m[0] = in.m[4] = in.m[8] = 0;  // no direction is left
  EXPECT_TRUE(enter(in).bad);
  make();
  in.m[0] = 1 << 28;  // a stretch of 4
  EXPECT_TRUE(enter(in).bad);
  make();
  in.b[1] = std::int64_t{3} << 31;  // an origin beyond 2^17
  in.e[1] = contract::kRowExponentMax;
  in.origin[1] = 1 << 25;
  in.m[4] = 0x7fffffff;
  EXPECT_TRUE(enter(in).bad);
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int bad = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto any = directed_record<contract::InstanceEnterInRecord>(random);
    const auto out = enter(any);
    bad += out.bad != 0;
    ASSERT_FALSE(out.bad && out.enters);
    ASSERT_EQ(out, golden::instance_enter(any)) << "seed " << seed << " vector " << i;
  }
  EXPECT_GT(bad, 10000);
}

TEST(Instance, the_record_places_the_object_where_the_scene_does) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  double worst = 0, ratio = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto shape = static_cast<InstanceShape>(random.below(static_cast<std::uint64_t>(InstanceShape::kCount)));
    const Placement placement = random_placement(random, shape);
    const std::array<std::int32_t, 6> box{-(7 << 21), 7 << 21, -5, 6, -(1 << 23), (1 << 23) + 1};
    const auto record = make_instance(placement, box, 17, 23);
    ASSERT_TRUE(record) << "seed " << seed << " instance " << i;
    EXPECT_TRUE(record->fits());
    EXPECT_EQ(record->root, 17u);
    EXPECT_EQ(record->first_id, 23u);
    for (std::size_t face = 0; face < 6; ++face) {
      const double exact = box[face] * 0x1p-24, kept = record->box[face] * 0x1p-7;
      EXPECT_TRUE(face % 2 ? kept >= exact && kept < exact + 0x1p-7 : kept <= exact && kept > exact - 0x1p-7) << face;
    }
    // A point of the object, through the scene's matrix and back through the record, as a distance in the world.
    glm::dvec3 point, back;
    for (int axis = 0; axis < 3; ++axis) point[axis] = random.real(-kObjectReach, kObjectReach);
    const glm::dvec3 world = placement.linear * point + placement.offset;
    for (int row = 0; row < 3; ++row) {
      const auto at = static_cast<std::size_t>(row);
      long double sum = std::ldexp(static_cast<long double>(record->b[at]), -31);
      for (int j = 0; j < 3; ++j)
        sum += std::ldexp(static_cast<long double>(record->m[3 * at + static_cast<std::size_t>(j)]), -31) * world[j];
      back[row] = static_cast<double>(std::ldexp(sum, static_cast<int>(record->e[at])));
    }
    const double off = glm::length(placement.linear * (back - point));
    // Half a unit in every coefficient, and in the constant; 2^-47 for the inverse in doubles.
    double bound = 0;
    for (int row = 0; row < 3; ++row)
      bound += glm::length(placement.linear[row]) *
               std::ldexp(1.0, static_cast<int>(record->e[static_cast<std::size_t>(row)])) * (0x1p-32 + 0x1p-47) *
               (std::abs(world.x) + std::abs(world.y) + std::abs(world.z) + 1.0);
    worst = std::max(worst, off);
    ratio = std::max(ratio, off / bound);
    ASSERT_LE(off, bound) << "seed " << seed << " instance " << i;
  }
  std::printf("placement: at most 2^%.2f off in the world\n", std::log2(worst));
  EXPECT_GT(ratio, 0.3);
}

TEST(Instance, what_no_record_can_say_is_refused) {
  const std::array<std::int32_t, 6> box{-1000, 1000, -1000, 1000, -1000, 1000};
  Placement placement;
  EXPECT_TRUE(make_instance(placement, box, 0, 0));
  placement.linear[1] = glm::dvec3(0.0);
  EXPECT_FALSE(make_instance(placement, box, 0, 0));
  placement.linear[1] = glm::dvec3(0.0, 0x1p-16, 0.0);
  EXPECT_FALSE(make_instance(placement, box, 0, 0));
  placement.linear[1] = glm::dvec3(0.0, 1.97, 0.0);
  EXPECT_FALSE(make_instance(placement, box, 0, 0));
  placement.linear[1] = glm::dvec3(0.0, 1.95, 0.0);
  EXPECT_TRUE(make_instance(placement, box, 0, 0));
  placement.linear[1][1] = std::nan("");
  EXPECT_FALSE(make_instance(placement, box, 0, 0));
  placement = {};
  placement.offset.x = 9.0;
  EXPECT_FALSE(make_instance(placement, box, 0, 0));
  EXPECT_FALSE(make_instance({}, {-1000, 1000, -1000, (7 << 21) + 1, -1000, 1000}, 0, 0));
  glm::dmat3 shear(1.0);
  shear[1][0] = 1.5;  // singular values 2 and 1/2
  EXPECT_NEAR(largest_stretch(shear), 2.0, 1e-12);
  EXPECT_NEAR(largest_stretch(glm::dmat3(-0.25)), 0.25, 1e-12);
}

}  // namespace
}  // namespace retrace
