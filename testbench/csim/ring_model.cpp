// ring_model [SCENE [WIDTHxHEIGHT [FIRST-END]]]: an estimate of what the ring of tasks would need in hardware, for the rows FIRST to END - 1 of a
// frame. C simulation says what each token does in each lap and which reads miss the caches; this model adds time:
//
//   - every task takes a token in each clock (II = 1), in order, and hands it on after its latency, which is assumed (kTasks);
//   - a task with a memory port is a rigid pipeline, as deep as its latency and the memory's: a hit takes as long as a miss, a late answer stops it;
//   - a read is answered `--latency` clocks after it was asked for, when the bus, `--bytes` a clock for all ports, is free; `--outstanding` reads a port at most;
//   - streams have their declared depths; ray_setup and hit_finish have II = 8.
//
// No compiler has confirmed an interval or a latency: the figures are estimates.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/ring_run.hpp"
#include "testbench/kit/command_line.hpp"

namespace {

using namespace retrace;

struct TaskModel {
  const char* name;
  const char* output;  // stream
  int latency;         // clocks, without the memory's
  int bytes;           // of a read, 0 without a port
  int lines;           // of the cache
};
constexpr std::array<TaskModel, 12> kTasks{{{"launch", "launched", 4, 0, 0},
                                            {"node_fetch", "nodes", 5, 16, 1024},
                                            {"step", "stepped", 12, 0, 0},
                                            {"node_fetch_2", "nodes_2", 5, 16, 1024},
                                            {"step_2", "stepped_2", 12, 0, 0},
                                            {"leaf_fetch", "leaf_lines", 5, 64, 256},
                                            {"leaf_exit", "in_leaf", 14, 0, 0},
                                            {"list_fetch", "references", 8, 16, 256},
                                            {"mailbox", "wanted", 4, 0, 0},
                                            {"triangle_fetch", "triangle_lines", 5, 64, 512},
                                            {"tri_test", "candidates", 50, 0, 0},
                                            {"result", "ready", 8, 0, 0}}};
enum {
  kLaunch,
  kNodeFetch,
  kStep,
  kNodeFetch2,
  kStep2,
  kLeafFetch,
  kLeafExit,
  kListFetch,
  kMailbox,
  kTriangleFetch,
  kTriTest,
  kResult
};
constexpr int kSetupInterval = 8, kFinishInterval = 8, kFifo = 2, kSetups = 32, kFinishes = 64;

/// What one token does in one lap.
struct Lap {
  bool ray = false, fresh = false, finished = false;
  std::array<bool, kTasks.size()> work{}, miss{};
};

/// Recorded from the streams: the order of the tokens never changes, so word i of each stream is lap i.
struct Recorder {
  std::vector<Lap> laps;
  std::array<std::size_t, kTasks.size()> at{};
  std::array<std::vector<std::int64_t>, kTasks.size()> cache;
  std::vector<std::int64_t> list_base = std::vector<std::int64_t>(RETRACE_RING_CONTEXTS);

  Recorder() {
    for (std::size_t i = 0; i < kTasks.size(); ++i) cache[i].assign(std::max(1, kTasks[i].lines), -1);
  }
  void read(Lap& lap, int task, std::int64_t index) {
    std::int64_t& held = cache[task][index % kTasks[task].lines];
    lap.work[task] = true;
    lap.miss[task] = held != index;
    held = index;
  }
  void operator()(const ::hls::stream_base& stream) {
    const std::string name = stream.name();
    std::size_t task = 0;
    while (task < kTasks.size() && name != kTasks[task].output) ++task;
    if (task == kTasks.size()) return;
    const std::size_t number = at[task]++;
    if (number >= laps.size()) laps.resize(number + 1);
    Lap& lap = laps[number];
    // Word types differ; the token is in the low 256 bits.
    retrace::hls::token_word_t bits;
    retrace::hls::token_word_t behind = 0;
    if (name == "nodes" || name == "nodes_2" || name == "in_leaf" || name == "candidates") {
      const retrace::hls::token_data_t word =
          static_cast<const ::hls::stream<retrace::hls::token_data_t>&>(stream).newest();
      bits = word;
      behind = word >> 256;
    } else if (name == "leaf_lines" || name == "triangle_lines") {
      bits = static_cast<const ::hls::stream<retrace::hls::token_line_t>&>(stream).newest();
    } else {
      bits = static_cast<const ::hls::stream<retrace::hls::token_word_t>&>(stream).newest();
    }
    const retrace::hls::token t = retrace::hls::unpack_token(bits);
    const auto phase = t.phase.to_int();
    const auto way = t.way.to_int(), node = t.node.to_int(), ref = t.ref.to_int();
    if (task == kLaunch) {
      lap.ray = phase != retrace::hls::kTokenIdle && phase != retrace::hls::kTokenEnd;
      lap.fresh = t.fresh == 1;
      if (phase == retrace::hls::kTokenDown) read(lap, kNodeFetch, node / 2);
      if (phase == retrace::hls::kTokenUp) read(lap, kNodeFetch, way / 2);
    } else if (task == kStep && t.arrive == 0) {
      if (phase == retrace::hls::kTokenDown) read(lap, kNodeFetch2, node / 2);
      if (phase == retrace::hls::kTokenUp) read(lap, kNodeFetch2, way / 2);
    } else if (task == kStep2 && t.arrive == 1) {
      read(lap, kLeafFetch, ref);
    } else if (task == kLeafExit && t.arrive == 1) {
      const ap_uint<64> base = behind >> 192;
      list_base[t.id.to_uint()] = static_cast<std::int64_t>(base.to_uint64());
    } else if (task == kListFetch && t.test == 1 && t.next > contract::kLeafInline) {
      read(lap, kListFetch, (list_base[t.id.to_uint()] + t.next.to_int() - 1 - contract::kLeafInline) / 4);
    } else if (task == kMailbox && t.test == 1 && t.skipped == 0) {
      read(lap, kTriangleFetch, ref);
      lap.work[kTriTest] = true;
    } else if (task == kResult) {
      lap.finished = lap.ray && phase == retrace::hls::kTokenIdle;
    }
  }
};

/// The bus of the memory: one transfer after another, each in the first free clocks.
struct Bus {
  std::vector<bool> taken;
  int bytes;
  std::int64_t transfer(std::int64_t from, int size) {
    for (int left = (size + bytes - 1) / bytes; left > 0; ++from) {
      if (static_cast<std::size_t>(from) >= taken.size()) taken.resize(2 * static_cast<std::size_t>(from) + 1024);
      if (taken[static_cast<std::size_t>(from)]) continue;
      taken[static_cast<std::size_t>(from)] = true;
      --left;
    }
    return from;
  }
};

int run(const std::string& name, int width, int height, int first, int last, int latency, int bytes, int outstanding) {
  const Scene scene = open_scene(name);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world);
  const MemoryImage image = build_kd(grid);
  const ViewCamera view = default_view(scene, world);
  std::vector<GridRay> rays;
  for (int y = first; y < last; ++y)
    for (int x = 0; x < width; ++x)
      rays.push_back(quantise(view.ray(x + 0.5, y + 0.5, width, height), grid.transform, grid.box, false));
  std::erase_if(rays, [](const GridRay& ray) { return ray.outside; });
  if (rays.empty()) throw std::runtime_error("no ray meets the scene");
  Recorder recorder;
  RingRun::of_thread().settings.on_write = [&](const ::hls::stream_base& stream) { recorder(stream); };
  constexpr std::size_t kRayWords64 = contract::RayRecord::kWords;
  std::vector<std::uint64_t> ray_words(kRayWords64 * rays.size()), hits(2 * rays.size()), unused(2);
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i].record.pack(&ray_words[kRayWords64 * i]);
  std::array<ap_uint<64>, kSummaryWords> summary;
  const auto* words = reinterpret_cast<const retrace::hls::word_t*>(image.words().data());
  const auto* lines = reinterpret_cast<const retrace::hls::line_t*>(image.words().data());
  retrace_ring(words, words, lines, words, lines, reinterpret_cast<const retrace::hls::token_word_t*>(ray_words.data()),
               reinterpret_cast<retrace::hls::word_t*>(hits.data()),
               reinterpret_cast<retrace::hls::word_t*>(unused.data()), summary.data(),
               image.words().size() / MemoryImage::kLineWords, rays.size(), 0);

  constexpr std::size_t kCount = kTasks.size();
  const std::size_t laps = recorder.laps.size() - 1;      // the last word is the end
  std::array<std::vector<std::int64_t>, kCount> in, out;  // clock at which a task takes, hands on a token
  std::array<std::vector<std::int64_t>, kCount> answers;
  std::array<std::int64_t, kCount> starved{}, blocked{}, memory{}, work{}, misses{};
  for (std::size_t s = 0; s < kCount; ++s) in[s].resize(laps), out[s].resize(laps);
  Bus bus{{}, bytes};
  std::vector<std::int64_t> launches, finishes;
  std::int64_t setup = 0, last_finish = 0, ray_laps = 0;
  for (std::size_t j = 0; j < laps; ++j) {
    const Lap& lap = recorder.laps[j];
    ray_laps += lap.ray;
    for (std::size_t s = 0; s < kCount; ++s) {
      std::int64_t arrives = 0;
      if (s > 0) arrives = out[s - 1][j] + 1;
      if (s == 0 && j >= RETRACE_RING_CONTEXTS) arrives = out[kResult][j - RETRACE_RING_CONTEXTS] + 1;
      if (s == 0 && lap.fresh) {
        const std::size_t number = launches.size();
        setup = std::max(setup + kSetupInterval, number >= kSetups ? launches[number - kSetups] : 0);
        bus.transfer(setup, contract::kRayBytes);
        arrives = std::max(arrives, setup + latency);
      }
      const std::int64_t free = j > 0 ? in[s][j - 1] + 1 : 0;
      // A pipeline holds as many tokens as it has stages.
      const int depth = kTasks[s].latency + (kTasks[s].bytes ? latency : 0);
      const std::int64_t room = j >= static_cast<std::size_t>(depth) ? out[s][j - depth] : 0;
      std::int64_t takes = std::max({arrives, free, room});
      if (arrives > std::max(free, room)) starved[s] += arrives - std::max(free, room);
      if (room > std::max(free, arrives)) blocked[s] += room - std::max(free, arrives);
      std::int64_t done = takes + depth;
      if (lap.miss[s]) {
        const std::size_t number = answers[s].size();
        std::int64_t asks = takes + 3;
        if (number >= static_cast<std::size_t>(outstanding)) asks = std::max(asks, answers[s][number - outstanding]);
        const std::int64_t answer = bus.transfer(asks + latency, kTasks[s].bytes);
        answers[s].push_back(answer);
        if (answer + 2 > done) memory[s] += answer + 2 - done;
        done = std::max(done, answer + 2);
      }
      if (j > 0) done = std::max(done, out[s][j - 1] + 1);
      if (s + 1 < kCount && j >= kFifo) done = std::max(done, in[s + 1][j - kFifo]);
      if (s == kResult && lap.finished) {
        const std::size_t number = finishes.size();
        if (number >= kFinishes) done = std::max(done, finishes[number - kFinishes]);
        last_finish = std::max(done, last_finish + kFinishInterval);
        finishes.push_back(last_finish);
        bus.transfer(last_finish + 40, contract::kHitBytes);
      }
      if (s == 0 && lap.fresh) launches.push_back(takes);
      in[s][j] = takes;
      out[s][j] = done;
      work[s] += lap.work[s];
      misses[s] += lap.miss[s];
    }
  }
  const auto count = static_cast<double>(rays.size());
  const double clocks = static_cast<double>(last_finish);
  std::int64_t moved = 0;
  for (std::size_t s = 0; s < kCount; ++s) moved += misses[s] * kTasks[s].bytes;
  std::printf(
      "estimate, %s %dx%d rows %d-%d: %zu rays, %.1f clocks a ray, of which %.1f laps of its token; %d tokens, memory "
      "%d clocks, %d bytes a "
      "clock, %d reads a port; %.0f bytes read a ray without the rays\n",
      name.c_str(), width, height, first, last, rays.size(), clocks / count, static_cast<double>(ray_laps) / count,
      RETRACE_RING_CONTEXTS, latency, bytes, outstanding, static_cast<double>(moved) / count);
  std::printf("%-15s %8s %8s | clocks a ray: %8s %8s %8s\n", "task", "work/ray", "miss/ray", "starved", "blocked",
              "memory");
  for (std::size_t s = 0; s < kCount; ++s)
    std::printf("%-15s %8.2f %8.2f | %14s %8.2f %8.2f %8.2f\n", kTasks[s].name, static_cast<double>(work[s]) / count,
                static_cast<double>(misses[s]) / count, "", static_cast<double>(starved[s]) / count,
                static_cast<double>(blocked[s]) / count, static_cast<double>(memory[s]) / count);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string scene = "room";
  ImageSize size{640, 480};
  std::pair<int, int> rows{200, 216};
  int latency = 60, bytes = 16, outstanding = 16;
  CLI::App app("An estimate of the clocks a ray of the ring of tasks, and where they wait.", "ring_model");
  app.add_option("scene", scene, "A generated scene")->capture_default_str();
  add_size(app, "size", size, 4096, "Rays");
  add_pair(app, "rows", rows, '-', "Only these rows of the image");
  const CLI::Range positive(1, 1 << 20);
  app.add_option("--latency", latency, "Of the memory, in clocks")->check(positive)->capture_default_str();
  app.add_option("--bytes", bytes, "A clock")->check(positive)->capture_default_str();
  app.add_option("--outstanding", outstanding, "Reads of a port")->check(positive)->capture_default_str();
  return run_program(app, argc, argv, [&] {
    if (rows.second <= rows.first || rows.second > size.height)
      throw std::invalid_argument("rows: FIRST-END within the image");
    return run(scene, size.width, size.height, rows.first, rows.second, latency, bytes, outstanding);
  });
}
