// Flattening and snapping: ids and sources, the grid's rounding, the box, what is dropped, what stays closed.
#include "golden/scene/geometry.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <map>

#include "hls/include/contract.hpp"
#include "scenes/generators.hpp"
#include "scenes/shapes.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

constexpr std::int32_t kOne = 1 << 24;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Triangle = std::array<glm::dvec3, 3>;

WorldTriangles world_of(std::vector<Triangle> triangles) {
  WorldTriangles world;
  world.sources.resize(triangles.size());
  world.vertices = std::move(triangles);
  return world;
}

Scene scene_of(Primitive primitive) {
  Scene scene;
  scene.name = "test";
  scene.meshes.push_back({"m", {std::move(primitive)}});
  scene.nodes.emplace_back();
  scene.nodes[0].mesh = 0;
  scene.roots = {0};
  return scene;
}

void expect_sound(const GridScene& grid, const WorldTriangles& world) {
  EXPECT_EQ(grid.triangles.size() + grid.degenerate, world.vertices.size());
  std::array<std::int32_t, 6> box{};
  bool first = true;
  for (std::size_t i = 0; i < grid.triangles.size(); ++i) {
    const GridTriangle& t = grid.triangles[i];
    if (i > 0) {
      EXPECT_LT(grid.triangles[i - 1].id, t.id);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      for (int a = 0; a < 3; ++a) {
        const std::size_t lower = static_cast<std::size_t>(2 * a), upper = lower + 1;
        const std::int32_t x = t.vertices[c][a];
        box[lower] = first ? x : std::min(box[lower], x);
        box[upper] = first ? x : std::max(box[upper], x);
      }
      first = false;
      const glm::dvec3 exact = grid.transform.to_grid(world.vertices[t.id][c]) * double(kOne);
      for (int a = 0; a < 3; ++a) EXPECT_EQ(static_cast<double>(t.vertices[c][a]), std::floor(exact[a] + 0.5));
    }
  }
  for (std::size_t f = 0; f < 6; ++f) {
    EXPECT_EQ(grid.box[f], box[f] + (f % 2 ? contract::kBoxPad : -contract::kBoxPad));
    EXPECT_GE(grid.box[f], -kOne);
    EXPECT_LE(grid.box[f], kOne);
  }
}

TEST(Flatten, IdsFollowNodesPrimitivesTriangles) {
  Primitive one, two;
  one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  two.positions = one.positions;
  two.triangles = {{2, 1, 0}, {1, 0, 2}};
  Scene scene;
  scene.meshes = {{"a", {one, Primitive{}, two}}, {"b", {two}}};
  scene.nodes.resize(4);
  scene.nodes[0].mesh = 1;
  scene.nodes[0].children = {3};
  scene.nodes[2].mesh = 0;
  scene.nodes[2].translation = {10, 0, 0};
  scene.nodes[3].mesh = 0;
  scene.nodes[3].parent = 0;
  scene.nodes[1].mesh = 0;  // not in the scene
  scene.roots = {2, 0};
  const WorldTriangles world = flatten(scene);
  const std::uint32_t expected[][4] = {{2, 0, 0, 0}, {2, 0, 2, 0}, {2, 0, 2, 1}, {0, 1, 0, 0},
                                       {0, 1, 0, 1}, {3, 0, 0, 0}, {3, 0, 2, 0}, {3, 0, 2, 1}};
  ASSERT_EQ(world.sources.size(), std::size(expected));
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    EXPECT_EQ(world.sources[i].node, expected[i][0]) << i;
    EXPECT_EQ(world.sources[i].mesh, expected[i][1]) << i;
    EXPECT_EQ(world.sources[i].primitive, expected[i][2]) << i;
    EXPECT_EQ(world.sources[i].triangle, expected[i][3]) << i;
  }
  EXPECT_EQ(world.vertices[0][1], glm::dvec3(11, 0, 0));
  EXPECT_EQ(world.vertices[1][0], glm::dvec3(10, 1, 0));
}

TEST(Flatten, NamesTheFirstBadVertex) {
  Primitive p;
  p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}};
  for (int i = 0; i < 100000; ++i) p.triangles.push_back({0, 1, i == 50000 || i == 70000 ? 3u : 2u});
  const auto message = [](const Scene& scene) -> std::string {
    try {
      flatten(scene);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  Scene scene = scene_of(p);
  scene.nodes[0].name = "bad";
  EXPECT_EQ(message(scene), "test: node 0 'bad', mesh 0 'm', primitive 0, vertex 3: the world position is not finite");
  scene.meshes[0].primitives[0].triangles[17] = {0, 9, 1};
  EXPECT_EQ(message(scene), "test: node 0 'bad', mesh 0 'm', primitive 0, vertex 9: there is no such vertex");
  p.positions[3] = {3e38f, 0, 0};
  scene = scene_of(p);
  scene.nodes[0].scale = glm::dvec3(1e280, 1, 1);
  EXPECT_NE(message(scene).find("vertex 3: the world position is not finite"), std::string::npos) << message(scene);
}

TEST(Flatten, InstancesAreBounded) {
  Primitive p;
  p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  p.triangles.resize(1 << 16, {0, 1, 2});
  Scene scene = scene_of(p);
  scene.nodes.resize(1000, scene.nodes[0]);
  for (std::uint32_t i = 1; i < scene.nodes.size(); ++i) scene.roots.push_back(i);
  EXPECT_THROW(flatten(scene), Error);
}

TEST(Snap, TiesGoUp) {
  // The scale is a power of two only by chance, so ties are looked for: codes of a scene whose extent makes the scale
  // known.
  const double half = static_cast<double>(kOne - contract::kBoxPad - 1);  // world units are codes
  std::vector<Triangle> triangles = {{{{-half, -half, -half}, {half, -half, 0}, {0, half, half}}}};
  const double offsets[] = {0.5, -0.5, 0.25, -0.25, 1.5, -1.5, 0.4999999, -0.4999999, 0.5000001, -0.5000001};
  for (const double x : offsets) triangles.push_back({{{x, 0, 0}, {100 + x, 0, 0}, {0, 100 + x, 0}}});
  const WorldTriangles world = world_of(triangles);
  const GridScene grid = snap(world);
  ASSERT_EQ(grid.transform.center, glm::dvec3(0.0));
  ASSERT_EQ(grid.transform.scale * kOne, 1.0);
  const std::int32_t expected[] = {1, 0, 0, 0, 2, -1, 0, 0, 1, -1};
  for (std::size_t i = 0; i < std::size(offsets); ++i) {
    EXPECT_EQ(grid.triangles[i + 1].vertices[0].x, expected[i]) << offsets[i];
    EXPECT_EQ(grid.triangles[i + 1].vertices[1].x, 100 + expected[i]) << offsets[i];
  }
  expect_sound(grid, world);
  EXPECT_EQ(grid.box[0], -kOne + 1);
  EXPECT_EQ(grid.box[5], kOne - 1);
}

TEST(Snap, BoxStaysInRangeForAnyScene) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed);
  Random random(seed);
  for (int round = 0; round < 300; ++round) {
    const double size = std::exp2(random.real(-1000, 1000));
    const double distance = random.chance(3) ? 0 : size * std::exp2(random.real(-10, 60));
    const glm::dvec3 at = distance * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    std::vector<Triangle> triangles(1 + random.below(30));
    for (Triangle& t : triangles)
      for (glm::dvec3& p : t)
        p = at +
            size * glm::dvec3(random.real(-1, 1), random.chance(8) ? 0.0 : random.real(-1, 1), random.real(-0.01, 1));
    const WorldTriangles world = world_of(triangles);
    expect_sound(snap(world), world);
    if (testing::Test::HasFailure()) FAIL() << "round " << round;
  }
}

TEST(Snap, ExtremeScenes) {
  const double big = std::numeric_limits<double>::max(), tiny = std::numeric_limits<double>::denorm_min();
  const std::vector<std::vector<Triangle>> scenes = {
      {},
      {{{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}},
      {{{{5, 5, 5}, {5, 5, 5}, {6, 6, 6}}}},
      {{{{-big, -big, -big}, {big, big, big}, {big, -big, 0}}}},
      {{{{tiny, 0, 0}, {0, tiny, 0}, {0, 0, tiny}}}},
      {{{{1e300, 1e300, 1e300}, {1e300, 1e300, 1.0000001e300}, {1e300, 1.0000001e300, 1e300}}}},
      {{{{1, 1, 1}, {1, 1, std::nextafter(1.0, 2.0)}, {1, std::nextafter(1.0, 2.0), 1}}}},
  };
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    SCOPED_TRACE(i);
    const WorldTriangles world = world_of(scenes[i]);
    const GridScene grid = snap(world);
    expect_sound(grid, world);
    EXPECT_TRUE(std::isfinite(grid.transform.scale) && grid.transform.scale > 0);
    if (grid.triangles.empty()) {
      EXPECT_EQ(grid.box, (std::array<std::int32_t, 6>{-1024, 1024, -1024, 1024, -1024, 1024}));
    }
  }
  EXPECT_EQ(snap(world_of(scenes[3])).triangles.size(), 1u);
  EXPECT_EQ(snap(world_of(scenes[6])).triangles.size(), 1u);
}

TEST(Snap, DropsExactlyWhatHasNoAreaOnTheGrid) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed);
  Random random(seed);
  // Small integers as world coordinates with a scale of a power of two: the grid is exact, so area can be told in the
  // world.
  const double half = static_cast<double>(kOne - contract::kBoxPad - 1);
  std::vector<Triangle> triangles = {{{{-half, -half, -half}, {half, half, half}, {half, -half, 0}}}};
  std::vector<bool> sound = {true};
  for (int i = 0; i < 20000; ++i) {
    Triangle t;
    for (glm::dvec3& p : t)
      for (int a = 0; a < 3; ++a) p[a] = static_cast<double>(random.integer(-2, 2));
    if (random.chance(4)) t[2] = t[0] + (t[1] - t[0]) * static_cast<double>(random.integer(-1000, 1000));
    triangles.push_back(t);
    sound.push_back(glm::cross(t[1] - t[0], t[2] - t[0]) != glm::dvec3(0.0));
  }
  const WorldTriangles world = world_of(triangles);
  const GridScene grid = snap(world);
  std::vector<bool> kept(world.vertices.size(), false);
  for (const GridTriangle& t : grid.triangles) kept[t.id] = true;
  EXPECT_EQ(kept, sound);
  EXPECT_GT(grid.degenerate, 1000u);
  expect_sound(grid, world);
}

TEST(Snap, CollapsedTrianglesHaveNoSayInTheScale) {
  const std::vector<Triangle> sound = {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}};
  std::vector<Triangle> with = sound;
  with.push_back({{{1e30, 0, 0}, {1e30, 0, 0}, {0, 1e30, 0}}});
  const GridScene a = snap(world_of(sound)), b = snap(world_of(with));
  EXPECT_EQ(a.transform.scale, b.transform.scale);
  EXPECT_EQ(a.box, b.box);
  EXPECT_EQ(b.degenerate, 1u);
}

/// On the grid, every edge of a closed mesh runs once in each direction; dropped triangles included, since their
/// neighbours then share what is left of their edges.
TEST(Snap, ClosedMeshesStayClosed) {
  for (const auto& [name, parameters] : std::vector<std::pair<std::string, SceneParameters>>{
           {"sphere", {{"cells", 40}}}, {"knot", {{"along", 300}, {"around", 24}}}, {"slivers", {{"count", 5000}}}}) {
    SCOPED_TRACE(name);
    Scene scene = make_scene(name, parameters);
    scene.nodes[0].rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3)));
    scene.nodes[0].translation = {1000, -2000, 300};
    const GridScene grid = snap(flatten(scene));
    using Key = std::array<std::int32_t, 6>;
    std::map<Key, int> balance;
    for (const GridTriangle& t : grid.triangles)
      for (std::size_t c = 0; c < 3; ++c) {
        const GridPoint &p = t.vertices[c], &q = t.vertices[(c + 1) % 3];
        const bool forward = std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
        const GridPoint &a = forward ? p : q, &b = forward ? q : p;
        balance[{a.x, a.y, a.z, b.x, b.y, b.z}] += forward ? 1 : -1;
      }
    int open = 0;
    for (const auto& [edge, count] : balance) open += count != 0;
    // A dropped sliver whose corners are on a line but apart leaves three edges that balance among its neighbours only
    // together.
    if (grid.degenerate == 0) {
      EXPECT_EQ(open, 0);
    } else {
      EXPECT_LE(open, 3 * static_cast<int>(grid.degenerate));
    }
    if (name != "slivers") {
      EXPECT_EQ(grid.degenerate, 0u);
    }
  }
}

TEST(Snap, SameForAnyNumberOfThreads) {
  const Scene scene = make_scene("field", {{"count", 500}});
  std::vector<GridScene> grids;
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    grids.push_back(snap(flatten(scene)));
  }
  for (const GridScene& grid : grids) {
    EXPECT_EQ(grid.box, grids[0].box);
    EXPECT_EQ(grid.transform.scale, grids[0].transform.scale);
    EXPECT_EQ(grid.transform.center, grids[0].transform.center);
    ASSERT_EQ(grid.triangles.size(), grids[0].triangles.size());
    for (std::size_t i = 0; i < grid.triangles.size(); ++i) {
      ASSERT_EQ(grid.triangles[i].id, grids[0].triangles[i].id);
      ASSERT_EQ(grid.triangles[i].vertices, grids[0].triangles[i].vertices);
    }
  }
}

TEST(Snap, NonFiniteWorldDoesNotReachTheGrid) {
  // flatten() is the gate; this is what it guards against.
  Primitive p;
  p.positions = {{0, 0, 0}, {static_cast<float>(kInfinity), 0, 0}, {0, 1, 0}};
  p.triangles = {{0, 1, 2}};
  EXPECT_THROW(flatten(scene_of(p)), Error);
}

}  // namespace
}  // namespace retrace
