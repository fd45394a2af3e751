// Runs retrace_trace or retrace_ring over blocks of rays in parallel; every block is a run of the kernel of its own.
#include "csim_engine.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>

#include "csim_pixels.hpp"
#include "golden/engine/hit_codec.hpp"
#include "golden/engine/registry.hpp"
#include "hls/ring/ring.hpp"
#include "hls/top/trace.hpp"
#include "watched_trace.hpp"

namespace retrace {
namespace {

using hls::word_t;
constexpr std::size_t kBlock = 4096;  // rays a kernel run
static_assert(sizeof(word_t) == 16, "C simulation maps memory words onto ap_uint<128>");
static_assert(sizeof(hls::line_t) == 64 && sizeof(hls::token_word_t) == 32 &&
              alignof(hls::line_t) <= alignof(std::uint64_t));
static_assert(kCsimMailbox == RETRACE_MAILBOX && kCsimMailbox == RETRACE_RING_MAILBOX);

/// The image is handed to the kernel without a copy; this checks that ap_uint<128> is two little-endian 64-bit words
/// here.
void check_word_layout() {
  const std::array<std::uint64_t, 2> raw{0x0123456789abcdefull, 0xfedcba9876543210ull};
  word_t word = raw[1];
  word <<= 64;
  word |= word_t(raw[0]);
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the representation is what is checked
  if (std::memcmp(&word, raw.data(), sizeof raw) != 0)
    throw Error("csim engine: ap_uint<128> of these headers is not two little-endian 64-bit words");
}

class Simulation final : public CsimEngine {
 public:
  Simulation(std::span<const std::uint64_t> image, CsimKernel kernel) : image_(image), kernel_(kernel) {
    check_word_layout();
  }

  std::string name() const override { return "csim"; }
  std::span<const std::uint64_t> raw_hits() const override { return raw_hits_; }
  CsimTotals totals() const override { return totals_; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size() || (!work.empty() && work.size() != rays.size()))
      throw Error("csim engine: sizes of rays, hits and work differ");
    check(options);
    raw_hits_.assign(kHitWords * rays.size(), 0);
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<std::size_t>(0, rays.size(), kBlock),
          [&](const auto& range) {
            run_block(rays.subspan(range.begin(), range.size()), hits.subspan(range.begin(), range.size()),
                      work.empty() ? work : work.subspan(range.begin(), range.size()),
                      std::span(raw_hits_).subspan(kHitWords * range.begin(), kHitWords * range.size()), options);
            if (options.done) *options.done += range.size();
          },
          tbb::simple_partitioner());
    });
  }

  Walk walk(const GridRay& ray, const TraceOptions& options) override {
    check(options);
    const std::vector<contract::InstanceRecord> instances = instances_of(image_);
    std::array<std::uint64_t, contract::RayRecord::kWords> ray_words;
    std::array<std::uint64_t, contract::HitRecord::kWords> hit_words;
    std::array<ap_uint<64>, kSummaryWords> summary;
    ray.record.pack(ray_words.data());
    Walk walk;
    watched_trace(
        [&](Stage stage, std::span<const std::uint64_t> input, std::span<const std::uint64_t> output) {
          walk.calls.push_back(read_stage_call(stage, input, output));
          if (stage == Stage::kInstanceEnter)
            name_instance(walk.calls.back(), contract::InstanceEnterInRecord::unpack(input.data()), instances);
        },
        reinterpret_cast<const word_t*>(image_.data()), reinterpret_cast<const word_t*>(ray_words.data()),
        reinterpret_cast<word_t*>(hit_words.data()), summary.data(), image_.size() / MemoryImage::kLineWords, 1,
        option_bits(options));
    check_fault(summary);
    walk.hit = unpack_hit(hit_words);
    find_levels(walk.calls);
    return walk;
  }

 private:
  using Summary = std::array<ap_uint<64>, kSummaryWords>;

  static void check(const TraceOptions& options) {
    if (options.way_up == WayUp::kStack) throw Error("csim engine: the kernel has no stack; use parent or face links");
    if (options.mailbox != 0 && options.mailbox != kCsimMailbox)
      throw Error("csim engine: the kernel's mailbox has " + std::to_string(kCsimMailbox) +
                  " entries, or 0 to leave it off");
  }

  static int option_bits(const TraceOptions& options) {
    return (options.way_up == WayUp::kParentLinks ? RETRACE_OPTION_PARENT_LINKS : 0) |
           (options.mailbox != 0 ? RETRACE_OPTION_MAILBOX : 0);
  }

  static void check_fault(const Summary& summary) {
    if (const auto fault = summary[kSummaryStatus].to_uint(); fault != kFaultNone)
      throw Error(
          fault == kFaultHeader
              ? "csim engine: the image's magic or version is wrong"
              : "csim engine: a section of the image lies outside it, or has more records than its indices reach");
  }

  void run_block(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
                 std::span<std::uint64_t> raw, const TraceOptions& options) {
    const std::vector<std::size_t> inside = rays_inside(rays);
    std::vector<std::uint64_t> ray_words = pack_rays(rays, inside);
    // One record more than there are rays, so that there is something to point at.
    ray_words.resize(ray_words.size() + kRayWords);
    std::vector<std::uint64_t> hit_words(kHitWords * (inside.size() + 1)), work_words(kWorkWords * (inside.size() + 1));

    const auto* image = reinterpret_cast<const word_t*>(image_.data());
    Summary summary;
    const int bits = option_bits(options) | (work.empty() ? 0 : RETRACE_OPTION_WORK);
    auto* hit_memory = reinterpret_cast<word_t*>(hit_words.data());
    auto* work_memory = reinterpret_cast<word_t*>(work_words.data());
    const auto lines = image_.size() / MemoryImage::kLineWords;
    if (kernel_ == CsimKernel::kBarrel) {
      retrace_trace(image, image, image, image, reinterpret_cast<const word_t*>(ray_words.data()), hit_memory,
                    work_memory, summary.data(), lines, inside.size(), bits);
    } else {
      const auto* image_lines = reinterpret_cast<const hls::line_t*>(image_.data());
      retrace_ring(image, image, image_lines, image, image_lines,
                   reinterpret_cast<const hls::token_word_t*>(ray_words.data()), hit_memory, work_memory,
                   summary.data(), lines, inside.size(), bits);
    }
    check_fault(summary);

    std::fill(hits.begin(), hits.end(), Hit{});
    std::fill(work.begin(), work.end(), RayWork{});
    unpack_hits(hit_words, inside, hits, raw);
    if (!work.empty()) unpack_work(work_words, inside, work);
    const std::scoped_lock lock(mutex_);
    const auto total = [&](int word) { return static_cast<std::uint64_t>(summary[word].to_uint64()); };
    totals_.rays += total(kSummaryRays);
    totals_.faults += total(kSummaryFaults);
    totals_.down += total(kSummaryDown);
    totals_.up += total(kSummaryUp);
    totals_.leaf += total(kSummaryLeaf);
    totals_.tests += total(kSummaryTests);
    totals_.skipped += total(kSummarySkipped);
    totals_.steps += total(kSummarySteps);
  }

  std::span<const std::uint64_t> image_;
  CsimKernel kernel_;
  std::vector<std::uint64_t> raw_hits_;
  CsimTotals totals_;
  std::mutex mutex_;
};

}  // namespace

std::unique_ptr<CsimEngine> make_csim_engine(const MemoryImage& image, CsimKernel kernel) {
  return std::make_unique<Simulation>(image.words(), kernel);
}

std::unique_ptr<CsimEngine> make_csim_engine(std::span<const std::uint64_t> image_words, CsimKernel kernel) {
  return std::make_unique<Simulation>(image_words, kernel);
}

EngineKind csim_engine_kind() {
  EngineKind kind;
  kind.name = "csim";
  kind.help = "the fixed-point HLS kernel in C simulation, on all cores";
  kind.shows_walks = true;
  kind.shows_entries = true;
  kind.instances = true;
  kind.make = [](const GridScene&, const MemoryImage& image, const std::string&) -> std::unique_ptr<Engine> {
    return make_csim_engine(image);
  };
  kind.make_pixels = [](const GridScene&, const MemoryImage& image, const ShadeTable& table, const std::string&) {
    return make_csim_pixels(image.words(), table);
  };
  return kind;
}

}  // namespace retrace
