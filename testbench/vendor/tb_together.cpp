// The testbenches of all stages and of all kernels of the streaming machine one after the other, in one translation unit that reads ap_int.h once.
// Returns 0 if all succeed.
#define RETRACE_BENCHES_TOGETHER
#include "tb_hit_finish.cpp"
#include "tb_instance_enter.cpp"
#include "tb_kd_backtrack.cpp"
#include "tb_kd_descend.cpp"
#include "tb_leaf_exit.cpp"
#include "tb_ray_setup.cpp"
#include "tb_stream_finish.cpp"
#include "tb_stream_generate.cpp"
#include "tb_stream_intersect.cpp"
#include "tb_stream_setup.cpp"
#include "tb_stream_shade.cpp"
#include "tb_stream_trace.cpp"
#include "tb_stream_traverse.cpp"
#include "tb_tri_test.cpp"

int main() {
  int wrong = 0;
  wrong += bench_ray_setup::run();
  wrong += bench_kd_descend::run();
  wrong += bench_leaf_exit::run();
  wrong += bench_kd_backtrack::run();
  wrong += bench_tri_test::run();
  wrong += bench_hit_finish::run();
  wrong += bench_instance_enter::run();
  wrong += bench_stream_generate::run();
  wrong += bench_stream_setup::run();
  wrong += bench_stream_traverse::run();
  wrong += bench_stream_intersect::run();
  wrong += bench_stream_finish::run();
  wrong += bench_stream_shade::run();
  wrong += bench_stream_trace::run();
  return wrong == 0 ? 0 : 1;
}
