// Any one task of the ring alone. The tasks are a network of Kahn's, so what a task writes depends only on the words it reads: all words of its input
// streams that a run of the whole ring had go in, and it has to write those of its output streams. Tasks that write to memory have to write the
// hits, work and totals of that run. With RETRACE_RING_TASK only that task is referred to; otherwise all of them have to be linked.
#pragma once
#include "../../hls/ring/ring.hpp"
#include "stage_bench.hpp"

// All words of a stream go in before the task runs. The testbench's stream has bounds.
#if defined(RETRACE_HLS_STREAM_H)
#define RETRACE_DEPTH , 4096
#else
#define RETRACE_DEPTH
#endif

#define RETRACE_NAME_OF(name) #name
#define RETRACE_NAME(name) RETRACE_NAME_OF(name)
#ifdef RETRACE_RING_TASK
#define RETRACE_RUN(name, function, arguments) \
  if constexpr (same(#name, RETRACE_NAME(RETRACE_RING_TASK))) ring_##function arguments;
#else
#define RETRACE_RUN(name, function, arguments) \
  if (same(#name, task)) ring_##function arguments;
#endif

namespace retrace_bench::ring {

using namespace retrace::hls;

static constexpr bool same(const char* a, const char* b) {
  while (*a != 0 && *a == *b) {
    ++a;
    ++b;
  }
  return *a == *b;
}

static const unsigned long long kImage[] = {
#include "data/image.inc"
};
static const unsigned long long kRays[] = {
#include "data/rays.inc"
};
static const unsigned long long kHits[] = {
#include "data/hits.inc"
};
static const int kRingRays = 5, kRingTokens = 3;  // of the run that was recorded

// The words of the streams.
namespace recorded {
static const unsigned long long ray_words[][4] = {
#include "data/ring_ray_words.inc"
};
static const unsigned long long setups[][8] = {
#include "data/ring_setups.inc"
};
static const unsigned long long ready[][4] = {
#include "data/ring_ready.inc"
};
static const unsigned long long step_rays[][4] = {
#include "data/ring_step_rays.inc"
};
static const unsigned long long step_rays_2[][4] = {
#include "data/ring_step_rays_2.inc"
};
static const unsigned long long exit_rays[][4] = {
#include "data/ring_exit_rays.inc"
};
static const unsigned long long test_rays[][4] = {
#include "data/ring_test_rays.inc"
};
static const unsigned long long result_rays[][1] = {
#include "data/ring_result_rays.inc"
};
static const unsigned long long launched[][4] = {
#include "data/ring_launched.inc"
};
static const unsigned long long nodes[][8] = {
#include "data/ring_nodes.inc"
};
static const unsigned long long stepped[][4] = {
#include "data/ring_stepped.inc"
};
static const unsigned long long nodes_2[][8] = {
#include "data/ring_nodes_2.inc"
};
static const unsigned long long stepped_2[][4] = {
#include "data/ring_stepped_2.inc"
};
static const unsigned long long leaf_lines[][16] = {
#include "data/ring_leaf_lines.inc"
};
static const unsigned long long in_leaf[][8] = {
#include "data/ring_in_leaf.inc"
};
static const unsigned long long references[][4] = {
#include "data/ring_references.inc"
};
static const unsigned long long wanted[][4] = {
#include "data/ring_wanted.inc"
};
static const unsigned long long triangle_lines[][16] = {
#include "data/ring_triangle_lines.inc"
};
static const unsigned long long candidates[][8] = {
#include "data/ring_candidates.inc"
};
static const unsigned long long finishes[][8] = {
#include "data/ring_finishes.inc"
};
static const unsigned long long finished_hits[][4] = {
#include "data/ring_finished_hits.inc"
};
static const unsigned long long works[][4] = {
#include "data/ring_works.inc"
};
static const unsigned long long totals[][1] = {
#include "data/ring_totals.inc"
};
}  // namespace recorded

// A copy of the image for each port.
static const int kImageLines = sizeof(kImage) / 64;
static word_t pair_memory[4 * kImageLines], list_memory[4 * kImageLines];
static line_t leaf_memory[kImageLines], triangle_memory[kImageLines];
static token_word_t ray_memory[kRingRays];
static word_t hit_memory[kRingRays], work_memory[kRingRays];
static ring_word64_t totals_memory[kSummaryWords];

/// 0 if the task called so in RETRACE_RING_TASKS writes what it has to.
static int run_task(const char* task) {
  for (int i = 0; i < 4 * kImageLines; ++i) pair_memory[i] = list_memory[i] = join<word_t>(kImage + 2 * i, 2);
  for (int i = 0; i < kImageLines; ++i) leaf_memory[i] = triangle_memory[i] = join<line_t>(kImage + 8 * i, 8);
  for (int i = 0; i < kRingRays; ++i) ray_memory[i] = join<token_word_t>(kRays + 4 * i, 4);
  image_view view = {};
  int wrong = read_header(pair_memory, ap_uint<32>(unsigned(kImageLines)), view) != kFaultNone;

  // What the region's arguments are called in RETRACE_RING_TASKS.
  const word_t *pairs = pair_memory, *pairs_2 = pair_memory, *list = list_memory;
  const line_t *leaves = leaf_memory, *triangles = triangle_memory;
  const token_word_t* rays = ray_memory;
  word_t *hits = hit_memory, *work = work_memory;
  ring_word64_t* summary = totals_memory;
  const ap_uint<32> ray_count = kRingRays, contexts = kRingTokens, parent_links = 1, mailbox = 1, write_work = 1,
                    fault = 0;
  (void)pairs, (void)pairs_2, (void)list, (void)leaves, (void)triangles, (void)rays, (void)ray_count, (void)contexts;
  (void)parent_links, (void)mailbox, (void)write_work, (void)fault, (void)hits, (void)work, (void)summary;
  if (same(task, "ray_reader")) RETRACE_BENCH_MEMORY(1, ray_memory);
  if (same(task, "node_fetch")) RETRACE_BENCH_MEMORY(2, pair_memory);
  if (same(task, "leaf_fetch")) RETRACE_BENCH_MEMORY(2, leaf_memory);
  if (same(task, "list_fetch")) RETRACE_BENCH_MEMORY(2, list_memory);
  if (same(task, "triangle_fetch")) RETRACE_BENCH_MEMORY(2, triangle_memory);
  if (same(task, "hit_writer")) RETRACE_BENCH_MEMORY(1, hit_memory);
  if (same(task, "work_writer")) RETRACE_BENCH_MEMORY(1, work_memory);
  if (same(task, "summary_writer")) RETRACE_BENCH_MEMORY(1, totals_memory);

#define RETRACE_FILL(name, word, places, writer, reader) \
  hls::stream<word> name(#name RETRACE_DEPTH);           \
  if (same(#reader, task))                               \
    for (const auto& row : recorded::name) name.write(join<word>(row, sizeof(row) / 8));
  RETRACE_RING_STREAMS(RETRACE_FILL)

  RETRACE_RING_TASKS(RETRACE_RUN)

  int words = 0;
#define RETRACE_COMPARE(name, word, places, writer, reader)                          \
  if (same(#writer, task)) {                                                         \
    for (const auto& row : recorded::name) {                                         \
      const word result = name.read();                                               \
      ++words;                                                                       \
      if (result == join<word>(row, sizeof(row) / 8)) continue;                      \
      if (++wrong == 1) std::printf("ring_%s: a word of %s differs\n", task, #name); \
    }                                                                                \
  }
  RETRACE_RING_STREAMS(RETRACE_COMPARE)

  if (same(task, "hit_writer"))
    for (int i = 0; i < kRingRays; ++i, ++words) wrong += hit_memory[i] != join<word_t>(kHits + 2 * i, 2);
  if (same(task, "work_writer"))
    for (const auto& row : recorded::works) {
      const token_word_t bits = join<token_word_t>(row, 4);
      const ap_uint<33> index = bits >> 128;
      if (index[kRingEndBit] == 1) continue;
      ++words;
      wrong += work_memory[index.to_uint()] != word_t(bits);
    }
  if (same(task, "summary_writer")) {
    const int order[] = {kSummaryRays, kSummaryFaults, kSummaryDown,    kSummaryUp,
                         kSummaryLeaf, kSummaryTests,  kSummarySkipped, kSummarySteps};
    for (int i = 0; i < 8; ++i, ++words) wrong += totals_memory[order[i]] != ap_uint<64>(recorded::totals[i][0]);
  }
  if (words == 0) ++wrong;  // the task's name is wrong
  std::printf("ring_%-14s %d words, %d differ\n", task, words, wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace retrace_bench::ring
