// tri_test, golden: the closed triangle, decided exactly.
//
//   p = vertex 0 - o, e1 and e2 the edges to vertices 1 and 2, n = e1 x e2
//   dn = n . d,  h = n . p,  U = -(d x p) . e2,  V = (d x p) . e1,  W = dn - U - V;  t = h / dn, u = U / dn, v = V / dn
//   a hit if dn != 0, U, V, W >= 0 and 0 <= t <= t_max, all as integers decide
//
// Double precision decides where its error bound allows, golden/engine/exact.hpp where it does not. Vertex, edges, normal, origin and
// direction are exact in doubles, so only the products of the formulas above round: with vertices in [-1, 1], E = the larger of
// |e1|_1, |e2|_1, and any origin and direction of their formats, U, V and W are off by less than 2^-45 E, h and t_max dn together by less
// than 2^-47 |n|_1, and t by less than 2^-37 where dn >= 2^-10 |n|_1 (docs/error-bounds.md, "Golden").
// Counterparts: hls/stages/tri_test.hpp, rtl/isect/rt_tri_test.sv. Source: Moeller & Trumbore 1997; for the filter Shewchuk 1997.
#pragma once
#include <algorithm>
#include <cassert>
#include <cmath>
#include <compare>

#include "golden/engine/exact.hpp"
#include "golden/scene/geometry.hpp"
#include "ray_setup.hpp"

namespace retrace::golden {

/// What is wanted of a triangle, in grid units. The first cache line is enough for one that lies behind the origin or beyond the best hit.
struct alignas(64) Triangle {
  glm::dvec3 n, vertex;
  double slack_depth;  ///< 2^-45 |n|_1
  alignas(64) glm::dvec3 e1;
  glm::dvec3 e2;
  double slack_edge;  ///< 2^-45 E
  std::uint32_t id;

  std::array<exact::Vec, 3> codes() const {
    std::array<exact::Vec, 3> result;
    for (int axis = 0; axis < 3; ++axis) {
      const auto code = [](double x) { return static_cast<std::int64_t>(x * (1 << contract::kPositionFrac)); };
      const auto i = static_cast<std::size_t>(axis);
      result[0][i] = code(vertex[axis]);
      result[1][i] = result[0][i] + code(e1[axis]);
      result[2][i] = result[0][i] + code(e2[axis]);
    }
    return result;
  }
};
static_assert(sizeof(Triangle) == 128);

/// `order`: file index of the record's vertices 0, 1, 2, as make_unit_triangle gives it; u belongs to vertex 1, v to vertex 2.
inline Triangle make_triangle(const GridTriangle& triangle, const std::array<int, 3>& order) {
  constexpr double kUnit = 1.0 / (1 << contract::kPositionFrac), kSlack = 0x1p-45;
  const auto norm = [](const glm::dvec3& x) { return std::abs(x.x) + std::abs(x.y) + std::abs(x.z); };
  const GridPoint a = triangle.vertices[static_cast<std::size_t>(order[0])];
  for (const GridPoint& p : triangle.vertices)
    for (int axis = 0; axis < 3; ++axis) assert(std::abs(p[axis]) <= 1 << contract::kPositionFrac);
  Triangle result;
  result.vertex = glm::dvec3(a) * kUnit;
  result.e1 = glm::dvec3(triangle.vertices[static_cast<std::size_t>(order[1])] - a) * kUnit;
  result.e2 = glm::dvec3(triangle.vertices[static_cast<std::size_t>(order[2])] - a) * kUnit;
  result.n = glm::cross(result.e1, result.e2);
  result.slack_depth = kSlack * norm(result.n);
  result.slack_edge = kSlack * std::max(norm(result.e1), norm(result.e2));
  result.id = triangle.id;
  return result;
}

/// A hit as long as there may be a nearer one; u and v are still multiplied by dz. The weights are sound: 0 <= edge_u, edge_v <= dz.
struct Candidate {
  double t, edge_u, edge_v, dz;
  const Triangle* triangle = nullptr;
};

/// Bound of the error of Candidate::t.
inline constexpr double kDepthError = 0x1p-37;
/// dn below this many slack_depth, 2^-10 |n|_1, is decided in integers: the quotient h / dn would be too coarse.
inline constexpr double kGrazing = 0x1p35;

/// Where the filter of tri_test cannot decide, or the ray grazes the plane.
[[gnu::noinline, gnu::cold]] inline bool tri_test_exactly(const Triangle& triangle, const RayState& ray,
                                                          Candidate& candidate) {
  const glm::dvec3 moment = glm::cross(ray.direction, triangle.vertex - ray.origin);
  const double u = -glm::dot(moment, triangle.e2), v = glm::dot(moment, triangle.e1);
  const double w = glm::dot(triangle.n, ray.direction) - u - v;
  // Rays in the plane of a mesh come here for every triangle on their way; signs that differ are a miss from either side.
  if (std::min({u, v, w}) < -triangle.slack_edge && std::max({u, v, w}) > triangle.slack_edge) return false;
  const contract::RayRecord codes = ray.codes();
  const exact::Crossing crossing = exact::intersect(codes, triangle.codes());
  if (!crossing.inside() || !crossing.ahead() || !crossing.before(codes.t_max)) return false;
  candidate = {crossing.t(), static_cast<double>(crossing.edge[2]), static_cast<double>(crossing.edge[0]),
               static_cast<double>(crossing.dn), &triangle};
  return true;
}

/// True if the ray meets the triangle and 0 <= t <= t_max, but for hits whose t lies beyond `limit` by more than kDepthError, of which it may
/// say false: `limit` is the t of the best candidate, or t_max.
inline bool tri_test(const Triangle& triangle, const RayState& ray, double limit, Candidate& candidate) {
  const glm::dvec3 p = triangle.vertex - ray.origin;
  double dn = glm::dot(triangle.n, ray.direction), height = glm::dot(triangle.n, p);
  const double side = dn < 0.0 ? -1.0 : 1.0;
  dn *= side;
  height *= side;
  // Where the sign of dn is in doubt, |h / dn| is above any t_max unless |h| is below the slack: the decision stands.
  if (height < -triangle.slack_depth || height > (limit + kDepthError) * dn + triangle.slack_depth) return false;
  if (dn < kGrazing * triangle.slack_depth) [[unlikely]]
    return tri_test_exactly(triangle, ray, candidate);
  const glm::dvec3 moment = glm::cross(ray.direction, p);
  const double slack = triangle.slack_edge, u = -side * glm::dot(moment, triangle.e2);
  if (u < -slack || u > dn + slack) return false;
  const double v = side * glm::dot(moment, triangle.e1), least = std::min(v, dn - u - v);
  if (least < -slack) return false;
  if (std::min(u, least) < slack || std::min(height, ray.t_max * dn - height) < triangle.slack_depth) [[unlikely]]
    return tri_test_exactly(triangle, ray, candidate);
  candidate = {height / dn, u, v, dn, &triangle};
  return true;
}

[[gnu::noinline, gnu::cold]] inline bool is_nearer_exactly(const Candidate& candidate, const Candidate& best,
                                                           const RayState& ray) {
  const contract::RayRecord codes = ray.codes();
  const auto order = exact::compare_depth(exact::intersect(codes, candidate.triangle->codes()),
                                          exact::intersect(codes, best.triangle->codes()));
  return std::is_lt(order) || (std::is_eq(order) && candidate.triangle->id < best.triangle->id);
}

/// Whether a candidate comes before another: nearer, or as near with the lower id.
inline bool is_nearer(const Candidate& candidate, const Candidate& best, const RayState& ray) {
  if (best.triangle == nullptr) return true;
  if (std::abs(candidate.t - best.t) > 2 * kDepthError) [[likely]]
    return candidate.t < best.t;
  return is_nearer_exactly(candidate, best, ray);
}

}  // namespace retrace::golden
