// Testbench of stream_intersect for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_intersect {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][24] = {
#include "data/stream_intersect.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

static int run() {
  load_grid();
  hls::stream<ray_setup_out_word_t> rays("rays");
  hls::stream<ray_state_word_t> in("in"), out("out");
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    rays.write(join<ray_setup_out_word_t>(kRows[i], 8));
    in.write(join<ray_state_word_t>(kRows[i] + 8, 8));
    RETRACE_BENCH_MEMORY(3, grid_memory);
    RETRACE_BENCH_MEMORY(4, list_memory);
    RETRACE_BENCH_MEMORY(5, triangle_memory);
    stream_intersect(rays, in, out, grid_memory, list_memory, triangle_memory, kGridLines, 1);
    wrong += compare("stream_intersect", "state", i, out.read(), kRows[i] + 16, 8);
  }
  return report("stream_intersect", kCount, wrong);
}

}  // namespace bench_stream_intersect
RETRACE_BENCH_MAIN(bench_stream_intersect::run)
