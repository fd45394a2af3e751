// The engine that renders through the RTL core in Verilator.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "golden/engine/engine.hpp"
#include "testbench/driver/core_driver.hpp"
#include "testbench/sim/core/axi_memory.hpp"
#include "testbench/sim/core/core_description.hpp"

namespace retrace {

struct RtlOptions {
  std::string configuration = "ecp5";  ///< one of cosim::core_configurations()
  cosim::MemoryOptions memory;
  std::string waves;  ///< FST file, empty for none
  std::uint64_t seed = 1;
  std::uint32_t ray_row = 0;              ///< as RtlEngine::set_ray_row
  std::uint64_t clocks_per_ray = 100000;  ///< give up after this many clocks a ray (and a constant)
};

class RtlEngine : public Engine {
 public:
  bool counts_work() const override { return false; }
  /// Hit records of the last trace() exactly as written, two 64-bit words a ray (0 for rays marked outside).
  virtual std::span<const std::uint64_t> raw_hits() const = 0;
  /// Of all runs so far.
  virtual const cosim::CoreCounters& counters() const = 0;
  virtual const std::string& configuration() const = 0;
  virtual cosim::CoreIdentity identity() const = 0;
  /// Bytes read so far: header, rays, leaves, list, triangles, nodes (all lanes).
  virtual std::array<std::uint64_t, cosim::kReadSources.size()> read_bytes_by_source() const = 0;
  /// Of the last run.
  virtual cosim::CoreStatus status() const = 0;
  /// The rays of trace() are an image with rows of so many; lets the core visit them in tiles. 0, the default: one after the other. Hits do not
  /// depend on it. Rays marked outside leave gaps, and what is left has no rows: it is handed over in tiles.
  virtual void set_ray_row(std::uint32_t rays) = 0;
  /// Clocks simulated and the seconds they took.
  virtual std::uint64_t simulated_clocks() const = 0;
  virtual double simulation_seconds() const = 0;
};

/// `image` must outlive the engine. way_up kStack is an Error; mailbox must be 0 or the core's; per-ray work is not available (an Error if
/// asked for). One simulation: TraceOptions::threads has no meaning.
std::unique_ptr<RtlEngine> make_rtl_engine(const MemoryImage& image, const RtlOptions& options);
/// The same over words that nobody has checked, for tests with corrupt images.
std::unique_ptr<RtlEngine> make_rtl_engine(std::span<const std::uint64_t> image_words, const RtlOptions& options);

}  // namespace retrace
