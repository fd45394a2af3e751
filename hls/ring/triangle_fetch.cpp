// Task triangle_fetch of the ring: the triangle record to be tested, through a cache.
#include "tasks.hpp"

namespace retrace::hls {

// A line of the cache: the data, the index they belong to, and whether there are any, in one word, so that a lookup that is older than the last
// fill finds an entry that is as right as the new one: the memory does not change during a run.
typedef ap_uint<544> triangle_line_t;
static const int kTriangleLines = 512;

}  // namespace retrace::hls

extern "C" void ring_triangle_fetch(hls::stream<retrace::hls::token_word_t>& in,
                                    hls::stream<retrace::hls::token_line_t>& out, const retrace::hls::line_t* triangles,
                                    ap_uint<32> triangle_offset) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=triangles offset=direct bundle=bus_triangles
#endif
  // clang-format on
  triangle_line_t cache[kTriangleLines];
  RT_STALE(cache)
CLEAR_TRIANGLES:
  for (int line = 0; line < kTriangleLines; ++line) {
    RT_PIPELINE(1)  // one line a clock
    cache[line] = 0;
  }
TRIANGLE_FETCH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one lookup and at most one read of memory a token
    token t = unpack_token(in.read());
    line_t triangle = 0;
    if (t.test && !t.skipped) {
      const ap_uint<9> slot = t.ref;
      ap_uint<32> wanted = t.ref;
      wanted[31] = 1;
      const triangle_line_t line = cache[slot.to_uint()];
      const ap_uint<32> held = line >> 512;
      triangle = line;
      if (held != wanted) {
        triangle = triangles[ring_address(triangle_offset, t.ref, 1, 1).to_uint64()];
        triangle_line_t fill = wanted;
        fill <<= 512;
        fill |= triangle_line_t(triangle);
        cache[slot.to_uint()] = fill;
      }
    }
    token_line_t data = triangle;
    data <<= 256;
    data |= token_line_t(pack_token(t));
    out.write(data);
    if (t.phase == kTokenEnd) break;
  }
}
