// Streaming top of hit_finish: one record in, one record out, every clock.
#include "hit_finish.hpp"

#include "../include/stream.hpp"

extern "C" void hit_finish_top(hls::stream<retrace::hls::hit_finish_in_word_t>& in,
                               hls::stream<retrace::hls::hit_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::hit_finish_in_word_t input = in.read();
  const retrace::hls::hit_finish_in_record record = retrace::hls::read_hit_finish_in(input);
  const retrace::hls::hit_record result = retrace::hls::hit_finish(record);
  const retrace::hls::hit_word_t output = retrace::hls::write_hit(result);
  out.write(output);
}
