// The HLS stage functions on host records: names match, so a field is copied to the field of the same name.
#pragma once
#include "golden/contract/contract_records.hpp"
#include "hls/stages/hit_finish.hpp"
#include "hls/stages/instance_enter.hpp"
#include "hls/stages/kd_backtrack.hpp"
#include "hls/stages/kd_descend.hpp"
#include "hls/stages/leaf_exit.hpp"
#include "hls/stages/ray_setup.hpp"
#include "hls/stages/tri_test.hpp"

namespace retrace::cosim {

namespace detail {
template <std::size_t Size, typename Code, typename Value>
void to_hls(const std::array<Value, Size>& from, Code (&to)[Size]) {
  for (std::size_t i = 0; i < Size; ++i) to[i] = from[i];
}
template <std::size_t Size, typename Code, typename Value>
void to_host(const Code (&from)[Size], std::array<Value, Size>& to) {
  for (std::size_t i = 0; i < Size; ++i) to[i] = static_cast<Value>(from[i]);
}
}  // namespace detail

inline contract::RaySetupOutRecord hls_ray_setup(const contract::RaySetupInRecord& host) {
  hls::ray_setup_in_record in;
  detail::to_hls(host.origin, in.origin);
  detail::to_hls(host.direction, in.direction);
  detail::to_hls(host.box, in.box);
  in.t_max = host.t_max;
  in.any = host.any;
  const hls::ray_setup_out_record out = hls::ray_setup(in);
  contract::RaySetupOutRecord result;
  detail::to_host(out.origin, result.origin);
  detail::to_host(out.direction, result.direction);
  detail::to_host(out.reciprocal, result.reciprocal);
  detail::to_host(out.shift, result.shift);
  detail::to_host(out.zero, result.zero);
  detail::to_host(out.negative, result.negative);
  result.t_max = out.t_max;
  result.any = out.any;
  result.valid = out.valid;
  return result;
}

inline contract::KdDescendOutRecord hls_kd_descend(const contract::KdDescendInRecord& host) {
  hls::kd_descend_in_record in;
  in.split = host.split;
  in.child = host.child;
  in.origin = host.origin;
  in.reciprocal = host.reciprocal;
  in.shift = host.shift;
  in.zero = host.zero;
  in.negative = host.negative;
  in.t = host.t;
  const hls::kd_descend_out_record out = hls::kd_descend(in);
  contract::KdDescendOutRecord result;
  result.node = out.node;
  return result;
}

inline contract::LeafExitOutRecord hls_leaf_exit(const contract::LeafExitInRecord& host) {
  hls::leaf_exit_in_record in;
  detail::to_hls(host.bound, in.bound);
  detail::to_hls(host.origin, in.origin);
  detail::to_hls(host.reciprocal, in.reciprocal);
  detail::to_hls(host.shift, in.shift);
  detail::to_hls(host.zero, in.zero);
  detail::to_hls(host.negative, in.negative);
  in.t = host.t;
  const hls::leaf_exit_out_record out = hls::leaf_exit(in);
  contract::LeafExitOutRecord result;
  result.t_exit = out.t_exit;
  result.face = out.face;
  result.plane = out.plane;
  result.exits = out.exits;
  result.broken = out.broken;
  return result;
}

inline contract::KdBacktrackOutRecord hls_kd_backtrack(const contract::KdBacktrackInRecord& host) {
  hls::kd_backtrack_in_record in;
  in.face = host.face;
  in.plane = host.plane;
  in.node = host.node;
  in.parent = host.parent;
  in.parent_split = host.parent_split;
  in.parent_axis = host.parent_axis;
  in.parent_child = host.parent_child;
  const hls::kd_backtrack_out_record out = hls::kd_backtrack(in);
  contract::KdBacktrackOutRecord result;
  result.node = out.node;
  result.matched = out.matched;
  result.finished = out.finished;
  result.bad = out.bad;
  return result;
}

inline contract::TriTestOutRecord hls_tri_test(const contract::TriTestInRecord& host) {
  hls::tri_test_in_record in;
  detail::to_hls(host.u, in.u);
  detail::to_hls(host.v, in.v);
  detail::to_hls(host.n, in.n);
  detail::to_hls(host.origin, in.origin);
  detail::to_hls(host.direction, in.direction);
  in.offset_u = host.offset_u;
  in.offset_v = host.offset_v;
  in.offset_n = host.offset_n;
  in.exponent_u = host.exponent_u;
  in.exponent_v = host.exponent_v;
  in.id = host.id;
  const hls::tri_test_out_record out = hls::tri_test(in);
  contract::TriTestOutRecord result;
  result.hit = out.hit;
  result.t = out.t;
  result.id = out.id;
  result.edge_u = out.edge_u;
  result.edge_v = out.edge_v;
  result.dz = out.dz;
  result.exponent_u = out.exponent_u;
  result.exponent_v = out.exponent_v;
  return result;
}

inline contract::HitRecord hls_hit_finish(const contract::HitFinishInRecord& host) {
  hls::hit_finish_in_record in;
  in.status = host.status;
  in.t = host.t;
  in.id = host.id;
  in.edge_u = host.edge_u;
  in.edge_v = host.edge_v;
  in.dz = host.dz;
  in.exponent_u = host.exponent_u;
  in.exponent_v = host.exponent_v;
  const hls::hit_record out = hls::hit_finish(in);
  contract::HitRecord result;
  result.t = out.t;
  result.reserved = out.reserved;
  result.status = out.status;
  result.id = out.id;
  result.u = out.u;
  result.v = out.v;
  return result;
}

inline contract::InstanceEnterOutRecord hls_instance_enter(const contract::InstanceEnterInRecord& host) {
  hls::instance_enter_in_record in;
  detail::to_hls(host.m, in.m);
  detail::to_hls(host.b, in.b);
  detail::to_hls(host.e, in.e);
  detail::to_hls(host.box, in.box);
  detail::to_hls(host.origin, in.origin);
  detail::to_hls(host.direction, in.direction);
  in.reach = host.reach;
  const hls::instance_enter_out_record out = hls::instance_enter(in);
  contract::InstanceEnterOutRecord result;
  detail::to_host(out.origin, result.origin);
  detail::to_host(out.direction, result.direction);
  detail::to_host(out.reciprocal, result.reciprocal);
  detail::to_host(out.shift, result.shift);
  detail::to_host(out.zero, result.zero);
  detail::to_host(out.negative, result.negative);
  result.t_max = out.t_max;
  result.scale = out.scale;
  result.start = out.start;
  result.enters = out.enters;
  result.bad = out.bad;
  return result;
}

}  // namespace retrace::cosim
