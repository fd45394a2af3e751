// The token: what of a ray changes while it goes round the ring, in one 256-bit word, and the words of the streams between the tasks.
// No field lies in two 64-bit words. What is constant for a ray, or belongs to one unit (references of a leaf, mailbox, best hit), stays in that
// unit, at the token's number.
#pragma once
#include "../include/arithmetic.hpp"
#include "../include/stream.hpp"

/// Rays in flight, at most: one lap of the ring takes some 300 clocks with 60 clocks of memory latency, and a token uses a task for one clock.
#define RETRACE_RING_CONTEXTS 512
/// Entries of the mailbox of a ray, those of the barrel kernel.
#define RETRACE_RING_MAILBOX 8

namespace retrace::hls {

static const unsigned long long kRingIterations = 1ULL << 48;  // a static bound; 32 days at 100 MHz

static const int kTokenIdle = 0;    // no ray
static const int kTokenDown = 1;    // wants a node: descend, or arrive at a leaf
static const int kTokenTest = 2;    // in a leaf with references left
static const int kTokenUp = 3;      // wants the parent
static const int kTokenFinish = 4;  // wants its hit written
static const int kTokenEnd = 5;     // the last token of a run: every task hands it on and ends

typedef ap_uint<64> ring_word64_t;
typedef ap_uint<256> token_word_t;
typedef ap_uint<512> token_data_t;   // a token and 256 bits for the next task
typedef ap_uint<1024> token_line_t;  // a token and 512 bits of memory

struct token {
  node_index_t node;
  node_index_t way;  // on from the leaf: the parent, or the face link of the exit face
  ap_uint<10> id;
  ap_uint<3> phase;
  t_t t;
  ap_uint<32> steps;
  status_t status;  // why the ray failed; 0 as long as it has not
  t_t t_exit;
  position_t plane;
  face_t face;
  flag_t exits;
  ap_uint<3> size;        // size code of the leaf, kLeafLong for all that need the list
  triangle_index_t next;  // reference of the leaf
  triangle_index_t ref;   // leaf record, then triangle
  // What happened in this lap.
  flag_t fresh;     // launched: the units take the ray's constants
  ap_uint<2> down;  // nodes it went down
  ap_uint<2> up;    // nodes it went up
  flag_t arrive;    // has to fetch its leaf, then: has it
  flag_t test;      // has a reference
  flag_t skipped;   // which the mailbox knows
  flag_t last;      // of the leaf
};

inline token_word_t ring_join(const ring_word64_t& w0, const ring_word64_t& w1, const ring_word64_t& w2,
                              const ring_word64_t& w3) {
  RT_INLINE
  token_word_t bits = w3;
  bits <<= 64;
  bits |= token_word_t(w2);
  bits <<= 64;
  bits |= token_word_t(w1);
  bits <<= 64;
  bits |= token_word_t(w0);
  return bits;
}

// A field of a 64-bit word under construction. Fields are added from the highest down.
inline void ring_push(ring_word64_t& word, const ring_word64_t& field, int bits) {
  RT_INLINE
  word <<= bits;
  word |= field;
}

inline token_word_t pack_token(const token& t) {
  RT_INLINE
  ring_word64_t w0 = ring_word64_t(t.phase);
  ring_push(w0, ring_word64_t(t.id), 10);
  ring_push(w0, ring_word64_t(t.way), contract::kNodeIndexBits);
  ring_push(w0, ring_word64_t(t.node), contract::kNodeIndexBits);
  ring_word64_t w1 = ring_word64_t(t.status);
  ring_push(w1, ring_word64_t(t.steps), 32);
  ring_push(w1, ring_word64_t(ap_uint<contract::kTBits>(t.t)), contract::kTBits);
  ring_word64_t w2 = ring_word64_t(t.size);
  ring_push(w2, ring_word64_t(t.exits), 1);
  ring_push(w2, ring_word64_t(t.face), contract::kFaceBits);
  ring_push(w2, ring_word64_t(ap_uint<contract::kPositionBits>(t.plane)), contract::kPositionBits);
  ring_push(w2, ring_word64_t(ap_uint<contract::kTBits>(t.t_exit)), contract::kTBits);
  ring_word64_t w3 = ring_word64_t(t.fresh);
  ring_push(w3, ring_word64_t(t.down), 2);
  ring_push(w3, ring_word64_t(t.up), 2);
  ring_push(w3, ring_word64_t(t.arrive), 1);
  ring_push(w3, ring_word64_t(t.test), 1);
  ring_push(w3, ring_word64_t(t.skipped), 1);
  ring_push(w3, ring_word64_t(t.last), 1);
  ring_push(w3, ring_word64_t(t.ref), contract::kTriangleIndexBits);
  ring_push(w3, ring_word64_t(t.next), contract::kTriangleIndexBits);
  return ring_join(w0, w1, w2, w3);
}

inline token unpack_token(const token_word_t& bits) {
  RT_INLINE
  const ring_word64_t w0 = bits;
  const ring_word64_t w1 = bits >> 64;
  const ring_word64_t w2 = bits >> 128;
  const ring_word64_t w3 = bits >> 192;
  token t;
  t.node = w0;
  t.way = w0 >> 24;
  t.id = w0 >> 48;
  t.phase = w0 >> 58;
  t.t = w1;
  t.steps = w1 >> 28;
  t.status = w1 >> 60;
  t.t_exit = w2;
  t.plane = w2 >> 28;
  t.face = w2 >> 55;
  t.exits = w2 >> 58;
  t.size = w2 >> 59;
  t.next = w3;
  t.ref = w3 >> 24;
  t.last = w3 >> 48;
  t.skipped = w3 >> 49;
  t.test = w3 >> 50;
  t.arrive = w3 >> 51;
  t.up = w3 >> 52;
  t.down = w3 >> 54;
  t.fresh = w3 >> 56;
  return t;
}

inline void token_fails(token& t, int status) {
  RT_INLINE
  t.status = status;
  t.phase = kTokenFinish;
}

// Counts a step; false if the ray has used up the image's limit.
inline bool token_steps(token& t, const ap_uint<32>& limit) {
  RT_INLINE
  if (t.steps >= limit) {
    token_fails(t, contract::kStatusStepLimit);
    return false;
  }
  t.steps += 1;
  return true;
}

// Word address of a record of `stride` words in a section at `offset` lines, `line` words each.
inline ap_uint<34> ring_address(const ap_uint<32>& offset, const ap_uint<32>& index, int line, int stride) {
  RT_INLINE
  ap_uint<34> address = offset;
  address *= ap_uint<3>(line);
  ap_uint<34> within = index;
  within *= ap_uint<3>(stride);
  address += within;
  return address;
}

// What a slab test needs of an axis of the ray: origin, reciprocal, shift, zero, negative.
struct slab_axis {
  position_t origin;
  reciprocal_t reciprocal;
  recip_shift_t shift;
  flag_t zero, negative;
};
inline slab_axis unpack_slab(const token_word_t& bits, int axis) {
  RT_INLINE
  ring_word64_t w = bits;
  if (axis == 1) w = bits >> 64;
  if (axis == 2) w = bits >> 128;
  slab_axis slab;
  slab.origin = w;
  slab.reciprocal = w >> 27;
  slab.shift = w >> 54;
  slab.zero = w >> 59;
  slab.negative = w >> 60;
  return slab;
}
inline ring_word64_t pack_slab(const ray_setup_out_record& ray, int axis) {
  RT_INLINE
  ring_word64_t w = ring_word64_t(ray.negative[axis]);
  ring_push(w, ring_word64_t(ray.zero[axis]), 1);
  ring_push(w, ring_word64_t(ray.shift[axis]), contract::kRecipShiftBits);
  ring_push(w, ring_word64_t(ap_uint<contract::kReciprocalBits>(ray.reciprocal[axis])), contract::kReciprocalBits);
  ring_push(w, ring_word64_t(ap_uint<contract::kPositionBits>(ray.origin[axis])), contract::kPositionBits);
  return w;
}

}  // namespace retrace::hls
