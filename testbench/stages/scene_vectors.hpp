// What the stages are given when rays walk through a scene: every stage's inputs, recorded on the way.
#pragma once
#include <span>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/tree/memory_image.hpp"

namespace retrace::cosim {

struct SceneVectors {
  std::vector<contract::RaySetupInRecord> ray_setup;
  std::vector<contract::KdDescendInRecord> kd_descend;
  std::vector<contract::LeafExitInRecord> leaf_exit;
  std::vector<contract::KdBacktrackInRecord> kd_backtrack;
  std::vector<contract::TriTestInRecord> tri_test;
  std::vector<contract::HitFinishInRecord> hit_finish;
  std::vector<contract::InstanceEnterInRecord> instance_enter;  ///< the scene, half as large and turned, as an object
};

/// Walks the rays over the image with parent links, closest hit, and appends what each stage is given.
void record_walks(const MemoryImage& image, std::span<const GridRay> rays, SceneVectors& vectors);

}  // namespace retrace::cosim
