// The builder: every leaf references what touches its widened box (decided with exact integers) and nothing that is
// farther away than the margins explain; the image passes its own check, is the same for any number of threads, and is
// ordered as documented.
#include "golden/scene/kd_builder.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <atomic>
#include <cmath>
#include <set>

#include "grid_scenes.hpp"

namespace retrace {
namespace {

using Split = BuildOptions::Split;
constexpr Split kSplits[] = {Split::kSah, Split::kSpatialMedian, Split::kObjectMedian};

/// Do a triangle and a closed box have a common point? Separating axes (Akenine-Moeller 2001), exact: the box's axes,
/// the triangle's normal and the nine products of edges. Coordinates below 2^26, products below 2^81.
bool touches(const std::array<GridPoint, 3>& v, const std::array<std::int32_t, 6>& box) {
  using Wide = __int128;
  const auto separated_along = [&](const Wide axis[3]) {
    Wide triangle_low = 0, triangle_high = 0, box_low = 0, box_high = 0;
    for (int i = 0; i < 3; ++i) {
      const Wide at = axis[0] * v[i].x + axis[1] * v[i].y + axis[2] * v[i].z;
      triangle_low = i == 0 ? at : std::min(triangle_low, at);
      triangle_high = i == 0 ? at : std::max(triangle_high, at);
    }
    for (int k = 0; k < 3; ++k) {
      const Wide a = axis[k] * box[2 * k], b = axis[k] * box[2 * k + 1];
      box_low += std::min(a, b);
      box_high += std::max(a, b);
    }
    return triangle_high < box_low || box_high < triangle_low;
  };
  Wide edges[3][3];
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) edges[i][k] = Wide{v[(i + 1) % 3][k]} - v[i][k];
  for (int k = 0; k < 3; ++k) {
    const Wide axis[3] = {k == 0, k == 1, k == 2};
    if (separated_along(axis)) return false;
    for (const auto& e : edges) {
      Wide cross[3] = {0, 0, 0};
      cross[(k + 1) % 3] = -e[(k + 2) % 3];
      cross[(k + 2) % 3] = e[(k + 1) % 3];
      if (separated_along(cross)) return false;
    }
  }
  const auto &e = edges[0], &f = edges[1];
  const Wide normal[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
  return !separated_along(normal);
}

std::array<std::int32_t, 6> widened(const std::array<std::int32_t, 6>& box, std::int32_t by) {
  std::array<std::int32_t, 6> wide = box;
  for (int axis = 0; axis < 3; ++axis) {
    wide[2 * axis] -= by;
    wide[2 * axis + 1] += by;
  }
  return wide;
}

TEST(KdBuilder, OverlapOfTheTestItselfIsExact) {
  const std::array<std::int32_t, 6> box{-10, 10, -10, 10, -10, 10};
  EXPECT_TRUE(touches({GridPoint(10, 10, 10), GridPoint(20, 10, 10), GridPoint(10, 20, 10)}, box)) << "a common corner";
  EXPECT_FALSE(touches({GridPoint(11, 10, 10), GridPoint(20, 10, 10), GridPoint(11, 20, 10)}, box));
  EXPECT_TRUE(touches({GridPoint(30, 0, 0), GridPoint(0, 30, 0), GridPoint(0, 0, 30)}, box))
      << "the plane meets the corner";
  EXPECT_FALSE(touches({GridPoint(31, 0, 0), GridPoint(0, 31, 0), GridPoint(0, 0, 31)}, box))
      << "only the normal separates";
  EXPECT_FALSE(touches({GridPoint(21, 0, -90), GridPoint(0, 21, -90), GridPoint(21, 0, 90)}, box))
      << "only edge x z separates";
  EXPECT_TRUE(touches({GridPoint(-1000, -1000, 1), GridPoint(1000, -1000, 1), GridPoint(0, 1000, 1)}, box))
      << "cut through";
}

TEST(KdBuilder, EveryLeafReferencesWhatTouchesItsWidenedBox) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  std::size_t touching = 0, referenced = 0;
  for (const NamedGridScene& s : grid_scenes(random, 400)) {
    SCOPED_TRACE(s.name);
    // Tests made dear make small leaves.
    for (const auto& [split, test_cost] : {std::pair{Split::kSah, 0.75},
                                           {Split::kSah, 1000.0},
                                           {Split::kSpatialMedian, 0.75},
                                           {Split::kObjectMedian, 0.75}}) {
      BuildOptions options;
      options.split = split;
      options.intersection_cost = test_cost;
      const MemoryImage image = build_kd(s.scene, options);
      ASSERT_NO_THROW(image.check());
      std::set<std::uint32_t> stored;
      for (std::uint32_t i = 0; i < image.header().triangle_count; ++i) stored.insert(image.triangle(i).id);
      for (std::uint32_t i = 0; i < image.header().leaf_count; ++i) {
        const contract::LeafRecord leaf = image.leaf(i);
        std::set<std::uint32_t> ids;
        for (std::uint32_t r = 0; r < leaf.count; ++r) ids.insert(image.triangle(image.reference(leaf, r)).id);
        ASSERT_EQ(ids.size(), leaf.count) << "leaf " << i << " holds a triangle twice";
        const auto needed = widened(leaf.bound, contract::kWiden), most = widened(leaf.bound, contract::kWiden + 2);
        for (const GridTriangle& t : s.scene.triangles) {
          const bool found = ids.count(t.id) != 0;
          if (touches(t.vertices, needed)) {
            ++touching;
            ASSERT_TRUE(found) << "leaf " << i << " misses triangle " << t.id;
          }
          if (found) {
            ++referenced;
            ASSERT_TRUE(touches(t.vertices, most)) << "leaf " << i << " holds triangle " << t.id << " for no reason";
          }
        }
      }
      ASSERT_EQ(stored.size(), s.scene.triangles.size());
    }
  }
  // Clipping is tight: what is referenced beyond need is what ends within the last code or two.
  EXPECT_GT(touching, 30000u);

  EXPECT_LT(static_cast<double>(referenced), 1.02 * static_cast<double>(touching));
}

TEST(KdBuilder, ImageIsTheSameForAnyNumberOfThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const NamedGridScene& s : grid_scenes(random, 6000)) {
    SCOPED_TRACE(s.name);
    std::vector<std::uint64_t> words;
    for (const std::size_t threads : {1, 2, 7}) {
      tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      const MemoryImage image = build_kd(s.scene);
      if (threads == 1) {
        words.assign(image.words().begin(), image.words().end());
        continue;
      }
      ASSERT_TRUE(std::equal(words.begin(), words.end(), image.words().begin(), image.words().end()))
          << threads << " threads";
    }
  }
}

TEST(KdBuilder, OrderIsDepthFirst) {
  Random random(test_seed());
  for (const NamedGridScene& s : grid_scenes(random, 300)) {
    SCOPED_TRACE(s.name);
    const MemoryImage image = build_kd(s.scene);
    // Pairs: children of the left node come at once, so a depth-first walk meets 1, 2, 3, ... Leaves and triangles
    // likewise.
    std::uint32_t next_pair = 1, next_leaf = 0, next_triangle = 0;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const std::uint32_t node = stack.back();
      stack.pop_back();
      const contract::NodePairRecord pair = image.pair(node >> 1);
      const std::uint32_t axis = node & 1 ? pair.right_axis : pair.left_axis,
                          child = node & 1 ? pair.right_child : pair.left_child;
      if (axis != static_cast<std::uint32_t>(contract::kAxisLeaf)) {
        ASSERT_EQ(child, next_pair++);
        stack.push_back(2 * child + 1);
        stack.push_back(2 * child);
        continue;
      }
      ASSERT_EQ(child, next_leaf++);
      const contract::LeafRecord leaf = image.leaf(child);
      for (std::uint32_t r = 0; r < leaf.count; ++r) {
        const std::uint32_t index = image.reference(leaf, r);
        ASSERT_LE(index, next_triangle);
        next_triangle = std::max(next_triangle, index + 1);
        if (r > 0) {
          ASSERT_LT(image.triangle(image.reference(leaf, r - 1)).id, image.triangle(index).id) << "leaf " << child;
        }
      }
    }
    EXPECT_EQ(next_pair, image.header().pair_count);
    EXPECT_EQ(next_leaf, image.header().leaf_count);
    EXPECT_EQ(next_triangle, image.header().triangle_count);
  }
}

TEST(KdBuilder, FewTrianglesMakeARootThatIsALeaf) {
  for (const int count : {0, 1}) {
    std::vector<std::array<GridPoint, 3>> triangles(count,
                                                    {GridPoint(0, 0, 0), GridPoint(100, 0, 0), GridPoint(0, 100, 0)});
    BuildOptions options;
    options.max_depth = 0;
    options.intersection_cost = 1e-3;
    const MemoryImage image = build_kd(grid_scene(triangles), options);
    image.check();
    EXPECT_EQ(image.header().pair_count, 1u);
    ASSERT_EQ(image.header().leaf_count, 1u);
    const contract::LeafRecord leaf = image.leaf(0);
    EXPECT_EQ(leaf.count, static_cast<std::uint32_t>(count));
    EXPECT_EQ(leaf.parent, 0u);
    for (int face = 0; face < 6; ++face) EXPECT_EQ(leaf.link[face], 0u);
    EXPECT_EQ(image.header().max_depth, 0u);
  }
}

TEST(KdBuilder, DepthAndCostsAreObeyed) {
  Random random(test_seed());
  const GridScene scene = grid_scenes(random, 2000)[2].scene;
  for (const Split split : kSplits) {
    for (const int depth : {1, 5, 11}) {
      BuildOptions options;
      options.split = split;
      options.max_depth = depth;
      const MemoryImage image = build_kd(scene, options);
      image.check();
      EXPECT_EQ(image.header().max_depth, static_cast<std::uint32_t>(depth));
    }
  }
  BuildOptions dear;
  dear.traversal_cost = 1e9;
  EXPECT_EQ(build_kd(scene, dear).header().pair_count, 1u) << "no split pays";
  const double sah = describe(build_kd(scene)).sah_cost;
  for (const Split split : {Split::kSpatialMedian, Split::kObjectMedian}) {
    BuildOptions options;
    options.split = split;
    EXPECT_LT(sah, describe(build_kd(scene, options)).sah_cost);
  }
}

TEST(KdBuilder, WallsInSplitPlanesAreOnOneSide) {
  // A room of two halves and a wall between them: no leaf on either side but the wall's own may hold it.
  std::vector<std::array<GridPoint, 3>> triangles;
  const std::int32_t size = kGridMost;
  triangles.push_back({GridPoint(0, -size, -size), GridPoint(0, size, -size), GridPoint(0, 0, size)});
  for (const std::int32_t side : {-1, 1})
    for (std::int32_t i = 0; i < 8; ++i)
      triangles.push_back({GridPoint(side * size, i * 1000, 0), GridPoint(side * size, i * 1000 + 900, 0),
                           GridPoint(side * (size - 1000), i * 1000, 900)});
  BuildOptions options;
  options.intersection_cost = 4;
  const MemoryImage image = build_kd(grid_scene(triangles), options);
  int holding = 0;
  for (std::uint32_t i = 0; i < image.header().leaf_count; ++i) {
    const contract::LeafRecord leaf = image.leaf(i);
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      if (image.triangle(image.reference(leaf, r)).id != 0) continue;
      ++holding;
      EXPECT_LE(leaf.bound[1] - leaf.bound[0], 2 * (contract::kWiden + 1))
          << "leaf " << i << " is no slab around the wall";
    }
  }
  EXPECT_GE(holding, 1);
}

TEST(KdBuilder, ProgressRisesToOne) {
  Random random(test_seed());
  const GridScene scene = grid_scenes(random, 12000)[2].scene;
  std::atomic<int> calls{0};
  std::atomic<double> last{0.0};
  BuildOptions options;
  options.progress = [&](double fraction) {
    ++calls;
    EXPECT_GE(fraction, 0.0);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
  };
  build_kd(scene, options);
  EXPECT_GT(calls.load(), 2);
  EXPECT_EQ(last.load(), 1.0);
}

}  // namespace
}  // namespace retrace
