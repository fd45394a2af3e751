// See ray_rows.hpp.
#include "golden/render/ray_rows.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <limits>
#include <vector>

#include "golden/base/clock.hpp"

namespace retrace {
namespace {

constexpr std::size_t kBlock = 2048;  // rays a task takes at a time
constexpr SceneHit kMiss{std::numeric_limits<double>::infinity(), -1, -1, -1, -1, 0.0, 0.0};

WorldRay world_ray(const RayRows& rows, std::size_t row) {
  WorldRay ray;
  ray.origin = {rows.at(row, 0), rows.at(row, 1), rows.at(row, 2)};
  ray.t_min = rows.at(row, 3);
  ray.direction = {rows.at(row, 4), rows.at(row, 5), rows.at(row, 6)};
  ray.t_max = rows.at(row, 7);
  return ray;
}

SceneHit scene_hit(const Surfaces& surfaces, const GridRay& ray, const Hit& hit) {
  const glm::dvec3 b = surfaces.file_barycentrics(hit);
  const TriangleSource& source = surfaces.world().sources[hit.id];
  const std::uint32_t posed_from = surfaces.scene().meshes[source.mesh].source;
  return {ray.t_base + ray.t_scale * hit.t,
          static_cast<std::int32_t>(posed_from != kNone ? posed_from : source.mesh),
          static_cast<std::int32_t>(source.primitive),
          static_cast<std::int32_t>(source.triangle),
          static_cast<std::int32_t>(source.node),
          b.y,
          b.z};
}

/// Makes `value` the smaller of itself and `i`.
void lower(std::atomic<std::size_t>& value, std::size_t i) {
  std::size_t seen = value.load();
  while (i < seen && !value.compare_exchange_weak(seen, i)) {
  }
}

}  // namespace

RowsResult trace_rows(const Surfaces& surfaces, Engine& engine, const RayRows& rows, std::span<SceneHit> hits,
                      std::span<RayWork> work, const RowsOptions& options) {
  if (hits.size() != rows.count || (!work.empty() && work.size() != rows.count))
    throw Error("trace: numbers of rays, hits and works differ");
  const double start = now();
  const std::clock_t cpu_start = std::clock();
  const GridScene& grid = surfaces.grid();
  const bool count = options.totals && engine.counts_work();
  RowsResult result;
  result.totals.rays = rows.count;
  std::vector<GridRay> rays;
  std::vector<Hit> found;
  std::vector<RayWork> wave_work;
  tbb::task_arena arena(options.trace.threads > 0 ? options.trace.threads : tbb::task_arena::automatic);
  const auto parallel = [&](std::size_t n, const auto& body) {
    arena.execute([&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, kBlock), body); });
  };
  for (std::size_t begin = 0; begin < rows.count; begin += options.wave) {
    const std::size_t n = std::min(options.wave, rows.count - begin);
    rays.resize(n);
    found.resize(n);
    std::span<RayWork> of_wave;
    if (!work.empty()) {
      of_wave = work.subspan(begin, n);
    } else if (count) {
      wave_work.assign(n, RayWork{});
      of_wave = wave_work;
    }
    std::atomic<std::size_t> bad{n};  // the first row that is no ray
    parallel(n, [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end() && i < bad.load(std::memory_order_relaxed); ++i) {
        found[i] = Hit{};
        try {
          rays[i] = quantise(world_ray(rows, begin + i), grid.transform, grid.box, options.any);
        } catch (const Error&) {
          lower(bad, i);
        }
      }
    });
    if (const std::size_t i = bad.load(); i < n) {
      const std::string name = options.source + ": ray " + std::to_string(begin + i);
      try {
        quantise(world_ray(rows, begin + i), grid.transform, grid.box, options.any);
      } catch (const Error& error) {
        throw Error(name + ": " + error.what());
      }
      throw Error(name + ": changed while it was read");
    }
    const double engine_start = now();
    engine.trace(rays, found, of_wave, options.trace);
    result.trace_s += now() - engine_start;
    if (count) {
      for (const RayWork& w : of_wave) result.totals.add(w);
    }
    std::atomic<std::size_t> failed{n};  // the first ray that is neither hit nor miss
    std::atomic<std::size_t> hit_count{0};
    parallel(n, [&](const auto& range) {
      std::size_t here = 0;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        here += found[i].hit() ? 1 : 0;
        if (found[i].status > contract::kStatusHit) lower(failed, i);
        hits[begin + i] = found[i].hit() ? scene_hit(surfaces, rays[i], found[i]) : kMiss;
      }
      hit_count += here;
    });
    if (const std::size_t i = failed.load(); i < n)
      throw Error("engine " + engine.name() + ": ray " + std::to_string(begin + i) + " ended with status " +
                  std::to_string(found[i].status));
    result.hits += hit_count.load();
    if (options.progress) options.progress(begin + n);
  }
  result.seconds = now() - start;
  result.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace retrace
