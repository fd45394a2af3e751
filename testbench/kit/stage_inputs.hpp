// What a walk in integers gives to each stage: the records of the image and the state of the ray, put together as the kernel does.
#pragma once
#include "golden/contract/contract_records.hpp"
#include "golden/engine/instance_ray.hpp"
#include "golden/tree/memory_image.hpp"

namespace retrace {

struct WalkedNode {
  std::int32_t split;
  std::uint32_t axis, child, parent;
};

inline WalkedNode node_of(const MemoryImage& image, std::uint32_t index) {
  const auto pair = image.pair(index >> 1);
  if (index & 1) return {pair.right_split, pair.right_axis, pair.right_child, pair.parent};
  return {pair.left_split, pair.left_axis, pair.left_child, pair.parent};
}

/// `t` is where the ray stands.
inline contract::KdDescendInRecord kd_descend_in(const WalkedNode& node, const contract::RaySetupOutRecord& ray,
                                                 std::int32_t t) {
  contract::KdDescendInRecord in;
  in.split = node.split;
  in.child = node.child;
  in.origin = ray.origin[node.axis];
  in.reciprocal = ray.reciprocal[node.axis];
  in.shift = ray.shift[node.axis];
  in.zero = ray.zero[node.axis];
  in.negative = ray.negative[node.axis];
  in.t = t;
  return in;
}

inline contract::LeafExitInRecord leaf_exit_in(const contract::LeafRecord& leaf, const contract::RaySetupOutRecord& ray,
                                               std::int32_t t) {
  contract::LeafExitInRecord in;
  in.bound = leaf.bound;
  in.origin = ray.origin;
  in.reciprocal = ray.reciprocal;
  in.shift = ray.shift;
  in.zero = ray.zero;
  in.negative = ray.negative;
  in.t = t;
  return in;
}

inline contract::TriTestInRecord tri_test_in(const contract::TriangleRecord& triangle,
                                             const contract::RaySetupOutRecord& ray) {
  contract::TriTestInRecord in;
  in.u = triangle.u;
  in.v = triangle.v;
  in.n = triangle.n;
  in.offset_u = triangle.offset_u;
  in.offset_v = triangle.offset_v;
  in.offset_n = triangle.offset_n;
  in.exponent_u = triangle.exponent_u;
  in.exponent_v = triangle.exponent_v;
  in.id = triangle.id;
  in.origin = ray.origin;
  in.direction = ray.direction;
  return in;
}

}  // namespace retrace
