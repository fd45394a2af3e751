#include "scene_vectors.hpp"

#include "golden/tree/instance.hpp"
#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_inputs.hpp"

namespace retrace::cosim {
namespace {

/// The scene as an object, half as large and turned about two axes.
contract::InstanceEnterInRecord record_entry(const MemoryImage& image, const contract::RayRecord& ray) {
  const glm::dmat3 about_z(0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0),
      about_x(1.0, 0.0, 0.0, 0.0, 0.8, 0.6, 0.0, -0.6, 0.8);
  std::array<std::int32_t, 6> box{};
  for (std::size_t face = 0; face < 6; ++face)
    box[face] = static_cast<std::int32_t>(static_cast<std::int32_t>(image.header().box[face]) * kObjectReach);
  const auto record = make_instance({0.5 * about_z * about_x, glm::dvec3(0.1, -0.05, 0.02)}, box, 0, 0).value();
  return instance_enter_in(record, ray, ray.t_max + 1);
}

void record_walk(const MemoryImage& image, const contract::RayRecord& ray, SceneVectors& vectors) {
  vectors.instance_enter.push_back(record_entry(image, ray));
  contract::RaySetupInRecord start;
  start.origin = ray.origin;
  start.direction = ray.direction;
  start.t_max = ray.t_max;
  start.any = ray.any;
  for (std::size_t face = 0; face < 6; ++face) start.box[face] = static_cast<std::int32_t>(image.header().box[face]);
  vectors.ray_setup.push_back(start);
  const auto state = reference::ray_setup(start);
  contract::HitFinishInRecord best;
  best.status = state.valid ? contract::kStatusMiss : contract::kStatusBadRay;
  best.t = ray.t_max;
  best.id = contract::kNoTriangle;

  std::uint32_t index = 0;
  std::int32_t t = 0;
  bool walking = state.valid;
  for (std::uint32_t step = 0; walking && step < image.header().step_limit; ++step) {
    const WalkedNode node = node_of(image, index);
    if (node.axis != contract::kAxisLeaf) {
      const auto down = kd_descend_in(node, state, t);
      vectors.kd_descend.push_back(down);
      index = reference::kd_descend(down).node;
      continue;
    }

    const auto leaf = image.leaf(node.child);
    const auto cell = leaf_exit_in(leaf, state, t);
    vectors.leaf_exit.push_back(cell);
    const auto exit = reference::leaf_exit(cell);
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      const auto test = tri_test_in(image.triangle(image.reference(leaf, i)), state);
      vectors.tri_test.push_back(test);
      const auto hit = reference::tri_test(test);
      if (!hit.hit || hit.t > best.t || (hit.t == best.t && hit.id >= best.id)) continue;
      best = {.status = contract::kStatusHit,
              .t = hit.t,
              .id = hit.id,
              .edge_u = hit.edge_u,
              .edge_v = hit.edge_v,
              .dz = hit.dz,
              .exponent_u = hit.exponent_u,
              .exponent_v = hit.exponent_v};
    }
    walking = exit.exits && static_cast<std::int64_t>(best.t) > exit.t_exit && index != 0;
    t = exit.t_exit;

    std::uint32_t parent = leaf.parent;
    while (walking) {
      const WalkedNode above = node_of(image, parent);
      contract::KdBacktrackInRecord up;
      up.face = exit.face;
      up.plane = exit.plane;
      up.node = index;
      up.parent = parent;
      up.parent_split = above.split;
      up.parent_axis = above.axis;
      up.parent_child = above.child;
      vectors.kd_backtrack.push_back(up);
      const auto turn = reference::kd_backtrack(up);
      index = turn.node;
      parent = above.parent;
      walking = !turn.finished;
      if (turn.matched) break;
    }
  }
  vectors.hit_finish.push_back(best);
}

}  // namespace

void record_walks(const MemoryImage& image, std::span<const GridRay> rays, SceneVectors& vectors) {
  for (const auto& ray : rays)
    if (!ray.outside) record_walk(image, ray.record, vectors);
}

}  // namespace retrace::cosim
