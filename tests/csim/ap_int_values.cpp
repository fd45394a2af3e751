// Every operation that the kernels' integers have, on random and extreme operands: a line of widths and a checksum of the results for each pair of
// types. Built with the integers of C simulation and with the vendor's; ap_int_test.py compares what the two print.
#include <ap_int.h>

#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace {

std::mt19937_64 generator;

struct Checksum {
  std::uint64_t value = 14695981039346656037ull;

  void word(std::uint64_t w) {
    for (int i = 0; i < 8; ++i) value = (value ^ (w >> (8 * i) & 255)) * 1099511628211ull;
  }
  template <class T>
  void number(const T& x) {  // of 128 bits at most
    const ap_int<128> all = x;
    const ap_uint<128> bits = all;
    word(bits.to_uint64());
    const ap_uint<128> high = bits >> 64;
    word(high.to_uint64());
  }
  template <int Bits>
  void bus(const ap_uint<Bits>& x) {
    for (int i = 0; i < Bits; i += 64) {
      const ap_uint<Bits> part = x >> i;
      word(part.to_uint64());
    }
  }
};

/// Random bits, and now and then all ones, none, one at either end.
template <class T>
T draw(int bits) {
  T x = 0;
  const auto kind = generator() % 8;
  for (int i = 0; i < bits; i += 32) {
    const T part = T(ap_uint<32>(kind == 0 ? 0xffffffffu : kind == 1 ? 0u : static_cast<std::uint32_t>(generator())));
    x |= part << i;
  }
  if (kind == 2) x = T(1) << (bits - 1);
  if (kind == 3) x = 1;
  if (kind == 4) x = x >> (bits / 2);
  return x;
}

template <class A, class B>
void pair(const char* name, int bits_a, int bits_b) {
  enum { kSum, kDifference, kProduct, kLogic, kCompare, kShift, kAssign, kNative, kUnary, kBits, kConvert, kGroups };
  static const char* const names[kGroups] = {"sum",    "difference", "product", "logic", "compare", "shift",
                                             "assign", "native",     "unary",   "bits",  "convert"};
  Checksum sums[kGroups];
  for (int round = 0; round < 2000; ++round) {
    const A a = draw<A>(bits_a);
    const B b = draw<B>(bits_b);
    const int small = static_cast<int>(generator() % 1000) - 500;
    const A like = A(b);
    sums[kSum].number(a + b);
    sums[kDifference].number(a - b);
    sums[kProduct].number(a * b);
    if constexpr (A::width <= 64) {  // by 0, and the least number by -1, is not defined
      if (like != 0 && !(like + 1 == 0)) sums[kProduct].number(A(a / like));
    }
    sums[kLogic].number(a & b);
    sums[kLogic].number(a | b);
    sums[kLogic].number(a ^ b);
    sums[kCompare].word((a == like) | (a != like) << 1 | (a < like) << 2 | (a > like) << 3 | (a <= like) << 4 |
                        (a >= like) << 5);
    const int by = static_cast<int>(generator() % static_cast<unsigned>(bits_a + 3));
    const ap_uint<7> wide_by = static_cast<unsigned>(by > 127 ? 127 : by);
    sums[kShift].number(a << by);
    sums[kShift].number(a >> by);
    sums[kShift].number(a << wide_by);
    sums[kShift].number(a >> wide_by);
    A c = a;
    sums[kAssign].number(c += b);
    sums[kAssign].number(c -= small);
    sums[kAssign].number(c *= b);
    sums[kAssign].number(c ^= like);
    sums[kAssign].number(c |= like);
    sums[kAssign].number(c &= a);
    c = a;
    c <<= by;
    sums[kAssign].number(c);
    c = a;
    c >>= wide_by;
    sums[kAssign].number(c);
    sums[kNative].number(a + small);
    sums[kNative].number(small - a);
    sums[kNative].number(a & 0xffu);
    sums[kNative].number(a * ap_int<11>(small));
    const int literal = A(-1) < A(0) ? small : small & 0x1ff;  // a number without a sign is compared with what has none
    sums[kNative].word((a == literal) | (a < literal) << 1 | (literal <= a) << 2 | (a > 5) << 3 | (a != 1) << 4 |
                       (a >= 3) << 5);
    sums[kUnary].number(-a);
    sums[kUnary].number(A(~a));
    sums[kUnary].word(!a ? 1 : 0);
    if constexpr (A::width <= 64) sums[kUnary].word(a ? 1 : 0);
    const int high = static_cast<int>(generator() % static_cast<unsigned>(bits_a));
    const int low = static_cast<int>(generator() % static_cast<unsigned>(high + 1));
    c = a;
    sums[kBits].word(c[low] ? 1 : 0);
    const ap_uint<128> cut = c.range(high, low);
    sums[kBits].number(cut);
    c.range(high, low) = ap_uint<64>(generator());
    sums[kBits].number(c);
    c[high] = (generator() & 1) != 0;
    sums[kBits].number(c);
    sums[kConvert].number(B(a));
    sums[kConvert].number(A(b));
    sums[kConvert].word(a.to_uint64());
    sums[kConvert].word(a.to_uint());
    sums[kConvert].word(static_cast<std::uint64_t>(static_cast<std::int64_t>(a.to_int())));
    c = b;
    sums[kConvert].number(c);
    c = small;
    sums[kConvert].number(c);
  }
  for (int group = 0; group < kGroups; ++group)
    std::printf("%s %s %016" PRIx64 "\n", name, names[group], sums[group].value);
  std::printf("%s widths %d %d %d %d %d\n", name, static_cast<int>(decltype(A() + B())::width),
              static_cast<int>(decltype(A() - B())::width), static_cast<int>(decltype(A() * B())::width),
              static_cast<int>(decltype(A() & B())::width), static_cast<int>(decltype(A() + 1)::width));
}

template <int Bits, int Other>
void bus(const char* name) {
  Checksum sum;
  for (int round = 0; round < 2000; ++round) {
    ap_uint<Bits> a = draw<ap_uint<Bits>>(Bits);
    const ap_uint<Bits> b = draw<ap_uint<Bits>>(Bits);
    const ap_uint<Other> other = draw<ap_uint<Other>>(Other);
    const int by = static_cast<int>(generator() % static_cast<unsigned>(Bits));
    sum.bus(ap_uint<Bits>(a << by));
    sum.bus(ap_uint<Bits>(a >> by));
    sum.bus(ap_uint<Bits>(a & b));
    sum.bus(ap_uint<Bits>(a | b));
    sum.bus(ap_uint<Bits>(a ^ b));
    sum.bus(ap_uint<Bits>(~a));
    sum.word((a == b) | (a != b) << 1 | (a == a) << 2);
    sum.bus(ap_uint<Other>(a));
    sum.bus(ap_uint<Bits>(other));
    const int high = static_cast<int>(generator() % static_cast<unsigned>(Bits));
    const int low = static_cast<int>(generator() % static_cast<unsigned>(high + 1));
    const ap_uint<Bits> cut = a.range(high, low);
    sum.bus(cut);
    a.range(high, low) = b;
    sum.bus(a);
    const ap_uint<27> little = a;
    const ap_int<27> with_sign = a;
    sum.number(little);
    sum.number(with_sign);
    sum.word(a.to_uint64());
    sum.bus(ap_uint<Bits>(with_sign));
  }
  std::printf("%s bus %016" PRIx64 "\n", name, sum.value);
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t seed = argc > 1 ? std::strtoull(argv[1], nullptr, 0) : 1;
  std::printf("seed %" PRIu64 "\n", seed);
  generator.seed(seed);
#define PAIR(A, B) pair<A, B>(#A " " #B, decltype(A())::width, decltype(B())::width)
  PAIR(ap_uint<1>, ap_uint<1>);
  PAIR(ap_uint<1>, ap_int<27>);
  PAIR(ap_int<27>, ap_int<27>);
  PAIR(ap_int<27>, ap_uint<27>);
  PAIR(ap_uint<32>, ap_uint<32>);
  PAIR(ap_uint<32>, ap_int<32>);
  PAIR(ap_int<32>, ap_uint<5>);
  PAIR(ap_int<54>, ap_int<58>);
  PAIR(ap_uint<34>, ap_uint<3>);
  PAIR(ap_int<64>, ap_int<33>);
  PAIR(ap_uint<64>, ap_uint<12>);
  PAIR(ap_int<58>, ap_uint<64>);
  PAIR(ap_int<90>, ap_int<27>);
  PAIR(ap_uint<100>, ap_uint<8>);
#undef PAIR
  bus<128, 64>("ap_uint<128> ap_uint<64>");
  bus<160, 544>("ap_uint<160> ap_uint<544>");
  bus<512, 128>("ap_uint<512> ap_uint<128>");
  bus<1024, 256>("ap_uint<1024> ap_uint<256>");
  return 0;
}
