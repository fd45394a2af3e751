// A scene with everything that is traced of it: the one way from a scene to triangles on the grid and their tree.
#pragma once
#include "golden/scene/geometry.hpp"
#include "golden/scene/scene.hpp"
#include "kd_builder.hpp"
#include "memory_image.hpp"

namespace retrace {

struct TracedScene {
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  MemoryImage image;
};

/// Whether instances stay instances (golden/tree/instanced_scene.hpp), or are flattened into one tree.
enum class TwoLevels {
  kOff,
  kAuto,  ///< where that makes the image smaller: has_instances()
  kOn
};

/// All but the image. `side`: as snap() takes it, of a scene of one level. Throws Error as flatten() does.
TracedScene snap_scene(Scene scene, TwoLevels levels = TwoLevels::kOff, double side = 1.0);
/// The image of a snapped scene. Throws Error as build_kd() does.
MemoryImage build_image(const GridScene& grid, const BuildOptions& options = {});
/// Both.
TracedScene prepare_scene(Scene scene, const BuildOptions& options = {}, TwoLevels levels = TwoLevels::kOff);

}  // namespace retrace
