// See pixels.hpp.
#include "pixels.hpp"

#include "../stages/raster.hpp"
#include "../stages/shade.hpp"
#include "../stages/shadow.hpp"
#include "image_view.hpp"

namespace retrace::hls {

static const int kPixelsCountBits = contract::kFramePixelsLog2 + contract::kSamplesLog2Max + 1;
typedef ap_uint<kPixelsCountBits> pixel_count_t;
static const int kMostSamples = 1 << (contract::kFramePixelsLog2 + contract::kSamplesLog2Max);

inline frame_record read_frame(const word_t* frame) {
  word_t words[kFrameWords];
FRAME:
  for (int i = 0; i < kFrameWords; ++i) {
    RT_PIPELINE(1)
    words[i] = frame[i];
  }
  return unpack_frame(words);
}

// Pixels of a frame that can be drawn, 0 of any other.
inline pixel_count_t pixels_of(const frame_record& frame) {
  RT_INLINE
  ap_uint<2 * contract::kFrameSizeBits> area = frame.width;
  area *= frame.height;
  const flag_t fits = frame.width <= (1 << contract::kFrameSizeLog2) &&
                      frame.height <= (1 << contract::kFrameSizeLog2) && area <= (1 << contract::kFramePixelsLog2) &&
                      frame.samples <= contract::kSamplesLog2Max && frame.kind <= contract::kPixelHit &&
                      (frame.samples == 0 || frame.kind == contract::kPixelColour);
  pixel_count_t pixels = 0;
  if (fits) pixels = area;
  return pixels;
}

}  // namespace retrace::hls

extern "C" void retrace_raster(const retrace::hls::word_t* image, const retrace::hls::word_t* camera,
                               const retrace::hls::word_t* frame, hls::stream<retrace::hls::raster_out_word_t>& samples,
                               ap_uint<64>* summary, ap_uint<32> image_lines) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=samples
  RT_MEMORY(image, gmem_image, 8)
  RT_MEMORY(camera, gmem_image, 4)
  RT_MEMORY(frame, gmem_image, 2)
  RT_MEMORY(summary, gmem_summary, kPixelsWords)
  RT_CONTROL(image_lines)
  RT_CONTROL(return)
  // clang-format on
  image_view view;
  int fault = read_header(image, image_lines, view);
  word_t camera_words[kCameraWords];
CAMERA:
  for (int i = 0; i < kCameraWords; ++i) {
    RT_PIPELINE(1)
    camera_words[i] = camera[i];
  }
  const camera_record eye = unpack_camera(camera_words);
  const frame_record shape = read_frame(frame);
  pixel_count_t left = pixels_of(shape);
  if (fault == kFaultNone && left == 0) fault = kFaultFrame;
  if (fault != kFaultNone) left = 0;
  left <<= shape.samples;
  const ap_uint<64> total = left;

  // A place in the frame: the sample, its pixel, the tile and the row of tiles that hold it.
  ap_uint<64> odd = 0;
  frame_size_t x = 0, y = 0, tile_x = 0, tile_y = 0;
  pixel_index_t row = 0, tile_row = 0;  // first pixels of the row at hand, and of the first row of the tile
  ap_uint<2> sample = 0;
SAMPLES:
  for (int turn = 0; turn < kMostSamples; ++turn) {
    RT_PIPELINE(1)
    if (left == 0) break;
    pixel_index_t pixel = row;
    pixel += x;
    const raster_out_record ray = raster(eye, shape, view.box, x, y, sample, pixel);
    const raster_out_word_t word = write_raster_out(ray);
    samples.write(word);
    if (ray.bad) odd += 1;
    left -= 1;
    ap_uint<3> last_sample = 1;
    last_sample <<= shape.samples;
    last_sample -= 1;
    sample += 1;
    if (sample == ap_uint<2>(last_sample + 1)) {
      sample = 0;
      frame_size_t tile_right = 1;
      tile_right <<= shape.tile_x;
      tile_right += tile_x;
      frame_size_t tile_below = 1;
      tile_below <<= shape.tile_y;
      tile_below += tile_y;
      frame_size_t next_x = x;
      next_x += 1;
      frame_size_t next_y = y;
      next_y += 1;
      x = next_x;
      if (next_x == tile_right || next_x == shape.width) {
        x = tile_x;
        y = next_y;
        row += shape.width;
        if (next_y == tile_below || next_y == shape.height) {
          if (next_x == shape.width) {  // the next row of tiles
            tile_x = 0;
            tile_y = next_y;
            tile_row = row;
          } else {
            tile_x = next_x;
            row = tile_row;
          }
          x = tile_x;
          y = tile_y;
        }
      }
    }
  }
  summary[kPixelsStatus] = fault;
  summary[kPixelsSamples] = total;
  summary[kPixelsOdd] = odd;
}

extern "C" void retrace_shade(const retrace::hls::word_t* frame, const retrace::hls::word_t* materials,
                              hls::stream<retrace::hls::shade_in_word_t>& samples, ap_uint<32>* pixels,
                              ap_uint<64>* summary, ap_uint<32> material_count, ap_uint<32> instance_count) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=samples
  RT_MEMORY(frame, gmem_frame, 2)
  RT_MEMORY(materials, gmem_materials, 1024)
  RT_MEMORY(pixels, gmem_pixels, 4096)
  RT_MEMORY(summary, gmem_summary, kPixelsWords)
  RT_CONTROL(material_count)
  RT_CONTROL(instance_count)
  RT_CONTROL(return)
  // clang-format on
  const frame_record shape = read_frame(frame);
  pixel_count_t left = pixels_of(shape);
  ap_uint<64> fault = kFaultNone;
  if (left == 0) fault = kFaultFrame;
  left <<= shape.samples;
  const ap_uint<64> total = left;
  ap_uint<3> last_sample = 1;
  last_sample <<= shape.samples;
  last_sample -= 1;

  ap_uint<64> odd = 0;
  ap_uint<2> sample = 0;
  ap_uint<contract::kShadeBits + contract::kSamplesLog2Max> sum[3];
  RT_PARTITION(sum)
SAMPLES:
  for (int turn = 0; turn < kMostSamples; ++turn) {
    RT_PIPELINE(1)
    if (left == 0) break;
    const shade_in_word_t word = samples.read();
    const shade_in_record in = read_shade_in(word);
    colour_t colour;
    const flag_t coloured = shape.kind == contract::kPixelColour;
    light_t light = light_of(shape);
    ap_uint<32> index = in.id;
    if (in.hit && coloured && in.number < instance_count) {
      word_t words[kInstanceShadeWords];
      words[0] = materials[in.number.to_uint()];
      const instance_shade_record record = unpack_instance_shade(words);
      light = turned_light(record, shape);
      material_index_t place = in.id;
      place += record.material;
      index = place;
    }
    const flag_t known = index < material_count;
    const flag_t lit = in.hit & known & coloured;
    if (in.hit && !known && coloured) odd += 1;
    if (lit) {
      word_t material_words[kMaterialWords];
      const word_t two = materials[(index >> 1).to_uint()];
      material_words[0] = two;
      if (index[0] == 1) material_words[0] = two >> 64;
      const material_record material = unpack_material(material_words);
      colour = shade(material, shape, light, in.shadow);
    } else {
    BACKGROUND:
      for (int i = 0; i < 3; ++i) {
        RT_UNROLL
        colour.part[i] = shape.background[i];
      }
    }
  SUM:
    for (int i = 0; i < 3; ++i) {
      RT_UNROLL
      if (sample == 0) sum[i] = 0;
      sum[i] += colour.part[i];
    }
    left -= 1;
    if (sample == ap_uint<2>(last_sample)) {
      sample = 0;
      ap_uint<32> first = 0xff;
    MEAN:
      for (int i = 0; i < 3; ++i) {
        RT_UNROLL
        const ap_uint<32> mean = sum[2 - i] >> shape.samples;
        first <<= contract::kShadeBits;
        first |= mean;
      }
      triangle_id_t id = contract::kNoTriangle;
      if (in.hit) id = in.id;
      if (shape.kind == contract::kPixelId) first = id;
      if (shape.kind == contract::kPixelDepth || shape.kind == contract::kPixelHit) first = camera_depth(in);
      ap_uint<contract::kPixelIndexBits + 1> place = in.pixel;
      if (shape.kind == contract::kPixelHit) {
        place <<= 1;
        pixels[place.to_uint() + 1] = id;
      }
      pixels[place.to_uint()] = first;
    } else {
      sample += 1;
    }
  }
  summary[kPixelsStatus] = fault;
  summary[kPixelsSamples] = total;
  summary[kPixelsOdd] = odd;
}

extern "C" void retrace_shadow(const retrace::hls::word_t* image, const retrace::hls::word_t* frame,
                               hls::stream<retrace::hls::raster_out_word_t>& samples,
                               hls::stream<retrace::hls::shade_in_word_t>& hits,
                               hls::stream<retrace::hls::raster_out_word_t>& rays, ap_uint<64>* summary,
                               ap_uint<32> image_lines) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=samples
#pragma HLS interface mode=axis port=hits
#pragma HLS interface mode=axis port=rays
  RT_MEMORY(image, gmem_image, 8)
  RT_MEMORY(frame, gmem_image, 2)
  RT_MEMORY(summary, gmem_summary, kPixelsWords)
  RT_CONTROL(image_lines)
  RT_CONTROL(return)
  // clang-format on
  image_view view;
  int fault = read_header(image, image_lines, view);
  const frame_record shape = read_frame(frame);
  pixel_count_t left = pixels_of(shape);
  if (fault == kFaultNone && left == 0) fault = kFaultFrame;
  if (fault != kFaultNone) left = 0;
  left <<= shape.samples;
  const ap_uint<64> total = left;
  ap_uint<64> odd = 0;
SAMPLES:
  for (int turn = 0; turn < kMostSamples; ++turn) {
    RT_PIPELINE(1)
    if (left == 0) break;
    const raster_out_word_t sample_word = samples.read();
    const shade_in_word_t hit_word = hits.read();
    const raster_out_record sample = read_raster_out(sample_word);
    const shade_in_record hit = read_shade_in(hit_word);
    raster_out_record ray = shadow(sample, hit.t, shape, view.box);
    ray.enters = ray.enters & hit.hit & shape.shadows & flag_t(shape.kind == contract::kPixelColour);
    const raster_out_word_t word = write_raster_out(ray);
    rays.write(word);
    if (ray.enters) odd += 1;
    left -= 1;
  }
  summary[kPixelsStatus] = fault;
  summary[kPixelsSamples] = total;
  summary[kPixelsOdd] = odd;
}
