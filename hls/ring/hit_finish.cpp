// Task hit_finish of the ring: barycentric coordinates of the hits.
#include "../stages/hit_finish.hpp"
#include "tasks.hpp"

extern "C" void ring_hit_finish(hls::stream<retrace::hls::token_data_t>& finishes,
                                hls::stream<retrace::hls::token_word_t>& hits_out) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=finishes
#pragma HLS interface mode=axis port=hits_out
  // clang-format on
HIT_FINISH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(8)  // two dividers shared in time; a ray takes more laps than that
    const token_data_t bits = finishes.read();
    const ap_uint<64> tail = bits >> 256;  // number of the ray, end
    token_word_t hit = tail;
    hit <<= 128;
    const hit_finish_in_word_t input = bits;
    hit |= token_word_t(write_hit(hit_finish(read_hit_finish_in(input))));
    hits_out.write(hit);
    const flag_t end = tail >> kRingEndBit;
    if (end) break;
  }
}
