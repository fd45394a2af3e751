// Tasks and a region that break each rule of scripts/hls_tasks.py; the last task and the streams between `good` ends are as they have to be.
#include <ap_int.h>
#include "../../../hls/include/pragmas.hpp"
#include "../../../hls/include/stream.hpp"

#define RT_LAP(name) RT_INDEPENDENT(name, 16)

typedef ap_uint<64> word_t;

extern "C" void two_reads(hls::stream<word_t>& in, hls::stream<word_t>& out, const word_t* memory,
                          const word_t* other) {
READS:
  for (int i = 0; i < 100; ++i) {
    RT_PIPELINE(1)  // one word a clock
    word_t word = memory[i];
    word += other[i];  // expect: master
    word += in.read();
    out.write(word);
  }
}

extern "C" void early_write(hls::stream<word_t>& in, hls::stream<word_t>& out, word_t* memory) {
  memory[0] = 1;  // expect: master
FORWARD:
  for (int i = 0; i < 100; ++i) {
    RT_PIPELINE(1)  // one word a clock
    out.write(in.read());
  }
}

extern "C" void both_ends(hls::stream<word_t>& in, hls::stream<word_t>& out) {
BOTH:
  for (int i = 0; i < 100; ++i) {
    RT_PIPELINE(1)  // one word a clock
    out.write(in.read());
    in.write(word_t(i));  // expect: ends
  }
}

extern "C" void carries(hls::stream<word_t>& in, hls::stream<word_t>& out) {
  word_t sums[16];    // expect: carried
  word_t counts[16];  // with its reason
  word_t table[16];   // only written outside of the loop that reads it
  RT_LAP(counts)
CLEAR:
  for (int i = 0; i < 16; ++i) {
    RT_UNROLL
    table[i] = i;
  }
SUM:
  for (int i = 0; i < 100; ++i) {  // expect: interval
    word_t one[1];                 // of an iteration
    one[0] = in.read();
    sums[i % 16] += one[0];
    sums[(i + 1) % 16] = one[0];
    counts[i % 16] = counts[i % 16] + 1;
    out.write(sums[i % 16]);
  }
REST:
  for (int i = 0; i < 16; ++i) {
    RT_PIPELINE(1) /* expect: interval */
    out.write(counts[i]);
  }
}

extern "C" void good(hls::stream<word_t>& in, hls::stream<word_t>& out, word_t* memory) {
  word_t last[16];
  RT_LAP(last)
GOOD:
  for (int i = 0; i < 100; ++i) {
    RT_PIPELINE(1)  // one word a clock
    const word_t word = in.read();
    memory[i] = last[i % 16];
    last[i % 16] = word;
    out.write(word);
  }
}

void region(word_t* memory) {
  hls::stream<word_t> a;
  hls::stream<word_t> b;
  hls::stream<word_t> twice;   // expect: ends
  hls::stream<word_t> nobody;  // expect: ends
  good(a, b, memory);
  carries(b, twice);
  early_write(twice, a, memory);
  two_reads(twice, nobody, memory, memory);
}
