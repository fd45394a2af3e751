// Static SaarCOR as a cycle model: its hits do not depend on the size of a packet and are right by the classes of `retrace compare`; its clocks, where they
// can be counted by hand.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "golden/compare/compare.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/machine_memory.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/packets/packet_engine.hpp"

namespace retrace {
namespace {

std::vector<Hit> trace(PacketEngine& engine, std::span<const GridRay> rays, std::vector<RayWork>* work = nullptr) {
  std::vector<Hit> hits(rays.size());
  if (work != nullptr) work->resize(rays.size());
  engine.trace(rays, hits, work != nullptr ? std::span(*work) : std::span<RayWork>(), {});
  return hits;
}

TEST(Packets, hits_are_right_whatever_the_packet) {
  const std::uint64_t seed = test_seed();
  for (const char* name : {"box", "sphere:cells=12", "knot:along=60,around=8", "needles:count=300", "slivers:count=300",
                           "coincident:cells=6", "degenerate:count=120", "one", "none", "room:detail=0.03"}) {
    const TracedScene traced = prepare_scene(open_scene(name));
    Random random(seed);
    const std::vector<GridRay> rays = make_test_rays(traced.grid, traced.image, 2000, random);
    std::vector<Hit> golden(rays.size());
    make_golden_engine(traced.grid, traced.image)->trace(rays, golden, {}, {});
    const Comparator comparator(traced.grid);
    std::vector<Hit> first;
    for (const int size : {1, 5, 64}) {
      PacketMachine machine;
      machine.rays = size;
      const auto engine = make_packet_engine(traced.image, machine);
      const std::vector<Hit> hits = trace(*engine, rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Verdict verdict = comparator.compare(rays[i], golden[i], hits[i]);
        ASSERT_NE(verdict.agreement, Agreement::kViolation)
            << name << " packets of " << size << " ray " << i << " seed " << seed << ": " << verdict.reason;
        ASSERT_FALSE(verdict.lost) << name << " ray " << i << " seed " << seed;
        if (!first.empty() && rays[i].record.any == 0) {
          ASSERT_EQ(first[i].status, hits[i].status)
              << name << " packets of " << size << " ray " << i << " seed " << seed;
        }
      }
      if (first.empty()) first = hits;
      const PacketTotals& t = engine->totals();
      EXPECT_LE(t.ray_nodes, t.nodes * size);
      EXPECT_LE(t.tests, t.triangles * size);
      EXPECT_GE(t.clocks, std::max({t.traversal, t.list, t.intersection, t.bus}));
    }
  }
}

/// A ray through a scene of one triangle: if the root is the leaf, its three steps are one behind the other.
TEST(Packets, clocks_of_one_ray_in_one_leaf) {
  const TracedScene traced = prepare_scene(open_scene("one"));
  Random random(1);
  for (const GridRay& ray : make_test_rays(traced.grid, traced.image, 400, random)) {
    if (ray.outside) continue;
    const auto engine = make_packet_engine(traced.image);
    std::vector<RayWork> work;
    trace(*engine, std::span(&ray, 1), &work);
    if (work[0].down != 0 || work[0].leaf != 1 || work[0].tests != 1) continue;
    const double line = 64 / MachineMemory::kBytesPerClock, latency = MachineMemory::kLatency;
    // Leaf record; list entry in it; triangle record.
    EXPECT_EQ(engine->totals().clocks, (line + latency + 1 + 12) + (1 + 8) + (line + latency + 1 + 50));
    EXPECT_EQ(engine->totals().bytes, 64u + 64 + 32 + 16);
    return;
  }
  ADD_FAILURE() << "no ray walks one leaf";
}

/// Rays side by side share what they read.
TEST(Packets, coherent_rays_share_reads) {
  const TracedScene traced = prepare_scene(open_scene("knot:along=60,around=8"));
  std::vector<GridRay> rays;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      WorldRay ray;
      const auto& box = traced.grid.box;
      const auto place = [&](int axis, double part) {
        return (box[2 * axis] + part * (double(box[2 * axis + 1]) - box[2 * axis])) * 0x1p-24;
      };
      ray.origin = traced.grid.transform.to_world({place(0, 0.3 + 0.01 * x), place(1, 0.3 + 0.01 * y), 2.0});
      ray.direction = {0, 0, -1};
      rays.push_back(quantise(ray, traced.grid.transform, traced.grid.box, false));
    }
  std::array<PacketTotals, 2> totals;
  for (const int i : {0, 1}) {
    PacketMachine machine;
    machine.rays = i ? 64 : 1;
    const auto engine = make_packet_engine(traced.image, machine);
    trace(*engine, rays);
    totals[i] = engine->totals();
  }
  EXPECT_EQ(totals[0].ray_nodes, totals[0].nodes);
  EXPECT_LT(8 * totals[1].nodes, totals[0].nodes);
  EXPECT_LT(2 * totals[1].triangles, totals[0].triangles);
  EXPECT_THROW(packet_engine_kind().check("0"), UsageError);
  EXPECT_THROW(packet_engine_kind().check("64x"), UsageError);
}

}  // namespace
}  // namespace retrace
