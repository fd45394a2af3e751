// Testbench of hit_finish_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_hit_finish {

typedef retrace::hls::hit_finish_in_word_t in_word_t;
typedef retrace::hls::hit_word_t out_word_t;
extern "C" void hit_finish_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][6] = {
#include "data/hit_finish.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 4, 2>(
      "hit_finish", kVectors,
      [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { hit_finish_top(in, out); });
}

}  // namespace bench_hit_finish
RETRACE_BENCH_MAIN(bench_hit_finish::run)
