// Testbench of kd_backtrack_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_kd_backtrack {

typedef retrace::hls::kd_backtrack_in_word_t in_word_t;
typedef retrace::hls::kd_backtrack_out_word_t out_word_t;
extern "C" void kd_backtrack_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][5] = {
#include "data/kd_backtrack.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 4, 1>(
      "kd_backtrack", kVectors,
      [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { kd_backtrack_top(in, out); });
}

}  // namespace bench_kd_backtrack
RETRACE_BENCH_MAIN(bench_kd_backtrack::run)
