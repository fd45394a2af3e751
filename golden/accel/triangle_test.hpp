// The triangle test that all structures of the lab share, in double precision.
//
//   A, B, C = vertices - origin;  e = C - B, A - C, B - A
//   U = d . ((C + B) x e_a), V = d . ((A + C) x e_b), W = d . ((B + A) x e_c)      edge functions (Pluecker products)
//   hit if U, V, W are all >= 0 or all <= 0;  t = (U tA + V tB + W tC) / (U + V + W), tX = X . d / d . d
//
// Properties the structures rely on:
// - An edge function of a shared edge is, in floating point, exactly the negative of the neighbour's: sum and
//   products are symmetric, the edge changes sign (no contraction to FMA, see scripts/cmake). As zero counts for
//   both, no ray slips between.
// - t is a convex combination, so the hit lies in the triangle's extent along the ray however bad the rounding.
// - The error of an edge function is below 2^-48 m s (m, s: largest component of A, B, C and of the edges). A
//   determinant below kGrazing m s^2 is a miss (the ray lies in the triangle's plane to 1e-8 or so), so a reported
//   point is within 2^-20 s of the triangle: half of kMargin, by which every structure widens its cells.
// Source: Embree's Pluecker test (kernels/geometry/triangle_intersector_pluecker.h); A. Woop et al., Watertight
// ray/triangle intersection, JCGT 2(1), 2013, for the argument on shared edges.
#pragma once
#include <algorithm>
#include <cmath>

#include "accel.hpp"

namespace retrace::accel {

inline constexpr double kGrazing = 0x1p-26;

/// Whether (t, id) replaces the hit: nearer, or as near with a lower id.
inline bool closer(double t, std::uint32_t id, const Hit& best) { return t < best.t || (t == best.t && id < best.id); }

/// Tests one triangle; on a hit that is `closer`, replaces `best` and returns true. best.t bounds the search: start
/// with t_max.
inline bool intersect(const Ray& ray, const Triangle& triangle, Hit& best) {
  const glm::dvec3 &d = ray.direction, a = triangle.vertices[0] - ray.origin, b = triangle.vertices[1] - ray.origin,
                   c = triangle.vertices[2] - ray.origin;
  const glm::dvec3 ea = c - b, eb = a - c, ec = b - a;
  const double u = glm::dot(d, glm::cross(c + b, ea));
  const double v = glm::dot(d, glm::cross(a + c, eb));
  if ((u < 0.0 && v > 0.0) || (u > 0.0 && v < 0.0)) return false;
  const double w = glm::dot(d, glm::cross(b + a, ec));
  if (!((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0))) return false;
  const double det = u + v + w;
  const auto largest = [](const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z) {
    const glm::dvec3 m = glm::max(glm::max(glm::abs(x), glm::abs(y)), glm::abs(z));
    return std::max(m.x, std::max(m.y, m.z));
  };
  const double m = largest(a, b, c), s = largest(ea, eb, ec), dd = glm::dot(d, d);
  if (!(std::abs(det) > kGrazing * m * s * s * std::sqrt(dd))) return false;
  const double t = (u * glm::dot(a, d) + v * glm::dot(b, d) + w * glm::dot(c, d)) / (det * dd);
  if (!(t >= 0.0) || !closer(t, triangle.id, best)) return false;
  best = {t, triangle.id, v / det, w / det};
  return true;
}

}  // namespace retrace::accel
