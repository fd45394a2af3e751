// The ring of tasks: the same hits, work and totals as the barrel bit for bit, whatever the image and the order of the tasks; and no deadlock at
// the least depths of its streams, but one below them.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/csim/ring_run.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

struct Case {
  GridScene scene;
  MemoryImage image;
  std::vector<GridRay> rays;

  explicit Case(const std::string& name, std::size_t count, std::uint64_t seed) {
    TracedScene traced = prepare_scene(open_scene(name));
    scene = std::move(traced.grid);
    image = std::move(traced.image);
    Random random(seed);
    rays = make_test_rays(scene, image, count, random);
  }
};

/// Both kernels over the same words and rays: hits, work and totals.
void expect_same(std::span<const std::uint64_t> words, std::span<const GridRay> rays, TraceOptions options,
                 const std::string& what, std::array<int, 8>* seen = nullptr, std::uint32_t contexts = 24) {
  std::array<std::vector<Hit>, 2> hits;
  std::array<std::vector<RayWork>, 2> work;
  std::array<std::vector<std::uint64_t>, 2> raw;
  std::array<CsimTotals, 2> totals;
  options.threads = 1;  // the settings of the ring are those of this thread
  RingRun::of_thread().settings.contexts = contexts;
  if (contexts < RETRACE_RING_CONTEXTS) RingRun::of_thread().settings.depth = contexts;
  for (const int ring : {0, 1}) {
    auto engine = make_csim_engine(words, ring ? CsimKernel::kRing : CsimKernel::kBarrel);
    hits[ring].resize(rays.size());
    work[ring].resize(rays.size());
    engine->trace(rays, hits[ring], work[ring], options);
    raw[ring].assign(engine->raw_hits().begin(), engine->raw_hits().end());
    totals[ring] = engine->totals();
  }
  RingRun::of_thread().settings = {};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(raw[0][2 * i] == raw[1][2 * i] && raw[0][2 * i + 1] == raw[1][2 * i + 1])
        << what << " ray " << i << " status " << hits[0][i].status << " and " << hits[1][i].status;
    const auto counts = [&](int ring) {
      const RayWork& w = work[ring][i];
      return std::array{w.down, w.up, w.leaf, w.tests, w.skipped};
    };
    ASSERT_EQ(counts(0), counts(1)) << what << " ray " << i;
    if (seen) ++(*seen)[hits[1][i].status];
  }
  const auto list = [](const CsimTotals& t) {
    return std::array{t.rays, t.faults, t.down, t.up, t.leaf, t.tests, t.skipped, t.steps};
  };
  EXPECT_EQ(list(totals[0]), list(totals[1])) << what;
}

void every_mode(std::span<const std::uint64_t> words, std::span<const GridRay> rays, const std::string& what) {
  for (const WayUp way : {WayUp::kParentLinks, WayUp::kFaceLinks})
    for (const int mailbox : {0, kCsimMailbox}) {
      TraceOptions options;
      options.way_up = way;
      options.mailbox = mailbox;
      expect_same(words, rays, options, what + " mailbox " + std::to_string(mailbox));
    }
}

TEST(Ring, gives_the_bits_of_the_barrel_on_every_scene) {
  const std::uint64_t seed = test_seed();
  for (const char* name :
       {"box", "sphere:cells=12", "knot:along=60,around=8", "field:count=24,cells=2", "needles:count=300",
        "slivers:count=300", "coincident:cells=6", "degenerate:count=120", "one", "none", "room:detail=0.03"}) {
    const Case c(name, 450, seed);
    every_mode(c.image.words(), c.rays, std::string(name) + " seed " + std::to_string(seed));
  }
}

TEST(Ring, gives_the_bits_of_the_barrel_as_declared) {
  const std::uint64_t seed = test_seed();
  const Case c("knot:along=60,around=8", 600, seed);
  expect_same(c.image.words(), c.rays, {}, "seed " + std::to_string(seed), nullptr, RETRACE_RING_CONTEXTS);
}

TEST(Ring, corrupt_images_and_step_limits_end_in_the_barrels_status) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const Case c("knot:along=24,around=6", 90, seed);
  std::array<int, 8> seen{};
  for (int round = 0; round < 80; ++round) {
    std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
    auto header = c.image.header();
    if (round % 4 == 0) header.step_limit = 1 + static_cast<std::uint32_t>(random.below(40));
    header.pack(words.data());
    const std::size_t first = contract::HeaderRecord::kWords;
    if (round % 4 != 0)
      for (std::uint64_t flips = 1 + random.below(64); flips > 0; --flips)
        words[first + random.below(words.size() - first)] ^= std::uint64_t{1} << random.below(64);
    TraceOptions options;
    options.way_up = random.chance(2) ? WayUp::kParentLinks : WayUp::kFaceLinks;
    options.mailbox = random.chance(2) ? kCsimMailbox : 0;
    expect_same(words, c.rays, options, "seed " + std::to_string(seed) + " round " + std::to_string(round), &seen);
  }
  for (const int status : {contract::kStatusMiss, contract::kStatusHit, contract::kStatusStepLimit,
                           contract::kStatusBadIndex, contract::kStatusBadRecord})
    EXPECT_GT(seen[status], 0) << "status " << status << " was not met";
}

TEST(Ring, bad_rays_and_bad_headers) {
  const Case c("one", 9, test_seed());
  std::vector<GridRay> rays(2);
  rays[0].record.origin = {c.scene.box[1] + 1, c.scene.box[2], c.scene.box[4]};
  rays[0].record.direction = {-(1 << 26), 0, 0};
  rays[1].record.origin = {c.scene.box[1], c.scene.box[2], c.scene.box[4]};
  std::array<int, 8> seen{};
  expect_same(c.image.words(), rays, {}, "bad rays", &seen);
  EXPECT_EQ(seen[contract::kStatusBadRay], 2);

  std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
  words[0] ^= 1;
  auto engine = make_csim_engine(words, CsimKernel::kRing);
  std::vector<Hit> hits(c.rays.size());
  EXPECT_THROW(engine->trace(c.rays, hits, {}, {}), Error);
}

/// One run of the ring in this thread with settings of its own.
struct SmallRun {
  const Case& c;
  std::vector<std::uint64_t> rays;
  std::uint32_t count = 0;

  SmallRun(const Case& scene, std::size_t most) : c(scene) {
    for (const GridRay& ray : c.rays) {
      if (ray.outside || count == most) continue;
      rays.resize(rays.size() + contract::RayRecord::kWords);
      ray.record.pack(&rays[rays.size() - contract::RayRecord::kWords]);
      ++count;
    }
  }
  std::vector<std::uint64_t> operator()(const RingSettings& settings, int options) const {
    std::vector<std::uint64_t> hits(2 * count + 2), work(2 * count + 2);
    std::array<ap_uint<64>, kSummaryWords> summary;
    const auto* image = reinterpret_cast<const hls::word_t*>(c.image.words().data());
    const auto* lines = reinterpret_cast<const hls::line_t*>(c.image.words().data());
    RingRun& run = RingRun::of_thread();
    run.settings = settings;
    run.throws = false;
    retrace_ring(image, image, lines, image, lines, reinterpret_cast<const hls::token_word_t*>(rays.data()),
                 reinterpret_cast<hls::word_t*>(hits.data()), reinterpret_cast<hls::word_t*>(work.data()),
                 summary.data(), c.image.words().size() / MemoryImage::kLineWords, count, options);
    run.settings = {};
    run.throws = true;
    hits.insert(hits.end(), work.begin(), work.end());
    return hits;
  }
};

/// The least depths: one word everywhere but in `ready`. While `launch` brings the last token, the others stand in `ready` or between: one in
/// `result`, which waits for `ready`, and one behind it whose constants are the word in `result_rays`; so `ready` needs two places less than there
/// are tokens. Where the streams of constants are deep, the others may fill the whole ring: 11 streams of one word and 11 tasks that hold a token each.
constexpr std::uint32_t kPlacesLeast = 2, kPlacesDeep = 22;
RingSettings least(std::uint32_t contexts, std::uint64_t seed, bool deep = false) {
  RingSettings settings;
  settings.seed = seed;
  settings.contexts = contexts;
  settings.depth = 1;
  const std::uint32_t places = deep ? kPlacesDeep : kPlacesLeast;
  settings.depths["ready"] = contexts > places ? contexts - places : 1;
  if (deep)
    for (const char* name : {"step_rays", "step_rays_2", "exit_rays", "test_rays", "result_rays"})
      settings.depths[name] = 64;
  return settings;
}

TEST(Ring, no_order_of_the_tasks_changes_a_bit_or_deadlocks_at_the_least_depths) {
  const std::uint64_t seed = test_seed();
  // RETRACE_RING_SCHEDULES=1000000 is the long form.
  const char* const wanted = std::getenv("RETRACE_RING_SCHEDULES");
  const std::uint64_t schedules = wanted ? std::strtoull(wanted, nullptr, 0) : 600;
  const Case box("box", 40, seed), coincident("coincident:cells=2", 40, seed + 1);
  const std::array<SmallRun, 2> runs{SmallRun(box, 5), SmallRun(coincident, 4)};
  const int options = RETRACE_OPTION_WORK | RETRACE_OPTION_MAILBOX | RETRACE_OPTION_PARENT_LINKS;
  std::array<std::vector<std::uint64_t>, 2> expected;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    expected[i] = runs[i]({}, options);
    ASSERT_EQ(RingRun::of_thread().report.tasks.text, "");
  }
  std::atomic<std::uint64_t> switches = 0;
  std::atomic<bool> failed = false;
  std::mutex mutex;
  std::string first;  // what was wrong, of the first schedule that showed it
  tbb::parallel_for(std::uint64_t{1}, schedules + 1, [&](std::uint64_t schedule) {
    if (failed) return;
    const std::size_t i = schedule % runs.size();
    const std::uint32_t contexts = schedule % 16 == 0 ? 21 : 1 + schedule % 5;
    const auto found = runs[i](least(contexts, seed + schedule), options);
    const RingReport& report = RingRun::of_thread().report;
    std::string wrong = report.tasks.text;
    if (found != expected[i]) wrong += "other hits or work\n";
    // Tokens: as many words on every stream between launch and result; all but the end come back, and nothing stays.
    const std::size_t launched = report.words.at("launched");
    const auto expect_words = [&](const char* name, std::size_t words) {
      if (report.words.at(name) != words) wrong += std::string(name) + " has another number of words\n";
    };
    for (const char* name : {"nodes", "stepped", "nodes_2", "stepped_2", "leaf_lines", "in_leaf", "references",
                             "wanted", "triangle_lines", "candidates"})
      expect_words(name, launched);
    expect_words("ready", launched - 1);
    for (const char* name :
         {"ray_words", "setups", "step_rays", "step_rays_2", "exit_rays", "test_rays", "result_rays"})
      expect_words(name, runs[i].count);
    expect_words("finished_hits", runs[i].count + 1);
    switches += report.tasks.switches;
    if (wrong.empty()) return;
    const std::scoped_lock lock(mutex);
    if (failed.exchange(true)) return;
    first = "seed " + std::to_string(seed + schedule) + ", " + std::to_string(contexts) + " tokens: " + wrong;
  });
  EXPECT_FALSE(failed) << first;
  std::printf("%llu schedules, %llu switches of tasks, seed %llu\n", static_cast<unsigned long long>(schedules),
              static_cast<unsigned long long>(switches.load()), static_cast<unsigned long long>(seed));
}

TEST(Ring, one_word_less_than_the_least_depth_deadlocks_and_the_streams_are_named) {
  const std::uint64_t seed = test_seed();
  const Case c("box", 90, seed);
  const SmallRun run(c, 40);  // more rays than tokens
  const std::vector<std::string> short_cycle{"ready", "result_rays"};
  const std::vector<std::string> whole_ring{"ready",      "launched",  "nodes",          "stepped",
                                            "nodes_2",    "stepped_2", "leaf_lines",     "in_leaf",
                                            "references", "wanted",    "triangle_lines", "candidates"};
  for (const bool deep : {false, true})
    for (const std::uint32_t contexts : {24U, 31U})
      for (std::uint64_t schedule = 0; schedule < 15; ++schedule) {
        RingSettings settings = least(contexts, schedule == 0 ? 0 : seed + schedule, deep);
        const std::string where =
            std::to_string(contexts) + " tokens, seed " + std::to_string(settings.seed) + (deep ? ", deep" : "");
        run(settings, 0);
        EXPECT_EQ(RingRun::of_thread().report.tasks.text, "") << where;
        --settings.depths["ready"];
        run(settings, 0);
        const auto& tasks = RingRun::of_thread().report.tasks;
        ASSERT_TRUE(tasks.deadlock) << where;
        EXPECT_NE(tasks.text.find("cycle"), std::string::npos) << where << tasks.text;
        const std::vector<std::string>& expected = deep ? whole_ring : short_cycle;
        EXPECT_TRUE(std::is_permutation(tasks.cycle.begin(), tasks.cycle.end(), expected.begin(), expected.end()))
            << where << '\n'
            << tasks.text;
      }
}

/// Each stream is needed: without any place, whoever needs it waits, and the report says where.
TEST(Ring, a_stream_without_room_is_named) {
  const Case c("box", 60, test_seed());
  const SmallRun run(c, 3);
#define RETRACE_RING_NAME(name, word, places, writer, reader) #name,
  for (const char* name : {RETRACE_RING_STREAMS(RETRACE_RING_NAME)}) {
    RingSettings settings = least(3, 0);
    settings.depths[name] = 0;
    run(settings, RETRACE_OPTION_WORK);
    const auto& tasks = RingRun::of_thread().report.tasks;
    EXPECT_TRUE(tasks.deadlock) << name;
    EXPECT_NE(tasks.text.find(name), std::string::npos) << name << '\n' << tasks.text;
  }
}

}  // namespace
}  // namespace retrace
