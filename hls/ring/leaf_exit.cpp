// Task leaf_exit of the ring: where the ray leaves the leaf it has arrived at, and the way on from there.
#include "../stages/leaf_exit.hpp"
#include "tasks.hpp"

extern "C" void ring_leaf_exit(hls::stream<retrace::hls::token_line_t>& in,
                               hls::stream<retrace::hls::token_word_t>& exit_rays,
                               hls::stream<retrace::hls::token_data_t>& out, ap_uint<32> parent_links) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=exit_rays
#pragma HLS interface mode=axis port=out
  // clang-format on
  token_word_t rays[RETRACE_RING_CONTEXTS];
  RT_LAP(rays)
LEAF_EXIT:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one leaf a token
    const token_line_t bits = in.read();
    token t = unpack_token(token_word_t(bits));
    token_word_t ray = rays[t.id.to_uint()];
    if (t.fresh) {
      ray = exit_rays.read();
      rays[t.id.to_uint()] = ray;
    }
    ring_word64_t refs_0 = 0;
    ring_word64_t refs_1 = 0;
    ring_word64_t refs_2 = 0;
    ring_word64_t base = 0;
    if (t.arrive) {
      word_t words[kLeafWords];
      words[0] = bits >> 256;
      words[1] = bits >> 384;
      words[2] = bits >> 512;
      words[3] = bits >> 640;
      const leaf_record leaf = unpack_leaf(words);
      leaf_exit_in_record cell;
    COPY_LEAF:
      for (int axis = 0; axis < 3; ++axis) {
        RT_UNROLL
        const slab_axis slab = unpack_slab(ray, axis);
        cell.bound[2 * axis] = leaf.bound[2 * axis];
        cell.bound[2 * axis + 1] = leaf.bound[2 * axis + 1];
        cell.origin[axis] = slab.origin;
        cell.reciprocal[axis] = slab.reciprocal;
        cell.shift[axis] = slab.shift;
        cell.zero[axis] = slab.zero;
        cell.negative[axis] = slab.negative;
      }
      cell.t = t.t;
      const leaf_exit_out_record exit = leaf_exit(cell);
      t.t_exit = exit.t_exit;
      t.plane = exit.plane;
      t.face = exit.face;
      t.exits = exit.exits;
      node_index_t link = 0;
    LINK:
      for (int face = 0; face < 6; ++face) {
        RT_UNROLL
        if (exit.face == face) link = leaf.link[face];
      }
      t.way = link;
      if (parent_links != 0) t.way = leaf.parent;
      // The node says how many references there are, unless the list is needed.
      triangle_index_t count = leaf.count;
      if (t.size < contract::kLeafLong) count = t.size;
      t.next = 0;
      t.phase = kTokenTest;
      if (leaf.kind != contract::kKindTriangles) {
        token_fails(t, contract::kStatusBadRecord);
      } else if (exit.broken) {
        token_fails(t, contract::kStatusInvariant);
      } else if (count == 0) {
        t.last = 1;
      }
      refs_0 = ring_word64_t(leaf.refs[1]);
      ring_push(refs_0, ring_word64_t(leaf.refs[0]), contract::kTriangleIndexBits);
      refs_1 = ring_word64_t(leaf.refs[3]);
      ring_push(refs_1, ring_word64_t(leaf.refs[2]), contract::kTriangleIndexBits);
      refs_2 = ring_word64_t(count);
      ring_push(refs_2, ring_word64_t(leaf.refs[4]), contract::kTriangleIndexBits);
      base = ring_word64_t(leaf.list_base);
    }
    token_data_t data = ring_join(refs_0, refs_1, refs_2, base);
    data <<= 256;
    data |= token_data_t(pack_token(t));
    out.write(data);
    if (t.phase == kTokenEnd) break;
  }
}
