// Floating point, also where it is only in between.
#include <ap_int.h>

typedef float real;  // expect: float
#define HALF 0.5
template <typename T>
struct box {
  T value;
};

inline real scale(  // expect: float
    real value) {   // expect: float
  return value;     // expect: float
}

extern "C" void floating_top(const int* in, int* out, ap_int<27>* code) {
  out[0] = in[0] * HALF;                     // expect: float
  out[1] = int(scale(in[1]));                // expect: float
  const auto hidden = code[0].to_double();   // expect: float
  out[3] = in[2] / 2.0L;                     // expect: float
  static long double table[3];               // expect: float
  box<real*> pointer;                        // expect: float
  out[2] = sizeof(table) + sizeof(pointer);  // expect: float
  code[2] = code[3] * ap_int<4>(3);
  (void)hidden;  // expect: float
}
