// Testbench of stream_setup for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_setup {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][16] = {
#include "data/stream_setup.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

static int run() {
  load_grid();
  hls::stream<ray_setup_out_word_t> rays("rays");
  hls::stream<ray_state_word_t> out("out");
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    rays.write(join<ray_setup_out_word_t>(kRows[i], 8));
    RETRACE_BENCH_MEMORY(2, grid_memory);
    stream_setup(rays, out, grid_memory, kGridLines, 0, 1);
    wrong += compare("stream_setup", "state", i, out.read(), kRows[i] + 8, 8);
  }
  return report("stream_setup", kCount, wrong);
}

}  // namespace bench_stream_setup
RETRACE_BENCH_MAIN(bench_stream_setup::run)
