// Streaming top of leaf_exit: one record in, one record out, every clock.
#include "leaf_exit.hpp"

#include "../include/stream.hpp"

extern "C" void leaf_exit_top(hls::stream<retrace::hls::leaf_exit_in_word_t>& in,
                              hls::stream<retrace::hls::leaf_exit_out_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::leaf_exit_in_word_t input = in.read();
  const retrace::hls::leaf_exit_in_record record = retrace::hls::read_leaf_exit_in(input);
  const retrace::hls::leaf_exit_out_record result = retrace::hls::leaf_exit(record);
  const retrace::hls::leaf_exit_out_word_t output = retrace::hls::write_leaf_exit_out(result);
  out.write(output);
}
