// Streaming top of kd_backtrack: one record in, one record out, every clock.
#include "kd_backtrack.hpp"

#include "../include/stream.hpp"

extern "C" void kd_backtrack_top(hls::stream<retrace::hls::kd_backtrack_in_word_t>& in,
                                 hls::stream<retrace::hls::kd_backtrack_out_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::kd_backtrack_in_word_t input = in.read();
  const retrace::hls::kd_backtrack_in_record record = retrace::hls::read_kd_backtrack_in(input);
  const retrace::hls::kd_backtrack_out_record result = retrace::hls::kd_backtrack(record);
  const retrace::hls::kd_backtrack_out_word_t output = retrace::hls::write_kd_backtrack_out(result);
  out.write(output);
}
