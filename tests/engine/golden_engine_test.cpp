// The reference engine decides as integers of arbitrary width do, and its walks find what all triangles together have.
#include <ap_int.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "golden/engine/stages/hit_finish.hpp"
#include "golden/engine/stages/tri_test.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/closed_meshes.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

using Big = ap_int<192>;  // products of two numerators need 168
using BigVec = std::array<Big, 3>;

constexpr std::int32_t kOne = 1 << contract::kPositionFrac;
constexpr std::uint32_t kFarthest = (1u << contract::kTLimitBits) - 1;

template <class A, class B>
BigVec difference(const A& a, const B& b) {
  BigVec result;
  for (int i = 0; i < 3; ++i) result[static_cast<std::size_t>(i)] = Big(a[i]) - Big(b[i]);
  return result;
}
Big determinant(const BigVec& a, const BigVec& b, const BigVec& c) {
  const Big x = b[1] * c[2] - b[2] * c[1], y = b[2] * c[0] - b[0] * c[2], z = b[0] * c[1] - b[1] * c[0];
  return a[0] * x + a[1] * y + a[2] * z;
}

/// Cramer's rule for o + t d = v0 + u e1 + v e2: numerators over a positive denominator.
struct Solution {
  Big t, u, v, denominator;
  bool hit(std::uint32_t t_max) const {
    // t counts in codes of position over codes of direction: 4 grid units; t_max in units of 2^-24.
    return denominator > 0 && u >= 0 && v >= 0 && u + v <= denominator && t >= 0 &&
           (t << 26) <= Big(t_max) * denominator;
  }
};

Solution solve(const contract::RayRecord& ray, const GridTriangle& triangle) {
  const auto& p = triangle.vertices;
  const BigVec e1 = difference(p[1], p[0]), e2 = difference(p[2], p[0]), s = difference(ray.origin, p[0]);
  const std::array<std::int32_t, 3> none{};
  const BigVec back = difference(none, ray.direction);
  Solution solution{determinant(s, e1, e2), determinant(back, s, e2), determinant(back, e1, s),
                    determinant(back, e1, e2)};
  if (solution.denominator < 0) {
    solution = {-solution.t, -solution.u, -solution.v, -solution.denominator};
  }
  return solution;
}

golden::Triangle make(const GridTriangle& triangle) { return golden::make_triangle(triangle, {0, 1, 2}); }

bool has_area(const GridTriangle& t) {
  const auto edge = [&](std::size_t i) {
    return exact::difference(exact::to_vec(t.vertices[i]), exact::to_vec(t.vertices[0]));
  };
  return exact::cross(edge(1), edge(2)) != exact::Vec{};
}

/// A ray and a triangle that it meets on the lattice in a way that leaves a zero somewhere, or misses by a code.
struct Degenerate {
  contract::RayRecord ray;
  GridTriangle triangle;
  bool sound = true;
};

Degenerate make_degenerate(Random& random, std::uint64_t kind) {
  const auto vector = [&](std::int32_t reach) {
    return GridPoint(random.integer(-reach, reach), random.integer(-reach, reach), random.integer(-reach, reach));
  };
  const auto any_reach = [&](int most) { return std::int32_t{1} << random.below(static_cast<std::uint64_t>(most)); };
  const auto inside = [](const GridPoint& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kOne;
  };
  Degenerate result;
  const GridPoint step = vector(any_reach(21));
  const std::int32_t steps = static_cast<std::int32_t>(random.integer(-2, 12));
  const GridPoint origin = vector(random.chance(2) ? kOne / 4 : any_reach(20)), target = origin + step * steps;
  GridPoint a = vector(any_reach(24)), b = vector(any_reach(24)), c = vector(any_reach(24));
  const GridPoint along = vector(any_reach(20));
  switch (kind) {
    case 0:  // through a vertex
      a = target;
      break;
    case 1:  // through an edge, or its extension
      a = target + along * static_cast<std::int32_t>(random.integer(-1, 3));
      b = target - along * static_cast<std::int32_t>(random.integer(1, 3));
      break;
    case 2:  // in the plane
      a = target + along;
      b = target - along;
      c = a + step * static_cast<std::int32_t>(random.integer(-3, 3));
      break;
    case 3:  // along an edge
      a = target;
      b = target + step;
      break;
    case 4:  // in the plane of an edge, edge behind or at the origin
      a = origin + along;
      b = origin - along;
      break;
    case 5:  // a sliver that the ray meets in its interior
      a = target + along;
      b = target - along;
      c = a + GridPoint(random.integer(-1, 1), random.integer(-1, 1), random.integer(-1, 1));
      break;
    default:  // nothing special
      break;
  }
  result.triangle = {{a, b, c}, 7};
  const auto turn = random.below(3);
  std::rotate(result.triangle.vertices.begin(), result.triangle.vertices.begin() + static_cast<std::ptrdiff_t>(turn),
              result.triangle.vertices.end());
  std::int32_t factor = random.chance(2) ? -1 : 1;
  while (random.chance(8) == false) {
    const GridPoint next = step * (2 * factor);
    if (std::max({std::abs(next.x), std::abs(next.y), std::abs(next.z)}) >= 1 << contract::kDirectionFrac) break;
    factor *= 2;
  }
  for (int axis = 0; axis < 3; ++axis) {
    result.ray.origin[static_cast<std::size_t>(axis)] = origin[axis];
    result.ray.direction[static_cast<std::size_t>(axis)] = step[axis] * factor;
  }
  result.ray.t_max = kFarthest;
  if (random.chance(2)) {  // a code beside it
    const auto axis = random.below(3);
    const auto by = static_cast<std::int32_t>(random.integer(-1, 1));
    if (random.chance(3)) {
      result.ray.direction[axis] += by;
    } else if (random.chance(2)) {
      result.ray.origin[axis] += by;
    } else {
      result.triangle.vertices[random.below(3)][static_cast<int>(axis)] += by;
    }
  }
  for (const GridPoint& p : result.triangle.vertices) result.sound = result.sound && inside(p);
  for (const std::int32_t d : result.ray.direction)
    result.sound = result.sound && std::abs(d) < 1 << contract::kDirectionFrac;
  result.sound = result.sound && has_area(result.triangle) && result.ray.direction != std::array<std::int32_t, 3>{};
  return result;
}

TEST(GoldenTriTest, decides_like_integers_of_any_width) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  std::array<int, 7> hits{}, misses{};
  int ends = 0;
  for (int i = 0; i < 140000; ++i) {
    const auto kind = static_cast<std::size_t>(i) % hits.size();
    Degenerate c = make_degenerate(random, kind);
    if (!c.sound) continue;
    const Solution exact = solve(c.ray, c.triangle);
    if (exact.hit(kFarthest) && random.chance(3)) {  // t_max at the hit, or a code beside it
      const Big code = (exact.t << 26) / exact.denominator;
      c.ray.t_max = static_cast<std::uint32_t>(
          std::clamp<std::int64_t>(code.to_int64() + random.integer(-1, 1), 0, std::int64_t{kFarthest}));
      ++ends;
    }
    const golden::Triangle triangle = make(c.triangle);
    const golden::RayState ray = golden::ray_setup(c.ray);
    golden::Candidate candidate{};
    const bool hit = golden::tri_test(triangle, ray, ray.t_max, candidate);
    ASSERT_EQ(hit, exact.hit(c.ray.t_max)) << "seed " << seed << " vector " << i << " kind " << kind;
    ++(hit ? hits : misses)[kind];
    if (!hit) continue;
    const Big code = (exact.t << 60) / exact.denominator;
    const double t = static_cast<double>(code.to_int64()) * 0x1p-58;
    ASSERT_NEAR(candidate.t, t, golden::kDepthError) << "seed " << seed << " vector " << i;
    const Hit finished = golden::hit_finish(candidate);
    ASSERT_TRUE(finished.u >= 0 && finished.v >= 0 && finished.u <= 1 && finished.v <= 1)
        << "seed " << seed << " vector " << i;
  }
  for (std::size_t kind = 0; kind < hits.size(); ++kind) {
    EXPECT_GT(hits[kind], kind == 2 ? 0 : 100) << kind;
    EXPECT_GT(misses[kind], 100) << kind;
  }
  EXPECT_GT(ends, 500);
}

// Two triangles with the same vertex or edge under the ray have the same t, whatever rounding says; else the exact order counts.
TEST(GoldenTriTest, orders_hits_like_integers_of_any_width) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int ties = 0, close = 0;
  for (int i = 0; i < 40000; ++i) {
    const auto kind = static_cast<std::uint64_t>(i % 2);
    Degenerate c = make_degenerate(random, kind);
    Degenerate other = c;
    other.triangle.vertices[random.below(3)] +=
        GridPoint(random.integer(-3, 3), random.integer(-3, 3), random.integer(-3, 3));
    other.triangle.id = random.chance(2) ? 6 : 8;
    for (const GridPoint& p : other.triangle.vertices)
      c.sound = c.sound && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kOne;
    if (!c.sound || !has_area(other.triangle)) continue;
    const Solution one = solve(c.ray, c.triangle), two = solve(c.ray, other.triangle);
    if (!one.hit(kFarthest) || !two.hit(kFarthest)) continue;
    const golden::Triangle a = make(c.triangle), b = make(other.triangle);
    const golden::RayState ray = golden::ray_setup(c.ray);
    golden::Candidate first{}, second{};
    ASSERT_TRUE(golden::tri_test(a, ray, ray.t_max, first));
    ASSERT_TRUE(golden::tri_test(b, ray, ray.t_max, second));
    const Big left = one.t * two.denominator, right = two.t * one.denominator;
    ASSERT_EQ(golden::is_nearer(first, second, ray), left < right || (left == right && a.id < b.id))
        << "seed " << seed << " vector " << i;
    ASSERT_EQ(golden::is_nearer(second, first, ray), right < left || (left == right && b.id < a.id))
        << "seed " << seed << " vector " << i;
    ties += left == right;
    close += left != right && std::abs(first.t - second.t) <= 2 * golden::kDepthError;
    // The best so far must not hide the nearer one.
    golden::Candidate again{};
    ASSERT_TRUE(right < left || golden::tri_test(a, ray, second.t, again)) << "seed " << seed << " vector " << i;
  }
  EXPECT_GT(ties, 500);
  RecordProperty("close", close);
}

std::vector<Hit> trace(Engine& engine, std::span<const GridRay> rays, WayUp way, int mailbox) {
  TraceOptions options;
  options.way_up = way;
  options.mailbox = mailbox;
  std::vector<Hit> hits(rays.size());
  engine.trace(rays, hits, {}, options);
  return hits;
}

/// Every walk against all triangles: the same triangle, t, u and v; for any-hit rays the same answer.
void check_walks(const std::string& name, const GridScene& scene, const std::vector<GridRay>& rays) {
  const std::uint64_t seed = test_seed();
  const MemoryImage image = build_kd(scene);
  auto engine = make_golden_engine(scene, image);
  std::vector<golden::Triangle> triangles;
  for (const GridTriangle& triangle : scene.triangles) {
    std::array<int, 3> order;
    make_unit_triangle(triangle, &order);
    triangles.push_back(golden::make_triangle(triangle, order));
  }
  std::vector<Hit> truth(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays[i].outside) continue;
    const golden::RayState ray = golden::ray_setup(rays[i].record);
    golden::Candidate best{}, candidate{};
    for (const golden::Triangle& triangle : triangles)
      if (golden::tri_test(triangle, ray, ray.t_max, candidate) && golden::is_nearer(candidate, best, ray))
        best = candidate;
    if (best.triangle != nullptr) truth[i] = golden::hit_finish(best);
  }
  for (const WayUp way : {WayUp::kStack, WayUp::kParentLinks, WayUp::kFaceLinks}) {
    for (const int mailbox : {0, 8}) {
      const auto hits = trace(*engine, rays, way, mailbox);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto where = [&] { return name + " seed " + std::to_string(seed) + " ray " + std::to_string(i); };
        ASSERT_EQ(hits[i].status, truth[i].status) << where();
        if (rays[i].record.any != 0) continue;
        ASSERT_EQ(hits[i].id, truth[i].id) << where();
        ASSERT_EQ(hits[i].t, truth[i].t) << where();
        ASSERT_EQ(hits[i].u, truth[i].u) << where();
        ASSERT_EQ(hits[i].v, truth[i].v) << where();
      }
    }
  }
}

TEST(GoldenWalk, finds_what_all_triangles_have) {
  Random random(test_seed());
  for (const char* name : {"box", "knot:along=40,around=8", "slivers:count=100", "needles:count=200",
                           "coincident:cells=4", "degenerate", "one", "none"}) {
    const GridScene scene = snap(flatten(open_scene(name)));
    check_walks(name, scene, make_test_rays(scene, build_kd(scene), 4500, random));
  }
}

TEST(GoldenWalk, finds_edges_and_vertices_of_closed_meshes) {
  Random random(test_seed());
  for (const char* kind : {"box", "sphere", "random", "sliver"}) {
    const GridScene scene = make_closed_mesh(kind, 6, random);
    std::vector<GridRay> rays;
    for (int part = 0; part < 10; ++part) {
      const GridPoint origin = inside_closed_mesh(scene, random);
      for (const auto& some :
           {make_exact_edge_rays(scene, origin, 200, random), make_edge_rays(scene, origin, 200, random)})
        rays.insert(rays.end(), some.begin(), some.end());
    }
    for (std::size_t i = 0; i < rays.size(); i += 5) rays[i].record.any = 1;
    check_walks(kind, scene, rays);
  }
}

TEST(GoldenWatertight, no_ray_leaves_small_and_odd_closed_meshes) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  for (int round = 0; round < 60; ++round) {
    const char* kind = std::array{"box", "sphere", "random", "sliver"}[static_cast<std::size_t>(round) % 4];
    const GridScene scene = make_closed_mesh(kind, 1 + static_cast<int>(random.below(5)), random);
    const MemoryImage image = build_kd(scene);
    auto engine = make_golden_engine(scene, image);
    const GridPoint origin = inside_closed_mesh(scene, random);
    auto rays = make_exact_edge_rays(scene, origin, 2000, random);
    for (const GridRay& ray : make_edge_rays(scene, origin, 2000, random)) rays.push_back(ray);
    const auto hits = trace(*engine, rays, round % 2 == 0 ? WayUp::kFaceLinks : WayUp::kStack, 0);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(hits[i].hit()) << kind << " seed " << seed << " round " << round << " ray " << i;
  }
}

// As a camera and a file of rays see it: pixels of the inside of a closed box, whose diagonals cross the middle of the picture, and rays
// from its centre to its vertices, quantised from world units.
TEST(GoldenWatertight, pixels_and_vertices_of_a_closed_box) {
  Random random(test_seed());
  for (const int cells : {1, 2, 8}) {
    const GridScene scene = make_closed_mesh("box", cells, random);
    const MemoryImage image = build_kd(scene);
    auto engine = make_golden_engine(scene, image);
    std::vector<GridRay> rays;
    const auto add = [&](const glm::dvec3& direction) {
      WorldRay ray;
      ray.direction = direction;
      rays.push_back(quantise(ray, scene.transform, scene.box, false));
    };
    constexpr int kSize = 161;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) add({(x - kSize / 2) * (2.0 / kSize), (y - kSize / 2) * (2.0 / kSize), -1.0});
    for (const GridTriangle& triangle : scene.triangles)
      for (const GridPoint& p : triangle.vertices) add(glm::dvec3(p));
    const auto hits = trace(*engine, rays, WayUp::kFaceLinks, 0);
    const auto escaped = std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return !hit.hit(); });
    EXPECT_EQ(escaped, 0) << cells << " cells, of " << rays.size() << " rays";
  }
}

}  // namespace
}  // namespace retrace
