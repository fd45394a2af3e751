// Testbench of one task of the ring for any C++ compiler and co-simulation: RETRACE_RING_TASK names it. The tasks are a network of Kahn's, so what a
// task writes depends only on the words it reads: all words of its input streams that a run of the whole ring had go in, and it has to write those
// of its output streams. Tasks that write to memory have to write the hits, work and totals of that run. Returns 0 on success.
#include <vector>

#include "../../hls/ring/ring.hpp"
#include "stage_bench.hpp"

using namespace retrace::hls;

// All words of a stream go in before the task runs. The testbench's stream has bounds.
#if defined(RETRACE_HLS_STREAM_H)
#define RETRACE_DEPTH , 4096
#else
#define RETRACE_DEPTH
#endif

#define RETRACE_NAME_OF(name) #name
#define RETRACE_NAME(name) RETRACE_NAME_OF(name)
static constexpr const char* kTask = RETRACE_NAME(RETRACE_RING_TASK);

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

template <typename Word>
static Word join(const unsigned long long* words, int count) {
  return retrace_bench::join<Word>(words, count);
}

int main() {
  std::vector<word_t> image(sizeof(kImage) / 16);
  std::vector<line_t> lines(sizeof(kImage) / 64);
  std::vector<token_word_t> ray_words(kRingRays);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = join<word_t>(kImage + 2 * i, 2);
  for (std::size_t i = 0; i < lines.size(); ++i) lines[i] = join<line_t>(kImage + 8 * i, 8);
  for (int i = 0; i < kRingRays; ++i) ray_words[i] = join<token_word_t>(kRays + 4 * i, 4);
  std::vector<word_t> hit_memory(kRingRays), work_memory(kRingRays);
  std::vector<ap_uint<64> > totals_memory(kSummaryWords);
  image_view view = {};
  int wrong = read_header(image.data(), ap_uint<32>(unsigned(lines.size())), view) != kFaultNone;

  // What the region's arguments are called in RETRACE_RING_TASKS.
  const word_t *pairs = image.data(), *pairs_2 = image.data(), *list = image.data();
  const line_t *leaves = lines.data(), *triangles = lines.data();
  const token_word_t* rays = ray_words.data();
  word_t *hits = hit_memory.data(), *work = work_memory.data();
  ap_uint<64>* summary = totals_memory.data();
  const ap_uint<32> ray_count = kRingRays, contexts = kRingTokens, parent_links = 1, mailbox = 1, write_work = 1,
                    fault = 0;
  (void)pairs, (void)pairs_2, (void)list, (void)leaves, (void)triangles, (void)rays, (void)ray_count, (void)contexts;
  (void)parent_links, (void)mailbox, (void)write_work, (void)fault, (void)hits, (void)work, (void)summary;

#define RETRACE_FILL(name, word, places, writer, reader) \
  hls::stream<word> name(#name RETRACE_DEPTH);           \
  if (same(#reader, kTask))                              \
    for (const auto& row : recorded::name) name.write(join<word>(row, sizeof(row) / 8));
  RETRACE_RING_STREAMS(RETRACE_FILL)

#define RETRACE_RUN(name, function, arguments) \
  if constexpr (same(#name, kTask)) ring_##function arguments;
  RETRACE_RING_TASKS(RETRACE_RUN)

  int words = 0;
#define RETRACE_COMPARE(name, word, places, writer, reader)                           \
  if (same(#writer, kTask)) {                                                         \
    for (const auto& row : recorded::name) {                                          \
      const word result = name.read();                                                \
      ++words;                                                                        \
      if (result == join<word>(row, sizeof(row) / 8)) continue;                       \
      if (++wrong == 1) std::printf("ring_%s: a word of %s differs\n", kTask, #name); \
    }                                                                                 \
  }
  RETRACE_RING_STREAMS(RETRACE_COMPARE)

  if (same(kTask, "hit_writer"))
    for (int i = 0; i < kRingRays; ++i, ++words) wrong += hit_memory[i] != join<word_t>(kHits + 2 * i, 2);
  if (same(kTask, "work_writer"))
    for (const auto& row : recorded::works) {
      const token_word_t bits = join<token_word_t>(row, 4);
      const ap_uint<33> index = bits >> 128;
      if (index[kRingEndBit] == 1) continue;
      ++words;
      wrong += work_memory[index.to_uint()] != word_t(bits);
    }
  if (same(kTask, "summary_writer")) {
    const int order[] = {kSummaryRays, kSummaryFaults, kSummaryDown,    kSummaryUp,
                         kSummaryLeaf, kSummaryTests,  kSummarySkipped, kSummarySteps};
    for (int i = 0; i < 8; ++i, ++words) wrong += totals_memory[order[i]] != ap_uint<64>(recorded::totals[i][0]);
  }
  if (words == 0) ++wrong;  // the task's name is wrong
  std::printf("ring_%-14s %d words, %d differ\n", kTask, words, wrong);
  return wrong == 0 ? 0 : 1;
}
