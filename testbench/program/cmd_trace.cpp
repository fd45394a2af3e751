// retrace trace: any rays from a NumPy file, hits to a NumPy file.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <memory>

#include "golden/base/output_file.hpp"
#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "golden/render/surface.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/npy.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

struct TraceArguments {
  std::string scene, input, output, engine = "golden", way_up = "face", stats;
  bool any = false;
  TraceOptions trace;
};

void run_trace(const TraceArguments& a, const Common& common) {
  TraceOptions options = a.trace;
  options.way_up = parse_way_up(a.way_up);
  options.threads = common.threads;
  check_options(a.engine, options);
  if (common.two_levels == TwoLevels::kOn) check_instances(a.engine);
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  files.reads(a.input);
  OutputFile& output = files.add(a.output);
  OutputFile* const stats_file = a.stats.empty() ? nullptr : &files.add(a.stats);
  const std::vector<NpyRay> rows = read_rays(a.input);

  const LoadedScene loaded = load_scene(a.scene, common, false);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  const std::unique_ptr<Engine> engine = make_engine(a.engine, loaded.grid, loaded.image);
  std::vector<NpyHit> results(rows.size());
  std::vector<GridRay> rays;
  std::vector<Hit> hits;
  std::vector<RayWork> work;
  WorkTotals totals;
  double seconds = 0;
  std::size_t found = 0;
  Progress progress("trace " + loaded.name + " (" + engine->name() + ")", common.quiet);
  constexpr std::size_t kWave = std::size_t{1} << 17;
  for (std::size_t begin = 0; begin < rows.size(); begin += kWave) {
    const std::size_t n = std::min(kWave, rows.size() - begin);
    rays.resize(n);
    hits.assign(n, Hit{});
    if (engine->counts_work()) work.assign(n, RayWork{});
    for (std::size_t i = 0; i < n; ++i) {
      const NpyRay& row = rows[begin + i];
      WorldRay ray;
      ray.origin = {row[0], row[1], row[2]};
      ray.t_min = row[3];
      ray.direction = {row[4], row[5], row[6]};
      ray.t_max = row[7];
      try {
        rays[i] = quantise(ray, loaded.grid.transform, loaded.grid.box, a.any);
      } catch (const Error& error) {
        throw Error(a.input + ": ray " + std::to_string(begin + i) + ": " + error.what());
      }
    }
    const double start = now();
    engine->trace(rays, hits, work, options);
    seconds += now() - start;
    for (std::size_t i = 0; i < n; ++i) {
      const Hit& hit = hits[i];
      if (!work.empty()) totals.add(work[i]);
      if (hit.status > contract::kStatusHit) {
        throw Error("engine " + engine->name() + ": ray " + std::to_string(begin + i) + " ended with status " +
                    std::to_string(hit.status));
      }
      NpyHit& result = results[begin + i];
      result = {std::numeric_limits<double>::infinity(), -1, -1, -1, -1, 0.0, 0.0};
      if (!hit.hit()) continue;
      ++found;
      const glm::dvec3 b = surfaces.file_barycentrics(hit);
      const TriangleSource& source = loaded.world.sources[hit.id];
      result.t = rays[i].t_base + rays[i].t_scale * hit.t;
      const std::uint32_t posed_from = loaded.scene.meshes[source.mesh].source;
      result.mesh = static_cast<std::int32_t>(posed_from != kNone ? posed_from : source.mesh);
      result.primitive = static_cast<std::int32_t>(source.primitive);
      result.triangle = static_cast<std::int32_t>(source.triangle);
      result.node = static_cast<std::int32_t>(source.node);
      result.u = b.y;
      result.v = b.z;
    }
    progress.update(static_cast<double>(begin + n) / static_cast<double>(rows.size()));
  }
  progress.finish();
  totals.rays = rows.size();
  output.write(format_hits(results));
  if (stats_file != nullptr) {
    nlohmann::ordered_json json = {{"command", "trace"},
                                   {"scene", scene_json(loaded)},
                                   {"engine", engine->name()},
                                   {"way_up", a.way_up},
                                   {"mailbox", options.mailbox},
                                   {"any", a.any},
                                   {"rays", totals.rays},
                                   {"hits", found},
                                   {"work", nullptr},
                                   {"trace_s", seconds}};
    if (engine->counts_work())
      json["work"] = {{"down", totals.down},
                      {"up", totals.up},
                      {"leaf", totals.leaf},
                      {"tests", totals.tests},
                      {"skipped", totals.skipped}};
    stats_file->write(json.dump(2) + "\n");
  }
  files.commit();
  std::printf("%s: %s rays, %s hits, %s rays/s\n", a.output.c_str(), with_commas(rows.size()).c_str(),
              with_commas(found).c_str(),
              with_unit(seconds > 0 ? static_cast<double>(rows.size()) / seconds : 0.0).c_str());
}

}  // namespace

void add_trace(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("trace", "Trace the rays of a NumPy file, write the hits to another");
  auto a = std::make_shared<TraceArguments>();
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command->add_option("-i,--input", a->input, "Rays, see below")->required()->type_name("FILE.npy");
  command->add_option("-o,--output", a->output, "Hits, see below")->required()->type_name("FILE.npy");
  command->add_flag("--any", a->any,
                    "Any hit will do (occlusion): t, triangle, u, v are those of the hit that was found first");
  command->add_option("-e,--engine", a->engine, "Engine, see below")->capture_default_str()->type_name("ENGINE");
  command->add_option("--way-up", a->way_up, "How a walk goes up the tree: stack (golden only), parent or face links")
      ->capture_default_str()
      ->check(CLI::IsMember({"stack", "parent", "face"}));
  add_mailbox(*command, a->trace.mailbox);
  command->add_option("--stats", a->stats, "Counters and times as JSON")->type_name("FILE");
  add_engine_options(*command);
  add_two_level(*command, program);
  add_common(*command, program);
  command->footer(
      "Rays: float64 array of shape (N, 8): origin x y z, t_min, direction x y z, t_max, in the scene's own units. The "
      "direction need\n"
      "  not have unit length; t counts in its lengths. Hits with t_min <= t <= t_max count; t_max may be inf.\n"
      "Hits: structured array of shape (N,) with t, mesh, primitive, triangle, node, u, v. Indices are those of the "
      "glTF file: node is\n"
      "  the instance, triangle counts within the primitive; u, v belong to the second and third vertex as the file "
      "lists them.\n"
      "  A miss has t = inf and indices -1.\n"
      "Engines:\n" +
      engine_help() +
      "Examples:\n"
      "  python3 -c \"import numpy as np; np.save('rays.npy', np.array([[0,1,5, 0, 0,0,-1, np.inf]]))\"\n"
      "  retrace trace room.glb -i rays.npy -o hits.npy\n"
      "  retrace trace room.glb -i rays.npy -o hits.npy --any --engine csim\n"
      "  python3 -c \"import numpy as np; print(np.load('hits.npy')['t'])\"\n");
  command->callback([a, &program] { run_trace(*a, program.common); });
}

}  // namespace retrace::cli
