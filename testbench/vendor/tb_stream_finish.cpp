// Testbench of stream_finish for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_finish {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][10] = {
#include "data/stream_finish.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

static int run() {
  hls::stream<ray_state_word_t> states("states");
  hls::stream<hit_word_t> hits("hits");
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    states.write(join<ray_state_word_t>(kRows[i], 8));
    stream_finish(states, hits, 1);
    wrong += compare("stream_finish", "hit", i, hits.read(), kRows[i] + 8, 2);
  }
  return report("stream_finish", kCount, wrong);
}

}  // namespace bench_stream_finish
RETRACE_BENCH_MAIN(bench_stream_finish::run)
