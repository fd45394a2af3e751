// Kernel traverse of the streaming machine: one voxel. Reads 4 bytes, through port `voxels`.
#include "kernels.hpp"
#include "steps.hpp"

extern "C" void stream_traverse(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                                hls::stream<retrace::hls::ray_state_word_t>& in,
                                hls::stream<retrace::hls::ray_state_word_t>& out, const retrace::hls::word_t* grid,
                                const retrace::hls::word_t* voxels, ap_uint<32> image_lines, ap_uint<32> count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#pragma HLS interface mode=m_axi port=voxels offset=direct bundle=bus_voxels
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(voxels, gmem_voxels, RETRACE_COSIM_IMAGE_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(count)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
TRAVERSE:
  for (int i = 0; i < kMostRays; ++i) {
    RT_PIPELINE(1)  // one read of memory a ray
    if (ap_uint<32>(i) >= count) break;
    const ray_setup_out_word_t ray_word = rays.read();
    const ray_setup_out_record ray = read_ray_setup_out(ray_word);
    const ray_state_word_t in_word = in.read();
    ray_state_record state = read_ray_state(in_word);
    if (fault != kFaultNone) {
      ray_fails(state, retrace::contract::kStatusBadRecord);
    } else if (state.kernel == retrace::contract::kKernelTraverse) {
      state = traverse_step(ray, state, view, voxels);
    }
    const ray_state_word_t out_word = write_ray_state(state);
    out.write(out_word);
  }
}
