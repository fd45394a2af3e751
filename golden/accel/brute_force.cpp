// Brute force: the triangle test on every triangle, in ascending order. The reference of every other structure.
#include "probe.hpp"
#include "structures.hpp"

namespace retrace::accel {
namespace {

class BruteForce final : public Structure {
 public:
  explicit BruteForce(const TriangleSet& set) : set_(set) {}
  Footprint footprint() const override { return {.triangles = set_.triangles.size() * Probe::kTriangleStride}; }
  std::size_t size() const override { return set_.triangles.size(); }
  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Hit best = no_hit(ray);
    for (std::uint32_t i = 0; i < set_.triangles.size(); ++i) {
      if (probe.test(ray, set_.triangles[i], i, std::uint64_t{i} * Probe::kTriangleStride, best) && ray.any) break;
    }
    return finished(best);
  }

 private:
  const TriangleSet& set_;
};

}  // namespace

std::unique_ptr<Structure> make_brute_force(const TriangleSet& set) { return std::make_unique<BruteForce>(set); }

}  // namespace retrace::accel
