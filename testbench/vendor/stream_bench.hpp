// What the testbenches of the streaming machine's kernels share: the grid image, and rows of recorded words. Needs a compiler with C++17 and ap_types.
#pragma once
#include "../../hls/streaming/kernels.hpp"
#include "stage_bench.hpp"

namespace retrace_bench {

static const unsigned long long kGridWords[] = {
#include "data/grid.inc"
};
static const int kGridLines = sizeof(kGridWords) / 64;
static_assert(4 * kGridLines <= RETRACE_COSIM_IMAGE_WORDS, "the grid is larger than the ports' depth");

// As large as the depths of the ports say, and a copy for each port: co-simulation gives every port a memory of its own.
static retrace::hls::word_t grid_memory[RETRACE_COSIM_IMAGE_WORDS], voxel_memory[RETRACE_COSIM_IMAGE_WORDS];
static retrace::hls::word_t list_memory[RETRACE_COSIM_IMAGE_WORDS];
static retrace::hls::line_t triangle_memory[RETRACE_COSIM_IMAGE_WORDS];

inline void load_grid() {
  for (int i = 0; i < RETRACE_COSIM_IMAGE_WORDS; ++i) {
    retrace::hls::word_t word = 0;
    retrace::hls::line_t line = 0;
    if (i < 4 * kGridLines) word = join<retrace::hls::word_t>(kGridWords + 2 * i, 2);
    if (i < kGridLines) line = join<retrace::hls::line_t>(kGridWords + 8 * i, 8);
    grid_memory[i] = voxel_memory[i] = list_memory[i] = word;
    triangle_memory[i] = line;
  }
}

/// Compares word `result` of a row with what was recorded; returns 1 if it differs.
template <typename Word>
int compare(const char* kernel, const char* what, int row, const Word& result, const unsigned long long* recorded,
            int words) {
  const Word expected = join<Word>(recorded, words);
  if (result == expected) return 0;
  std::printf("%s: record %d differs in its %s\n", kernel, row, what);
  print("expected", expected, words);
  print("result", result, words);
  return 1;
}

inline int report(const char* kernel, int rows, int wrong) {
  std::printf("%-17s %d records, %d words differ\n", kernel, rows, wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace retrace_bench
