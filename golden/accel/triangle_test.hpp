// The triangle test that all structures of the lab share, in double precision.
//
//   A, B, C = vertices - origin;  e = C - B, A - C, B - A
//   U = d . ((C + B) x e_a), V = d . ((A + C) x e_b), W = d . ((B + A) x e_c)      edge functions (Pluecker products)
//   hit if U, V, W are all >= 0 or all <= 0;  t = (U tA + V tB + W tC) / (U + V + W), tX = X . d / d . d
//
// Properties the structures rely on:
// - The signs of the edge functions are those of the exact ones on the position grid: what is smaller than its rounding error, below 2^-48 m s (m, s:
//   largest component of A, B, C and of the edges), is computed again in 113 bits, in which grid coordinates lose none. As zero counts for both
//   sides, no ray slips between triangles, at an edge or at a vertex.
// - t is a convex combination, so the hit lies in the triangle's extent along the ray however bad the rounding.
// - A reported point is within 2^-20 of the triangle, half of kMargin, by which every structure widens its cells: where the determinant is so small
//   that the rounding of the weights could move t further (the ray nearly lies in the triangle's plane), the wide values are taken too.
// Source: Embree's Pluecker test (kernels/geometry/triangle_intersector_pluecker.h); A. Woop et al., Watertight
// ray/triangle intersection, JCGT 2(1), 2013, for the argument on shared edges.
#pragma once
#include <algorithm>
#include <cmath>

#include "accel.hpp"

namespace retrace::accel {

inline constexpr double kGrazing = 0x1p-26;

namespace detail {

/// The edge function of p and q, rounded once where coordinates are those of the grid (82 bits). It changes its sign, and nothing else, with the
/// order of p and q.
inline double exact_edge(const glm::dvec3& d, const glm::dvec3& p, const glm::dvec3& q) {
  using Wide = __float128;
  const auto cross = [&](int i, int j) { return static_cast<Wide>(p[i]) * q[j] - static_cast<Wide>(p[j]) * q[i]; };
  return static_cast<double>(2 * (d.x * cross(1, 2) + d.y * cross(2, 0) + d.z * cross(0, 1)));
}

}  // namespace detail

/// Whether (t, id) replaces the hit: nearer, or as near with a lower id.
inline bool closer(double t, std::uint32_t id, const Hit& best) { return t < best.t || (t == best.t && id < best.id); }

/// Tests one triangle; on a hit that is `closer`, replaces `best` and returns true. best.t bounds the search: start
/// with t_max.
inline bool intersect(const Ray& ray, const Triangle& triangle, Hit& best) {
  const glm::dvec3 &d = ray.direction, a = triangle.vertices[0] - ray.origin, b = triangle.vertices[1] - ray.origin,
                   c = triangle.vertices[2] - ray.origin;
  const glm::dvec3 ea = c - b, eb = a - c, ec = b - a;
  double u = glm::dot(d, glm::cross(c + b, ea));
  double v = glm::dot(d, glm::cross(a + c, eb));
  double w = glm::dot(d, glm::cross(b + a, ec));
  const auto largest = [](const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z) {
    const glm::dvec3 m = glm::max(glm::max(glm::abs(x), glm::abs(y)), glm::abs(z));
    return std::max(m.x, std::max(m.y, m.z));
  };
  const double m = largest(a, b, c), s = largest(ea, eb, ec), dd = glm::dot(d, d);
  const auto inside = [&] { return (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0); };
  const double nearest = std::min(std::abs(u), std::min(std::abs(v), std::abs(w)));
  const bool signs_are_sure = nearest > 0x1p-48 * m * s * std::sqrt(dd);
  if (signs_are_sure && !inside()) return false;
  const double ta = glm::dot(a, d), tb = glm::dot(b, d), tc = glm::dot(c, d);
  const double extent = std::max(ta, std::max(tb, tc)) - std::min(ta, std::min(tb, tc));
  if (!signs_are_sure || !(std::abs(u + v + w) > kGrazing * m * s * extent)) {
    u = detail::exact_edge(d, b, c), v = detail::exact_edge(d, c, a), w = detail::exact_edge(d, a, b);
    if (!inside()) return false;
  }
  const double det = u + v + w;
  if (det == 0.0) return false;  // the ray lies in the triangle's plane, or the triangle has no area
  const double t = (u * ta + v * tb + w * tc) / (det * dd);
  if (!(t >= 0.0) || !closer(t, triangle.id, best)) return false;
  best = {t, triangle.id, v / det, w / det};
  return true;
}

}  // namespace retrace::accel
