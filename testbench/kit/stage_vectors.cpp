#include "stage_vectors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "golden/tree/kd_builder.hpp"
#include "reference.hpp"
#include "test_instances.hpp"

namespace retrace {
namespace {

constexpr std::int32_t kOne = 1 << contract::kPositionFrac;  // 1.0 as a position

GridPoint random_point(Random& random) {
  return {random.integer(-kOne, kOne), random.integer(-kOne, kOne), random.integer(-kOne, kOne)};
}

std::array<std::int32_t, 3> random_direction(Random& random) {
  std::array<double, 3> d{};
  for (double& x : d) x = random.real(-1, 1);
  // Zero and tiny components are where reciprocals and shifts have their ends.
  if (random.chance(4)) d[random.below(3)] = 0.0;
  if (random.chance(4)) d[random.below(3)] *= std::ldexp(1.0, -static_cast<int>(random.below(27)));
  if (random.chance(8)) d = {0.0, 0.0, random.chance(2) ? 1.0 : -1.0};
  const double length = std::max(std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), 1e-9);
  std::array<std::int32_t, 3> code{};
  constexpr double kUnit = 1 << contract::kDirectionFrac;
  for (int axis = 0; axis < 3; ++axis)
    code[axis] = static_cast<std::int32_t>(std::min(std::floor(d[axis] / length * kUnit + 0.5), kUnit - 1));
  return code;
}

contract::RaySetupOutRecord random_state(Random& random) {
  contract::RaySetupInRecord ray;
  const GridPoint origin = random_point(random);
  ray.origin = {origin.x, origin.y, origin.z};
  ray.direction = random_direction(random);
  ray.box = {-kOne, kOne, -kOne, kOne, -kOne, kOne};
  ray.t_max = static_cast<std::uint32_t>(random.bits() >> (64 - contract::kTLimitBits));
  return reference::ray_setup(ray);
}

}  // namespace

std::int64_t directed_value(Random& random, int bits, bool is_signed) {
  std::uint64_t value = random.bits();
  switch (random.below(6)) {
    case 0:  // next to a power of two
      value = (std::uint64_t{1} << random.below(static_cast<std::uint64_t>(bits))) + random.below(3) - 1;
      if (is_signed && random.chance(2)) value = -value;
      break;
    case 1:  // small
      value = random.below(5) - (is_signed ? 2 : 0);
      break;
    case 2:  // the ends of the range: 0 1 2 and -1 -2 -3, around the middle bit if signed
      value = random.below(6) - 3 + (is_signed ? std::uint64_t{1} << (bits - 1) : 0);
      break;
    default:
      break;
  }
  if (bits == 64) return static_cast<std::int64_t>(value);
  return is_signed ? contract::detail::sign_extend(value, bits)
                   : static_cast<std::int64_t>(value & ((std::uint64_t{1} << bits) - 1));
}

contract::RaySetupInRecord ray_setup_vector(Random& random) {
  auto in = directed_record<contract::RaySetupInRecord>(random);
  if (random.chance(2)) in.direction = random_direction(random);
  if (random.chance(2)) {
    for (int axis = 0; axis < 3; ++axis) {
      if (in.box[2 * axis] > in.box[2 * axis + 1]) std::swap(in.box[2 * axis], in.box[2 * axis + 1]);
      // Inside, on a face, and one code beyond a face.
      const std::array<std::int64_t, 5> places{in.box[2 * axis], in.box[2 * axis + 1], in.box[2 * axis] - 1ll,
                                               in.box[2 * axis + 1] + 1ll,
                                               random.integer(in.box[2 * axis], in.box[2 * axis + 1])};
      const auto place = places[random.chance(3) ? random.below(4) : 4];
      in.origin[axis] = static_cast<std::int32_t>(reference::wrap(place, contract::kPositionBits));
    }
  }
  return in;
}

contract::KdDescendInRecord kd_descend_vector(Random& random) {
  auto in = directed_record<contract::KdDescendInRecord>(random);
  in.shift %= contract::kDirectionFrac + 1;
  if (random.chance(4)) return in;
  const auto state = random_state(random);
  const auto axis = random.below(3);
  in.origin = state.origin[axis];
  in.reciprocal = state.reciprocal[axis];
  in.shift = state.shift[axis];
  in.zero = state.zero[axis];
  in.negative = state.negative[axis];
  in.split = random.chance(8) ? in.origin : static_cast<std::int32_t>(random.integer(-kOne, kOne));
  if (random.chance(2)) {  // t next to the plane, where the comparison turns
    const auto plane = reference::t_plane(in.split, in.origin, in.reciprocal, in.shift);
    in.t = static_cast<std::int32_t>(reference::wrap(plane + random.integer(-1, 1), contract::kTBits));
  }
  return in;
}

contract::LeafExitInRecord leaf_exit_vector(Random& random) {
  auto in = directed_record<contract::LeafExitInRecord>(random);
  for (auto& shift : in.shift) shift %= contract::kDirectionFrac + 1;
  if (random.chance(4)) return in;
  const auto state = random_state(random);
  in.origin = state.origin;
  in.reciprocal = state.reciprocal;
  in.shift = state.shift;
  in.zero = state.zero;
  in.negative = state.negative;
  for (auto& bound : in.bound) bound = static_cast<std::int32_t>(random.integer(-kOne, kOne));
  if (random.chance(4)) {  // a diagonal through an edge or a corner of the cell: ties between axes
    const auto twin = random.below(2) + 1;
    in.origin[twin] = in.origin[0];
    in.reciprocal[twin] = in.reciprocal[0];
    in.shift[twin] = in.shift[0];
    in.zero[twin] = in.zero[0];
    in.negative[twin] = in.negative[0];
    in.bound[2 * twin] = in.bound[0];
    in.bound[2 * twin + 1] = in.bound[1];
  }
  const auto exit = reference::leaf_exit(in);
  if (random.chance(2))
    in.t = static_cast<std::int32_t>(reference::wrap(exit.t_exit + random.integer(-1, 1), contract::kTBits));
  return in;
}

contract::KdBacktrackInRecord kd_backtrack_vector(Random& random) {
  auto in = directed_record<contract::KdBacktrackInRecord>(random);
  in.face %= 6;
  if (random.chance(2)) in.parent_axis = in.face / 2;
  if (random.chance(2)) in.plane = in.parent_split;
  if (random.chance(4)) in.parent = 0;
  return in;
}

contract::TriTestInRecord tri_test_vector(Random& random) {
  auto in = directed_record<contract::TriTestInRecord>(random);
  if (random.chance(8)) return in;

  GridTriangle triangle;
  triangle.id = in.id;
  for (int attempt = 0;; ++attempt) {
    for (auto& vertex : triangle.vertices) vertex = random_point(random);
    const auto shape = attempt < 8 ? random.below(4) : 3;
    const auto near = [&](const GridPoint& p, std::int64_t reach) {
      GridPoint q;
      for (int axis = 0; axis < 3; ++axis)
        q[axis] = static_cast<int>(std::clamp<std::int64_t>(p[axis] + random.integer(-reach, reach), -kOne, kOne));
      return q;
    };
    const auto reach = std::int64_t{1} << random.below(25);
    if (shape < 2) {  // a small triangle, of any size
      triangle.vertices[1] = near(triangle.vertices[0], reach);
      triangle.vertices[2] = near(triangle.vertices[0], reach);
    } else if (shape == 2) {  // a needle
      triangle.vertices[1] = near(triangle.vertices[2], reach);
    }
    const auto a = glm::i64vec3(triangle.vertices[1] - triangle.vertices[0]);
    const auto b = glm::i64vec3(triangle.vertices[2] - triangle.vertices[0]);
    if (a.y * b.z != a.z * b.y || a.z * b.x != a.x * b.z || a.x * b.y != a.y * b.x) break;
  }
  const auto record = make_unit_triangle(triangle);
  in.u = record.u;
  in.v = record.v;
  in.n = record.n;
  in.offset_u = record.offset_u;
  in.offset_v = record.offset_v;
  in.offset_n = record.offset_n;
  in.exponent_u = record.exponent_u;
  in.exponent_v = record.exponent_v;

  // Aim at a vertex, at an edge, or inside; sometimes start on the triangle.
  std::array<double, 3> weight{random.real(0, 1), random.real(0, 1), random.real(0, 1)};
  const auto aim = random.below(3);
  if (aim >= 1) weight[random.below(3)] = 0.0;
  if (aim == 2) weight = {1.0, 0.0, 0.0};
  const double sum = std::max(weight[0] + weight[1] + weight[2], 1e-12);
  const GridPoint origin = random_point(random);
  std::array<double, 3> d{};
  double length = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    double target = 0.0;
    for (int i = 0; i < 3; ++i) target += weight[i] / sum * triangle.vertices[i][axis];
    in.origin[axis] = random.chance(32) ? static_cast<std::int32_t>(target) : origin[axis];
    d[axis] = target - in.origin[axis];
    length += d[axis] * d[axis];
  }
  length = std::max(std::sqrt(length), 1e-9);
  constexpr double kUnit = 1 << contract::kDirectionFrac;
  for (int axis = 0; axis < 3; ++axis)
    in.direction[axis] =
        static_cast<std::int32_t>(std::clamp(std::floor(d[axis] / length * kUnit + 0.5), -kUnit, kUnit - 1));
  return in;
}

contract::HitFinishInRecord hit_finish_vector(Random& random) {
  auto in = directed_record<contract::HitFinishInRecord>(random);
  if (random.chance(2)) {
    in.status = contract::kStatusHit;
    const auto hit = reference::tri_test(tri_test_vector(random));
    if (hit.hit) {
      in.t = hit.t;
      in.id = hit.id;
      in.edge_u = hit.edge_u;
      in.edge_v = hit.edge_v;
      in.dz = hit.dz;
      in.exponent_u = hit.exponent_u;
      in.exponent_v = hit.exponent_v;
    }
    // The quotient's ends: exactly 1, one below, one above.
    if (random.chance(8) && in.exponent_u <= contract::kBarycentricFrac)
      in.edge_u = ((std::int64_t{in.dz} << (contract::kBarycentricFrac + contract::kExponentBias)) >> in.exponent_u) +
                  random.integer(-1, 1);
  }
  in.dz = in.dz == std::numeric_limits<std::int32_t>::min() ? 1 : std::abs(in.dz);
  if (in.dz == 0 || in.dz >= 1 << contract::kDirectionFrac) in.dz = 1;  // tri_test's candidates have d'z above 0
  return in;
}

contract::InstanceEnterInRecord instance_enter_vector(Random& random) {
  auto in = directed_record<contract::InstanceEnterInRecord>(random);
  if (random.chance(8)) return in;  // mostly a bad record

  // A box of any size, an instance of any shape.
  std::array<std::int32_t, 6> box{};
  constexpr auto kReach = static_cast<std::int32_t>(kObjectReach * kOne);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto half = std::min<std::int64_t>(kReach, (std::int64_t{1} << random.below(25)) + contract::kBoxPad);
    const std::int64_t middle = random.chance(2) ? 0 : random.integer(half - kReach, kReach - half);
    box[2 * axis] = static_cast<std::int32_t>(middle - half);
    box[2 * axis + 1] = static_cast<std::int32_t>(middle + half);
  }
  const auto shape = static_cast<InstanceShape>(random.below(static_cast<std::uint64_t>(InstanceShape::kCount)));
  const Placement placement = random_placement(random, shape);
  const auto record = make_instance(placement, box, 0, 0);
  if (!record) return in;
  in.m = record->m;
  in.b = record->b;
  in.e = record->e;
  in.box = record->box;

  // From anywhere in the world, or from inside the object, to a corner, an edge, a face or the inside of its box, or a little beside.
  const auto place = [&](bool sides) {
    glm::dvec3 point;
    const auto fixed = sides ? random.below(4) : 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<std::size_t>(axis);
      const double lower = box[2 * at] * (1.0 / kOne), upper = box[2 * at + 1] * (1.0 / kOne);
      point[axis] =
          static_cast<std::uint64_t>(axis) < fixed ? (random.chance(2) ? lower : upper) : random.real(lower, upper);
    }
    return placement.linear * point + placement.offset;
  };
  glm::dvec3 target = place(true);
  if (random.chance(3))
    for (int axis = 0; axis < 3; ++axis)
      target[axis] += random.real(-1, 1) * std::ldexp(1.0, -static_cast<int>(random.below(26)));
  const glm::dvec3 start = place(false);
  const bool inside = random.chance(4);
  std::array<double, 3> d{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from =
        inside ? start[static_cast<int>(axis)] * kOne : static_cast<double>(random.integer(-kOne, kOne));
    in.origin[axis] = static_cast<std::int32_t>(std::clamp(std::floor(from), -1.0 * kOne, 1.0 * kOne));
    d[axis] = target[static_cast<int>(axis)] - in.origin[axis] * (1.0 / kOne);
  }
  if (random.chance(8)) d[random.below(3)] = 0.0;  // along a plane of the world
  if (random.chance(16)) {                         // along an axis of the object
    const auto column = placement.linear[static_cast<int>(random.below(3))];
    d = {column.x, column.y, column.z};
  }
  const double length = std::max(std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), 1e-12);
  constexpr double kUnit = 1 << contract::kDirectionFrac;
  for (std::size_t axis = 0; axis < 3; ++axis)
    in.direction[axis] =
        static_cast<std::int32_t>(std::clamp(std::floor(d[axis] / length * kUnit + 0.5), -kUnit, kUnit - 1));
  // Far away, or just at the box: what is left of it turns at 0 and at 2^27.
  in.reach = 1u << (contract::kTReachBits - 1);
  if (random.chance(4)) {
    const auto entry = reference::instance_enter(in);
    const auto first = entry.enters ? reference::world_t(0, entry.start, entry.scale) : 0;
    in.reach = static_cast<std::uint32_t>(std::max<std::int64_t>(0, first + random.integer(-1, 2)));
  } else if (random.chance(2)) {
    in.reach = static_cast<std::uint32_t>(random.below(std::uint64_t{4} << contract::kTLimitFrac));
  }
  if (random.chance(16))
    in.e[random.below(3)] = static_cast<std::uint32_t>(random.below(1u << contract::kRowExponentBits));
  return in;
}

}  // namespace retrace
