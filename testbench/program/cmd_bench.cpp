// retrace bench: build time, rays a second of the engines, work of a ray for each way up the tree.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>

#include "golden/render/renderer.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/engines.hpp"
#include "testbench/program/pipeline_view.hpp"
#include "testbench/program/progress.hpp"
#ifdef RETRACE_RTL
#include "testbench/sim/core/rtl_engine.hpp"
#endif
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
#ifdef RETRACE_RTL
      if (auto* core = dynamic_cast<RtlEngine*>(engine.get())) {
        json["rtl_rays_s"] = measure_rtl(*core, loaded, camera, size);
        continue;
      }
#endif
      TraceOptions options;
      options.threads = common_.threads;
      const double seconds = best_time(a_.repeat, [&] { engine->trace(rays, hits, {}, options); });
      json[find_engine(name).name + "_rays_s"] = static_cast<double>(rays.size()) / seconds;
    }
    say(scene + ": embree");
    const std::optional<double> embree = embree_rays_s(loaded.grid, rays, a_.repeat);
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
      options.mailbox = kCsimMailbox;
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

  /// One entry for each scene and run of the RTL core.
  const nlohmann::ordered_json& rtl() const { return rtl_; }

 private:
#ifdef RETRACE_RTL
  /// Primary rays in image order, once; rays a second of wall time.
  double measure_rtl(RtlEngine& core, const LoadedScene& loaded, const ViewCamera& camera, const Size& size) {
    std::vector<WorldRay> world;
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) world.push_back(camera.ray(x + 0.5, y + 0.5, size.width, size.height));
    std::vector<GridRay> rays(world.size());
    quantise_all(world, rays, loaded.grid.transform, loaded.grid.box, false);
    std::vector<Hit> hits(rays.size());
    core.set_ray_row(static_cast<std::uint32_t>(size.width));
    TraceOptions options;
    options.mailbox = core.identity().mail_entries;
    core.trace(rays, hits, {}, options);
    const cosim::CoreCounters& c = core.counters();
    const auto clocks = static_cast<double>(c.clocks), n = static_cast<double>(std::max<std::uint64_t>(c.rays, 1));
    // Whoever misses looks up again and hits, so every access is a hit in the end; a miss is a line that was fetched.
    const auto hit_rate = [](std::uint64_t hit, std::uint64_t missed) {
      return hit == 0 ? 1.0 : 1.0 - static_cast<double>(missed) / static_cast<double>(hit);
    };
    const auto shares = [](const cosim::UnitClocks& u) -> nlohmann::ordered_json {
      const auto all = static_cast<double>(std::max<std::uint64_t>(u.busy + u.starved + u.blocked, 1));
      return {{"busy", static_cast<double>(u.busy) / all},
              {"starved", static_cast<double>(u.starved) / all},
              {"blocked", static_cast<double>(u.blocked) / all}};
    };
    rtl_.push_back(
        {{"scene", loaded.name},
         {"config", core.configuration()},
         {"clocks_per_ray", clocks / n},
         {"steps_per_clock", static_cast<double>(c.node_steps()) / clocks},
         {"sim_clocks_per_s", static_cast<double>(core.simulated_clocks()) / core.simulation_seconds()},
         {"bytes_per_ray", static_cast<double>(c.read_beats + c.write_beats) * core.identity().data_bytes / n},
         {"hit_rate",
          {{"node", hit_rate(c.node_hits, c.node_misses)},
           {"leaf", hit_rate(c.leaf_hits, c.leaf_misses)},
           {"triangle", hit_rate(c.triangle_hits, c.triangle_misses)}}},
         {"units",
          {{"lanes", shares(c.lanes)},
           {"leaf_unit", shares(c.leaf_unit)},
           {"references", shares(c.references)},
           {"tri_test", shares(c.tri_test)},
           {"bus", shares(c.bus)}}}});
    return n / core.simulation_seconds();
  }
#endif

  nlohmann::ordered_json rtl_ = nlohmann::ordered_json::array();
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

void print_rtl(const nlohmann::ordered_json& rtl) {
  for (const auto& run : rtl) {
    std::fprintf(stderr,
                 "%s, rtl %s: %.2f clocks/ray, %.3f steps/clock, %.1f bytes/ray, %s simulated clocks/s; hit rate node "
                 "%.4f leaf %.4f triangle %.4f\n",
                 run["scene"].get<std::string>().c_str(), run["config"].get<std::string>().c_str(),
                 run["clocks_per_ray"].get<double>(), run["steps_per_clock"].get<double>(),
                 run["bytes_per_ray"].get<double>(), with_unit(run["sim_clocks_per_s"].get<double>()).c_str(),
                 run["hit_rate"]["node"].get<double>(), run["hit_rate"]["leaf"].get<double>(),
                 run["hit_rate"]["triangle"].get<double>());
    for (const auto& [name, unit] : run["units"].items())
      std::fprintf(stderr, "  %-12s busy %5.1f %%  starved %5.1f %%  blocked %5.1f %%\n", name.c_str(),
                   100 * unit["busy"].get<double>(), 100 * unit["starved"].get<double>(),
                   100 * unit["blocked"].get<double>());
  }
}

std::vector<PipelineRun> pipeline_runs(const nlohmann::ordered_json& rtl) {
  std::vector<PipelineRun> runs;
  for (const auto& run : rtl) {
    char text[96];
    std::snprintf(text, sizeof text, ": %.2f clocks/ray, %.3f steps/clock, %.0f bytes/ray",
                  run["clocks_per_ray"].get<double>(), run["steps_per_clock"].get<double>(),
                  run["bytes_per_ray"].get<double>());
    PipelineRun& to = runs.emplace_back();
    to.title = run["scene"].get<std::string>() + ", " + run["config"].get<std::string>() + text;
    for (const auto& [name, unit] : run["units"].items())
      to.units.push_back(
          {name, unit["busy"].get<double>(), unit["starved"].get<double>(), unit["blocked"].get<double>()});
  }
  return runs;
}

void run_bench(BenchArguments& a, const Common& common) {
  parse_size(a.size);
  if (a.engines.empty()) a.engines = {"golden", "csim"};
  for (const std::string& engine : a.engines) check_options(engine, {});
  if (a.scenes.empty()) {
    a.scenes = {"room", "knot", "sphere"};
    std::error_code ignored;
    if (std::filesystem::exists(kEngineModel, ignored)) a.scenes.emplace_back(kEngineModel);
  }
  OutputFiles files;
  OutputFile* pipeline = nullptr;
  if (!a.pipeline.empty()) {
    if (std::none_of(a.engines.begin(), a.engines.end(), [](const auto& e) { return find_engine(e).name == "rtl"; }))
      throw UsageError("--pipeline shows the units of the RTL core: it needs --engine rtl");
    is_linear_format(a.pipeline);
    for (const std::string& scene : a.scenes) files.reads(scene);
    pipeline = &files.add(a.pipeline);
  }
  Bench bench(a, common);
  nlohmann::ordered_json scenes = nlohmann::ordered_json::array();
  for (const std::string& scene : a.scenes) scenes.push_back(bench.measure(scene));
  print_rtl(bench.rtl());
  if (pipeline != nullptr) {
    write_raster(*pipeline, pipeline_view(pipeline_runs(bench.rtl())));
    files.commit();
  }
  if (a.json) {
    nlohmann::ordered_json json = {{"scenes", scenes}};
    if (!bench.rtl().empty()) json["rtl"] = bench.rtl();
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
  add_engine_options(*command);
  add_common(*command, program);
  command->footer(
      "Rays are the primary rays of the scene's first camera, on all cores. Embree, where it was found when the "
      "program was built, traces\n"
      "the same snapped triangles and the same quantised rays, one by one, in single precision. Work per ray is "
      "golden's; tests_mailbox is\n"
      "the number of triangle tests with a mailbox of 8 entries.\n"
      "Engines:\n" +
      engine_help() +
      "Examples:\n"
      "  retrace bench\n"
      "  retrace bench --json room.glb > bench.json\n"
      "  retrace bench --engine golden knot:along=2000 room.glb\n");
  command->callback([a, &program] { run_bench(*a, program.common); });
}

}  // namespace retrace::cli
