#include "golden/scene/two_level_scene.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "hls/include/contract.hpp"

namespace retrace {
namespace {

constexpr double kUnit = 1 << contract::kPositionFrac;

/// Codes by which boxes grow: what a walk over the top tree is off by (docs/error-bounds.md, "instance_enter") and the doubles here.
constexpr double kTopPad = 4.0;

std::array<std::int32_t, 6> root_box(const MemoryImage& image) {
  std::array<std::int32_t, 6> box{};
  for (std::size_t face = 0; face < 6; ++face) box[face] = static_cast<std::int32_t>(image.header().box[face]);
  return box;
}

}  // namespace

std::array<std::int32_t, 6> world_box(const contract::InstanceRecord& record,
                                      const std::array<std::int32_t, 6>& root_box) {
  glm::dmat3 linear;  // of the record: world to object
  glm::dvec3 offset;
  for (int row = 0; row < 3; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const int shift = static_cast<int>(record.e[at]) - contract::kInstanceCoefficientFrac;
    for (int column = 0; column < 3; ++column)
      linear[column][row] = std::ldexp(record.m[3 * at + static_cast<std::size_t>(column)], shift);
    offset[row] = std::ldexp(static_cast<double>(record.b[at]), shift);
  }
  const glm::dmat3 back = glm::inverse(linear);
  glm::dvec3 lower(1e30), upper(-1e30);
  for (unsigned corner = 0; corner < 8; ++corner) {
    glm::dvec3 point;
    for (unsigned axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] = root_box[2 * axis + (corner >> axis & 1)] / kUnit;
    const glm::dvec3 world = back * (point - offset);
    lower = glm::min(lower, world);
    upper = glm::max(upper, world);
  }
  std::array<std::int32_t, 6> box{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    box[2 * axis] = static_cast<std::int32_t>(std::floor(lower[i] * kUnit - kTopPad));
    box[2 * axis + 1] = static_cast<std::int32_t>(std::ceil(upper[i] * kUnit + kTopPad));
  }
  return box;
}

TwoLevelScene build_two_levels(std::span<const GridScene> objects, std::span<const PlacedObject> placed) {
  TwoLevelScene scene;
  std::vector<std::uint32_t> sizes;
  for (const GridScene& object : objects) {
    scene.objects.push_back(build_kd(object));
    std::uint32_t ids = 0;
    for (const GridTriangle& triangle : object.triangles) ids = std::max(ids, triangle.id + 1);
    sizes.push_back(ids);
  }
  GridScene world;
  world.box = {1 << 30, -(1 << 30), 1 << 30, -(1 << 30), 1 << 30, -(1 << 30)};
  std::uint32_t first_id = 0;
  for (const PlacedObject& one : placed) {
    const auto number = static_cast<std::uint32_t>(scene.instances.size());
    if (one.object >= scene.objects.size()) throw Error("instance " + std::to_string(number) + ": no such object");
    const auto root = root_box(scene.objects[one.object]);
    const auto record = make_instance(one.to_world, root, one.object, first_id);
    if (!record) throw Error("instance " + std::to_string(number) + ": no record can place its object so");
    const auto box = world_box(*record, root);
    // Three corners of the box: with BuildOptions::clip off, a triangle counts as its bounding box.
    const GridPoint low(box[0], box[2], box[4]), high(box[1], box[3], box[5]);
    world.triangles.push_back({{low, high, GridPoint(low.x, high.y, low.z)}, number});
    for (std::size_t face = 0; face < 6; ++face) {
      const std::int32_t padded = box[face] + (face % 2 ? contract::kBoxPad : -contract::kBoxPad);
      world.box[face] = face % 2 ? std::max(world.box[face], padded) : std::min(world.box[face], padded);
    }
    scene.instances.push_back(*record);
    scene.object_of.push_back(one.object);
    first_id += sizes[one.object];
  }
  if (placed.empty()) world.box = {-1024, 1024, -1024, 1024, -1024, 1024};
  BuildOptions options;
  options.clip = false;
  scene.top = build_kd(world, options);
  return scene;
}

}  // namespace retrace
