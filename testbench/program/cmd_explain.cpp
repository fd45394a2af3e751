// retrace explain: one ray through several engines, stage by stage, and where they part.
#include <algorithm>
#include <array>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "golden/base/output_file.hpp"
#include "golden/compare/compare.hpp"
#include "golden/engine/registry.hpp"
#include "golden/engine/walk.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/view.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/walk_picture.hpp"

namespace retrace::cli {
namespace {

struct ExplainArguments {
  std::string scene, engines, size = "640x480", camera, way_up = "face", output, stats;
  std::vector<int> pixel;
  std::vector<double> ray;
  bool any = false, all_engines = false;  ///< none were named
  TraceOptions trace;
};

/// One call in a line of its own.
std::string told(const StageCall& call) {
  const auto v = [&](const char* name) { return call.value(name); };
  constexpr std::array<const char*, 6> kFace = {"-x", "+x", "-y", "+y", "-z", "+z"};
  char text[160];
  switch (call.stage) {
    case Stage::kRaySetup:
      std::snprintf(text, sizeof text, "from %.5f %.5f %.5f%s", v("origin_x"), v("origin_y"), v("origin_z"),
                    v("valid") != 0 ? "" : ", refused");
      break;
    case Stage::kKdDescend:
      std::snprintf(text, sizeof text, "t %.7f, plane %.6f: to node %.0f", v("t"), v("split"), v("node"));
      break;
    case Stage::kLeafExit:
      std::snprintf(text, sizeof text, "leaves at t %.7f by %s", v("t_exit"),
                    kFace[static_cast<std::size_t>(v("face")) % 6]);
      break;
    case Stage::kTriTest:
      if (v("hit") != 0) {
        std::snprintf(text, sizeof text, "triangle %.0f: hit at t %.7f", v("triangle"), v("t"));
      } else {
        std::snprintf(text, sizeof text, "triangle %.0f: no", v("triangle"));
      }
      break;
    case Stage::kKdBacktrack:
      if (v("matched") != 0) {
        std::snprintf(text, sizeof text, "up to %.0f, across to node %.0f", v("parent"), v("node"));
      } else {
        std::snprintf(text, sizeof text, "up to %.0f", v("parent"));
      }
      break;
    case Stage::kInstanceEnter:
      if (v("enters") != 0) {
        std::snprintf(text, sizeof text, "instance %.0f: in at t %.7f, at %.5f %.5f %.5f of its object", v("instance"),
                      std::ldexp(v("start"), -static_cast<int>(v("scale"))), v("origin_x"), v("origin_y"),
                      v("origin_z"));
      } else {
        std::snprintf(text, sizeof text, "instance %.0f: passes it by, or nearer ones are hit", v("instance"));
      }
      break;
    case Stage::kHitFinish:
      if (v("status") == contract::kStatusHit) {
        std::snprintf(text, sizeof text, "triangle %.0f, t %.7f, u %.4f, v %.4f", v("triangle"), v("t"), v("u"),
                      v("v"));
      } else {
        std::snprintf(text, sizeof text, v("status") == contract::kStatusMiss ? "miss" : "error status %.0f",
                      v("status"));
      }
      break;
  }
  return call.level > 0 ? std::string("| ") + text : text;
}

nlohmann::ordered_json walk_json(const Walk& walk) {
  auto calls = nlohmann::ordered_json::array();
  for (const StageCall& call : walk.calls) {
    nlohmann::ordered_json entry = {{"stage", to_string(call.stage)}};
    if (call.level > 0) entry["level"] = call.level;
    for (const StageValue& value : call.values) {
      if (value.choice) {
        entry[value.name] = static_cast<std::int64_t>(value.value);
      } else {
        entry[value.name] = value.value;
      }
    }
    calls.push_back(entry);
  }
  return calls;
}

struct Explained {
  std::string name;
  bool fixed = false;
  Walk walk;
  Parting parting;          ///< from the engine it is held against
  std::size_t against = 0;  ///< that engine's place
};

void print_steps(const std::vector<Explained>& engines) {
  std::size_t steps = 0;
  std::vector<std::size_t> width;
  for (const Explained& engine : engines) {
    steps = std::max(steps, engine.walk.calls.size());
    std::size_t widest = engine.name.size();
    for (const StageCall& call : engine.walk.calls) widest = std::max(widest, told(call).size());
    width.push_back(widest);
  }
  std::printf("\n%5s  %-12s", "step", "stage");
  for (std::size_t e = 0; e < engines.size(); ++e) std::printf("  %-*s", int(width[e]), engines[e].name.c_str());
  std::printf("\n");
  for (std::size_t i = 0; i < steps; ++i) {
    std::string line;
    char head[64];
    const auto longest = std::find_if(engines.begin(), engines.end(),
                                      [&](const Explained& engine) { return i < engine.walk.calls.size(); });
    std::snprintf(head, sizeof head, "%5zu  %-12s", i, to_string(longest->walk.calls[i].stage));
    line = head;
    bool parts = false;
    for (std::size_t e = 0; e < engines.size(); ++e) {
      const auto& calls = engines[e].walk.calls;
      std::string cell;
      if (i < calls.size()) {
        const Explained& other = engines[engines[e].against];
        const bool same_bits = e != 0 && engines[e].fixed && other.fixed && i < other.walk.calls.size() &&
                               agree_in_bits(other.walk.calls[i], calls[i]);
        cell = same_bits ? "= " + other.name : told(calls[i]);
        if (calls[i].stage != longest->walk.calls[i].stage) cell = std::string(to_string(calls[i].stage)) + ": " + cell;
      }
      parts = parts || (engines[e].parting.parts && engines[e].parting.step == i);
      cell.resize(std::max(cell.size(), width[e]), ' ');
      line += "  " + cell;
    }
    while (!line.empty() && line.back() == ' ') line.pop_back();
    std::printf("%s%s\n", line.c_str(), parts ? "   <- they part" : "");
  }
}

/// Throws UsageError if the engine does not show walks through instances.
void check_entries(const std::string& name) {
  if (!find_engine(name).shows_entries)
    throw UsageError("engine " + name + " shows walks through one level only: --two-level off");
}

void run_explain(const ExplainArguments& a, Program& program) {
  const Size size = parse_size(a.size);
  std::vector<std::string> names = parse_engines(a.engines);
  if (a.pixel.empty() == a.ray.empty()) throw UsageError("explain takes a ray: --pixel X,Y or --ray OX,OY,OZ,DX,DY,DZ");
  if (!a.pixel.empty() && (a.pixel[0] < 0 || a.pixel[0] >= size.width || a.pixel[1] < 0 || a.pixel[1] >= size.height))
    throw UsageError("--pixel " + std::to_string(a.pixel[0]) + "," + std::to_string(a.pixel[1]) +
                     " is not in an image of " + a.size + " pixels");
  TraceOptions options = a.trace;
  options.way_up = parse_way_up(a.way_up);
  options.threads = program.common.threads;
  for (const std::string& name : names) {
    check_options(name, options);
    if (!find_engine(name).shows_walks) throw UsageError("engine " + name + " does not show its walks");
    if (program.common.two_levels == TwoLevels::kOn && !a.all_engines) check_entries(name);
  }
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile* const picture = a.output.empty() ? nullptr : &files.add(a.output);
  OutputFile* const stats = a.stats.empty() ? nullptr : &files.add(a.stats);

  const LoadedScene loaded = load_scene(a.scene, program.common, false);
  if (loaded.grid.two_levels) {
    // Whether an engine with an argument, a configuration of the core, reads instances depends on it; who wants it names it.
    if (a.all_engines)
      std::erase_if(names, [](const std::string& name) {
        return !find_engine(name).shows_entries || find_engine(name).takes_argument;
      });
    for (const std::string& name : names) check_entries(name);
  }
  WorldRay world;
  std::string what;
  char text[256];
  if (a.ray.empty()) {
    const ViewCamera camera = default_view(loaded.scene, loaded.world, a.camera);
    world = camera.ray(a.pixel[0] + 0.5, a.pixel[1] + 0.5, size.width, size.height);
    std::snprintf(text, sizeof text, "pixel %d,%d of %s", a.pixel[0], a.pixel[1], a.size.c_str());
  } else {
    world.origin = {a.ray[0], a.ray[1], a.ray[2]};
    world.direction = {a.ray[3], a.ray[4], a.ray[5]};
    std::snprintf(text, sizeof text, "ray from %g %g %g along %g %g %g", a.ray[0], a.ray[1], a.ray[2], a.ray[3],
                  a.ray[4], a.ray[5]);
  }
  what = loaded.name + ", " + text;
  const GridRay ray = quantise(world, loaded.grid.transform, loaded.grid.box, a.any);
  std::printf("%s, way up: %s\n", what.c_str(), a.way_up.c_str());
  print_levels(loaded);
  std::vector<Explained> engines;
  if (ray.outside) {
    std::printf("the ray does not meet the box of the scene: no engine sees it, a miss\n");
  } else {
    const auto& r = ray.record;
    std::printf("ray record: origin (%d %d %d) direction (%d %d %d) t_max %u; world t = %.9g + %.9g t\n", r.origin[0],
                r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2], r.t_max, ray.t_base,
                ray.t_scale);
    for (const std::string& name : names) {
      Explained explained;
      explained.name = name;
      explained.fixed = find_engine(name).fixed_point;
      explained.walk = make_engine(name, loaded.grid, loaded.image)->walk(ray, options);
      engines.push_back(std::move(explained));
    }
    const std::vector<std::size_t> against = places_held_against(names);
    for (std::size_t i = 1; i < engines.size(); ++i) {
      engines[i].against = against[i];
      const Explained& other = engines[against[i]];
      engines[i].parting = engines[i].fixed && other.fixed ? first_parting_in_bits(other.walk, engines[i].walk)
                                                           : first_parting_in_choices(other.walk, engines[i].walk);
    }
    print_steps(engines);
    std::printf("\n");
    const Comparator comparator(loaded.grid);
    for (std::size_t i = 1; i < engines.size(); ++i) {
      const Explained &one = engines[i], &other = engines[one.against];
      const bool bits = one.fixed && other.fixed;
      const Verdict verdict = one.fixed == other.fixed ? Comparator::identical(other.walk.hit, one.walk.hit)
                              : other.fixed            ? comparator.compare(ray, one.walk.hit, other.walk.hit)
                                                       : comparator.compare(ray, other.walk.hit, one.walk.hit);
      if (one.parting.parts) {
        std::printf("%s and %s part at step %zu, %s\n", other.name.c_str(), one.name.c_str(), one.parting.step,
                    one.parting.why.c_str());
      } else {
        std::printf("%s and %s take the same %zu steps%s\n", other.name.c_str(), one.name.c_str(),
                    one.walk.calls.size(), bits ? ", bit for bit" : "");
      }
      std::printf("  their hits: class %s%s%s\n", to_string(verdict.agreement), *verdict.reason != 0 ? ", " : "",
                  verdict.reason);
      if (verdict.agreement == Agreement::kViolation || (bits && one.parting.parts)) program.exit_code = 1;
    }
  }
  if (picture != nullptr) {
    static const Walk kNothing;
    const bool seen = !engines.empty();
    picture->write(draw_walk({seen ? engines[0].name : "outside", seen ? &engines[0].walk : &kNothing}, what,
                             loaded.grid, loaded.image));
  }
  if (stats != nullptr) {
    nlohmann::ordered_json json = {
        {"command", "explain"}, {"scene", scene_json(loaded)}, {"ray", what},
        {"way_up", a.way_up},   {"outside", ray.outside},      {"engines", nlohmann::ordered_json::array()}};
    for (const Explained& engine : engines) {
      nlohmann::ordered_json entry = {{"name", engine.name}, {"steps", walk_json(engine.walk)}, {"parting", nullptr}};
      if (engine.parting.parts)
        entry["parting"] = {
            {"from", engines[engine.against].name}, {"step", engine.parting.step}, {"why", engine.parting.why}};
      json["engines"].push_back(entry);
    }
    stats->write(json.dump(2) + "\n");
  }
  files.commit();
}

}  // namespace

void add_explain(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("explain", "Follow one ray through several engines, stage by stage");
  auto a = std::make_shared<ExplainArguments>();
  for (const EngineKind& kind : engine_kinds()) {
    if (kind.shows_walks) a->engines += (a->engines.empty() ? "" : ",") + kind.name;
  }
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command->add_option("--pixel", a->pixel, "The ray through the centre of this pixel")
      ->expected(2)
      ->delimiter(',')
      ->type_name("X,Y");
  command->add_option("--ray", a->ray, "Origin and direction in the scene's units")
      ->expected(6)
      ->delimiter(',')
      ->type_name("OX,OY,OZ,DX,DY,DZ");
  command->add_option("-s,--size", a->size, "Image that --pixel lies in")->capture_default_str()->type_name("WxH");
  command->add_option("--camera", a->camera, "Number or name of a camera of the file");
  command->add_flag("--any", a->any, "Any hit will do (occlusion)");
  const CLI::Option* engines =
      command->add_option("-e,--engines", a->engines, "Engines, see below")->capture_default_str()->type_name("LIST");
  command->add_option("--way-up", a->way_up, "How a walk goes up the tree: parent or face links")
      ->capture_default_str()
      ->check(CLI::IsMember({"parent", "face"}));
  add_mailbox(*command, a->trace.mailbox);
  command->add_option("-o,--output", a->output, "Picture of the first engine's walk")->type_name("FILE.svg");
  command->add_option("--stats", a->stats, "All steps as JSON")->type_name("FILE");
  add_two_level(*command, program);
  add_engine_options(*command);
  add_common(*command, program);
  command->footer(
      "Each step is a call of a stage (docs/core.md). Golden and a fixed-point engine part where they choose "
      "differently (a node, a "
      "face, a\n"
      "triangle hit or not); two fixed-point engines where any bit of a record differs, and that is an error (exit "
      "code 1).\n"
      "Lengths are in grid units, behind a | those of an instance's object.\n"
      "Engines:\n" +
      engine_help() +
      "Examples:\n"
      "  retrace explain knot --pixel 320,240 -o walk.svg\n"
      "  retrace explain room.glb --pixel 100,80 --size 320x240 --engines golden,csim --way-up parent --mailbox\n"
      "  retrace explain carousel --two-level on --pixel 320,240\n"
      "  retrace explain knot --ray 0,0,5,0,0,-1 --stats walk.json\n");
  command->callback([a, engines, &program] {
    a->all_engines = engines->count() == 0;
    run_explain(*a, program);
  });
}

}  // namespace retrace::cli
