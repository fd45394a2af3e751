// Testbench of leaf_exit_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_leaf_exit {

typedef retrace::hls::leaf_exit_in_word_t in_word_t;
typedef retrace::hls::leaf_exit_out_word_t out_word_t;
extern "C" void leaf_exit_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][9] = {
#include "data/leaf_exit.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 8, 1>(
      "leaf_exit", kVectors, [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { leaf_exit_top(in, out); });
}

}  // namespace bench_leaf_exit
RETRACE_BENCH_MAIN(bench_leaf_exit::run)
