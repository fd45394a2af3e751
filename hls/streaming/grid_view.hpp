// What the kernels read of the header of a grid image (number contract, grid_header), its checks, and where a voxel's entry stands.
#pragma once
#include "../top/image_view.hpp"

namespace retrace::hls {

typedef ap_uint<512> line_t;         // a line of memory
typedef ap_uint<30> voxel_number_t;  // a resolution has 10 bits an axis

struct grid_view {
  ap_uint<32> voxel_offset, list_offset, triangle_offset;
  ap_uint<32> list_count, triangle_count;
  ap_uint<32> step_limit;
  position_t lower[3];
  position_t side[3];
  voxel_t resolution[3];
};

// 0, or a RetraceFault.
inline int read_grid(const word_t* grid, const ap_uint<32>& image_lines, grid_view& view) {
  // A grid of one voxel, which rays of an image that is none are set up in: nothing comes of them, but nothing is divided by 0 either.
NO_GRID:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    view.lower[axis] = 0;
    view.side[axis] = 1;
    view.resolution[axis] = 1;
  }
  view.voxel_offset = 0;
  view.list_offset = 0;
  view.triangle_offset = 0;
  view.list_count = 0;
  view.triangle_count = 0;
  view.step_limit = 0;
  if (image_lines < contract::kGridHeaderBytes / 64) return kFaultLayout;
  word_t words[kGridHeaderWords];
GRID_HEADER:
  for (int i = 0; i < kGridHeaderWords; ++i) {
    RT_PIPELINE(1)  // one word a clock
    words[i] = grid[i];
  }
  const grid_header_record header = unpack_grid_header(words);
  if (header.magic != contract::kGridMagic || header.version != contract::kGridVersion) return kFaultHeader;
  view.voxel_offset = header.voxel_offset;
  view.list_offset = header.list_offset;
  view.triangle_offset = header.triangle_offset;
  view.list_count = header.list_count;
  view.triangle_count = header.triangle_count;
  view.step_limit = header.step_limit;
  flag_t fits = 1;
AXES:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    view.lower[axis] = header.lower[axis];
    view.side[axis] = header.side[axis];
    view.resolution[axis] = header.resolution[axis];
    if (header.resolution[axis] == 0 || header.side[axis] <= 0) {
      fits = 0;
      view.side[axis] = 1;
    }
  }
  voxel_number_t voxels = header.resolution[0];
  voxels *= header.resolution[1];
  voxels *= header.resolution[2];
  fits = fits & section_fits(view.voxel_offset, voxels, 4, 30, image_lines) &
         section_fits(view.list_offset, view.list_count, 4, contract::kListIndexBits, image_lines) &
         section_fits(view.triangle_offset, view.triangle_count, contract::kTriangleBytes, contract::kTriangleIndexBits,
                      image_lines);
  return fits ? kFaultNone : kFaultLayout;
}

// A 32-bit entry of a section.
inline ap_uint<32> grid_entry(const word_t* memory, const ap_uint<32>& offset, const ap_uint<32>& index) {
  RT_INLINE
  const ap_uint<32> word = index >> 2;
  const word_t four = memory[word_address(offset, word, 1).to_uint64()];
  const ap_uint<2> within = index;
  ap_uint<7> place = within;
  place <<= 5;
  const word_t shifted = four >> place;
  return ap_uint<32>(shifted);
}

}  // namespace retrace::hls
