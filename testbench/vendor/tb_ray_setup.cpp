// Testbench of ray_setup_top for csim_design, cosim_design and any C++ compiler: returns 0 on success.
#include "stage_bench.hpp"

namespace bench_ray_setup {

typedef retrace::hls::ray_setup_in_word_t in_word_t;
typedef retrace::hls::ray_setup_out_word_t out_word_t;
extern "C" void ray_setup_top(hls::stream<in_word_t>& in, hls::stream<out_word_t>& out);

static const unsigned long long kVectors[][16] = {
#include "data/ray_setup.inc"
};

static int run() {
  return retrace_bench::run_stage<in_word_t, out_word_t, 8, 8>(
      "ray_setup", kVectors, [](hls::stream<in_word_t>& in, hls::stream<out_word_t>& out) { ray_setup_top(in, out); });
}

}  // namespace bench_ray_setup
RETRACE_BENCH_MAIN(bench_ray_setup::run)
