// What the testbenches of the streaming machine's kernels share: the grid image, and rows of recorded words. Needs a compiler with C++17 and ap_types.
#pragma once
#include "../../hls/streaming/kernels.hpp"
#include "stage_bench.hpp"

namespace retrace_bench {

static const unsigned long long kGridWords[] = {
#include "data/grid.inc"
};
static const int kGridLines = sizeof(kGridWords) / 64;
static retrace::hls::word_t grid_memory[4 * kGridLines];
static retrace::hls::line_t grid_lines[kGridLines];

inline void load_grid() {
  for (int i = 0; i < 4 * kGridLines; ++i) grid_memory[i] = join<retrace::hls::word_t>(kGridWords + 2 * i, 2);
  for (int i = 0; i < kGridLines; ++i) grid_lines[i] = join<retrace::hls::line_t>(kGridWords + 8 * i, 8);
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
