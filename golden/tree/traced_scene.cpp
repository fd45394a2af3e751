// See traced_scene.hpp.
#include "traced_scene.hpp"

#include <utility>

#include "instanced_scene.hpp"
#include "two_level_scene.hpp"

namespace retrace {

TracedScene snap_scene(Scene scene, TwoLevels levels, double side) {
  TracedScene traced;
  traced.scene = std::move(scene);
  traced.world = flatten(traced.scene);
  const bool two = levels == TwoLevels::kOn || (levels == TwoLevels::kAuto && has_instances(traced.scene));
  traced.grid = two ? InstancedScene(traced.scene, side).release() : snap(traced.world, side);
  return traced;
}

MemoryImage build_image(const GridScene& grid, const BuildOptions& options) {
  return grid.two_levels ? TwoLevelImage(grid, false, options).release() : build_kd(grid, options);
}

TracedScene prepare_scene(Scene scene, const BuildOptions& options, TwoLevels levels) {
  TracedScene traced = snap_scene(std::move(scene), levels);
  traced.image = build_image(traced.grid, options);
  return traced;
}

}  // namespace retrace
