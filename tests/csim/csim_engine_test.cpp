// The kernel as an engine: options, corrupt images, and why the exit distance of a leaf is needed.
#include "testbench/csim/csim_engine.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <vector>

#include "golden/engine/stages/kd_descend.hpp"
#include "golden/engine/stages/leaf_exit.hpp"
#include "golden/engine/stages/tri_test.hpp"
#include "golden/tree/kd_builder.hpp"
#include "hls/top/trace.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

struct Case {
  GridScene scene;
  MemoryImage image;
  std::vector<GridRay> rays;

  explicit Case(const std::string& name, std::size_t count, std::uint64_t seed) {
    scene = snap(flatten(open_scene(name)));
    image = build_kd(scene);
    Random random(seed);
    rays = make_test_rays(scene, image, count, random);
  }
};

std::vector<Hit> trace(Engine& engine, std::span<const GridRay> rays, const TraceOptions& options = {},
                       std::span<RayWork> work = {}) {
  std::vector<Hit> hits(rays.size());
  engine.trace(rays, hits, work, options);
  return hits;
}

TEST(CsimEngine, the_number_of_threads_changes_nothing) {
  const Case c("knot:along=60,around=8", 9000, test_seed());
  auto engine = make_csim_engine(c.image);
  TraceOptions options;
  options.threads = 1;
  trace(*engine, c.rays, options);
  const std::vector<std::uint64_t> one(engine->raw_hits().begin(), engine->raw_hits().end());
  options.threads = 3;
  trace(*engine, c.rays, options);
  EXPECT_EQ(one, std::vector<std::uint64_t>(engine->raw_hits().begin(), engine->raw_hits().end()));
}

TEST(CsimEngine, work_counts_agree_with_golden) {
  Case c("knot:along=60,around=8", 45000, test_seed());
  // Rays of no particular aim; those in planes and through vertices touch cells that fixed point may step over or into.
  std::vector<GridRay> plain;
  for (std::size_t i = 0; i < c.rays.size(); ++i) {
    const auto kind = static_cast<RayKind>(i % static_cast<std::size_t>(RayKind::kCount));
    if (kind == RayKind::kThrough || kind == RayKind::kInside) plain.push_back(c.rays[i]);
  }
  c.rays = plain;
  auto csim = make_csim_engine(c.image);
  auto golden = make_golden_engine(c.scene, c.image);
  for (const WayUp way : {WayUp::kParentLinks, WayUp::kFaceLinks}) {
    TraceOptions options;
    options.way_up = way;
    std::vector<RayWork> a(c.rays.size()), b(c.rays.size());
    trace(*csim, c.rays, options, a);
    trace(*golden, c.rays, options, b);
    RayWork sum_a, sum_b;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum_a.down += a[i].down, sum_b.down += b[i].down;
      sum_a.up += a[i].up, sum_b.up += b[i].up;
      sum_a.leaf += a[i].leaf, sum_b.leaf += b[i].leaf;
      sum_a.tests += a[i].tests, sum_b.tests += b[i].tests;
    }
    EXPECT_NEAR(sum_a.down, sum_b.down, 0.01 * sum_b.down);
    EXPECT_NEAR(sum_a.up, sum_b.up, 0.01 * sum_b.up);
    EXPECT_NEAR(sum_a.leaf, sum_b.leaf, 0.01 * sum_b.leaf);
    EXPECT_NEAR(sum_a.tests, sum_b.tests, 0.01 * sum_b.tests);
    if (way == WayUp::kFaceLinks) EXPECT_EQ(sum_a.up, 0u);
  }
}

TEST(CsimEngine, refuses_what_the_kernel_does_not_have) {
  const Case c("one", 9, test_seed());
  auto engine = make_csim_engine(c.image);
  TraceOptions options;
  options.way_up = WayUp::kStack;
  EXPECT_THROW(trace(*engine, c.rays, options), Error);
  options.way_up = WayUp::kFaceLinks;
  options.mailbox = 3;
  EXPECT_THROW(trace(*engine, c.rays, options), Error);
  std::vector<Hit> few(1);
  EXPECT_THROW(engine->trace(c.rays, few, {}, {}), Error);
}

TEST(CsimEngine, bad_rays_end_in_a_status) {
  const Case c("one", 9, test_seed());
  auto engine = make_csim_engine(c.image);
  std::vector<GridRay> rays(2);
  rays[0].record.origin = {c.scene.box[1] + 1, c.scene.box[2], c.scene.box[4]};
  rays[0].record.direction = {-(1 << 26), 0, 0};
  rays[1].record.origin = {c.scene.box[1], c.scene.box[2], c.scene.box[4]};
  for (const Hit& hit : trace(*engine, rays))
    EXPECT_EQ(hit.status, static_cast<std::uint32_t>(contract::kStatusBadRay));
}

TEST(CsimEngine, a_step_limit_ends_the_walk) {
  const Case c("knot:along=60,around=8", 900, test_seed());
  std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
  auto header = c.image.header();
  header.step_limit = 10;
  header.pack(words.data());
  auto engine = make_csim_engine(words);
  std::vector<RayWork> work(c.rays.size());
  const auto hits = trace(*engine, c.rays, {}, work);
  int limited = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_LE(work[i].down + work[i].up + work[i].leaf + work[i].tests + work[i].skipped, 10u);
    limited += hits[i].status == static_cast<std::uint32_t>(contract::kStatusStepLimit);
  }
  EXPECT_GT(limited, 100);
}

TEST(CsimEngine, a_wrong_header_is_an_error_and_nothing_is_traced) {
  const Case c("one", 9, test_seed());
  for (const bool magic : {true, false}) {
    std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
    auto header = c.image.header();
    if (magic) {
      header.magic ^= 1;
    } else {
      header.triangle_count = 0x7fffffff;
    }
    header.pack(words.data());
    auto engine = make_csim_engine(words);
    EXPECT_THROW(trace(*engine, c.rays), Error);
  }
  std::vector<std::uint64_t> nothing;
  auto engine = make_csim_engine(nothing);
  EXPECT_THROW(trace(*engine, c.rays), Error);
}

// Bits are turned over anywhere behind the header. Whatever comes out, every ray is answered and nothing outside the
// image is read (the sanitizer build sees that).
// An index that cannot name the last records would wrap in one engine and not in another.
TEST(CsimEngine, a_section_with_more_records_than_its_index_can_name_is_refused) {
  const Case c("box", 1, test_seed());
  const auto fault_of = [&](std::uint32_t contract::HeaderRecord::*field, std::uint32_t count) {
    std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
    contract::HeaderRecord header = c.image.header();
    header.*field = count;
    header.pack(words.data());
    const auto* image = reinterpret_cast<const hls::word_t*>(words.data());
    std::array<ap_uint<64>, kSummaryWords> summary;
    // As large as an image can say it is; without rays nothing but the header is read.
    constexpr std::uint32_t kLines = 0xffffffff;
    retrace_trace(image, image, image, image, nullptr, nullptr, nullptr, summary.data(), kLines, 0, 0);
    return summary[kSummaryStatus].to_int();
  };
  const auto expect_limit = [&](std::uint32_t contract::HeaderRecord::*field, int bits, const char* name) {
    const std::uint32_t most = std::uint32_t{1} << bits;
    EXPECT_EQ(fault_of(field, most), kFaultNone) << name;
    for (const std::uint32_t count : {most + 1, 2 * most, 3 * most})
      EXPECT_EQ(fault_of(field, count), kFaultLayout) << name << ' ' << count;
  };
  expect_limit(&contract::HeaderRecord::pair_count, contract::kPairIndexBits, "pair_count");
  expect_limit(&contract::HeaderRecord::leaf_count, contract::kPairIndexBits, "leaf_count");
  expect_limit(&contract::HeaderRecord::list_count, contract::kListIndexBits, "list_count");
  expect_limit(&contract::HeaderRecord::triangle_count, contract::kTriangleIndexBits, "triangle_count");
}

TEST(CsimEngine, corrupt_images_end_in_a_status) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const Case c("knot:along=24,around=6", 90, seed);
  std::array<int, 8> seen{};
  for (int round = 0; round < 300; ++round) {
    std::vector<std::uint64_t> words(c.image.words().begin(), c.image.words().end());
    const std::size_t first = contract::HeaderRecord::kWords;
    for (std::uint64_t flips = 1 + random.below(64); flips > 0; --flips)
      words[first + random.below(words.size() - first)] ^= std::uint64_t{1} << random.below(64);
    auto engine = make_csim_engine(words);
    TraceOptions options;
    options.way_up = random.chance(2) ? WayUp::kParentLinks : WayUp::kFaceLinks;
    options.mailbox = random.chance(2) ? kCsimMailbox : 0;
    options.threads = 1;
    for (const Hit& hit : trace(*engine, c.rays, options)) {
      ASSERT_LE(hit.status, static_cast<std::uint32_t>(contract::kStatusInvariant))
          << "seed " << seed << " round " << round;
      ++seen[hit.status];
    }
  }
  EXPECT_GT(seen[contract::kStatusBadIndex], 0);
  EXPECT_GT(seen[contract::kStatusBadRecord], 0);
}

// A walk that has neither boxes nor the exit distance of the leaf: it climbs to the nearest ancestor whose near child
// it is in and keeps its old t. Kept to show that the exit distance is not decoration.
Hit walk_without_exit_distance(const GridScene& scene, const MemoryImage& image, const contract::RayRecord& record) {
  const auto ray = golden::ray_setup(record);
  std::uint32_t node = 0;
  Hit best;
  double limit = ray.t_max;
  while (true) {
    const auto at = [&](std::uint32_t index) {
      const auto pair = image.pair(index / 2);
      return index % 2 ? std::array<std::int64_t, 3>{pair.right_split, pair.right_axis, pair.right_child}
                       : std::array<std::int64_t, 3>{pair.left_split, pair.left_axis, pair.left_child};
    };
    auto here = at(node);
    while (here[1] != contract::kAxisLeaf) {
      const int axis = static_cast<int>(here[1]);
      node = golden::kd_descend(ray, axis, golden::t_plane(ray, axis, here[0] * 0x1p-24),
                                static_cast<std::uint32_t>(2 * here[2]), 0.0);
      here = at(node);
    }
    const auto leaf = image.leaf(static_cast<std::size_t>(here[2]));
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      const auto id = image.triangle(image.reference(leaf, r)).id;
      const auto triangle = std::lower_bound(scene.triangles.begin(), scene.triangles.end(), id,
                                             [](const GridTriangle& a, std::uint32_t b) { return a.id < b; });
      std::array<int, 3> order;
      make_unit_triangle(*triangle, &order);
      golden::Candidate candidate;
      if (golden::tri_test(golden::make_triangle(*triangle, order), ray, limit, candidate) && candidate.t <= limit) {
        limit = candidate.t;
        best.status = contract::kStatusHit;
        best.id = id;
      }
    }
    if (best.hit()) return best;
    while (true) {
      if (node == 0) return best;
      const std::uint32_t parent = image.pair(node / 2).parent;
      const auto above = at(parent);
      const bool near = (node % 2 != 0) == ray.negative[static_cast<int>(above[1])];
      node = near ? node ^ 1u : parent;
      if (near) break;
    }
  }
}

TEST(Backtrack, without_the_exit_distance_hits_are_wrong) {
  const Case c("knot:along=60,around=8", 900, test_seed());
  auto golden = make_golden_engine(c.scene, c.image);
  std::vector<GridRay> rays;
  for (const auto& ray : c.rays)
    if (!ray.outside && !ray.record.any) rays.push_back(ray);
  const auto truth = trace(*golden, rays);
  int wrong = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    wrong += walk_without_exit_distance(c.scene, c.image, rays[i].record).id != truth[i].id;
  EXPECT_GT(wrong, static_cast<int>(rays.size() / 50)) << "of " << rays.size();
}

}  // namespace
}  // namespace retrace
