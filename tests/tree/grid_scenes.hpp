// Scenes on the position grid for the tests of the builder and the image: each kind is there for something that goes
// wrong easily.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {

inline constexpr std::int32_t kGridOne = std::int32_t{1} << contract::kPositionFrac;
/// Largest coordinate a snapped vertex has: the padded box ends at 1.
inline constexpr std::int32_t kGridMost = kGridOne - contract::kBoxPad;

struct NamedGridScene {
  std::string name;
  GridScene scene;
};

inline bool has_area(const std::array<GridPoint, 3>& v) {
  const auto edge = [&](int i, int axis) { return std::int64_t{v[i][axis]} - v[0][axis]; };
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    if (edge(1, a) * edge(2, b) != edge(1, b) * edge(2, a)) return true;
  }
  return false;
}

/// As snap() leaves a scene: ids ascending with gaps where a triangle without area was, box padded.
inline GridScene grid_scene(const std::vector<std::array<GridPoint, 3>>& triangles) {
  GridScene scene;
  scene.transform.scale = 0.375;
  scene.transform.center = {1.5, -2.0, 1e6};
  scene.box = {-contract::kBoxPad, contract::kBoxPad,  -contract::kBoxPad,
               contract::kBoxPad,  -contract::kBoxPad, contract::kBoxPad};
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!has_area(triangles[i])) {
      ++scene.degenerate;
      continue;
    }
    const bool first = scene.triangles.empty();
    scene.triangles.push_back({triangles[i], static_cast<std::uint32_t>(i)});
    for (int axis = 0; axis < 3; ++axis) {
      for (const GridPoint& v : triangles[i]) {
        std::int32_t &low = scene.box[2 * axis], &high = scene.box[2 * axis + 1];
        const bool reset = first && &v == &triangles[i][0];
        low = reset ? v[axis] - contract::kBoxPad : std::min(low, v[axis] - contract::kBoxPad);
        high = reset ? v[axis] + contract::kBoxPad : std::max(high, v[axis] + contract::kBoxPad);
      }
    }
  }
  return scene;
}

inline GridPoint random_point(Random& random, std::int64_t size, const GridPoint& center = GridPoint(0)) {
  GridPoint p;
  for (int axis = 0; axis < 3; ++axis)
    p[axis] = static_cast<std::int32_t>(
        std::clamp<std::int64_t>(center[axis] + random.integer(-size, size), -kGridMost, kGridMost));
  return p;
}

/// Small scenes, about `count` triangles each.
inline std::vector<NamedGridScene> grid_scenes(Random& random, int count) {
  using Triangles = std::vector<std::array<GridPoint, 3>>;
  std::vector<NamedGridScene> all;
  const auto add = [&](std::string name, const Triangles& triangles) {
    all.push_back({std::move(name), grid_scene(triangles)});
  };
  const auto soup = [&](int n, std::int64_t spread, std::int64_t size) {
    Triangles t;
    for (int i = 0; i < n; ++i) {
      const GridPoint c = random_point(random, spread);
      t.push_back({random_point(random, size, c), random_point(random, size, c), random_point(random, size, c)});
    }
    return t;
  };
  add("none", {});
  add("one triangle", soup(1, kGridMost, kGridMost));
  add("soup", soup(count, kGridMost, kGridOne / 8));
  add("medium triangles", soup(count / 3, kGridMost, kGridOne / 3));
  Triangles large;
  for (int i = 0; i < count / 3; ++i)
    large.push_back(
        {random_point(random, kGridMost), random_point(random, kGridMost), random_point(random, kGridMost)});
  add("large triangles", large);
  add("within the margin", soup(count, 150, 60));  // cells of the size of kWiden
  add("one code apart", soup(count / 2, 4, 3));

  Triangles slivers;  // two vertices next to each other, or all three nearly on a line
  for (int i = 0; i < count; ++i) {
    const GridPoint a = random_point(random, kGridMost), b = random_point(random, kGridMost);
    const GridPoint near = i % 2 == 0 ? a : a / 2 + b / 2;
    slivers.push_back({a, b, random_point(random, i % 3 == 0 ? 1 : 40, near)});
  }
  add("slivers", slivers);

  Triangles walls;  // rectangles in few planes that many of them share, and that splits will share with them
  const std::int32_t step = kGridOne / 8;
  for (int i = 0; i < count / 2; ++i) {
    const int axis = static_cast<int>(random.below(3)), b = (axis + 1) % 3, c = (axis + 2) % 3;
    GridPoint corner, along(0), up(0);
    for (int k = 0; k < 3; ++k) corner[k] = static_cast<std::int32_t>(random.integer(-6, 4)) * step;
    along[b] = static_cast<std::int32_t>(random.integer(1, 2)) * step;
    up[c] = static_cast<std::int32_t>(random.integer(1, 2)) * step;
    walls.push_back({corner, corner + along, corner + along + up});
    walls.push_back({corner, corner + along + up, corner + up});
  }
  add("walls", walls);

  Triangles layers;  // parallel planes kWiden and a little apart
  for (int i = 0; i < count / 2; ++i) {
    const std::int32_t z =
        static_cast<std::int32_t>(random.integer(-8, 8)) * static_cast<std::int32_t>(random.integer(31, 35));
    const GridPoint p(random.integer(-4, 4) * step, random.integer(-4, 4) * step, z);
    layers.push_back({p, p + GridPoint(step, 0, 0), p + GridPoint(0, step, 0)});
  }
  add("layers", layers);

  Triangles coincident = soup(count / 8, kGridMost, kGridOne / 4);
  const Triangles once = coincident;
  for (int i = 0; i < 7; ++i) coincident.insert(coincident.end(), once.begin(), once.end());
  add("coincident", coincident);

  Triangles fan;  // all share a vertex
  for (int i = 0; i < count; ++i)
    fan.push_back({GridPoint(17, -5, 3), random_point(random, kGridMost), random_point(random, kGridMost)});
  add("fan", fan);

  Triangles dust = soup(count, kGridOne / 1000, kGridOne / 20000);  // a small thing in a large box
  dust.push_back({GridPoint(-kGridMost, -kGridMost, -kGridMost), GridPoint(kGridMost, -kGridMost, -kGridMost),
                  GridPoint(0, kGridMost, kGridMost)});
  add("dust and a wall", dust);
  return all;
}

}  // namespace retrace
