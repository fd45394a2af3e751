// Every stage once more, in plain 64- and 128-bit integers, written from docs/number-contract.md and independent of the
// kernels: what the C-simulation testbenches compare with. Host compiler only.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "golden/scene/contract_records.hpp"
#include "golden/stages/instance_enter.hpp"
#include "hls/include/contract.hpp"

namespace retrace::reference {

using Wide = __int128;

inline std::int64_t wrap(std::int64_t value, int bits) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(value) << (64 - bits)) >> (64 - bits);
}

inline std::int64_t t_plane(std::int64_t plane, std::int64_t origin, std::int64_t reciprocal, unsigned shift) {
  const std::int64_t distance = wrap(plane - origin, contract::kPositionBits);
  const std::int64_t limit = std::int64_t{1} << (contract::kTBits - 1);
  return std::clamp((distance * reciprocal) >> shift, -limit, limit - 1);
}

inline contract::RaySetupOutRecord ray_setup(const contract::RaySetupInRecord& in) {
  contract::RaySetupOutRecord out;
  out.origin = in.origin;
  out.direction = in.direction;
  out.t_max = in.t_max;
  out.any = in.any;
  out.valid = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t d = in.direction[axis];
    out.zero[axis] = d == 0;
    out.negative[axis] = d < 0;
    if (d == 0) {
      out.shift[axis] = 0;
    } else {
      out.valid = 1;
      std::int64_t magnitude = d < 0 ? -d : d;
      unsigned shift = contract::kDirectionFrac;
      while (magnitude < std::int64_t{1} << contract::kDirectionFrac) {
        magnitude *= 2;
        --shift;
      }
      const std::int64_t quotient = std::min((std::int64_t{1} << 2 * contract::kDirectionFrac) / magnitude,
                                             (std::int64_t{1} << (contract::kReciprocalBits - 1)) - 1);
      out.reciprocal[axis] = static_cast<std::int32_t>(d < 0 ? -quotient : quotient);
      out.shift[axis] = shift;
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    if (in.origin[axis] < in.box[2 * axis] || in.origin[axis] > in.box[2 * axis + 1]) out.valid = 0;
  return out;
}

inline contract::KdDescendOutRecord kd_descend(const contract::KdDescendInRecord& in) {
  const bool near = in.zero ? in.origin < in.split : in.t < t_plane(in.split, in.origin, in.reciprocal, in.shift);
  const std::uint32_t near_side = in.negative ? 1 : 0;
  return {.node = 2 * in.child + (near ? near_side : 1 - near_side)};
}

inline contract::LeafExitOutRecord leaf_exit(const contract::LeafExitInRecord& in) {
  contract::LeafExitOutRecord out;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (in.zero[axis]) continue;
    const unsigned face = 2 * axis + (in.negative[axis] ? 0 : 1);
    const auto t = t_plane(in.bound[face], in.origin[axis], in.reciprocal[axis], in.shift[axis]);
    if (out.exits && t >= out.t_exit) continue;
    out.exits = 1;
    out.t_exit = static_cast<std::int32_t>(t);
    out.face = face;
    out.plane = in.bound[face];
  }
  out.broken = out.exits && out.t_exit < in.t;
  return out;
}

inline contract::KdBacktrackOutRecord kd_backtrack(const contract::KdBacktrackInRecord& in) {
  contract::KdBacktrackOutRecord out;
  const bool left = in.node % 2 == 0;
  const bool near = in.face % 2 == 1 ? left : !left;
  out.bad = in.parent_axis == contract::kAxisLeaf;
  out.matched = in.parent_axis == in.face / 2 && in.parent_split == in.plane && near;
  out.node = out.matched ? 2 * in.parent_child + in.face % 2 : in.parent;
  out.finished = !out.matched && in.parent == 0;
  return out;
}

namespace detail {
template <typename Row, typename Point>
std::int64_t row(const Row& row, const Point& point, Wide offset) {
  Wide sum = offset;
  for (int i = 0; i < 3; ++i) sum += static_cast<Wide>(row[i]) * point[i];
  sum += Wide{1} << (contract::kCoefficientFrac - 1);
  return wrap(static_cast<std::int64_t>(sum >> contract::kCoefficientFrac), contract::kRowPositionBits);
}
}  // namespace detail

inline contract::TriTestOutRecord tri_test(const contract::TriTestInRecord& in) {
  const int align = contract::kCoefficientFrac + contract::kPositionFrac - contract::kOffsetFrac;
  const auto scale = [&](std::int32_t offset) { return static_cast<Wide>(offset) << align; };
  const std::int64_t ou = detail::row(in.u, in.origin, scale(in.offset_u));
  const std::int64_t ov = detail::row(in.v, in.origin, scale(in.offset_v));
  std::int64_t oz = detail::row(in.n, in.origin, scale(in.offset_n));
  const std::int64_t du = detail::row(in.u, in.direction, 0);
  const std::int64_t dv = detail::row(in.v, in.direction, 0);
  std::int64_t dz = detail::row(in.n, in.direction, 0);
  if (dz < 0) {
    dz = wrap(-dz, contract::kRowDirectionBits);
    oz = wrap(-oz, contract::kRowPositionBits);
  }
  const std::int64_t u = ou * dz - oz * du, v = ov * dz - oz * dv;
  const unsigned difference = (in.exponent_u - in.exponent_v) & ((1u << contract::kExponentBits) - 1);
  const Wide one = static_cast<Wide>(dz) << (contract::kPositionFrac + contract::kExponentBias);
  const Wide one_u = one >> in.exponent_u, one_v = one >> in.exponent_v;
  const Wide w = one_u - u - (static_cast<Wide>(v) >> difference);
  contract::TriTestOutRecord out;
  out.id = in.id;
  out.hit = dz > 0 && oz <= 0 && u >= -contract::kEpsUv && v >= -contract::kEpsUv && w >= -contract::kEpsW &&
            u <= one_u + contract::kEpsUv && v <= one_v + contract::kEpsUv && -oz < 2 * dz;
  if (!out.hit) return out;
  out.t = static_cast<std::uint32_t>((static_cast<Wide>(-oz) << contract::kCoefficientFrac) / dz);
  out.edge_u = u;
  out.edge_v = v;
  out.dz = static_cast<std::int32_t>(dz);
  out.exponent_u = in.exponent_u;
  out.exponent_v = in.exponent_v;
  return out;
}

inline std::uint32_t barycentric(std::int64_t edge, unsigned exponent, std::int64_t dz) {
  const std::uint32_t one = 1u << contract::kBarycentricFrac;
  if (edge <= 0) return 0;
  // u = edge 2^(exponent - bias) / dz with 24 fraction bits, and `edge` has 24 fraction bits more than `dz`.
  const auto numerator = static_cast<unsigned __int128>(edge) << exponent;  // below 2^(54 + 63)
  const auto denominator = static_cast<unsigned __int128>(dz) << contract::kExponentBias;
  if (numerator >= denominator << contract::kBarycentricFrac) return one;
  return static_cast<std::uint32_t>(numerator / denominator);
}

inline contract::HitRecord hit_finish(const contract::HitFinishInRecord& in) {
  contract::HitRecord out;
  out.status = in.status;
  out.id = contract::kNoTriangle;
  if (in.status != static_cast<std::uint32_t>(contract::kStatusHit)) return out;
  out.t = in.t;
  out.id = in.id;
  out.u = barycentric(in.edge_u, in.exponent_u, in.dz);
  out.v = barycentric(in.edge_v, in.exponent_v, in.dz);
  return out;
}

using golden::instance_enter;  // in integers already
using golden::world_t;

}  // namespace retrace::reference
