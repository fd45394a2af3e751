// Task work_writer of the ring: the work of each ray to its place in memory.
#include "tasks.hpp"

extern "C" void ring_work_writer(hls::stream<retrace::hls::token_word_t>& works, retrace::hls::word_t* work) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=works
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=work offset=direct bundle=bus_work
#endif
  // clang-format on
WORK_WRITER:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one write a ray
    const token_word_t bits = works.read();
    const ap_uint<64> tail = bits >> 128;
    const flag_t end = tail >> kRingEndBit;
    if (end) break;
    const ap_uint<32> index = tail;
    work[index.to_uint()] = word_t(bits);
  }
}
