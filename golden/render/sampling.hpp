// Sample points for antialiasing, ambient occlusion and area lights: the (0, 2)-sequence of Sobol', scrambled per pixel by hashing.
// Source: B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, sections 3 to 5; warps: P. Shirley and K. Chiu, "A low
// distortion map between disk and square", JGT 2(3), 1997.
#pragma once
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

namespace retrace {

inline std::uint32_t hash_mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ x >> 16;
}
inline std::uint32_t hash_combine(std::uint32_t seed, std::uint32_t value) {
  return hash_mix(seed ^ (value * 0x9e3779b9u + 0x85ebca6bu + (seed << 6) + (seed >> 2)));
}

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
  x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
  x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
  return __builtin_bswap32(x);
}

/// Owen scrambling of a 32-bit fraction.
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reverse_bits(x);
}

/// Point `index` of the scrambled sequence with this seed, in [0, 1)^2.
inline glm::dvec2 sample_2d(std::uint32_t index, std::uint32_t seed) {
  index = owen_scramble(index, seed);
  std::uint32_t y = 0;  // second dimension of Sobol': direction numbers v, v ^ v >> 1, ...
  for (std::uint32_t i = index, v = 0x80000000u; i != 0; i >>= 1, v ^= v >> 1) {
    if (i & 1) y ^= v;
  }
  const std::uint32_t x = owen_scramble(reverse_bits(index), hash_combine(seed, 1));
  y = owen_scramble(y, hash_combine(seed, 2));
  return {x * 0x1p-32, y * 0x1p-32};
}

/// Uniform on the unit disk.
inline glm::dvec2 to_disk(const glm::dvec2& s) {
  const double a = 2 * s.x - 1, b = 2 * s.y - 1;
  if (a == 0 && b == 0) return {0.0, 0.0};
  constexpr double kQuarterPi = 0.78539816339744831;
  const bool wide = std::fabs(a) > std::fabs(b);
  const double r = wide ? a : b;
  const double phi = wide ? kQuarterPi * (b / a) : 2 * kQuarterPi - kQuarterPi * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

/// Two unit vectors that complete `n` to an orthonormal frame (T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017).
inline void make_frame(const glm::dvec3& n, glm::dvec3& s, glm::dvec3& t) {
  const double sign = std::copysign(1.0, n.z), a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  s = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  t = {b, sign + n.y * n.y * a, -n.y};
}

/// Cosine-weighted direction about `n`.
inline glm::dvec3 to_cosine_hemisphere(const glm::dvec2& sample, const glm::dvec3& n) {
  const glm::dvec2 d = to_disk(sample);
  glm::dvec3 s, t;
  make_frame(n, s, t);
  return s * d.x + t * d.y + n * std::sqrt(std::fmax(0.0, 1.0 - d.x * d.x - d.y * d.y));
}

}  // namespace retrace
