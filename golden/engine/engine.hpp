// What an engine is: rays in, hits out, over one memory image. Engines differ only in how a ray becomes a hit.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "golden/scene/geometry.hpp"
#include "golden/tree/memory_image.hpp"

namespace retrace {

/// A ray in world units. `direction` need not have unit length; t counts in its lengths. Hits with t_min <= t <= t_max count.
struct WorldRay {
  glm::dvec3 origin{0.0};  ///< relative to `center`
  double t_min = 0.0;
  glm::dvec3 direction{0.0, 0.0, 1.0};
  double t_max = 1e300;
  glm::dvec3 center{0.0};  ///< that of the grid for rays from surfaces, which would lose their place far from 0
};

/// A quantised ray: what every engine traces, golden too. Codes of the number contract.
/// world t = t_base + t_scale * (t code * 2^-24).
struct GridRay {
  contract::RayRecord record;
  double t_base = 0.0, t_scale = 1.0;
  bool outside = false;  ///< the ray misses the root box or [t_min, t_max] ends before it: a miss without tracing
};

/// Moves the origin to where the ray enters the root box (or to t_min, whichever is later), normalises and quantises the direction.
/// Throws Error for a non-finite component or a zero direction. t_max is rounded down after clamping to the format's range.
GridRay quantise(const WorldRay& ray, const GridTransform& transform, const std::array<std::int32_t, 6>& box, bool any);

/// Work of walks through a tree.
template <class Count>
struct WalkWork {
  Count down = 0;     ///< interior nodes visited on the way down
  Count up = 0;       ///< ancestors visited on the way up (0 with face links)
  Count leaf = 0;     ///< leaves visited, empty ones too
  Count tests = 0;    ///< triangle tests carried out
  Count skipped = 0;  ///< tests that the mailbox saved

  Count visits() const { return down + up + leaf; }
  template <class Other>
  void add(const WalkWork<Other>& other) {
    down += other.down, up += other.up, leaf += other.leaf, tests += other.tests, skipped += other.skipped;
  }
  friend bool operator==(const WalkWork&, const WalkWork&) = default;
};

/// Of one ray.
using RayWork = WalkWork<std::uint32_t>;

/// Of many.
struct WorkTotals : WalkWork<std::uint64_t> {
  std::uint64_t rays = 0;
};

/// Result of one ray, in grid units along the quantised ray.
struct Hit {
  std::uint32_t status = contract::kStatusMiss;  ///< contract::kStatus*
  std::uint32_t id = contract::kNoTriangle;      ///< triangle id (WorldTriangles)
  double t = 0.0;                                ///< grid units; fixed-point engines: code * 2^-24
  double u = 0.0, v = 0.0;                       ///< of the record's vertices 1 and 2, see make_unit_triangle
  bool hit() const { return status == contract::kStatusHit; }
};

/// Triangles that the kernel and the cores remember for a ray.
inline constexpr int kKernelMailbox = 8;

enum class WayUp { kStack, kParentLinks, kFaceLinks };

struct TraceOptions {
  WayUp way_up = WayUp::kFaceLinks;
  int mailbox = 0;                             ///< entries per ray: 0 or the kernel's size; golden takes any
  int threads = 0;                             ///< 0: all cores
  std::atomic<std::uint64_t>* done = nullptr;  ///< counts finished rays for progress
};

struct Walk;  // walk.hpp

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  /// Whether trace() can fill `work`; otherwise it must be empty.
  virtual bool counts_work() const { return true; }
  /// The rays of trace() are an image with rows of so many, or (0, the default) have no order. May be made use of; hits do not depend on it.
  virtual void set_ray_row(std::uint32_t /*rays*/) {}
  /// Traces rays[i] into hits[i] (and work[i] if `work` is not empty). Rays marked `outside` become misses. Sizes must agree.
  virtual void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
                     const TraceOptions& options) = 0;
  /// The walk of one ray that is not marked `outside`, stage by stage, without a stack. Throws Error if the engine cannot show it.
  virtual Walk walk(const GridRay& ray, const TraceOptions& options);
};

/// Double precision: kd traversal with a stack, or kd-backtrack with parent or face links.
std::unique_ptr<Engine> make_golden_engine(const GridScene& scene, const MemoryImage& image);

}  // namespace retrace
