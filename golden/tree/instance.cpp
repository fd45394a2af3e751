#include "golden/tree/instance.hpp"

#include <algorithm>
#include <cmath>

#include "golden/scene/bounds.hpp"
#include "hls/include/contract.hpp"

namespace retrace {

double largest_stretch(const glm::dmat3& matrix) {
  // The largest eigenvalue of the symmetric matrix M^T M, by the trigonometric solution of its cubic (Smith 1961).
  const glm::dmat3 s = glm::transpose(matrix) * matrix;
  const double mean = (s[0][0] + s[1][1] + s[2][2]) / 3.0;
  const double off = s[1][0] * s[1][0] + s[2][0] * s[2][0] + s[2][1] * s[2][1];
  const glm::dmat3 rest = s - glm::dmat3(mean);
  const double p2 = rest[0][0] * rest[0][0] + rest[1][1] * rest[1][1] + rest[2][2] * rest[2][2] + 2.0 * off;
  const double p = std::sqrt(p2 / 6.0);
  if (!(p > 0.0)) return std::sqrt(mean);
  const double cosine = std::clamp(glm::determinant(rest / p) / 2.0, -1.0, 1.0);
  return std::sqrt(mean + 2.0 * p * std::cos(std::acos(cosine) / 3.0));
}

std::optional<contract::InstanceRecord> make_instance(const Placement& to_world, const std::array<std::int32_t, 6>& box,
                                                      std::uint32_t root, std::uint32_t first_id) {
  constexpr double kRowNorm = 1.0 - 0x1p-20;
  if (!(largest_stretch(to_world.linear) <= kInstanceStretch)) return std::nullopt;
  const glm::dmat3 linear = glm::inverse(to_world.linear);
  const glm::dvec3 offset = -(linear * to_world.offset);
  contract::InstanceRecord record;
  record.root = root;
  record.first_id = first_id;
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const glm::dvec3 row(linear[0][i], linear[1][i], linear[2][i]);
    const double norm = glm::length(row);
    if (!(norm < std::ldexp(kRowNorm, contract::kRowExponentMax))) return std::nullopt;
    int exponent = 0;
    while (norm >= std::ldexp(kRowNorm, exponent)) ++exponent;
    record.e[at] = static_cast<std::uint32_t>(exponent);
    const double unit = std::ldexp(1.0, contract::kInstanceCoefficientFrac - exponent);
    for (int j = 0; j < 3; ++j) {
      // A row that is one axis rounds to at most 2^31 (1 - 2^-20): it fits.
      record.m[3 * at + static_cast<std::size_t>(j)] = static_cast<std::int32_t>(std::llround(row[j] * unit));
    }
    const double constant = offset[i] * unit;
    if (!(std::abs(constant) < std::ldexp(1.0, contract::kInstanceOffsetBits - 1) - 1.0)) return std::nullopt;
    record.b[at] = std::llround(constant);
    constexpr std::int32_t kReach = static_cast<std::int32_t>(kObjectReach * (1 << contract::kPositionFrac));
    if (box[2 * at] < -kReach || box[2 * at + 1] > kReach) return std::nullopt;
  }
  record.box = coarse_box(box);
  return record;
}

Placement object_from_world(const contract::InstanceRecord& record) {
  Placement result;
  for (int row = 0; row < 3; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const int shift = static_cast<int>(record.e[at]) - contract::kInstanceCoefficientFrac;
    for (int column = 0; column < 3; ++column)
      result.linear[column][row] = std::ldexp(record.m[3 * at + static_cast<std::size_t>(column)], shift);
    result.offset[row] = std::ldexp(static_cast<double>(record.b[at]), shift);
  }
  return result;
}

std::array<std::int32_t, 6> coarse_box(const std::array<std::int32_t, 6>& root_box) {
  constexpr int kStep = contract::kPositionFrac - contract::kBoxFaceFrac;
  std::array<std::int32_t, 6> box{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box[2 * axis] = root_box[2 * axis] >> kStep;
    box[2 * axis + 1] = -(-root_box[2 * axis + 1] >> kStep);
  }
  return box;
}

std::array<std::int32_t, 6> world_box(const contract::InstanceRecord& record,
                                      const std::array<std::int32_t, 6>& root_box) {
  // What a walk over the top level is off by (docs/error-bounds.md, "instance_enter") and the doubles here.
  constexpr double kTopPad = 4.0, kUnit = 1 << contract::kPositionFrac, kMost = 1 << 30;
  const Placement placement = object_from_world(record);
  const glm::dmat3 back = glm::inverse(placement.linear);
  Bounds bounds;
  bounds.add_corners(root_box, [&](const glm::dvec3& corner) { return back * (corner - placement.offset); });
  std::array<std::int32_t, 6> box{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    box[2 * axis] = static_cast<std::int32_t>(std::clamp(std::floor(bounds.lower[i] * kUnit - kTopPad), -kMost, kMost));
    box[2 * axis + 1] =
        static_cast<std::int32_t>(std::clamp(std::ceil(bounds.upper[i] * kUnit + kTopPad), -kMost, kMost));
  }
  return box;
}

}  // namespace retrace
