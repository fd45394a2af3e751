// Rays as rows of an array and hits as records of another: what `retrace trace` reads and writes, and what the Python module takes and gives.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "golden/engine/engine.hpp"
#include "golden/render/surface.hpp"

namespace retrace {

/// Rays where they stand, not copied: eight doubles each, origin, t_min, direction, t_max, in the scene's own units. The direction may have
/// any length; t counts in its lengths. Steps are in doubles and may be negative.
struct RayRows {
  const double* data = nullptr;
  std::size_t count = 0;
  std::ptrdiff_t row_step = 8, column_step = 1;

  double at(std::size_t row, int column) const {
    return data[static_cast<std::ptrdiff_t>(row) * row_step + column * column_step];
  }
};

/// A hit in the terms of the scene's file: packed, 40 bytes.
struct SceneHit {
  double t;                                      ///< infinite for a miss
  std::int32_t mesh, primitive, triangle, node;  ///< -1 for a miss
  double u, v;  ///< barycentrics of the second and third vertex as the file lists them; 0 for a miss
};
static_assert(sizeof(SceneHit) == 40);

struct RowsOptions {
  TraceOptions trace;
  bool any = false;                                     ///< any hit will do
  bool totals = false;                                  ///< count the work of all rays, where the engine can
  std::string source = "rays";                          ///< where they come from, for messages
  std::size_t wave = std::size_t{1} << 17;              ///< rays that an engine gets at a time
  std::function<void(std::size_t rays_done)> progress;  ///< after each wave, from the calling thread; may throw
};

struct RowsResult {
  WorkTotals totals;  ///< of the work only `rays` without RowsOptions::totals
  std::size_t hits = 0;
  double trace_s = 0;      ///< in the engine alone
  double seconds = 0;      ///< from rows to hits
  double cpu_seconds = 0;  ///< of processors, meanwhile, in all threads of the process
};

/// Traces all rows in waves. `hits` has one record a row; `work` is empty or has as many. Throws Error for the first row that is no ray, naming it, and
/// for a ray that ends with another status than hit or miss.
RowsResult trace_rows(const Surfaces& surfaces, Engine& engine, const RayRows& rows, std::span<SceneHit> hits,
                      std::span<RayWork> work, const RowsOptions& options);

}  // namespace retrace
