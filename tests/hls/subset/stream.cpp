// Stream operations that other compilers do not have, and a macro that breaks their headers.
#include "../../../hls/include/stream.hpp"
#include <ap_int.h>

#define W 8  // expect: macro

extern "C" void stream_top(hls::stream<ap_uint<8>>& in, hls::stream<ap_uint<8>>& out) {
  if (in.empty()) return;                  // expect: stream
  hls::stream<ap_uint<8>> inner("inner");  // expect: stream
  inner.write(in.read());
  out.write(inner.read());
}
