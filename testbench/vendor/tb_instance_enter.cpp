// Testbench of instance_enter_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_instance_enter {

typedef retrace::hls::instance_enter_in_word_t in_word_t;
typedef retrace::hls::instance_enter_out_word_t out_word_t;
extern "C" void instance_enter_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][24] = {
#include "data/instance_enter.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 16, 8>(
      "instance_enter", kVectors,
      [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { instance_enter_top(in, out); });
}

}  // namespace bench_instance_enter
RETRACE_BENCH_MAIN(bench_instance_enter::run)
