// The certified bounds against measurement: the datapaths of ray_setup / t_plane, tri_test and hit_finish, written here
// once more in plain integers from the number contract (codes; 128-bit products), and a long double reference on the
// real triangle and the exact quantised ray. Random and adversarial triangles and rays, and a hill climb for the worst
// edge error: nothing may exceed its bound, and the bound must not be absurdly far away either. Proofs:
// docs/error-bounds.md. Independent of hls/ and golden/.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "golden/contract/certified_bounds.hpp"

namespace {

using std::int64_t;
__extension__ typedef __int128 int128;
using Real = long double;
using Codes = std::array<int64_t, 3>;
using Vector = std::array<Real, 3>;
namespace certified = retrace::certified;

constexpr int64_t kUnit = int64_t{1} << 24;  // position 1.0
constexpr int64_t kEpsUv = int64_t{1} << 28, kEpsW = int64_t{1} << 29;
const Real kShrink = 1 - std::ldexp(Real(1), -22);  // norm of row n, largest norm of rows u and v

Real scale(Real x, int exponent) { return std::ldexp(x, exponent); }
Real dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Real norm(const Vector& a) { return std::sqrt(dot(a, a)); }
Vector real_of(const Codes& a, int frac) {
  return {scale(Real(a[0]), -frac), scale(Real(a[1]), -frac), scale(Real(a[2]), -frac)};
}
int64_t floor_shift(int128 x, int bits) { return static_cast<int64_t>(x >> bits); }
int64_t nearest_shift(int128 x, int bits) { return floor_shift(x + (int128{1} << (bits - 1)), bits); }
int64_t floor_div(int128 a, int128 b) { return static_cast<int64_t>(a / b - (a % b != 0 && (a < 0) != (b < 0))); }

std::uint64_t seed() {
  const char* text = std::getenv("RETRACE_SEED");
  return text ? std::strtoull(text, nullptr, 0) : 20070621;
}

struct Ray {
  Codes origin, direction;
};

// Unit direction to codes: nearest, ties up, saturated.
Ray make_ray(const Codes& origin, const Vector& direction) {
  Ray ray{origin, {}};
  const Real length = norm(direction);
  for (int i = 0; i < 3; ++i) {
    const Real code = std::floor(scale(direction[i] / length, 26) + 0.5L);
    ray.direction[i] = std::clamp(static_cast<int64_t>(code), -(int64_t{1} << 26), (int64_t{1} << 26) - 1);
  }
  return ray;
}

// A triangle: its vertices in the record's order, the real rows, and the record.
struct Triangle {
  std::array<Codes, 3> vertex;
  std::array<Vector, 3> real_row;  // u, v, n; u and v scaled by 2^-exponent
  std::array<Codes, 3> row;
  std::array<int64_t, 3> offset;
  int eu, ev;
  std::array<Real, 3> height;  // of vertices 0 (w), 1 (u), 2 (v)
  Real norm_u, norm_v, norm_w;
  Real slenderness;  // shortest edge over least height: 1 / sine of the middle angle
  bool valid = false;
};

std::array<int128, 3> cross(const std::array<int128, 3>& a, const std::array<int128, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
std::array<int128, 3> edge(const Codes& from, const Codes& to) {
  return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

Triangle make_triangle(std::array<Codes, 3> vertex) {
  Triangle t;
  const auto squared = [&](int i) {  // of the edge opposite to vertex i
    const auto e = edge(vertex[(i + 1) % 3], vertex[(i + 2) % 3]);
    return e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
  };
  std::array<int, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return squared(a) > squared(b); });  // longest edge, least height
  t.vertex = {vertex[order[0]], vertex[order[1]], vertex[order[2]]};
  const auto ab = edge(t.vertex[0], t.vertex[1]), ac = edge(t.vertex[0], t.vertex[2]);
  const auto n = cross(ab, ac);
  const Vector normal{Real(n[0]), Real(n[1]), Real(n[2])};
  const Real area2 = norm(normal);
  if (area2 == 0) return t;
  const auto gradient = [&](const std::array<int128, 3>& product) {  // per unit of position, not per code
    Vector g;
    for (int i = 0; i < 3; ++i) g[i] = scale(Real(product[i]) / area2 / area2, 24);
    return g;
  };
  std::array<Vector, 2> rows{gradient(cross(ac, n)), gradient(cross(n, ab))};
  std::array<int, 2> exponent;
  for (int k = 0; k < 2; ++k) {
    std::frexp(norm(rows[k]), &exponent[k]);
    if (scale(norm(rows[k]), -exponent[k]) > kShrink) ++exponent[k];
    for (int i = 0; i < 3; ++i) t.real_row[k][i] = scale(rows[k][i], -exponent[k]);
  }
  for (int i = 0; i < 3; ++i) t.real_row[2][i] = normal[i] / area2 * kShrink;
  t.eu = exponent[0], t.ev = exponent[1];
  t.norm_u = norm(t.real_row[0]), t.norm_v = norm(t.real_row[1]);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) t.row[k][i] = std::llround(scale(t.real_row[k][i], 26));
    t.offset[k] = std::llround(scale(-dot(t.real_row[k], real_of(t.vertex[0], 24)), 29));
  }
  Real length = 0;  // in the end of the last edge, which is the shortest
  for (int i = 0; i < 3; ++i) {
    const auto e = edge(t.vertex[(i + 1) % 3], t.vertex[(i + 2) % 3]);
    length = scale(norm({Real(e[0]), Real(e[1]), Real(e[2])}), -24);
    t.height[i] = scale(area2, -48) / length;
  }
  t.slenderness = length / t.height[0];
  t.norm_w = scale(1 / t.height[0], -t.eu);
  t.valid = true;
  return t;
}

struct TriTest {
  std::array<int64_t, 3> o, d;  // o'u, o'v, o'z (24 fraction bits), d' (26), signs flipped so that d'z >= 0
  int128 u, v, w;               // 50 fraction bits
  int128 top_u, top_v;          // U - DZ, V - DZ: 0 where u or v is 1
  bool hit;
  int64_t t;
};

TriTest tri_test(const Triangle& triangle, const Ray& ray) {
  TriTest r{};
  for (int k = 0; k < 3; ++k) {
    int128 o = int128{triangle.offset[k]} << 21, d = 0;  // 50 and 52 fraction bits
    for (int i = 0; i < 3; ++i) {
      o += int128{triangle.row[k][i]} * ray.origin[i];
      d += int128{triangle.row[k][i]} * ray.direction[i];
    }
    r.o[k] = nearest_shift(o, 26);
    r.d[k] = nearest_shift(d, 26);
  }
  if (r.d[2] < 0) r.d[2] = -r.d[2], r.o[2] = -r.o[2];
  r.u = int128{r.o[0]} * r.d[2] - int128{r.o[2]} * r.d[0];
  r.v = int128{r.o[1]} * r.d[2] - int128{r.o[2]} * r.d[1];
  const int128 one_u = (int128{r.d[2]} << 25) >> (triangle.eu + 1), one_v = (int128{r.d[2]} << 25) >> (triangle.ev + 1);
  r.w = one_u - r.u - (r.v >> (triangle.eu - triangle.ev));
  r.top_u = r.u - one_u;
  r.top_v = r.v - one_v;
  const bool edges = r.u >= -kEpsUv && r.top_u <= kEpsUv && r.v >= -kEpsUv && r.top_v <= kEpsUv && r.w >= -kEpsW;
  r.hit = edges && r.d[2] > 0 && r.o[2] <= 0 && -r.o[2] < 2 * r.d[2];
  if (r.hit) r.t = floor_div(int128{-r.o[2]} << 26, r.d[2]);
  return r;
}

struct Exact {
  std::array<Real, 3> o, d;
  Real u, v, w, top_u, top_v;
  Real t, cosine;
};

// The same formulas on the real rows; the signs as the datapath chose them.
Exact exact(const Triangle& triangle, const Ray& ray) {
  Exact e;
  Vector from;
  for (int i = 0; i < 3; ++i) from[i] = scale(Real(ray.origin[i] - triangle.vertex[0][i]), -24);
  const Vector direction = real_of(ray.direction, 26);
  for (int k = 0; k < 3; ++k) e.o[k] = dot(triangle.real_row[k], from), e.d[k] = dot(triangle.real_row[k], direction);
  if (e.d[2] < 0) e.d[2] = -e.d[2], e.o[2] = -e.o[2];
  e.u = e.o[0] * e.d[2] - e.o[2] * e.d[0];
  e.v = e.o[1] * e.d[2] - e.o[2] * e.d[1];
  e.w = scale(e.d[2], -triangle.eu) - e.u - scale(e.v, triangle.ev - triangle.eu);
  e.top_u = e.u - scale(e.d[2], -triangle.eu);
  e.top_v = e.v - scale(e.d[2], -triangle.ev);
  e.t = -e.o[2] / e.d[2];
  e.cosine = e.d[2] / kShrink / norm(direction);
  return e;
}

// hit_finish for one coordinate.
int64_t barycentric(int128 edge, int exponent, int64_t dz) {
  if (edge <= 0) return 0;
  const int shift = exponent + 1;  // the biased exponent
  if (shift >= 60) return kUnit;
  const int128 denominator = int128{dz} << 1;
  if ((edge >> (110 - shift)) != 0) return kUnit;
  return static_cast<int64_t>(std::min<int128>((edge << shift) / denominator, kUnit));
}

// Largest error seen of each certified quantity, as a fraction of its bound.
struct Worst {
  double row_origin = 0, row_direction = 0, edge_uv = 0, edge_top = 0, edge_w = 0, depth_exact = 0, depth_computed = 0,
         barycentric = 0, false_uv = 0, false_top = 0, false_w = 0, false_reach = 0;
  int64_t exact_hits = 0, false_hits = 0, missed = 0;

  static void raise(double& worst, Real error, double bound) {
    worst = std::max(worst, static_cast<double>(error / bound));
  }
};

Real segment_distance(const Vector& p, const Vector& a, const Vector& b) {
  Vector ab, ap;
  for (int i = 0; i < 3; ++i) ab[i] = b[i] - a[i], ap[i] = p[i] - a[i];
  const Real s = std::clamp(dot(ap, ab) / dot(ab, ab), Real(0), Real(1));
  return norm({ap[0] - s * ab[0], ap[1] - s * ab[1], ap[2] - s * ab[2]});
}

// Of the ray's exact point in the triangle's plane from the triangle.
Real triangle_distance(const Triangle& triangle, const Ray& ray, const Exact& e) {
  if (e.u >= 0 && e.v >= 0 && e.w >= 0) return 0;
  Vector p = real_of(ray.origin, 24);
  for (int i = 0; i < 3; ++i) p[i] += e.t * scale(Real(ray.direction[i]), -26);
  Real distance = 1e9;
  for (int i = 0; i < 3; ++i)
    distance = std::min(
        distance, segment_distance(p, real_of(triangle.vertex[i], 24), real_of(triangle.vertex[(i + 1) % 3], 24)));
  return distance;
}

// One ray against one triangle; everything that is certified.
void measure(const Triangle& triangle, const Ray& ray, Worst& worst) {
  const TriTest r = tri_test(triangle, ray);
  const Exact e = exact(triangle, ray);
  if (e.d[2] < std::ldexp(1.0, -24)) return;  // grazing: nothing is certified
  for (int k = 0; k < 3; ++k) {
    Worst::raise(worst.row_origin, std::fabs(scale(Real(r.o[k]), -24) - e.o[k]), certified::kRowOrigin);
    Worst::raise(worst.row_direction, std::fabs(scale(Real(r.d[k]), -26) - e.d[k]), certified::kRowDirection);
  }
  Worst::raise(worst.edge_uv, std::fabs(scale(Real(r.u), -50) - e.u), certified::kEdgeUv);
  Worst::raise(worst.edge_uv, std::fabs(scale(Real(r.v), -50) - e.v), certified::kEdgeUv);
  Worst::raise(worst.edge_top, std::fabs(scale(Real(r.top_u), -50) - e.top_u), certified::kEdgeTop);
  Worst::raise(worst.edge_top, std::fabs(scale(Real(r.top_v), -50) - e.top_v), certified::kEdgeTop);
  Worst::raise(worst.edge_w, std::fabs(scale(Real(r.w), -50) - e.w), certified::kEdgeW);
  EXPECT_GT(r.d[2], 0);
  const bool inside = e.u >= 0 && e.v >= 0 && e.w >= 0 && e.o[2] <= 0;
  if (inside) {
    ++worst.exact_hits;
    if (!r.hit) ++worst.missed;
  }
  if (!r.hit) return;
  const Real floor_of_t = std::ldexp(1.0L, -24), dz = scale(Real(r.d[2]), -26);
  const Real t_error = std::fabs(scale(Real(r.t), -24) - e.t);
  if (e.t <= 3.4642L)
    Worst::raise(worst.depth_exact, t_error, static_cast<double>(certified::kDepthExact / dz + floor_of_t));
  if (r.t <= scale(3.4649L, 24))
    Worst::raise(worst.depth_computed, t_error, static_cast<double>(certified::kDepthComputed / e.cosine + floor_of_t));
  if (inside) {
    const std::array<int128, 2> edges{r.u, r.v};
    const std::array<Real, 2> real{scale(e.u, triangle.eu) / e.d[2], scale(e.v, triangle.ev) / e.d[2]};
    const std::array<int, 2> exponents{triangle.eu, triangle.ev};
    for (int k = 0; k < 2; ++k) {
      const Real code = scale(Real(barycentric(edges[k], exponents[k], r.d[2])), -24);
      const Real bound = scale(Real(certified::kBarycentric), exponents[k]) / dz + floor_of_t;
      Worst::raise(worst.barycentric, std::fabs(code - real[k]), static_cast<double>(bound));
    }
    return;
  }
  ++worst.false_hits;
  const Real length = kShrink * norm(real_of(ray.direction, 26));
  Worst::raise(worst.false_uv, -e.u / triangle.norm_u / length, certified::kFalseUv);
  Worst::raise(worst.false_uv, -e.v / triangle.norm_v / length, certified::kFalseUv);
  Worst::raise(worst.false_w, -e.w / triangle.norm_w / length, certified::kFalseW);
  Worst::raise(worst.false_top, e.top_u / triangle.norm_u / length, certified::kFalseTop);
  Worst::raise(worst.false_top, e.top_v / triangle.norm_v / length, certified::kFalseTop);
  Worst::raise(worst.false_reach, triangle_distance(triangle, ray, e) * e.cosine / triangle.slenderness,
               certified::kFalseReach);
}

class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : random_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int64_t integer(int64_t low, int64_t high) { return std::uniform_int_distribution<int64_t>(low, high)(random_); }
  bool chance(double p) { return uniform(0, 1) < p; }

  Codes position() {
    Codes p;
    for (auto& x : p) x = chance(0.2) ? (chance(0.5) ? kUnit : -kUnit) : integer(-kUnit, kUnit);
    return p;
  }
  Codes near(const Codes& p, double size) {
    Codes q;
    for (int i = 0; i < 3; ++i)
      q[i] = std::clamp(p[i] + static_cast<int64_t>(std::llround(uniform(-size, size) * kUnit)), -kUnit, kUnit);
    return q;
  }

  // Large, small, needles (one short edge) and flat ones (a vertex near the opposite edge).
  std::array<Codes, 3> triangle() {
    const Codes a = position();
    const double size = std::exp2(uniform(-24, 1));
    switch (integer(0, 4)) {
      case 0:
        return {a, position(), position()};
      case 1:
        return {a, near(a, size), near(a, size)};
      case 2:
        return {a, near(a, size), position()};
      case 3: {
        const Codes b = position();
        Codes c;
        for (int i = 0; i < 3; ++i) c[i] = (a[i] + b[i]) / 2;
        return {a, b, near(c, size)};
      }
      default: {
        const Codes b = near(a, std::sqrt(size));
        const double s = uniform(0, 1);
        Codes c;
        for (int i = 0; i < 3; ++i) c[i] = static_cast<int64_t>(std::llround(double(a[i]) + s * double(b[i] - a[i])));
        return {a, b, near(c, size)};
      }
    }
  }

  // From anywhere to a point of the triangle, of an edge, a vertex, a little beside an edge, or anywhere.
  Ray ray(const Triangle& t) {
    const Codes origin = position();
    std::array<Real, 3> weight{uniform(0, 1), uniform(0, 1), uniform(0, 1)};
    const int64_t kind = integer(0, 4);
    if (kind >= 1) weight[integer(0, 2)] = 0;
    if (kind == 2) weight[integer(0, 2)] = 0;
    const Real sum = weight[0] + weight[1] + weight[2];
    Vector direction;
    for (int i = 0; i < 3; ++i) {
      Real target = uniform(-1, 1);
      if (kind != 4 && sum > 0) {
        target = 0;
        for (int k = 0; k < 3; ++k) target += weight[k] / sum * Real(t.vertex[k][i]) / kUnit;
        if (kind == 3) target += scale(uniform(-1, 1), static_cast<int>(integer(-27, -17)));
      }
      direction[i] = target - Real(origin[i]) / kUnit;
    }
    if (norm(direction) == 0) direction[0] = 1;
    return make_ray(origin, direction);
  }

 private:
  std::mt19937_64 random_;
};

TEST(Bounds, TrianglesAndRays) {
  const std::uint64_t start = seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(start));
  Sampler sampler(start);
  Worst worst;
  for (int i = 0; i < 100000; ++i) {
    const Triangle triangle = make_triangle(sampler.triangle());
    if (!triangle.valid) continue;
    ASSERT_GE(triangle.eu, triangle.ev);
    ASSERT_GE(triangle.ev, -1);
    ASSERT_LE(triangle.eu, 52);
    ASSERT_LE(triangle.norm_w, 2);
    for (int k = 0; k < 3; ++k) measure(triangle, sampler.ray(triangle), worst);
  }
  std::printf("exact hits %lld, of them missed %lld; false hits %lld\n", static_cast<long long>(worst.exact_hits),
              static_cast<long long>(worst.missed), static_cast<long long>(worst.false_hits));
  EXPECT_EQ(worst.missed, 0);
  EXPECT_GT(worst.exact_hits, 50000);
  EXPECT_GT(worst.false_hits, 1000);
  const auto check = [](const char* name, double ratio, double least) {
    std::printf("%-16s measured / bound %.3f\n", name, ratio);
    EXPECT_LE(ratio, 1.0) << name;
    EXPECT_GE(ratio, least) << name << ": the bound says little";
  };
  check("row_origin", worst.row_origin, 0.5);
  check("row_direction", worst.row_direction, 0.5);
  check("edge_uv", worst.edge_uv, 0.25);
  check("edge_top", worst.edge_top, 0.25);
  check("edge_w", worst.edge_w, 0.2);
  check("depth_exact", worst.depth_exact, 0.3);
  check("depth_computed", worst.depth_computed, 0.3);
  check("barycentric", worst.barycentric, 0.2);
  check("false_uv", worst.false_uv, 0.5);
  check("false_top", worst.false_top, 0.5);
  check("false_w", worst.false_w, 0.5);
  check("false_reach", worst.false_reach, 0.3);
}

// Climbs towards the worst edge error: long lever arms, 45 degrees, and rounding errors that add up.
enum class Edge { kUv, kTop, kW };
double climb(Sampler& sampler, Edge edge, int restarts, int steps) {
  double best = 0;
  const auto error = [&](const Triangle& t, const Ray& ray) {
    if (!t.valid) return 0.0;
    const TriTest r = tri_test(t, ray);
    const Exact e = exact(t, ray);
    if (e.d[2] < std::ldexp(1.0, -24)) return 0.0;
    const auto ratio = [](int128 code, Real real, double bound) {
      return static_cast<double>(std::fabs(scale(Real(code), -50) - real) / bound);
    };
    return edge == Edge::kUv    ? ratio(r.u, e.u, certified::kEdgeUv)
           : edge == Edge::kTop ? ratio(r.top_u, e.top_u, certified::kEdgeTop)
                                : ratio(r.w, e.w, certified::kEdgeW);
  };
  for (int restart = 0; restart < restarts; ++restart) {
    // Vertices near one corner of the cube's diagonal, the origin at the other: the longest lever arms.
    Codes origin, far;
    for (int i = 0; i < 3; ++i) origin[i] = sampler.chance(0.5) ? kUnit : -kUnit, far[i] = -origin[i];
    std::array<Codes, 3> vertices{sampler.near(far, 0.5), sampler.near(far, 0.5), sampler.near(far, 0.5)};
    if (edge == Edge::kW &&
        restart % 2 == 0)  // row w twice as long as row u: a vertex near the middle of the opposite edge
      for (int i = 0; i < 3; ++i) vertices[2][i] = (vertices[0][i] + vertices[1][i]) / 2 + sampler.integer(-1000, 1000);
    Vector direction{sampler.uniform(-1, 1), sampler.uniform(-1, 1), sampler.uniform(-1, 1)};
    double here = 0;
    for (int step = 0; step < steps; ++step) {
      auto new_vertices = vertices;
      auto new_origin = origin;
      auto new_direction = direction;
      const double size = std::exp2(sampler.uniform(-26, 0));
      const int64_t what = sampler.integer(0, 4);
      if (what < 3) new_vertices[what] = sampler.near(vertices[what], size);
      if (what == 3) new_origin = sampler.near(origin, size);
      if (what == 4)
        for (auto& x : new_direction) x += sampler.uniform(-size, size);
      if (norm(new_direction) < 0.01L) continue;
      const double there = error(make_triangle(new_vertices), make_ray(new_origin, new_direction));
      if (there >= here) vertices = new_vertices, origin = new_origin, direction = new_direction, here = there;
    }
    best = std::max(best, here);
  }
  return best;
}

TEST(Bounds, WorstEdgeErrors) {
  const std::uint64_t start = seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(start));
  Sampler sampler(start);
  const auto check = [&](const char* name, Edge edge, double least) {
    const double ratio = climb(sampler, edge, 12, 20000);
    std::printf("%-8s measured / bound %.3f\n", name, ratio);
    EXPECT_LE(ratio, 1.0) << name;
    EXPECT_GE(ratio, least) << name << ": the bound says little";
  };
  check("edge_uv", Edge::kUv, 0.4);
  check("edge_top", Edge::kTop, 0.4);
  check("edge_w", Edge::kW, 0.35);
}

struct Reciprocal {
  int64_t r;
  int shift;
};
Reciprocal reciprocal(int64_t direction) {
  const int64_t magnitude = std::llabs(direction);
  int e = 0;
  while ((magnitude << e) < (int64_t{1} << 26)) ++e;
  const int64_t r = std::min((int64_t{1} << 52) / (magnitude << e), (int64_t{1} << 26) - 1);
  return {direction < 0 ? -r : r, 26 - e};
}
int64_t t_plane(int64_t plane, int64_t origin, const Reciprocal& r) {
  const int64_t t = floor_shift(int128{plane - origin} * r.r, r.shift);
  return std::clamp(t, -(int64_t{1} << 27), (int64_t{1} << 27) - 1);
}

TEST(Bounds, Planes) {
  const std::uint64_t start = seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(start));
  Sampler sampler(start);
  double worst = 0;
  for (int i = 0; i < 300000; ++i) {
    int64_t d =
        i < 4096 ? i + 1 : std::min(int64_t{1} << 26, static_cast<int64_t>(std::exp2(sampler.uniform(0, 26.01))));
    if (i % 64 == 0) d = int64_t{1} << sampler.integer(0, 26);
    if (sampler.chance(0.5)) d = -d;
    d = std::min(d, (int64_t{1} << 26) - 1);  // Q1.26
    const Reciprocal r = reciprocal(d);
    ASSERT_TRUE(r.shift >= 0 && r.shift <= 26 && std::llabs(r.r) >= int64_t{1} << 25 &&
                std::llabs(r.r) < int64_t{1} << 26)
        << d;
    const int64_t origin = sampler.position()[0];
    int64_t plane = sampler.position()[0];
    // Planes that the ray reaches within the scene, too: those of a small direction lie close.
    if (sampler.chance(0.5))
      plane = std::clamp(origin + floor_shift(int128{d} * sampler.integer(0, 4 * kUnit), 26), -kUnit, kUnit);
    const int64_t t = t_plane(plane, origin, r);
    const int64_t next = t_plane(std::min(plane + 1, kUnit), origin, r);
    ASSERT_TRUE(d > 0 ? next >= t : next <= t) << d << ' ' << origin << ' ' << plane;
    if (t == (int64_t{1} << 27) - 1 || t == -(int64_t{1} << 27)) continue;  // saturated: 8 away, outside the scene
    const int128 error = int128{t} * d - (int128{plane - origin} << 26);    // 50 fraction bits, sign of d
    worst = std::max(worst, std::fabs(std::ldexp(static_cast<double>(error), -50)) / certified::kTPlanePosition);
    if (t >= 0) {
      ASSERT_LE(d > 0 ? error : -error, 0) << d << ' ' << origin << ' ' << plane;  // never late
    }
  }
  std::printf("t_plane_position measured / bound %.3f\n", worst);
  EXPECT_LE(worst, 1.0);
  EXPECT_GE(worst, 0.5);
}

// Rays straight down on (x, y): the last x that is hit on the way from `from`, which is, to `to`, which is not.
int64_t last_hit(const Triangle& triangle, int64_t y, int64_t from, int64_t to) {
  const auto hit = [&](int64_t x) { return tri_test(triangle, make_ray({x, y, kUnit / 2}, {0, 0, -1})).hit; };
  EXPECT_TRUE(hit(from));
  EXPECT_FALSE(hit(to));
  while (std::llabs(to - from) > 1) {
    const int64_t middle = (from + to) / 2;
    (hit(middle) ? from : to) = middle;
  }
  return from;
}

// Three strips alone would meet far beyond the tip of a needle that is thinner than the tolerance (this one would be
// hit at eight times its length). The upper ends of u and v cut them off there.
TEST(Bounds, TipsOfNeedles) {
  constexpr int64_t kTip = kUnit / 8;
  const Triangle needle = make_triangle({Codes{0, 0, 0}, Codes{0, 2, 0}, Codes{kTip, 1, 0}});  // 2^-23 wide
  ASSERT_TRUE(needle.valid);
  ASSERT_LT(needle.slenderness, 1.001L);
  const Real below = scale(Real(-last_hit(needle, 1, 0, -kUnit)), -24);
  const Real beyond = scale(Real(last_hit(needle, 1, kTip, kUnit) - kTip), -24);
  std::printf("needle of length 1/8 and width 2^-23: hit up to %.3g below its base and %.3g beyond its tip\n",
              static_cast<double>(below), static_cast<double>(beyond));
  EXPECT_LE(below, certified::kFalseUv);
  EXPECT_LE(beyond, certified::kFalseTop);
}

// What remains, and why the documentation says so: where all three edges are nearly parallel, so are the strips and the
// lines that cut them.
TEST(Bounds, TipsOfFlatSlivers) {
  constexpr int64_t kTip = kUnit / 32;
  for (const int64_t height : {1, 2, 8, 64, 1024}) {
    const Triangle sliver = make_triangle({Codes{0, 0, 0}, Codes{kTip, 0, 0}, Codes{kTip / 2, height, 0}});
    ASSERT_TRUE(sliver.valid);
    const Real bound = certified::kFalseReach * sliver.slenderness;
    const int64_t codes = std::max(-last_hit(sliver, 0, 0, -kUnit), last_hit(sliver, 0, kTip, kUnit) - kTip);
    const Real beyond = scale(Real(codes), -24);
    std::printf("flat sliver of length 1/32 and height %4lld codes: hit up to %.3g beyond its tips, bound %.3g\n",
                static_cast<long long>(height), static_cast<double>(beyond), static_cast<double>(bound));
    EXPECT_LE(beyond, bound) << height;
    EXPECT_GE(beyond, bound / 20) << height << ": the bound says little";
  }
}

}  // namespace
