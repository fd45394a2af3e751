// The core of streams without its AXI shell: rays of a test pattern in, a checksum of hits out (testbench/sim/sv/tb_streams.sv), a memory of a few
// lines behind the one memory port. The checksum is that of the kernel's hits, whoever holds up whom and however long the core's own ways are.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "testbench/sim/clocked.hpp"
#include "tests/rtl_core/frames.hpp"
#include "Vtb_streams_deep.h"
#include "Vtb_streams_none.h"
#include "Vtb_streams_shipped.h"

namespace retrace::rtl_core_test {
namespace {

using cosim::Clocked;

constexpr std::uint64_t kImageBase = 0x123456fc0;  // a multiple of 64 that ends a page
constexpr int kRayFault = 1;
constexpr unsigned kContexts = 64, kInFlight = kContexts + 64;  // of configuration small; rt_core's bound

/// Rays as testbench/sim/sv/tb_pattern_source.sv makes them.
struct Pattern {
  std::array<std::int32_t, 6> base{}, step_x{}, step_y{};
  std::uint32_t width = 1, height = 1, t_max = (1u << 27) - 1;
  bool mark = false;

  std::uint32_t count() const { return width * height; }
  bool marked(std::size_t ray) const { return mark && ray % width % 8 == 5; }
  std::uint32_t tag(std::size_t ray) const { return static_cast<std::uint32_t>(ray / width << 16 | ray % width); }
  std::vector<GridRay> rays() const {
    std::vector<GridRay> all(count());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto x = static_cast<std::int32_t>(i % width), y = static_cast<std::int32_t>(i / width);
      const auto code = [&](std::size_t c) { return base[c] + x * step_x[c] + y * step_y[c]; };
      all[i].record.origin = {code(0), code(1), code(2)};
      all[i].record.direction = {code(3), code(4), code(5)};
      all[i].record.t_max = t_max;
      all[i].record.any = static_cast<std::uint32_t>(x & y & 1);
    }
    return all;
  }
};

/// From the lower z face of the root box upwards, a little apart: most rays meet the scene, some leave it by the sides.
Pattern camera(const GridScene& grid, std::uint32_t width, std::uint32_t height) {
  Pattern p;
  p.width = width;
  p.height = height;
  const auto w = static_cast<std::int32_t>(width), h = static_cast<std::int32_t>(height);
  constexpr std::int32_t kSpread = 1 << 24;  // a quarter
  p.base = {grid.box[0], grid.box[2], grid.box[4], -kSpread, -kSpread, 60000000};
  p.step_x = {(grid.box[1] - grid.box[0]) / w, 0, 0, 2 * kSpread / w, 0, 0};
  p.step_y = {0, (grid.box[3] - grid.box[2]) / h, 0, 0, 2 * kSpread / h, 0};
  return p;
}

/// FNV-1a of a hit and its tag, as testbench/sim/sv/tb_checksum_sink.sv has it.
std::uint64_t hash(std::uint32_t tag, const std::uint64_t* hit) {
  std::uint64_t h = 0xcbf29ce484222325;
  const auto bytes = [&](std::uint64_t word, int count) {
    for (int i = 0; i < count; ++i) h = (h ^ (word >> 8 * i & 255)) * 0x100000001b3;
  };
  bytes(hit[0], 8);
  bytes(hit[1], 8);
  bytes(tag, 4);
  return h;
}

/// What a sink has to hold after the first `count` rays.
struct Expected {
  std::uint32_t count = 0;
  std::uint64_t checksum = 0;
  std::uint32_t hits = 0, faults = 0;  // rays that hit something; rays with an error
};

Expected expected(const Prepared& scene, const Pattern& pattern, std::uint32_t count, const TraceOptions& options) {
  std::vector<GridRay> rays = pattern.rays();
  rays.resize(count);
  std::vector<std::uint64_t> hits = csim_hits(scene.image.words(), rays, options);
  Expected e;
  e.count = count;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (pattern.marked(i)) {
      contract::HitRecord record;
      record.status = contract::kStatusBusError;
      record.id = contract::kNoTriangle;
      record.pack(&hits[2 * i]);
    }
    e.checksum += hash(pattern.tag(i), &hits[2 * i]);
    e.hits += status_of(hits, i) == contract::kStatusHit;
    e.faults += status_of(hits, i) > contract::kStatusHit;
  }
  return e;
}

struct Traffic {
  unsigned source_rest = 0, sink_rest = 0;  // of 256 clocks
  unsigned memory_percent = 100;            // of clocks in which a request is taken, and in which a beat is given
  unsigned latency = 1;                     // at most, in clocks
  bool any_order = false;                   // beats of different requests are mixed
};

/// Answers requests from an image; takes and gives as Traffic says.
class Memory {
 public:
  Memory(std::span<const std::uint64_t> words, std::uint64_t seed) : words_(words), random_(seed) {}

  template <typename Bench>
  void drive(Bench& bench, const Traffic& traffic) {
    bench->read_ready_i = random_.below(100) < traffic.memory_percent;
    bench->fill_valid_i = 0;
    given_ = false;
    if (reads_.empty() || random_.below(100) >= traffic.memory_percent) return;
    at_ = traffic.any_order ? random_.below(reads_.size()) : 0;
    const Read& read = reads_[at_];
    if (read.due > bench.clock()) return;
    const std::uint64_t word = (read.address - kImageBase) / 8 + read.beat;
    outside_ += read.address < kImageBase || word >= words_.size();
    given_ = true;
    bench->fill_valid_i = static_cast<std::uint8_t>(1u << read.source);
    bench->fill_mshr_i = read.mshr;
    bench->fill_last_i = read.beat == read.last;
    bench->fill_error_i = 0;
    bench->fill_data_i = word < words_.size() ? words_[word] : 0;
  }
  /// After settle(): what happens at the edge.
  template <typename Bench>
  void look(Bench& bench, const Traffic& traffic) {
    if (given_ && reads_[at_].beat++ == reads_[at_].last)
      reads_.erase(reads_.begin() + static_cast<std::ptrdiff_t>(at_));
    if (bench->read_valid_o && bench->read_ready_i)
      reads_.push_back({bench->read_addr_o, bench.clock() + 1 + random_.below(traffic.latency), bench->read_len_o, 0,
                        bench->read_source_o, bench->read_mshr_o});
  }
  std::size_t waiting() const { return reads_.size(); }
  unsigned outside() const { return outside_; }

 private:
  struct Read {
    std::uint64_t address, due;
    unsigned last, beat;
    std::uint8_t source, mshr;
  };
  std::span<const std::uint64_t> words_;
  Random random_;
  std::vector<Read> reads_;
  std::size_t at_ = 0;
  bool given_ = false;
  unsigned outside_ = 0;
};

template <typename Model>
class Streams : public testing::Test {
 protected:
  Streams() : memory_(scene_.image.words(), test_seed()), bench_(test_seed()) {
    bench_->start_i = bench_->stop_i = bench_->hold_i = bench_->mark_i = 0;
    bench_->fill_valid_i = 0;
    bench_->read_ready_i = 0;
    bench_.reset();
    clock();  // the core's units are out of reset a clock later (rt_core.sv)
  }
  ~Streams() override { EXPECT_FALSE(bench_.failed()) << "an assertion of the RTL; seed " << test_seed(); }

  void clock() {
    memory_.drive(bench_, traffic_);
    bench_.settle();
    memory_.look(bench_, traffic_);
    taken_ += bench_->ray_taken_o;
    bench_.rise();
  }
  void begin(const Pattern& pattern, std::uint32_t count, const TraceOptions& options = {}) {
    bench_->image_base_i = kImageBase;
    bench_->image_lines_i = static_cast<std::uint32_t>(scene_.image.words().size() / MemoryImage::kLineWords);
    bench_->parent_links_i = options.way_up == WayUp::kParentLinks;
    bench_->use_mailbox_i = options.mailbox != 0;
    for (std::size_t c = 0; c < 6; ++c) {
      bench_->base_i[c] = static_cast<std::uint32_t>(pattern.base[c]);
      bench_->step_x_i[c] = static_cast<std::uint32_t>(pattern.step_x[c]);
      bench_->step_y_i[c] = static_cast<std::uint32_t>(pattern.step_y[c]);
    }
    bench_->width_i = static_cast<std::uint16_t>(pattern.width);
    bench_->t_max_i = pattern.t_max;
    bench_->mark_i = pattern.mark;
    bench_->count_i = count;
    bench_->source_rest_i = static_cast<std::uint8_t>(traffic_.source_rest);
    bench_->sink_rest_i = static_cast<std::uint8_t>(traffic_.sink_rest);
    taken_ = 0;
    bench_->start_i = 1;
    clock();
    bench_->start_i = 0;
    bench_.settle();
    ASSERT_TRUE(bench_->busy_o);
    ASSERT_FALSE(bench_->done_o);
  }
  void finish() {
    const std::uint64_t limit = bench_.clock() + kPatience / 4;
    while (!bench_->done_o && bench_.clock() < limit && !bench_.failed()) clock();
    ASSERT_TRUE(bench_->done_o) << "not done; seed " << test_seed();
    EXPECT_EQ(memory_.waiting(), 0u);
    EXPECT_EQ(memory_.outside(), 0u);
  }
  void check(const Expected& e) {
    EXPECT_EQ(taken_, e.count);
    EXPECT_EQ(bench_->hit_count_o, e.count) << "seed " << test_seed();
    EXPECT_EQ(bench_->checksum_o, e.checksum) << "seed " << test_seed();
    EXPECT_EQ(bench_->image_fault_o, 0);
    EXPECT_EQ(bench_->ray_fault_o, e.faults != 0 ? kRayFault : 0);
  }
  void run(const Pattern& pattern, const Expected& e, const TraceOptions& options = {}) {
    ASSERT_NO_FATAL_FAILURE(begin(pattern, e.count, options));
    ASSERT_NO_FATAL_FAILURE(finish());
    check(e);
  }

  const Prepared& scene_ = prepared("knot");
  Memory memory_;
  Clocked<Model> bench_;
  Traffic traffic_;
  std::uint32_t taken_ = 0;  // rays of this run
};

struct Name {
  template <typename Model>
  static std::string GetName(int) {
    if (std::is_same_v<Model, Vtb_streams_shipped>) return "Shipped";
    return std::is_same_v<Model, Vtb_streams_none> ? "NoHops" : "DeepHops";
  }
};
using Models = testing::Types<Vtb_streams_shipped, Vtb_streams_none, Vtb_streams_deep>;
TYPED_TEST_SUITE(Streams, Models, Name);

constexpr Traffic kRandom = {
    .source_rest = 100, .sink_rest = 100, .memory_percent = 60, .latency = 200, .any_order = true};

TYPED_TEST(Streams, ChecksumOfAFrameIsTheKernels) {
  const Pattern pattern = camera(this->scene_.grid, 32, 24);
  const Expected e = expected(this->scene_, pattern, pattern.count(), {});
  ASSERT_GT(e.hits, e.count / 8);  // the pattern is worth something
  ASSERT_LT(e.hits, e.count);
  ASSERT_EQ(e.faults, 0u);
  for (const Traffic& traffic :
       {Traffic{}, Traffic{.source_rest = 230}, Traffic{.sink_rest = 230}, Traffic{.latency = 300}, kRandom}) {
    this->traffic_ = traffic;
    SCOPED_TRACE(testing::Message() << "rests " << traffic.source_rest << ' ' << traffic.sink_rest << " latency "
                                    << traffic.latency);
    this->run(pattern, e);
    if (this->HasFailure()) return;
  }
}

TYPED_TEST(Streams, WaysUpAndMailbox) {
  const Pattern pattern = camera(this->scene_.grid, 20, 15);
  this->traffic_ = kRandom;
  for (const WayUp way_up : {WayUp::kParentLinks, WayUp::kFaceLinks})
    for (const int mailbox : {0, kCsimMailbox}) {
      const TraceOptions options{.way_up = way_up, .mailbox = mailbox};
      this->run(pattern, expected(this->scene_, pattern, pattern.count(), options), options);
      if (this->HasFailure()) return;
    }
}

// Nobody takes hits: the core fills up and stands still with no ray more than its bound, though contexts that cannot get on look again and may read again; then all hits come.
TYPED_TEST(Streams, SinkThatStallsForThousandsOfClocks) {
  const Pattern pattern = camera(this->scene_.grid, 32, 24);
  const Expected e = expected(this->scene_, pattern, pattern.count(), {});
  this->traffic_ = {.memory_percent = 90, .latency = 50, .any_order = true};
  ASSERT_NO_FATAL_FAILURE(this->begin(pattern, e.count));
  unsigned stalls = 0;
  while (!this->bench_->done_o && stalls < 100 && !this->bench_.failed()) {
    this->bench_->hold_i = 1;
    for (int i = 0; i < (stalls == 1 ? 60000 : 6000); ++i) this->clock();
    const std::uint32_t taken = this->taken_, hits = this->bench_->hit_count_o;
    EXPECT_LE(taken - hits, kInFlight);
    if (taken < e.count) {
      EXPECT_GE(taken - hits, kContexts);
    }
    for (int i = 0; i < 3000; ++i) this->clock();
    EXPECT_EQ(this->taken_, taken);
    EXPECT_EQ(this->bench_->hit_count_o, hits);
    EXPECT_FALSE(this->bench_->done_o);
    this->bench_->hold_i = 0;
    for (int i = 0; i < 4000 && !this->bench_->done_o; ++i) this->clock();
    EXPECT_GT(this->bench_->hit_count_o + (hits == e.count), hits);
    ++stalls;
  }
  EXPECT_GE(stalls, 3u);
  ASSERT_NO_FATAL_FAILURE(this->finish());
  this->check(e);
}

// A run is done when the sink is: the last hit may be on its way for as long as it likes.
TYPED_TEST(Streams, DoneWaitsForTheSink) {
  const Pattern pattern = camera(this->scene_.grid, 8, 4);
  const Expected e = expected(this->scene_, pattern, pattern.count(), {});
  ASSERT_NO_FATAL_FAILURE(this->begin(pattern, e.count));
  for (int i = 0; i < 1000000 && !this->bench_->drained_o; ++i) {
    this->clock();
    this->bench_->hold_i = this->bench_->hit_count_o + 1 == e.count ? this->bench_->drained_o : 0;
    if (this->bench_->hit_count_o == e.count) this->bench_->hold_i = 1;
  }
  ASSERT_TRUE(this->bench_->drained_o);
  for (int i = 0; i < 2000; ++i) this->clock();
  EXPECT_TRUE(this->bench_->drained_o);
  EXPECT_FALSE(this->bench_->done_o);
  this->bench_->hold_i = 0;
  ASSERT_NO_FATAL_FAILURE(this->finish());
  this->check(e);
}

// No rays, one, a few more or less than there are contexts, and a source that ends before its count: the run ends with what was taken.
TYPED_TEST(Streams, SourcesOfAnyLength) {
  const Pattern pattern = camera(this->scene_.grid, 32, 24);
  Random random(test_seed());
  for (const std::uint32_t count : {0u, 1u, 2u, 0u, kContexts - 1, kContexts, kContexts + 1, 3 * kContexts}) {
    SCOPED_TRACE(count);
    this->traffic_ = random.chance(2) ? Traffic{} : kRandom;
    this->run(pattern, expected(this->scene_, pattern, count, {}));
    if (this->HasFailure()) return;
  }
  for (int i = 0; i < 8; ++i) {
    this->traffic_ = random.chance(2) ? Traffic{} : kRandom;
    ASSERT_NO_FATAL_FAILURE(this->begin(pattern, pattern.count()));
    const std::uint64_t stop = random.below(1500) * (i != 0);
    for (std::uint64_t k = 0; k < stop; ++k) this->clock();
    this->bench_->stop_i = 1;
    ASSERT_NO_FATAL_FAILURE(this->finish());
    this->bench_->stop_i = 0;
    ASSERT_LT(this->taken_, pattern.count());
    this->check(expected(this->scene_, pattern, this->taken_, {}));
    if (this->HasFailure()) return;
  }
}

// A ray that could not be read is a hit with that status, the run's sticky fault with its tag; the next run knows nothing of it.
TYPED_TEST(Streams, MarkedRays) {
  Pattern pattern = camera(this->scene_.grid, 30, 20);
  for (const bool mark : {true, false, true}) {
    pattern.mark = mark;
    this->traffic_ = kRandom;
    const Expected e = expected(this->scene_, pattern, pattern.count(), {});
    ASSERT_EQ(e.faults != 0, mark);
    this->run(pattern, e);
    if (mark) {
      EXPECT_EQ(this->bench_->first_fault_o, static_cast<std::uint32_t>(contract::kStatusBusError));
      EXPECT_EQ(this->bench_->fault_tag_o % 65536 % 8, 5u);
      EXPECT_LT(this->bench_->fault_tag_o >> 16, pattern.height);
    }
    if (this->HasFailure()) return;
  }
}

}  // namespace
}  // namespace retrace::rtl_core_test
