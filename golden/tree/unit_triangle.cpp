// Unit-triangle transform: three affine rows that map a triangle to u, v and distance from its plane (Arenberg 1988;
// Woop 2004), stored as docs/number-contract.md, record `triangle`, says. Edges and normal are exact integers; the rows
// are doubles until they are rounded.
//
// Error: the unrounded rows are off by less than 2^-48 of their norm, so a stored coefficient is within 2^-27 + 2^-48
// and a stored offset within 2^-30 + 2^-47 of the exact one.
#include <cassert>
#include <cmath>

#include "kd_builder.hpp"

namespace retrace {
namespace {

using contract::kCoefficientFrac;
using contract::kExponentBias;
using contract::kExponentMax;
using contract::kOffsetFrac;
using contract::kPositionFrac;

/// Largest norm of a stored row before rounding: three coefficients rounded up stay inside the unit ball.
constexpr double kMaxNorm = 1.0 - 0x1p-22;

struct Vec {
  std::int64_t x, y, z;
};

Vec difference(const GridPoint& a, const GridPoint& b) {
  return {std::int64_t{a.x} - b.x, std::int64_t{a.y} - b.y, std::int64_t{a.z} - b.z};
}
/// |a| < 2^26 and |b| < 2^26: components stay below 2^53.
Vec cross(const Vec& a, const Vec& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
std::int64_t squared_length(const Vec& a) { return a.x * a.x + a.y * a.y + a.z * a.z; }

glm::dvec3 to_double(const Vec& a) {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

struct Row {
  std::array<std::int32_t, 3> coefficient;
  std::int32_t offset;
};

/// Rounds a row of norm <= kMaxNorm, coefficients in units of 1 / position, and its constant -(row . a).
Row round_row(const glm::dvec3& row, const glm::dvec3& a) {
  Row result;
  for (int i = 0; i < 3; ++i)
    result.coefficient[i] = static_cast<std::int32_t>(std::round(std::ldexp(row[i], kCoefficientFrac)));
  const double constant = -(row.x * a.x + row.y * a.y + row.z * a.z);
  result.offset = static_cast<std::int32_t>(std::round(std::ldexp(constant, kOffsetFrac)));
  return result;
}

/// Smallest exponent e with norm * 2^-e <= kMaxNorm.
int row_exponent(double norm) {
  int exponent;
  const double mantissa = std::frexp(norm, &exponent);  // [1/2, 1)
  return mantissa <= kMaxNorm ? exponent : exponent + 1;
}

}  // namespace

contract::TriangleRecord make_unit_triangle(const GridTriangle& triangle, std::array<int, 3>* order) {
  const auto& p = triangle.vertices;
  // The height of a vertex is twice the area over the edge opposite to it: the longest edge faces the smallest height.
  std::array<std::int64_t, 3> opposite;
  for (int i = 0; i < 3; ++i) opposite[i] = squared_length(difference(p[(i + 1) % 3], p[(i + 2) % 3]));
  std::array<int, 3> index{0, 1, 2};
  const auto swap_if_shorter = [&](int i, int j) {
    if (opposite[index[i]] < opposite[index[j]]) std::swap(index[i], index[j]);
  };
  // Stable insertion sort by descending edge length, so ties keep the file's order.
  swap_if_shorter(0, 1);
  swap_if_shorter(1, 2);
  swap_if_shorter(0, 1);
  if (order != nullptr) *order = index;

  const GridPoint &a = p[index[0]], &b = p[index[1]], &c = p[index[2]];
  const Vec ab = difference(b, a), ac = difference(c, a);
  const Vec normal_exact = cross(ab, ac);
  const glm::dvec3 normal = to_double(normal_exact);
  const double normal_squared = glm::dot(normal, normal), normal_length = std::sqrt(normal_squared);
  assert(normal_squared > 0 && "snap() drops triangles without area");

  // |grad u| = |ac| / |normal|, from exact squares: equal edges give equal exponents, and a longer edge never a smaller
  // one.
  const double to_position = std::ldexp(1.0, kPositionFrac);
  const double norm_u = std::sqrt(static_cast<double>(squared_length(ac))) / normal_length * to_position;
  const double norm_v = std::sqrt(static_cast<double>(squared_length(ab))) / normal_length * to_position;
  const int exponent_u = row_exponent(norm_u), exponent_v = row_exponent(norm_v);
  assert(exponent_u >= exponent_v);
  assert(exponent_v + kExponentBias >= 0 && exponent_u + kExponentBias <= kExponentMax);

  const glm::dvec3 gradient_u = glm::cross(to_double(ac), normal) * (to_position / normal_squared);
  const glm::dvec3 gradient_v = glm::cross(normal, to_double(ab)) * (to_position / normal_squared);
  const glm::dvec3 origin = glm::dvec3(a) / to_position;
  const Row u = round_row(gradient_u * std::ldexp(1.0, -exponent_u), origin);
  const Row v = round_row(gradient_v * std::ldexp(1.0, -exponent_v), origin);
  const Row n = round_row(normal * (kMaxNorm / normal_length), origin);

  contract::TriangleRecord record;
  record.u = u.coefficient;
  record.v = v.coefficient;
  record.n = n.coefficient;
  record.offset_u = u.offset;
  record.offset_v = v.offset;
  record.offset_n = n.offset;
  record.exponent_u = static_cast<std::uint32_t>(exponent_u + kExponentBias);
  record.exponent_v = static_cast<std::uint32_t>(exponent_v + kExponentBias);
  record.id = triangle.id;
  assert(record.fits());
  return record;
}

}  // namespace retrace
