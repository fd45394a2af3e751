// Engine "stream": the streaming machine of Purcell et al. 2002 (hls/streaming) over a uniform grid, in C simulation, in the two variants of the paper.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "golden/engine/registry.hpp"

namespace retrace {

enum class StreamVariant {
  kMultiPass,  ///< a state a ray in memory; a pass sends the rays that wait for one kernel through it
  kBranching,  ///< a ray stays in the processor until it is done
};

/// Work in the terms of the paper.
struct StreamTotals {
  std::uint64_t rays = 0, voxels = 0, tests = 0;
  std::uint64_t screens = 0;          ///< batches of rays that pass together
  std::uint64_t traverse_passes = 0;  ///< of all screens
  std::uint64_t intersect_passes = 0;
  std::uint64_t steps = 0;        ///< records that a kernel has worked on
  std::uint64_t slots = 0;        ///< records of all passes, those that the stencil keeps from the kernel included
  std::uint64_t state_bytes = 0;  ///< rays and states read and written
  std::uint64_t image_bytes = 0;  ///< voxels, list entries, triangles read

  // A cycle model of it: kernels take a record a clock, the stencil kStencil records; what a pass moves goes over the bus of MachineMemory, and the image's
  // reads through small caches.
  static constexpr double kStencil = 16;
  double clocks = 0, traverse_clocks = 0, intersect_clocks = 0, bus_clocks = 0;  ///< of the run; busy
  std::uint64_t bus_bytes = 0;
  double voxel_hits = 1, list_hits = 1, triangle_hits = 1;  ///< hit rates of the caches

  std::uint64_t passes() const { return traverse_passes + intersect_passes; }
  /// Share of the records of a pass that the kernel works on.
  double utilisation() const { return slots ? static_cast<double>(steps) / static_cast<double>(slots) : 0.0; }
};

class StreamEngine : public Engine {
 public:
  virtual StreamTotals totals() const = 0;
  /// Hits of rays that ray_setup takes, in their order, and what ray_setup made of them.
  virtual std::vector<contract::HitRecord> run(std::span<const contract::RaySetupInRecord> rays) = 0;
  /// Hit records of the last trace(), two words each.
  virtual std::span<const std::uint64_t> raw_hits() const = 0;
};

/// Rays that pass together at most.
inline constexpr std::size_t kStreamScreen = std::size_t{1} << 18;

/// `image_words`: a grid image (accel::GridImage); the kernels check what they read of it. `box`: root box of the scene.
std::unique_ptr<StreamEngine> make_stream_engine(std::span<const std::uint64_t> image_words,
                                                 const std::array<std::int32_t, 6>& box, StreamVariant variant);

EngineKind stream_engine_kind();

}  // namespace retrace
