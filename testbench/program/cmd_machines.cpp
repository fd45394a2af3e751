// retrace machines: the ray tracing machines of the field on the same scenes, rays and kind of memory, as far as they exist here.
#include <algorithm>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

struct MachinesArguments {
  std::vector<std::string> scenes, machines;
  std::string size = "160x120";
  std::string json, page;
};

/// What is modelled of a machine and what is not. `engine` may be empty: there is none here.
struct Machine {
  const char* name;
  const char* engine;
  const char* source;
  const char* published;  ///< figures of the source, as docs/ray-rates.md has them; empty: none here
  const char* about;
};
constexpr Machine kMachines[] = {
    {"Purcell, multi-pass", "stream", "Purcell, Buck, Mark, Hanrahan, SIGGRAPH 2002", "",
     "Ray tracing as passes of stream kernels over a uniform grid, a state for each ray in memory; the stencil keeps "
     "rays from the kernel that do not wait for "
     "it. Modelled: kernels (HLS, in C simulation), passes, a record a clock, 16 records a clock through the stencil, "
     "states over the bus, caches for "
     "the grid. Not modelled: a graphics card's clock, texture caches and fragment pipes."},
    {"Purcell, branching", "stream:branching", "Purcell, Buck, Mark, Hanrahan, SIGGRAPH 2002", "",
     "The same kernels in one processor that keeps a ray until it is done, so that states stay inside. Modelled: a "
     "step a clock, with so many rays in flight "
     "that nobody waits for memory, only for its bandwidth. Not modelled: the latency of a step, which one ray alone "
     "would wait for; caches see one ray after the other."},
    {"SaarCOR", "packets", "Schmittler, Wald, Slusallek, Graphics Hardware 2002", "",
     "Packets of 64 rays walk a kd-tree together, with one stack a packet; a node, a list entry or a triangle is read "
     "once for all of them. Modelled: the walk with "
     "the arithmetic of the core's stages, traversal, list and intersection units, 16 packets in flight that compete "
     "for units, caches and bus. Not modelled: "
     "ray generation and shading; the sizes are the project's, not the paper's."},
    {"Dynamic SaarCOR", "rtl:saarcor", "Schmittler, Woop, Wagner, Paul, Slusallek, Graphics Hardware 2004",
     "4 M to 12 M primary rays a second, 90 MHz, Virtex-II 6000",
     "Two levels of kd-trees, one transformation unit for entries into objects and for triangle tests. Here it is the "
     "RTL core in its configuration of two levels: every "
     "clock is simulated. Not modelled: the packets of rays of the paper's machine; this core has single rays in flight, without "
     "a stack."},
    {"RPU", "", "Woop, Schmittler, Slusallek, SIGGRAPH 2005", "1.1 M primary rays a second, 66 MHz, Virtex-II 6000",
     "A programmable shader processor beside a traversal unit. Its triangle test is the one "
     "of all cores here; its shader processor "
     "is not in this table, so it has no row."},
    {"Lee (this project's core)", "rtl", "Lee 2007; Foley, Sugerman, Graphics Hardware 2005", "",
     "kd-backtrack without a stack, single rays, hundreds in flight. The RTL core in its configuration `ecp5`: every "
     "clock is simulated."},
};

bool is_built(const Machine& machine) {
  if (*machine.engine == 0) return false;
  try {
    check_options(machine.engine, {});
    return true;
  } catch (const UsageError&) {
    return false;
  }
}

nlohmann::ordered_json measure(const LoadedScene& loaded, const Machine& machine, std::span<const GridRay> rays,
                               int row, int threads) {
  const std::unique_ptr<Engine> engine = make_engine(machine.engine, loaded.grid, loaded.image);
  engine->set_ray_row(static_cast<std::uint32_t>(row));
  std::vector<Hit> hits(rays.size());
  std::vector<RayWork> work(rays.size());
  TraceOptions options;
  options.threads = threads;
  options.mailbox = kKernelMailbox;  // of the machines that have one
  const bool counts = engine->counts_work();
  engine->trace(rays, hits, counts ? std::span(work) : std::span<RayWork>(), options);
  // The RTL core does what the kernel does, which counts.
  if (!counts) make_engine("csim", loaded.grid, loaded.image)->trace(rays, hits, work, options);
  const CoreReport report = find_engine(machine.engine).report(*engine);
  const auto n = static_cast<double>(std::max<std::uint64_t>(report.rays, 1));
  WorkTotals totals;
  for (const RayWork& one : work) totals.add(one);
  nlohmann::ordered_json rates = nlohmann::ordered_json::object(), units = nlohmann::ordered_json::object();
  for (const auto& [name, rate] : report.hit_rates) rates[name] = rate;
  for (const CoreReport::Unit& unit : report.units) units[unit.name] = unit.busy;
  const bool model = report.configuration == "model";
  return {{"machine", machine.name},
          {"engine", machine.engine},
          {"measured", model ? "model" : "simulated RTL"},
          {"rays", report.rays},
          {"hits", std::ranges::count_if(hits, &Hit::hit)},
          {"clocks_per_ray", static_cast<double>(report.clocks) / n},
          {"bytes_per_ray", static_cast<double>(report.bytes) / n},
          {"steps_per_ray", static_cast<double>(totals.visits()) / n},
          {"tests_per_ray", static_cast<double>(totals.tests) / n},
          {"hit_rate", rates},
          {"busy", units}};
}

std::string number(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string table(const nlohmann::ordered_json& scenes) {
  std::string text =
      "| scene | machine | from | clocks a ray | bytes a ray | steps a ray | tests a ray | units busy | hit rates |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const auto& scene : scenes)
    for (const auto& row : scene["machines"]) {
      std::string units, rates;
      for (const auto& [name, share] : row["busy"].items())
        units += (units.empty() ? "" : ", ") + name + " " + number(100 * share.get<double>(), 0) + " %";
      for (const auto& [name, rate] : row["hit_rate"].items())
        rates += (rates.empty() ? "" : ", ") + name + " " + number(100 * rate.get<double>(), 1) + " %";
      text += "| " + scene["name"].get<std::string>() + " | " + row["machine"].get<std::string>() + " | " +
              row["measured"].get<std::string>() + " | " + number(row["clocks_per_ray"], 2) + " | " +
              number(row["bytes_per_ray"], 1) + " | " + number(row["steps_per_ray"], 1) + " | " +
              number(row["tests_per_ray"], 1) + " | " + units + " | " + rates + " |\n";
    }
  return text;
}

std::string page_of(const nlohmann::ordered_json& result, const std::string& command) {
  std::string text =
      "# Machines of the field\n\n<!-- Generated by retrace machines --page. Do not edit. -->\n\n"
      "The ray tracing machines of the literature that exist here, on the same scenes and the same primary rays, in "
      "image order. Memory: " +
      result["memory"].get<std::string>() +
      ". *Model*: clocks come from a cycle model, an estimate; *simulated RTL*: every clock was simulated. Steps are "
      "nodes, leaves or voxels that a ray visits.\n\n    " +
      command + "\n\n" + table(result["scenes"]) +
      "\nThe machines differ in what a clock means (how many units of which kind), so the columns that compare them "
      "without that are bytes, steps and tests; "
      "clocks say where each of them waits.\n\n## Published figures\n\n| machine | published |\n| --- | --- |\n";
  for (const Machine& machine : kMachines)
    if (*machine.published != 0)
      text += std::string("| ") + machine.name + " (" + machine.source + ") | " + machine.published + " |\n";
  text += "\nOf the other papers no figure is quoted here, because their text was not at hand.\n";
  for (const Machine& machine : kMachines)
    text += std::string("\n## ") + machine.name + "\n\n" + machine.source + ". " + machine.about +
            (*machine.engine != 0 ? std::string(" Engine: `") + machine.engine + "`.\n" : "\n");
  return text;
}

void run_machines(MachinesArguments& a, const Common& common) {
  const Size size = parse_size(a.size);
  if (a.scenes.empty()) a.scenes = {"room:detail=0.3", "knot", "box"};
  std::vector<const Machine*> machines;
  for (const Machine& machine : kMachines) {
    const bool named = std::ranges::count(a.machines, machine.engine) != 0;
    if (a.machines.empty() ? is_built(machine) : named) machines.push_back(&machine);
    if (named) check_options(machine.engine, {});
  }
  for (const std::string& name : a.machines) {
    std::string known;
    for (const Machine& machine : kMachines)
      if (*machine.engine != 0) known += (known.empty() ? "" : ", ") + std::string(machine.engine);
    if (name.empty() || std::ranges::none_of(kMachines, [&](const Machine& m) { return m.engine == name; }))
      throw UsageError("there is no machine with the engine '" + name + "'; there are: " + known);
  }
  OutputFiles files;
  for (const std::string& scene : a.scenes) files.reads(gltf_files(scene));
  OutputFile* const json_file = a.json.empty() ? nullptr : &files.add(a.json);
  OutputFile* const page_file = a.page.empty() ? nullptr : &files.add(a.page);

  nlohmann::ordered_json result = {{"memory", "60 clocks of latency, 8 bytes a clock"},
                                   {"scenes", nlohmann::ordered_json::array()}};
  std::string command = "retrace machines";
  for (const std::string& scene : a.scenes) {
    command += " " + scene;
    const LoadedScene loaded = load_scene(scene, common, false);
    const ViewCamera camera = default_view(loaded.scene, loaded.world);
    std::vector<WorldRay> world;
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) world.push_back(camera.ray(x + 0.5, y + 0.5, size.width, size.height));
    std::vector<GridRay> rays(world.size());
    quantise_all(world, rays, loaded.grid.transform, loaded.grid.box, false);
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const Machine* machine : machines) rows.push_back(measure(loaded, *machine, rays, size.width, common.threads));
    result["scenes"].push_back({{"name", loaded.name},
                                {"triangles", loaded.world.vertices.size()},
                                {"width", size.width},
                                {"height", size.height},
                                {"machines", rows}});
  }
  command += " --size " + a.size;
  if (std::ranges::any_of(machines, [](const Machine* m) { return std::string(m->engine).starts_with("rtl"); }))
    command += " --memory latency=60,bytes=8";
  if (json_file != nullptr) json_file->write(result.dump(2) + "\n");
  if (page_file != nullptr) page_file->write(page_of(result, command + " --page docs/machines.md"));
  files.commit();
  std::printf("%s", table(result["scenes"]).c_str());
  for (const Machine& machine : kMachines)
    if (*machine.engine != 0 && !is_built(machine))
      std::printf("not built: %s (engine %s)\n", machine.name, machine.engine);
  for (const auto& file : files.files()) std::printf("wrote %s\n", file->path().c_str());
}

}  // namespace

void add_machines(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand(
      "machines", "Ray tracing machines of the field on the same scenes: clocks, bytes, steps and tests a ray");
  auto a = std::make_shared<MachinesArguments>();
  command->add_option("scenes", a->scenes, "Scenes, as for render; default: generated room (detail=0.3), knot and box")
      ->type_name("SCENE...");
  command->add_option("-m,--machines", a->machines, "Engines of the machines; default: all that are built")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("ENGINE,...");
  command->add_option("-s,--size", a->size, "Primary rays of a picture of this size")
      ->type_name("WxH")
      ->capture_default_str();
  command->add_option("--json", a->json, "Everything as JSON")->type_name("FILE");
  command->add_option("--page", a->page, "The page of the documentation")->type_name("FILE");
  add_engine_options(*command);
  add_common(*command, program);
  command->callback([a, &program] { run_machines(*a, program.common); });
}

}  // namespace retrace::cli
