// A ray against a triangle in integers: signs, inside, and the order of two hits, without rounding.
//
// With o, d the codes of the ray, a, b, c those of the vertices, and p = a - o, q = b - o, r = c - o, n = (b - a) x (c - a):
//   edge  = d . (p x q), d . (q x r), d . (r x p)     twice the signed volumes of ray and edge; their sum is d . n
//   t     = n . p / n . d                              in lengths of d, codes; in grid units times 2^-24 / 2^-26
//   inside: the three are all >= 0 or all <= 0, and d . n != 0
// Zero counts as inside on either side of an edge, so a ray through an edge or a vertex hits every triangle there that it is not parallel to.
// Range: vertices below 2^25, origin and direction of 27 bits give |p| < 2^27, cross products < 2^55, volumes < 2^83 and n . p < 2^82.
// Source: Moeller & Trumbore 1997; Plücker products as in Woop, Benthin & Wald 2013.
#pragma once
#include <array>
#include <compare>
#include <cstdint>

#include "golden/contract/contract_records.hpp"
#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"

namespace retrace::exact {

using Wide = __int128;
using Vec = std::array<std::int64_t, 3>;

inline Vec difference(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Wide dot(const Vec& a, const Vec& b) { return Wide{a[0]} * b[0] + Wide{a[1]} * b[1] + Wide{a[2]} * b[2]; }
inline Vec to_vec(const std::array<std::int32_t, 3>& a) { return {a[0], a[1], a[2]}; }
inline Vec to_vec(const GridPoint& a) { return {a.x, a.y, a.z}; }

/// Grid units of t for one length of the direction, position over direction code.
inline constexpr double kDepthUnit =
    double(std::int64_t{1} << contract::kDirectionFrac) / double(std::int64_t{1} << contract::kPositionFrac);

/// The line of a ray and a triangle; dn >= 0 (the triangle is seen from its front, whichever that is).
struct Crossing {
  std::array<Wide, 3>
      edge;     ///< of the edges from vertex 0 to 1, 1 to 2, 2 to 0: the weights of vertices 2, 0, 1 times dn
  Wide dn;      ///< direction . normal
  Wide height;  ///< normal . (vertex 0 - origin); t = height / dn
  Vec normal;   ///< not turned

  bool parallel() const { return dn == 0; }
  bool inside() const { return dn > 0 && edge[0] >= 0 && edge[1] >= 0 && edge[2] >= 0; }
  bool ahead() const { return height >= 0; }
  /// t <= t_max, of a line that is not parallel. 2^107 at most on either side.
  bool before(std::uint32_t t_max) const {
    constexpr int kShift = contract::kTLimitFrac + contract::kDirectionFrac - contract::kPositionFrac;
    static_assert(kShift >= 0 && kShift + 82 < 127);
    return height * (Wide{1} << kShift) <= Wide{t_max} * dn;
  }
  /// t in grid units, off by less than 2^-51 of itself.
  double t() const { return static_cast<double>(height) / static_cast<double>(dn) * kDepthUnit; }
};

inline Crossing intersect(const contract::RayRecord& ray, const std::array<Vec, 3>& vertices) {
  const Vec o = to_vec(ray.origin), d = to_vec(ray.direction);
  const Vec p = difference(vertices[0], o), q = difference(vertices[1], o), r = difference(vertices[2], o);
  Crossing result;
  result.normal = cross(difference(q, p), difference(r, p));
  result.edge = {dot(d, cross(p, q)), dot(d, cross(q, r)), dot(d, cross(r, p))};
  result.dn = dot(d, result.normal);
  result.height = dot(result.normal, p);
  if (result.dn < 0) {
    for (Wide& e : result.edge) e = -e;
    result.dn = -result.dn;
    result.height = -result.height;
  }
  return result;
}

/// Product of two numbers of up to 127 bits, high half first: ordered like the number.
inline std::array<unsigned __int128, 2> multiply(Wide a, Wide b) {
  using Unsigned = unsigned __int128;
  const auto low = [](Unsigned x) { return static_cast<std::uint64_t>(x); };
  const Unsigned x = static_cast<Unsigned>(a), y = static_cast<Unsigned>(b);
  const Unsigned x1 = x >> 64, x0 = low(x), y1 = y >> 64, y0 = low(y);
  const Unsigned bottom = x0 * y0, middle = x1 * y0 + (bottom >> 64), other = x0 * y1 + low(middle);
  return {x1 * y1 + (middle >> 64) + (other >> 64), other << 64 | low(bottom)};
}

/// Order of t of two crossings, neither of them parallel, both ahead of the origin.
inline std::strong_ordering compare_depth(const Crossing& a, const Crossing& b) {
  const auto left = multiply(a.height, b.dn), right = multiply(b.height, a.dn);
  if (left == right) return std::strong_ordering::equal;
  return left < right ? std::strong_ordering::less : std::strong_ordering::greater;
}

}  // namespace retrace::exact
