// What it means that two engines agree on a ray: the classes of `retrace compare`.
//
// Golden (double) against a fixed-point engine, both on the same snapped triangles and the same quantised ray. Whether a ray truly hits
// a triangle, and where, is decided here with exact integers (products of 27-bit codes, 128 bits), not by either engine.
//   same       both miss, or both hit the same triangle and each t is within the depth bound of the exact one
//   edge       the hits differ, and the ray passes within the edge band of an edge of every triangle on which an engine is wrong
//   depth      the hits differ, and their t lie closer together than the two depth bounds (or closer to 0 or t_max than one)
//   violation  anything else, also an engine's error status
// Two fixed-point engines must agree bit for bit: `same` or `violation`.
// Grazing hits (|d'z| < kGrazing) are counted apart within their class; they have no excuse of their own.
//
// In a scene of two levels, "exactly" means the ray of an instance's object: it is rounded once, by instance_enter, from ray and instance alone, and
// is exact from there on. Its direction is as short as 1/2, so bands widen by what it lacks; depth bounds are those of docs/error-bounds.md,
// "instance_enter", brought to the world. The rounding itself is held against reals by instance_enter_test.
//
// How far outside an edge a ray passes is measured from the line of the edge, in the plane of the triangle and foreshortened by the angle
// of incidence: the measure in which the test's error is bounded (docs/error-bounds.md, "False hits").
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "golden/contract/certified_bounds.hpp"
#include "golden/engine/engine.hpp"

namespace retrace {

/// Edge band: how far outside an edge, or beyond the vertex opposite to it, an accepted hit may pass, grid units. For two of the edges the
/// certified bound is below 2^-20. For the longest one it is above, so that edge has a band of its own.
inline constexpr double kEdgeBand = 0x1p-20;
inline constexpr double kLongestEdgeBand = certified::kFalseW;
static_assert(certified::kFalseUv <= kEdgeBand && certified::kFalseTop <= kEdgeBand);
/// Depth bound of a fixed-point hit: |t - exact t| <= kDepthNumerator / |d'z| + kDepthFloor, d'z the direction along the unit normal.
inline constexpr double kDepthNumerator =
    certified::kDepthExact > certified::kDepthComputed ? certified::kDepthExact : certified::kDepthComputed;
inline constexpr double kDepthFloor = 0x1p-24;
/// Below this |d'z| a hit counts as grazing.
inline constexpr double kGrazing = 0x1p-10;

/// The same in an object of a scene of two levels, in its units, of the exact d'z: the certified bound is one of the computed d'z.
inline double object_depth_bound(double dz) {
  const double computed = (dz < 0 ? -dz : dz) - certified::kRowDirection;
  return (computed > 0 ? certified::kInstanceDepth / computed : 1e300) + kDepthFloor;
}

inline double depth_bound(double dz) { return kDepthNumerator / (dz < 0 ? -dz : dz) + kDepthFloor; }

enum class Agreement : std::uint8_t { kSame, kEdge, kDepth, kViolation };
const char* to_string(Agreement agreement);

struct Verdict {
  Agreement agreement = Agreement::kSame;
  bool grazing = false;     ///< one of the hits is grazing
  const char* reason = "";  ///< of a violation
  bool lost = false;        ///< the fixed-point engine overlooked an exact hit in front of its own
  double outside = 0.0;     ///< of a false hit: how far outside its triangle
};

/// A ray against one triangle, exactly: the signs are those of integers, t is rounded once.
struct ExactIntersection {
  bool inside = false;    ///< the line meets the closed triangle (edges included) at one point
  bool parallel = false;  ///< the line is parallel to the plane: no t
  double t = 0.0;         ///< along the quantised direction, grid units; of the plane, whether inside or not
  double dz = 0.0;        ///< direction along the unit normal, absolute
  double outside =
      0.0;  ///< how far outside the worst edge (or beyond a vertex) the line passes, foreshortened; negative: inside
  bool in_band = false;  ///< outside by no more than the bands, or inside but as close to some edge as its band
};
/// `widening`: of the bands, for a direction shorter than 1; `outside` is given in units of it.
ExactIntersection intersect_exactly(const contract::RayRecord& ray, const GridTriangle& triangle,
                                    double widening = 1.0);

/// Classifies pairs of hits over one scene. Thread-safe.
class Comparator {
 public:
  explicit Comparator(const GridScene& scene);

  /// Golden against a fixed-point engine, closest hit or any hit as the ray's record says.
  Verdict compare(const GridRay& ray, const Hit& golden, const Hit& fixed) const;
  /// Two fixed-point engines: bit for bit.
  static Verdict identical(const Hit& a, const Hit& b);

  /// A hit as an engine reported it, seen exactly.
  struct Judged {
    ExactIntersection exact;
    double bound = 0;  ///< depth bound
    bool grazing = false;
    const char* wrong = nullptr;  ///< why the report cannot be right
    bool solid() const { return exact.inside && !exact.in_band; }
    /// t is clear of both ends of the ray by more than the bound.
    bool within(double t_max) const { return exact.t > bound && exact.t < t_max - bound; }
  };

 private:
  /// The hits differ; null: a miss.
  Verdict closest(const contract::RayRecord& ray, const Judged* golden, const Judged* fixed) const;
  /// Only one engine, golden or the other, found an occluder.
  Verdict any(const contract::RayRecord& ray, const Judged& only, bool golden) const;
  /// Whether a triangle lies in front of `t` by more than the bounds, well inside its edges, so that no engine may overlook it.
  bool solid_in_front(const contract::RayRecord& ray, double t, double bound) const;
  Judged judge_report(const contract::RayRecord& ray, const Hit& hit, double t_max) const;

  const GridScene& scene_;
};

/// Counts of verdicts.
struct AgreementCounts {
  std::array<std::uint64_t, 4> total{}, grazing{};
  std::uint64_t both_hit = 0, both_miss = 0, only_a = 0, only_b = 0;
  std::uint64_t lost = 0;         ///< exact hits that the fixed-point engine overlooked
  std::uint64_t false_hits = 0;   ///< hits outside their triangle
  std::uint64_t beyond_band = 0;  ///< of these, how many by more than kEdgeBand
  double farthest = 0;            ///< largest distance outside, grid units

  void add(const Verdict& verdict, bool hit_a, bool hit_b);
  AgreementCounts& operator+=(const AgreementCounts& other);
  std::uint64_t violations() const { return total[static_cast<int>(Agreement::kViolation)]; }
  std::uint64_t rays() const { return both_hit + both_miss + only_a + only_b; }
};

}  // namespace retrace
