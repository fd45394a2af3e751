// retrace machines: the ray tracing machines of the field on the same scenes, rays and kind of memory, as far as they exist here.
#include <algorithm>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "testbench/kit/machine_memory.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

struct MachinesArguments {
  std::vector<std::string> scenes, machines;
  CLI::Option* memory = nullptr;  ///< of the RTL core; the machines share one, so it is not the user's
  std::string size = "160x120";
  std::string json, page;
};

/// Rays a second that a paper gives, at the clock of its part.
struct Published {
  double least = 0, most = 0, clock = 0;  ///< 0: none at hand
  const char* part = "";
  bool known() const { return clock > 0; }
};

/// What is modelled of a machine and what is not. `engine` may be empty: there is none here.
struct Machine {
  const char* name;
  const char* engine;
  const char* source;
  Published published;
  const char* about;
};
constexpr Machine kMachines[] = {
    {"Purcell, multi-pass",
     "stream",
     "Purcell, Buck, Mark, Hanrahan, SIGGRAPH 2002",
     {},
     "Ray tracing as passes of stream kernels over a uniform grid. Every ray has a state in memory; a pass reads all "
     "states, and the stencil keeps the rays from the kernel that do not wait for it. Modelled: the kernels, which are "
     "the HLS sources in C simulation; the passes, with one record a clock through a kernel and 16 a clock through the "
     "stencil; rays and states over the bus; a direct-mapped cache each for voxels, lists and triangles. Not modelled: "
     "a graphics card's clock, its texture caches and its fragment pipes side by side."},
    {"Purcell, branching",
     "stream:branching",
     "Purcell, Buck, Mark, Hanrahan, SIGGRAPH 2002",
     {},
     "The same kernels in one processor that can branch and keeps a ray until it is done, so that no state leaves it. "
     "Modelled: one step of a ray a clock, and so many rays in flight that nobody waits for the latency of memory, "
     "only for its bandwidth. Not modelled: the latency of a step, which a single ray would wait for; the caches see "
     "one ray after the other."},
    {"SaarCOR",
     "packets",
     "Schmittler, Wald, Slusallek, Graphics Hardware 2002",
     {},
     "Packets of 64 rays, here neighbours in a row of the image, walk a kd-tree together, with one stack a packet: a "
     "node, a list entry or a triangle is read "
     "once for all of them. Modelled: the walk, with the arithmetic of this project's stages; 16 packets in flight "
     "that compete for a traversal unit (4 rays a clock), a list unit, an intersection unit (one ray a clock), caches "
     "and the bus. Not modelled: ray generation and shading. The sizes are this project's, not the paper's."},
    {"Dynamic SaarCOR",
     "rtl:saarcor",
     "Schmittler, Woop, Wagner, Paul, Slusallek, Graphics Hardware 2004",
     {4e6, 12e6, 90e6, "Virtex-II 6000"},
     "Two levels of kd-trees, with one transformation unit for entries into objects and for triangle tests. Here it is "
     "the RTL core in the configuration `saarcor` (two lanes): every clock is simulated. The scenes of the table have "
     "one level; [dynamic scenes](dynamic-scenes.md) have two. Not modelled: the packets of the paper's machine; "
     "this core has single rays in flight and no stack."},
    {"RPU",
     "",
     "Woop, Schmittler, Slusallek, SIGGRAPH 2005",
     {1.1e6, 1.1e6, 66e6, "Virtex-II 6000"},
     "A programmable shader processor beside a traversal unit for the same kd-tree. Here its instruction set, "
     "assembler "
     "and arithmetic exist, and a machine on the host that renders with its programs ([shader](shader.md)); that "
     "machine "
     "has no clocks, so it has no row in the table."},
    {"Lee (this project's core)",
     "rtl",
     "Lee 2007; Foley, Sugerman, Graphics Hardware 2005",
     {},
     "kd-backtrack: a walk without a stack by links of the leaves and parents, single rays, hundreds in flight. Here "
     "it "
     "is the RTL core in the configuration `ecp5` (four lanes): every clock is simulated. Not modelled: nothing of the "
     "core; its memory is the one of the table, not that of a board."},
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

/// "7.5 to 22.5", or one number where both are the same.
std::string range(double least, double most, int digits) {
  const std::string from = number(least, digits), to = number(most, digits);
  return from == to ? from : from + " to " + to;
}

std::string page_of(const nlohmann::ordered_json& result, const std::string& command) {
  std::string text =
      "# Machines of the field\n\n<!-- Generated by retrace machines --page. Do not edit. -->\n\n"
      "The ray tracing machines of the literature that exist here, on the same scenes, the same primary rays in image "
      "order and the same memory: " +
      result["memory"].get<std::string>() +
      ". *Model*: the clocks come from a cycle model, an estimate. *Simulated RTL*: every clock was simulated. Steps "
      "are "
      "the nodes, leaves or voxels that a ray visits.\n\n    " +
      command +
      " --json machines.json\n    scripts/machines_plots.py machines.json docs/pictures/machines.svg\n\n"
      "![Clocks, bytes, steps and tests a ray of each machine on each scene, and how busy the units are]"
      "(pictures/machines.svg)\n\n" +
      table(result["scenes"]) +
      "\nA clock is not the same in two machines: they have other units, and more or fewer of them. Bytes, steps and "
      "tests a ray can be compared as they are; clocks together with the units that are busy say what a machine waits "
      "for.\n\n## Published figures\n\n"
      "Primary rays a second as the papers give them, on their own scenes, and what that is in clocks.\n\n"
      "| machine | million rays a second | clock, MHz | clocks a ray | part |\n| --- | --- | --- | --- | --- |\n";
  for (const Machine& machine : kMachines) {
    const Published& p = machine.published;
    if (p.known())
      text += std::string("| ") + machine.name + " (" + machine.source + ") | " +
              range(p.least / 1e6, p.most / 1e6, 1) + " | " + number(p.clock / 1e6, 0) + " | " +
              range(p.clock / p.most, p.clock / p.least, 1) + " | " + p.part + " |\n";
  }
  text +=
      "\nOf the other papers no figure is quoted, because their text was not at hand. What this project's core reaches "
      "on its part: [ray-rates.md](ray-rates.md).\n";
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

  const std::string latency = number(MachineMemory::kLatency, 0), width = number(MachineMemory::kBytesPerClock, 0);
  if (a.memory != nullptr) {
    if (a.memory->count() != 0) throw UsageError("machines: all machines have the same memory; --memory is not taken");
    a.memory->add_result("latency=" + latency + ",bytes=" + width);
    a.memory->run_callback();
  }
  nlohmann::ordered_json result = {{"memory", latency + " clocks of latency, " + width + " bytes a clock"},
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
  for (const Machine& machine : kMachines)
    if (const Published& p = machine.published; p.known())
      result["published"].push_back({{"machine", machine.name},
                                     {"source", machine.source},
                                     {"rays_per_second", {p.least, p.most}},
                                     {"clock_hz", p.clock},
                                     {"part", p.part}});
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
  a->memory = command->get_option_no_throw("--memory");
  add_common(*command, program);
  command->footer(
      "Every machine has the same memory, and traces the primary rays of the scene's first camera in image order. "
      "Clocks "
      "of engines rtl are\n"
      "simulated, of the others a model's. Where the program was built without the RTL, its machines are left out.\n"
      "Examples:\n"
      "  retrace machines\n"
      "  retrace machines room:detail=0.1 --size 64x48 --machines stream,packets --json machines.json\n");
  command->callback([a, &program] { run_machines(*a, program.common); });
}

}  // namespace retrace::cli
