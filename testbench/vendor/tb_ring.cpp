// C simulation of the ring, retrace_ring, with any C++ compiler: the scene and hits of tb_trace, its tasks as coroutines in turn and in random
// orders, and then each task alone. Needs the testbench's stream (testbench/csim/include) before any other. Returns 0 on success.
#include <cstddef>
#include <cstdio>
#include <vector>

#include "../csim/ring_run.hpp"
#include "ring_task_bench.hpp"

using namespace retrace::hls;

// Words of 64 bits, lowest first: the memory image, 4 words a ray, 2 words a hit.
static const unsigned long long kImage[] = {
#include "data/image.inc"
};
static const unsigned long long kRays[] = {
#include "data/rays.inc"
};
static const unsigned long long kHits[] = {
#include "data/hits.inc"
};
static const int kRayCount = sizeof(kRays) / 32;

template <typename Word>
static std::vector<Word> join(const unsigned long long* words, std::size_t count, int each) {
  std::vector<Word> result;
  for (std::size_t i = 0; i < count; i += each) {
    Word bits = 0;
    for (int part = each - 1; part >= 0; --part) {
      bits <<= 64;
      bits |= Word(ap_uint<64>(words[i + part]));
    }
    result.push_back(bits);
  }
  return result;
}

static int run(const char* what, int options, std::uint64_t seed, std::uint32_t contexts) {
  const std::size_t image_words = sizeof(kImage) / 8;
  const std::vector<word_t> words = join<word_t>(kImage, image_words, 2);
  const std::vector<line_t> lines = join<line_t>(kImage, image_words, 8);
  const std::vector<token_word_t> rays = join<token_word_t>(kRays, 4 * kRayCount, 4);
  const std::vector<word_t> expected = join<word_t>(kHits, 2 * kRayCount, 2);
  std::vector<word_t> hits(kRayCount), work(kRayCount);
  ap_uint<64> summary[kSummaryWords];
  retrace::RingRun& ring = retrace::RingRun::of_thread();
  ring.throws = false;
  ring.settings.seed = seed;
  ring.settings.contexts = contexts;
  retrace_ring(words.data(), words.data(), lines.data(), words.data(), lines.data(), rays.data(), hits.data(),
               work.data(), summary, image_words / 8, kRayCount, options);
  int wrong = summary[kSummaryStatus] != kFaultNone || summary[kSummaryRays] != kRayCount;
  for (int i = 0; i < kRayCount; ++i) {
    if (hits[i] == expected[i]) continue;
    if (++wrong == 1) std::printf("%s: ray %d differs\n", what, i);
  }
  if (!ring.report.tasks.text.empty()) {
    std::printf("%s", ring.report.tasks.text.c_str());
    ++wrong;
  }
  std::printf("ring, %-34s %s\n", what, wrong == 0 ? "ok" : "WRONG");
  return wrong;
}

int main() {
  int wrong = run("face links, tasks in turn", 0, 0, 128);
  wrong += run("parent links, mailbox, random order", RETRACE_OPTION_PARENT_LINKS | RETRACE_OPTION_MAILBOX, 1, 7);
  wrong += run("face links, work, random order", RETRACE_OPTION_WORK, 2, 40);
#define RETRACE_ALONE(name, function, arguments) wrong += retrace_bench::ring::run_task(#name);
  RETRACE_RING_TASKS(RETRACE_ALONE)
  return wrong == 0 ? 0 : 1;
}
