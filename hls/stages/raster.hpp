// raster: the ray of a sample of a frame, from a camera.
//   x = 256 px + offset_x - 128 width, y likewise: place in the frame from its middle, in 1/256 of a pixel
//   perspective: from (0, 0, 0) towards (x, y, 2^19) 2^-20; orthographic: from (x, y, 0) 2^-20 towards (0, 0, 2^19) 2^-20
//   then instance_enter with the camera's transform; passed by where the origin lies outside of the root box on some axis and the direction
//   does not lead back
// Counterparts: golden/engine/stages/raster.hpp, rtl/ray/rt_raster.sv.
#pragma once
#include "instance_enter.hpp"

namespace retrace::hls {

static const int kCameraFrac = 20;  // fraction bits of a place in the frame as a coordinate of the camera's ray
static const int kPlaceLog2 = 8;    // places in a pixel

inline camera_step_t camera_place(const frame_size_t& pixel, const shade_t& offset, const frame_size_t& size) {
  RT_INLINE
  ap_int<contract::kFrameSizeBits + kPlaceLog2 + 1> place = pixel;
  place <<= kPlaceLog2;
  place += offset;
  ap_int<contract::kFrameSizeBits + kPlaceLog2 + 1> middle = size;
  middle <<= kPlaceLog2 - 1;
  place -= middle;
  return camera_step_t(place);
}

inline raster_out_record raster(const camera_record& camera, const frame_record& frame, const position_t box[6],
                                const frame_size_t& px, const frame_size_t& py, const ap_uint<2>& sample,
                                const pixel_index_t& pixel) {
  RT_INLINE
  instance_enter_in_record in;
ROWS_IN:
  for (int i = 0; i < 9; ++i) {
    RT_UNROLL
    in.m[i] = camera.m[i];
  }
AXES_IN:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    in.b[i] = camera.b[i];
    in.e[i] = camera.e[i];
    in.box[2 * i] = camera.box[2 * i];
    in.box[2 * i + 1] = camera.box[2 * i + 1];
    in.origin[i] = 0;
    in.direction[i] = 0;
  }
  in.reach = camera.reach;
  const shade_t offset_x = frame.offset_x[sample.to_uint()];
  const shade_t offset_y = frame.offset_y[sample.to_uint()];
  const camera_step_t x = camera_place(px, offset_x, frame.width);
  const camera_step_t y = camera_place(py, offset_y, frame.height);
  if (camera.orthographic) {
    in.origin[0] = x;
    in.origin[1] = y;
    in.origin[0] <<= contract::kPositionFrac - kCameraFrac;
    in.origin[1] <<= contract::kPositionFrac - kCameraFrac;
  } else {
    in.direction[0] = x;
    in.direction[1] = y;
    in.direction[0] <<= contract::kDirectionFrac - kCameraFrac;
    in.direction[1] <<= contract::kDirectionFrac - kCameraFrac;
  }
  in.direction[2] = 1 << (contract::kDirectionFrac - 1);

  const instance_enter_out_record entry = instance_enter(in);
  raster_out_record out;
  out.pixel = pixel;
  out.bad = entry.bad;
  flag_t enters = entry.enters;
OUTSIDE:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    if (entry.origin[i] < box[2 * i] && entry.direction[i] <= 0) enters = 0;
    if (entry.origin[i] > box[2 * i + 1] && entry.direction[i] >= 0) enters = 0;
  }
AXES_OUT:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    out.origin[i] = 0;
    out.direction[i] = 0;
    if (enters) {
      out.origin[i] = entry.origin[i];
      out.direction[i] = entry.direction[i];
    }
  }
  out.enters = enters;
  out.t_max = 0;
  out.scale = 0;
  out.start = 0;
  if (enters) {
    out.t_max = entry.t_max;
    out.scale = entry.scale;
    out.start = entry.start;
  }
  return out;
}

}  // namespace retrace::hls
