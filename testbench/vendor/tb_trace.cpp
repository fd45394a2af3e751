// Testbench of the full kernel, retrace_trace, for csim_design, cosim_design and any C++ compiler: a small scene, every hit compared bit for
// bit, with either way up and with the mailbox; then images and rays that must end in an error. Returns 0 on success.
#include <cstddef>
#include <cstdio>

#include "../../hls/top/trace.hpp"
#ifdef __BAMBU_SIM__
#include <mdpi/mdpi_user.h>
#endif

using retrace::hls::word_t;

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
static const int kImageWords = sizeof(kImage) / 16;
static const int kRayCount = sizeof(kRays) / 32;
static_assert(sizeof(kImage) % 64 == 0 && sizeof(kHits) == 16 * kRayCount, "the data belong together");
static_assert(kImageWords <= RETRACE_COSIM_IMAGE_WORDS, "the image is larger than the ports' depth");
static_assert(kRayCount <= RETRACE_COSIM_RAYS && 2 * RETRACE_COSIM_RAYS == RETRACE_COSIM_RAY_WORDS,
              "more rays than the ports' depth");
static_assert(kSummaryWords == RETRACE_COSIM_SUMMARY_WORDS, "depth of the summary");

// As large as the depths of the ports say. A copy of the image for each of its ports: co-simulation gives every port a memory of its own.
static word_t pairs[RETRACE_COSIM_IMAGE_WORDS], leaves[RETRACE_COSIM_IMAGE_WORDS];
static word_t list[RETRACE_COSIM_IMAGE_WORDS], triangles[RETRACE_COSIM_IMAGE_WORDS];
static word_t rays[RETRACE_COSIM_RAY_WORDS];
static word_t hits[RETRACE_COSIM_RAYS], work[RETRACE_COSIM_RAYS];
static ap_uint<64> summary[RETRACE_COSIM_SUMMARY_WORDS];

static word_t join(unsigned long long low, unsigned long long high) {
  word_t bits = ap_uint<64>(high);
  bits <<= 64;
  bits |= word_t(ap_uint<64>(low));
  return bits;
}

static void print(const char* title, const word_t& bits) {
  const word_t shifted = bits >> 64;
  const ap_uint<64> low = bits, high = shifted;
  std::printf("  %-8s 0x%016llx%016llx\n", title, static_cast<unsigned long long>(high.to_uint64()),
              static_cast<unsigned long long>(low.to_uint64()));
}

static unsigned long long total(int word) { return summary[word].to_uint64(); }

static void run(int image_lines, int ray_count, int options) {
  const word_t untouched = join(0x5a5a5a5a5a5a5a5aULL, 0x5a5a5a5a5a5a5a5aULL);
  for (int i = 0; i < RETRACE_COSIM_RAYS; ++i) hits[i] = work[i] = untouched;
  for (int i = 0; i < RETRACE_COSIM_SUMMARY_WORDS; ++i) summary[i] = 0;
#ifdef __BAMBU_SIM__
  m_param_alloc(0, sizeof pairs);
  m_param_alloc(1, sizeof leaves);
  m_param_alloc(2, sizeof list);
  m_param_alloc(3, sizeof triangles);
  m_param_alloc(4, sizeof rays);
  m_param_alloc(5, sizeof hits);
  m_param_alloc(6, sizeof work);
  m_param_alloc(7, sizeof summary);
#endif
  retrace_trace(pairs, leaves, list, triangles, rays, hits, work, summary, image_lines, ray_count, options);
}

static int check(bool good, const char* what) {
  std::printf("%-48s %s\n", what, good ? "ok" : "WRONG");
  return good ? 0 : 1;
}

static int check_hits(const char* what, int options, int count) {
  run(kImageWords / 4, count, options);
  int wrong = 0;
  for (int i = 0; i < count; ++i) {
    const word_t expected = join(kHits[2 * i], kHits[2 * i + 1]);
    if (hits[i] == expected || ++wrong > 1) continue;
    std::printf("%s: ray %d differs\n", what, i);
    print("expected", expected);
    print("result", hits[i]);
  }
  if (total(kSummaryStatus) != kFaultNone || total(kSummaryRays) != static_cast<unsigned long long>(count)) ++wrong;
  if (options & RETRACE_OPTION_WORK) {  // the totals are the sums of the rays
    unsigned long long down = 0, tests = 0;
    for (int i = 0; i < count; ++i) {
      const retrace::hls::work_record record = retrace::hls::unpack_work(&work[i]);
      down += record.down.to_uint();
      tests += record.tests.to_uint();
    }
    if (down != total(kSummaryDown) || tests != total(kSummaryTests)) ++wrong;
  }
  return check(wrong == 0, what);
}

int main() {
  const word_t untouched = join(0x5a5a5a5a5a5a5a5aULL, 0x5a5a5a5a5a5a5a5aULL);
  for (int i = 0; i < RETRACE_COSIM_IMAGE_WORDS; ++i) {
    const word_t word = i < kImageWords ? join(kImage[2 * i], kImage[2 * i + 1]) : word_t(0);
    pairs[i] = leaves[i] = list[i] = triangles[i] = word;
  }
  for (int i = 0; i < RETRACE_COSIM_RAY_WORDS; ++i) rays[i] = 0;
  for (int i = 0; i < 2 * kRayCount; ++i) rays[i] = join(kRays[2 * i], kRays[2 * i + 1]);

  std::printf("retrace_trace: %d words of image, %d rays\n", kImageWords, kRayCount);
  int wrong = check_hits("face links", RETRACE_OPTION_WORK, kRayCount);
  wrong += check_hits("parent links", RETRACE_OPTION_PARENT_LINKS, kRayCount);
  wrong += check_hits("face links, mailbox", RETRACE_OPTION_MAILBOX, kRayCount);
  wrong += check_hits("fewer rays than contexts", 0, 5);
  wrong += check(hits[5] == untouched && work[0] == untouched, "nothing written beyond the last ray");

  const word_t header = pairs[0];
  pairs[0] ^= word_t(1);
  run(kImageWords / 4, kRayCount, 0);
  wrong += check(total(kSummaryStatus) == kFaultHeader && total(kSummaryRays) == 0 && hits[0] == untouched,
                 "an image without its magic is refused");
  pairs[0] = header;
  run(kImageWords / 4 - 1, kRayCount, 0);
  wrong += check(total(kSummaryStatus) == kFaultLayout && hits[0] == untouched, "an image cut short is refused");

  const word_t direction[2] = {rays[0], rays[1]};
  rays[0] = join(0, 0);
  rays[1] = join(0, 0);
  run(kImageWords / 4, 1, 0);
  const retrace::hls::hit_record hit = retrace::hls::unpack_hit(hits);
  wrong += check(hit.status == retrace::contract::kStatusBadRay && total(kSummaryFaults) == 1,
                 "a ray without direction ends in its status");
  rays[0] = direction[0];
  rays[1] = direction[1];
  wrong += check_hits("and leaves nothing behind", 0, kRayCount);
  return wrong == 0 ? 0 : 1;
}
