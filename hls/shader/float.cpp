// Streaming top of the shader unit's arithmetic: an operation and four numbers in, its result out, every clock.
//   in    x, y, z, w from the lowest bit, 32 bits each; above them the operation: 0 x y, 1 x + y, 2 x y + z, 3 (x, y, z, w) . (y, z, w, x), 4 1 / x,
//         5 1 / sqrt(x), 6 x - floor(x)
#include "float.hpp"

#include "../include/stream.hpp"

extern "C" void float_top(hls::stream<ap_uint<256> >& in, hls::stream<ap_uint<64> >& out) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  RT_FREE_RUNNING
  RT_PIPELINE(1)
  const ap_uint<256> input = in.read();
  const retrace::hls::float_t x = input.range(31, 0);
  const retrace::hls::float_t y = input.range(63, 32);
  const retrace::hls::float_t z = input.range(95, 64);
  const retrace::hls::float_t w = input.range(127, 96);
  const ap_uint<3> operation = input.range(130, 128);
  const retrace::hls::float_t a[4] = {x, y, z, w};
  const retrace::hls::float_t b[4] = {y, z, w, x};
  retrace::hls::float_t result = retrace::hls::float_mul(x, y);
  if (operation == 1) result = retrace::hls::float_add(x, y);
  if (operation == 2) result = retrace::hls::float_mad(x, y, z);
  if (operation == 3) result = retrace::hls::float_dot(a, b);
  if (operation == 4) result = retrace::hls::float_rcp(x);
  if (operation == 5) result = retrace::hls::float_rsq(x);
  if (operation == 6) result = retrace::hls::float_frac(x);
  const ap_uint<64> output = result;
  out.write(output);
}
