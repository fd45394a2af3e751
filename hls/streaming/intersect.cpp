// Kernel intersect of the streaming machine: one triangle. Reads 4 bytes through port `list` and the 48 of a triangle through port `triangles`.
#include "kernels.hpp"
#include "steps.hpp"

extern "C" void stream_intersect(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                                 hls::stream<retrace::hls::ray_state_word_t>& in,
                                 hls::stream<retrace::hls::ray_state_word_t>& out, const retrace::hls::word_t* grid,
                                 const retrace::hls::word_t* list, const retrace::hls::line_t* triangles,
                                 ap_uint<32> image_lines, ap_uint<32> count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#pragma HLS interface mode=m_axi port=list offset=direct bundle=bus_list
#pragma HLS interface mode=m_axi port=triangles offset=direct bundle=bus_triangles
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(list, gmem_list, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(triangles, gmem_triangles, RETRACE_COSIM_IMAGE_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(count)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
INTERSECT:
  for (int i = 0; i < kMostRays; ++i) {
    RT_PIPELINE(1)  // one read through each port a ray
    if (ap_uint<32>(i) >= count) break;
    const ray_setup_out_word_t ray_word = rays.read();
    const ray_setup_out_record ray = read_ray_setup_out(ray_word);
    const ray_state_word_t in_word = in.read();
    ray_state_record state = read_ray_state(in_word);
    if (fault != kFaultNone) {
      ray_fails(state, retrace::contract::kStatusBadRecord);
    } else if (state.kernel == retrace::contract::kKernelIntersect) {
      state = intersect_step(ray, state, view, list, triangles);
    }
    const ray_state_word_t out_word = write_ray_state(state);
    out.write(out_word);
  }
}
