// Instances as scenes have them, and beyond: for vectors of the stage and for scenes of two levels.
#pragma once
#include "golden/tree/instance.hpp"
#include "random.hpp"

namespace retrace {

enum class InstanceShape {
  kRigid,          ///< a rotation, as large as the object
  kScaled,         ///< and smaller, down to 1e-3
  kSmallest,       ///< down to the least size that a record holds
  kSquashed,       ///< 1:100 on an axis of the object
  kSquashedWorld,  ///< on an axis of the world
  kSheared,
  kMirrored,
  kPermuted,  ///< axes exchanged: exact zeros in the record
  kCount
};

/// A random map of that kind that keeps the instance in the world's [-1, 1], for an object in [-reach, reach].
Placement random_placement(Random& random, InstanceShape shape, double reach = kObjectReach);

}  // namespace retrace
