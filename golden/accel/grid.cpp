// Uniform grid with the 3D-DDA of Amanatides & Woo (A fast voxel traversal algorithm for ray tracing, Eurographics
// 1987). Resolution either after Woo (Ray tracing polygons using spatial subdivision, Graphics Interface 1992:
// subdivide until a voxel holds about 20) or after Pharr & Humphreys (Physically Based Rendering, 1st ed., section 4.3:
// 3 cbrt(N) along the longest side).
//
// A triangle is referenced from every voxel whose box, widened by kMargin, it touches (separating axes:
// Akenine-Moeller, JGT 2001), or, as in the book, from every voxel that its bounding box touches.
//
// A hit beyond the voxel is kept and the walk goes on: it ends in the voxel that contains the best hit, so nothing
// nearer is missed, and a mailbox may drop the second test.
//
// Budget: at most kVoxels voxels and kReferences references a triangle, which no mesh needs. After Woo, voxels are
// halved while that lowers the number of triangles in an occupied one: coincident triangles never part. After Pharr &
// Humphreys, the resolution is halved until the references fit: a bounding box may cover all voxels.
//
// Layout for bytes: one 4-byte offset a voxel (two are read: begin and end), 4 bytes a reference.
#include <algorithm>
#include <cmath>

#include "probe.hpp"
#include "structures.hpp"

namespace retrace::accel {
namespace {

constexpr double kWooDensity = 20.0;
constexpr int kMaxResolution = 1024;  // a side
constexpr double kMaxVoxels = 64e6;   // 256 MB of offsets
constexpr double kVoxels = 64;        // a triangle
constexpr std::uint64_t kReferences = 16;

/// Separating-axis test of a triangle against a box given by centre and half extents.
bool overlaps(const Triangle& triangle, const glm::dvec3& center, const glm::dvec3& half) {
  const glm::dvec3 v[3] = {triangle.vertices[0] - center, triangle.vertices[1] - center, triangle.vertices[2] - center};
  for (int a = 0; a < 3; ++a) {
    if (std::min({v[0][a], v[1][a], v[2][a]}) > half[a] || std::max({v[0][a], v[1][a], v[2][a]}) < -half[a])
      return false;
  }
  const glm::dvec3 edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const glm::dvec3 n = glm::cross(edges[0], edges[1]);
  if (std::abs(glm::dot(n, v[0])) > glm::dot(half, glm::abs(n)) * (1.0 + 1e-12)) return false;
  for (const glm::dvec3& e : edges) {
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 axis(0.0);
      axis[(a + 1) % 3] = -e[(a + 2) % 3];
      axis[(a + 2) % 3] = e[(a + 1) % 3];
      const double p0 = glm::dot(axis, v[0]), p1 = glm::dot(axis, v[1]), p2 = glm::dot(axis, v[2]);
      const double r = glm::dot(half, glm::abs(axis)) * (1.0 + 1e-12);
      if (std::min({p0, p1, p2}) > r || std::max({p0, p1, p2}) < -r) return false;
    }
  }
  return true;
}

class Grid final : public Structure {
 public:
  Grid(const TriangleSet& set, GridDensity density) : set_(set), by_box_(density == GridDensity::kPharr) {
    const glm::dvec3 extent = set.box.extent();
    const double longest = std::max({extent.x, extent.y, extent.z});
    if (density != GridDensity::kWoo) {
      const double per_unit =
          3.0 * std::cbrt(static_cast<double>(std::max<std::size_t>(set.triangles.size(), 1))) / longest;
      for (int a = 0; a < 3; ++a)
        n_[a] = std::clamp(static_cast<int>(std::lround(extent[a] * per_unit)), 1, kMaxResolution);
      while (!fill()) n_ = glm::max(n_ / 2, glm::ivec3(1));
    } else {
      const double most_voxels =
          std::min(kMaxVoxels, kVoxels * static_cast<double>(std::max<std::size_t>(set.triangles.size(), 1)));
      n_ = glm::ivec3(1);
      fill();
      double mean = mean_occupied(), least = mean;
      glm::ivec3 best = n_;
      while (mean > kWooDensity && (n_.x + 0.0) * n_.y * n_.z * 2.0 <= most_voxels) {
        const glm::dvec3 side = extent / glm::dvec3(n_);
        const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
        if (n_[axis] * 2 > kMaxResolution) break;
        n_[axis] *= 2;
        if (!fill()) break;
        mean = mean_occupied();
        if (mean < least) least = mean, best = n_;
      }
      if (best != n_) {
        n_ = best;
        fill();
      }
    }
  }

  /// Of that resolution, or of less where its references are too many.
  Grid(const TriangleSet& set, const glm::ivec3& resolution) : set_(set), by_box_(false), n_(resolution) {
    while (!fill()) n_ = glm::max(n_ / 2, glm::ivec3(1));
  }

  const glm::ivec3& resolution() const { return n_; }
  VoxelLists take_lists() && { return {n_, std::move(offsets_), std::move(references_)}; }

  const BuildSteps& steps() const { return steps_; }
  bool duplicates_references() const override { return true; }
  std::size_t size() const override { return set_.triangles.size(); }
  std::size_t references() const override { return references_.size(); }
  Footprint footprint() const override {
    return {.nodes = offsets_.size() * 4,
            .references = references_.size() * 4,
            .triangles = set_.triangles.size() * Probe::kTriangleStride};
  }

  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Hit best = no_hit(ray);
    const ClippedRay clip(ray, set_.box);
    if (!clip.ok) return Hit{};
    const std::uint64_t reference_base = offsets_.size() * 4,
                        triangle_base = align(reference_base + references_.size() * 4);
    glm::ivec3 cell, step, stop;
    glm::dvec3 next, delta;
    for (int a = 0; a < 3; ++a) {
      const double x = ray.origin[a] + clip.t_min * ray.direction[a];
      cell[a] = std::clamp(static_cast<int>((x - set_.box.lower[a]) / side_[a]), 0, n_[a] - 1);
      const bool forward = ray.direction[a] > 0.0;
      step[a] = forward ? 1 : -1;
      stop[a] = forward ? n_[a] : -1;
      if (ray.direction[a] == 0.0) {
        next[a] = delta[a] = kInfinity;
      } else {
        next[a] = (set_.box.lower[a] + (cell[a] + (forward ? 1 : 0)) * side_[a] - ray.origin[a]) * clip.inverse[a];
        delta[a] = side_[a] * std::abs(clip.inverse[a]);
      }
    }
    for (;;) {
      ++probe.work.leaf;
      const std::size_t index = voxel(cell);
      probe.touch(index * 4, 8);
      for (std::uint32_t r = offsets_[index]; r < offsets_[index + 1]; ++r) {
        probe.touch(reference_base + r * 4ull, 4);
        const std::uint32_t i = references_[r];
        if (probe.test(ray, set_.triangles[i], i, triangle_base + i * std::uint64_t{Probe::kTriangleStride}, best) &&
            ray.any)
          return best;
      }
      const int axis = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
      if (best.t <= next[axis]) break;
      cell[axis] += step[axis];
      if (cell[axis] == stop[axis] || !(next[axis] < kInfinity)) break;
      next[axis] += delta[axis];
    }
    return finished(best);
  }

 private:
  static std::uint64_t align(std::uint64_t x) { return (x + 63) & ~std::uint64_t{63}; }
  std::size_t voxel(const glm::ivec3& c) const { return (static_cast<std::size_t>(c.z) * n_.y + c.y) * n_.x + c.x; }

  double mean_occupied() const {
    std::size_t occupied = 0;
    for (std::size_t i = 0; i + 1 < offsets_.size(); ++i) occupied += offsets_[i + 1] > offsets_[i];
    return occupied ? static_cast<double>(references_.size()) / static_cast<double>(occupied) : 0.0;
  }

  /// Calls f(voxel) until it returns false; false if it did.
  template <class F>
  bool for_each_voxel(const Triangle& triangle, F&& f) {
    const Box b = triangle.box();
    glm::ivec3 lo, hi;
    for (int a = 0; a < 3; ++a) {
      lo[a] =
          std::clamp(static_cast<int>(std::floor((b.lower[a] - kMargin - set_.box.lower[a]) / side_[a])), 0, n_[a] - 1);
      hi[a] =
          std::clamp(static_cast<int>(std::floor((b.upper[a] + kMargin - set_.box.lower[a]) / side_[a])), 0, n_[a] - 1);
    }
    return for_each_in(triangle, lo, hi, f);
  }

  /// Halves the range of voxels where the triangle touches it: a thin triangle across the scene touches few voxels of
  /// the many in its box.
  template <class F>
  bool for_each_in(const Triangle& triangle, const glm::ivec3& lo, const glm::ivec3& hi, F&& f) {
    ++steps_.steps;
    const glm::dvec3 half = 0.5 * side_ * glm::dvec3(hi - lo + 1) + kMargin;
    if (!by_box_ && !overlaps(triangle, set_.box.lower + 0.5 * side_ * glm::dvec3(lo + hi + 1), half)) return true;
    const glm::ivec3 n = hi - lo;
    if (n == glm::ivec3(0)) return f(voxel(lo));
    const int axis = n.x >= n.y && n.x >= n.z ? 0 : n.y >= n.z ? 1 : 2;
    glm::ivec3 low_end = hi, high_begin = lo;
    low_end[axis] = lo[axis] + n[axis] / 2;
    high_begin[axis] = low_end[axis] + 1;
    return for_each_in(triangle, lo, low_end, f) && for_each_in(triangle, high_begin, hi, f);
  }

  /// Fills the voxels at the resolution n_. False, with the grid left unusable, if that takes too many references.
  bool fill() {
    side_ = set_.box.extent() / glm::dvec3(n_);
    const std::size_t voxels = static_cast<std::size_t>(n_.x) * n_.y * n_.z;
    offsets_.assign(voxels + 1, 0);
    // Offsets have 32 bits.
    std::uint64_t left = std::min<std::uint64_t>(kReferences * set_.triangles.size(), contract::kNoTriangle - 1);
    for (const Triangle& t : set_.triangles) {
      const bool fits = for_each_voxel(t, [&](std::size_t v) {
        ++offsets_[v + 1];
        return left-- > 0;
      });
      if (!fits) return false;
    }
    for (std::size_t v = 0; v < voxels; ++v) offsets_[v + 1] += offsets_[v];
    references_.resize(offsets_[voxels]);
    std::vector<std::uint32_t> at(offsets_.begin(), offsets_.end() - 1);
    for (std::uint32_t i = 0; i < set_.triangles.size(); ++i)
      for_each_voxel(set_.triangles[i], [&](std::size_t v) {
        references_[at[v]++] = i;
        return true;
      });
    return true;
  }

  const TriangleSet& set_;
  bool by_box_;
  BuildSteps steps_;  ///< of the build
  glm::ivec3 n_{1};
  glm::dvec3 side_{1.0};
  std::vector<std::uint32_t> offsets_, references_;
};

}  // namespace

std::unique_ptr<Structure> make_grid(const TriangleSet& set, GridDensity density, BuildSteps* steps) {
  auto grid = std::make_unique<Grid>(set, density);
  if (steps) *steps = grid->steps();
  return grid;
}

glm::ivec3 grid_resolution(const TriangleSet& set) { return Grid(set, GridDensity::kPharrExact).resolution(); }

VoxelLists list_voxels(const TriangleSet& set, const glm::ivec3& resolution) {
  return Grid(set, resolution).take_lists();
}

}  // namespace retrace::accel
