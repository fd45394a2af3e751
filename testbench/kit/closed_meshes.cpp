#include "closed_meshes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <map>

namespace retrace {
namespace {

constexpr double kReach =
    0.55 * (1 << contract::kPositionFrac);  // sqrt 3 times this, a corner of the box, stays below 1

glm::dquat any_rotation(Random& random) {
  const double angle = random.real(0, 3.14), z = random.real(-1, 1), a = random.real(0, 6.28);
  return glm::angleAxis(angle, glm::dvec3(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z));
}

}  // namespace

GridScene make_closed_mesh(const std::string& kind, int cells, Random& random) {
  if (kind != "box" && kind != "sphere" && kind != "random" && kind != "sliver")
    throw Error(kind + ": no such closed mesh (box, sphere, random, sliver)");
  const bool turned = kind == "sliver";
  const glm::dquat rotation = any_rotation(random);
  const glm::dvec3 squeeze{1.0, std::exp2(random.real(-5, 0)), std::exp2(random.real(-10, 0))};
  std::map<std::array<int, 3>, GridPoint> made;  // by place on the cube: faces share the vertices of their edges
  const auto vertex = [&](const std::array<int, 3>& place) {
    const auto found = made.find(place);
    if (found != made.end()) return found->second;
    glm::dvec3 p = glm::dvec3(place[0], place[1], place[2]) / static_cast<double>(cells);
    if (kind != "box") p = glm::normalize(p) * (kind == "sphere" ? 1.0 : random.real(0.3, 1.7));
    if (turned) p = rotation * (p * squeeze);
    return made[place] = GridPoint(glm::floor(p * kReach + 0.5));
  };
  GridScene scene;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          const auto at = [&](int a, int b) {
            std::array<int, 3> place;
            place[static_cast<std::size_t>(axis)] = side * cells;
            place[static_cast<std::size_t>((axis + 1) % 3)] = 2 * (i + a) - cells;
            place[static_cast<std::size_t>((axis + 2) % 3)] = side * (2 * (j + b) - cells);
            return vertex(place);
          };
          const auto id = static_cast<std::uint32_t>(scene.triangles.size());
          scene.triangles.push_back({{at(0, 0), at(1, 0), at(1, 1)}, id});
          scene.triangles.push_back({{at(0, 0), at(1, 1), at(0, 1)}, id + 1});
        }
      }
    }
  }
  GridPoint lower(0), upper(0);
  for (const GridTriangle& triangle : scene.triangles) {
    for (const GridPoint& p : triangle.vertices) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    scene.box[static_cast<std::size_t>(2 * axis)] = lower[axis] - contract::kBoxPad;
    scene.box[static_cast<std::size_t>(2 * axis + 1)] = upper[axis] + contract::kBoxPad;
  }
  return scene;
}

GridPoint inside_closed_mesh(const GridScene& scene, Random& random) {
  if (random.chance(3)) return GridPoint(0);
  const GridTriangle& t = scene.triangles[random.below(scene.triangles.size())];
  const glm::dvec3 middle = (glm::dvec3(t.vertices[0]) + glm::dvec3(t.vertices[1]) + glm::dvec3(t.vertices[2])) / 3.0;
  return GridPoint(glm::floor(middle * random.real(0, 0.9)));
}

std::vector<GridRay> make_exact_edge_rays(const GridScene& scene, const GridPoint& origin, std::size_t count,
                                          Random& random) {
  constexpr std::int32_t kMost = (1 << contract::kDirectionFrac) - 1;
  std::vector<GridRay> rays;
  rays.reserve(count);
  while (rays.size() < count) {
    const GridTriangle& triangle = scene.triangles[random.below(scene.triangles.size())];
    const auto corner = random.below(3);
    GridPoint direction = triangle.vertices[corner] - origin;
    if (random.chance(2)) direction += triangle.vertices[(corner + 1) % 3] - origin;
    const auto largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
    if (largest == 0 || largest > kMost) continue;
    int scale = 1;
    while (largest * (2 * scale) <= kMost) scale *= 2;
    GridRay ray;
    for (int axis = 0; axis < 3; ++axis) {
      ray.record.origin[static_cast<std::size_t>(axis)] = origin[axis];
      ray.record.direction[static_cast<std::size_t>(axis)] = direction[axis] * scale;
    }
    ray.record.t_max = (1u << contract::kTLimitBits) - 1;
    rays.push_back(ray);
  }
  return rays;
}

}  // namespace retrace
