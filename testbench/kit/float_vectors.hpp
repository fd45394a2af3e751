// Numbers that floating point goes wrong at, in the classes of TestFloat: every exponent near the ends, near 1 and near the width of the significand,
// with fractions of few bits, of few zeros, and any; pairs that cancel, nearly cancel, or lie as far apart as the significand is wide.
#pragma once
#include <array>
#include <cstdint>

#include "testbench/kit/random.hpp"

namespace retrace {

/// Bits of a number. Exponent fields of 0 and 255 are among them: they read as zero and as the greatest number.
inline std::uint32_t float_vector(Random& random) {
  constexpr std::array<std::uint32_t, 22> kExponents{0,   1,   2,   3,   63,  64,  102, 103, 104, 125, 126,
                                                     127, 128, 148, 149, 150, 151, 190, 191, 252, 253, 254};
  const std::uint64_t bits = random.bits();
  const auto draw = static_cast<std::uint32_t>(bits);
  const auto kind = static_cast<unsigned>(bits >> 32);
  std::uint32_t exponent = draw >> 23 & 255;
  if ((kind & 3) == 0) exponent = kExponents[(bits >> 40) % kExponents.size()];
  if ((kind & 3) == 1) exponent = 117 + exponent % 32;
  if ((kind & 255) == 2) exponent = 255;
  std::uint32_t fraction = draw & 0x7fffff;
  const auto place = static_cast<std::uint32_t>(bits >> 48) % 24;
  switch (kind >> 2 & 7) {
    case 0:
      fraction = 0;
      break;
    case 1:
      fraction = 0x7fffff;
      break;
    case 2:
      fraction = (1u << place) & 0x7fffff;
      break;
    case 3:
      fraction = ((1u << place) - 1) & 0x7fffff;
      break;
    case 4:
      fraction = ~((1u << place) - 1) & 0x7fffff;
      break;
    default:
      break;
  }
  return (static_cast<std::uint32_t>(bits >> 63) << 31) | exponent << 23 | fraction;
}

/// A second operand for `x`: often one that its sum or product with x is hard to round for.
inline std::uint32_t float_partner(Random& random, std::uint32_t x) {
  const std::uint64_t bits = random.bits();
  const auto exponent = static_cast<std::int64_t>(x >> 23 & 255);
  switch (bits & 7) {
    case 0:
      return x ^ 0x80000000u;  // cancels
    case 1:
      return (x ^ 0x80000000u) + static_cast<std::uint32_t>(bits >> 8 & 7) - 3;  // nearly
    case 2: {                                                                    // apart by up to 30 places
      const std::int64_t other = exponent - 15 + static_cast<std::int64_t>(bits >> 8 & 31);
      return (float_vector(random) & 0x807fffffu) | static_cast<std::uint32_t>(other & 255) << 23;
    }
    case 3: {  // a product near the ends of the range, or near 1
      const std::int64_t sum = ((bits >> 8 & 3) == 0   ? 127
                                : (bits >> 8 & 3) == 1 ? 127 + 254
                                                       : 254) +
                               static_cast<std::int64_t>(bits >> 16 & 7) - 4;
      return (float_vector(random) & 0x807fffffu) | static_cast<std::uint32_t>((sum - exponent) & 255) << 23;
    }
    default:
      return float_vector(random);
  }
}

}  // namespace retrace
