// Shapes, see shapes.hpp.
// Noise: K. Perlin, "Improving noise", SIGGRAPH 2002.
#include "scenes/shapes.hpp"

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <unordered_map>

namespace retrace::shapes {
namespace {

constexpr double kPi = glm::pi<double>();

glm::dvec3 unit(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : glm::dvec3(0, 1, 0);
}

std::uint32_t hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9u ^ static_cast<std::uint32_t>(x) * 0x85ebca6bu ^
                    static_cast<std::uint32_t>(y) * 0xc2b2ae35u ^ static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  return h ^ h >> 15;
}

double gradient(int x, int y, int z, const glm::dvec3& d, std::uint32_t seed) {
  const std::uint32_t h = hash(x, y, z, seed) % 12;
  const double sign_a = h & 1 ? -1 : 1, sign_b = h & 2 ? -1 : 1;
  return h < 4 ? sign_a * d.x + sign_b * d.y : h < 8 ? sign_a * d.x + sign_b * d.z : sign_a * d.y + sign_b * d.z;
}

void add_triangle(Primitive& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const glm::vec3 &x = p.positions[a], &y = p.positions[b], &z = p.positions[c];
  if (x != y && y != z && z != x) p.triangles.push_back({a, b, c});
}

}  // namespace

glm::dvec3 Random::direction() {
  const double z = uniform(-1, 1), a = uniform(0, 2 * kPi), r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(a), r * std::sin(a), z};
}

double noise(const glm::dvec3& p, std::uint32_t seed) {
  const glm::dvec3 cell = glm::floor(p), f = p - cell;
  const glm::dvec3 s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
  const int x = static_cast<int>(cell.x), y = static_cast<int>(cell.y), z = static_cast<int>(cell.z);
  double corner[2][2][2];
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) corner[i][j][k] = gradient(x + i, y + j, z + k, f - glm::dvec3(i, j, k), seed);
  const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
  double edge[2];
  for (int k = 0; k < 2; ++k)
    edge[k] = mix(mix(corner[0][0][k], corner[1][0][k], s.x), mix(corner[0][1][k], corner[1][1][k], s.x), s.y);
  return mix(edge[0], edge[1], s.z);
}

double fractal_noise(glm::dvec3 p, int octaves, std::uint32_t seed) {
  double sum = 0, weight = 1, total = 0;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * noise(p, seed + static_cast<std::uint32_t>(i));
    total += weight;
    weight *= 0.5;
    p *= 2.0;
  }
  return sum / total;
}

void append(Primitive& to, const Primitive& part, const glm::dmat4& transform) {
  const auto base = static_cast<std::uint32_t>(to.positions.size());
  const glm::dmat3 normal = glm::inverseTranspose(glm::dmat3(transform));
  const bool mirrored = glm::determinant(glm::dmat3(transform)) < 0;
  for (const glm::vec3& p : part.positions)
    to.positions.emplace_back(glm::vec3(transform * glm::dvec4(glm::dvec3(p), 1.0)));
  for (const glm::vec3& n : part.normals) to.normals.emplace_back(glm::vec3(unit(normal * glm::dvec3(n))));
  to.texcoords[0].insert(to.texcoords[0].end(), part.texcoords[0].begin(), part.texcoords[0].end());
  // glTF wants an attribute for all vertices or for none.
  if (!to.texcoords[0].empty()) to.texcoords[0].resize(to.positions.size(), glm::vec2(0.0f));
  for (const glm::uvec3& t : part.triangles)
    to.triangles.push_back(mirrored ? glm::uvec3(base + t.x, base + t.z, base + t.y)
                                    : glm::uvec3(base + t.x, base + t.y, base + t.z));
}

glm::dmat4 translate(double x, double y, double z) { return glm::translate(glm::dmat4(1.0), glm::dvec3(x, y, z)); }
glm::dmat4 rotate_y(double radians) { return rotate(radians, {0, 1, 0}); }
glm::dmat4 rotate(double radians, const glm::dvec3& axis) { return glm::rotate(glm::dmat4(1.0), radians, axis); }
glm::dmat4 scale(double x, double y, double z) { return glm::scale(glm::dmat4(1.0), glm::dvec3(x, y, z)); }

Primitive surface(int columns, int rows, const std::function<glm::dvec3(double, double)>& f, bool wrap_u) {
  Primitive p;
  const auto at = [&](int c, int r) { return static_cast<std::uint32_t>(r * (columns + 1) + c); };
  std::vector<glm::dvec3> points;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double u = static_cast<double>(c) / columns, v = static_cast<double>(r) / rows;
      points.push_back(wrap_u && c == columns ? points[at(0, r)] : f(u, v));
      p.positions.emplace_back(points.back());
      p.texcoords[0].emplace_back(u, v);
    }
  std::vector<glm::dvec3> sums(points.size(), glm::dvec3(0.0));
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const std::uint32_t a = at(c, r), b = at(c + 1, r), d = at(c, r + 1), e = at(c + 1, r + 1);
      add_triangle(p, a, b, e);
      add_triangle(p, a, e, d);
      const glm::dvec3 n = glm::cross(points[e] - points[a], points[d] - points[b]);
      for (const std::uint32_t i : {a, b, d, e}) sums[i] += n;
    }
  for (int r = 0; r <= rows; ++r) {
    glm::dvec3 pole(0.0);
    bool is_pole = true;
    for (int c = 0; c <= columns; ++c) {
      pole += sums[at(c, r)];
      is_pole = is_pole && p.positions[at(c, r)] == p.positions[at(0, r)];
    }
    for (int c = 0; c <= columns; ++c) {
      glm::dvec3 n = is_pole ? pole : sums[at(c, r)];
      if (wrap_u && !is_pole && (c == 0 || c == columns)) n = sums[at(0, r)] + sums[at(columns, r)];
      p.normals.emplace_back(unit(n));
    }
  }
  return p;
}

Primitive quad(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v, int columns, int rows,
               const glm::dvec2& repeat) {
  Primitive p = surface(columns, rows, [&](double s, double t) { return corner + u * s + v * t; });
  p.normals.assign(p.positions.size(), glm::vec3(unit(glm::cross(u, v))));
  for (glm::vec2& t : p.texcoords[0]) t *= glm::vec2(repeat);
  return p;
}

Primitive box(const glm::dvec3& lower, const glm::dvec3& upper) {
  Primitive p;
  const glm::dvec3 d = upper - lower;
  const glm::dvec3 x(d.x, 0, 0), y(0, d.y, 0), z(0, 0, d.z);
  append(p, quad(lower, z, y));
  append(p, quad(lower + x + z, -z, y));
  append(p, quad(lower, x, z));
  append(p, quad(lower + y + z, x, -z));
  append(p, quad(lower + x, -x, y));
  append(p, quad(lower + z, x, y));
  return p;
}

Primitive rounded_box(const glm::dvec3& lower, const glm::dvec3& upper, double radius, int cells) {
  const glm::dvec3 half = (upper - lower) * 0.5, center = (upper + lower) * 0.5;
  const glm::dvec3 core = half - radius;
  // Places along an edge, from -half to half: arcs of equal steps in angle at both ends.
  const auto places = [&](double h) {
    std::vector<double> t;
    for (int i = 0; i <= cells; ++i) t.push_back(h - radius + radius * std::tan(kPi / 4 * i / cells));
    std::vector<double> all;
    for (std::size_t i = t.size(); i-- > 0;) all.push_back(-t[i]);
    all.insert(all.end(), t.begin(), t.end());
    return all;
  };
  Primitive p;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      const std::vector<double> us = places(half[a]), vs = places(half[b]);
      const auto base = static_cast<std::uint32_t>(p.positions.size());
      const auto columns = static_cast<std::uint32_t>(us.size());
      for (const double v : vs)
        for (const double u : us) {
          glm::dvec3 q;
          q[axis] = side * half[axis];
          q[a] = u;
          q[b] = v;
          const glm::dvec3 inner = glm::clamp(q, -core, core);
          const glm::dvec3 n = unit(q - inner);
          p.positions.emplace_back(center + inner + n * radius);
          p.normals.emplace_back(n);
          p.texcoords[0].emplace_back(u, v);
        }
      for (std::uint32_t r = 0; r + 1 < vs.size(); ++r)
        for (std::uint32_t c = 0; c + 1 < columns; ++c) {
          const std::uint32_t i = base + r * columns + c, j = i + columns;
          if (side > 0) {
            add_triangle(p, i, i + 1, j + 1);
            add_triangle(p, i, j + 1, j);
          } else {
            add_triangle(p, i, j + 1, i + 1);
            add_triangle(p, i, j, j + 1);
          }
        }
    }
  return p;
}

Primitive lathe(std::span<const glm::dvec2> profile, int columns, int rows) {
  std::vector<glm::dvec2> points;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    points.push_back(profile[i]);
    if (i + 1 == profile.size() || rows <= 1 || profile[i] == profile[i + 1]) continue;
    const glm::dvec2 p1 = profile[i], p2 = profile[i + 1];
    const glm::dvec2 p0 = i > 0 ? profile[i - 1] : p1, p3 = i + 2 < profile.size() ? profile[i + 2] : p2;
    for (int k = 1; k < rows; ++k) {
      const double t = static_cast<double>(k) / rows;
      glm::dvec2 p = 0.5 * (2.0 * p1 + (p2 - p0) * t + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t * t +
                            (3.0 * p1 - p0 - 3.0 * p2 + p3) * t * t * t);
      p.x = std::max(p.x, 0.0);
      points.push_back(p);
    }
  }
  const int count = static_cast<int>(points.size()) - 1;
  return surface(
      columns, count,
      [&](double u, double v) {
        const glm::dvec2 p = points[static_cast<std::size_t>(std::lround(v * count))];
        return glm::dvec3(p.x * std::cos(2 * kPi * u), p.y, -p.x * std::sin(2 * kPi * u));
      },
      true);
}

Primitive sphere(double radius, int columns) {
  const int rows = std::max(2, columns / 2);
  return surface(
      columns, rows,
      [&](double u, double v) {
        if (v == 0 || v == 1) return glm::dvec3(0, v == 0 ? -radius : radius, 0);
        const double a = 2 * kPi * u, b = kPi * v;
        return radius * glm::dvec3(std::sin(b) * std::cos(a), -std::cos(b), -std::sin(b) * std::sin(a));
      },
      true);
}

Primitive tube(const std::function<glm::dvec3(double)>& curve, const std::function<double(double)>& radius, int columns,
               int rows, bool caps) {
  // A frame carried along the curve: it turns no more than the curve does.
  std::vector<glm::dvec3> centers, tangents, sides;
  for (int r = 0; r <= rows; ++r) centers.push_back(curve(static_cast<double>(r) / rows));
  for (int r = 0; r <= rows; ++r)
    tangents.push_back(unit(centers[static_cast<std::size_t>(std::min(r + 1, rows))] -
                            centers[static_cast<std::size_t>(std::max(r - 1, 0))]));
  glm::dvec3 side = std::abs(tangents[0].y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  for (const glm::dvec3& t : tangents) {
    side = unit(side - t * glm::dot(side, t));
    sides.push_back(side);
  }
  const auto ring = [&](std::size_t r, double u, double size) {
    const glm::dvec3 other = glm::cross(tangents[r], sides[r]);
    return centers[r] + size * (std::cos(2 * kPi * u) * sides[r] + std::sin(2 * kPi * u) * other);
  };
  Primitive p = surface(
      columns, rows,
      [&](double u, double v) {
        const auto r = static_cast<std::size_t>(std::lround(v * rows));
        return ring(r, u, radius(v));
      },
      true);
  if (caps) {
    const auto last = static_cast<std::size_t>(rows);
    append(p, surface(
                  columns, 1, [&](double u, double v) { return ring(0, u, v * radius(0)); }, true));
    append(p, surface(
                  columns, 1, [&](double u, double v) { return ring(last, u, (1 - v) * radius(1)); }, true));
  }
  return p;
}

Primitive cube_sphere(int cells, const std::function<double(const glm::dvec3&)>& radius) {
  Primitive p;
  const auto n = static_cast<std::uint64_t>(cells);
  std::unordered_map<std::uint64_t, std::uint32_t> vertices;
  const auto warp = [&](int i) {
    // The middle and the ends exactly, the rest odd about the middle: the mesh is symmetric.
    return 2 * i == cells  ? 0.0
           : 2 * i > cells ? std::tan(kPi / 4 * (2.0 * i / cells - 1))
                           : -std::tan(kPi / 4 * (1 - 2.0 * i / cells));
  };
  const auto vertex = [&](const glm::ivec3& q) {
    const std::uint64_t key = (static_cast<std::uint64_t>(q.x) * (n + 1) + static_cast<std::uint64_t>(q.y)) * (n + 1) +
                              static_cast<std::uint64_t>(q.z);
    const auto [it, added] = vertices.try_emplace(key, static_cast<std::uint32_t>(p.positions.size()));
    if (added) {
      const glm::dvec3 d = glm::normalize(glm::dvec3(warp(q.x), warp(q.y), warp(q.z)));
      p.positions.emplace_back(d * radius(d));
    }
    return it->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j) {
          const auto corner = [&](int di, int dj) {
            glm::ivec3 q;
            q[axis] = side * cells;
            q[(axis + 1) % 3] = i + di;
            q[(axis + 2) % 3] = j + dj;
            return vertex(q);
          };
          const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side) {
            p.triangles.push_back({a, b, c});
            p.triangles.push_back({a, c, d});
          } else {
            p.triangles.push_back({a, c, b});
            p.triangles.push_back({a, d, c});
          }
        }
  smooth_normals(p);
  return p;
}

Primitive torus_knot(int p, int q, double tube_radius, int along, int around) {
  const auto curve = [&](double t) {
    const double r = 2 + std::cos(q * t);
    return glm::dvec3(r * std::cos(p * t), std::sin(q * t), -r * std::sin(p * t));
  };
  const auto slope = [&](double t) {
    const double r = 2 + std::cos(q * t), dr = -q * std::sin(q * t);
    return glm::dvec3(dr * std::cos(p * t) - p * r * std::sin(p * t), q * std::cos(q * t),
                      -dr * std::sin(p * t) - p * r * std::cos(p * t));
  };
  Primitive out;
  for (int i = 0; i < along; ++i) {
    const double t = 2 * kPi * i / along;
    const glm::dvec3 c = curve(t), tangent = unit(slope(t));
    // The frame follows the place itself, which is never along the tangent, so it closes up.
    const glm::dvec3 b = unit(glm::cross(tangent, c)), n = glm::cross(b, tangent);
    for (int j = 0; j < around; ++j) {
      const double a = 2 * kPi * j / around;
      const glm::dvec3 d = std::cos(a) * n + std::sin(a) * b;
      out.positions.emplace_back(c + tube_radius * d);
      out.normals.emplace_back(d);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i % along * around + j % around); };
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      out.triangles.push_back({a, c, b});
      out.triangles.push_back({a, d, c});
    }
  return out;
}

void smooth_normals(Primitive& primitive) {
  std::vector<glm::dvec3> sums(primitive.positions.size(), glm::dvec3(0.0));
  for (const glm::uvec3& t : primitive.triangles) {
    const glm::dvec3 a(primitive.positions[t.x]), b(primitive.positions[t.y]), c(primitive.positions[t.z]);
    const glm::dvec3 n = glm::cross(b - a, c - a);
    for (int i = 0; i < 3; ++i) sums[t[i]] += n;
  }
  primitive.normals.clear();
  for (const glm::dvec3& n : sums) primitive.normals.emplace_back(unit(n));
}

}  // namespace retrace::shapes
