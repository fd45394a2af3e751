#include "false_hit.hpp"

#include <algorithm>
#include <cmath>

#include "golden/contract/certified_bounds.hpp"
#include "golden/engine/exact.hpp"
#include "golden/engine/instance_ray.hpp"

namespace retrace {
namespace {

using exact::Vec;
using exact::Wide;

/// volume <= band |edge| |direction| in exact integers, for the volume of ray and edge and squared lengths in codes.
bool within(Wide volume, Wide edge2, Wide direction2, double band) {
  if (volume <= 0) return true;
  // band in units of 2^-44, rounded down: an edge's volume is its distance times |edge| |direction|, in units of 2^-24.
  constexpr int kFine = 20;
  const Wide limit = static_cast<Wide>(std::floor(std::ldexp(band, contract::kPositionFrac + kFine)));
  const Wide scaled = volume << kFine;
  return exact::multiply(scaled, scaled) <= exact::multiply(limit * limit * edge2, direction2);
}

/// Faces of the cell moved inwards by what t_plane may misplace them.
Cell shrunk(const Cell& cell) {
  constexpr auto kCodes = static_cast<std::int32_t>(certified::kTPlanePosition * (1 << contract::kPositionFrac));
  static_assert(kCodes == 2);
  Cell result = cell;
  for (std::size_t face = 0; face < 6; ++face) result[face] += face % 2 ? -kCodes : kCodes;
  return result;
}

/// Parts 2 and 3 of the proof, for anything that leaves list: `lists(leaf)`, `meets(cell)`.
template <typename Lists, typename Meets>
FalseHit unseen(const MemoryImage& image, const contract::RayRecord& ray, std::uint32_t t,
                std::span<const std::uint32_t> visits, Lists lists, Meets meets) {
  for (const std::uint32_t number : visits) {
    const auto leaf = image.leaf(number);
    if (lists(leaf)) return FalseHit::kListed;
    if (meets(leaf.bound)) return FalseHit::kNotListed;
  }
  for (std::uint32_t number = 0; number < image.header().leaf_count; ++number) {
    const auto leaf = image.leaf(number);
    if (lists(leaf) && passes(ray, shrunk(leaf.bound), t)) return FalseHit::kPassedBy;
  }
  return FalseHit::kProved;
}

/// Does the leaf list the triangle, or the instance, of that number?
auto lists_id(const MemoryImage& image, std::uint32_t id) {
  return [&image, id](const contract::LeafRecord& leaf) {
    for (std::uint32_t i = 0; i < leaf.count; ++i)
      if (image.triangle(image.reference(leaf, i)).id == id) return true;
    return false;
  };
}

bool overlap(const Cell& a, const Cell& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a[2 * axis] > b[2 * axis + 1] || b[2 * axis] > a[2 * axis + 1]) return false;
  return true;
}

FalseHit prove_in_tree(const GridTriangle& triangle, const MemoryImage& image, const contract::RayRecord& ray,
                       std::uint32_t t, std::span<const std::uint32_t> visits) {
  return unseen(image, ray, t, visits, lists_id(image, triangle.id),
                [&](const Cell& cell) { return touches(triangle, cell); });
}

}  // namespace

const char* to_string(FalseHit verdict) {
  switch (verdict) {
    case FalseHit::kProved:
      return "proved";
    case FalseHit::kTrueHit:
      return "the ray meets the triangle";
    case FalseHit::kBeyondBand:
      return "the ray passes outside the certified band";
    case FalseHit::kListed:
      return "a leaf that the walk visited lists it";
    case FalseHit::kNotListed:
      return "a cell that the walk visited touches it, and its leaf does not list it";
    default:
      return "the ray passes a cell whose leaf lists it, and the walk did not visit it";
  }
}

bool touches(const GridTriangle& triangle, const Cell& cell) {
  // Doubled, so that the middle of the cell is an integer: below 2^28.
  std::array<Vec, 3> v{};
  Vec half{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    half[axis] = std::int64_t{cell[2 * axis + 1]} - cell[2 * axis];
    for (std::size_t i = 0; i < 3; ++i)
      v[i][axis] = 2 * std::int64_t{triangle.vertices[i][static_cast<int>(axis)]} - cell[2 * axis] - cell[2 * axis + 1];
  }
  const auto separates = [&](const Vec& along) {
    const Wide a = exact::dot(along, v[0]), b = exact::dot(along, v[1]), c = exact::dot(along, v[2]);
    const Wide reach = exact::dot({std::abs(along[0]), std::abs(along[1]), std::abs(along[2])}, half);
    return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
  };
  const std::array<Vec, 3> axes{Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}};
  if (separates(exact::cross(exact::difference(v[1], v[0]), exact::difference(v[2], v[0])))) return false;
  for (const Vec& axis : axes) {
    if (separates(axis)) return false;
    for (std::size_t i = 0; i < 3; ++i)
      if (separates(exact::cross(exact::difference(v[(i + 1) % 3], v[i]), axis))) return false;
  }
  return true;
}

bool passes(const contract::RayRecord& ray, const Cell& cell, std::uint32_t t_end) {
  // t in codes as fractions: a position is o + d t 2^-26. Numerators are below 2^54, denominators at most 2^26.
  struct Fraction {
    Wide over, under;
    bool operator<(const Fraction& other) const { return over * other.under < other.over * under; }
  };
  Fraction near{0, 1}, far{t_end, 1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t d = ray.direction[axis], o = ray.origin[axis];
    const std::int64_t low = cell[2 * axis], high = cell[2 * axis + 1];
    if (low > high) return false;
    if (d == 0) {
      if (o < low || o > high) return false;
      continue;
    }
    const auto at = [&](std::int64_t face) {
      const Wide way = Wide{face - o} << contract::kDirectionFrac;
      return d > 0 ? Fraction{way, d} : Fraction{-way, -d};
    };
    near = std::max(near, at(d > 0 ? low : high));
    far = std::min(far, at(d > 0 ? high : low));
  }
  return !(far < near);
}

FalseHit outside_within_band(const contract::RayRecord& ray, const GridTriangle& triangle, bool unit_direction) {
  const std::array<Vec, 3> vertices{exact::to_vec(triangle.vertices[0]), exact::to_vec(triangle.vertices[1]),
                                    exact::to_vec(triangle.vertices[2])};
  const exact::Crossing crossing = exact::intersect(ray, vertices);
  if (crossing.parallel()) return FalseHit::kBeyondBand;
  if (crossing.inside() && crossing.ahead()) return FalseHit::kTrueHit;
  const Vec d = exact::to_vec(ray.direction);
  const Wide direction2 = unit_direction ? exact::dot(d, d) : Wide{1} << 2 * contract::kDirectionFrac;
  std::array<Wide, 3> length2{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec edge = exact::difference(vertices[(k + 1) % 3], vertices[k]);
    length2[k] = exact::dot(edge, edge);
  }
  const Wide longest = std::max({length2[0], length2[1], length2[2]});
  for (std::size_t k = 0; k < 3; ++k) {
    const bool is_longest = length2[k] == longest;
    const double band = is_longest ? certified::kFalseW : certified::kFalseUv;
    if (!within(-crossing.edge[k], length2[k], direction2, band)) return FalseHit::kBeyondBand;
    // Beyond the opposite vertex, which the test bounds for the two shorter edges.
    if (!is_longest && !within(crossing.edge[k] - crossing.dn, length2[k], direction2, certified::kFalseTop))
      return FalseHit::kBeyondBand;
  }
  if (crossing.ahead()) return FalseHit::kProved;
  // Behind the origin: accepted where o'z, which is off by kRowOrigin, is not positive. height / |normal| is the distance from the plane.
  const Wide normal2 = exact::dot(crossing.normal, crossing.normal);
  constexpr double kBehind = certified::kRowOrigin;
  return within(-crossing.height, 1, normal2, kBehind) ? FalseHit::kProved : FalseHit::kBeyondBand;
}

FalseHit prove_false_hit(const GridScene& scene, const MemoryImage& image, const contract::RayRecord& ray,
                         std::uint32_t id, std::uint32_t t, std::span<const std::uint32_t> visits) {
  const GridTriangle& triangle = *find_triangle(scene.triangles, id);
  const FalseHit outside = outside_within_band(ray, triangle, true);
  return outside == FalseHit::kProved ? prove_in_tree(triangle, image, ray, t, visits) : outside;
}

FalseHit prove_false_hit(std::span<const GridScene> objects, const TwoLevelScene& scene, const contract::RayRecord& ray,
                         const TwoLevelHit& hit, const TwoLevelVisits& visits, bool& top) {
  const std::uint32_t number = scene.object_of[hit.instance];
  const contract::InstanceRecord& record = scene.instances[hit.instance];
  const MemoryImage& image = scene.objects[number];
  const GridTriangle& triangle = *find_triangle(objects[number].triangles, hit.id);
  const auto entry = enter_instance(record, ray, ray.t_max + 1);
  const FalseHit outside = outside_within_band(object_ray(*entry), triangle, false);
  if (outside != FalseHit::kProved) return outside;
  const auto searched = visits.objects.find(hit.instance);
  top = searched == visits.objects.end();
  if (!top) return prove_in_tree(triangle, image, object_ray(*entry), hit.t_object, searched->second);
  const Cell box = world_box(record, objects[number].box);
  return unseen(scene.top, ray, hit.t, visits.top, lists_id(scene.top, hit.instance),
                [&](const Cell& cell) { return overlap(box, cell); });
}

}  // namespace retrace
