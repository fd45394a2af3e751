// rtl_stages: any number of vectors through the verilated stages, compared with the HLS functions bit by bit, on all
// cores. Vectors come in batches with seeds of their own, so that a failure is repeated from the start of its batch.
// Exit code 1 on any difference.
#include <algorithm>
#include <atomic>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "golden/base/clock.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scene_vectors.hpp"
#include "scenes/open_scene.hpp"
#include "stage_bench.hpp"
#include "testbench/kit/test_rays.hpp"

namespace {

using namespace retrace::cosim;

int run(int argc, char** argv) {
  CLI::App app{"RTL stages against the HLS functions"};
  std::vector<std::string> stages = stage_names();
  std::vector<std::string> modes = stall_mode_names();
  std::uint64_t vectors = 1'000'000, batch = 1'000'000, seed = retrace::test_seed();
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  bool json = false;
  std::string scene;
  std::size_t rays = 2000;
  app.add_option("--stage", stages, "stages to run")->check(CLI::IsMember(stage_names()));
  app.add_option("--mode", modes, "stalls")->check(CLI::IsMember(stall_mode_names()));
  app.add_option("--vectors", vectors, "vectors a stage, over all modes")->check(CLI::PositiveNumber);
  app.add_option("--batch", batch, "vectors a seed")->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "seed of the first batch (or RETRACE_SEED)");
  app.add_option("--threads", threads, "threads")->check(CLI::Range(1, 1024));
  app.add_option("--scene", scene,
                 "a scene (file, or NAME[:key=value...]): record what its rays give to the stages, and use that, once "
                 "in each mode");
  app.add_option("--rays", rays, "rays through the scene")->check(CLI::PositiveNumber);
  app.add_flag("--json", json, "result as JSON: latency and interval as measured, vectors, vectors a second");
  CLI11_PARSE(app, argc, argv);

  SceneVectors walks;
  if (!scene.empty()) {
    const retrace::GridScene grid = retrace::snap(retrace::flatten(retrace::open_scene(scene)));
    const retrace::MemoryImage image = retrace::build_kd(grid);
    retrace::Random random(seed);
    record_walks(image, retrace::make_test_rays(grid, image, rays, random), walks);
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
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < runs.size(); i = next++) {
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
  };
  std::vector<std::thread> pool;
  for (unsigned i = 0; i < threads; ++i) pool.emplace_back(work);
  for (auto& thread : pool) thread.join();

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
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rtl_stages: %s\n", error.what());
    return 1;
  }
}
