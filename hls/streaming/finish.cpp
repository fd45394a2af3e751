// Kernel finish of the streaming machine: the hit record of a ray that is done, by hit_finish.
#include "kernels.hpp"
#include "steps.hpp"

extern "C" void stream_finish(hls::stream<retrace::hls::ray_state_word_t>& states,
                              hls::stream<retrace::hls::hit_word_t>& hits, ap_uint<32> count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=states
#pragma HLS interface mode=axis port=hits
  RT_CONTROL(count)
  RT_CONTROL(return)
  // clang-format on
FINISH:
  for (int i = 0; i < kMostRays; ++i) {
    RT_PIPELINE(8)  // two dividers of 27 bits, once a ray
    if (ap_uint<32>(i) >= count) break;
    const ray_state_word_t state_word = states.read();
    const ray_state_record state = read_ray_state(state_word);
    const hit_record hit = finished_hit(state);
    const hit_word_t hit_word = write_hit(hit);
    hits.write(hit_word);
  }
}
