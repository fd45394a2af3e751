// C-simulation testbench: no ray from inside a closed mesh gets out. Rays are aimed at edges and vertices, where a test
// that loses a bit too many would let them through. usage: tb_watertight [SCENE [SEED [RAYS]]]; SCENE is a closed mesh
// (sphere, knot) or a closed room with its camera inside.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "csim_engine.hpp"
#include "golden/scene/kd_builder.hpp"
#include "golden/scene/view.hpp"
#include "scenes/open_scene.hpp"
#include "test_rays.hpp"

namespace {

using namespace retrace;

/// A point just behind a triangle of a closed mesh whose normals point outwards.
GridPoint behind_triangle(const GridScene& grid, Random& random) {
  constexpr double kDepth = 1 << (contract::kPositionFrac - 12);
  while (true) {
    const GridTriangle& t = grid.triangles[random.below(grid.triangles.size())];
    const glm::dvec3 a(t.vertices[0]), b(t.vertices[1]), c(t.vertices[2]);
    const glm::dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
    const glm::dvec3 p = (a + b + c) / 3.0 - normal * kDepth;
    const GridPoint code(p);
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis)
      inside = inside && code[axis] > grid.box[2 * axis] && code[axis] < grid.box[2 * axis + 1];
    if (inside) return code;
  }
}

int run(const char* name, std::uint64_t seed, std::size_t count) {
  const Scene scene = open_scene(name);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world);
  if (grid.triangles.empty()) throw Error(std::string(name) + ": no triangles");
  const MemoryImage image = build_kd(grid);
  auto engine = make_csim_engine(image);
  const bool room = std::strncmp(name, "room", 4) == 0;
  const glm::dvec3 eye = grid.transform.to_grid(default_view(scene, world).ray(0.5, 0.5, 1, 1).origin);
  Random random(seed);
  std::uint64_t escaped = 0, traced = 0;
  constexpr std::size_t kPerOrigin = 4096;
  while (traced < count) {
    const GridPoint origin =
        room ? GridPoint(eye * static_cast<double>(1 << contract::kPositionFrac)) : behind_triangle(grid, random);
    const auto rays = make_edge_rays(grid, origin, std::min<std::size_t>(kPerOrigin * 16, count - traced), random);
    std::vector<Hit> hits(rays.size());
    TraceOptions options;
    options.way_up = traced / rays.size() % 2 == 0 ? WayUp::kFaceLinks : WayUp::kParentLinks;
    engine->trace(rays, hits, {}, options);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].hit()) continue;
      const auto& r = rays[i].record;
      if (++escaped < 10)
        std::printf("  escaped: seed %" PRIu64 " origin %d %d %d direction %d %d %d status %u\n", seed, r.origin[0],
                    r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2], hits[i].status);
    }
    traced += rays.size();
  }
  std::printf("%-16s %8zu triangles %9" PRIu64 " rays from inside at edges and vertices, seed %" PRIu64 ": %" PRIu64
              " escaped\n",
              name, grid.triangles.size(), traced, seed, escaped);
  return escaped == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const char* name = argc > 1 ? argv[1] : "sphere";
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 0) : test_seed();
  const std::size_t count = argc > 3 ? std::strtoull(argv[3], nullptr, 0) : 100000;
  try {
    return run(name, seed, count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tb_watertight: %s\n", error.what());
    return 1;
  }
}
