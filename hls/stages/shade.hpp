// shade: from what became of a sample to a pixel.
//   l = light, or on an instance with a record floor(turn light 2^-10)
//   facing = min(|n . l| >> 8, 2^16 - 1), 0 in a shadow;  lit = min(256 ambient + (diffuse facing >> 8), 2^16 - 1)
//   strength = floor(sqrt(lit)), 255 where unlit;  component = colour (strength + 1) >> 8
// Colours are what a screen shows, which goes with the root of the light: so does the strength.
// Counterparts: golden/engine/stages/shade.hpp, rtl/ray/rt_light.sv, rtl/ray/rt_shade.sv.
#pragma once
#include "../include/arithmetic.hpp"

namespace retrace::hls {

static const int kLitBits = 16;
typedef ap_uint<kLitBits> lit_t;
static const int kTurnedBits = contract::kNormalBits + 2;  // a light that a record of random bits has turned
typedef ap_int<kTurnedBits> turned_t;
typedef ap_int<contract::kNormalBits + kTurnedBits + 2> facing_sum_t;

struct light_t {
  turned_t axis[3];
};

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

inline light_t light_of(const frame_record& frame) {
  RT_INLINE
  light_t light;
AXES:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    light.axis[i] = frame.light[i];
  }
  return light;
}

// As an object sees it that is turned so.
inline light_t turned_light(const instance_shade_record& record, const frame_record& frame) {
  RT_INLINE
  light_t light;
ROWS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<contract::kTurnBits + contract::kNormalBits + 2> sum = 0;
  TERMS:
    for (int j = 0; j < 3; ++j) {
      RT_UNROLL
      ap_int<contract::kTurnBits + contract::kNormalBits> product = record.turn[3 * i + j];
      product *= frame.light[j];
      sum += product;
    }
    sum >>= contract::kTurnFrac;
    light.axis[i] = sum;
  }
  return light;
}

inline colour_t shade(const material_record& material, const frame_record& frame, const light_t& light,
                      const flag_t& shadow) {
  RT_INLINE
  facing_sum_t dot = 0;
TERMS:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    ap_int<contract::kNormalBits + kTurnedBits> product = material.normal[i];
    product *= light.axis[i];
    dot += product;
  }
  if (shadow) dot = 0;
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
