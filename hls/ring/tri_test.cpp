// Task tri_test of the ring: the unit-triangle test of the token's reference.
#include "../stages/tri_test.hpp"
#include "tasks.hpp"

extern "C" void ring_tri_test(hls::stream<retrace::hls::token_line_t>& in,
                              hls::stream<retrace::hls::token_word_t>& test_rays,
                              hls::stream<retrace::hls::token_data_t>& out) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=test_rays
#pragma HLS interface mode=axis port=out
  // clang-format on
  token_word_t rays[RETRACE_RING_CONTEXTS];
  RT_LAP(rays)
TRI_TEST:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one triangle a token
    const token_line_t bits = in.read();
    const token t = unpack_token(token_word_t(bits));
    token_word_t ray = rays[t.id.to_uint()];
    if (t.fresh) {
      ray = test_rays.read();
      rays[t.id.to_uint()] = ray;
    }
    tri_test_out_word_t candidate = 0;
    if (t.test && !t.skipped) {
      word_t words[kTriangleWords];
      words[0] = bits >> 256;
      words[1] = bits >> 384;
      words[2] = bits >> 512;
      const triangle_record triangle = unpack_triangle(words);
      tri_test_in_record in_record;
      ring_word64_t lines_0 = ray;
      ring_word64_t lines_1 = ray >> 64;
      ring_word64_t lines_2 = ray >> 128;
      in_record.origin[0] = lines_0;
      in_record.origin[1] = lines_1;
      in_record.origin[2] = lines_2;
      in_record.direction[0] = lines_0 >> 27;
      in_record.direction[1] = lines_1 >> 27;
      in_record.direction[2] = lines_2 >> 27;
    COPY_TRIANGLE:
      for (int axis = 0; axis < 3; ++axis) {
        RT_UNROLL
        in_record.u[axis] = triangle.u[axis];
        in_record.v[axis] = triangle.v[axis];
        in_record.n[axis] = triangle.n[axis];
      }
      in_record.offset_u = triangle.offset_u;
      in_record.offset_v = triangle.offset_v;
      in_record.offset_n = triangle.offset_n;
      in_record.exponent_u = triangle.exponent_u;
      in_record.exponent_v = triangle.exponent_v;
      in_record.id = triangle.id;
      candidate = write_tri_test_out(tri_test(in_record));
    }
    token_data_t data = candidate;
    data <<= 256;
    data |= token_data_t(pack_token(t));
    out.write(data);
    if (t.phase == kTokenEnd) break;
  }
}
