// The branching variant of the streaming machine: a ray stays until it is done. A turn of the loop is a step of traverse or of intersect, of which
// the other one idles; the next turn needs what this one made, so the interval is the latency of a step: a processor of this kind has many such loops
// side by side, or many rays in one.
#include "kernels.hpp"
#include "steps.hpp"

extern "C" void stream_trace(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                             hls::stream<retrace::hls::ray_state_word_t>& states, const retrace::hls::word_t* grid,
                             const retrace::hls::word_t* voxels, const retrace::hls::word_t* list,
                             const retrace::hls::line_t* triangles, ap_uint<64>* summary, ap_uint<32> image_lines,
                             ap_uint<32> first, ap_uint<32> count) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=states
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#pragma HLS interface mode=m_axi port=voxels offset=direct bundle=bus_voxels
#pragma HLS interface mode=m_axi port=list offset=direct bundle=bus_list
#pragma HLS interface mode=m_axi port=triangles offset=direct bundle=bus_triangles
#pragma HLS interface mode=m_axi port=summary offset=direct bundle=bus_summary
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(voxels, gmem_voxels, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(list, gmem_list, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(triangles, gmem_triangles, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(summary, gmem_summary, RETRACE_COSIM_STREAM_SUMMARY_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(first)
  RT_CONTROL(count)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
  ap_uint<64> all_voxels = 0, all_tests = 0, all_steps = 0;
  ap_uint<32> done = 0;
  ray_setup_out_record ray = {};
  ray_state_record state = {};
  state.kernel = contract::kKernelDone;
TRACE:
  for (long long turn = 0; turn < kStreamTurns; ++turn) {
    RT_PIPELINE(64)  // the latency of a step
    if (done == count) break;
    if (state.kernel == contract::kKernelDone) {
      const ray_setup_out_word_t ray_word = rays.read();
      ray = read_ray_setup_out(ray_word);
      ap_uint<32> number = first;
      number += done;
      state = begin_ray(ray, view, number);
      if (fault != kFaultNone) ray_fails(state, contract::kStatusBadRecord);
    } else if (state.kernel == contract::kKernelTraverse) {
      state = traverse_step(ray, state, view, voxels);
      all_steps += 1;
    } else {
      state = intersect_step(ray, state, view, list, triangles);
      all_steps += 1;
    }
    if (state.kernel == contract::kKernelDone) {
      all_voxels += state.voxels;
      all_tests += state.tests;
      done += 1;
      const ray_state_word_t state_word = write_ray_state(state);
      states.write(state_word);
    }
  }
  summary[kStreamStatus] = fault;
  summary[kStreamRays] = done;
  summary[kStreamVoxels] = all_voxels;
  summary[kStreamTests] = all_tests;
  summary[kStreamSteps] = all_steps;
}
