// Classes of agreement, see compare.hpp. Signs and the numerators and denominators of t are exact (exact.hpp).
#include "compare.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "golden/engine/exact.hpp"
#include "golden/engine/instance_ray.hpp"
#include "golden/engine/stages/instance_enter.hpp"

namespace retrace {
namespace {

using exact::Vec;
using Real = std::array<double, 3>;

double dot(const Real& a, const Real& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Real to_real(const Vec& a) { return {double(a[0]), double(a[1]), double(a[2])}; }

constexpr double kPositionUlp = 0x1p-24, kDirectionUlp = 0x1p-26;
static_assert(contract::kPositionFrac == 24 && contract::kDirectionFrac == 26 && contract::kTLimitFrac == 24);

bool valid(const Hit& hit) { return hit.status == contract::kStatusHit || hit.status == contract::kStatusMiss; }
double t_limit(const contract::RayRecord& ray) { return ray.t_max * kPositionUlp; }

using Judged = Comparator::Judged;

Judged judge(const ExactIntersection& exact) {
  Judged j;
  j.exact = exact;
  j.bound = exact.parallel ? INFINITY : depth_bound(exact.dz);
  j.grazing = exact.dz < kGrazing;
  return j;
}

/// A ray of an instance's object.
struct ObjectRay {
  contract::InstanceEnterOutRecord entry;
  contract::RayRecord ray;
  double widening = 1.0;
  bool enters() const { return entry.enters != 0; }
};

ObjectRay enter(const contract::InstanceRecord& instance, const contract::RayRecord& ray) {
  ObjectRay result;
  result.entry = golden::instance_enter(instance_enter_in(instance, ray, ray.t_max + 1));
  result.ray = object_ray(result.entry);
  const Real d = to_real(exact::to_vec(result.ray.direction));
  result.widening = 1.0 / (std::sqrt(dot(d, d)) * kDirectionUlp);
  return result;
}

/// A triangle of an instance's object; t and its bound in the world.
Judged judge_in(const ObjectRay& object, const GridTriangle& triangle) {
  Judged j;
  j.exact = intersect_exactly(object.ray, triangle, object.widening);
  j.grazing = j.exact.dz * object.widening < kGrazing;
  j.bound = INFINITY;
  if (j.exact.parallel) return j;
  j.bound = std::ldexp(object_depth_bound(j.exact.dz), -static_cast<int>(object.entry.scale)) + kDepthFloor;
  j.exact.t = world_t(j.exact.t, object.entry);
  return j;
}

Verdict agree(Agreement agreement) {
  Verdict verdict;
  verdict.agreement = agreement;
  return verdict;
}

Verdict violation(const char* reason) {
  Verdict verdict = agree(Agreement::kViolation);
  verdict.reason = reason;
  return verdict;
}

}  // namespace

const char* to_string(Agreement agreement) {
  switch (agreement) {
    case Agreement::kSame:
      return "same";
    case Agreement::kEdge:
      return "edge";
    case Agreement::kDepth:
      return "depth";
    default:
      return "violation";
  }
}

ExactIntersection intersect_exactly(const contract::RayRecord& ray, const GridTriangle& triangle, double widening) {
  const std::array<Vec, 3> vertices{exact::to_vec(triangle.vertices[0]), exact::to_vec(triangle.vertices[1]),
                                    exact::to_vec(triangle.vertices[2])};
  const exact::Crossing crossing = exact::intersect(ray, vertices);

  ExactIntersection result;
  result.parallel = crossing.parallel();
  result.inside = crossing.inside();
  if (!result.parallel) {
    const Real n = to_real(crossing.normal);
    result.t = crossing.t();
    result.dz = static_cast<double>(crossing.dn) * kDirectionUlp / std::sqrt(dot(n, n));
  }
  // An edge's volume is |edge| |d . normal| times the distance from the edge in the plane, so that over |edge| |d| it is foreshortened.
  const Real dr = to_real(exact::to_vec(ray.direction));
  double length2[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const Real r = to_real(exact::difference(vertices[(k + 1) % 3], vertices[k]));
    length2[k] = dot(r, r);  // below 2^53: exact
  }
  const double longest = std::max({length2[0], length2[1], length2[2]}), d2 = dot(dr, dr);
  result.outside = -std::numeric_limits<double>::infinity();
  bool within = true, close = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const double unit = kPositionUlp / (std::sqrt(length2[k] * d2) * widening);
    const double inside = static_cast<double>(crossing.edge[k]) * unit;
    const bool is_longest = length2[k] == longest;
    const double band = is_longest ? kLongestEdgeBand : kEdgeBand;
    // Beyond the opposite vertex: |d . n| is the volume at that vertex. The test bounds it for the two shorter edges.
    const double beyond = is_longest ? -inside : inside - static_cast<double>(crossing.dn) * unit;
    result.outside = std::max({result.outside, -inside, beyond});
    within = within && -inside <= band && beyond <= band;
    close = close || inside <= band;
  }
  result.in_band = !result.parallel && within && close;
  return result;
}

Comparator::Comparator(const GridScene& scene) : scene_(scene) {}

Judged Comparator::judge_report(const contract::RayRecord& ray, const Hit& hit, double t_max) const {
  const auto placed = find_placed(scene_, hit.id);
  Judged j;
  if (!placed) {
    j.wrong = "the reported triangle does not exist";
    return j;
  }
  if (placed->instance) {
    const ObjectRay object = enter(scene_.instances[*placed->instance].record, ray);
    if (!object.enters()) {
      j.wrong = "the ray passes by the instance of the reported triangle";
      return j;
    }
    j = judge_in(object, *placed->triangle);
  } else {
    j = judge(intersect_exactly(ray, *placed->triangle));
  }
  if (j.exact.parallel) {
    j.wrong = "the reported triangle is parallel to the ray";
  } else if (!j.exact.inside && !j.exact.in_band) {
    j.wrong = "the ray passes outside the reported triangle";
  } else if (!(std::fabs(hit.t - j.exact.t) <= j.bound)) {
    j.wrong = "t is beyond the depth bound";
  } else if (!(hit.t >= -j.bound && hit.t <= t_max + j.bound)) {
    j.wrong = "t is outside the ray";
  }
  return j;
}

namespace {

/// Calls `meets` with the triangles that the line of the ray may meet, until it says true.
template <typename Meets>
bool any_met(const std::vector<GridTriangle>& triangles, const contract::RayRecord& ray, Meets meets) {
  const Real d{double(ray.direction[0]), double(ray.direction[1]), double(ray.direction[2])};
  const Real o{double(ray.origin[0]), double(ray.origin[1]), double(ray.origin[2])};
  // Rounding error of an edge function in double is below 2^80 * 2^-49.
  constexpr double kError = 0x1p31;
  for (const GridTriangle& triangle : triangles) {
    Real p[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = {triangle.vertices[i].x - o[0], triangle.vertices[i].y - o[1], triangle.vertices[i].z - o[2]};
    }
    bool positive = false, negative = false;
    for (int i = 0; i < 3; ++i) {
      const Real &a = p[i], &b = p[(i + 1) % 3];
      const double e =
          d[0] * (a[1] * b[2] - a[2] * b[1]) + d[1] * (a[2] * b[0] - a[0] * b[2]) + d[2] * (a[0] * b[1] - a[1] * b[0]);
      positive = positive || e > kError;
      negative = negative || e < -kError;
    }
    if (positive && negative) continue;
    if (meets(triangle)) return true;
  }
  return false;
}

}  // namespace

bool Comparator::solid_in_front(const contract::RayRecord& ray, double t, double bound) const {
  const auto in_front = [&](const Judged& j) {
    return j.solid() && j.exact.t > j.bound && j.exact.t < t - bound - j.bound;
  };
  if (any_met(scene_.triangles, ray,
              [&](const GridTriangle& triangle) { return in_front(judge(intersect_exactly(ray, triangle))); }))
    return true;
  return std::any_of(scene_.instances.begin(), scene_.instances.end(), [&](const GridInstance& instance) {
    const ObjectRay object = enter(instance.record, ray);
    return object.enters() &&
           any_met(scene_.objects[instance.record.root].triangles, object.ray,
                   [&](const GridTriangle& triangle) { return in_front(judge_in(object, triangle)); });
  });
}

Verdict Comparator::compare(const GridRay& ray, const Hit& golden, const Hit& fixed) const {
  if (!valid(golden) || !valid(fixed)) {
    if (golden.status == fixed.status) return {};
    return violation("one engine ended with an error status");
  }
  if (!golden.hit() && !fixed.hit()) return {};
  if (ray.outside) return violation("a ray outside the root box was hit");
  const double t_max = t_limit(ray.record);
  Judged g, f;
  if (golden.hit()) g = judge_report(ray.record, golden, t_max);
  if (fixed.hit()) f = judge_report(ray.record, fixed, t_max);
  Verdict verdict;
  if (g.wrong || f.wrong) {
    verdict = violation(g.wrong ? g.wrong : f.wrong);
  } else if (ray.record.any != 0) {
    if (golden.hit() != fixed.hit()) verdict = any(ray.record, golden.hit() ? g : f, golden.hit());
    verdict.lost = !fixed.hit() && g.exact.inside && g.within(t_max);
  } else if (!golden.hit() || !fixed.hit() || golden.id != fixed.id) {
    verdict = closest(ray.record, golden.hit() ? &g : nullptr, fixed.hit() ? &f : nullptr);
    verdict.lost =
        golden.hit() && g.exact.inside && (fixed.hit() ? g.exact.t < f.exact.t - g.bound - f.bound : g.within(t_max));
  }
  verdict.grazing = g.grazing || f.grazing;
  if (fixed.hit() && !f.exact.inside) verdict.outside = f.exact.outside;
  return verdict;
}

Verdict Comparator::closest(const contract::RayRecord& ray, const Judged* g, const Judged* f) const {
  const double t_max = t_limit(ray);
  const bool near_in_depth =
      g && f ? std::fabs(g->exact.t - f->exact.t) <= g->bound + f->bound : !(g ? g : f)->within(t_max);
  if (!f || (g && g->exact.t <= f->exact.t)) {  // the fixed-point engine overlooked golden's triangle
    if (g->exact.in_band) {
      if (solid_in_front(ray, f ? f->exact.t : t_max, f ? f->bound : 0.0))
        return violation("a triangle in front was overlooked");
      return agree(Agreement::kEdge);
    }
    if (near_in_depth) return agree(f && f->exact.in_band ? Agreement::kEdge : Agreement::kDepth);
    return violation("golden's triangle was overlooked");
  }
  // The fixed-point engine's triangle lies in front of golden's, or golden has none.
  if (f->exact.in_band) return agree(Agreement::kEdge);
  if (near_in_depth) return agree(Agreement::kDepth);
  return violation("golden overlooked a triangle");
}

Verdict Comparator::any(const contract::RayRecord& ray, const Judged& only, bool golden) const {
  const double t_max = t_limit(ray);
  if (only.solid() && only.within(t_max))
    return violation(golden ? "an occluder was overlooked" : "golden overlooked an occluder");
  if (solid_in_front(ray, t_max, 0.0)) return violation("an occluder was overlooked");
  return agree(only.exact.in_band ? Agreement::kEdge : Agreement::kDepth);
}

Verdict Comparator::identical(const Hit& a, const Hit& b) {
  if (a.status != b.status) return violation("status differs");
  if (!a.hit()) return {};
  if (a.id != b.id) return violation("triangle differs");
  if (a.t != b.t) return violation("t differs");
  if (a.u != b.u || a.v != b.v) return violation("u or v differs");
  return {};
}

void AgreementCounts::add(const Verdict& verdict, bool hit_a, bool hit_b) {
  ++total[static_cast<int>(verdict.agreement)];
  if (verdict.grazing) ++grazing[static_cast<int>(verdict.agreement)];
  if (verdict.lost) ++lost;
  if (verdict.outside > 0) {
    ++false_hits;
    if (verdict.outside > kEdgeBand) ++beyond_band;
    farthest = std::max(farthest, verdict.outside);
  }
  ++(hit_a ? (hit_b ? both_hit : only_a) : (hit_b ? only_b : both_miss));
}

AgreementCounts& AgreementCounts::operator+=(const AgreementCounts& other) {
  for (std::size_t i = 0; i < total.size(); ++i) {
    total[i] += other.total[i];
    grazing[i] += other.grazing[i];
  }
  lost += other.lost;
  false_hits += other.false_hits;
  beyond_band += other.beyond_band;
  farthest = std::max(farthest, other.farthest);
  both_hit += other.both_hit;
  both_miss += other.both_miss;
  only_a += other.only_a;
  only_b += other.only_b;
  return *this;
}

}  // namespace retrace
