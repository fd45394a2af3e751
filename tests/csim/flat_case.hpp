// A scene of one level with rays that look for trouble, as tests of the kernels take it.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {

struct FlatCase {
  GridScene scene;
  MemoryImage image;
  std::vector<GridRay> rays;

  explicit FlatCase(const std::string& name, std::size_t count, std::uint64_t seed) {
    TracedScene traced = prepare_scene(open_scene(name));
    scene = std::move(traced.grid);
    image = std::move(traced.image);
    Random random(seed);
    rays = make_test_rays(scene, image, count, random);
  }
};

}  // namespace retrace
