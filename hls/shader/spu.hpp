// The machine of the shader unit, one instruction of one thread a call: decodes the word, reads, computes, writes, and says where the thread goes on.
//   State      A thread's registers are one array of slots: 64 of the stack, which the window moves over, then those from I0 to HIT, P and ADDR.
//   Order      What an instruction reads is read before it writes, except what a trace and a call of a material take: E0 to E2, ADDR.
//   Faults     End the thread with a status; what was written before the fault stays written.
//   Memory     memory_vectors words of four numbers; nothing else is read or written.
//   Numbers    float.hpp. Words of memory and constants may hold any bits; they are read as numbers (float_canonical).
// Counterparts: golden/shader/machine.cpp, rtl/shader/rt_spu.sv.
#pragma once
#include "float.hpp"

namespace retrace::hls {

static const int kSpuFixed = shader::kStackRegisters;                                 // slot of I0
static const int kSpuP = kSpuFixed + shader::kRegisterHit + 1 - shader::kRegisterI0;  // behind HIT
static const int kSpuAddr = kSpuP + 1;
static const int kSpuSlots = kSpuAddr + 1;
static const int kVectorBits = 4 * kFloatBits;
static const int kPlaceBits = 11;  // one more than an address of the program: behind its end
static const int kWindowBits = 6;
static const int kDepthBits = 5;

typedef ap_uint<kVectorBits> vector_word_t;
typedef ap_uint<128> instruction_word_t;
typedef ap_uint<kPlaceBits> place_t;
typedef ap_uint<kWindowBits> window_t;
typedef ap_uint<shader::kIndexBits + 1> vector_index_t;  // 2^24: none
typedef ap_uint<8> slot_t;

struct spu_vector {
  float_t part[4];
};

struct spu_thread {
  vector_word_t slots[kSpuSlots];
  ap_uint<4> classes[4];  // of the last first operation's result
  place_t return_place[shader::kCallDepth];
  window_t return_window[shader::kCallDepth];
  place_t place;
  window_t window;
  ap_uint<kDepthBits> depth;
  ap_uint<32> steps;
  ap_uint<3> status;
  ap_uint<8> code;
  ap_uint<1> waits;
  slot_t ray_target;  // kSpuSlots: none
};

struct spu_setting {
  place_t length;  // of the program
  place_t start;
  ap_uint<32> step_limit;
  vector_index_t memory_vectors;
  ap_uint<shader::kIndexBits> triangles;
  ap_uint<8> triangle_vectors;
  ap_uint<shader::kIndexBits> object;
};

struct spu_ray {
  spu_vector origin, direction;  // three components
  float_t t_min, t_max;
  ap_uint<1> any;
};

struct spu_answer {
  ap_uint<1> hit;
  float_t t, u, v;
  ap_uint<shader::kIndexBits> id;
};

struct spu_source {
  ap_uint<8> swizzle;
  ap_uint<7> index;
  ap_uint<2> scale;
  ap_uint<1> negate;
  ap_uint<1> immediate;
  ap_uint<shader::kABits - 1> number;  // of an immediate
};

struct spu_instruction {
  ap_uint<5> op;
  ap_uint<2> modifier;
  ap_uint<2> component;
  ap_uint<6> target;
  ap_uint<4> mask;
  spu_source source[3];
  ap_uint<4> second;
  ap_uint<16> payload;
  ap_uint<4> classes;
  ap_uint<4> lanes;
  ap_uint<1> all;
};

// ---- words

inline vector_word_t spu_join(const spu_vector& x) {
  RT_INLINE
  vector_word_t word = 0;
JOIN:
  for (int c = 3; c >= 0; --c) {
    RT_UNROLL
    const vector_word_t part = x.part[c];
    word <<= kFloatBits;
    word |= part;
  }
  return word;
}
inline spu_vector spu_split(const vector_word_t& word) {
  RT_INLINE
  spu_vector x;
SPLIT:
  for (int c = 0; c < 4; ++c) {
    RT_UNROLL
    const vector_word_t moved = word >> (c * kFloatBits);
    const float_t part = moved.range(kFloatBits - 1, 0);
    x.part[c] = part;
  }
  return x;
}

inline spu_source spu_decode_source(const ap_uint<shader::kABits>& bits) {
  RT_INLINE
  spu_source source;
  source.swizzle = bits.range(7, 0);
  source.index = bits.range(14, 8);
  source.scale = bits.range(16, 15);
  source.negate = bits[shader::kSourceNegateAt];
  source.immediate = bits[shader::kSourceImmediateAt];
  source.number = bits.range(shader::kABits - 2, 0);
  return source;
}

inline spu_instruction spu_decode(const instruction_word_t& word) {
  RT_INLINE
  spu_instruction in;
  in.op = word.range(shader::kOpAt + shader::kOpBits - 1, shader::kOpAt);
  in.modifier = word.range(shader::kModifierAt + shader::kModifierBits - 1, shader::kModifierAt);
  in.component = word.range(shader::kComponentAt + shader::kComponentBits - 1, shader::kComponentAt);
  in.target = word.range(shader::kTargetAt + shader::kTargetBits - 1, shader::kTargetAt);
  in.mask = word.range(shader::kMaskAt + shader::kMaskBits - 1, shader::kMaskAt);
  const ap_uint<shader::kABits> a = word.range(shader::kAAt + shader::kABits - 1, shader::kAAt);
  const ap_uint<shader::kABits> b = word.range(shader::kBAt + shader::kBBits - 1, shader::kBAt);
  const ap_uint<shader::kABits> c = word.range(shader::kCAt + shader::kCBits - 1, shader::kCAt);
  in.source[0] = spu_decode_source(a);
  in.source[1] = spu_decode_source(b);
  in.source[2] = spu_decode_source(c);
  in.second = word.range(shader::kSecondAt + shader::kSecondBits - 1, shader::kSecondAt);
  in.payload = word.range(shader::kPayloadAt + shader::kPayloadBits - 1, shader::kPayloadAt);
  in.classes = word.range(shader::kClassesAt + shader::kClassesBits - 1, shader::kClassesAt);
  in.lanes = word.range(shader::kLanesAt + shader::kLanesBits - 1, shader::kLanesAt);
  in.all = word[shader::kAllAt];
  return in;
}

// ---- what an instruction is

static_assert(shader::kSecondMov == shader::kOpMov && shader::kSecondMad == shader::kOpMad,
              "arithmetic has one code as a first and a second operation");

inline bool spu_is_arithmetic(const ap_uint<5>& op) {
  RT_INLINE
  return op >= shader::kOpMov && op <= shader::kOpDp4;
}
inline bool spu_second_is_arithmetic(const ap_uint<4>& second) {
  RT_INLINE
  return second >= shader::kSecondMov && second <= shader::kSecondMad;
}
inline bool spu_is_texture(const ap_uint<5>& op) {
  RT_INLINE
  return op == shader::kOpTexload || op == shader::kOpTexload4x || op == shader::kOpTexstore;
}
inline ap_uint<3> spu_sources(const ap_uint<5>& op) {
  RT_INLINE
  ap_uint<3> sources = 2;
  if (op == shader::kOpNop) sources = 0;
  if (op == shader::kOpMov || op == shader::kOpFrac || op == shader::kOpStore) sources = 1;
  if (op == shader::kOpMad || op == shader::kOpTexstore || op == shader::kOpTrace) sources = 3;
  return sources;
}
inline ap_uint<3> spu_second_sources(const ap_uint<4>& second) {
  RT_INLINE
  const ap_uint<5> op = second;
  ap_uint<3> sources = 0;
  if (spu_second_is_arithmetic(second)) sources = spu_sources(op);
  return sources;
}
inline bool spu_writable(const ap_uint<6>& code) {
  RT_INLINE
  return code <= shader::kRegisterHit || code == shader::kRegisterAddr;
}
inline bool spu_readable(const ap_uint<7>& code) {
  RT_INLINE
  return code <= shader::kRegisterC ||
         (code >= shader::kRegisterConstants && code < shader::kRegisterConstants + shader::kConstants);
}

struct spu_arithmetic_payload {
  ap_uint<6> target;
  ap_uint<4> mask;
  ap_uint<1> saturate;
};
inline spu_arithmetic_payload spu_decode_arithmetic(const ap_uint<16>& payload) {
  RT_INLINE
  spu_arithmetic_payload fields;
  fields.target = payload.range(5, 0);
  fields.mask = payload.range(9, 6);
  fields.saturate = payload[shader::kArithmeticSaturateAt];
  return fields;
}

// Whether the machine knows the instruction; is_valid of golden/shader/assembler.cpp.
inline bool spu_valid(const spu_instruction& in) {
  RT_INLINE
  const bool arithmetic = spu_is_arithmetic(in.op);
  const bool store = in.op == shader::kOpStore;
  const bool alone = spu_is_texture(in.op) || in.op == shader::kOpTrace;
  const spu_arithmetic_payload other = spu_decode_arithmetic(in.payload);
  bool valid = in.op <= shader::kOpTrace && in.second <= shader::kSecondStore;
  if (in.modifier != shader::kModifierNone && !arithmetic) valid = false;
  if (store != (in.second == shader::kSecondStore)) valid = false;
  if (alone && in.second != shader::kSecondNone) valid = false;
  if (arithmetic && !spu_writable(in.target)) valid = false;
  if (in.op == shader::kOpTexload && (in.target < shader::kRegisterI0 || in.target > shader::kRegisterI3))
    valid = false;
  if (spu_second_is_arithmetic(in.second)) {
    const ap_uint<4> both = other.mask & in.mask;
    const bool special = in.modifier == shader::kModifierRcp || in.modifier == shader::kModifierRsq;
    if (!spu_writable(other.target)) valid = false;
    if (both != 0 && arithmetic && other.target == in.target) valid = false;
    if (both != 0 && special && other.target == shader::kRegisterS) valid = false;
  }
  const ap_uint<4> sources = spu_sources(in.op) + spu_second_sources(in.second);
  if (sources > 3) valid = false;
SOURCES:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    if (i < sources && in.source[i].immediate == 0 && !spu_readable(in.source[i].index)) valid = false;
  }
  return valid;
}

// ---- registers

// Slot of a register that can be written, or P; beyond the stack: kSpuSlots.
inline slot_t spu_slot(const ap_uint<7>& code, const window_t& window) {
  RT_INLINE
  slot_t slot = code;
  if (code < shader::kRegisters) {
    slot += window;
    if (slot >= shader::kStackRegisters) slot = kSpuSlots;
  } else {
    slot += kSpuFixed - shader::kRegisterI0;
  }
  return slot;
}

inline spu_vector spu_spread(const float_t& x) {
  RT_INLINE
  spu_vector all;
SPREAD:
  for (int c = 0; c < 4; ++c) {
    RT_UNROLL
    all.part[c] = x;
  }
  return all;
}

inline vector_word_t spu_merge(const vector_word_t& old, const ap_uint<4>& mask, const spu_vector& value) {
  RT_INLINE
  spu_vector merged = spu_split(old);
MERGE:
  for (int c = 0; c < 4; ++c) {
    RT_UNROLL
    if (mask[c] == 1) merged.part[c] = value.part[c];
  }
  return spu_join(merged);
}

// The bare C: 0, 1, 0.5, the greatest number.
inline spu_vector spu_bare() {
  RT_INLINE
  spu_vector bare;
  bare.part[0] = 0;
  bare.part[1] = kFloatOne;
  bare.part[2] = kFloatOne - (1u << shader::kFractionBits);
  bare.part[3] = float_greatest(0);
  return bare;
}

// The value of a source; `fits` becomes false where it lies beyond the stack.
inline spu_vector spu_fetch(const spu_thread& thread, const vector_word_t* constants, const spu_source& source,
                            bool& fits) {
  RT_INLINE
  spu_vector whole = spu_bare();
  if (source.index >= shader::kRegisterConstants) {
    const ap_uint<5> place = source.index.range(4, 0);
    whole = spu_split(constants[place.to_uint()]);
  } else if (source.index != shader::kRegisterC) {
    const slot_t slot = spu_slot(source.index, thread.window);
    if (slot < kSpuSlots) {
      whole = spu_split(thread.slots[slot.to_uint()]);
    } else if (source.immediate == 0) {
      fits = false;
    }
  }
  ap_int<3> power = source.scale;
  if (source.scale == 3) power = -1;
  float_t number = source.number;
  number <<= kFloatBits - shader::kABits + 1;
  const float_t immediate = float_canonical(number);
  spu_vector value;
COMPONENTS:
  for (int c = 0; c < 4; ++c) {
    RT_UNROLL
    const ap_uint<8> moved = source.swizzle >> (2 * c);
    const ap_uint<2> from = moved.range(1, 0);
    float_t x = float_scale(whole.part[from.to_uint()], power);
    if (source.negate == 1) x = float_negate(x);
    if (source.immediate == 1) x = immediate;
    value.part[c] = x;
  }
  return value;
}

// ---- arithmetic

inline spu_vector spu_compute(const ap_uint<5>& op, const spu_vector& a, const spu_vector& b, const spu_vector& c) {
  RT_INLINE
  float_t x[4], y[4];
OPERANDS:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    x[i] = a.part[i];
    y[i] = b.part[i];
  }
  if (op == shader::kOpDp2h) y[2] = kFloatOne;
  if (op == shader::kOpDp3h) y[3] = kFloatOne;
  if (op == shader::kOpDp2h || op == shader::kOpDp3) {
    x[3] = 0;
    y[3] = 0;
  }
  spu_vector r;
LANES:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    float_t z = x[i];
    if (op == shader::kOpFrac) z = float_frac(x[i]);
    if (op == shader::kOpAdd) z = float_add(x[i], y[i]);
    if (op == shader::kOpMul) z = float_mul(x[i], y[i]);
    if (op == shader::kOpMad) z = float_mad(x[i], y[i], c.part[i]);
    r.part[i] = z;
  }
  if (op >= shader::kOpDp2h) r = spu_spread(float_dot(x, y));
  return r;
}

inline spu_vector spu_saturate(const spu_vector& x) {
  RT_INLINE
  spu_vector r;
LANES:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    r.part[i] = float_saturate(x.part[i]);
  }
  return r;
}

inline bool spu_fulfilled(const spu_instruction& in, const ap_uint<4> classes[4]) {
  RT_INLINE
  bool every = true;
  bool some = false;
LANES:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    const ap_uint<4> common = classes[i] & in.classes;
    if (in.lanes[i] == 1) {
      if (common != 0) {
        some = true;
      } else {
        every = false;
      }
    }
  }
  return in.all == 1 ? every : some;
}

// ---- memory

// Of a load or store; kNoIndex and more where the register holds none.
inline vector_index_t spu_address(const spu_thread& thread, const ap_uint<16>& payload) {
  RT_INLINE
  const ap_uint<3> address = payload.range(4, 2);
  const ap_uint<8> offset = payload.range(12, 5);
  int slot = kSpuFixed + shader::kRegisterA - shader::kRegisterI0;
  if (address[2] == 1) slot = kSpuAddr;
  const spu_vector from = spu_split(thread.slots[slot]);
  const ap_uint<2> lane = address.range(1, 0);
  vector_index_t index = float_index(from.part[lane.to_uint()]);
  if (index[shader::kIndexBits] == 0) index += offset;
  return index;
}

// floor(x) modulo size; what no index can say counts as 0.
inline vector_index_t spu_wrapped(const float_t& x, const vector_index_t& size) {
  RT_INLINE
  const float_t positive = x & ~(1u << (kFloatBits - 1));
  const bool negative = x[kFloatBits - 1] == 1;
  vector_index_t whole = float_index(positive);
  if (negative && float_frac(positive) != 0) whole += 1;
  if (whole[shader::kIndexBits] == 1) whole = 0;
  vector_index_t rest = 0;
DIVIDE:
  for (int i = shader::kIndexBits - 1; i >= 0; --i) {
    rest <<= 1;
    rest[0] = whole[i];
    if (rest >= size) rest -= size;
  }
  if (negative && rest != 0) rest = size - rest;
  return rest;
}

inline void spu_texture(spu_thread& thread, const spu_setting& setting, const spu_instruction& in,
                        const spu_vector& picture, const spu_vector& at, const spu_vector& value,
                        vector_word_t* memory) {
  const vector_index_t begin = float_index(picture.part[0]);
  const vector_index_t width = float_index(picture.part[1]);
  const vector_index_t height = float_index(picture.part[2]);
  const bool none = begin[shader::kIndexBits] == 1 || width[shader::kIndexBits] == 1 ||
                    height[shader::kIndexBits] == 1 || width == 0 || height == 0;
  if (none) {
    thread.status = shader::kStatusBadAddress;
    return;
  }
  const vector_index_t x = spu_wrapped(at.part[0], width);
  const vector_index_t y = spu_wrapped(at.part[1], height);
  vector_index_t right = x + 1;
  if (right == width) right = 0;
  ap_uint<2 * shader::kIndexBits + 2> row = y;
  row *= width;
  row += begin;
  ap_uint<2 * shader::kIndexBits + 2> below = row;
  below += width;
  const vector_index_t next = y + 1;
  if (next == height) below = begin;
  ap_uint<2 * shader::kIndexBits + 2> texel[4];
  texel[0] = row + x;
  texel[1] = row + right;
  texel[2] = below + x;
  texel[3] = below + right;
  const bool four = in.op == shader::kOpTexload4x;
  bool inside = texel[0] < setting.memory_vectors;
OTHERS:
  for (int i = 1; i < 4; ++i) {
    RT_UNROLL
    if (four && texel[i] >= setting.memory_vectors) inside = false;
  }
  if (!inside) {
    thread.status = shader::kStatusBadAddress;
    return;
  }
  if (in.op == shader::kOpTexstore) {
    memory[texel[0].to_uint()] = spu_join(value);
  } else {
    int slot = kSpuFixed;
    if (!four) slot += in.target.to_uint() - shader::kRegisterI0;
  TEXELS:
    for (int i = 0; i < 4; ++i) {
      if (i == 0 || four) thread.slots[slot + i] = memory[texel[i].to_uint()];
    }
  }
}

// ---- control

inline void spu_call(spu_thread& thread, const ap_uint<10>& place, const ap_uint<4>& push, place_t& next) {
  RT_INLINE
  ap_uint<kWindowBits + 1> window = thread.window;
  window += push;
  if (thread.depth == shader::kCallDepth || window >= shader::kStackRegisters) {
    thread.status = shader::kStatusStackOverflow;
  } else {
    thread.return_place[thread.depth.to_uint()] = next;
    thread.return_window[thread.depth.to_uint()] = thread.window;
    thread.depth += 1;
    thread.window = window;
    next = place;
  }
}

inline void spu_trace(spu_thread& thread, const spu_ray& ray) {
  RT_INLINE
  bool zero = true;
AXES:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    const ap_uint<kFloatBits - 1> size = ray.direction.part[i].range(kFloatBits - 2, 0);
    if (size != 0) zero = false;
  }
  if (zero) {
    thread.status = shader::kStatusBadRay;
  } else {
    thread.waits = 1;
  }
}

inline void spu_material(spu_thread& thread, const spu_setting& setting, const ap_uint<16>& payload,
                         const vector_word_t* memory, place_t& next) {
  const ap_uint<4> push = payload.range(3, 0);
  const ap_uint<2> entry = payload.range(5, 4);
  const spu_vector addresses = spu_split(thread.slots[kSpuAddr]);
  const vector_index_t triangle = float_index(addresses.part[0]);
  if (triangle >= setting.memory_vectors) {
    thread.status = shader::kStatusBadAddress;
    return;
  }
  const spu_vector first = spu_split(memory[triangle.to_uint()]);
  const vector_index_t material = float_index(first.part[3]);
  if (material >= setting.memory_vectors) {
    thread.status = shader::kStatusBadAddress;
    return;
  }
  const spu_vector places = spu_split(memory[material.to_uint()]);
  const vector_index_t place = float_index(places.part[entry.to_uint()]);
  if (place >= shader::kProgramWords) {
    thread.status = shader::kStatusBadPlace;
    return;
  }
  const ap_uint<10> entered = place;
  spu_call(thread, entered, push, next);
}

// ---- an instruction

// An instruction of one or two operations.
inline void spu_pair(spu_thread& thread, const spu_setting& setting, const spu_instruction& in,
                     const spu_vector value[3], const vector_word_t* memory, spu_ray& ray, place_t& next) {
  const ap_uint<3> own = spu_sources(in.op);
  const bool arithmetic = spu_second_is_arithmetic(in.second);
  const spu_arithmetic_payload payload = spu_decode_arithmetic(in.payload);
  // The sources that the first operation leaves.
  spu_vector left[3];
LEFT:
  for (int i = 0; i < 3; ++i) {
    RT_UNROLL
    const int from = i + own.to_uint();
    left[i] = value[from < 3 ? from : 2];
  }
  const ap_uint<5> second_op = in.second;
  const spu_vector other = spu_compute(second_op, left[0], left[1], left[2]);
  const bool load = in.second == shader::kSecondLoad || in.second == shader::kSecondLoad4x;
  const vector_index_t at = spu_address(thread, in.payload);

  if (in.op != shader::kOpNop) {
    const spu_vector first = spu_compute(in.op, value[0], value[1], value[2]);
  CLASSES:
    for (int i = 0; i < 4; ++i) {
      RT_UNROLL
      thread.classes[i] = float_class(first.part[i]);
    }
    const ap_uint<7> target = in.target;
    const slot_t slot = spu_slot(target, thread.window);
    if (slot >= kSpuSlots) {
      thread.status = shader::kStatusStackOverflow;
      return;
    }
    const bool clamped = in.modifier == shader::kModifierSat;
    const spu_vector written = clamped ? spu_saturate(first) : first;
    thread.slots[slot.to_uint()] = spu_merge(thread.slots[slot.to_uint()], in.mask, written);
    if (in.modifier == shader::kModifierRcp || in.modifier == shader::kModifierRsq) {
      const float_t x = first.part[in.component.to_uint()];
      const bool root = in.modifier == shader::kModifierRsq;
      const spu_vector special = spu_spread(root ? float_rsq(x) : float_rcp(x));
      const int s = kSpuFixed + shader::kRegisterS - shader::kRegisterI0;
      thread.slots[s] = spu_merge(thread.slots[s], in.mask, special);
    }
  }
  if (arithmetic) {
    const ap_uint<7> target = payload.target;
    const slot_t slot = spu_slot(target, thread.window);
    if (slot >= kSpuSlots) {
      thread.status = shader::kStatusStackOverflow;
      return;
    }
    const spu_vector written = payload.saturate == 1 ? spu_saturate(other) : other;
    thread.slots[slot.to_uint()] = spu_merge(thread.slots[slot.to_uint()], payload.mask, written);
    return;
  }
  if (in.second == shader::kSecondNone || !spu_fulfilled(in, thread.classes)) return;
  if (load) {
    const bool four = in.second == shader::kSecondLoad4x;
    ap_uint<shader::kIndexBits + 2> end = at;
    end += four ? 4 : 1;
    if (end > setting.memory_vectors) {
      thread.status = shader::kStatusBadAddress;
      return;
    }
    const ap_uint<2> result = in.payload.range(1, 0);
    int slot = kSpuFixed;
    if (!four) slot += result.to_uint();
  VECTORS:
    for (int i = 0; i < 4; ++i) {
      if (i == 0 || four) thread.slots[slot + i] = memory[at.to_uint() + i];
    }
  } else if (in.second == shader::kSecondJmp) {
    next = in.payload.range(9, 0);
  } else if (in.second == shader::kSecondCall) {
    const ap_uint<10> place = in.payload.range(9, 0);
    const ap_uint<4> push = in.payload.range(13, 10);
    spu_call(thread, place, push, next);
  } else if (in.second == shader::kSecondMaterial) {
    spu_material(thread, setting, in.payload, memory, next);
  } else if (in.second == shader::kSecondTrace) {
    const spu_vector reciprocal = spu_split(thread.slots[kSpuFixed + shader::kRegisterE1 - shader::kRegisterI0]);
    const spu_vector limits = spu_split(thread.slots[kSpuFixed + shader::kRegisterE2 - shader::kRegisterI0]);
    const ap_uint<2> entry = in.payload.range(5, 4);
    ap_uint<7> code = in.payload.range(3, 0);
    code += 4;
    ray.origin = spu_split(thread.slots[kSpuFixed + shader::kRegisterE0 - shader::kRegisterI0]);
  AXES:
    for (int i = 0; i < 3; ++i) {
      RT_UNROLL
      ray.direction.part[i] = float_rcp(reciprocal.part[i]);
    }
    ray.t_min = limits.part[1];
    ray.t_max = limits.part[2];
    ray.any = entry == 1;
    slot_t target = thread.window;
    target += code;
    if (target >= shader::kStackRegisters) {
      thread.status = shader::kStatusStackOverflow;
      return;
    }
    thread.ray_target = target;
    spu_trace(thread, ray);
  } else if (in.second == shader::kSecondReturn) {
    if (thread.depth == 0) {
      thread.status = shader::kStatusDone;
    } else {
      thread.depth -= 1;
      next = thread.return_place[thread.depth.to_uint()];
      thread.window = thread.return_window[thread.depth.to_uint()];
    }
  } else {
    thread.code = in.payload.range(7, 0);
    thread.status = shader::kStatusDone;
  }
}

// A thread before its first instruction.
inline void spu_launch(spu_thread& thread, const spu_setting& setting, const vector_word_t& parameters) {
CLEAR:
  for (int i = 0; i < kSpuSlots; ++i) {
    RT_PIPELINE(1)
    thread.slots[i] = 0;
  }
  thread.slots[kSpuP] = parameters;
CLASSES:
  for (int i = 0; i < 4; ++i) {
    RT_UNROLL
    thread.classes[i] = 1 << shader::kClassZero;
  }
  thread.place = setting.start;
  thread.window = 0;
  thread.depth = 0;
  thread.steps = 0;
  thread.status = shader::kStatusRunning;
  thread.code = 0;
  thread.waits = 0;
  thread.ray_target = kSpuSlots;
}

// One instruction of a thread that runs. `ray` is what it waits for where `waits` becomes 1.
inline void spu_step(spu_thread& thread, const spu_setting& setting, const instruction_word_t* program,
                     const vector_word_t* constants, vector_word_t* memory, spu_ray& ray) {
  if (thread.steps == setting.step_limit) {
    thread.status = shader::kStatusStepLimit;
    return;
  }
  thread.steps += 1;
  if (thread.place >= setting.length) {
    thread.status = shader::kStatusBadPlace;
    return;
  }
  const instruction_word_t word = program[thread.place.to_uint()];
  const spu_instruction in = spu_decode(word);
  if (!spu_valid(in)) {
    thread.status = shader::kStatusBadOpcode;
    return;
  }
  const ap_uint<4> sources = spu_sources(in.op) + spu_second_sources(in.second);
  bool fits = true;
  spu_vector value[3];
FETCH:
  for (int i = 0; i < 3; ++i) {
    bool here = true;
    value[i] = spu_fetch(thread, constants, in.source[i], here);
    if (i < sources && !here) fits = false;
  }
  if (!fits) {
    thread.status = shader::kStatusStackOverflow;
    return;
  }
  place_t next = thread.place;
  next += 1;
  if (in.op == shader::kOpStore) {
    const vector_index_t at = spu_address(thread, in.payload);
    if (at >= setting.memory_vectors) {
      thread.status = shader::kStatusBadAddress;
    } else {
      memory[at.to_uint()] = spu_join(value[0]);
    }
  } else if (spu_is_texture(in.op)) {
    spu_texture(thread, setting, in, value[0], value[1], value[2], memory);
  } else if (in.op == shader::kOpTrace) {
    ray.origin = value[0];
    ray.direction = value[1];
    ray.t_min = value[2].part[0];
    ray.t_max = value[2].part[1];
    const ap_uint<4> limit_class = float_class(value[2].part[2]);
    ray.any = limit_class[shader::kClassOneUp];
    thread.ray_target = kSpuSlots;
    spu_trace(thread, ray);
  } else {
    spu_pair(thread, setting, in, value, memory, ray, next);
  }
  if (thread.status == shader::kStatusRunning) thread.place = next;
}

// The answer to the ray that the thread waits for.
inline void spu_wake(spu_thread& thread, const spu_setting& setting, const spu_answer& answer) {
  thread.waits = 0;
  const float_t minus_one = kFloatOne | 1u << (kFloatBits - 1);
  spu_vector hit;
  hit.part[0] = float_greatest(0);
  hit.part[1] = 0;
  hit.part[2] = 0;
  hit.part[3] = minus_one;
  ap_int<2 * shader::kIndexBits> triangle = setting.triangles;
  if (answer.hit == 1) {
    hit.part[0] = float_canonical(answer.t);
    hit.part[1] = float_canonical(answer.u);
    hit.part[2] = float_canonical(answer.v);
    hit.part[3] = float_from_index(answer.id);
    ap_int<2 * shader::kIndexBits> offset = answer.id;
    offset *= setting.triangle_vectors;
    triangle += offset;
  } else {
    triangle -= setting.triangle_vectors;
  }
  const ap_uint<shader::kIndexBits> index = triangle;
  float_t tri = float_from_index(index);
  if (triangle < 0 || (triangle >> shader::kIndexBits) != 0) tri = minus_one;  // no address
  const float_t obj = float_from_index(setting.object);
  thread.slots[kSpuFixed + shader::kRegisterHit - shader::kRegisterI0] = spu_join(hit);
  spu_vector pair;
  pair.part[0] = tri;
  pair.part[1] = obj;
  pair.part[2] = 0;
  pair.part[3] = 0;
  thread.slots[kSpuAddr] = spu_merge(thread.slots[kSpuAddr], 3, pair);
  pair.part[0] = obj;
  pair.part[1] = tri;
  pair.part[3] = hit.part[3];
  const int h = kSpuFixed + shader::kRegisterH - shader::kRegisterI0;
  thread.slots[h] = spu_merge(thread.slots[h], 11, pair);
  if (thread.ray_target < kSpuSlots) {
    spu_vector moved;
    moved.part[0] = hit.part[1];
    moved.part[1] = hit.part[2];
    moved.part[2] = hit.part[0];
    moved.part[3] = hit.part[3];
    thread.slots[thread.ray_target.to_uint()] = spu_join(moved);
  }
}

}  // namespace retrace::hls
