// The classes of agreement, each on a case made for it: what is excused, and that what is a little worse is not.
#include "golden/compare/compare.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

constexpr int kHalf = 1 << 22;  ///< half the size of the triangles, codes
constexpr double kUlp = 0x1p-24;
constexpr std::int32_t kAhead = (1 << 26) - 1;  ///< direction code of +z

/// Triangle in the plane z, with a vertical edge at x = -kHalf and its longest edge opposite.
GridTriangle upright(std::uint32_t id, int z) {
  return {{GridPoint(-kHalf, -kHalf, z), GridPoint(kHalf, -kHalf, z), GridPoint(-kHalf, kHalf, z)}, id};
}

GridRay ray_at(int x, int y, bool any = false) {
  GridRay ray;
  ray.record.origin = {x, y, -(1 << 23)};
  ray.record.direction = {0, 0, kAhead};
  ray.record.t_max = (1u << contract::kTLimitBits) - 1;
  ray.record.any = any ? 1 : 0;
  return ray;
}

Hit hit_of(std::uint32_t id, double t) {
  Hit hit;
  hit.status = contract::kStatusHit;
  hit.id = id;
  hit.t = t;
  return hit;
}
const Hit kMiss{};

double exact_t(const GridScene& scene, const GridRay& ray, std::size_t index) {
  return intersect_exactly(ray.record, scene.triangles[index]).t;
}

GridScene scene_of(std::vector<GridTriangle> triangles) {
  GridScene scene;
  scene.triangles = std::move(triangles);
  return scene;
}

constexpr int kInside = -kHalf / 2;
const int kBandCodes = static_cast<int>(kEdgeBand / kUlp);

TEST(Exact, SignsAndDistancesOfAPlainTriangle) {
  const GridScene scene = scene_of({upright(0, 0)});
  const auto inside = intersect_exactly(ray_at(kInside, kInside).record, scene.triangles[0]);
  EXPECT_TRUE(inside.inside);
  EXPECT_FALSE(inside.in_band);
  EXPECT_NEAR(inside.t, 0.5, 1e-7);
  EXPECT_NEAR(inside.dz, 1.0, 1e-7);
  EXPECT_NEAR(inside.outside, -kHalf / 2 * kUlp, 1e-12);
  const auto on_edge = intersect_exactly(ray_at(-kHalf, kInside).record, scene.triangles[0]);
  EXPECT_TRUE(on_edge.inside);
  EXPECT_TRUE(on_edge.in_band);
  EXPECT_EQ(on_edge.outside, 0.0);
  const auto outside = intersect_exactly(ray_at(-kHalf - 1, kInside).record, scene.triangles[0]);
  EXPECT_FALSE(outside.inside);
  EXPECT_NEAR(outside.outside, kUlp, 1e-15);
  GridRay along = ray_at(kInside, kInside);
  along.record.direction = {kAhead, 0, 0};
  EXPECT_TRUE(intersect_exactly(along.record, scene.triangles[0]).parallel);
}

TEST(Exact, LongestEdgeHasTheWiderBand) {
  const GridScene scene = scene_of({upright(0, 0)});
  const auto beyond_longest = [&](double distance) {  // the hypotenuse runs through the origin of the plane
    const int offset = static_cast<int>(std::lround(distance / kUlp / std::sqrt(2.0)));
    return intersect_exactly(ray_at(offset, offset).record, scene.triangles[0]);
  };
  EXPECT_TRUE(beyond_longest(1.4 * kEdgeBand).in_band);
  EXPECT_FALSE(beyond_longest(1.7 * kEdgeBand).in_band);
  EXPECT_NEAR(beyond_longest(64 * kEdgeBand).outside, 64 * kEdgeBand, kUlp);
  EXPECT_FALSE(intersect_exactly(ray_at(-kHalf - 2 * kBandCodes, kInside).record, scene.triangles[0]).in_band);
}

TEST(Exact, DistanceIsForeshortened) {
  // The triangle tilted about the axis of its edge: outside in its plane counts by the cosine.
  GridTriangle tilted = upright(0, 0);
  tilted.vertices[1] = GridPoint(0, -kHalf, kHalf);
  tilted.vertices[2] = GridPoint(-kHalf, kHalf, 0);
  tilted.vertices[0] = GridPoint(-kHalf, -kHalf, 0);
  const auto e = intersect_exactly(ray_at(-kHalf - 16, kInside).record, tilted);
  EXPECT_NEAR(e.outside, 16 * kUlp, 1e-15);
  EXPECT_LT(e.dz, 0.75);
}

// Random triangles and rays through a chosen point of their plane: inside and distances as barycentrics say.
TEST(Exact, AgreesWithBarycentrics) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    GridTriangle triangle{};
    for (GridPoint& p : triangle.vertices) {
      for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<int>(random.integer(-(1 << 24), 1 << 24));
    }
    const double u = random.real(-0.5, 1.5), v = random.real(-0.5, 1.5);
    const glm::dvec3 a(triangle.vertices[0]), b(triangle.vertices[1]), c(triangle.vertices[2]);
    const glm::dvec3 target = a * (1 - u - v) + b * u + c * v;
    GridRay ray;
    for (int axis = 0; axis < 3; ++axis)
      ray.record.origin[axis] = static_cast<int>(random.integer(-(1 << 24), 1 << 24));
    const glm::dvec3 to = target - glm::dvec3(ray.record.origin[0], ray.record.origin[1], ray.record.origin[2]);
    for (int axis = 0; axis < 3; ++axis) {
      ray.record.direction[axis] = static_cast<int>(std::lround(glm::normalize(to)[axis] * kAhead));
    }
    const auto e = intersect_exactly(ray.record, triangle);
    if (e.dz < 0.01) continue;
    ASSERT_NEAR(e.t, glm::length(to) * kUlp, 1e-5) << i;
    if (std::min({u, v, 1 - u - v}) > 1e-3) {
      ASSERT_TRUE(e.inside) << i;
      ASSERT_LT(e.outside, 0.0) << i;
      ++inside;
    } else if (std::min({u, v, 1 - u - v}) < -1e-3) {
      ASSERT_FALSE(e.inside) << i;
      ASSERT_GT(e.outside, 0.0) << i;
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(Compare, SameTriangleWithinTheDepthBound) {
  const GridScene scene = scene_of({upright(3, 0)});
  const Comparator comparator(scene);
  const GridRay ray = ray_at(kInside, kInside);
  const double t = exact_t(scene, ray, 0), bound = depth_bound(1.0);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, t), hit_of(3, t)).agreement, Agreement::kSame);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, t), hit_of(3, t - 0.9 * bound)).agreement, Agreement::kSame);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, t), hit_of(3, t + 1.1 * bound)).agreement, Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, t + 1.1 * bound), hit_of(3, t)).agreement, Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, t), hit_of(3, NAN)).agreement, Agreement::kViolation);
}

TEST(Compare, MissesAndStatuses) {
  const GridScene scene = scene_of({upright(3, 0)});
  const Comparator comparator(scene);
  const GridRay ray = ray_at(kInside, kInside);
  EXPECT_EQ(comparator.compare(ray, kMiss, kMiss).agreement, Agreement::kSame);
  Hit fault;
  fault.status = contract::kStatusStepLimit;
  EXPECT_EQ(comparator.compare(ray, kMiss, fault).agreement, Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, fault, fault).agreement, Agreement::kSame);
  EXPECT_EQ(comparator.compare(ray, hit_of(3, 0.5), hit_of(7, 0.5)).agreement, Agreement::kViolation);  // no triangle 7
  GridRay outside = ray;
  outside.outside = true;
  EXPECT_EQ(comparator.compare(outside, kMiss, hit_of(3, 0.5)).agreement, Agreement::kViolation);
}

TEST(Compare, FalseHitIsExcusedInTheBandOnly) {
  const GridScene scene = scene_of({upright(0, 0)});
  const Comparator comparator(scene);
  const GridRay close = ray_at(-kHalf - kBandCodes / 2, kInside), far = ray_at(-kHalf - 2 * kBandCodes, kInside);
  const Verdict excused = comparator.compare(close, kMiss, hit_of(0, exact_t(scene, close, 0)));
  EXPECT_EQ(excused.agreement, Agreement::kEdge);
  EXPECT_NEAR(excused.outside, kEdgeBand / 2, 1e-12);
  EXPECT_FALSE(excused.lost);
  EXPECT_EQ(comparator.compare(far, kMiss, hit_of(0, exact_t(scene, far, 0))).agreement, Agreement::kViolation);
}

TEST(Compare, OverlookedHitIsExcusedInTheBandOnly) {
  const GridScene scene = scene_of({upright(0, 0)});
  const Comparator comparator(scene);
  const GridRay close = ray_at(-kHalf + kBandCodes / 2, kInside), far = ray_at(-kHalf + 3 * kBandCodes, kInside);
  const Verdict excused = comparator.compare(close, hit_of(0, exact_t(scene, close, 0)), kMiss);
  EXPECT_EQ(excused.agreement, Agreement::kEdge);
  EXPECT_TRUE(excused.lost);
  EXPECT_EQ(comparator.compare(far, hit_of(0, exact_t(scene, far, 0)), kMiss).agreement, Agreement::kViolation);
}

// Overlooking the first triangle at its edge does not excuse overlooking what is behind it.
TEST(Compare, TriangleBehindMustStillBeFound) {
  const GridScene scene = scene_of({upright(0, 0), upright(1, 1 << 20)});
  GridScene wide = scene;
  wide.triangles[1].vertices[0].x -= kHalf;  // the second one reaches further, so the ray is well inside
  wide.triangles[1].vertices[2].x -= kHalf;
  const Comparator comparator(wide);
  const GridRay ray = ray_at(-kHalf + kBandCodes / 2, kInside);
  const Hit first = hit_of(0, exact_t(wide, ray, 0)), second = hit_of(1, exact_t(wide, ray, 1));
  EXPECT_EQ(comparator.compare(ray, first, second).agreement, Agreement::kEdge);
  EXPECT_EQ(comparator.compare(ray, first, kMiss).agreement, Agreement::kViolation);
}

TEST(Compare, OrderInDepth) {
  const auto verdict = [](int gap) {
    const GridScene scene = scene_of({upright(0, 0), upright(1, gap)});
    const GridRay ray = ray_at(kInside, kInside);
    return Comparator(scene).compare(ray, hit_of(0, exact_t(scene, ray, 0)), hit_of(1, exact_t(scene, ray, 1)));
  };
  EXPECT_EQ(verdict(0).agreement, Agreement::kDepth);
  EXPECT_EQ(verdict(1).agreement, Agreement::kDepth);
  EXPECT_EQ(verdict(1 << 6).agreement, Agreement::kViolation);
  EXPECT_TRUE(verdict(1 << 6).lost);
}

// Golden is not beyond doubt either: a triangle well in front of its hit, found by the other engine, is a violation.
TEST(Compare, GoldenMayNotOverlook) {
  const GridScene scene = scene_of({upright(0, 0), upright(1, 1 << 10)});
  const GridRay ray = ray_at(kInside, kInside);
  const Comparator comparator(scene);
  EXPECT_EQ(comparator.compare(ray, hit_of(1, exact_t(scene, ray, 1)), hit_of(0, exact_t(scene, ray, 0))).agreement,
            Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, kMiss, hit_of(0, exact_t(scene, ray, 0))).agreement, Agreement::kViolation);
}

TEST(Compare, EndsOfTheRay) {
  const GridScene scene = scene_of({upright(0, 0)});
  const Comparator comparator(scene);
  GridRay ray = ray_at(kInside, kInside);
  const double t = exact_t(scene, ray, 0);
  ray.record.t_max = static_cast<std::uint32_t>(t / kUlp);  // rounded down to just before the triangle
  EXPECT_EQ(comparator.compare(ray, kMiss, hit_of(0, ray.record.t_max * kUlp)).agreement, Agreement::kDepth);
  ray.record.t_max += 1u << 10;
  EXPECT_EQ(comparator.compare(ray, hit_of(0, t), kMiss).agreement, Agreement::kViolation);
  ray.record.t_max -= 1u << 11;
  EXPECT_EQ(comparator.compare(ray, kMiss, hit_of(0, t)).agreement, Agreement::kViolation);
  // Origin in the plane.
  GridRay start = ray_at(kInside, kInside);
  start.record.origin[2] = 0;
  EXPECT_EQ(comparator.compare(start, hit_of(0, 0.0), kMiss).agreement, Agreement::kDepth);
}

TEST(Compare, GrazingIsCountedApart) {
  GridTriangle steep{
      {GridPoint(-kHalf, -kHalf, -kHalf), GridPoint(-kHalf + 4096, -kHalf, kHalf), GridPoint(-kHalf, kHalf, -kHalf)},
      0};
  const GridScene scene = scene_of({steep});
  const GridRay ray = ray_at(-kHalf + 1000, -kHalf / 2);
  const auto e = intersect_exactly(ray.record, steep);
  ASSERT_TRUE(e.inside);
  ASSERT_LT(e.dz, kGrazing);
  const Verdict verdict = Comparator(scene).compare(ray, hit_of(0, e.t), hit_of(0, e.t + 0.9 * depth_bound(e.dz)));
  EXPECT_EQ(verdict.agreement, Agreement::kSame);
  EXPECT_TRUE(verdict.grazing);
}

TEST(Compare, AnyHit) {
  const GridScene scene = scene_of({upright(0, 0), upright(1, 1 << 20)});
  const Comparator comparator(scene);
  const GridRay ray = ray_at(kInside, kInside, true), close = ray_at(-kHalf - kBandCodes / 2, kInside, true);
  const Hit first = hit_of(0, exact_t(scene, ray, 0)), second = hit_of(1, exact_t(scene, ray, 1));
  EXPECT_EQ(comparator.compare(ray, first, second).agreement, Agreement::kSame);  // which one is found is free
  EXPECT_EQ(comparator.compare(ray, first, kMiss).agreement, Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, kMiss, second).agreement, Agreement::kViolation);
  EXPECT_EQ(comparator.compare(ray, first, hit_of(1, 0.25)).agreement,
            Agreement::kViolation);  // reported where it is not
  EXPECT_EQ(comparator.compare(close, kMiss, hit_of(0, exact_t(scene, close, 0))).agreement, Agreement::kEdge);
  EXPECT_EQ(comparator.compare(close, hit_of(0, exact_t(scene, close, 0)), kMiss).agreement, Agreement::kEdge);
  EXPECT_EQ(comparator.compare(close, kMiss, kMiss).agreement, Agreement::kSame);
}

TEST(Compare, FixedEnginesMustBeIdentical) {
  Hit a = hit_of(5, 0.5);
  a.u = 0.25;
  a.v = 0.5;
  EXPECT_EQ(Comparator::identical(a, a).agreement, Agreement::kSame);
  EXPECT_EQ(Comparator::identical(kMiss, kMiss).agreement, Agreement::kSame);
  EXPECT_EQ(Comparator::identical(a, kMiss).agreement, Agreement::kViolation);
  Hit b = a;
  b.id = 6;
  EXPECT_EQ(Comparator::identical(a, b).agreement, Agreement::kViolation);
  b = a;
  b.t += kUlp;
  EXPECT_EQ(Comparator::identical(a, b).agreement, Agreement::kViolation);
  b = a;
  b.u += kUlp;
  EXPECT_EQ(Comparator::identical(a, b).agreement, Agreement::kViolation);
  b = a;
  b.v += kUlp;
  EXPECT_EQ(Comparator::identical(a, b).agreement, Agreement::kViolation);
}

TEST(Compare, CountsAddUp) {
  AgreementCounts a, b;
  Verdict edge;
  edge.agreement = Agreement::kEdge;
  edge.grazing = true;
  edge.outside = 1.2 * kEdgeBand;
  a.add(edge, false, true);
  a.add({}, true, true);
  Verdict violation;
  violation.agreement = Agreement::kViolation;
  violation.lost = true;
  b.add(violation, true, false);
  b.add({}, false, false);
  a += b;
  EXPECT_EQ(a.rays(), 4u);
  EXPECT_EQ(a.violations(), 1u);
  EXPECT_EQ(a.lost, 1u);
  EXPECT_EQ(a.false_hits, 1u);
  EXPECT_EQ(a.beyond_band, 1u);
  EXPECT_EQ(a.farthest, 1.2 * kEdgeBand);
  EXPECT_EQ(a.grazing[static_cast<int>(Agreement::kEdge)], 1u);
  EXPECT_EQ(a.only_a + a.only_b + a.both_hit + a.both_miss, 4u);
}

}  // namespace
}  // namespace retrace
