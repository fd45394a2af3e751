// The steps of the streaming machine, each a function of the ray, what changes of it, and one record of memory.
//
//   begin       voxel i of the origin: floor((origin - lower) / side), clamped to the grid
//   leave       t_plane(lower + (i + forward) side), for each axis that the ray moves along
//   traverse    on through the nearest of the three planes (lowest axis on a tie), unless the best hit is not behind it
//   intersect   the next triangle of the voxel's list, by the unit-triangle test (hls/stages/tri_test.hpp)
//
// Planes are integers and t_plane is the one of the kd-tree's cells, monotone in the plane, so that a ray stays inside its voxel widened by the
// error of a plane, and a triangle that is referenced from every voxel, widened by kWiden, that it touches is not lost (docs/error-bounds.md).
// A hit beyond the voxel is kept, as in golden/accel/grid.cpp: the walk ends in the voxel that holds the best hit.
//
// Source: T. Purcell, I. Buck, W. Mark, P. Hanrahan: Ray Tracing on Programmable Graphics Hardware, SIGGRAPH 2002; Amanatides & Woo 1987.
// Counterpart: testbench/streaming/grid_walk.cpp, in plain integers.
#pragma once
#include "../stages/hit_finish.hpp"
#include "../stages/tri_test.hpp"
#include "grid_view.hpp"

namespace retrace::hls {

// The plane through which the ray leaves voxel i of an axis: t of it, the format's largest on an axis that the ray does not move along.
inline t_t leave_t(const ray_setup_out_record& ray, const grid_view& view, const voxel_t& voxel, int axis) {
  RT_INLINE
  ap_uint<11> planes = voxel;
  if (!ray.negative[axis]) planes += 1;
  position_t plane = view.side[axis];
  plane *= planes;
  plane += view.lower[axis];
  t_t t = (1 << (contract::kTBits - 1)) - 1;
  if (!ray.zero[axis]) t = t_plane(plane, ray.origin[axis], ray.reciprocal[axis], ray.shift[axis]);
  return t;
}

inline void ray_fails(ray_state_record& state, int status) {
  RT_INLINE
  state.status = status;
  state.kernel = contract::kKernelDone;
}

// Counts a step; false if the ray has used up the image's limit.
inline bool ray_steps(ray_state_record& state, const grid_view& view) {
  RT_INLINE
  if (state.steps >= view.step_limit) {
    ray_fails(state, contract::kStatusStepLimit);
    return false;
  }
  state.steps += 1;
  return true;
}

inline ray_state_record begin_ray(const ray_setup_out_record& ray, const grid_view& view, const ap_uint<32>& number) {
  RT_INLINE
  ray_state_record state;
  state.kernel = contract::kKernelTraverse;
  state.fresh = 1;
  state.entry = 0;
  state.steps = 0;
  state.voxels = 0;
  state.tests = 0;
  state.status = contract::kStatusMiss;
  state.found = 0;
  state.t = ray.t_max;
  state.id = contract::kNoTriangle;
  state.edge_u = 0;
  state.edge_v = 0;
  state.dz = 0;
  state.exponent_u = 0;
  state.exponent_v = 0;
  state.ray = number;
AXES:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    position_t offset = ray.origin[axis] - view.lower[axis];
    if (offset < 0) offset = 0;
    const ap_uint<contract::kPositionBits> distance = offset;
    const ap_uint<contract::kPositionBits> side = view.side[axis];
    const ap_uint<contract::kPositionBits> quotient = distance / side;
    voxel_t voxel = view.resolution[axis] - 1;
    if (quotient < view.resolution[axis]) voxel = quotient;
    state.voxel[axis] = voxel;
    state.leave[axis] = leave_t(ray, view, voxel, axis);
  }
  if (!ray.valid) ray_fails(state, contract::kStatusBadRay);
  return state;
}

// Goes on to the next voxel, if the ray has been in one, and looks up its list.
inline ray_state_record traverse_step(const ray_setup_out_record& ray, const ray_state_record& in,
                                      const grid_view& view, const word_t* voxels) {
  RT_INLINE
  ray_state_record state = in;
  if (!ray_steps(state, view)) return state;
  if (!state.fresh) {
    ap_uint<2> axis = 3;
    t_t nearest = 0;
  AXES:
    for (int a = 0; a < 3; ++a) {
      RT_UNROLL
      if (!ray.zero[a] && (axis == 3 || state.leave[a] < nearest)) {
        axis = a;
        nearest = state.leave[a];
      }
    }
    if (axis == 3) {  // a valid ray moves; this one comes out of a damaged record
      ray_fails(state, contract::kStatusBadRay);
      return state;
    }
    const int a = axis.to_int();
    const flag_t last = ray.negative[a] ? flag_t(state.voxel[a] == 0)
                                        : flag_t(ap_uint<11>(state.voxel[a]) + ap_uint<11>(1) >= view.resolution[a]);
    if (last || state.t <= nearest) {
      state.kernel = contract::kKernelDone;
      return state;
    }
    if (ray.negative[a]) {
      state.voxel[a] -= 1;
    } else {
      state.voxel[a] += 1;
    }
    state.leave[a] = leave_t(ray, view, state.voxel[a], a);
  }
  state.fresh = 0;
  state.voxels += 1;
  // A voxel of a damaged record may lie outside.
  if (state.voxel[0] >= view.resolution[0] || state.voxel[1] >= view.resolution[1] ||
      state.voxel[2] >= view.resolution[2]) {
    ray_fails(state, contract::kStatusBadIndex);
    return state;
  }
  voxel_number_t number = state.voxel[2];
  number *= view.resolution[1];
  number += state.voxel[1];
  number *= view.resolution[0];
  number += state.voxel[0];
  const ap_uint<32> list = grid_entry(voxels, view.voxel_offset, number);
  if (list != contract::kGridEmpty) {
    if (list >= view.list_count) {
      ray_fails(state, contract::kStatusBadIndex);
    } else {
      state.entry = list;
      state.kernel = contract::kKernelIntersect;
    }
  }
  return state;
}

// Tests the next triangle of the list.
inline ray_state_record intersect_step(const ray_setup_out_record& ray, const ray_state_record& in,
                                       const grid_view& view, const word_t* list, const line_t* triangles) {
  RT_INLINE
  ray_state_record state = in;
  if (!ray_steps(state, view)) return state;
  if (state.entry >= view.list_count) {  // no list ends beyond the section
    ray_fails(state, contract::kStatusBadIndex);
    return state;
  }
  const ap_uint<32> entry = grid_entry(list, view.list_offset, state.entry);
  const flag_t last = entry >> contract::kGridLastLog2;
  ap_uint<32> index = entry;
  index[contract::kGridLastLog2] = 0;
  if (index >= view.triangle_count) {
    ray_fails(state, contract::kStatusBadIndex);
    return state;
  }
  const line_t line = triangles[(view.triangle_offset + index).to_uint()];
  word_t words[kTriangleWords];
  words[0] = line;
  words[1] = line >> 128;
  words[2] = line >> 256;
  const triangle_record triangle = unpack_triangle(words);
  tri_test_in_record test;
COPY:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    test.origin[axis] = ray.origin[axis];
    test.direction[axis] = ray.direction[axis];
    test.u[axis] = triangle.u[axis];
    test.v[axis] = triangle.v[axis];
    test.n[axis] = triangle.n[axis];
  }
  test.offset_u = triangle.offset_u;
  test.offset_v = triangle.offset_v;
  test.offset_n = triangle.offset_n;
  test.exponent_u = triangle.exponent_u;
  test.exponent_v = triangle.exponent_v;
  test.id = triangle.id;
  const tri_test_out_record candidate = tri_test(test);
  state.tests += 1;
  state.entry += 1;
  if (last) state.kernel = contract::kKernelTraverse;
  if (candidate.hit && is_nearer(candidate.t, candidate.id, state.t, state.id)) {
    state.found = 1;
    state.t = candidate.t;
    state.id = candidate.id;
    state.edge_u = candidate.edge_u;
    state.edge_v = candidate.edge_v;
    state.dz = candidate.dz;
    state.exponent_u = candidate.exponent_u;
    state.exponent_v = candidate.exponent_v;
    if (ray.any) state.kernel = contract::kKernelDone;
  }
  return state;
}

inline hit_record finished_hit(const ray_state_record& state) {
  RT_INLINE
  hit_finish_in_record best;
  best.status = state.status;
  if (state.status == contract::kStatusMiss && state.found) best.status = contract::kStatusHit;
  best.t = state.t;
  best.id = state.id;
  best.edge_u = state.edge_u;
  best.edge_v = state.edge_v;
  best.dz = state.dz;
  best.exponent_u = state.exponent_u;
  best.exponent_v = state.exponent_v;
  return hit_finish(best);
}

}  // namespace retrace::hls
