// Testbench of tri_test_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_tri_test {

typedef retrace::hls::tri_test_in_word_t in_word_t;
typedef retrace::hls::tri_test_out_word_t out_word_t;
extern "C" void tri_test_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][20] = {
#include "data/tri_test.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 16, 4>(
      "tri_test", kVectors, [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { tri_test_top(in, out); });
}

}  // namespace bench_tri_test
RETRACE_BENCH_MAIN(bench_tri_test::run)
