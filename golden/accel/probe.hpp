// What watches a traversal: work counters, the mailbox, and the log of memory accesses that feeds the cache model.
// One per thread. Structures call enter/touch/test; they know nothing of what is switched on.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "accel.hpp"
#include "triangle_test.hpp"

namespace retrace::accel {

/// Mailbox (Arnaldi et al. 1987; Amanatides & Woo 1987): what a ray has already tested it does not test again.
/// `entries` < 0: exact, one stamp a triangle; 0: none; 2..64: a direct-mapped table per ray, indexed by a hash of the
/// triangle's number, which is what a hardware context can afford.
class Mailbox {
 public:
  static constexpr int kExact = -1;
  Mailbox() = default;
  Mailbox(int entries, std::size_t triangles);
  void begin_ray() {
    ++ray_;
    if (entries_ > 0) table_.fill(contract::kNoTriangle);
  }
  /// True if the triangle was tested before and the mailbox still knows; otherwise enters it.
  bool seen(std::uint32_t triangle) {
    if (entries_ == 0) return false;
    std::uint32_t& slot = entries_ < 0 ? stamps_[triangle] : table_[fold(triangle) & mask_];
    const std::uint32_t mark = entries_ < 0 ? ray_ : triangle;
    if (slot == mark) return true;
    slot = mark;
    return false;
  }

 private:
  /// Exclusive or of 6-bit groups: three gates deep. Plain low bits alias where a mesh has rows of a power of two.
  static std::uint32_t fold(std::uint32_t x) { return x ^ x >> 6 ^ x >> 12 ^ x >> 18; }

  int entries_ = 0;
  std::uint32_t mask_ = 0, ray_ = 0;
  std::array<std::uint32_t, 64> table_{};
  std::vector<std::uint32_t> stamps_;
};

/// Lines (64 bytes) that rays touch, ray by ray. Consecutive touches of one line by one ray are kept: they are
/// accesses.
class AccessLog {
 public:
  static constexpr int kLineShift = 6;
  void begin_ray() { starts_.push_back(lines_.size()); }
  void add(std::uint64_t address, std::uint32_t bytes) {
    for (std::uint64_t line = address >> kLineShift; line <= (address + bytes - 1) >> kLineShift; ++line)
      lines_.push_back(static_cast<std::uint32_t>(line));
  }
  std::size_t rays() const { return starts_.size(); }
  std::span<const std::uint32_t> ray(std::size_t i) const {
    const std::size_t end = i + 1 < starts_.size() ? starts_[i + 1] : lines_.size();
    return std::span(lines_).subspan(starts_[i], end - starts_[i]);
  }
  void clear() { starts_.clear(), lines_.clear(); }

 private:
  std::vector<std::size_t> starts_;
  std::vector<std::uint32_t> lines_;
};

class Probe {
 public:
  explicit Probe(Mailbox mailbox = {}, AccessLog* log = nullptr) : mailbox_(std::move(mailbox)), log_(log) {}

  void begin_ray() {
    mailbox_.begin_ray();
    if (log_ && !nested_) log_->begin_ray();
  }
  /// While true, begin_ray() is that of an object inside a scene: the mailbox forgets, the ray is still the same.
  void nest(bool nested) { nested_ = nested; }
  void touch(std::uint64_t address, std::uint32_t bytes) {
    work.bytes += bytes;
    if (log_) log_->add(address, bytes);
  }
  /// Tests triangle number `index` of the set; its record starts at `address`. True if it became the best hit.
  bool test(const Ray& ray, const Triangle& triangle, std::uint32_t index, std::uint64_t address, Hit& best) {
    if (mailbox_.seen(index)) {
      ++work.skipped;
      return false;
    }
    touch(address, kTriangleBytes);
    ++work.tests;
    return intersect(ray, triangle, best);
  }

  static constexpr std::uint32_t kTriangleBytes = 48, kTriangleStride = 64;
  Work work;

 private:
  Mailbox mailbox_;
  AccessLog* log_ = nullptr;
  bool nested_ = false;
};

/// Ray clipped to a box: reciprocals and the interval inside. `ok` is false if the ray misses the box.
struct ClippedRay {
  glm::dvec3 inverse;  ///< 1 / direction; infinite where the direction is zero, which no traversal multiplies by
  double t_min = 0.0, t_max = kInfinity;
  bool ok = true;
  ClippedRay(const Ray& ray, const Box& box);
};

/// Best hit to start with: nothing found yet, and nothing beyond t_max.
inline Hit no_hit(const Ray& ray) { return {ray.t_max, contract::kNoTriangle, 0.0, 0.0}; }
/// What a traversal returns: a miss has t infinite.
inline Hit finished(const Hit& best) { return best.hit() ? best : Hit{}; }

}  // namespace retrace::accel
