// rtl_stages: any number of vectors through the verilated stages, compared with the HLS functions bit by bit, on all
// cores. Vectors come in batches with seeds of their own, so that a failure is repeated from the start of its batch.
// Exit code 1 on any difference.
#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "golden/base/clock.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scene_vectors.hpp"
#include "scenes/open_scene.hpp"
#include "stage_bench.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/test_rays.hpp"

namespace {

using namespace retrace::cosim;

struct Arguments {
  std::vector<std::string> stages = stage_names();
  std::vector<std::string> modes = stall_mode_names();
  std::uint64_t vectors = 1'000'000, batch = 1'000'000, seed = retrace::test_seed();
  int threads = tbb::info::default_concurrency();
  bool json = false;
  std::string scene;
  std::size_t rays = 2000;
};

int run(const Arguments& a) {
  const auto& [stages, modes, vectors, batch, seed, threads, json, scene, rays] = a;

  SceneVectors walks;
  if (!scene.empty()) {
    const retrace::TracedScene traced = retrace::prepare_scene(retrace::open_scene(scene));
    retrace::Random random(seed);
    record_walks(traced.image, retrace::make_test_rays(traced.grid, traced.image, rays, random), walks);
  }

  std::vector<StageRun> runs;
  for (const auto& stage : stages) {
    if (!scene.empty()) {
      for (const auto& name : modes) {
        const auto mode =
            std::find(stall_mode_names().begin(), stall_mode_names().end(), name) - stall_mode_names().begin();
        runs.push_back({stage, static_cast<StallMode>(mode), seed, vectors_of(walks, stage), &walks});
      }
      continue;
    }
    std::uint64_t left = vectors, batch_seed = seed;
    for (std::size_t turn = 0; left > 0; ++turn) {
      const auto& name = modes[turn % modes.size()];
      const auto mode =
          std::find(stall_mode_names().begin(), stall_mode_names().end(), name) - stall_mode_names().begin();
      const std::uint64_t share = std::min({left, batch, (vectors + modes.size() - 1) / modes.size()});
      runs.push_back({stage, static_cast<StallMode>(mode), batch_seed++, share});
      left -= share;
    }
  }

  struct Total {
    std::uint64_t vectors = 0, clocks = 0, latency = 0;
    double seconds = 0.0, interval = 0.0;
    bool failed = false;
  };
  std::map<std::string, Total> totals;
  std::mutex mutex;
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, runs.size(), 1),
        [&](const auto& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const double start = retrace::now();
            const StageResult result = run_stage(runs[i]);
            const double seconds = retrace::now() - start;
            const std::lock_guard lock(mutex);
            Total& total = totals[runs[i].stage];
            total.vectors += result.vectors;
            total.clocks += result.clocks;
            total.seconds += seconds;
            if (runs[i].mode == StallMode::kNone) {
              total.latency = result.latency;
              total.interval = result.interval;
            }
            if (!result.failure.empty()) {
              total.failed = true;
              std::fprintf(stderr, "%s\n", result.failure.c_str());
            }
          }
        },
        tbb::simple_partitioner());
  });

  bool failed = false;
  auto report = nlohmann::ordered_json::array();
  for (const auto& stage : stages) {
    const Total& total = totals[stage];
    failed |= total.failed;
    const double rate = static_cast<double>(total.vectors) / std::max(total.seconds, 1e-9);
    if (json) {
      report.push_back({{"stage", stage},
                        {"vectors", total.vectors},
                        {"equal", !total.failed},
                        {"latency", total.latency},
                        {"interval", total.interval},
                        {"vectors_per_s", rate}});
    } else {
      std::printf("%-12s %12llu vectors %s, latency %llu, interval %.2f, %.2f M vectors/s a thread\n", stage.c_str(),
                  static_cast<unsigned long long>(total.vectors), total.failed ? "DIFFER" : "equal",
                  static_cast<unsigned long long>(total.latency), total.interval, rate * 1e-6);
    }
  }
  if (json) std::printf("%s\n", report.dump(2).c_str());
  return failed ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app("RTL stages against the HLS functions.", "rtl_stages");
  app.add_option("--stage", a.stages, "stages to run")->check(CLI::IsMember(stage_names()));
  app.add_option("--mode", a.modes, "stalls")->check(CLI::IsMember(stall_mode_names()));
  app.add_option("--vectors", a.vectors, "vectors a stage, over all modes")->check(CLI::PositiveNumber);
  app.add_option("--batch", a.batch, "vectors a seed")->check(CLI::PositiveNumber);
  app.add_option("--seed", a.seed, "seed of the first batch (or RETRACE_SEED)");
  app.add_option("--threads", a.threads, "threads")->check(CLI::Range(1, 1024));
  app.add_option("--scene", a.scene,
                 "a scene (file, or NAME[:key=value...]): record what its rays give to the stages, and use that, once "
                 "in each mode");
  app.add_option("--rays", a.rays, "rays through the scene")->check(CLI::PositiveNumber);
  app.add_flag("--json", a.json, "result as JSON: latency and interval as measured, vectors, vectors a second");
  return retrace::run_program(app, argc, argv, [&] { return run(a); });
}
