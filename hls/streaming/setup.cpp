// Kernel setup of the streaming machine: a ray enters the grid. Three divisions of 27 by 27 bits, of which 10 bits of the quotient count.
#include "kernels.hpp"
#include "steps.hpp"

extern "C" void stream_setup(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                             hls::stream<retrace::hls::ray_state_word_t>& states, const retrace::hls::word_t* grid,
                             ap_uint<32> image_lines, ap_uint<32> first, ap_uint<32> count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=states
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(first)
  RT_CONTROL(count)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
SETUP:
  for (int i = 0; i < kMostRays; ++i) {
    RT_PIPELINE(1)  // one ray a clock, the rate of ray_setup
    if (ap_uint<32>(i) >= count) break;
    const ray_setup_out_word_t ray_word = rays.read();
    const ray_setup_out_record ray = read_ray_setup_out(ray_word);
    ap_uint<32> number = first;
    number += ap_uint<32>(i);
    if (fault != kFaultNone) {
      ray_state_record failed = {};
      failed.id = retrace::contract::kNoTriangle;
      failed.ray = number;
      ray_fails(failed, retrace::contract::kStatusBadRecord);
      const ray_state_word_t failed_word = write_ray_state(failed);
      states.write(failed_word);
    } else {
      const ray_state_record state = begin_ray(ray, view, number);
      const ray_state_word_t state_word = write_ray_state(state);
      states.write(state_word);
    }
  }
}
