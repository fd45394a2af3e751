// Task step of the ring: a node down (kd_descend), the arrival at a leaf, or a node up (kd_backtrack).
#include "../stages/kd_backtrack.hpp"
#include "../stages/kd_descend.hpp"
#include "tasks.hpp"

extern "C" void ring_step(hls::stream<retrace::hls::token_data_t>& in,
                          hls::stream<retrace::hls::token_word_t>& step_rays,
                          hls::stream<retrace::hls::token_word_t>& out) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=step_rays
#pragma HLS interface mode=axis port=out
  // clang-format on
  token_word_t rays[RETRACE_RING_CONTEXTS];
  RT_LAP(rays)
STEP:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one node a token
    const token_data_t bits = in.read();
    token t = unpack_token(token_word_t(bits));
    token_word_t ray = rays[t.id.to_uint()];
    if (t.fresh) {
      ray = step_rays.read();
      rays[t.id.to_uint()] = ray;
    }
    word_t words[kNodePairWords];
    words[0] = bits >> 256;
    const node_pair_record pair = unpack_node_pair(words);
    if (t.phase == kTokenDown && !t.arrive) {
      const flag_t right = t.node;
      position_t split = pair.left_split;
      axis_t axis = pair.left_axis;
      pair_index_t child = pair.left_child;
      if (right) {
        split = pair.right_split;
        axis = pair.right_axis;
        child = pair.right_child;
      }
      if (axis == contract::kAxisLeaf) {
        const ap_uint<contract::kPositionBits> size = split;
        t.size = contract::kLeafLong;
        if (size < contract::kLeafLong) t.size = size;
        t.ref = child;
        t.arrive = 1;
      } else {
        slab_axis slab = unpack_slab(ray, 0);
        if (axis == 1) slab = unpack_slab(ray, 1);
        if (axis == 2) slab = unpack_slab(ray, 2);
        kd_descend_in_record down;
        down.split = split;
        down.child = child;
        down.origin = slab.origin;
        down.reciprocal = slab.reciprocal;
        down.shift = slab.shift;
        down.zero = slab.zero;
        down.negative = slab.negative;
        down.t = t.t;
        t.node = kd_descend(down).node;
        t.down += 1;
      }
    } else if (t.phase == kTokenUp) {
      const flag_t right = t.way;
      kd_backtrack_in_record up;
      up.face = t.face;
      up.plane = t.plane;
      up.node = t.node;
      up.parent = t.way;
      up.parent_split = pair.left_split;
      up.parent_axis = pair.left_axis;
      up.parent_child = pair.left_child;
      if (right) {
        up.parent_split = pair.right_split;
        up.parent_axis = pair.right_axis;
        up.parent_child = pair.right_child;
      }
      const kd_backtrack_out_record turn = kd_backtrack(up);
      t.up += 1;
      t.node = turn.node;
      t.way = pair.parent;
      if (turn.bad) {
        token_fails(t, contract::kStatusBadRecord);
      } else if (turn.finished) {
        t.phase = kTokenFinish;
      } else if (turn.matched) {
        t.phase = kTokenDown;
      }
    }
    out.write(pack_token(t));
    if (t.phase == kTokenEnd) break;
  }
}
