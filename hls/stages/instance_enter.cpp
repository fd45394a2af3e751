// Streaming top of instance_enter: one record in, one record out, every clock.
#include "instance_enter.hpp"

#include "../include/stream.hpp"

extern "C" void instance_enter_top(hls::stream<retrace::hls::instance_enter_in_word_t>& in,
                                   hls::stream<retrace::hls::instance_enter_out_word_t>& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const retrace::hls::instance_enter_in_word_t input = in.read();
  const retrace::hls::instance_enter_in_record record = retrace::hls::read_instance_enter_in(input);
  const retrace::hls::instance_enter_out_record result = retrace::hls::instance_enter(record);
  const retrace::hls::instance_enter_out_word_t output = retrace::hls::write_instance_enter_out(result);
  out.write(output);
}
