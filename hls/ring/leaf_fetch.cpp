// Task leaf_fetch of the ring: the leaf record at which a token arrives, through a cache.
#include "tasks.hpp"

namespace retrace::hls {

// A line of the cache: the data, the index they belong to, and whether there are any, in one word, so that a lookup that is older than the last
// fill finds an entry that is as right as the new one: the memory does not change during a run.
typedef ap_uint<544> leaf_line_t;
static const int kLeafLines = 256;

}  // namespace retrace::hls

extern "C" void ring_leaf_fetch(hls::stream<retrace::hls::token_word_t>& in,
                                hls::stream<retrace::hls::token_line_t>& out, const retrace::hls::line_t* leaves,
                                ap_uint<32> leaf_offset, ap_uint<32> leaf_count) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=leaves offset=direct bundle=bus_leaves
#endif
  // clang-format on
  leaf_line_t cache[kLeafLines];
  RT_STALE(cache)
CLEAR_LEAVES:
  for (int line = 0; line < kLeafLines; ++line) {
    RT_PIPELINE(1)  // one line a clock
    cache[line] = 0;
  }
LEAF_FETCH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one lookup and at most one read of memory a token
    token t = unpack_token(in.read());
    line_t leaf = 0;
    if (t.arrive) {
      if (t.ref >= leaf_count) {
        token_fails(t, contract::kStatusBadIndex);
        t.arrive = 0;
      } else {
        const ap_uint<8> slot = t.ref;
        ap_uint<32> wanted = t.ref;
        wanted[31] = 1;
        const leaf_line_t line = cache[slot.to_uint()];
        const ap_uint<32> held = line >> 512;
        leaf = line;
        if (held != wanted) {
          leaf = leaves[ring_address(leaf_offset, t.ref, 1, 1).to_uint64()];
          leaf_line_t fill = wanted;
          fill <<= 512;
          fill |= leaf_line_t(leaf);
          cache[slot.to_uint()] = fill;
        }
      }
    }
    token_line_t data = leaf;
    data <<= 256;
    data |= token_line_t(pack_token(t));
    out.write(data);
    if (t.phase == kTokenEnd) break;
  }
}
