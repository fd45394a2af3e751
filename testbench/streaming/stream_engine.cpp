// See stream_engine.hpp.
#include "stream_engine.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <optional>

#include "golden/accel/grid_image.hpp"
#include "golden/engine/hit_codec.hpp"
#include "hls/streaming/kernels.hpp"
#include "hls/streaming/steps.hpp"
#include "testbench/csim/stage_tops.hpp"
#include "testbench/kit/machine_memory.hpp"
#include "testbench/streaming/grid_walk.hpp"
#include "testbench/streaming/stream_words.hpp"

namespace retrace {
namespace {

using hls::line_t;
using hls::ray_setup_out_word_t;
using hls::ray_state_word_t;
using hls::word_t;
constexpr std::size_t kBlock = 1024;  // records of one call of a kernel
constexpr std::uint64_t kRayBytes = 64, kStateBytes = 64;

/// What of a state decides where it goes next; the low bits of its word.
unsigned waits_for(const ray_state_word_t& state) {
  const ap_uint<contract::kKernelBits> kernel = state;
  return kernel.to_uint();
}

class Machine final : public StreamEngine {
 public:
  Machine(std::span<const std::uint64_t> image, const std::array<std::int32_t, 6>& box, StreamVariant variant)
      : memory_(image), image_(image.begin(), image.end()), box_(box), variant_(variant) {
    try {
      grid_.emplace(image_);
    } catch (const Error&) {  // the kernels say what of it they refuse; there is nothing to count
    }
  }

  std::string name() const override { return variant_ == StreamVariant::kBranching ? "stream:branching" : "stream"; }
  StreamTotals totals() const override { return totals_; }
  std::span<const std::uint64_t> raw_hits() const override { return raw_hits_; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size() || (!work.empty() && work.size() != rays.size()))
      throw Error("stream engine: sizes of rays, hits and work differ");
    raw_hits_.assign(kHitWords * rays.size(), 0);
    std::fill(hits.begin(), hits.end(), Hit{});
    std::fill(work.begin(), work.end(), RayWork{});
    const std::vector<std::size_t> inside = rays_inside(rays);
    std::vector<contract::RaySetupInRecord> records;
    for (const std::size_t place : inside) {
      const contract::RayRecord& ray = rays[place].record;
      records.push_back(
          {.origin = ray.origin, .direction = ray.direction, .t_max = ray.t_max, .any = ray.any, .box = box_});
    }
    std::vector<contract::HitRecord> made;
    std::vector<RayWork> done;
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] { run_screens(records, made, &done, options.done); });
    for (std::size_t i = 0; i < inside.size(); ++i) {
      std::array<std::uint64_t, kHitWords> words;
      made[i].pack(words.data());
      std::copy(words.begin(), words.end(), raw_hits_.begin() + static_cast<std::ptrdiff_t>(kHitWords * inside[i]));
      hits[inside[i]] = unpack_hit(words);
      if (!work.empty()) work[inside[i]] = done[i];
    }
    if (options.done) *options.done += rays.size() - inside.size();
  }

  std::vector<contract::HitRecord> run(std::span<const contract::RaySetupInRecord> rays) override {
    std::vector<contract::HitRecord> hits;
    run_screens(rays, hits, nullptr, nullptr);
    return hits;
  }

 private:
  void run_screens(std::span<const contract::RaySetupInRecord> rays, std::vector<contract::HitRecord>& hits,
                   std::vector<RayWork>* work, std::atomic<std::uint64_t>* done) {
    hits.resize(rays.size());
    if (work != nullptr) work->resize(rays.size());
    for (std::size_t first = 0; first < rays.size(); first += kStreamScreen) {
      const std::size_t count = std::min(kStreamScreen, rays.size() - first);
      run_screen(rays.subspan(first, count), std::span(hits).subspan(first, count),
                 work != nullptr ? std::span(*work).subspan(first, count) : std::span<RayWork>());
      if (done != nullptr) *done += count;
    }
  }

  void run_screen(std::span<const contract::RaySetupInRecord> rays, std::span<contract::HitRecord> hits,
                  std::span<RayWork> work) {
    std::vector<ray_setup_out_word_t> set_up(rays.size());
    std::vector<ray_state_word_t> states(rays.size());
    in_blocks(rays.size(), [&](std::size_t begin, std::size_t count) {
      ::hls::stream<hls::ray_setup_in_word_t> in("rays", 1);
      ::hls::stream<ray_setup_out_word_t> out("set up", 1), set_up_rays("set up", count);
      for (std::size_t i = begin; i < begin + count; ++i) {
        in.write(stream_word<hls::ray_setup_in_word_t>(rays[i]));
        ray_setup_top(in, out);
        set_up[i] = out.read();
        set_up_rays.write(set_up[i]);
      }
      const auto n = static_cast<unsigned>(count), number = static_cast<unsigned>(begin);
      ::hls::stream<ray_state_word_t> made("states", count);
      if (variant_ == StreamVariant::kMultiPass) {
        stream_setup(set_up_rays, made, memory_.words.data(), memory_.count, number, n);
      } else {
        std::array<ap_uint<64>, kStreamSummaryWords> summary;
        stream_trace(set_up_rays, made, memory_.words.data(), memory_.words.data(), memory_.words.data(),
                     memory_.lines.data(), summary.data(), memory_.count, number, n);
        const std::scoped_lock lock(mutex_);
        totals_.steps += summary[kStreamSteps].to_uint64();
      }
      for (std::size_t i = begin; i < begin + count; ++i) states[i] = made.read();
    });
    if (variant_ == StreamVariant::kMultiPass) {
      run_passes(set_up, states);
      // Set up and finish: a ray in, ray and state out; a state in, a hit out.
      const auto records = static_cast<double>(rays.size());
      add_clocks(records, records * (8 * (kRayWords + kHitWords) + kRayBytes + 2 * kStateBytes), 0, 0,
                 MachineMemory::kLatency);
    } else {
      add_branching(rays);
    }

    StreamTotals sum;
    in_blocks(rays.size(), [&](std::size_t begin, std::size_t count) {
      ::hls::stream<ray_state_word_t> done("states", count);
      ::hls::stream<hls::hit_word_t> made("hits", count);
      for (std::size_t i = begin; i < begin + count; ++i) done.write(states[i]);
      stream_finish(done, made, static_cast<unsigned>(count));
      std::uint64_t voxels = 0, tests = 0;
      for (std::size_t i = begin; i < begin + count; ++i) {
        const hls::hit_word_t word = made.read();
        const std::array<std::uint64_t, kHitWords> words{static_cast<ap_uint<64>>(word).to_uint64(),
                                                         static_cast<ap_uint<64>>(word >> 64).to_uint64()};
        hits[i] = contract::HitRecord::unpack(words.data());
        const hls::ray_state_record state = hls::read_ray_state(states[i]);
        voxels += state.voxels.to_uint();
        tests += state.tests.to_uint();
        if (!work.empty()) {
          work[i].leaf = state.voxels.to_uint();
          work[i].tests = state.tests.to_uint();
        }
      }
      const std::scoped_lock lock(mutex_);
      sum.voxels += voxels;
      sum.tests += tests;
    });
    totals_.rays += rays.size();
    totals_.screens += 1;
    totals_.voxels += sum.voxels;
    totals_.tests += sum.tests;
    totals_.image_bytes += 4 * sum.voxels + (4 + contract::kTriangleUsedBytes) * sum.tests;
    // Set up and finish: a ray in, ray and state out; a state in.
    totals_.state_bytes += rays.size() * (kRayBytes + 2 * kStateBytes);
    if (variant_ == StreamVariant::kBranching) totals_.slots = totals_.steps;  // no record passes by a kernel
  }

  /// Pass after pass until every ray is done. The kernel that most rays wait for is next.
  void run_passes(std::span<const ray_setup_out_word_t> rays, std::span<ray_state_word_t> states) {
    std::array<std::vector<std::uint32_t>, 2> waiting;  // for traverse, for intersect
    const auto sort_in = [&](std::uint32_t ray) {
      const unsigned kernel = waits_for(states[ray]);
      if (kernel != static_cast<unsigned>(contract::kKernelDone))
        waiting[kernel == static_cast<unsigned>(contract::kKernelIntersect)].push_back(ray);
    };
    for (std::uint32_t i = 0; i < states.size(); ++i) sort_in(i);
    while (!waiting[0].empty() || !waiting[1].empty()) {
      const bool intersect = waiting[1].size() > waiting[0].size();
      const std::vector<std::uint32_t> active = std::move(waiting[intersect]);
      waiting[intersect].clear();
      std::vector<std::uint32_t> entries(intersect ? active.size() : 0);  // of the lists, which this pass reads
      for (std::size_t i = 0; i < entries.size(); ++i)
        entries[i] = hls::read_ray_state(states[active[i]]).entry.to_uint();
      in_blocks(active.size(), [&](std::size_t begin, std::size_t count) {
        ::hls::stream<ray_setup_out_word_t> ray_words("rays", count);
        ::hls::stream<ray_state_word_t> in("in", count), out("out", count);
        for (std::size_t i = begin; i < begin + count; ++i) {
          ray_words.write(rays[active[i]]);
          in.write(states[active[i]]);
        }
        const auto n = static_cast<unsigned>(count);
        const word_t* words = memory_.words.data();
        if (intersect) {
          stream_intersect(ray_words, in, out, words, words, memory_.lines.data(), memory_.count, n);
        } else {
          stream_traverse(ray_words, in, out, words, words, memory_.count, n);
        }
        for (std::size_t i = begin; i < begin + count; ++i) states[active[i]] = out.read();
      });
      for (const std::uint32_t ray : active) sort_in(ray);
      add_pass(intersect, active, entries, states);
      ++(intersect ? totals_.intersect_passes : totals_.traverse_passes);
      totals_.steps += active.size();
      totals_.slots += states.size();
      totals_.state_bytes += active.size() * (kRayBytes + 2 * kStateBytes);
    }
  }

  template <class Body>
  static void in_blocks(std::size_t count, const Body& body) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, kBlock),
        [&](const auto& range) { body(range.begin(), range.size()); }, tbb::simple_partitioner());
  }

  /// A read of the image in the cycle model; the bytes that it moves.
  std::uint64_t look_up(const GridRead& read) { return caches_[read.kind].look_up(read.address / 64) ? 0 : 64; }

  void add_clocks(double busy, double bus_bytes, double traverse, double intersect, double latency) {
    const double bus = bus_bytes / MachineMemory::kBytesPerClock;
    totals_.clocks += std::max(busy, bus) + latency;
    totals_.bus_clocks += bus;
    totals_.bus_bytes += static_cast<std::uint64_t>(bus_bytes);
    totals_.traverse_clocks += traverse;
    totals_.intersect_clocks += intersect;
    totals_.voxel_hits = caches_[GridRead::kVoxel].hit_rate();
    totals_.list_hits = caches_[GridRead::kList].hit_rate();
    totals_.triangle_hits = caches_[GridRead::kTriangle].hit_rate();
  }

  /// What a pass has read of the image, from the states that went in and came out.
  void add_pass(bool intersect, std::span<const std::uint32_t> active, std::span<const std::uint32_t> entries,
                std::span<const ray_state_word_t> states) {
    std::uint64_t bytes = active.size() * (kRayBytes + 2 * kStateBytes);
    if (grid_) {
      const contract::GridHeaderRecord& grid = grid_->header();
      for (std::size_t i = 0; i < active.size(); ++i) {
        if (intersect) {
          bytes += look_up(read_of_list(grid, entries[i]));
          bytes += look_up(read_of_triangle(grid, grid_->list(entries[i]) & ~(1u << contract::kGridLastLog2)));
        } else {
          const std::uint64_t low = static_cast<ap_uint<64>>(states[active[i]]).to_uint64();
          std::array<std::uint32_t, 3> voxel;
          for (int a = 0; a < 3; ++a)
            voxel[static_cast<std::size_t>(a)] =
                low >> (contract::kKernelBits + 1 + contract::kVoxelBits * a) & ((1u << contract::kVoxelBits) - 1);
          bytes += look_up(read_of_voxel(grid, voxel));
        }
      }
    }
    const auto records = static_cast<double>(active.size());
    add_clocks(std::max(records, static_cast<double>(states.size()) / StreamTotals::kStencil),
               static_cast<double>(bytes), intersect ? 0 : records, intersect ? records : 0, MachineMemory::kLatency);
  }

  /// The branching variant: a ray after the other as far as the caches see it, so many in flight that nobody waits for memory.
  void add_branching(std::span<const contract::RaySetupInRecord> rays) {
    if (!grid_) return;
    std::uint64_t bytes = 0, voxels = 0, tests = 0;
    for (const contract::RaySetupInRecord& ray : rays) {
      std::vector<GridRead> reads;
      const GridWalk walk =
          walk_grid(*grid_, ray.box,
                    {.origin = ray.origin, .direction = ray.direction, .t_max = ray.t_max, .any = ray.any}, &reads);
      for (const GridRead& read : reads) bytes += look_up(read);
      voxels += walk.voxels;
      tests += walk.tests;
    }
    bytes += rays.size() * 8 * (kRayWords + kHitWords);
    add_clocks(static_cast<double>(voxels + tests), static_cast<double>(bytes), static_cast<double>(voxels),
               static_cast<double>(tests), MachineMemory::kLatency);
  }

  StreamMemory memory_;
  std::vector<std::uint64_t> image_;
  std::optional<accel::GridImage> grid_;
  std::array<MachineCache, 3> caches_{MachineCache(256), MachineCache(256), MachineCache(512)};
  std::array<std::int32_t, 6> box_;
  StreamVariant variant_;
  std::vector<std::uint64_t> raw_hits_;
  StreamTotals totals_;
  std::mutex mutex_;
};

StreamVariant variant_of(const std::string& argument) {
  if (argument.empty() || argument == "multipass") return StreamVariant::kMultiPass;
  if (argument == "branching") return StreamVariant::kBranching;
  throw UsageError("engine stream has no variant '" + argument + "'; there are: multipass, branching");
}

CoreReport report_of(const Engine& engine) {
  const StreamTotals t = dynamic_cast<const StreamEngine&>(engine).totals();
  CoreReport report;
  report.configuration = "model";
  report.rays = t.rays;
  report.clocks = static_cast<std::uint64_t>(std::llround(t.clocks));
  report.steps = t.voxels;
  report.bytes = t.bus_bytes;
  report.hit_rates = {{"voxel", t.voxel_hits}, {"list", t.list_hits}, {"triangle", t.triangle_hits}};
  const auto unit = [&](const char* name, double busy) -> CoreReport::Unit {
    return {name, t.clocks > 0 ? busy / t.clocks : 0, t.clocks > 0 ? 1 - busy / t.clocks : 1, 0};
  };
  report.units = {unit("traverse", t.traverse_clocks), unit("intersect", t.intersect_clocks),
                  unit("bus", t.bus_clocks)};
  return report;
}

std::string summary_of(const StreamTotals& totals) {
  const auto rays = static_cast<double>(std::max<std::uint64_t>(totals.rays, 1));
  char text[400];
  std::snprintf(text, sizeof text,
                "streaming machine: %.1f voxels and %.1f tests a ray, %.0f bytes of rays and states, %.0f of the grid",
                static_cast<double>(totals.voxels) / rays, static_cast<double>(totals.tests) / rays,
                static_cast<double>(totals.state_bytes) / rays, static_cast<double>(totals.image_bytes) / rays);
  std::string line = text;
  if (totals.passes() > 0) {
    std::snprintf(text, sizeof text,
                  "; %llu screens, %.0f passes of traverse and %.0f of intersect a screen, utilisation %.1f %%",
                  static_cast<unsigned long long>(totals.screens),
                  static_cast<double>(totals.traverse_passes) / static_cast<double>(totals.screens),
                  static_cast<double>(totals.intersect_passes) / static_cast<double>(totals.screens),
                  100 * totals.utilisation());
    line += text;
  }
  return line;
}

}  // namespace

std::unique_ptr<StreamEngine> make_stream_engine(std::span<const std::uint64_t> image_words,
                                                 const std::array<std::int32_t, 6>& box, StreamVariant variant) {
  return std::make_unique<Machine>(image_words, box, variant);
}

EngineKind stream_engine_kind() {
  EngineKind kind;
  kind.name = "stream";
  kind.same_hits = "grid";
  kind.help =
      "the streaming machine (Purcell 2002) over a uniform grid; stream:multipass (the default) or stream:branching";
  kind.takes_argument = true;
  kind.stack = true;
  kind.check = [](const std::string& argument) { variant_of(argument); };
  kind.make = [](const GridScene& scene, const MemoryImage&, const std::string& argument) -> std::unique_ptr<Engine> {
    return make_stream_engine(accel::GridImage::build(scene).words(), scene.box, variant_of(argument));
  };
  kind.report = report_of;
  kind.summary = [](const Engine& engine) { return summary_of(dynamic_cast<const StreamEngine&>(engine).totals()); };
  return kind;
}

}  // namespace retrace
