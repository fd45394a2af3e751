// Task list_fetch of the ring: the next reference of a token in a leaf: one of the five in the leaf, which stay here, or out of the list, through a cache.
#include "tasks.hpp"

namespace retrace::hls {

// A line of the cache: the data, the index they belong to, and whether there are any, in one word, so that a lookup that is older than the last
// fill finds an entry that is as right as the new one: the memory does not change during a run.
typedef ap_uint<160> list_line_t;
static const int kListLines = 256;

}  // namespace retrace::hls

extern "C" void ring_list_fetch(hls::stream<retrace::hls::token_data_t>& in,
                                hls::stream<retrace::hls::token_word_t>& out, const retrace::hls::word_t* list,
                                ap_uint<32> list_offset, ap_uint<32> list_count, ap_uint<32> triangle_count,
                                ap_uint<32> step_limit) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=list offset=direct bundle=bus_list
#endif
  // clang-format on
  token_word_t leaves[RETRACE_RING_CONTEXTS];
  RT_LAP(leaves)
  list_line_t cache[kListLines];
  RT_STALE(cache)
CLEAR_LIST:
  for (int line = 0; line < kListLines; ++line) {
    RT_PIPELINE(1)  // one line a clock
    cache[line] = 0;
  }
LIST_FETCH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one lookup and at most one read of memory a token
    const token_data_t bits = in.read();
    token t = unpack_token(token_word_t(bits));
    token_word_t leaf = leaves[t.id.to_uint()];
    if (t.arrive) {
      leaf = bits >> 256;
      leaves[t.id.to_uint()] = leaf;
    }
    const ring_word64_t refs_0 = leaf;
    const ring_word64_t refs_1 = leaf >> 64;
    const ring_word64_t refs_2 = leaf >> 128;
    const ring_word64_t base = leaf >> 192;
    triangle_index_t count = refs_2 >> 24;
    if (t.phase == kTokenTest && !t.last && token_steps(t, step_limit)) {
      ap_uint<32> index = triangle_index_t(refs_0);
      if (t.next == 1) index = triangle_index_t(refs_0 >> 24);
      if (t.next == 2) index = triangle_index_t(refs_1);
      if (t.next == 3) index = triangle_index_t(refs_1 >> 24);
      if (t.next == 4) index = triangle_index_t(refs_2);
      if (t.next >= contract::kLeafInline) {
        ap_uint<32> entry = list_index_t(base);
        entry += t.next;
        entry -= contract::kLeafInline;
        if (entry >= list_count) {
          token_fails(t, contract::kStatusBadIndex);
        } else {
          ap_uint<32> word = entry >> 2;
          const ap_uint<8> slot = word;
          ap_uint<32> wanted = word;
          wanted[31] = 1;
          const list_line_t line = cache[slot.to_uint()];
          const ap_uint<32> held = line >> 128;
          word_t four = line;
          if (held != wanted) {
            four = list[ring_address(list_offset, word, 4, 1).to_uint64()];
            list_line_t fill = wanted;
            fill <<= 128;
            fill |= list_line_t(four);
            cache[slot.to_uint()] = fill;
          }
          const ap_uint<2> lane = entry;
          ap_uint<7> bit = lane;
          bit <<= 5;
          four >>= bit;
          index = four;
        }
      }
      if (t.phase == kTokenTest) {
        if (index >= triangle_count) {
          token_fails(t, contract::kStatusBadIndex);
        } else {
          t.ref = index;
          t.next += 1;
          t.test = 1;
          t.last = t.next == count;
        }
      }
    }
    out.write(pack_token(t));
    if (t.phase == kTokenEnd) break;
  }
}
