// A walk as a picture: how deep in the tree it is along the ray, and the cells it passes in space.
#pragma once
#include <string>
#include <vector>

#include "golden/engine/walk.hpp"

namespace retrace::cli {

struct DrawnWalk {
  std::string engine;
  const Walk* walk = nullptr;
};

/// The walk as an SVG document. Cells and triangles are drawn on the two axes along which the ray goes farthest, in grid units.
std::string draw_walk(const DrawnWalk& drawn, const std::string& title, const GridScene& scene,
                      const MemoryImage& image);

}  // namespace retrace::cli
