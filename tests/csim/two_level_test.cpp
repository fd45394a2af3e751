// Scenes of two levels: the walk in integers against brute force over all triangles of all instances, and closed meshes inside instances.
// RETRACE_RAYS: rays of each test (20000).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "golden/compare/compare.hpp"
#include "golden/engine/exact.hpp"
#include "golden/tree/two_level_scene.hpp"
#include "hls/top/trace.hpp"
#include "testbench/kit/closed_meshes.hpp"
#include "testbench/kit/false_hit.hpp"
#include "testbench/kit/two_level_walk.hpp"
#include "testbench/kit/two_level_world.hpp"

namespace retrace {
namespace {

constexpr double kUnit = 1 << contract::kPositionFrac;

int rays_of_a_test() {
  const char* text = std::getenv("RETRACE_RAYS");
  return text ? std::atoi(text) : 20000;
}

GridPoint to_codes(const glm::dvec3& p) { return GridPoint(glm::floor(p * kUnit + 0.5)); }

/// Objects and instances as the comparator takes them.
GridScene grid_of(const TwoLevelWorld& world) {
  GridScene grid;
  grid.two_levels = true;
  grid.objects = world.objects;
  for (std::size_t i = 0; i < world.scene.instances.size(); ++i)
    grid.instances.push_back({static_cast<std::uint32_t>(i), world.scene.instances[i]});
  return grid;
}

/// The hit as an engine would report it.
Hit reported(const TwoLevelWorld& world, const TwoLevelHit& hit) {
  if (!hit.hit) return {};
  Hit result;
  result.status = contract::kStatusHit;
  result.id = world.scene.instances[hit.instance].first_id + hit.id;
  result.t = hit.t / kUnit;
  return result;
}

/// Is the point inside the closed mesh, and at least 2^-22 from the planes of its triangles, as the proof asks?
bool is_inside(const GridScene& mesh, const std::array<std::int32_t, 3>& point, Random& random) {
  contract::RayRecord ray;
  ray.origin = point;
  const exact::Vec from = exact::to_vec(point);
  for (const GridTriangle& triangle : mesh.triangles) {
    const exact::Vec a = exact::difference(exact::to_vec(triangle.vertices[0]), from);
    const exact::Vec n =
        exact::cross(exact::difference(exact::to_vec(triangle.vertices[1]), exact::to_vec(triangle.vertices[0])),
                     exact::difference(exact::to_vec(triangle.vertices[2]), exact::to_vec(triangle.vertices[0])));
    const double length = std::sqrt(static_cast<double>(exact::dot(n, n)));
    if (std::abs(static_cast<double>(exact::dot(n, a))) < 4.0 * length) return false;
  }
  for (;;) {  // until a ray meets no edge
    for (auto& d : ray.direction) d = static_cast<std::int32_t>(random.integer(-(1 << 26), (1 << 26) - 1));
    int winding = 0;
    bool clean = true;
    for (const GridTriangle& triangle : mesh.triangles) {
      const std::array<exact::Vec, 3> vertices{exact::to_vec(triangle.vertices[0]), exact::to_vec(triangle.vertices[1]),
                                               exact::to_vec(triangle.vertices[2])};
      const auto crossing = exact::intersect(ray, vertices);
      if (crossing.parallel()) clean = false;
      if (!crossing.inside() || !crossing.ahead()) continue;
      if (crossing.edge[0] == 0 || crossing.edge[1] == 0 || crossing.edge[2] == 0) clean = false;
      winding += exact::dot(exact::to_vec(ray.direction), crossing.normal) > 0 ? 1 : -1;
    }
    if (clean) return winding != 0;
  }
}

class TwoLevels : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(TwoLevels, walk_equals_brute_force_but_at_false_hits) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const auto [instances, cells] = GetParam();
  const TwoLevelWorld world = make_two_level_world(random, static_cast<std::size_t>(instances), cells);
  TwoLevelWork work;
  const GridScene grid = grid_of(world);
  const Comparator comparator(grid);
  int hits = 0, different = 0, false_hits = 0, at_top = 0, early = 0;
  const int rays = rays_of_a_test();
  for (int i = 0; i < rays; ++i) {
    const auto instance = static_cast<std::uint32_t>(random.below(world.placed.size()));
    auto ray = make_world_ray(random_world_origin(world, random), random_world_target(world, instance, random), random);
    if (random.chance(8))
      ray.t_max = static_cast<std::uint32_t>(random.below(std::uint64_t{3} << contract::kTLimitFrac));
    const TwoLevelHit hit = trace_two_levels(world.scene, ray, &work);
    TwoLevelHit truth = brute_force_two_levels(world.scene, ray);
    hits += truth.hit;
    auto any_ray = ray;
    any_ray.any = 1;
    const TwoLevelHit any = trace_two_levels(world.scene, any_ray);
    if (hit == truth) {
      ASSERT_EQ(any.hit, truth.hit) << "seed " << seed << " ray " << i;
      continue;
    }
    // What brute force has before the walk's answer are hits that only the tolerance of the test makes, in triangles whose cells the ray does
    // not pass, each proved in integers; or hits that lie behind the walk's answer, but for the certified error of t.
    ++different;
    TwoLevelVisits visits;
    ASSERT_EQ(trace_two_levels(world.scene, ray, nullptr, nullptr, &visits), hit);
    std::vector<TwoLevelTriangle> left_out;
    while (truth.hit && truth != hit) {
      bool top = false;
      const FalseHit proof = prove_false_hit(world.objects, world.scene, ray, truth, visits, top);
      if (proof == FalseHit::kTrueHit) {
        const Verdict verdict =
            comparator.compare({ray, 0.0, 1.0, false}, reported(world, truth), reported(world, hit));
        ASSERT_TRUE(verdict.agreement != Agreement::kViolation && !verdict.lost)
            << "seed " << seed << " ray " << i << ": instance " << truth.instance << " triangle " << truth.id << " t "
            << truth.t << ", the walk says " << hit.hit << " instance " << hit.instance << " triangle " << hit.id
            << " t " << hit.t << ": overlooked";
        ++early;
      } else {
        ASSERT_EQ(proof, FalseHit::kProved) << "seed " << seed << " ray " << i << ": instance " << truth.instance
                                            << " triangle " << truth.id << ": " << to_string(proof);
        ++false_hits;
        at_top += top;
      }
      left_out.push_back({truth.instance, truth.id});
      truth = brute_force_two_levels(world.scene, ray, left_out);
    }
    ASSERT_EQ(hit, truth) << "seed " << seed << " ray " << i;
  }
  const double n = rays;
  std::printf(
      "%d instances: %d hits of %d rays, %d differ from brute force; %d hits of it are proved false and outside the "
      "cells (%d of the top level), %d differ by the error of t\n",
      instances, hits, rays, different, false_hits, at_top, early);
  std::printf(
      "a ray: top %.2f down %.2f leaves, %.2f entries (%.2f rejected, %.2f saved), object %.2f down %.2f leaves %.2f "
      "tests\n",
      static_cast<double>(work.top_down) / n, static_cast<double>(work.top_leaf) / n,
      static_cast<double>(work.entries) / n, static_cast<double>(work.rejected) / n,
      static_cast<double>(work.saved) / n, static_cast<double>(work.down) / n, static_cast<double>(work.leaf) / n,
      static_cast<double>(work.tests) / n);
  EXPECT_GT(hits, rays / 2);
  EXPECT_LT(different, rays / 500);
}

TEST(FalseHits, are_proved_part_by_part) {
  constexpr std::int32_t kHalf = 1 << 22, kPad = contract::kBoxPad;
  GridScene one;
  one.triangles = {{{GridPoint(-kHalf, -kHalf, 0), GridPoint(kHalf, -kHalf, 0), GridPoint(-kHalf, kHalf, 0)}, 0}};
  one.box = {-kHalf - kPad, kHalf + kPad, -kHalf - kPad, kHalf + kPad, -kPad, kPad};
  GridScene two = one;  // the second triangle is not in the image
  two.triangles.push_back({one.triangles[0].vertices, 1});
  const MemoryImage image = build_kd(one);
  contract::RayRecord ray;
  ray.origin = {-kHalf - 8, 0, kPad / 2};
  ray.direction = {0, 0, -(1 << contract::kDirectionFrac)};
  ray.t_max = (1u << contract::kTLimitBits) - 1;
  const std::uint32_t t = kPad / 2;
  std::vector<std::uint32_t> visits;
  ASSERT_TRUE(trace_one_level(image, ray, visits).hit);  // a false hit, and the walk sees it
  ASSERT_EQ(visits.size(), 1u);
  EXPECT_EQ(prove_false_hit(two, image, ray, 0, t, visits), FalseHit::kListed);
  EXPECT_EQ(prove_false_hit(two, image, ray, 1, t, visits), FalseHit::kNotListed);
  EXPECT_EQ(prove_false_hit(two, image, ray, 0, t, {}), FalseHit::kPassedBy);
  EXPECT_EQ(prove_false_hit(two, image, ray, 1, t, {}), FalseHit::kProved);
  ray.origin[0] = -kHalf - 13;  // the certified band is 12.6 codes
  EXPECT_EQ(prove_false_hit(two, image, ray, 1, t, {}), FalseHit::kBeyondBand);
  ray.origin[0] = -kHalf + 8;
  EXPECT_EQ(prove_false_hit(two, image, ray, 1, t, {}), FalseHit::kTrueHit);
  ray.origin = {-kHalf + 8, 0, -1};  // behind, by less than the error of the test
  EXPECT_EQ(prove_false_hit(two, image, ray, 1, t, {}), FalseHit::kBeyondBand);
}

TEST(FalseHits, triangles_and_rays_touch_cells_exactly) {
  const GridTriangle triangle{{GridPoint(0, 0, 0), GridPoint(100, 0, 0), GridPoint(0, 100, 0)}, 0};
  EXPECT_TRUE(touches(triangle, {50, 60, 50, 60, -1, 1}));   // the corner of the cell lies on the edge
  EXPECT_FALSE(touches(triangle, {51, 60, 50, 60, -1, 1}));  // inside the box of the triangle, outside the triangle
  EXPECT_FALSE(touches(triangle, {0, 10, 0, 10, 1, 2}));
  EXPECT_TRUE(touches(triangle, {-10, 200, -10, 200, -10, 10}));
  contract::RayRecord ray;
  ray.direction = {1 << 26, 1 << 25, 0};
  EXPECT_TRUE(passes(ray, {10, 20, 10, 20, 0, 0}, 20));  // through a corner, at the very end
  EXPECT_FALSE(passes(ray, {10, 20, 10, 20, 0, 0}, 19));
  EXPECT_FALSE(passes(ray, {10, 19, 10, 20, 0, 0}, 1000));
  EXPECT_FALSE(passes(ray, {10, 20, 10, 20, 1, 5}, 1000));
  EXPECT_FALSE(passes(ray, {-20, -10, -20, -5, 0, 0}, 1000));  // behind
}

TEST_P(TwoLevels, no_ray_leaves_a_closed_mesh_of_an_instance) {
  const std::uint64_t seed = test_seed();
  Random random(seed + 1);
  const auto [instances, cells] = GetParam();
  const TwoLevelWorld world = make_two_level_world(random, static_cast<std::size_t>(instances), cells);
  int escaped = 0, left_out = 0;
  const int rays = rays_of_a_test();
  for (int i = 0; i < rays; ++i) {
    const auto instance = static_cast<std::uint32_t>(random.below(world.placed.size()));
    const GridScene& object = world.object(instance);
    const glm::dvec3 inside = glm::dvec3(inside_closed_mesh(object, random)) / kUnit;
    const GridPoint origin = to_codes(world.to_world(instance, inside));
    // The world's grid is coarse for a small object: the rounded origin may be outside its mesh, and then nothing is promised.
    const auto ray = make_world_ray(origin, random_world_target(world, instance, random), random);
    const auto entry = enter_instance(world.scene.instances[instance], ray, ray.t_max + 1);
    if (!entry || entry->start != 0) {
      ++left_out;
      continue;
    }
    if (!is_inside(object, entry->origin, random)) {
      ++left_out;
      continue;
    }
    if (!trace_two_levels(world.scene, ray).hit) {
      ++escaped;
      std::printf("seed %llu ray %d: instance %u, escaped\n", static_cast<unsigned long long>(seed), i, instance);
    }
  }
  std::printf("%d instances: %d of %d rays escaped, %d left out\n", instances, escaped, rays, left_out);
  EXPECT_EQ(escaped, 0);
  EXPECT_LT(left_out, rays / 2);
}

TEST_P(TwoLevels, the_answer_does_not_depend_on_the_order_of_visits) {
  // The same instances under another numbering: hits at the same place, of the same instance.
  const std::uint64_t seed = test_seed();
  Random random(seed + 2);
  const auto [instances, cells] = GetParam();
  const TwoLevelWorld world = make_two_level_world(random, static_cast<std::size_t>(instances), cells);
  TwoLevelWorld turned = world;
  std::reverse(turned.placed.begin(), turned.placed.end());
  turned.scene = build_two_levels(turned.objects, turned.placed);
  int same = 0;
  const int rays = rays_of_a_test() / 4;
  for (int i = 0; i < rays; ++i) {
    const auto instance = static_cast<std::uint32_t>(random.below(world.placed.size()));
    const auto ray =
        make_world_ray(random_world_origin(world, random), random_world_target(world, instance, random), random);
    const TwoLevelHit one = trace_two_levels(world.scene, ray), two = trace_two_levels(turned.scene, ray);
    ASSERT_EQ(one.hit, two.hit) << "seed " << seed << " ray " << i;
    if (!one.hit) continue;
    const auto other = static_cast<std::uint32_t>(world.placed.size()) - 1 - two.instance;
    ASSERT_EQ(one.t, two.t) << "seed " << seed << " ray " << i;
    if (one.instance != other) continue;  // as near in the world: the lower number
    ++same;
    ASSERT_EQ(one.id, two.id) << "seed " << seed << " ray " << i;
  }
  EXPECT_GT(same, rays / 4);
}

/// The kernel over the assembled image: hits of all rays.
std::vector<contract::HitRecord> run_kernel(const std::vector<std::uint64_t>& image,
                                            const std::vector<contract::RayRecord>& rays, unsigned options) {
  const auto to_words = [](const std::vector<std::uint64_t>& from) {
    std::vector<hls::word_t> words(from.size() / 2);
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i] = ap_uint<64>(from[2 * i + 1]);
      words[i] <<= 64;
      words[i] |= hls::word_t(ap_uint<64>(from[2 * i]));
    }
    return words;
  };
  std::vector<std::uint64_t> packed(rays.size() * contract::RayRecord::kWords);
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i].pack(&packed[i * contract::RayRecord::kWords]);
  const auto memory = to_words(image), ray_words = to_words(packed);
  std::vector<hls::word_t> hits(rays.size()), work(rays.size());
  ap_uint<64> summary[kSummaryWords];
  retrace_trace(memory.data(), memory.data(), memory.data(), memory.data(), ray_words.data(), hits.data(), work.data(),
                summary, static_cast<unsigned>(image.size() / MemoryImage::kLineWords),
                static_cast<unsigned>(rays.size()), options);
  EXPECT_EQ(summary[kSummaryStatus].to_uint64(), 0u);
  std::vector<contract::HitRecord> result;
  for (const hls::word_t& word : hits) {
    const hls::word_t high = word >> 64;
    const std::uint64_t raw[2] = {ap_uint<64>(word).to_uint64(), ap_uint<64>(high).to_uint64()};
    result.push_back(contract::HitRecord::unpack(raw));
  }
  return result;
}

constexpr unsigned kModes[] = {0, RETRACE_OPTION_PARENT_LINKS, RETRACE_OPTION_MAILBOX,
                               RETRACE_OPTION_PARENT_LINKS | RETRACE_OPTION_MAILBOX | RETRACE_OPTION_WORK};

TEST_P(TwoLevels, the_kernel_says_what_the_walk_says) {
  const std::uint64_t seed = test_seed();
  Random random(seed + 3);
  const auto [instances, cells] = GetParam();
  const TwoLevelWorld world = make_two_level_world(random, static_cast<std::size_t>(instances), cells);
  const auto image = assemble_two_levels(world.scene);
  std::vector<contract::RayRecord> rays;
  for (int i = 0; i < rays_of_a_test() / 10; ++i) {
    const auto instance = static_cast<std::uint32_t>(random.below(world.placed.size()));
    auto ray = make_world_ray(random_world_origin(world, random), random_world_target(world, instance, random), random);
    if (random.chance(8))
      ray.t_max = static_cast<std::uint32_t>(random.below(std::uint64_t{3} << contract::kTLimitFrac));
    if (random.chance(50)) ray.origin[0] = (1 << 24) + 1;
    if (random.chance(4)) ray.any = 1;
    rays.push_back(ray);
  }
  for (const unsigned options : kModes) {
    const auto hits = run_kernel(image, rays, options);
    int found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      std::uint32_t status = 0;
      const TwoLevelHit truth = trace_two_levels(world.scene, rays[i], nullptr, &status);
      ASSERT_EQ(hits[i].status, status) << "seed " << seed << " ray " << i << " options " << options;
      if (!truth.hit) continue;
      ++found;
      ASSERT_EQ(hits[i].t, truth.t) << "seed " << seed << " ray " << i << " options " << options;
      ASSERT_EQ(hits[i].id, world.scene.instances[truth.instance].first_id + truth.id)
          << "seed " << seed << " ray " << i << " options " << options;
    }
    EXPECT_GT(found, static_cast<int>(rays.size()) / 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, TwoLevels, testing::Values(std::pair{1, 4}, std::pair{12, 6}, std::pair{100, 4}),
                         [](const auto& info) { return std::to_string(info.param.first); });

TEST(TwoLevel, corrupt_instances_are_bad_records_or_misses_and_never_hang) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  const TwoLevelWorld world = make_two_level_world(random, 12, 2);
  int bad = 0;
  for (int i = 0; i < 4000; ++i) {
    TwoLevelWorld broken = world;
    const auto number = random.below(broken.scene.instances.size());
    std::uint64_t words[contract::InstanceRecord::kWords];
    broken.scene.instances[number].pack(words);
    for (auto flips = 1 + random.below(4); flips > 0; --flips) {
      const auto bit = random.below(288 + 102 + 15);  // rows and exponents; roots are checked with the image
      words[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    broken.scene.instances[number] = contract::InstanceRecord::unpack(words);
    const auto ray = make_world_ray(random_world_origin(world, random),
                                    random_world_target(world, static_cast<std::uint32_t>(number), random), random);
    std::uint32_t status = 0;
    const TwoLevelHit hit = trace_two_levels(broken.scene, ray, nullptr, &status);
    bad += status == static_cast<std::uint32_t>(contract::kStatusBadRecord);
    ASSERT_EQ(hit.hit, status == static_cast<std::uint32_t>(contract::kStatusHit));
  }
  EXPECT_GT(bad, 20);
}

TEST(TwoLevel, a_corrupt_image_ends_every_ray_of_the_kernel) {
  const std::uint64_t seed = test_seed();
  Random random(seed + 4);
  const TwoLevelWorld world = make_two_level_world(random, 12, 2);
  const auto image = assemble_two_levels(world.scene);
  std::vector<contract::RayRecord> rays;
  for (int i = 0; i < 40; ++i)
    rays.push_back(make_world_ray(
        random_world_origin(world, random),
        random_world_target(world, static_cast<std::uint32_t>(random.below(world.placed.size())), random), random));
  std::array<int, 16> statuses{};
  const auto header = contract::HeaderRecord::unpack(image.data());
  for (int i = 0; i < 400; ++i) {
    auto broken = image;
    for (auto flips = 1 + random.below(16); flips > 0; --flips) {
      // Anywhere behind the header, and as often in the instance records.
      const std::uint64_t first = (random.chance(2) ? header.instance_offset : 2) * MemoryImage::kLineWords;
      broken[first + random.below(broken.size() - first)] ^= std::uint64_t{1} << random.below(64);
    }
    for (const auto& hit : run_kernel(broken, rays, kModes[random.below(std::size(kModes))])) ++statuses[hit.status];
  }
  for (const auto status :
       {contract::kStatusMiss, contract::kStatusHit, contract::kStatusBadIndex, contract::kStatusBadRecord})
    EXPECT_GT(statuses[static_cast<std::size_t>(status)], 0) << status;
}

// The same wall in two objects; that of the higher number has a spike towards the ray, so its box is entered first, alone in its cells.
TEST(TwoLevel, at_the_same_t_the_lower_instance_wins_though_it_is_met_later) {
  constexpr std::int32_t kHalf = 1 << 23, kUp = 12 << 20;
  const GridPoint a(-kHalf, -kHalf, 0), b(kHalf, -kHalf, 0), c(kHalf, kHalf, 0), d(-kHalf, kHalf, 0);
  GridScene wall, spiked;
  wall.triangles = {{{a, b, c}, 0}, {{a, c, d}, 1}};
  wall.box = {-kHalf - contract::kBoxPad, kHalf + contract::kBoxPad, -kHalf - contract::kBoxPad,
              kHalf + contract::kBoxPad,  -contract::kBoxPad,        contract::kBoxPad};
  spiked = wall;
  spiked.triangles.push_back({{GridPoint(kHalf, 0, 0), GridPoint(kHalf, 1 << 18, kUp), GridPoint(kHalf, 0, kUp)}, 2});
  spiked.box[5] = kUp + contract::kBoxPad;
  const std::vector<GridScene> objects{wall, spiked};
  const Placement placement{glm::dmat3(0.5), glm::dvec3(0.0)};
  std::vector<PlacedObject> placed{{0, placement}, {1, placement}};
  placed.resize(32, {0, placement});  // more walls there: the tree splits above them
  const TwoLevelScene scene = build_two_levels(objects, placed);
  contract::RayRecord ray;
  ray.origin = {1 << 16, 1 << 17, 5 << 20};
  ray.direction = {0, 0, -(1 << 26)};
  ray.t_max = (1u << contract::kTLimitBits) - 1;
  TwoLevelWork work;
  const TwoLevelHit hit = trace_two_levels(scene, ray, &work);
  ASSERT_TRUE(hit.hit);
  EXPECT_EQ(hit, brute_force_two_levels(scene, ray));
  EXPECT_EQ(hit.instance, 0u);
  EXPECT_EQ(hit.t, 5u << 20);
  EXPECT_GE(work.top_leaf, 2u);
  for (const unsigned options : kModes) EXPECT_EQ(run_kernel(assemble_two_levels(scene), {ray}, options)[0].id, hit.id);
}

TEST(TwoLevel, what_cannot_be_an_instance_is_refused) {
  Random random(test_seed());
  std::vector<GridScene> objects{make_small_object("box", 2, random)};
  std::vector<PlacedObject> placed{{0, {}}};
  EXPECT_THROW(build_two_levels(objects, std::vector<PlacedObject>{{1, {}}}), Error);
  placed[0].to_world.linear = glm::dmat3(0.0);
  EXPECT_THROW(build_two_levels(objects, placed), Error);
  EXPECT_EQ(build_two_levels(objects, {}).top.header().triangle_count, 0u);
}

}  // namespace
}  // namespace retrace
