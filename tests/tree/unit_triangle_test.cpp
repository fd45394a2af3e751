// Rows of the unit-triangle test against the exact ones, which are quotients of integers below 2^127: coefficients,
// constants, exponents, norms, order of the vertices.
#include <gtest/gtest.h>

#include <cmath>

#include "golden/tree/kd_builder.hpp"
#include "grid_scenes.hpp"

namespace retrace {
namespace {

using Wide = __int128;
using Real = long double;

struct WideVec {
  Wide x, y, z;
};
WideVec difference(const GridPoint& a, const GridPoint& b) {
  return {Wide{a.x} - b.x, Wide{a.y} - b.y, Wide{a.z} - b.z};
}
WideVec cross(const WideVec& a, const WideVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Wide dot(const WideVec& a, const WideVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// A row is numerator / denominator in 1 / code; the stored one is this, times 2^24 (1 / position), times 2^-exponent.
void expect_row(const char* name, const WideVec& numerator, Real denominator, int exponent, const GridPoint& a,
                const std::array<std::int32_t, 3>& stored, std::int32_t offset) {
  const Real scale = std::ldexp(Real{1}, 24 - exponent) / denominator;
  const Wide parts[3] = {numerator.x, numerator.y, numerator.z};
  for (int k = 0; k < 3; ++k) {
    const Real exact = static_cast<Real>(parts[k]) * scale;
    ASSERT_LE(std::fabs(std::ldexp(Real{1} * stored[k], -26) - exact), 0x1p-27L + 0x1p-48L) << name << "[" << k << "]";
  }
  const Real constant = -static_cast<Real>(dot(numerator, {a.x, a.y, a.z})) * 0x1p-24L * scale;
  ASSERT_LE(std::fabs(std::ldexp(Real{1} * offset, -29) - constant), 0x1p-30L + 0x1p-47L) << "offset_" << name;
}

void expect_exact_record(const GridTriangle& triangle) {
  constexpr Real kMost = 1 - 0x1p-22L;
  std::array<int, 3> order{-1, -1, -1};
  const contract::TriangleRecord r = make_unit_triangle(triangle, &order);
  ASSERT_TRUE(r.fits());
  ASSERT_EQ(r.id, triangle.id);

  std::array<int, 3> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_EQ(sorted, (std::array<int, 3>{0, 1, 2}));
  const GridPoint &a = triangle.vertices[order[0]], &b = triangle.vertices[order[1]], &c = triangle.vertices[order[2]];
  const WideVec ab = difference(b, a), ac = difference(c, a), bc = difference(c, b);
  // Heights are inverse to the opposite edges; equal ones stand in the file's order.
  ASSERT_GE(dot(bc, bc), dot(ac, ac));
  ASSERT_GE(dot(ac, ac), dot(ab, ab));
  if (dot(bc, bc) == dot(ac, ac)) {
    ASSERT_LT(order[0], order[1]);
  }
  if (dot(ac, ac) == dot(ab, ab)) {
    ASSERT_LT(order[1], order[2]);
  }

  const WideVec normal = cross(ab, ac);
  const Real squared = static_cast<Real>(dot(normal, normal)), length = std::sqrt(squared);
  const int exponent_u = static_cast<int>(r.exponent_u) - contract::kExponentBias;
  const int exponent_v = static_cast<int>(r.exponent_v) - contract::kExponentBias;
  ASSERT_LE(r.exponent_u, static_cast<std::uint32_t>(contract::kExponentMax));
  ASSERT_GE(r.exponent_u, r.exponent_v);
  expect_row("u", cross(ac, normal), squared, exponent_u, a, r.u, r.offset_u);
  expect_row("v", cross(normal, ab), squared, exponent_v, a, r.v, r.offset_v);
  expect_row("n", normal, length / kMost * 0x1p24L, 0, a, r.n, r.offset_n);

  // Norms before rounding: the largest power-of-two scaling that stays below kMost. A hair of slack where the bound is
  // met exactly.
  const Real norm_u = std::sqrt(static_cast<Real>(dot(ac, ac))) / length * std::ldexp(Real{1}, 24 - exponent_u);
  const Real norm_v = std::sqrt(static_cast<Real>(dot(ab, ab))) / length * std::ldexp(Real{1}, 24 - exponent_v);
  for (const Real norm : {norm_u, norm_v}) {
    ASSERT_LE(norm, kMost * (1 + 0x1p-50L));
    ASSERT_GT(norm, kMost / 2 * (1 - 0x1p-50L));
  }
  for (const auto& row : {r.u, r.v, r.n}) {
    std::int64_t sum = 0;
    for (std::int64_t x : row) sum += x * x;
    ASSERT_LT(sum, std::int64_t{1} << 52) << "a stored row is inside the unit ball";
  }
}

std::string describe_triangle(const std::array<GridPoint, 3>& v) {
  std::string text;
  for (const GridPoint& p : v)
    text += " (" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
  return text;
}

void expect_exact(const std::array<GridPoint, 3>& vertices, std::uint32_t id = 7) {
  SCOPED_TRACE(describe_triangle(vertices));
  expect_exact_record(GridTriangle{vertices, id});
}

TEST(UnitTriangle, RowsAreTheExactOnesRounded) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto any = [&](std::int64_t size, const GridPoint& c = GridPoint(0)) {
    GridPoint p;
    for (int k = 0; k < 3; ++k)
      p[k] =
          static_cast<std::int32_t>(std::clamp<std::int64_t>(c[k] + random.integer(-size, size), -kGridOne, kGridOne));
    return p;
  };
  int checked = 0;
  for (int i = 0; i < 60000 && !HasFatalFailure(); ++i) {
    const std::int64_t size = std::int64_t{1} << random.integer(0, 24), small = std::int64_t{1} << random.integer(0, 8);
    const GridPoint c = any(kGridOne);
    std::array<GridPoint, 3> v;
    switch (i % 4) {
      case 0:
        v = {any(kGridOne), any(kGridOne), any(kGridOne)};
        break;
      case 1:
        v = {any(size, c), any(size, c), any(size, c)};
        break;
      case 2:
        v = {c, any(kGridOne), any(small, c)};
        break;    // needle
      default: {  // sliver: the third vertex near the opposite edge
        const GridPoint d = any(kGridOne);
        const double f = random.real(0, 1);
        v = {c, d, any(small, GridPoint(glm::dvec3(c) * f + glm::dvec3(d) * (1 - f)))};
      }
    }
    std::swap(v[0], v[random.below(3)]);
    if (!has_area(v)) continue;
    ++checked;
    expect_exact(v, static_cast<std::uint32_t>(random.bits()));
  }
  EXPECT_GT(checked, 50000);
}

TEST(UnitTriangle, ExtremesOfTheGrid) {
  const std::int32_t one = kGridOne;
  expect_exact({GridPoint(-one, -one, -one), GridPoint(one, one, -one), GridPoint(-one, one, one)});
  expect_exact({GridPoint(-one, -one, -one), GridPoint(one, one, one), GridPoint(-one, one, -one)});
  expect_exact({GridPoint(0, 0, 0), GridPoint(1, 0, 0), GridPoint(0, 1, 0)});
  expect_exact({GridPoint(one, one, one), GridPoint(one - 1, one, one), GridPoint(one, one, one - 1)});
  expect_exact({GridPoint(-one, -one, -one), GridPoint(one, one, one), GridPoint(one, one, one - 1)});
  // Neighbours in the Fibonacci sequence span one unit of area: the flattest triangle there is, spread over the box.
  std::int64_t f = 1, g = 1;
  while (f + g <= 2 * one) f = std::exchange(g, f + g);
  const GridPoint corner(-one, -one, 0);
  expect_exact({corner, corner + GridPoint(g, f, 0), corner + GridPoint(f, g - f, 0)});
  // The steepest exponent: the longest sides there are over the least area.
  expect_exact({GridPoint(-one, -one, -one), GridPoint(0, 0, 0), GridPoint(one, one, one - 1)});
}

TEST(UnitTriangle, EqualEdgesKeepTheOrderOfTheFile) {
  const GridPoint a(0, 0, 0), b(1 << 20, 0, 0), c(0, 1 << 20, 0), d(0, 0, 1 << 20);
  std::array<int, 3> order;
  make_unit_triangle({{b, c, d}, 0}, &order);
  EXPECT_EQ(order, (std::array<int, 3>{0, 1, 2})) << "all edges equal";
  make_unit_triangle({{a, b, c}, 0}, &order);
  EXPECT_EQ(order, (std::array<int, 3>{0, 1, 2})) << "hypotenuse opposite to the first vertex";
  make_unit_triangle({{b, a, c}, 0}, &order);
  EXPECT_EQ(order, (std::array<int, 3>{1, 0, 2}));
  make_unit_triangle({{b, c, a}, 0}, &order);
  EXPECT_EQ(order, (std::array<int, 3>{2, 0, 1}));
}

TEST(UnitTriangle, MapsItsVerticesToTheUnitTriangle) {
  Random random(test_seed());
  for (int i = 0; i < 1000; ++i) {
    const GridTriangle t{
        {random_point(random, kGridMost), random_point(random, kGridMost), random_point(random, kGridMost)}, 0};
    std::array<int, 3> order;
    const contract::TriangleRecord r = make_unit_triangle(t, &order);
    const auto apply = [&](const std::array<std::int32_t, 3>& row, std::int32_t offset, std::uint32_t exponent,
                           int vertex) {
      double sum = std::ldexp(offset, -29);
      for (int k = 0; k < 3; ++k) sum += std::ldexp(row[k], -26) * std::ldexp(t.vertices[order[vertex]][k], -24);
      return std::ldexp(sum, static_cast<int>(exponent) - contract::kExponentBias);
    };
    const double tolerance = std::ldexp(0x1p-25, static_cast<int>(r.exponent_u));
    for (int vertex = 0; vertex < 3; ++vertex) {
      EXPECT_NEAR(apply(r.u, r.offset_u, r.exponent_u, vertex), vertex == 1, tolerance);
      EXPECT_NEAR(apply(r.v, r.offset_v, r.exponent_v, vertex), vertex == 2, tolerance);
      EXPECT_NEAR(apply(r.n, r.offset_n, contract::kExponentBias, vertex), 0.0, 0x1p-25);
    }
  }
}

}  // namespace
}  // namespace retrace
