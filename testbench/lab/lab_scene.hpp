// A scene as the lab works on it.
#pragma once
#include "golden/scene/geometry.hpp"
#include "golden/scene/scene.hpp"
#include "golden/tree/memory_image.hpp"
#include "lab.hpp"

namespace retrace::lab {

struct LabScene {
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  MemoryImage image;
};

}  // namespace retrace::lab
