// Testbench of stream_trace for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_trace {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][16] = {
#include "data/stream_trace.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);
static_assert(kStreamSummaryWords == RETRACE_COSIM_STREAM_SUMMARY_WORDS, "depth of the summary");

static int run() {
  load_grid();
  hls::stream<ray_setup_out_word_t> rays("rays");
  hls::stream<ray_state_word_t> out("out");
  static ap_uint<64> summary[kStreamSummaryWords];
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    rays.write(join<ray_setup_out_word_t>(kRows[i], 8));
    RETRACE_BENCH_MEMORY(2, grid_memory);
    RETRACE_BENCH_MEMORY(3, voxel_memory);
    RETRACE_BENCH_MEMORY(4, list_memory);
    RETRACE_BENCH_MEMORY(5, triangle_memory);
    RETRACE_BENCH_MEMORY(6, summary);
    stream_trace(rays, out, grid_memory, voxel_memory, list_memory, triangle_memory, summary, kGridLines, 0, 1);
    if (summary[kStreamStatus] != kFaultNone || summary[kStreamRays] != 1) ++wrong;
    wrong += compare("stream_trace", "state", i, out.read(), kRows[i] + 8, 8);
  }
  return report("stream_trace", kCount, wrong);
}

}  // namespace bench_stream_trace
RETRACE_BENCH_MAIN(bench_stream_trace::run)
