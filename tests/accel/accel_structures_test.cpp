// Every structure and traversal of the lab returns, bit for bit, what brute force returns with the same triangle test,
// on rays that look for trouble; mailboxes change the work and nothing else; and the counts stand in the order they
// must.
#include <gtest/gtest.h>

#include <map>

#include "golden/accel/bvh.hpp"
#include "golden/accel/catalogue.hpp"
#include "golden/accel/probe.hpp"
#include "test_scenes.hpp"
#include "testbench/kit/closed_meshes.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace::accel {
namespace {

constexpr std::size_t kRays = 3000;

std::vector<Ray> rays_for(const GridScene& scene, std::size_t count, Random& random) {
  const MemoryImage image = build_kd(scene);
  std::vector<Ray> rays;
  for (const GridRay& r : make_test_rays(scene, image, count, random))
    if (!r.outside) rays.push_back(from_grid(r));
  return rays;
}

/// Bit for bit for closest-hit rays; for occlusion, the same answer and a hit that is one.
void expect_same(const Ray& ray, const Hit& expected, const Hit& hit, const TriangleSet& set,
                 const std::string& where) {
  if (!ray.any) {
    EXPECT_EQ(expected.id, hit.id) << where;
    EXPECT_EQ(expected.t, hit.t) << where;
    EXPECT_EQ(expected.u, hit.u) << where;
    EXPECT_EQ(expected.v, hit.v) << where;
    return;
  }
  EXPECT_EQ(expected.hit(), hit.hit()) << where;
  if (!hit.hit()) return;
  Hit again = no_hit(ray);
  for (const Triangle& t : set.triangles)
    if (t.id == hit.id) intersect(ray, t, again);
  EXPECT_EQ(again, hit) << where;
}

TEST(Structures, EqualBruteForce) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const NamedScene& s : small_scenes(random)) {
    const std::vector<Ray> rays = rays_for(s.scene, kRays, random);
    Workshop workshop(s.scene);
    double seconds;
    std::vector<Hit> expected;
    for (const Technique& technique : catalogue()) {
      const auto structure = technique.make(workshop, seconds);
      Probe probe;
      std::size_t hits = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit hit = structure->trace(rays[i], probe);
        hits += hit.hit();
        if (technique.key == "brute-force") {
          expected.push_back(hit);
        } else {
          expect_same(rays[i], expected[i], hit, workshop.set(),
                      s.name + ", " + technique.key + ", ray " + std::to_string(i));
        }
        if (HasFailure()) return;
      }
      if (s.name == "sphere") {
        EXPECT_GT(hits, rays.size() / 3) << technique.key;
      }
    }
  }
}

/// No ray from inside a closed mesh gets out, however thin its triangles and however flat they lie to the ray: the test gives up on a triangle only
/// where the ray lies in its plane.
TEST(TriangleTest, ClosedMeshesHaveNoHoles) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const char* kind : {"box", "sphere", "random", "sliver"}) {
    std::size_t lost = 0;
    for (int mesh = 0; mesh < 20; ++mesh) {
      const GridScene scene = make_closed_mesh(kind, 6, random);
      const TriangleSet set = from_grid(scene);
      for (const GridRay& grid : make_exact_edge_rays(scene, inside_closed_mesh(scene, random), 1000, random)) {
        const Ray ray = from_grid(grid);
        Hit best = no_hit(ray);
        for (const Triangle& triangle : set.triangles) intersect(ray, triangle, best);
        lost += !best.hit();
      }
    }
    EXPECT_EQ(lost, 0u) << kind;
  }
}

TEST(Structures, MailboxesOnlySaveTests) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene scene = snap_soup(random_soup(600, 0.4, random));
  const std::vector<Ray> rays = rays_for(scene, kRays, random);
  Workshop workshop(scene);
  double seconds;
  for (const Technique& technique : catalogue()) {
    if (!technique.duplicates) continue;
    const auto structure = technique.make(workshop, seconds);
    ASSERT_TRUE(structure->duplicates_references()) << technique.key;
    Probe plain;
    std::vector<Hit> expected;
    for (const Ray& ray : rays) expected.push_back(structure->trace(ray, plain));
    EXPECT_EQ(plain.work.skipped, 0u);
    std::uint64_t fewer = plain.work.tests;
    for (const int entries : {2, 4, 8, 16, 32, 64, Mailbox::kExact}) {
      Probe probe(Mailbox(entries, structure->size()));
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_EQ(expected[i], structure->trace(rays[i], probe))
            << technique.key << ", mailbox " << entries << ", ray " << i;
      EXPECT_EQ(plain.work.tests, probe.work.tests + probe.work.skipped) << technique.key << ", mailbox " << entries;
      EXPECT_EQ(plain.work.visits(), probe.work.visits());
      EXPECT_LE(probe.work.tests, fewer) << technique.key << ", mailbox " << entries;
      fewer = probe.work.tests;
      if (entries == Mailbox::kExact) {
        EXPECT_GT(probe.work.skipped, 0u) << technique.key;
      }
    }
  }
}

/// An exact mailbox never lets a triangle be tested twice by one ray: the number of tests equals that of distinct
/// triangles.
TEST(Structures, ExactMailboxTestsEveryTriangleOnce) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene scene = snap_soup(random_soup(300, 0.5, random));
  const std::vector<Ray> rays = rays_for(scene, 500, random);
  Workshop workshop(scene);
  double seconds;
  for (const char* key : {"grid-pharr", "kd-sah/stack", "kd-spatial/face-links"}) {
    for (const Technique& technique : catalogue()) {
      if (technique.key != key) continue;
      const auto structure = technique.make(workshop, seconds);
      for (const Ray& ray : rays) {
        Probe probe(Mailbox(Mailbox::kExact, structure->size()));
        structure->trace(ray, probe);
        EXPECT_LE(probe.work.tests, structure->size());
        Probe again(Mailbox(Mailbox::kExact, structure->size()));
        structure->trace(ray, again);
        EXPECT_EQ(probe.work, again.work);
      }
    }
  }
}

/// Orders that hold ray by ray, whatever the scene.
TEST(KdTraversals, WorkStandsInOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene scene = snap_soup(bumpy_sphere(24));
  const std::vector<Ray> rays = rays_for(scene, kRays, random);
  Workshop workshop(scene);
  double seconds;
  std::map<std::string, std::unique_ptr<Structure>> walks;
  const auto tree = workshop.kd(KdRecipe::kSah, seconds);
  walks["stack"] = make_kd(tree, KdTraversal::kStack);
  walks["restart"] = make_kd(tree, KdTraversal::kRestart);
  walks["boxes"] = make_kd(tree, KdTraversal::kBacktrackBoxes);
  walks["plane"] = make_kd(tree, KdTraversal::kBacktrackPlane);
  walks["links"] = make_kd(tree, KdTraversal::kFaceLinks);
  for (int n = 1; n <= 8; ++n) walks["short" + std::to_string(n)] = make_kd(tree, KdTraversal::kShortStack, n);
  walks["short64"] = make_kd(tree, KdTraversal::kShortStack, 64);
  std::map<std::string, Work> total;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    SCOPED_TRACE("ray " + std::to_string(i));
    std::map<std::string, Work> work;
    for (const auto& [name, walk] : walks) {
      Probe probe;
      walk->trace(rays[i], probe);
      work[name] = probe.work;
      EXPECT_EQ(probe.work.leaf, work["boxes"].leaf) << name;  // the same cells in the same order
      EXPECT_EQ(probe.work.tests, work["boxes"].tests) << name;
    }
    EXPECT_EQ(work["plane"].down, work["links"].down);
    EXPECT_EQ(work["links"].down, work["stack"].down);
    EXPECT_EQ(work["links"].up, 0u);
    EXPECT_GE(work["restart"].down, work["stack"].down);
    EXPECT_GE(work["boxes"].down + work["boxes"].up, work["plane"].down + work["plane"].up);
    EXPECT_EQ(work["short64"].down, work["stack"].down);
    EXPECT_EQ(work["short64"].restarts, 0u);
    EXPECT_EQ(work["restart"].restarts + 1, work["restart"].leaf);
    EXPECT_GE(work["restart"].down, work["short1"].down);
    if (HasFailure()) return;
    for (const auto& [name, w] : work) total[name] += w;
  }
  // A single ray may gain by a shorter stack: an early restart pushes the restart node down. Many rays do not.
  for (int n = 1; n < 8; ++n)
    EXPECT_GE(total["short" + std::to_string(n)].down, total["short" + std::to_string(n + 1)].down) << n;
  EXPECT_GT(total["restart"].down, total["stack"].down);
  EXPECT_GT(total["plane"].up, 0u);
}

TEST(Bvh, WorkStandsInOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene scene = snap_soup(bumpy_sphere(24));
  const std::vector<Ray> rays = rays_for(scene, kRays, random);
  const TriangleSet set = from_grid(scene);
  std::map<int, Work> by_slabs;
  for (const int slabs : {3, 5, 7}) {
    const auto bvh = build_bvh(set, BvhBuilder::kKayKajiya, slabs);
    const auto heap = make_bvh(bvh, BvhTraversal::kHeap), stack = make_bvh(bvh, BvhTraversal::kStack);
    Probe by_heap, by_stack;
    for (const Ray& ray : rays) {
      if (ray.any) continue;
      const Work before_heap = by_heap.work, before_stack = by_stack.work;
      heap->trace(ray, by_heap);
      stack->trace(ray, by_stack);
      // The heap opens a volume only if it lies before the final hit; no order opens fewer.
      EXPECT_LE(by_heap.work.down - before_heap.down, by_stack.work.down - before_stack.down);
    }
    by_slabs[slabs] = by_heap.work;
    EXPECT_EQ(bvh->nodes().size(), 2 * set.triangles.size() - 1);
  }
  EXPECT_LT(by_slabs[7].tests, by_slabs[3].tests);  // tighter volumes: fewer triangles
  EXPECT_LE(by_slabs[5].tests, by_slabs[3].tests);
  EXPECT_LE(by_slabs[7].tests, by_slabs[5].tests);
}

/// No ray from inside a closed mesh gets out, aimed at its edges and vertices.
TEST(TriangleTest, ClosedMeshIsTight) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene scene = snap_soup(bumpy_sphere(40));
  const TriangleSet set = from_grid(scene);
  const auto structure = make_bvh(build_bvh(set, BvhBuilder::kBinnedSah), BvhTraversal::kStack);
  Probe probe;
  std::size_t escaped = 0;
  for (int k = 0; k < 10; ++k) {
    const GridPoint origin{random.integer(-1 << 21, 1 << 21), random.integer(-1 << 21, 1 << 21),
                           random.integer(-1 << 21, 1 << 21)};
    for (const GridRay& ray : make_edge_rays(scene, origin, 10000, random))
      escaped += !structure->trace(from_grid(ray), probe).hit();
  }
  EXPECT_EQ(escaped, 0u);
}

TEST(TriangleTest, KnownHits) {
  const Triangle t{{glm::dvec3{0, 0, 1}, glm::dvec3{1, 0, 1}, glm::dvec3{0, 1, 1}}, 7};
  Hit best = no_hit({});
  EXPECT_TRUE(intersect({{0.25, 0.5, 0}, {0, 0, 1}}, t, best));
  EXPECT_EQ(best, (Hit{1.0, 7, 0.25, 0.5}));
  const auto hits = [&](const Ray& ray) {
    Hit h = no_hit(ray);
    return intersect(ray, t, h);
  };
  EXPECT_TRUE(hits({{0.25, 0.5, 2}, {0, 0, -2}}));       // from behind; t in lengths of the direction
  EXPECT_TRUE(hits({{0, 0, 0}, {0, 0, 1}}));             // a vertex counts
  EXPECT_TRUE(hits({{0.5, 0.5, 0}, {0, 0, 1}}));         // an edge counts
  EXPECT_TRUE(hits({{0.25, 0.25, 0}, {0, 0, 1}, 1.0}));  // t_max counts
  EXPECT_FALSE(hits({{0.25, 0.25, 0}, {0, 0, 1}, 0.999}));
  EXPECT_FALSE(hits({{0.25, 0.25, 2}, {0, 0, 1}}));  // behind the origin
  EXPECT_FALSE(hits({{0.6, 0.6, 0}, {0, 0, 1}}));
  EXPECT_FALSE(hits({{-1, 0.25, 1}, {1, 0, 0}}));  // in the plane
  Hit tie = best;
  EXPECT_FALSE(intersect({{0.25, 0.5, 0}, {0, 0, 1}}, {t.vertices, 8}, tie));  // equal t: the lowest id stays
  EXPECT_TRUE(intersect({{0.25, 0.5, 0}, {0, 0, 1}}, {t.vertices, 6}, tie));
}

TEST(Grid, HitBeyondTheVoxelIsNotTakenEarly) {
  // A large triangle is referenced from the first voxel but hit far behind; a small one in between is nearer.
  Soup soup{{glm::dvec3{0, -4, -4}, glm::dvec3{8, -4, 12}, glm::dvec3{8, 12, -4}},
            {glm::dvec3{1, -0.1, -0.1}, glm::dvec3{1, 0.1, -0.1}, glm::dvec3{1, 0, 0.1}}};
  for (int i = 0; i < 60; ++i)
    soup.push_back({glm::dvec3{0.1 * i, 7, 7}, glm::dvec3{0.1 * i, 7.1, 7}, glm::dvec3{0.1 * i, 7, 7.1}});
  const GridScene scene = snap_soup(soup);
  const TriangleSet set = from_grid(scene);
  WorldRay world;
  world.origin = {-1, 0, 0}, world.direction = {1, 0, 0};
  const Ray ray = from_grid(quantise(world, scene.transform, scene.box, false));
  Probe probe;
  const Hit expected = make_brute_force(set)->trace(ray, probe);
  ASSERT_EQ(expected.id, 1u);
  EXPECT_EQ(make_grid(set, GridDensity::kPharr)->trace(ray, probe), expected);
}

TEST(Mailbox, RejectsOddSizes) {
  EXPECT_THROW(Mailbox(3, 10), std::invalid_argument);
  EXPECT_THROW(Mailbox(128, 10), std::invalid_argument);
  EXPECT_THROW(Mailbox(1, 10), std::invalid_argument);
}

}  // namespace
}  // namespace retrace::accel
