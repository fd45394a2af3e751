// Small scenes for the tests of the lab, made on the spot; each is there for something that goes wrong easily.
#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "golden/scene/geometry.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {

using Soup = std::vector<std::array<glm::dvec3, 3>>;

inline GridScene snap_soup(const Soup& soup) {
  WorldTriangles world;
  world.vertices = soup;
  world.sources.resize(soup.size(), TriangleSource{0, 0, 0, 0});
  for (std::uint32_t i = 0; i < soup.size(); ++i) world.sources[i].triangle = i;
  return snap(world);
}

/// Triangles of one size strewn in a cube.
inline Soup random_soup(std::size_t count, double size, Random& random) {
  Soup soup;
  const auto point = [&](double r) { return glm::dvec3{random.real(-r, r), random.real(-r, r), random.real(-r, r)}; };
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 center = point(1.0);
    soup.push_back({center + point(size), center + point(size), center + point(size)});
  }
  return soup;
}

/// Closed sphere with bumps; 2 n (n - 1) * 2 triangles.
inline Soup bumpy_sphere(int n) {
  const auto at = [&](int i, int j) {
    const double theta = M_PI * i / n, phi = M_PI * (j % (2 * n)) / n;
    const double r = i == 0 || i == n ? 1.0 : 1.0 + 0.1 * std::sin(7.0 * phi) * std::sin(5.0 * theta);
    return r * glm::dvec3{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
  };
  Soup soup;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < 2 * n; ++j) {
      if (i + 1 < n) soup.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      if (i > 0) soup.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  return soup;
}

struct NamedScene {
  std::string name;
  GridScene scene;
};

inline std::vector<NamedScene> small_scenes(Random& random) {
  std::vector<NamedScene> all;
  const auto add = [&](std::string name, const Soup& soup) { all.push_back({std::move(name), snap_soup(soup)}); };
  add("soup", random_soup(400, 0.2, random));
  add("dust and a wall", [&] {
    Soup soup = random_soup(300, 0.002, random);
    soup.push_back({glm::dvec3{-5, -5, 0}, glm::dvec3{5, -5, 0}, glm::dvec3{0, 5, 0}});
    return soup;
  }());
  add("sphere", bumpy_sphere(12));
  add("needles", [&] {
    Soup soup;
    for (int i = 0; i < 200; ++i) {
      const glm::dvec3 a{random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)},
          d{random.real(-1, 1), random.real(-1, 1), 1};
      soup.push_back({a, a + d, a + d * 0.5 + glm::dvec3{1e-5, -2e-5, 1e-6}});
    }
    return soup;
  }());
  add("coincident", [&] {
    Soup soup;
    const Soup base = random_soup(20, 0.8, random);
    for (int i = 0; i < 5; ++i) soup.insert(soup.end(), base.begin(), base.end());
    return soup;
  }());
  add("flat lattice", [&] {  // axis-aligned, so that planes, splits and rays coincide
    Soup soup;
    for (int i = 0; i < 12; ++i) {
      for (int j = 0; j < 12; ++j) {
        const glm::dvec3 p{i, j, 0}, x{1, 0, 0}, y{0, 1, 0};
        soup.push_back({p, p + x, p + x + y});
        soup.push_back({p, p + x + y, p + y});
      }
    }
    return soup;
  }());
  add("boxes", [&] {
    Soup soup;
    for (int i = 0; i < 30; ++i) {
      const glm::dvec3 p{random.integer(-8, 8), random.integer(-8, 8), random.integer(-8, 8)};
      for (int a = 0; a < 3; ++a) {
        glm::dvec3 x(0.0), y(0.0), z(0.0);
        x[a] = 1.0, y[(a + 1) % 3] = 1.0, z[(a + 2) % 3] = 1.0;
        for (const double s : {0.0, 1.0}) {
          soup.push_back({p + s * z, p + s * z + x, p + s * z + x + y});
          soup.push_back({p + s * z, p + s * z + x + y, p + s * z + y});
        }
      }
    }
    return soup;
  }());
  add("one triangle", random_soup(1, 1.0, random));
  add("none", {});
  return all;
}

}  // namespace retrace
