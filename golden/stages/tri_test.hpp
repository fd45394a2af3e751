// tri_test in double: the unit-triangle test without tolerance; what is true, up to 2^-52.
// Counterparts: hls/stages/tri_test.hpp, rtl/stages/rt_tri_test.sv. Source: Arenberg 1988; Woop et al. 2005, section 3.2.
#pragma once
#include <cmath>

#include "golden/scene/geometry.hpp"
#include "ray_setup.hpp"

namespace retrace::golden {

/// Rows of the transform to the unit triangle; u belongs to vertex 1, v to vertex 2 of `make_unit_triangle`'s order.
struct alignas(32) UnitTriangle {
  glm::dvec3 u, v, n;
  double offset_u, offset_v, offset_n;
  std::uint32_t id;
};

/// `order`: file index of the record's vertices 0, 1, 2. Normal `n` has unit length.
inline UnitTriangle make_unit_triangle(const GridTriangle& triangle, const std::array<int, 3>& order) {
  constexpr double kUnit = 1.0 / (1 << contract::kPositionFrac);
  const glm::dvec3 a = glm::dvec3(triangle.vertices[order[0]]) * kUnit;
  const glm::dvec3 e1 = glm::dvec3(triangle.vertices[order[1]] - triangle.vertices[order[0]]) * kUnit;
  const glm::dvec3 e2 = glm::dvec3(triangle.vertices[order[2]] - triangle.vertices[order[0]]) * kUnit;
  // Differences are exact, products of two 26-bit codes nearly so: the normal is good to 2^-52 even for slivers.
  const glm::dvec3 normal = glm::cross(e1, e2);
  const double square = glm::dot(normal, normal);
  UnitTriangle unit;
  unit.u = glm::cross(e2, normal) / square;
  unit.v = glm::cross(normal, e1) / square;
  unit.n = normal / std::sqrt(square);
  unit.offset_u = -glm::dot(unit.u, a);
  unit.offset_v = -glm::dot(unit.v, a);
  unit.offset_n = -glm::dot(unit.n, a);
  unit.id = triangle.id;
  return unit;
}

/// What hit_finish needs: u and v are still multiplied by dz.
struct Candidate {
  double t, edge_u, edge_v, dz;
};

/// True if the ray meets the triangle with 0 <= t <= limit; u, v, 1 - u - v >= 0.
inline bool tri_test(const UnitTriangle& triangle, const RayState& ray, double limit, Candidate& candidate) {
  double oz = glm::dot(triangle.n, ray.origin) + triangle.offset_n;
  double dz = glm::dot(triangle.n, ray.direction);
  if (dz < 0.0) {
    dz = -dz;
    oz = -oz;
  }
  if (oz > 0.0 || -oz > limit * dz || dz == 0.0) return false;
  const double ou = glm::dot(triangle.u, ray.origin) + triangle.offset_u;
  const double u = ou * dz - oz * glm::dot(triangle.u, ray.direction);
  if (u < 0.0 || u > dz) return false;
  const double ov = glm::dot(triangle.v, ray.origin) + triangle.offset_v;
  const double v = ov * dz - oz * glm::dot(triangle.v, ray.direction);
  if (v < 0.0 || u + v > dz) return false;
  const double t = -oz / dz;
  if (t > limit) return false;
  candidate = {t, u, v, dz};
  return true;
}

}  // namespace retrace::golden
