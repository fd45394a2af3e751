#include "hls/stages/tri_test.hpp"

#include <cmath>

#include "golden/compare/compare.hpp"
#include "golden/tree/kd_builder.hpp"
#include "stage_test.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

contract::TriTestOutRecord test(const contract::TriTestInRecord& in) {
  return RETRACE_RUN_STAGE(TriTestIn, tri_test_in, TriTestOut, tri_test_out, tri_test, in);
}

contract::TriTestInRecord input(const GridTriangle& triangle, const contract::RayRecord& ray) {
  const auto record = make_unit_triangle(triangle);
  contract::TriTestInRecord in;
  in.u = record.u;
  in.v = record.v;
  in.n = record.n;
  in.offset_u = record.offset_u;
  in.offset_v = record.offset_v;
  in.offset_n = record.offset_n;
  in.exponent_u = record.exponent_u;
  in.exponent_v = record.exponent_v;
  in.id = record.id;
  in.origin = ray.origin;
  in.direction = ray.direction;
  return in;
}

GridPoint random_point(Random& random, std::int32_t reach) {
  return {random.integer(-reach, reach), random.integer(-reach, reach), random.integer(-reach, reach)};
}

GridScene scene_of(std::vector<GridTriangle> triangles) {
  GridScene scene;
  scene.triangles = std::move(triangles);
  scene.box = {-(1 << 24), 1 << 24, -(1 << 24), 1 << 24, -(1 << 24), 1 << 24};
  return scene;
}

TEST(TriTest, finds_every_exact_hit_that_is_not_grazing_and_its_t) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto size = std::int32_t{1} << (4 + random.below(20));
    const GridPoint centre = random_point(random, (1 << 24) - size);
    const GridTriangle triangle{
        {centre + random_point(random, size), centre + random_point(random, size), centre + random_point(random, size)},
        5};
    const auto normal = glm::cross(glm::dvec3(triangle.vertices[1] - triangle.vertices[0]),
                                   glm::dvec3(triangle.vertices[2] - triangle.vertices[0]));
    if (glm::dot(normal, normal) == 0) continue;
    const auto ray = make_edge_rays(scene_of({triangle}), random_point(random, 1 << 24), 1, random)[0].record;
    const auto exact = intersect_exactly(ray, triangle);
    const auto out = test(input(triangle, ray));
    if (exact.inside && exact.t >= 0x1p-18 && exact.dz >= 0x1p-10) {
      ASSERT_TRUE(out.hit) << "seed " << seed << " vector " << i;
      ASSERT_NEAR(out.t * 0x1p-24, exact.t, depth_bound(exact.dz)) << "seed " << seed << " vector " << i;
      ++hits;
    }
  }
  EXPECT_GT(hits, 3000);
}

TEST(TriTest, no_ray_slips_between_two_triangles_that_share_an_edge) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int crossings = 0;
  for (int i = 0; i < 20000; ++i) {
    const GridPoint a = random_point(random, 1 << 23), b = random_point(random, 1 << 23);
    const GridTriangle left{{a, b, random_point(random, 1 << 23)}, 1}, right{{b, a, random_point(random, 1 << 23)}, 2};
    const GridPoint origin = random_point(random, 1 << 24);
    // Of the target on the shared edge only the ray's rounding moves away: one of the two must be hit where they face
    // each other.
    const glm::dvec3 target = glm::mix(glm::dvec3(a), glm::dvec3(b), random.real(0.01, 0.99));
    const glm::dvec3 d = glm::normalize(target - glm::dvec3(origin));
    contract::RayRecord ray;
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = origin[axis];
      ray.direction[axis] = static_cast<std::int32_t>(std::min(std::floor(d[axis] * 0x1p26 + 0.5), 0x1p26 - 1));
    }
    const auto one = intersect_exactly(ray, left), two = intersect_exactly(ray, right);
    if (!one.inside && !two.inside) continue;  // seen along the fold
    if ((one.inside ? one : two).dz < 0x1p-10 || (one.inside ? one : two).t < 0x1p-18) continue;
    ++crossings;
    ASSERT_TRUE(test(input(left, ray)).hit || test(input(right, ray)).hit) << "seed " << seed << " vector " << i;
  }
  EXPECT_GT(crossings, 5000);
}

TEST(TriTest, a_needle_is_not_hit_beyond_its_tips) {
  // Width 2^-23, length 1/8, along x; rays come straight down beside it.
  const GridTriangle needle{{GridPoint{0, 0, 0}, GridPoint{0, 2, 0}, GridPoint{1 << 21, 1, 0}}, 1};
  for (const std::int32_t x : {-(1 << 23), -(1 << 12), (1 << 21) + (1 << 12), 1 << 23, 1 << 24}) {
    contract::RayRecord ray;
    ray.origin = {x, 1, 1 << 23};
    ray.direction = {0, 0, -(1 << 26)};
    EXPECT_FALSE(test(input(needle, ray)).hit) << x;
  }
  contract::RayRecord ray;
  ray.origin = {1 << 20, 1, 1 << 23};
  ray.direction = {0, 0, -(1 << 26)};
  EXPECT_TRUE(test(input(needle, ray)).hit);
}

TEST(TriTest, behind_parallel_and_at_the_origin) {
  const GridTriangle triangle{{GridPoint{0, 0, 0}, GridPoint{1 << 20, 0, 0}, GridPoint{0, 1 << 20, 0}}, 9};
  contract::RayRecord ray;
  ray.origin = {1 << 18, 1 << 18, 1 << 20};
  ray.direction = {0, 0, 1 << 25};
  EXPECT_FALSE(test(input(triangle, ray)).hit);
  ray.direction = {1 << 25, 0, 0};
  EXPECT_FALSE(test(input(triangle, ray)).hit);
  ray.direction = {0, 0, -(1 << 25)};  // half length: t counts in lengths of the direction
  const auto hit = test(input(triangle, ray));
  EXPECT_TRUE(hit.hit);
  EXPECT_NEAR(hit.t, 1 << 21, 2);
  ray.origin[2] = 0;
  EXPECT_TRUE(test(input(triangle, ray)).hit);
  EXPECT_EQ(test(input(triangle, ray)).t, 0u);
}

TEST(TriTest, the_nearer_candidate_wins_and_the_lower_id_on_a_tie) {
  const auto nearer = [](unsigned t, unsigned id, unsigned best_t, unsigned best_id) {
    return hls::is_nearer(t, id, best_t, best_id) == 1;
  };
  EXPECT_TRUE(nearer(4, 9, 5, 1));
  EXPECT_FALSE(nearer(6, 0, 5, 1));
  EXPECT_TRUE(nearer(5, 0, 5, 1));
  EXPECT_FALSE(nearer(5, 1, 5, 1));
  EXPECT_FALSE(nearer(5, 2, 5, 1));
  EXPECT_TRUE(nearer(5, 2, 5, contract::kNoTriangle));
}

}  // namespace
}  // namespace retrace
