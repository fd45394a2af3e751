// See ray_rows.hpp.
#include "golden/render/ray_rows.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
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

}  // namespace

RowsResult trace_rows(const Surfaces& surfaces, Engine& engine, const RayRows& rows, std::span<SceneHit> hits,
                      std::span<RayWork> work, const RowsOptions& options) {
  if (hits.size() != rows.count || (!work.empty() && work.size() != rows.count))
    throw Error("trace: numbers of rays, hits and works differ");
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
    found.assign(n, Hit{});
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
        try {
          rays[i] = quantise(world_ray(rows, begin + i), grid.transform, grid.box, options.any);
        } catch (const Error&) {
          std::size_t first = bad.load();
          while (i < first && !bad.compare_exchange_weak(first, i)) {
          }
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
    const double start = now();
    engine.trace(rays, found, of_wave, options.trace);
    result.trace_s += now() - start;
    if (count) {
      for (const RayWork& w : of_wave) result.totals.add(w);
    }
    const auto failed = std::ranges::find_if(found, [](const Hit& hit) { return hit.status > contract::kStatusHit; });
    if (failed != found.end())
      throw Error("engine " + engine.name() + ": ray " +
                  std::to_string(begin + static_cast<std::size_t>(failed - found.begin())) + " ended with status " +
                  std::to_string(failed->status));
    std::atomic<std::size_t> hit_count{0};
    parallel(n, [&](const auto& range) {
      std::size_t here = 0;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        here += found[i].hit() ? 1 : 0;
        hits[begin + i] = found[i].hit() ? scene_hit(surfaces, rays[i], found[i]) : kMiss;
      }
      hit_count += here;
    });
    result.hits += hit_count.load();
    if (options.progress) options.progress(begin + n);
  }
  return result;
}

}  // namespace retrace
