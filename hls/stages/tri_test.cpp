// Streaming top of tri_test: one record in, one record out, every clock.
#include "tri_test.hpp"

#include "../include/stream.hpp"

extern "C" void tri_test_top(hls::stream<retrace::hls::tri_test_in_word_t>& in,
                             hls::stream<retrace::hls::tri_test_out_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::tri_test_in_word_t input = in.read();
  const retrace::hls::tri_test_in_record record = retrace::hls::read_tri_test_in(input);
  const retrace::hls::tri_test_out_record result = retrace::hls::tri_test(record);
  const retrace::hls::tri_test_out_word_t output = retrace::hls::write_tri_test_out(result);
  out.write(output);
}
