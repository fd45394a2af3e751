// Inside the subset, with everything that a search for words would stumble over. Expected: no finding.
#include <ap_int.h>

namespace good {

// while (true) { float x = std::sqrt(*new double); goto end; malloc(1); } virtual recursion
static const char kText[] = "while do goto new delete malloc float double std:: virtual";
static const int kCount = 5;
enum class floating { kFloat, kDouble };  // only names

typedef ap_int<27> float_t;
struct virtual_machine {
  float_t std[kCount];
  int do_it(int while_not) const { return while_not + 1; }
};

inline ap_uint<8> sum(const ap_uint<4> values[kCount]) {
  ap_uint<8> total = 0;
SUM:
  for (int i = 0; i < kCount; ++i) total += values[i];
BACKWARDS:
  for (int i = kCount - 1; i >= 0; --i) total ^= values[i];
STEPS:
  for (unsigned char i = 0; i <= 250; i += 5) {
    if (total == i) break;
  }
  return total;
}

inline int twice(int value) { return 2 * value; }
inline int calls_twice_twice(int value) { return twice(twice(value)); }  // not recursion

}  // namespace good

extern "C" void good_top(const ap_uint<4> values[good::kCount], ap_uint<32>* out) {
  const good::virtual_machine machine = {};
  ap_uint<32> result = good::sum(values);
  result += machine.do_it(good::calls_twice_twice(good::kText[0]));
  *out = result;
}
