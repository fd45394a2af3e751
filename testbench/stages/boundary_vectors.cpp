#include "boundary_vectors.hpp"

#include <algorithm>

#include "hls/include/contract.hpp"

namespace retrace::cosim {
namespace {

constexpr int kHalfBit = contract::kCoefficientFrac - 1;  // a coefficient of one half
constexpr std::int64_t kRowLimit = std::int64_t{1} << (contract::kRowPositionBits - 2);

std::int64_t near(Random& random, std::int64_t value) { return value + random.integer(-1, 1); }

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b != 0 && (a < 0) != (b < 0)); }

}  // namespace

contract::TriTestInRecord tri_test_boundary_vector(Random& random) {
  // With every row one half of a unit vector and the origin 0: o' is the offset, d' half the direction.
  contract::TriTestInRecord in;
  in.u = {1 << kHalfBit, 0, 0};
  in.v = {0, 1 << kHalfBit, 0};
  in.n = {0, 0, 1 << kHalfBit};
  in.id = static_cast<std::uint32_t>(random.bits());

  // o'z = -1 (or 0) makes U = o'u d'z + d'u (or o'u d'z), so that any U and V can be had from a d'z that is large
  // enough.
  const std::int64_t dz = std::max<std::int64_t>(1, (std::int64_t{1} << random.below(contract::kRowDirectionBits - 1)) -
                                                        1 + random.integer(-1, 1) * random.integer(0, 2));
  in.exponent_v = static_cast<std::uint32_t>(random.below(12));
  in.exponent_u = in.exponent_v + static_cast<std::uint32_t>(random.below(random.chance(4) ? 40 : 4));
  const std::int64_t one = dz << (contract::kPositionFrac + contract::kExponentBias);
  const std::int64_t one_u = one >> in.exponent_u, one_v = one >> in.exponent_v;
  const unsigned difference = in.exponent_u - in.exponent_v;
  const std::int64_t inside_v = static_cast<std::int64_t>(random.real(0, 1) * static_cast<double>(one_v));
  const std::int64_t inside_u = static_cast<std::int64_t>(
      random.real(0, 1) * static_cast<double>(std::max<std::int64_t>(one_u - (inside_v >> difference), 0)));
  std::int64_t u = inside_u, v = inside_v, oz = -1, z = dz;
  switch (random.below(9)) {
    case 0:
      u = near(random, -contract::kEpsUv);
      break;
    case 1:
      v = near(random, -contract::kEpsUv);
      break;
    case 2:
      u = near(random, one_u + contract::kEpsUv);
      v = random.chance(2) ? 0 : -contract::kEpsUv;
      break;
    case 3:
      v = near(random, one_v + contract::kEpsUv);
      u = random.chance(2) ? 0 : -contract::kEpsUv;
      break;
    case 4:
    case 5:  // W at its end
      u = near(random, one_u - (v >> difference) + contract::kEpsW);
      break;
    case 6:
      oz = near(random, 0);
      break;
    case 7:
      oz = -near(random, 2 * dz);
      break;
    default:
      z = near(random, 0);
      break;
  }

  // U = o'u z - oz d'u for the given z and oz; what does not fit wraps and is a random vector.
  const auto solve = [&](std::int64_t edge, std::int64_t& o, std::int64_t& d) {
    const std::int64_t divisor = z == 0 ? 1 : z;
    o = floor_div(edge, divisor);
    d = oz == -1 ? edge - o * divisor : random.integer(-4, 4);
  };
  std::int64_t ou = 0, du = 0, ov = 0, dv = 0;
  solve(u, ou, du);
  solve(v, ov, dv);
  const bool flip = random.chance(2);  // both signs of n
  const auto offset = [](std::int64_t o) {
    return static_cast<std::int32_t>(std::clamp(o, -kRowLimit, kRowLimit) *
                                     (1 << (contract::kOffsetFrac - contract::kPositionFrac)));
  };
  const auto direction = [](std::int64_t d) {
    return static_cast<std::int32_t>(2 * std::clamp<std::int64_t>(d, -(1 << (contract::kDirectionFrac - 1)),
                                                                  (1 << (contract::kDirectionFrac - 1)) - 1));
  };
  in.offset_u = offset(ou);
  in.offset_v = offset(ov);
  in.offset_n = offset(flip ? -oz : oz);
  in.direction = {direction(du), direction(dv), direction(flip ? -z : z)};
  return in;
}

contract::TriTestInRecord tri_test_rounding_vector(Random& random) {
  // Coefficients and points are powers of two times small odd numbers, so that the bits below the result are 10...0 or
  // next to it.
  contract::TriTestInRecord in;
  const auto odd = [&](int bits) {
    const auto shift = random.below(static_cast<std::uint64_t>(bits));
    const std::int64_t value = static_cast<std::int64_t>(2 * random.below(4) + 1) << shift;
    return static_cast<std::int32_t>(random.chance(2) ? -value : value);
  };
  for (auto* row : {&in.u, &in.v, &in.n})
    for (auto& coefficient : *row) coefficient = random.chance(3) ? 0 : odd(24);
  for (auto& x : in.origin) x = odd(23);
  for (auto& x : in.direction) x = odd(23);
  const int align = contract::kOffsetFrac - contract::kPositionFrac;
  for (auto* offset : {&in.offset_u, &in.offset_v, &in.offset_n})
    *offset = static_cast<std::int32_t>(random.integer(-(1 << 20), 1 << 20)) * (1 << align) +
              (random.chance(2) ? 1 << (align - 1) : 0) +
              (random.chance(4) ? static_cast<std::int32_t>(random.integer(-1, 1)) : 0);
  // Tolerances of a triangle as large as the box, so that a good part of these are hits and show all their numbers.
  in.exponent_u = in.exponent_v = 0;
  in.id = static_cast<std::uint32_t>(random.bits());
  return in;
}

}  // namespace retrace::cosim
