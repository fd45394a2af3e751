// raster, golden: the ray of a sample of a frame, from a camera. Exact integers.
//   x = 256 px + offset_x - 128 width, y likewise: place in the frame from its middle, in 1/256 of a pixel, at most 2^19
//   perspective:   camera's ray from (0, 0, 0) towards (x, y, 2^19) 2^-20
//   orthographic:  from (x, y, 0) 2^-20 towards (0, 0, 2^19) 2^-20
//   then instance_enter with the camera's transform: a camera sees the scene as a ray of the world sees an object
//   passed by where the origin lies outside of the root box on some axis and the direction does not lead back: what is left meets an exit plane
//   at t >= 0 in the first leaf, so that no walk is broken
// Counterparts: hls/stages/raster.hpp, rtl/ray/rt_raster.sv.
#pragma once
#include <array>
#include <cstdint>

#include "golden/contract/contract_records.hpp"
#include "golden/engine/stages/instance_enter.hpp"
#include "hls/include/contract.hpp"

namespace retrace::golden {

/// Fraction bits of a place in the frame where it is a coordinate of the camera's ray.
inline constexpr int kCameraFrac = 20;

/// Whether a frame can be drawn: sizes, samples and kind within the contract, several samples only where they have a mean.
inline bool frame_fits(const contract::FrameRecord& frame) {
  constexpr std::uint32_t kSide = 1u << contract::kFrameSizeLog2;
  return frame.width >= 1 && frame.height >= 1 && frame.width <= kSide && frame.height <= kSide &&
         std::uint64_t{frame.width} * frame.height <= std::uint64_t{1} << contract::kFramePixelsLog2 &&
         frame.samples <= contract::kSamplesLog2Max && frame.kind <= contract::kPixelHit &&
         (frame.samples == 0 || frame.kind == contract::kPixelColour);
}

/// The ray of sample `sample` of pixel (px, py).
inline contract::RasterOutRecord raster(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                        const std::array<std::int32_t, 6>& box, std::uint32_t px, std::uint32_t py,
                                        std::uint32_t sample) {
  contract::InstanceEnterInRecord in;
  in.m = camera.m;
  in.b = camera.b;
  in.e = camera.e;
  in.box = camera.box;
  in.reach = camera.reach;
  const auto place = [](std::uint32_t pixel, std::uint32_t offset, std::uint32_t size) {
    return static_cast<std::int32_t>(256 * pixel + offset) - static_cast<std::int32_t>(128 * size);
  };
  const std::int32_t x = place(px, frame.offset_x[sample], frame.width);
  const std::int32_t y = place(py, frame.offset_y[sample], frame.height);
  const bool orthographic = camera.orthographic != 0;
  auto& at = orthographic ? in.origin : in.direction;
  const int frac = orthographic ? contract::kPositionFrac : contract::kDirectionFrac;
  at[0] = x * (1 << (frac - kCameraFrac));
  at[1] = y * (1 << (frac - kCameraFrac));
  in.direction[2] = 1 << (contract::kDirectionFrac - 1);

  const contract::InstanceEnterOutRecord entry = instance_enter(in);
  contract::RasterOutRecord out;
  out.pixel = py * frame.width + px;
  out.bad = entry.bad;
  out.enters = entry.enters;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (entry.origin[axis] < box[2 * axis] && entry.direction[axis] <= 0) out.enters = 0;
    if (entry.origin[axis] > box[2 * axis + 1] && entry.direction[axis] >= 0) out.enters = 0;
  }
  if (out.enters == 0) return out;
  out.origin = entry.origin;
  out.direction = entry.direction;
  out.t_max = entry.t_max;
  out.scale = entry.scale;
  out.start = entry.start;
  return out;
}

/// Calls visit(px, py) for the pixels of a frame that fits, in its order: tiles in rows, pixels of a tile in rows.
template <class Visit>
void for_each_pixel(const contract::FrameRecord& frame, const Visit& visit) {
  for (std::uint32_t band = 0; band < frame.height; band += 1u << frame.tile_y)
    for (std::uint32_t tile = 0; tile < frame.width; tile += 1u << frame.tile_x)
      for (std::uint32_t y = band; y < frame.height && y >> frame.tile_y == band >> frame.tile_y; ++y)
        for (std::uint32_t x = tile; x < frame.width && x >> frame.tile_x == tile >> frame.tile_x; ++x) visit(x, y);
}

}  // namespace retrace::golden
