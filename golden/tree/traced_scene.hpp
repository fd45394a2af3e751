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

/// All but the image. Throws Error as flatten() does.
TracedScene snap_scene(Scene scene);
/// The image, too. Throws Error as build_kd() does.
TracedScene prepare_scene(Scene scene, const BuildOptions& options = {});

}  // namespace retrace
