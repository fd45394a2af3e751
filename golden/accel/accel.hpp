// The one interface of the structure lab: a structure is built over triangles, answers closest-hit and any-hit queries,
// and counts its work. All in double precision on the snapped scene and the quantised rays (number contract:
// docs/number-contract.md), so that every structure, brute force and the engines of the project can be compared ray by
// ray. A structure is a file; catalogue.cpp lists them.
//
// Units: grid units (position code * 2^-24, direction code * 2^-26). t counts in lengths of the direction.
// Every structure must return, bit for bit, what brute force returns with the same triangle test (triangle_test.hpp).
#pragma once
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace::accel {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// By how much a structure widens its cells and volumes (2^-19, as the memory image does): far above what rounding in
/// double can move a hit point, so that no traversal loses one, see triangle_test.hpp.
inline constexpr double kMargin = contract::kWiden * 0x1p-24;

struct Box {
  glm::dvec3 lower{kInfinity}, upper{-kInfinity};
  void add(const glm::dvec3& p) { lower = glm::min(lower, p), upper = glm::max(upper, p); }
  void add(const Box& b) { lower = glm::min(lower, b.lower), upper = glm::max(upper, b.upper); }
  glm::dvec3 extent() const { return upper - lower; }
  glm::dvec3 center() const { return 0.5 * (lower + upper); }
  bool empty() const { return !(lower.x <= upper.x); }
  /// Half the surface area; 0 for an empty box.
  double half_area() const {
    if (empty()) return 0.0;
    const glm::dvec3 e = extent();
    return e.x * e.y + e.y * e.z + e.z * e.x;
  }
};

struct Triangle {
  std::array<glm::dvec3, 3> vertices;  ///< in file order
  std::uint32_t id;                    ///< what a hit reports; the lowest wins on equal t
  Box box() const {
    Box b;
    for (const auto& v : vertices) b.add(v);
    return b;
  }
};

/// What structures are built over.
struct TriangleSet {
  std::vector<Triangle> triangles;
  Box box;  ///< root box; rays are clipped to it, hits outside it do not exist
};

/// The snapped scene, exactly.
TriangleSet from_grid(const GridScene& scene);
/// Any triangles: the root box is theirs, padded as the memory image pads it.
TriangleSet make_triangle_set(std::vector<Triangle> triangles);

struct Ray {
  glm::dvec3 origin{0.0}, direction{0.0, 0.0, 1.0};
  double t_max = kInfinity;  ///< hits with 0 <= t <= t_max count
  bool any = false;          ///< occlusion: stop at the first accepted hit, whichever it is
};

/// The quantised ray, exactly.
inline Ray from_grid(const GridRay& ray) {
  Ray r;
  for (int a = 0; a < 3; ++a) {
    r.origin[a] = ray.record.origin[a] * 0x1p-24;
    r.direction[a] = ray.record.direction[a] * 0x1p-26;
  }
  r.t_max = ray.record.t_max * 0x1p-24;
  r.any = ray.record.any != 0;
  return r;
}

struct Hit {
  double t = kInfinity;
  std::uint32_t id = contract::kNoTriangle;
  double u = 0.0, v = 0.0;  ///< weights of the second and third vertex, in file order
  bool hit() const { return id != contract::kNoTriangle; }
  friend bool operator==(const Hit&, const Hit&) = default;
};

/// Work, summed over rays.
struct Work {
  std::uint64_t down = 0;      ///< interior nodes entered on the way down; grid: 0
  std::uint64_t up = 0;        ///< nodes visited on the way up
  std::uint64_t leaf = 0;      ///< leaves or voxels entered, empty ones too
  std::uint64_t volumes = 0;   ///< boxes or slab sets tested (BVH, kd-backtrack with boxes)
  std::uint64_t restarts = 0;  ///< walks begun anew at the root or at the restart node
  std::uint64_t tests = 0;     ///< triangle tests carried out
  std::uint64_t skipped = 0;   ///< tests that the mailbox saved
  std::uint64_t bytes = 0;     ///< bytes asked of memory, before any cache

  std::uint64_t visits() const { return down + up + leaf; }
  Work& operator+=(const Work& w) {
    down += w.down, up += w.up, leaf += w.leaf, volumes += w.volumes, restarts += w.restarts, tests += w.tests;
    skipped += w.skipped, bytes += w.bytes;
    return *this;
  }
  friend bool operator==(const Work&, const Work&) = default;
};

/// Bytes of a structure in the form a hardware design would hold: 4 bytes a coordinate, index or pointer; triangle
/// records of the project (64 bytes apart, 48 read). The layout of each structure is in its file.
struct Footprint {
  std::uint64_t nodes = 0, leaves = 0, references = 0, triangles = 0;
  std::uint64_t total() const { return nodes + leaves + references + triangles; }
};

class Probe;

class Structure {
 public:
  virtual ~Structure() = default;
  virtual Footprint footprint() const = 0;
  /// Nearest hit, or with ray.any the first one found. Thread-safe; `probe` belongs to one thread and counts the work.
  virtual Hit trace(const Ray& ray, Probe& probe) const = 0;
  /// Whether triangles stand in several cells, so that a mailbox has something to save.
  virtual bool duplicates_references() const { return false; }
  /// Number of triangles, the range of Probe's mailbox.
  virtual std::size_t size() const = 0;
  /// Number of references to them, over all cells.
  virtual std::size_t references() const { return size(); }
};

}  // namespace retrace::accel
