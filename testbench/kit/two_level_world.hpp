// Scenes of two levels as tests make them: small closed meshes, placed in every way that an instance record can say, and rays at them.
#pragma once
#include <string>
#include <vector>

#include "golden/tree/two_level_scene.hpp"
#include "random.hpp"

namespace retrace {

struct TwoLevelWorld {
  std::vector<GridScene> objects;
  std::vector<PlacedObject> placed;
  TwoLevelScene scene;

  glm::dvec3 to_world(std::uint32_t instance, const glm::dvec3& point) const {
    return placed[instance].to_world.linear * point + placed[instance].to_world.offset;
  }
  const GridScene& object(std::uint32_t instance) const { return objects[placed[instance].object]; }
};

/// A closed mesh (make_closed_mesh) small enough for an object.
GridScene make_small_object(const std::string& kind, int cells, Random& random);

/// Instances of four objects of all shapes; every fourth stands where an earlier one does, so that all its hits are ties.
TwoLevelWorld make_two_level_world(Random& random, std::size_t instances, int cells);

/// A ray from a point of the world's grid towards a point of the world, in units of [-1, 1].
contract::RayRecord make_world_ray(const GridPoint& origin, glm::dvec3 target, Random& random);

/// Inside, on an edge or at a vertex of a triangle of that instance, in the world.
glm::dvec3 random_world_target(const TwoLevelWorld& world, std::uint32_t instance, Random& random);

/// Anywhere in the root box of the top tree.
GridPoint random_world_origin(const TwoLevelWorld& world, Random& random);

}  // namespace retrace
