// rtl_bench: primary rays of a scene through the RTL core, in image order; prints where the clocks go and compares every hit with csim.
// usage: rtl_bench SCENE CONFIGURATION WIDTHxHEIGHT [key=value...]
//   latency=40 or latency=1-200, bytes=8 (a clock, 0: the bus), reorder=1, stall=20 (percent), up=parent|face, mailbox=0 (default 1), seed=1,
//   limit=100000 (clocks a ray before it gives up), waves=FILE.fst, shadow=1 (any-hit rays from the primary hits to a lamp beside the camera), rows=200-216 (only these rows of the image),
//   walk=tiles|rows (how the core visits the image; default tiles), tile=8 (the list itself in tiles; 1, the default, is image order)
// Returns 0 if all hits are identical.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/sim/core/rtl_engine.hpp"

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

int run(int argc, char** argv) {
  const std::string scene_name = argv[1], configuration = argv[2];
  int width = 0, height = 0;
  if (std::sscanf(argv[3], "%dx%d", &width, &height) != 2 || width < 1 || height < 1 || width > 4096 || height > 4096)
    throw Error("size must be WIDTHxHEIGHT");
  RtlOptions options;
  options.configuration = configuration;
  options.ray_row = static_cast<std::uint32_t>(width);
  TraceOptions trace;
  trace.mailbox = kCsimMailbox;
  bool shadow = false;
  int first_row = 0, last_row = height, tile = 1;
  for (int i = 4; i < argc; ++i) {
    const std::string text = argv[i];
    const auto equals = text.find('=');
    const std::string key = text.substr(0, equals), value = equals == std::string::npos ? "" : text.substr(equals + 1);
    if (key == "latency") {
      const auto dash = value.find('-');
      options.memory.latency_min = std::atoi(value.c_str());
      options.memory.latency_max =
          dash == std::string::npos ? options.memory.latency_min : std::atoi(value.c_str() + dash + 1);
    } else if (key == "bytes")
      options.memory.bytes_per_clock = std::atof(value.c_str());
    else if (key == "reorder")
      options.memory.reorder = value != "0";
    else if (key == "stall")
      options.memory.stall_percent = std::atoi(value.c_str());
    else if (key == "up")
      trace.way_up = value == "parent" ? WayUp::kParentLinks : WayUp::kFaceLinks;
    else if (key == "mailbox")
      trace.mailbox = value != "0" ? kCsimMailbox : 0;
    else if (key == "seed")
      options.seed = options.memory.seed = std::strtoull(value.c_str(), nullptr, 0);
    else if (key == "waves")
      options.waves = value;
    else if (key == "limit")
      options.clocks_per_ray = std::strtoull(value.c_str(), nullptr, 0);
    else if (key == "shadow")
      shadow = value != "0";
    else if (key == "walk")
      options.ray_row = value == "rows" ? 0 : static_cast<std::uint32_t>(width);
    else if (key == "tile")
      tile = std::max(1, std::atoi(value.c_str()));
    else if (key == "rows") {
      if (std::sscanf(value.c_str(), "%d-%d", &first_row, &last_row) != 2 || first_row < 0 || last_row > height ||
          first_row >= last_row)
        throw Error("rows must be FIRST-END within the image");
    } else
      throw Error("unknown option '" + text + "'");
  }

  const Scene scene = open_scene(scene_name);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world);
  const MemoryImage image = build_kd(grid);
  const ViewCamera view = default_view(scene, world);
  std::vector<GridRay> rays;
  // tile = 1 is image order.
  for (int tile_y = first_row; tile_y < last_row; tile_y += tile)
    for (int tile_x = 0; tile_x < width; tile_x += tile)
      for (int y = tile_y; y < std::min(tile_y + tile, last_row); ++y)
        for (int x = tile_x; x < std::min(tile_x + tile, width); ++x)
          rays.push_back(quantise(view.ray(x + 0.5, y + 0.5, width, height), grid.transform, grid.box, false));

  auto csim = make_csim_engine(image);
  if (shadow) rays = shadow_rays(rays, *csim, grid, view);
  const CsimTotals before = csim->totals();

  std::vector<Hit> hits(rays.size());
  auto rtl = make_rtl_engine(image, options);
  rtl->trace(rays, hits, {}, trace);
  csim->trace(rays, hits, {}, trace);
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
  std::printf("%s %s %dx%d: %" PRIu64 " rays, %" PRIu64 " differ from csim\n", scene_name.c_str(),
              configuration.c_str(), width, height, c.rays, differ);
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
  std::printf("  bytes/ray by source:");
  const auto sources = rtl->read_bytes_by_source();
  for (std::size_t i = 0; i < sources.size(); ++i) std::printf(" %s %.1f", cosim::kReadSources[i], per_ray(sources[i]));
  std::printf("\n");
  print_unit("lanes", c.lanes);
  print_unit("leaf unit", c.leaf_unit);
  print_unit("references", c.references);
  print_unit("tri_test", c.tri_test);
  print_unit("bus", c.bus);
  return differ == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: rtl_bench SCENE CONFIGURATION WIDTHxHEIGHT [key=value...]\n");
    return 2;
  }
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rtl_bench: %s\n", error.what());
    return 2;
  }
}
