// retrace trace: any rays from a NumPy file, hits to a NumPy file.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "golden/base/output_file.hpp"
#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/ray_rows.hpp"
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
  std::vector<SceneHit> results(rows.size());
  Progress progress("trace " + loaded.name + " (" + engine->name() + ")", common.quiet);
  RowsOptions how;
  how.trace = options;
  how.any = a.any;
  how.totals = stats_file != nullptr;
  how.source = a.input;
  how.progress = [&](std::size_t done) {
    progress.update(static_cast<double>(done) / static_cast<double>(rows.size()));
  };
  const RowsResult traced =
      trace_rows(surfaces, *engine, {rows.empty() ? nullptr : rows.front().data(), rows.size()}, results, {}, how);
  progress.finish();
  const WorkTotals& totals = traced.totals;
  output.write(format_hits(results));
  if (stats_file != nullptr) {
    nlohmann::ordered_json json = {
        {"command", "trace"},        {"scene", scene_json(loaded)}, {"engine", engine->name()},
        {"way_up", a.way_up},        {"mailbox", options.mailbox},  {"any", a.any},
        {"rays", totals.rays},       {"hits", traced.hits},         {"work", nullptr},
        {"trace_s", traced.trace_s}, {"rows_s", traced.seconds},    {"rows_cpu_s", traced.cpu_seconds}};
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
              with_commas(traced.hits).c_str(),
              with_unit(traced.seconds > 0 ? static_cast<double>(rows.size()) / traced.seconds : 0.0).c_str());
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
