// See traced_scene.hpp.
#include "traced_scene.hpp"

#include <utility>

namespace retrace {

TracedScene snap_scene(Scene scene) {
  TracedScene traced;
  traced.scene = std::move(scene);
  traced.world = flatten(traced.scene);
  traced.grid = snap(traced.world);
  return traced;
}

TracedScene prepare_scene(Scene scene, const BuildOptions& options) {
  TracedScene traced = snap_scene(std::move(scene));
  traced.image = build_kd(traced.grid, options);
  return traced;
}

}  // namespace retrace
