// retrace bench: build time, rays a second of the engines, work of a ray for each way up the tree.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/pipeline_view.hpp"
#include "testbench/program/progress.hpp"
#ifdef RETRACE_EMBREE
#include <embree3/rtcore.h>
#endif

namespace retrace::cli {
namespace {

struct BenchArguments {
  std::vector<std::string> scenes, engines;
  std::string size = "640x480";
  std::string pipeline;
  bool json = false;
  int repeat = 3;
};

constexpr const char* kEngineModel = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";

/// Best time of `repeat` runs; runs that take long are not repeated.
template <class Run>
double best_time(int repeat, const Run& run) {
  double best = 0, total = 0;
  for (int i = 0; i < repeat; ++i) {
    const double start = now();
    run();
    const double seconds = now() - start;
    best = i == 0 ? seconds : std::min(best, seconds);
    constexpr double kPatience = 20;
    if ((total += seconds) > kPatience) break;
  }
  return best;
}

#ifdef RETRACE_EMBREE
/// Rays a second of Embree on all cores, single rays, the same snapped triangles and quantised rays. Position codes fit a float exactly.
std::optional<double> embree_rays_s(const GridScene& scene, std::span<const GridRay> rays, int repeat) {
  RTCDevice device = rtcNewDevice(nullptr);
  if (device == nullptr) return std::nullopt;
  RTCScene embree = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t n = scene.triangles.size();
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * n));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), n));
  double rays_s = 0;
  if (n > 0 && vertices != nullptr && indices != nullptr) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (int axis = 0; axis < 3; ++axis) {
          *vertices++ = static_cast<float>(scene.triangles[i].vertices[corner][axis]) * 0x1p-24f;
        }
        *indices++ = static_cast<unsigned>(3 * i + corner);
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree, geometry);
    rtcCommitScene(embree);
    const double seconds = best_time(repeat, [&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays.size(), 1024), [&](const auto& range) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          if (rays[i].outside) continue;
          const contract::RayRecord& r = rays[i].record;
          RTCRayHit query{};
          query.ray.org_x = static_cast<float>(r.origin[0]) * 0x1p-24f;
          query.ray.org_y = static_cast<float>(r.origin[1]) * 0x1p-24f;
          query.ray.org_z = static_cast<float>(r.origin[2]) * 0x1p-24f;
          query.ray.dir_x = static_cast<float>(r.direction[0]) * 0x1p-26f;
          query.ray.dir_y = static_cast<float>(r.direction[1]) * 0x1p-26f;
          query.ray.dir_z = static_cast<float>(r.direction[2]) * 0x1p-26f;
          query.ray.tfar = static_cast<float>(r.t_max) * 0x1p-24f;
          query.ray.mask = ~0u;
          query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
          rtcIntersect1(embree, &context, &query);
        }
      });
    });
    rays_s = static_cast<double>(rays.size()) / seconds;
  }
  rtcReleaseGeometry(geometry);
  rtcReleaseScene(embree);
  rtcReleaseDevice(device);
  return n > 0 ? std::optional<double>(rays_s) : std::nullopt;
}
#else
std::optional<double> embree_rays_s(const GridScene&, std::span<const GridRay>, int) { return std::nullopt; }
#endif

class Bench {
 public:
  Bench(const BenchArguments& arguments, const Common& common) : a_(arguments), common_(common) {}

  nlohmann::ordered_json measure(const std::string& scene) {
    say(scene + ": load and build");
    const LoadedScene loaded = load_scene(scene, common_, false);
    const ViewCamera camera = default_view(loaded.scene, loaded.world);
    const Size size = parse_size(a_.size);
    std::vector<WorldRay> world;
    // Tiles, as the renderer has them: neighbours in the list are neighbours in the picture.
    constexpr int kTile = 16;
    for (int ty = 0; ty < size.height; ty += kTile) {
      for (int tx = 0; tx < size.width; tx += kTile) {
        for (int y = ty; y < std::min(ty + kTile, size.height); ++y) {
          for (int x = tx; x < std::min(tx + kTile, size.width); ++x)
            world.push_back(camera.ray(x + 0.5, y + 0.5, size.width, size.height));
        }
      }
    }
    std::vector<GridRay> rays(world.size());
    quantise_all(world, rays, loaded.grid.transform, loaded.grid.box, false);
    std::vector<Hit> hits(rays.size());
    std::vector<RayWork> work(rays.size());

    nlohmann::ordered_json json = {{"name", loaded.name},       {"triangles", loaded.world.vertices.size()},
                                   {"build_s", loaded.build_s}, {"image_bytes", loaded.image.bytes()},
                                   {"golden_rays_s", nullptr},  {"csim_rays_s", nullptr},
                                   {"embree_rays_s", nullptr}};
    for (const std::string& name : a_.engines) {
      say(scene + ": " + name);
      const std::unique_ptr<Engine> engine = make_engine(name, loaded.grid, loaded.image);
      if (find_engine(name).report) {
        json[find_engine(name).name + "_rays_s"] = measure_core(name, *engine, loaded, camera, size);
        continue;
      }
      TraceOptions options;
      options.threads = common_.threads;
      const double seconds = best_time(a_.repeat, [&] { engine->trace(rays, hits, {}, options); });
      json[find_engine(name).name + "_rays_s"] = static_cast<double>(rays.size()) / seconds;
    }
    say(scene + ": embree");
    // It is given one level, what it is held against as well.
    const std::optional<double> embree =
        loaded.grid.two_levels ? std::nullopt : embree_rays_s(loaded.grid, rays, a_.repeat);
    if (embree) json["embree_rays_s"] = *embree;

    say(scene + ": work per ray");
    const std::unique_ptr<Engine> golden = make_engine("golden", loaded.grid, loaded.image);
    for (const WayUp way_up : {WayUp::kStack, WayUp::kParentLinks, WayUp::kFaceLinks}) {
      TraceOptions options;
      options.threads = common_.threads;
      options.way_up = way_up;
      WorkTotals plain, boxed;
      golden->trace(rays, hits, work, options);
      for (const RayWork& w : work) plain.add(w);
      options.mailbox = kKernelMailbox;
      golden->trace(rays, hits, work, options);
      for (const RayWork& w : work) boxed.add(w);
      const double n = static_cast<double>(rays.size());
      json["per_ray"][to_string(way_up)] = {{"down", static_cast<double>(plain.down) / n},
                                            {"up", static_cast<double>(plain.up) / n},
                                            {"leaf", static_cast<double>(plain.leaf) / n},
                                            {"tests", static_cast<double>(plain.tests) / n},
                                            {"tests_mailbox", static_cast<double>(boxed.tests) / n}};
    }
    return json;
  }

  struct CoreRun {
    std::string scene, engine;
    CoreReport report;
    double clocks_per_ray() const {
      return static_cast<double>(report.clocks) / static_cast<double>(std::max<std::uint64_t>(report.rays, 1));
    }
    double steps_per_clock() const { return static_cast<double>(report.steps) / static_cast<double>(report.clocks); }
    double bytes_per_ray() const {
      return static_cast<double>(report.bytes) / static_cast<double>(std::max<std::uint64_t>(report.rays, 1));
    }
  };
  /// One for each scene and engine that says where its clocks went.
  const std::vector<CoreRun>& cores() const { return cores_; }

 private:
  /// Primary rays in image order, once; rays a second of wall time.
  double measure_core(const std::string& name, Engine& core, const LoadedScene& loaded, const ViewCamera& camera,
                      const Size& size) {
    std::vector<WorldRay> world;
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) world.push_back(camera.ray(x + 0.5, y + 0.5, size.width, size.height));
    std::vector<GridRay> rays(world.size());
    quantise_all(world, rays, loaded.grid.transform, loaded.grid.box, false);
    std::vector<Hit> hits(rays.size());
    core.set_ray_row(static_cast<std::uint32_t>(size.width));
    TraceOptions options;
    options.mailbox = kKernelMailbox;
    core.trace(rays, hits, {}, options);
    const EngineKind& kind = find_engine(name);
    cores_.push_back({loaded.name, kind.name, kind.report(core)});
    const CoreReport& report = cores_.back().report;
    return static_cast<double>(std::max<std::uint64_t>(report.rays, 1)) / report.seconds;
  }

  std::vector<CoreRun> cores_;
  void say(const std::string& text) const { note(common_, "bench " + text); }
  const BenchArguments& a_;
  const Common& common_;
};

void print_table(const nlohmann::ordered_json& scenes, const std::vector<std::string>& engines) {
  std::printf("%-18s %11s %9s %13s", "scene", "triangles", "build s", "image bytes");
  for (const std::string& engine : engines) std::printf(" %14s", (find_engine(engine).name + " rays/s").c_str());
  std::printf(" %14s\n", "embree rays/s");
  for (const auto& s : scenes) {
    std::printf("%-18s %11s %9.3f %13s", s["name"].get<std::string>().substr(0, 18).c_str(),
                with_commas(s["triangles"].get<std::uint64_t>()).c_str(), s["build_s"].get<double>(),
                with_commas(s["image_bytes"].get<std::uint64_t>()).c_str());
    for (const std::string& engine : engines) {
      std::printf(" %14s", with_unit(s[find_engine(engine).name + "_rays_s"].get<double>()).c_str());
    }
    std::printf(" %14s\n", s["embree_rays_s"].is_null() ? "-" : with_unit(s["embree_rays_s"].get<double>()).c_str());
  }
  std::printf("\n%-18s %-8s %9s %9s %9s %9s %14s\n", "per ray", "way up", "down", "up", "leaf", "tests",
              "with mailbox");
  for (const auto& s : scenes) {
    for (const char* way : kWayUpNames) {
      const auto& p = s["per_ray"][way];
      std::printf("%-18s %-8s %9.3f %9.3f %9.3f %9.3f %14.3f\n", s["name"].get<std::string>().substr(0, 18).c_str(),
                  way, p["down"].get<double>(), p["up"].get<double>(), p["leaf"].get<double>(),
                  p["tests"].get<double>(), p["tests_mailbox"].get<double>());
    }
  }
}

nlohmann::ordered_json core_json(const Bench::CoreRun& run) {
  nlohmann::ordered_json rates, units;
  for (const auto& [name, rate] : run.report.hit_rates) rates[name] = rate;
  for (const CoreReport::Unit& unit : run.report.units)
    units[unit.name] = {{"busy", unit.busy}, {"starved", unit.starved}, {"blocked", unit.blocked}};
  return {{"scene", run.scene},
          {"config", run.report.configuration},
          {"clocks_per_ray", run.clocks_per_ray()},
          {"steps_per_clock", run.steps_per_clock()},
          {"sim_clocks_per_s", run.report.clocks_per_second},
          {"bytes_per_ray", run.bytes_per_ray()},
          {"hit_rate", rates},
          {"units", units}};
}

void print_core(const Bench::CoreRun& run) {
  std::string rates;
  for (const auto& [name, rate] : run.report.hit_rates) {
    char text[64];
    std::snprintf(text, sizeof text, " %s %.4f", name.c_str(), rate);
    rates += text;
  }
  std::fprintf(
      stderr, "%s, %s %s: %.2f clocks/ray, %.3f steps/clock, %.1f bytes/ray, %s simulated clocks/s; hit rate%s\n",
      run.scene.c_str(), run.engine.c_str(), run.report.configuration.c_str(), run.clocks_per_ray(),
      run.steps_per_clock(), run.bytes_per_ray(), with_unit(run.report.clocks_per_second).c_str(), rates.c_str());
  for (const CoreReport::Unit& unit : run.report.units)
    std::fprintf(stderr, "  %-12s busy %5.1f %%  starved %5.1f %%  blocked %5.1f %%\n", unit.name.c_str(),
                 100 * unit.busy, 100 * unit.starved, 100 * unit.blocked);
}

std::vector<PipelineRun> pipeline_runs(const std::vector<Bench::CoreRun>& cores) {
  std::vector<PipelineRun> runs;
  for (const Bench::CoreRun& run : cores) {
    char text[96];
    std::snprintf(text, sizeof text, ": %.2f clocks/ray, %.3f steps/clock, %.0f bytes/ray", run.clocks_per_ray(),
                  run.steps_per_clock(), run.bytes_per_ray());
    PipelineRun& to = runs.emplace_back();
    to.title = run.scene + ", " + run.report.configuration + text;
    for (const CoreReport::Unit& unit : run.report.units)
      to.units.push_back({unit.name, unit.busy, unit.starved, unit.blocked});
  }
  return runs;
}

void run_bench(BenchArguments& a, const Common& common) {
  parse_size(a.size);
  if (a.engines.empty()) a.engines = {"golden", "csim"};
  for (const std::string& engine : a.engines) {
    check_options(engine, {});
    if (common.two_levels == TwoLevels::kOn) check_instances(engine);
  }
  if (a.scenes.empty()) {
    a.scenes = {"room", "knot", "sphere"};
    std::error_code ignored;
    if (std::filesystem::exists(kEngineModel, ignored)) a.scenes.emplace_back(kEngineModel);
  }
  OutputFiles files;
  OutputFile* pipeline = nullptr;
  if (!a.pipeline.empty()) {
    if (std::none_of(a.engines.begin(), a.engines.end(), [](const auto& e) { return bool(find_engine(e).report); }))
      throw UsageError("--pipeline shows the units of the RTL core: it needs --engine rtl");
    is_linear_format(a.pipeline);
    for (const std::string& scene : a.scenes) files.reads(gltf_files(scene));
    pipeline = &files.add(a.pipeline);
  }
  Bench bench(a, common);
  nlohmann::ordered_json scenes = nlohmann::ordered_json::array();
  for (const std::string& scene : a.scenes) scenes.push_back(bench.measure(scene));
  for (const Bench::CoreRun& run : bench.cores()) print_core(run);
  if (pipeline != nullptr) {
    write_raster(*pipeline, pipeline_view(pipeline_runs(bench.cores())));
    files.commit();
  }
  if (a.json) {
    nlohmann::ordered_json json = {{"scenes", scenes}};
    for (const Bench::CoreRun& run : bench.cores()) json[run.engine].push_back(core_json(run));
    std::printf("%s\n", json.dump(2).c_str());
  } else {
    print_table(scenes, a.engines);
  }
}

}  // namespace

void add_bench(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("bench", "Measure build time, rays a second, and the work of a ray");
  auto a = std::make_shared<BenchArguments>();
  command
      ->add_option("scenes", a->scenes,
                   "Scenes, as for render; default: generated room, knot and sphere, and 2CylinderEngine if installed")
      ->type_name("SCENE...");
  command->add_option("-e,--engine", a->engines, "Engines to time; default: golden, csim")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("ENGINE,...");
  command->add_flag("--json", a->json, "JSON on standard output");
  command->add_option("-s,--size", a->size, "Primary rays: size of the picture")
      ->capture_default_str()
      ->type_name("WxH");
  command->add_option("--repeat", a->repeat, "Runs of which the best counts")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--pipeline", a->pipeline,
                   "Picture of where the clocks of each unit of the RTL core went: busy, starved, blocked")
      ->type_name("FILE");
  add_two_level(*command, program);
  add_engine_options(*command);
  add_common(*command, program);
  command->footer(
      "Rays are the primary rays of the scene's first camera, on all cores. Embree, where it was found when the "
      "program was built, traces\n"
      "the same snapped triangles and the same quantised rays, one by one, in single precision. Work per ray is "
      "golden's; tests_mailbox is\n"
      "the number of triangle tests with a mailbox of 8 entries. Embree is left out of scenes of two levels.\n"
      "Engines:\n" +
      engine_help() +
      "Examples:\n"
      "  retrace bench\n"
      "  retrace bench --json room.glb > bench.json\n"
      "  retrace bench --engine golden knot:along=2000 room.glb\n");
  command->callback([a, &program] { run_bench(*a, program.common); });
}

}  // namespace retrace::cli
