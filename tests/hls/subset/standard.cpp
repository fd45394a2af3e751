// The standard library, by its name and behind others.
#include <stdio.h>
#include <string.h>
#include <algorithm>
#include <array>
#include <cstdint>

typedef std::array<int, 4> four_t;  // expect: std
namespace other = std;              // expect: std

struct holder {
  four_t values;  // expect: std
};

extern "C" void standard_top(int* out) {
  const std::uint32_t plain = 3;      // expect: std
  const auto two = other::max(1, 2);  // expect: std
  using namespace std;                // expect: std
  out[0] = min(two, 3) + int(plain);  // expect: std
  memcpy(out, out + 4, 16);           // expect: library
  printf("%d", out[0]);               // expect: library
  const uint32_t global = 3;
  out[1] = int(global) + int(sizeof(holder));
}
