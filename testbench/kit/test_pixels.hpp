// Cameras, frames and materials of the tests: as a host makes them, with every field in use.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {

/// A root box inside [-7/8, 7/8]^3, flat now and then.
inline std::array<std::int32_t, 6> random_box(Random& random) {
  std::array<std::int32_t, 6> box{};
  constexpr std::int64_t kReach = 7 << (contract::kPositionFrac - 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t a = random.integer(-kReach, kReach),
                       b = random.chance(8) ? a + 2048 : random.integer(-kReach, kReach);
    box[2 * axis] = static_cast<std::int32_t>(std::min(a, b));
    box[2 * axis + 1] = static_cast<std::int32_t>(std::min(std::max(a, b), kReach));
  }
  return box;
}

/// A camera anywhere around the box, or in it, looking at a point of it, rolled.
inline contract::CameraRecord random_camera(Random& random, const std::array<std::int32_t, 6>& box) {
  using Vector = std::array<double, 3>;
  const auto cross = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto unit = [](Vector v) {
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (length < 1e-9) return Vector{0.6, 0.0, 0.8};
    for (double& c : v) c /= length;
    return v;
  };
  const double distance = std::exp2(random.real(-4, random.chance(4) ? 12 : 3));
  Vector eye{}, ahead{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double target = random.real(std::ldexp(box[2 * i], -24), std::ldexp(box[2 * i + 1], -24) + 1e-9);
    eye[i] = target + random.real(-distance, distance);
    ahead[i] = target - eye[i];
  }
  ahead = unit(ahead);
  // Along an axis now and then, so that directions of 0 occur.
  if (random.chance(6)) ahead = {random.chance(2) ? 1.0 : 0.0, 0.0, 0.0}, ahead[2] = ahead[0] == 0.0 ? -1.0 : 0.0;
  const Vector right = unit(cross(ahead, unit({random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)})));
  const Vector down = cross(right, ahead);

  contract::CameraRecord camera;
  camera.orthographic = random.chance(3);
  double deep = 2.0;
  while (deep < distance) deep *= 2.0;
  // A frame of 12 pixels or so has to see the box.
  const double wide = (camera.orthographic ? 1.0 : deep) * std::exp2(random.real(5, 10));
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector row{right[i] * wide, down[i] * wide, ahead[i] * deep};
    const double norm =
        std::max(std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]), std::abs(eye[i]) / 3.9);
    int exponent = 0;
    while (exponent < contract::kRowExponentMax && norm >= std::ldexp(0.999, exponent)) ++exponent;
    camera.e[i] = static_cast<std::uint32_t>(exponent);
    const auto code = [&](double value, double limit) {
      return std::llround(std::clamp(std::ldexp(value, contract::kInstanceCoefficientFrac - exponent), -limit, limit));
    };
    for (std::size_t j = 0; j < 3; ++j) camera.m[3 * i + j] = static_cast<std::int32_t>(code(row[j], 2147483647.0));
    camera.b[i] = code(eye[i], 8589934591.0);
    constexpr int kStep = contract::kPositionFrac - contract::kBoxFaceFrac;
    camera.box[2 * i] = box[2 * i] >> kStep;
    camera.box[2 * i + 1] = -(-box[2 * i + 1] >> kStep);
  }
  constexpr std::uint32_t kMost = (1u << contract::kTReachBits) - 1;
  camera.reach = random.chance(4) ? static_cast<std::uint32_t>(random.bits()) & kMost : kMost;
  return camera;
}

/// A frame of at most `side` pixels a side.
inline contract::FrameRecord random_frame(Random& random, std::uint32_t side) {
  contract::FrameRecord frame;
  const auto shade = [&] { return static_cast<std::uint32_t>(random.below(256)); };
  frame.width = 1 + static_cast<std::uint32_t>(random.below(side));
  frame.height = 1 + static_cast<std::uint32_t>(random.below(side));
  frame.tile_x = static_cast<std::uint32_t>(random.below(random.chance(4) ? 8 : 4));
  frame.tile_y = static_cast<std::uint32_t>(random.below(random.chance(4) ? 8 : 4));
  frame.kind = random.chance(2) ? 0 : static_cast<std::uint32_t>(random.below(4));
  if (frame.kind == 0) frame.samples = static_cast<std::uint32_t>(random.below(3));
  frame.shadows = random.chance(2);
  frame.ambient = shade();
  frame.diffuse = random.chance(4) ? 255 : shade();
  for (std::uint32_t& part : frame.background) part = shade();
  for (std::uint32_t& offset : frame.offset_x) offset = shade();
  for (std::uint32_t& offset : frame.offset_y) offset = shade();
  for (std::int32_t& part : frame.light) part = static_cast<std::int32_t>(random.integer(-4096, 4095));
  return frame;
}

/// How an instance is turned, or bits that turn nothing; its materials are anywhere.
inline contract::InstanceShadeRecord random_instance_shade(Random& random) {
  contract::InstanceShadeRecord record;
  for (std::int32_t& part : record.turn)
    part = random.chance(8) ? -1024 : static_cast<std::int32_t>(random.integer(-1024, 1023));
  record.material = static_cast<std::uint32_t>(random.bits()) & ((1u << contract::kMaterialIndexBits) - 1);
  return record;
}

inline contract::MaterialRecord random_material(Random& random) {
  contract::MaterialRecord material;
  for (std::int32_t& part : material.normal)
    part = random.chance(8) ? -4096 : static_cast<std::int32_t>(random.integer(-4096, 4095));
  for (std::uint32_t& part : material.colour)
    part = random.chance(4) ? 255 : static_cast<std::uint32_t>(random.below(256));
  material.unlit = random.chance(4);
  return material;
}

}  // namespace retrace
