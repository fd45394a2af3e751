// Scenes on the position grid that builders choke on: a rule that is right for meshes duplicates references without
// end, or takes quadratic time. Each has about `count` triangles, so that growth with their number can be measured.
#pragma once
#include <cmath>
#include <functional>

#include "grid_scenes.hpp"

namespace retrace {

using GridTriangles = std::vector<std::array<GridPoint, 3>>;

struct HardScene {
  std::string name;
  std::function<GridTriangles(Random&, int count)> make;
  bool closed = false;  ///< a closed surface around the point (0, 0, 0)
  GridScene scene(Random& random, int count) const { return grid_scene(make(random, count)); }
};

namespace hard {

inline GridPoint rounded(double x, double y, double z) {
  const auto code = [](double v) {
    return static_cast<std::int32_t>(std::lround(std::clamp(v, -1.0, 1.0) * static_cast<double>(kGridMost)));
  };
  return {code(x), code(y), code(z)};
}

/// Overlapping triangles in the plane where coordinate `axis` is 0.
inline GridTriangles coplanar(Random& random, int count, int axis, double size) {
  GridTriangles all;
  for (int i = 0; i < count; ++i) {
    const GridPoint center = random_point(random, kGridMost / 2);
    std::array<GridPoint, 3> t;
    for (GridPoint& p : t) {
      p = random_point(random, static_cast<std::int64_t>(size * kGridMost), center);
      p[axis] = 0;
    }
    all.push_back(t);
  }
  return all;
}

/// Sectors of a disc of any direction, all with the centre as a vertex.
inline GridTriangles fan(int count, double tilt) {
  GridTriangles all;
  const auto at = [&](int i) {
    const double phi = 2 * M_PI * (i % count) / count;
    return rounded(0.9 * std::cos(phi) * std::cos(tilt), 0.9 * std::sin(phi), 0.9 * std::cos(phi) * std::sin(tilt));
  };
  for (int i = 0; i < count; ++i) all.push_back({GridPoint(0, 0, 0), at(i), at(i + 1)});
  return all;
}

/// Closed cylinder along an axis: slivers in the mantle, fans as caps.
inline GridTriangles cylinder(int count) {
  GridTriangles all;
  const int n = std::max(count / 4, 3);
  const auto at = [&](int i, double z) {
    const double phi = 2 * M_PI * (i % n) / n;
    return rounded(0.5 * std::cos(phi), 0.5 * std::sin(phi), z);
  };
  for (int i = 0; i < n; ++i) {
    all.push_back({at(i, -0.9), at(i + 1, -0.9), at(i + 1, 0.9)});
    all.push_back({at(i, -0.9), at(i + 1, 0.9), at(i, 0.9)});
    for (const double z : {-0.9, 0.9}) all.push_back({rounded(0, 0, z), at(i, z), at(i + 1, z)});
  }
  return all;
}

inline void add_box(GridTriangles& all, const GridPoint& low, const GridPoint& high) {
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (const bool upper : {false, true}) {
      GridPoint p = low, q = low, r = low, s = low;
      p[axis] = q[axis] = r[axis] = s[axis] = upper ? high[axis] : low[axis];
      q[b] = r[b] = high[b];
      r[c] = s[c] = high[c];
      all.push_back({p, q, r});
      all.push_back({p, r, s});
    }
  }
}

}  // namespace hard

inline std::vector<HardScene> hard_scenes() {
  using namespace hard;
  std::vector<HardScene> all;
  for (int axis = 0; axis < 3; ++axis)
    all.push_back({std::string("overlapping in one plane, axis ") + "xyz"[axis],
                   [axis](Random& random, int count) { return coplanar(random, count, axis, 0.5); }});
  all.push_back(
      {"full-size triangles in one plane", [](Random& random, int count) { return coplanar(random, count, 1, 2.0); }});
  all.push_back({"flat fan", [](Random&, int count) { return fan(count, 0.0); }});
  all.push_back({"tilted fan", [](Random&, int count) { return fan(count, 0.7); }});
  all.push_back(
      {"coincident", [](Random&, int count) {
         return GridTriangles(count, {rounded(-0.7, -0.5, 0.1), rounded(0.6, -0.3, 0.8), rounded(0.1, 0.9, -0.6)});
       }});
  all.push_back(
      {"coincident in an axis plane", [](Random&, int count) {
         return GridTriangles(count, {rounded(-0.7, -0.5, 0.1), rounded(0.6, -0.3, 0.1), rounded(0.1, 0.9, 0.1)});
       }});
  all.push_back(
      {"all through one vertex", [](Random& random, int count) {
         GridTriangles t;
         for (int i = 0; i < count; ++i)
           t.push_back({GridPoint(17, -5, 3), random_point(random, kGridMost), random_point(random, kGridMost)});
         return t;
       }});
  all.push_back({"all across the scene", [](Random& random, int count) {
                   GridTriangles t;
                   for (int i = 0; i < count; ++i)
                     t.push_back({random_point(random, kGridMost), random_point(random, kGridMost),
                                  random_point(random, kGridMost)});
                   return t;
                 }});
  all.push_back({"parallel diagonal needles", [](Random& random, int count) {
                   GridTriangles t;
                   for (int i = 0; i < count; ++i) {
                     const double x = random.real(-0.1, 0.1), y = random.real(-0.1, 0.1);
                     const GridPoint a = rounded(x - 0.9, y - 0.9, -0.9), b = rounded(x + 0.9, y + 0.9, 0.9);
                     t.push_back({a, b, a + GridPoint(40, -25, 3)});
                   }
                   return t;
                 }});
  all.push_back({"crossing needles", [](Random& random, int count) {
                   GridTriangles t;
                   for (int i = 0; i < count; ++i) {
                     const GridPoint a = random_point(random, kGridMost / 2) * 2;
                     t.push_back({a, random_point(random, 99, GridPoint(0) - a), random_point(random, 30, a)});
                   }
                   return t;
                 }});
  all.push_back({"nested boxes",
                 [](Random&, int count) {
                   GridTriangles t;
                   const int n = std::max(count / 12, 1);
                   for (int i = 0; i < n; ++i) {
                     const double r = 0.1 + 0.8 * (i + 1) / n;
                     add_box(t, rounded(-r, -r, -r), rounded(r, r, r));
                   }
                   return t;
                 },
                 true});
  all.push_back({"cylinder of slivers", [](Random&, int count) { return cylinder(count); }, true});
  all.push_back({"huge and tiny", [](Random& random, int count) {
                   GridTriangles t;
                   for (int i = 0; i < count; ++i) {
                     const std::int64_t size = i % 2 == 0 ? kGridMost : 500;
                     const GridPoint center = i % 2 == 0 ? GridPoint(0) : random_point(random, 20000);
                     t.push_back({random_point(random, size, center), random_point(random, size, center),
                                  random_point(random, size, center)});
                   }
                   return t;
                 }});
  // What is a point or a line is dropped when a scene is snapped; these are the next to it, one code high.
  all.push_back({"points and lines", [](Random& random, int count) {
                   GridTriangles t;
                   const GridPoint a = rounded(-0.9, 0.3, -0.2), b = rounded(0.9, -0.2, 0.6);
                   for (int i = 0; i < count; ++i) {
                     if (i % 2 == 0)
                       t.push_back({a, a + GridPoint(1, 0, 0), a + GridPoint(0, 1, 0)});
                     else
                       t.push_back({a, b, random_point(random, 1, a)});
                   }
                   return t;
                 }});
  all.push_back({"sizes in powers of two", [](Random& random, int count) {
                   GridTriangles t;
                   for (int i = 0; i < count; ++i) {
                     const std::int32_t size = std::int32_t{1} << random.integer(1, contract::kPositionFrac - 2);
                     GridPoint p;
                     for (int k = 0; k < 3; ++k) p[k] = random.chance(2) ? size : 0;
                     t.push_back({p, p + GridPoint(size / 2, 0, 1), p + GridPoint(0, size / 2, 1)});
                   }
                   return t;
                 }});
  return all;
}

}  // namespace retrace
