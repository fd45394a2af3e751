// Testbench of stream_intersect for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][24] = {
#include "data/stream_intersect.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

int main() {
  load_grid();
  hls::stream<ray_setup_out_word_t> rays("rays");
  hls::stream<ray_state_word_t> in("in"), out("out");
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    rays.write(join<ray_setup_out_word_t>(kRows[i], 8));
    in.write(join<ray_state_word_t>(kRows[i] + 8, 8));
    stream_intersect(rays, in, out, grid_memory, grid_memory, grid_lines, kGridLines, 1);
    wrong += compare("stream_intersect", "state", i, out.read(), kRows[i] + 16, 8);
  }
  return report("stream_intersect", kCount, wrong);
}
