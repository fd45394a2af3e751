// rtl_bench: primary rays of a scene through the RTL core, in image order; prints where the clocks go and compares every hit with csim.
// Returns 0 if all hits are identical, 1 if not, 2 if it cannot run.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/sim/core/rtl_engine.hpp"
#include "testbench/sim/dram/dram_model.hpp"

namespace {

using namespace retrace;

void print_unit(const char* name, const cosim::UnitClocks& unit) {
  const double all = static_cast<double>(unit.busy + unit.starved + unit.blocked);
  std::printf("  %-12s busy %5.1f %%  starved %5.1f %%  blocked %5.1f %%\n", name, 100 * unit.busy / all,
              100 * unit.starved / all, 100 * unit.blocked / all);
}

/// Whoever misses looks up again and hits, so every access is a hit in the end; a miss is a line that had to be fetched.
double rate(std::uint64_t hits, std::uint64_t misses) { return hits == 0 ? 1.0 : 1.0 - double(misses) / double(hits); }

/// From where primary rays hit to a lamp above and beside the camera; the pixels without a hit have no ray, so the image keeps its rows.
std::vector<GridRay> shadow_rays(std::span<const GridRay> primary, CsimEngine& csim, const GridScene& grid,
                                 const ViewCamera& view) {
  std::vector<Hit> hits(primary.size());
  csim.trace(primary, hits, {}, {});
  glm::dvec3 low(grid.box[0], grid.box[2], grid.box[4]), high(grid.box[1], grid.box[3], grid.box[5]);
  const double size = glm::length(high - low) * 0x1p-24 / grid.transform.scale;
  const glm::dvec3 lamp = view.eye() + 0.1 * size * (glm::dvec3(view.world[1]) - glm::dvec3(view.world[0]));
  constexpr double kClearance = 1e-4;
  std::vector<GridRay> rays(primary.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const contract::RayRecord& r = primary[i].record;
    rays[i].outside = true;
    if (!hits[i].hit()) continue;
    glm::dvec3 point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = r.origin[axis] * 0x1p-24 + hits[i].t * r.direction[axis] * 0x1p-26;
    WorldRay ray;
    ray.origin = grid.transform.to_world(point);
    ray.direction = lamp - ray.origin;
    ray.t_min = kClearance;
    ray.t_max = 1;
    rays[i] = quantise(ray, grid.transform, grid.box, true);
  }
  return rays;
}

struct Arguments {
  std::string scene;
  ImageSize size;
  RtlOptions rtl;
  TraceOptions trace;
  bool shadow = false, tiles = true, two_level = false;
  std::pair<int, int> rows;
  int tile = 1;
  BuildOptions build;
};

int run(Arguments& arguments) {
  const auto [width, height] = arguments.size;
  const auto [first_row, last_row] = arguments.rows;
  const int tile = arguments.tile;
  if (last_row > height) throw Error("--rows must be FIRST-END within the image");
  RtlOptions& options = arguments.rtl;
  options.ray_row = arguments.tiles ? static_cast<std::uint32_t>(width) : 0;

  const auto [scene, world, grid, image] = prepare_scene(open_scene(arguments.scene), arguments.build,
                                                         arguments.two_level ? TwoLevels::kOn : TwoLevels::kOff);
  const ViewCamera view = default_view(scene, world);
  std::vector<GridRay> rays;
  // tile = 1 is image order.
  for (int tile_y = first_row; tile_y < last_row; tile_y += tile)
    for (int tile_x = 0; tile_x < width; tile_x += tile)
      for (int y = tile_y; y < std::min(tile_y + tile, last_row); ++y)
        for (int x = tile_x; x < std::min(tile_x + tile, width); ++x)
          rays.push_back(quantise(view.ray(x + 0.5, y + 0.5, width, height), grid.transform, grid.box, false));

  auto csim = make_csim_engine(image);
  if (arguments.shadow) rays = shadow_rays(rays, *csim, grid, view);
  const CsimTotals before = csim->totals();

  std::vector<Hit> hits(rays.size());
  auto rtl = make_rtl_engine(image, options);
  rtl->trace(rays, hits, {}, arguments.trace);
  csim->trace(rays, hits, {}, arguments.trace);
  std::uint64_t differ = 0;
  const auto a = rtl->raw_hits(), b = csim->raw_hits();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (a[2 * i] == b[2 * i] && a[2 * i + 1] == b[2 * i + 1]) continue;
    if (++differ < 5)
      std::printf("ray %zu: rtl %016" PRIx64 "%016" PRIx64 " csim %016" PRIx64 "%016" PRIx64 "\n", i, a[2 * i + 1],
                  a[2 * i], b[2 * i + 1], b[2 * i]);
  }
  const auto& c = rtl->counters();
  const auto per_ray = [&](std::uint64_t n) { return double(n) / double(std::max<std::uint64_t>(c.rays, 1)); };
  const int bytes = rtl->identity().data_bytes;
  std::printf("%s %s %dx%d: %" PRIu64 " rays, %" PRIu64 " differ from csim\n", arguments.scene.c_str(),
              options.configuration.c_str(), width, height, c.rays, differ);
  std::printf("  %.2f clocks/ray, %.3f node steps/clock, %.0f simulated clocks/s\n", per_ray(c.clocks),
              double(c.node_steps()) / c.clocks, rtl->simulated_clocks() / rtl->simulation_seconds());
  std::printf(
      "  a ray: down %.2f up %.2f leaf %.2f tests %.2f skipped %.2f; csim down %.2f up %.2f leaf %.2f tests %.2f\n",
      per_ray(c.down), per_ray(c.up), per_ray(c.leaf), per_ray(c.tests), per_ray(c.skipped),
      per_ray(csim->totals().down - before.down), per_ray(csim->totals().up - before.up),
      per_ray(csim->totals().leaf - before.leaf), per_ray(csim->totals().tests - before.tests));
  std::printf(
      "  bytes/ray read %.1f written %.1f; hit rate node %.4f leaf %.4f list %.4f triangle %.4f; contexts in use "
      "%.1f\n",
      per_ray(c.read_beats * bytes), per_ray(c.write_beats * bytes), rate(c.node_hits, c.node_misses),
      rate(c.leaf_hits, c.leaf_misses), rate(c.list_hits, c.list_misses), rate(c.triangle_hits, c.triangle_misses),
      double(c.context_clocks) / c.clocks);
  if (arguments.two_level)
    std::printf(
        "  a ray: %.2f entries, %.2f of them passed by; clocks that entries found the stage full %.2f, stood at its "
        "end %.2f\n",
        per_ray(c.entries), per_ray(c.entry_passed), per_ray(c.entry_refused), per_ray(c.entry_blocked));
  std::printf("  bytes/ray by source:");
  const auto sources = rtl->read_bytes_by_source();
  for (std::size_t i = 0; i < sources.size(); ++i) std::printf(" %s %.1f", cosim::kReadSources[i], per_ray(sources[i]));
  std::printf("\n");
  print_unit("lanes", c.lanes);
  print_unit("leaf unit", c.leaf_unit);
  print_unit("references", c.references);
  print_unit("tri_test", c.tri_test);
  print_unit("results", c.results);
  print_unit("bus", c.bus);
  return differ == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  std::pair<int, int> rows{0, -1};
  bool mailbox = true;
  CLI::App app("Primary rays of a scene through the RTL core: where the clocks go; every hit is compared with csim's.",
               "rtl_bench");
  app.add_option("scene", a.scene, "A glTF file or a generated scene")->required();
  app.add_option("configuration", a.rtl.configuration, "Configuration of the core")
      ->check(CLI::IsMember(cosim::core_configurations()))
      ->required();
  add_size(app, "size", a.size, 4096, "Rays")->required();
  cosim::MemoryOptions& memory = a.rtl.memory;
  memory.latency_min = memory.latency_max = 40;
  app.add_option_function<std::string>(
         "--latency",
         [&memory](const std::string& text) {
           char end = 0;
           if (std::sscanf(text.c_str(), "%d-%d%c", &memory.latency_min, &memory.latency_max, &end) == 2) {
             if (memory.latency_min >= 0 && memory.latency_min < memory.latency_max) return;
           } else if (std::sscanf(text.c_str(), "%d%c", &memory.latency_min, &end) == 1 && memory.latency_min >= 1) {
             memory.latency_max = memory.latency_min;
             return;
           }
           throw CLI::ValidationError("--latency", "takes N or FROM-TO");
         },
         "Of the memory, in clocks: N, or FROM-TO, drawn for each burst")
      ->default_str("40");
  app.add_option("--dram", memory.dram, "A board's DRAM behind its controller instead")
      ->check(CLI::IsMember(cosim::dram_names()));
  app.add_option("--bytes", a.rtl.memory.bytes_per_clock, "Bytes a clock; 0: the bus");
  app.add_option("--reorder", a.rtl.memory.reorder, "Answers are mixed");
  app.add_option("--stall", a.rtl.memory.stall_percent, "Percent of the clocks")->check(CLI::Range(0, 100));
  app.add_option("--up", a.trace.way_up)
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, WayUp>{{"parent", WayUp::kParentLinks}, {"face", WayUp::kFaceLinks}}));
  app.add_option("--mailbox", mailbox)->capture_default_str();
  app.add_option_function<std::uint64_t>("--seed", [&](std::uint64_t n) { a.rtl.seed = a.rtl.memory.seed = n; });
  app.add_option("--waves", a.rtl.waves, "FST of the run");
  app.add_option("--limit", a.rtl.clocks_per_ray, "Clocks a ray before it gives up");
  app.add_flag("--two-level", a.two_level, "Instances stay instances");
  app.add_option("--shadow", a.shadow, "Any-hit rays from the primary hits to a lamp beside the camera");
  add_pair(app, "--rows", rows, '-', "Only these rows of the image");
  app.add_option("--walk", a.tiles, "How the core visits the image: tiles, rows")
      ->transform(CLI::CheckedTransformer(std::map<std::string, bool>{{"tiles", true}, {"rows", false}}));
  app.add_option("--tile", a.tile, "The list itself in tiles of so many pixels; 1: image order")
      ->check(CLI::Range(1, 4096));
  app.add_option("--intersection-cost", a.build.intersection_cost, "Of the builder, against the cost of a step")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  return run_program(
      app, argc, argv,
      [&] {
        a.trace.mailbox = mailbox ? kKernelMailbox : 0;
        a.rows = rows.second < 0 ? std::pair{0, a.size.height} : rows;
        if (a.rows.first >= a.rows.second) throw Error("--rows takes FIRST-END");
        return run(a);
      },
      2);
}
