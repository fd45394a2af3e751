#include "scene_vectors.hpp"

#include "golden/tree/instance.hpp"
#include "testbench/kit/reference.hpp"

namespace retrace::cosim {
namespace {

struct Node {
  std::int32_t split;
  std::uint32_t axis, child, parent;
};

Node node_of(const MemoryImage& image, std::uint32_t index) {
  const auto pair = image.pair(index >> 1);
  if (index & 1) return {pair.right_split, pair.right_axis, pair.right_child, pair.parent};
  return {pair.left_split, pair.left_axis, pair.left_child, pair.parent};
}

/// The scene as an object, half as large and turned about two axes.
contract::InstanceEnterInRecord record_entry(const MemoryImage& image, const contract::RayRecord& ray) {
  const glm::dmat3 about_z(0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0),
      about_x(1.0, 0.0, 0.0, 0.0, 0.8, 0.6, 0.0, -0.6, 0.8);
  std::array<std::int32_t, 6> box{};
  for (std::size_t face = 0; face < 6; ++face)
    box[face] = static_cast<std::int32_t>(static_cast<std::int32_t>(image.header().box[face]) * kObjectReach);
  const auto record = make_instance({0.5 * about_z * about_x, glm::dvec3(0.1, -0.05, 0.02)}, box, 0, 0).value();
  contract::InstanceEnterInRecord in;
  in.m = record.m;
  in.b = record.b;
  in.e = record.e;
  in.box = record.box;
  in.origin = ray.origin;
  in.direction = ray.direction;
  in.reach = ray.t_max + 1;
  return in;
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
    const Node node = node_of(image, index);
    if (node.axis != contract::kAxisLeaf) {
      contract::KdDescendInRecord down;
      down.split = node.split;
      down.child = node.child;
      down.origin = state.origin[node.axis];
      down.reciprocal = state.reciprocal[node.axis];
      down.shift = state.shift[node.axis];
      down.zero = state.zero[node.axis];
      down.negative = state.negative[node.axis];
      down.t = t;
      vectors.kd_descend.push_back(down);
      index = reference::kd_descend(down).node;
      continue;
    }

    const auto leaf = image.leaf(node.child);
    contract::LeafExitInRecord cell;
    cell.bound = leaf.bound;
    cell.origin = state.origin;
    cell.reciprocal = state.reciprocal;
    cell.shift = state.shift;
    cell.zero = state.zero;
    cell.negative = state.negative;
    cell.t = t;
    vectors.leaf_exit.push_back(cell);
    const auto exit = reference::leaf_exit(cell);
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      const auto triangle = image.triangle(image.reference(leaf, i));
      contract::TriTestInRecord test;
      test.u = triangle.u;
      test.v = triangle.v;
      test.n = triangle.n;
      test.offset_u = triangle.offset_u;
      test.offset_v = triangle.offset_v;
      test.offset_n = triangle.offset_n;
      test.exponent_u = triangle.exponent_u;
      test.exponent_v = triangle.exponent_v;
      test.id = triangle.id;
      test.origin = state.origin;
      test.direction = state.direction;
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
      const Node above = node_of(image, parent);
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
