// Kernel generate of the streaming machine: eye rays, row by row, one sample a pixel.
#include "../stages/raster.hpp"
#include "kernels.hpp"
#include "light.hpp"

extern "C" void stream_generate(hls::stream<retrace::hls::ray_setup_in_word_t>& rays,
                                hls::stream<retrace::hls::note_word_t>& notes, const retrace::hls::word_t* grid,
                                const retrace::hls::word_t* camera, const retrace::hls::word_t* frame,
                                ap_uint<32> image_lines, ap_uint<32> sample) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=notes
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#pragma HLS interface mode=m_axi port=camera offset=direct bundle=bus_camera
#pragma HLS interface mode=m_axi port=frame offset=direct bundle=bus_frame
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(camera, gmem_camera, RETRACE_COSIM_CAMERA_WORDS)
  RT_MEMORY(frame, gmem_frame, RETRACE_COSIM_FRAME_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(sample)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
  word_t camera_words[kCameraWords];
CAMERA:
  for (int i = 0; i < kCameraWords; ++i) {
    RT_PIPELINE(1)  // one word a clock
    camera_words[i] = camera[i];
  }
  word_t frame_words[kFrameWords];
FRAME:
  for (int i = 0; i < kFrameWords; ++i) {
    RT_PIPELINE(1)  // one word a clock
    frame_words[i] = frame[i];
  }
  const camera_record eye = unpack_camera(camera_words);
  const frame_record shape = unpack_frame(frame_words);
  position_t box[6];
BOX:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    box[2 * axis] = view.lower[axis];
    position_t upper = view.side[axis];
    upper *= view.resolution[axis];
    upper += view.lower[axis];
    box[2 * axis + 1] = upper;
  }
  ap_uint<2 * contract::kFrameSizeBits> left = shape.width;
  left *= shape.height;
  if (fault != kFaultNone || left > (1 << contract::kFramePixelsLog2)) left = 0;
  frame_size_t x = 0, y = 0;
  pixel_index_t pixel = 0;
EYE_RAYS:
  for (int i = 0; i < (1 << contract::kFramePixelsLog2); ++i) {
    RT_PIPELINE(1)  // one ray a clock
    if (left == 0) break;
    const raster_out_record made = raster(eye, shape, box, x, y, ap_uint<2>(sample), pixel);
    ray_setup_in_record ray;
    note n;
  AXES:
    for (int axis = 0; axis < 3; ++axis) {
      RT_UNROLL
      ray.origin[axis] = made.origin[axis];
      ray.direction[axis] = made.direction[axis];
      // A camera's ray begins where it enters the camera's own box, which may be a little outside of the grid.
      ray.box[2 * axis] = -(1 << (contract::kPositionBits - 1));
      ray.box[2 * axis + 1] = (1 << (contract::kPositionBits - 1)) - 1;
      n.weight[axis] = kWeightOne;
    }
    ray.t_max = made.t_max;
    ray.any = 0;
    n.pixel = pixel;
    n.active = made.enters & flag_t(made.bad == 0);
    const ray_setup_in_word_t ray_word = write_ray_setup_in(ray);
    const note_word_t note_word = write_note(n);
    rays.write(ray_word);
    notes.write(note_word);
    left -= 1;
    pixel += 1;
    x += 1;
    if (x == shape.width) {
      x = 0;
      y += 1;
    }
  }
}
