// What Bambu refuses, or makes wrong hardware of, while C++ is right.
#include <ap_int.h>
#include "../../../hls/include/stream.hpp"

#define BAD_AXIS(name) BAD_DO(HLS interface mode = axis port = name)
#define BAD_DO(text) _Pragma(#text)  // expect: pragma
#if defined(__SYNTHESIS__) && !defined(__BAMBU__)
#define GOOD_PIPELINE _Pragma("HLS pipeline II=1")
#else
#define GOOD_PIPELINE
#endif

typedef ap_uint<33> odd_t;
typedef ap_uint<32> word_t;
struct pair_t {
  ap_uint<8> first, second;
};

template <int kBits>
inline ap_uint<kBits> twice(const ap_uint<kBits>& value) {
// clang-format off
#pragma HLS interface mode=axis port=value  // expect: pragma
  // clang-format on
  return value << 1;
}

// Four fields of 27 bits in two words, the third in both.
inline ap_uint<27> third(const ap_uint<64>& w0, const ap_uint<64>& w1) {
  ap_uint<27> low = w0 >> 54;  // expect: narrow
  ap_uint<27> high = w1;
  high <<= 10;
  low |= high;
  return low;
}
inline ap_uint<27> third_again(const ap_uint<64>& w0, const ap_uint<64>& w1) {
  ap_uint<27> low;
  low = w0 >> 54;  // expect: narrow
  ap_uint<27> high = w1 << 10;
  const ap_uint<27> both = high | low;
  return both;
}
inline ap_uint<27> third_right(const ap_uint<64>& w0, const ap_uint<64>& w1) {
  ap_uint<64> low = w0 >> 54;
  ap_uint<64> high = w1;
  high <<= 10;
  low |= high;
  const ap_uint<27> second = w0 >> 27;  // not or-ed: nothing is lost
  return low ^ second;
}

extern "C" void bambu_top(hls::stream<ap_uint<64>>& in, hls::stream<odd_t>& odd,   // expect: width
                          hls::stream<word_t>& word,                               // expect: width
                          hls::stream<pair_t>& pairs,                              // expect: width
                          hls::stream<ap_int<64>>& negative, ap_uint<64>* memory,  // expect: width
                          ap_uint<64>* other) {
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface axis port=odd  // expect: pragma
#pragma HLS interface mode=m_axi port=memory offset=slave bundle=bus_memory  // expect: pragma
#pragma HLS interface mode=m_axi port=other offset=direct bundle=bus_other
#pragma HLS pipeline II=1  // expect: pragma
#ifndef __BAMBU__
#pragma HLS dataflow
#elif defined(ANYTHING)
#pragma HLS stream variable=in depth=4  // expect: pragma
#endif
  // clang-format on
  GOOD_PIPELINE
  BAD_AXIS(word)
  const ap_uint<64> input = in.read();
  const pair_t pair = {input, input};
  odd.write(twice<33>(input));
  word.write(third(input, input));
  pairs.write(pair);
  negative.write(input);
  memory[0] = third_again(input, input);
  other[0] = third_right(input, input);
}
