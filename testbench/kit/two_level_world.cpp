#include "two_level_world.hpp"

#include <algorithm>
#include <cmath>

#include "closed_meshes.hpp"
#include "golden/engine/exact.hpp"
#include "test_instances.hpp"

namespace retrace {
namespace {

constexpr double kUnit = 1 << contract::kPositionFrac;

}  // namespace

GridScene make_small_object(const std::string& kind, int cells, Random& random) {
  GridScene scene = make_closed_mesh(kind, cells, random);
  std::array<std::int32_t, 6> box{0, 0, 0, 0, 0, 0};
  std::vector<GridTriangle> kept;
  for (GridTriangle triangle : scene.triangles) {
    for (GridPoint& p : triangle.vertices) {
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = static_cast<std::int32_t>(std::int64_t{p[axis]} * 9 / 10);
        const auto at = static_cast<std::size_t>(2 * axis);
        box[at] = std::min(box[at], p[axis] - contract::kBoxPad);
        box[at + 1] = std::max(box[at + 1], p[axis] + contract::kBoxPad);
      }
    }
    const auto n =
        exact::cross(exact::difference(exact::to_vec(triangle.vertices[1]), exact::to_vec(triangle.vertices[0])),
                     exact::difference(exact::to_vec(triangle.vertices[2]), exact::to_vec(triangle.vertices[0])));
    if (n != exact::Vec{0, 0, 0}) kept.push_back(triangle);
  }
  scene.triangles = kept;
  scene.box = box;
  return scene;
}

TwoLevelWorld make_two_level_world(Random& random, std::size_t instances, int cells) {
  TwoLevelWorld world;
  for (const char* kind : {"box", "sphere", "random", "sliver"})
    world.objects.push_back(make_small_object(kind, cells, random));
  for (std::size_t i = 0; i < instances; ++i) {
    if (i % 4 == 3) {
      world.placed.push_back(world.placed[random.below(i)]);
      continue;
    }
    const auto shape = static_cast<InstanceShape>(random.below(static_cast<std::uint64_t>(InstanceShape::kCount)));
    const auto object = static_cast<std::uint32_t>(random.below(world.objects.size()));
    world.placed.push_back({object, random_placement(random, shape)});
  }
  world.scene = build_two_levels(world.objects, world.placed);
  return world;
}

contract::RayRecord make_world_ray(const GridPoint& origin, glm::dvec3 target, Random& random) {
  contract::RayRecord ray;
  glm::dvec3 d = target - glm::dvec3(origin) / kUnit;
  if (glm::length(d) < 1e-9) d = glm::dvec3(random.real(-1, 1), 1.0, random.real(-1, 1));
  d = glm::normalize(d);
  for (int axis = 0; axis < 3; ++axis) {
    ray.origin[static_cast<std::size_t>(axis)] = origin[axis];
    ray.direction[static_cast<std::size_t>(axis)] =
        static_cast<std::int32_t>(std::min(std::floor(d[axis] * 0x1p26 + 0.5), 0x1p26 - 1));
  }
  ray.t_max = (1u << contract::kTLimitBits) - 1;
  return ray;
}

glm::dvec3 random_world_target(const TwoLevelWorld& world, std::uint32_t instance, Random& random) {
  const auto& triangles = world.object(instance).triangles;
  const GridTriangle& triangle = triangles[random.below(triangles.size())];
  glm::dvec3 weight(random.real(0, 1), random.real(0, 1), random.real(0, 1));
  const auto aim = random.below(8);
  if (aim < 2) weight[static_cast<int>(random.below(3))] = 0.0;
  if (aim == 2) weight = glm::dvec3(1.0, 0.0, 0.0);
  weight /= weight.x + weight.y + weight.z;
  glm::dvec3 point(0.0);
  for (int i = 0; i < 3; ++i) point += weight[i] * glm::dvec3(triangle.vertices[static_cast<std::size_t>(i)]) / kUnit;
  return world.to_world(instance, point);
}

GridPoint random_world_origin(const TwoLevelWorld& world, Random& random) {
  const auto& box = world.scene.top.header().box;
  const auto face = [&](std::size_t i) { return static_cast<std::int32_t>(box[i]); };
  return {random.integer(face(0), face(1)), random.integer(face(2), face(3)), random.integer(face(4), face(5))};
}

}  // namespace retrace
