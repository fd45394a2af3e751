// shade: from what became of a sample to a pixel.
//   facing = min(|n . l| >> 8, 2^16 - 1);  lit = min(256 ambient + (diffuse facing >> 8), 2^16 - 1)
//   strength = floor(sqrt(lit)), 255 where unlit;  component = colour (strength + 1) >> 8
// Colours are what a screen shows, which goes with the root of the light: so does the strength.
// Counterparts: golden/engine/stages/shade.hpp, rtl/ray/rt_light.sv, rtl/ray/rt_shade.sv.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

static const int kLitBits = 16;
typedef ap_uint<kLitBits> lit_t;
typedef ap_int<2 * contract::kNormalBits + 2> facing_sum_t;

// floor(sqrt(lit)), a bit at a time.
inline shade_t root_of(const lit_t& lit) {
  RT_INLINE
  shade_t root = 0;
ROOT:
  for (int i = 0; i < contract::kShadeBits; ++i) {
    RT_UNROLL
    shade_t trial = root;
    trial[contract::kShadeBits - 1 - i] = 1;
    ap_uint<kLitBits> square = trial;
    square *= trial;
    if (square <= lit) root = trial;
  }
  return root;
}

struct colour_t {
  shade_t part[3];
};

inline colour_t shade(const material_record& material, const frame_record& frame) {
  RT_INLINE
  facing_sum_t dot = 0;
TERMS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<2 * contract::kNormalBits> product = material.normal[i];
    product *= frame.light[i];
    dot += product;
  }
  if (dot < 0) dot = 0 - dot;
  dot >>= contract::kShadeBits;
  lit_t facing = dot;
  if (dot > (1 << kLitBits) - 1) facing = (1 << kLitBits) - 1;
  ap_uint<kLitBits + contract::kShadeBits> part = facing;
  part *= frame.diffuse;
  part >>= contract::kShadeBits;
  ap_uint<kLitBits + 1> sum = frame.ambient;
  sum <<= contract::kShadeBits;
  sum += part;
  lit_t lit = sum;
  if (sum > (1 << kLitBits) - 1) lit = (1 << kLitBits) - 1;
  shade_t root = root_of(lit);
  if (material.unlit) root = (1 << contract::kShadeBits) - 1;
  ap_uint<contract::kShadeBits + 1> strength = root;
  strength += 1;
  colour_t colour;
PARTS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_uint<2 * contract::kShadeBits + 1> shown = material.colour[i];
    shown *= strength;
    colour.part[i] = shown >> contract::kShadeBits;
  }
  return colour;
}

// t along the camera's ray; all ones without a hit.
inline ap_uint<32> camera_depth(const shade_in_record& sample) {
  RT_INLINE
  ap_uint<contract::kEntryStartBits + contract::kTFrac - contract::kEntryStartFrac + 1> sum = sample.start;
  sum <<= contract::kTFrac - contract::kEntryStartFrac;
  sum += sample.t;
  sum >>= sample.scale;
  ap_uint<32> depth = sum;
  if (!sample.hit) depth = 0xffffffffu;
  return depth;
}

}  // namespace retrace::hls
