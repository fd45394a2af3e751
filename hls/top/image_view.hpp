// What the kernels read of the header of a memory image, its checks, and addresses of records.
#pragma once
#include "../include/arithmetic.hpp"
#include "trace.hpp"

namespace retrace::hls {

static const int kLineWords = 4;  // 128-bit words in a 64-byte line
typedef ap_uint<34> address_t;    // word address: lines are counted in 32 bits

// What the header says, as the walk needs it.
struct image_view {
  ap_uint<32> pair_offset, leaf_offset, list_offset, triangle_offset;
  ap_uint<32> pair_count, leaf_count, list_count, triangle_count;
  ap_uint<32> instance_offset, instance_count;  // no instances in an image of one level
  flag_t two_levels;
  ap_uint<32> step_limit;
  position_t box[6];
};

// Is a section of `count` records of `size` bytes inside the image, and can an index of `index_bits` bits name every record?
inline flag_t section_fits(const ap_uint<32>& offset, const ap_uint<32>& count, int size, int index_bits,
                           const ap_uint<32>& lines) {
  RT_INLINE
  const ap_uint<32> most = 1u << index_bits;
  ap_uint<40> bytes = count;
  bytes *= ap_uint<8>(size);
  ap_uint<40> end = bytes;
  end += 63;
  end >>= 6;
  end += offset;
  return flag_t(end <= lines) & flag_t(count <= most);
}

inline int read_header(const word_t* pairs, const ap_uint<32>& image_lines, image_view& view) {
  if (image_lines < contract::kHeaderBytes / 64) return kFaultLayout;
  word_t words[kHeaderWords];
HEADER:
  for (int i = 0; i < kHeaderWords; ++i) {
    RT_PIPELINE(1)
    words[i] = pairs[i];
  }
  const header_record header = unpack_header(words);
  const flag_t two_levels = header.version == contract::kImageVersionTwoLevels;
  if (header.magic != contract::kImageMagic || (header.version != contract::kImageVersion && !two_levels))
    return kFaultHeader;
  view.pair_offset = header.pair_offset;
  view.leaf_offset = header.leaf_offset;
  view.list_offset = header.list_offset;
  view.triangle_offset = header.triangle_offset;
  view.pair_count = header.pair_count;
  view.leaf_count = header.leaf_count;
  view.list_count = header.list_count;
  view.triangle_count = header.triangle_count;
  view.two_levels = two_levels;
  view.instance_offset = 0;
  view.instance_count = 0;
  if (two_levels) {
    view.instance_offset = header.instance_offset;
    view.instance_count = header.instance_count;
  }
  view.step_limit = header.step_limit;
BOX:
  for (int face = 0; face < 6; ++face) {
    RT_UNROLL
    view.box[face] = header.box[face];
  }
  const flag_t fits =
      section_fits(view.pair_offset, view.pair_count, contract::kNodePairBytes, contract::kPairIndexBits, image_lines) &
      section_fits(view.leaf_offset, view.leaf_count, contract::kLeafBytes, contract::kPairIndexBits, image_lines) &
      section_fits(view.list_offset, view.list_count, 4, contract::kListIndexBits, image_lines) &
      section_fits(view.triangle_offset, view.triangle_count, contract::kTriangleBytes, contract::kTriangleIndexBits,
                   image_lines) &
      section_fits(view.instance_offset, view.instance_count, contract::kInstanceBytes, contract::kTriangleIndexBits,
                   image_lines);
  return fits ? kFaultNone : kFaultLayout;
}

inline address_t word_address(const ap_uint<32>& offset, const ap_uint<32>& index, int stride) {
  RT_INLINE
  address_t address = offset;
  address *= ap_uint<3>(kLineWords);
  address_t within = index;
  within *= ap_uint<3>(stride);
  address += within;
  return address;
}

}  // namespace retrace::hls
