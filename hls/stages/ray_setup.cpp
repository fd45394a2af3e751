// Streaming top of ray_setup: one record in, one record out, every clock.
#include "ray_setup.hpp"

#include "../include/stream.hpp"

extern "C" void ray_setup_top(hls::stream<retrace::hls::ray_setup_in_word_t>& in,
                              hls::stream<retrace::hls::ray_setup_out_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::ray_setup_in_word_t input = in.read();
  const retrace::hls::ray_setup_in_record record = retrace::hls::read_ray_setup_in(input);
  const retrace::hls::ray_setup_out_record result = retrace::hls::ray_setup(record);
  const retrace::hls::ray_setup_out_word_t output = retrace::hls::write_ray_setup_out(result);
  out.write(output);
}
