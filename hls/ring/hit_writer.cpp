// Task hit_writer of the ring: the hit of each ray to its place in memory.
#include "tasks.hpp"

extern "C" void ring_hit_writer(hls::stream<retrace::hls::token_word_t>& hits_in, retrace::hls::word_t* hits) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=hits_in
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=hits offset=direct bundle=bus_hits
#endif
  // clang-format on
HIT_WRITER:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one write a ray
    const token_word_t bits = hits_in.read();
    const ap_uint<64> tail = bits >> 128;
    const flag_t end = tail >> kRingEndBit;
    if (end) break;
    const ap_uint<32> index = tail;
    hits[index.to_uint()] = word_t(bits);
  }
}
