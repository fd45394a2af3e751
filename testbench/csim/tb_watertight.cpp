// C-simulation testbench: no ray from inside a closed mesh gets out. Rays are aimed at edges and vertices, where a test
// that loses a bit too many would let them through.
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <string>

#include "csim_engine.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/closed_meshes.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/test_rays.hpp"

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

/// A closed mesh and points inside it.
class Subject {
 public:
  Subject(const std::string& name, Random& random) {
    constexpr const char* kClosed = "closed:";
    if (name.starts_with(kClosed)) {
      constexpr int kCells = 24;
      grid = make_closed_mesh(name.substr(std::strlen(kClosed)), kCells, random);
      origin_ = inside_closed_mesh;
      return;
    }
    TracedScene traced = snap_scene(open_scene(name));
    grid = std::move(traced.grid);
    if (grid.triangles.empty()) throw Error(name + ": no triangles");
    if (name.starts_with("room")) {
      const glm::dvec3 eye =
          grid.transform.to_grid(default_view(traced.scene, traced.world).ray(0.5, 0.5, 1, 1).origin);
      origin_ = [eye](const GridScene&, Random&) {
        return GridPoint(eye * static_cast<double>(1 << contract::kPositionFrac));
      };
    } else {
      origin_ = behind_triangle;
    }
  }
  GridPoint origin(Random& random) const { return origin_(grid, random); }
  GridScene grid;

 private:
  std::function<GridPoint(const GridScene&, Random&)> origin_;
};

int run(const std::string& name, std::uint64_t seed, std::size_t count, const std::string& engine_name) {
  const bool golden = engine_name == "golden";
  Random random(seed);
  const Subject subject(name, random);
  const GridScene& grid = subject.grid;
  const MemoryImage image = build_kd(grid);
  const std::unique_ptr<Engine> engine = golden ? make_golden_engine(grid, image) : make_csim_engine(image);
  std::uint64_t escaped = 0, traced = 0;
  constexpr std::size_t kPerOrigin = 4096;
  while (traced < count) {
    const GridPoint origin = subject.origin(random);
    const std::size_t part = std::min<std::size_t>(kPerOrigin * 16, count - traced);
    const std::size_t exact = golden ? part / 2 : 0;
    auto rays = make_edge_rays(grid, origin, part - exact, random);
    const auto more = make_exact_edge_rays(grid, origin, exact, random);
    rays.insert(rays.end(), more.begin(), more.end());
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
              " escaped %s\n",
              name.c_str(), grid.triangles.size(), traced, seed, escaped, engine_name.c_str());
  return escaped == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string scene = "sphere", engine = "csim";
  std::uint64_t seed = test_seed();
  std::size_t rays = 100000;
  CLI::App app("No ray from inside a closed mesh gets out.", "tb_watertight");
  app.add_option("scene", scene,
                 "A closed mesh (sphere, knot), a closed room with its camera inside, or closed:box, closed:sphere, "
                 "closed:random, closed:sliver")
      ->capture_default_str();
  app.add_option("seed", seed, "Default: RETRACE_SEED")->capture_default_str();
  app.add_option("rays", rays)->capture_default_str();
  app.add_option("engine", engine, "golden also gets rays exactly through edges and vertices")
      ->check(CLI::IsMember({"csim", "golden"}))
      ->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(scene, seed, rays, engine); });
}
