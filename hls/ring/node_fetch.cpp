// Task node_fetch of the ring: the sibling pair of the node a token goes down to, or of the parent it climbs to, through a cache.
#include "tasks.hpp"

namespace retrace::hls {

// A line of the cache: the data, the index they belong to, and whether there are any, in one word, so that a lookup that is older than the last
// fill finds an entry that is as right as the new one: the memory does not change during a run.
typedef ap_uint<160> node_line_t;
static const int kNodeLines = 1024;

}  // namespace retrace::hls

extern "C" void ring_node_fetch(hls::stream<retrace::hls::token_word_t>& in,
                                hls::stream<retrace::hls::token_data_t>& out, const retrace::hls::word_t* pairs,
                                ap_uint<32> pair_offset, ap_uint<32> pair_count, ap_uint<32> step_limit) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=pairs offset=direct bundle=bus_pairs
#endif
  // clang-format on
  node_line_t cache[kNodeLines];
  RT_STALE(cache)
CLEAR_NODES:
  for (int line = 0; line < kNodeLines; ++line) {
    RT_PIPELINE(1)  // one line a clock
    cache[line] = 0;
  }
NODE_FETCH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one lookup and at most one read of memory a token
    token t = unpack_token(in.read());
    pair_index_t index = t.node >> 1;
    if (t.phase == kTokenUp) index = t.way >> 1;
    word_t pair = 0;
    const bool wants = (t.phase == kTokenDown && !t.arrive) || t.phase == kTokenUp;
    if (wants && token_steps(t, step_limit)) {
      if (index >= pair_count) {
        token_fails(t, contract::kStatusBadIndex);
      } else {
        const ap_uint<10> slot = index;
        ap_uint<32> wanted = index;
        wanted[31] = 1;
        const node_line_t line = cache[slot.to_uint()];
        const ap_uint<32> held = line >> 128;
        pair = line;
        if (held != wanted) {
          pair = pairs[ring_address(pair_offset, index, 4, kNodePairStride).to_uint64()];
          node_line_t fill = wanted;
          fill <<= 128;
          fill |= node_line_t(pair);
          cache[slot.to_uint()] = fill;
        }
      }
    }
    token_data_t data = pair;
    data <<= 256;
    data |= token_data_t(pack_token(t));
    out.write(data);
    if (t.phase == kTokenEnd) break;
  }
}
