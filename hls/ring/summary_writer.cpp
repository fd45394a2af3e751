// Task summary_writer of the ring: status of the run and its totals to memory.
#include "../top/trace.hpp"
#include "tasks.hpp"

extern "C" void ring_summary_writer(hls::stream<retrace::hls::ring_word64_t>& totals,
                                    retrace::hls::ring_word64_t* summary, ap_uint<32> fault) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=totals
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=summary offset=direct bundle=bus_summary
#endif
  // clang-format on
SUMMARY_WRITER:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one word a clock
    if (i == kSummaryWords) break;
    ring_word64_t word = ring_word64_t(fault);
    if (i != kSummaryStatus) word = totals.read();
    summary[i] = word;
  }
}
