// Building blocks of the generators: indexed triangle meshes with normals and, where a texture makes sense, texture
// coordinates. Lengths are metres, y is up, triangles are counter-clockwise seen from outside. Positions come from
// double arithmetic, rounded once.
#pragma once
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <random>
#include <span>
#include <vector>

#include "golden/scene/scene.hpp"

namespace retrace::shapes {

/// Uniform numbers from std::mt19937_64 by exact arithmetic: the distributions of the standard library differ between
/// libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(uniform() * n); }
  glm::dvec3 direction();

 private:
  std::mt19937_64 engine_;
};

/// Smooth noise in [-1, 1] on a lattice of unit cells, and sums of octaves of it.
double noise(const glm::dvec3& p, std::uint32_t seed);
double fractal_noise(glm::dvec3 p, int octaves, std::uint32_t seed);

/// Adds `part`, transformed; normals by the inverse transpose, winding kept for mirroring transforms by flipping.
void append(Primitive& to, const Primitive& part, const glm::dmat4& transform = glm::dmat4(1.0));

glm::dmat4 translate(double x, double y, double z);
glm::dmat4 rotate_y(double radians);
glm::dmat4 rotate(double radians, const glm::dvec3& axis);
glm::dmat4 scale(double x, double y, double z);

/// Points of a surface over [0, 1]^2: `columns` x `rows` cells, position f(u, v), outside where (df/du x df/dv) points.
/// Normals by differences of f. `wrap_u`: column `columns` is column 0 (positions agree bit for bit).
Primitive surface(int columns, int rows, const std::function<glm::dvec3(double, double)>& f, bool wrap_u = false);

/// A parallelogram of columns x rows cells with its normal along u x v; texture coordinates 0..repeat.
Primitive quad(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v, int columns = 1, int rows = 1,
               const glm::dvec2& repeat = glm::dvec2(1.0));
/// Axis-aligned box with flat faces.
Primitive box(const glm::dvec3& lower, const glm::dvec3& upper);
/// Box with rounded edges, `cells` per radius on every edge.
Primitive rounded_box(const glm::dvec3& lower, const glm::dvec3& upper, double radius, int cells);
/// Surface of revolution about y. `profile`: (radius, height) from bottom to top, outside to the right; smoothed by a
/// Catmull-Rom spline of `rows` steps, or taken as it stands if rows is 0. A point given twice in a row makes an edge.
Primitive lathe(std::span<const glm::dvec2> profile, int columns, int rows = 0);
Primitive sphere(double radius, int columns);
/// Tube along a curve over [0, 1] with a radius that may change; open at the ends unless `caps`.
Primitive tube(const std::function<glm::dvec3(double)>& curve, const std::function<double(double)>& radius, int columns,
               int rows, bool caps);

/// Closed, shared vertices, 12 cells^2 triangles: a cube's faces blown up to a sphere. `radius` by unit direction.
Primitive cube_sphere(int cells, const std::function<double(const glm::dvec3&)>& radius);
/// Closed, shared vertices, 2 * along * around triangles: a tube along the (p, q) torus knot.
Primitive torus_knot(int p, int q, double tube_radius, int along, int around);

/// Normals from the triangles, weighted by area and angle-free; vertices that share a position keep their own.
void smooth_normals(Primitive& primitive);

}  // namespace retrace::shapes
