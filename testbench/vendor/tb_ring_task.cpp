// Testbench of one task of the ring for any C++ compiler and co-simulation: RETRACE_RING_TASK names it. Returns 0 on success.
#include "ring_task_bench.hpp"

int main() { return retrace_bench::ring::run_task(RETRACE_NAME(RETRACE_RING_TASK)); }
