#include "golden/tree/instance.hpp"

#include <algorithm>
#include <cmath>

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
    // Outward, in steps of 2^-7.
    constexpr int kStep = contract::kPositionFrac - contract::kBoxFaceFrac;
    constexpr std::int32_t kReach = static_cast<std::int32_t>(kObjectReach * (1 << contract::kPositionFrac));
    if (box[2 * at] < -kReach || box[2 * at + 1] > kReach) return std::nullopt;
    record.box[2 * at] = box[2 * at] >> kStep;
    record.box[2 * at + 1] = -(-box[2 * at + 1] >> kStep);
  }
  return record;
}

}  // namespace retrace
