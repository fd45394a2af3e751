// A scene of two levels: trees of objects, each on a grid of its own, and a tree over the instances that place them in the world.
#pragma once
#include <span>
#include <vector>

#include "golden/tree/instance.hpp"
#include "golden/tree/kd_builder.hpp"

namespace retrace {

struct TwoLevelScene {
  std::vector<MemoryImage> objects;
  std::vector<contract::InstanceRecord> instances;
  std::vector<std::uint32_t> object_of;  ///< by instance
  MemoryImage top;  ///< its triangle records are stand-ins: only their ids count, numbers of instances
};

struct PlacedObject {
  std::uint32_t object;
  Placement to_world;
};

/// Builds the trees of the objects and of the world. `root` of a record is the number of its object here: a memory image of several trees puts
/// root pairs there. Throws Error where an object's root box leaves [-kObjectReach, kObjectReach] or a placement has no record.
TwoLevelScene build_two_levels(std::span<const GridScene> objects, std::span<const PlacedObject> placed);

/// All trees, triangles and instances as one image of version image_version_two_levels: pair 0 is the top tree's root, roots in instance records are
/// pairs of the image, references of its leaves of instances are numbers of instance records.
std::vector<std::uint64_t> assemble_two_levels(const TwoLevelScene& scene);

/// The box in the world, position codes by face, that holds all points which a record takes to the object's root box.
std::array<std::int32_t, 6> world_box(const contract::InstanceRecord& record,
                                      const std::array<std::int32_t, 6>& root_box);

}  // namespace retrace
