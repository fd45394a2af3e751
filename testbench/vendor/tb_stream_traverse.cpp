// Testbench of stream_traverse for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_traverse {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][24] = {
#include "data/stream_traverse.inc"
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
    RETRACE_BENCH_MEMORY(4, voxel_memory);
    stream_traverse(rays, in, out, grid_memory, voxel_memory, kGridLines, 1);
    wrong += compare("stream_traverse", "state", i, out.read(), kRows[i] + 16, 8);
  }
  return report("stream_traverse", kCount, wrong);
}

}  // namespace bench_stream_traverse
RETRACE_BENCH_MAIN(bench_stream_traverse::run)
