#include "brute_force.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "reference.hpp"

namespace retrace {
namespace {

constexpr std::size_t kChunk = 1024;
// Float rows and rays are good to 2^-22 and values stay below 8, so 1e-4 is far more than the float test can be wrong
// by.
constexpr float kMargin = 1e-4f;

struct FloatRay {
  float ox, oy, oz, dx, dy, dz;
};

/// keep[i] = 1 unless triangle i is surely missed. Written for the vectoriser.
__attribute__((target_clones("avx2,fma", "default"))) void filter(const FloatRay& ray, const float* const column[14],
                                                                  std::size_t count, unsigned char* keep) {
  const float *ux = column[0], *uy = column[1], *uz = column[2], *uo = column[3];
  const float *vx = column[4], *vy = column[5], *vz = column[6], *vo = column[7];
  const float *nx = column[8], *ny = column[9], *nz = column[10], *no = column[11];
  const float *scale_z = column[12], *scale_v = column[13];
  for (std::size_t i = 0; i < count; ++i) {
    const float du = ux[i] * ray.dx + uy[i] * ray.dy + uz[i] * ray.dz;
    const float dv = vx[i] * ray.dx + vy[i] * ray.dy + vz[i] * ray.dz;
    const float d = nx[i] * ray.dx + ny[i] * ray.dy + nz[i] * ray.dz;
    const float ou = ux[i] * ray.ox + uy[i] * ray.oy + uz[i] * ray.oz + uo[i];
    const float ov = vx[i] * ray.ox + vy[i] * ray.oy + vz[i] * ray.oz + vo[i];
    const float o = nx[i] * ray.ox + ny[i] * ray.oy + nz[i] * ray.oz + no[i];
    const float sign = d < 0.0f ? -1.0f : 1.0f;
    const float u = sign * (ou * d - o * du), v = sign * (ov * d - o * dv);
    const float w = sign * d * scale_z[i] - u - v * scale_v[i];
    const float front = -sign * o;  // distance to the plane, positive ahead
    const float least = std::min(std::min(u, v), std::min(w, front));
    // Where d' nearly vanishes its sign, and with it the sign of the rest, is in doubt.
    keep[i] = static_cast<unsigned char>((least >= -kMargin) | (std::abs(d) < kMargin));
  }
}

}  // namespace

BruteForce::BruteForce(const MemoryImage& image) {
  const std::uint32_t count = image.header().triangle_count;
  for (auto& column : columns_) column.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto t = image.triangle(i);
    triangles_.push_back(t);
    const auto put = [&](int column, double value) { columns_[column].push_back(static_cast<float>(value)); };
    for (int axis = 0; axis < 3; ++axis) {
      put(axis, std::ldexp(t.u[axis], -contract::kCoefficientFrac));
      put(4 + axis, std::ldexp(t.v[axis], -contract::kCoefficientFrac));
      put(8 + axis, std::ldexp(t.n[axis], -contract::kCoefficientFrac));
    }
    put(3, std::ldexp(t.offset_u, -contract::kOffsetFrac));
    put(7, std::ldexp(t.offset_v, -contract::kOffsetFrac));
    put(11, std::ldexp(t.offset_n, -contract::kOffsetFrac));
    put(12, std::ldexp(1.0, contract::kExponentBias - static_cast<int>(t.exponent_u)));
    put(13, std::ldexp(1.0, static_cast<int>(t.exponent_v) - static_cast<int>(t.exponent_u)));
  }
}

BruteForce::Result BruteForce::trace(const contract::RayRecord& ray, std::span<const std::uint32_t> without) const {
  const auto position = [](std::int32_t code) {
    return static_cast<float>(std::ldexp(code, -contract::kPositionFrac));
  };
  const auto direction = [](std::int32_t code) {
    return static_cast<float>(std::ldexp(code, -contract::kDirectionFrac));
  };
  const FloatRay fast{position(ray.origin[0]),     position(ray.origin[1]),     position(ray.origin[2]),
                      direction(ray.direction[0]), direction(ray.direction[1]), direction(ray.direction[2])};
  Result best;
  best.t = ray.t_max;
  contract::TriTestInRecord in;
  in.origin = ray.origin;
  in.direction = ray.direction;
  std::array<unsigned char, kChunk> keep;
  for (std::size_t base = 0; base < triangles_.size(); base += kChunk) {
    const std::size_t count = std::min(kChunk, triangles_.size() - base);
    const float* column[kColumns];
    for (int i = 0; i < kColumns; ++i) column[i] = columns_[i].data() + base;
    filter(fast, column, count, keep.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (!keep[i]) continue;
      const auto& t = triangles_[base + i];
      in.u = t.u;
      in.v = t.v;
      in.n = t.n;
      in.offset_u = t.offset_u;
      in.offset_v = t.offset_v;
      in.offset_n = t.offset_n;
      in.exponent_u = t.exponent_u;
      in.exponent_v = t.exponent_v;
      in.id = t.id;
      const auto hit = reference::tri_test(in);
      if (!hit.hit || hit.t > best.t || (hit.t == best.t && hit.id >= best.id)) continue;
      if (std::find(without.begin(), without.end(), hit.id) != without.end()) continue;
      best = {true, hit.t, hit.id, hit.dz};
    }
  }
  return best;
}

}  // namespace retrace
