// What the testbenches of the stage tops share: vectors as 64-bit words, lowest first, through a top and compared bit for bit. Needs a compiler
// with C++17 and ap_types, nothing else.
#pragma once
#include <cstddef>
#include <cstdio>

#include "../../hls/include/contract_types.hpp"
#include "../../hls/include/stream.hpp"

// Co-simulation in Bambu wants to know how much memory stands behind a pointer: argument number `place` of the top, from 0.
#ifdef __BAMBU_SIM__
#include <mdpi/mdpi_user.h>
#define RETRACE_BENCH_MEMORY(place, memory) m_param_alloc(place, sizeof memory)
#else
#define RETRACE_BENCH_MEMORY(place, memory) (void)memory
#endif

// Several testbenches can be one translation unit, which then has a main() of its own.
#ifdef RETRACE_BENCHES_TOGETHER
#define RETRACE_BENCH_MAIN(run)
#else
#define RETRACE_BENCH_MAIN(run) \
  int main() { return run(); }
#endif

namespace retrace_bench {

template <typename Word>
Word join(const unsigned long long* words, int count) {
  Word bits = 0;
  for (int i = count - 1; i >= 0; --i) {
    const Word part = Word(ap_uint<64>(words[i]));
    if (i != count - 1) bits <<= 64;
    bits |= part;
  }
  return bits;
}

template <typename Word>
void print(const char* title, const Word& bits, int count) {
  std::printf("  %-8s 0x", title);
  for (int i = count - 1; i >= 0; --i) {
    const Word shifted = bits >> (64 * i);
    const ap_uint<64> part = shifted;
    std::printf("%016llx", static_cast<unsigned long long>(part.to_uint64()));
  }
  std::printf("\n");
}

/// Sends every vector through `top(in, out)`. A vector is kInWords words of input and kOutWords of expected output. Returns 0 if all agree.
template <typename InWord, typename OutWord, int kInWords, int kOutWords, typename Top, std::size_t kVectors>
int run_stage(const char* stage, const unsigned long long (&vectors)[kVectors][kInWords + kOutWords], Top top) {
  hls::stream<InWord> in;
  hls::stream<OutWord> out;
  int wrong = 0;
  for (std::size_t i = 0; i < kVectors; ++i) {
    const InWord input = join<InWord>(vectors[i], kInWords);
    const OutWord expected = join<OutWord>(vectors[i] + kInWords, kOutWords);
    in.write(input);
    top(in, out);
    const OutWord result = out.read();
    if (result == expected) continue;
    if (++wrong > 1) continue;
    std::printf("%s: vector %d differs\n", stage, static_cast<int>(i));
    print("input", input, kInWords);
    print("expected", expected, kOutWords);
    print("result", result, kOutWords);
  }
  std::printf("%-12s %d vectors, %d differ\n", stage, static_cast<int>(kVectors), wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace retrace_bench
