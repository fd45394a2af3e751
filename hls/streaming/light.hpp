// What the kernels generate and shade of the streaming machine do with one ray: numbers for a note, light from one point, a bounce.
//
//   note     where a ray's light goes: pixel, and how much of each colour counts (UQ1.12), in one 64-bit word
//   point    p = o + floor(t d), off the surface by 2^-13 along the normal on the ray's side, inside the grid
//   shadow   l = light - p; the ray p + t (l 2^s), s so that the largest component is in [1/4, 1/2); it ends at the light, t = 2^(2 - s)
//            cos = floor(n . d 2^-10 / floor(|d| 2^-10)), of 4096, at most 4096; light = colour / 256 cos
//   bounce   from p along n + r, r a point in the unit ball by a hash of seed, pixel and number (the first of four points in the cube that lies in
//            the ball); 0.98 long, so that rounding leaves it below 1. More towards the normal than the cosine would have it.
//
// Source: Purcell et al. 2002, section 3 (Whitted's shadow ray, a diffuse bounce). Counterpart: testbench/streaming/light_model.hpp.
#pragma once
#include "../include/arithmetic.hpp"
#include "grid_view.hpp"

namespace retrace::hls {

static const int kWeightBits = 13;  // UQ1.12
static const int kWeightOne = 4096;
typedef ap_uint<kWeightBits> weight_t;
typedef ap_uint<64> note_word_t;

struct note {
  pixel_index_t pixel;
  weight_t weight[3];
  flag_t active;
};

inline note read_note(const note_word_t& bits) {
  RT_INLINE
  note n;
  n.pixel = bits;
  n.weight[0] = bits >> contract::kPixelIndexBits;
  n.weight[1] = bits >> (contract::kPixelIndexBits + kWeightBits);
  n.weight[2] = bits >> (contract::kPixelIndexBits + 2 * kWeightBits);
  n.active = bits >> (contract::kPixelIndexBits + 3 * kWeightBits);
  return n;
}

inline note_word_t write_note(const note& n) {
  RT_INLINE
  note_word_t bits = note_word_t(n.active);
  bits <<= kWeightBits;
  bits |= note_word_t(n.weight[2]);
  bits <<= kWeightBits;
  bits |= note_word_t(n.weight[1]);
  bits <<= kWeightBits;
  bits |= note_word_t(n.weight[0]);
  bits <<= contract::kPixelIndexBits;
  bits |= note_word_t(n.pixel);
  return bits;
}

// Root, rounded down, bit by bit.
inline ap_uint<16> root_of(const ap_uint<32>& square) {
  RT_INLINE
  ap_uint<32> left = square;
  ap_uint<32> root = 0;
ROOT:
  for (int bit = 15; bit >= 0; --bit) {
    RT_UNROLL
    ap_uint<32> step = root;
    step <<= 1;
    step |= ap_uint<32>(1u << bit);
    step <<= bit;
    if (left >= step) {
      left -= step;
      root |= ap_uint<32>(1u << bit);
    }
  }
  return ap_uint<16>(root);
}

inline ap_uint<32> mix(const ap_uint<32>& value) {
  RT_INLINE
  ap_uint<32> x = value;
  x ^= x >> 16;
  x *= ap_uint<32>(0x7feb352du);
  x ^= x >> 15;
  x *= ap_uint<32>(0x846ca68bu);
  x ^= x >> 16;
  return x;
}

// By how much a largest component goes up so that it lies in [2^24, 2^25); 0 for 0 and for what is above.
inline recip_shift_t shift_up(const ap_uint<32>& largest) {
  RT_INLINE
  recip_shift_t shift = 0;
RISE:
  for (int bit = 0; bit < 24; ++bit) {
    RT_UNROLL
    if (largest[bit]) shift = 24 - bit;
  }
  if (largest >= (1u << 24)) shift = 0;
  return shift;
}

struct lit_point {
  ray_setup_in_record shadow, bounce;
  note direct, shadow_note, bounce_note;
};

struct light_setting {
  ap_int<32> position[3];
  shade_t colour[3];
  ap_uint<32> seed;
};

// What a hit sends on. `number`: of the record in its stream.
inline lit_point light_hit(const ray_setup_out_record& ray, const hit_record& hit, const note& in,
                           const material_record& material, const flag_t& known, const grid_view& view,
                           const light_setting& light, const ap_uint<32>& number) {
  RT_INLINE
  lit_point out;
  out.direct = in;
  out.shadow_note = in;
  out.bounce_note = in;
  const flag_t hits = in.active & known & flag_t(hit.status == contract::kStatusHit);
  out.direct.active = hits & material.unlit;
  const flag_t lit = hits & flag_t(material.unlit == 0);
  out.shadow_note.active = lit;
  out.bounce_note.active = lit;

  // Weights: what the surface sends on.
WEIGHTS:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    ap_uint<32> weight = in.weight[a];
    ap_uint<32> colour = material.colour[a];
    colour += 1;
    weight *= colour;
    weight >>= 8;
    out.direct.weight[a] = weight;
    out.shadow_note.weight[a] = weight;
    out.bounce_note.weight[a] = weight;
  }

  // The normal on the ray's side, and the point.
  ap_int<64> along = 0;
ALONG:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    ap_int<64> product = material.normal[a];
    product *= ray.direction[a];
    along += product;
  }
  ap_int<32> normal[3];
  ap_int<32> point[3];
POINT:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    normal[a] = material.normal[a];
    if (along > 0) normal[a] = -normal[a];
    ap_int<64> way = hit.t;
    way *= ray.direction[a];
    way >>= contract::kDirectionFrac;
    point[a] = ray.origin[a];
    point[a] += ap_int<32>(way);
    point[a] += normal[a] >> 1;
    const ap_int<32> lowest = view.lower[a];
    ap_int<32> highest = view.side[a];
    highest *= view.resolution[a];
    highest += lowest;
    if (point[a] < lowest) point[a] = lowest;
    if (point[a] > highest) point[a] = highest;
    out.shadow.origin[a] = point[a];
    out.bounce.origin[a] = point[a];
    out.shadow.box[2 * a] = lowest;
    out.shadow.box[2 * a + 1] = highest;
    out.bounce.box[2 * a] = lowest;
    out.bounce.box[2 * a + 1] = highest;
  }

  // To the light.
  ap_int<32> to_light[3];
  ap_uint<32> largest = 0;
TO_LIGHT:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    to_light[a] = light.position[a] - point[a];
    ap_uint<32> size = to_light[a];
    if (to_light[a] < 0) size = -to_light[a];
    if (size > largest) largest = size;
  }
  const recip_shift_t up = shift_up(largest);
  if (largest == 0 || largest >= (1u << 25)) out.shadow_note.active = 0;
  ap_int<64> facing = 0;
  ap_uint<64> square = 0;
FACING:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    ap_int<64> d = to_light[a];
    d <<= up;
    out.shadow.direction[a] = d;
    ap_int<64> towards = normal[a];
    towards *= d;
    facing += towards;
    d *= d;
    square += ap_uint<64>(d);
  }
  ap_uint<32> high = square >> 20;
  const ap_uint<32> root = root_of(high);
  ap_uint<32> cosine = 0;
  if (facing <= 0 || root == 0) {
    out.shadow_note.active = 0;
  } else {
    ap_uint<64> numerator = ap_uint<64>(facing);
    numerator >>= 10;
    ap_uint<64> quotient = numerator / ap_uint<64>(root);
    if (quotient > kWeightOne) quotient = kWeightOne;
    cosine = quotient;
  }
LIGHT:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    ap_uint<64> strength = out.shadow_note.weight[a];
    ap_uint<32> colour = light.colour[a];
    colour += 1;
    strength *= cosine;
    strength *= colour;
    strength >>= 20;
    out.shadow_note.weight[a] = strength;
  }
  ap_uint<32> end = 1u << 26;
  end >>= up;
  out.shadow.t_max = end;
  out.shadow.any = 1;

  // The bounce.
  ap_uint<32> key = in.pixel;
  key *= ap_uint<32>(0x9e3779b1u);
  key += number;
  key ^= light.seed;
  ap_int<32> way[3];
  flag_t found = 0;
COPY_NORMAL:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    way[a] = normal[a];
  }
TRIES:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    ap_uint<32> next = key;
    next += ap_uint<32>(0x632be5abu * i);
    const ap_uint<32> hash = mix(next);
    ap_int<32> r0 = ap_int<32>(ap_uint<10>(hash));
    ap_int<32> r1 = ap_int<32>(ap_uint<10>(hash >> 10));
    ap_int<32> r2 = ap_int<32>(ap_uint<10>(hash >> 20));
    r0 -= 512;
    r1 -= 512;
    r2 -= 512;
    ap_int<32> distance = r0 * r0;
    distance += r1 * r1;
    distance += r2 * r2;
    if (!found && distance < 512 * 512) {
      found = 1;
      way[0] += r0 << 3;
      way[1] += r1 << 3;
      way[2] += r2 << 3;
    }
  }
  ap_int<32> length_square = 0;
LENGTH:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    length_square += way[a] * way[a];
  }
  const ap_uint<32> length = root_of(ap_uint<32>(length_square));
  ap_uint<64> inverse = 0;
  if (length < 64) {
    out.bounce_note.active = 0;
  } else {
    const ap_uint<64> one = 1077524023705ULL;  // 0.98 2^40
    inverse = one / ap_uint<64>(length);
  }
DIRECTION:
  for (int a = 0; a < 3; ++a) {
    RT_UNROLL
    ap_int<64> d = way[a];
    d *= ap_int<64>(inverse);
    d >>= 14;
    out.bounce.direction[a] = d;
  }
  out.bounce.t_max = (1u << contract::kTLimitBits) - 1;
  out.bounce.any = 0;
  return out;
}

}  // namespace retrace::hls
