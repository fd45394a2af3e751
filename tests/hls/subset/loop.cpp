// Loops whose end no compiler can see.
#include <ap_int.h>

static int limit = 8;
inline void move(int& value) { value = 0; }
#define FOREVER for (;;)

extern "C" void loop_top(const int* in, int* out, int count) {
  int sum = 0;
  while (sum < count) ++sum;  // expect: loop
  do {                        // expect: loop
    sum += in[0];
  } while (sum < 100);
  FOREVER {  // expect: loop
    if (in[0]) break;
  }
  for (int i = 0; i < count; ++i) sum += in[i];               // expect: loop
  for (int i = 0; i < limit; ++i) sum += in[i];               // expect: loop
  for (int i = count; i < 8; ++i) sum += in[i];               // expect: loop
  for (int i = 0; i < 8; i += count) sum += in[i];            // expect: loop
  for (int i = 0; i < 8; --i) sum += in[i];                   // expect: loop
  for (int i = 0; i != 8; i += 3) sum += in[i];               // expect: loop
  for (unsigned char i = 0; i < 256; ++i) sum += in[i];       // expect: loop
  for (unsigned i = 7; i >= 0; --i) sum += in[i];             // expect: loop
  for (ap_uint<3> i = 0; i < 8; ++i) sum += in[i.to_uint()];  // expect: loop
  for (const int* p = in; p < in + 8; ++p) sum += *p;         // expect: loop
  for (int i = 0; i < 8; ++i) {
    if (in[i]) i = 0;  // expect: loop
  }
  for (int i = 0; i < 8; ++i) move(i);  // expect: loop
  for (int i = 0; i < 8; ++i) {
    int* p = &i;  // expect: loop
    *p -= 1;
  }
  int j = 0;
  for (; j < 8; ++j) sum += in[j];  // expect: loop
  const int few[2] = {1, 2};
  for (const int x : few) sum += x;  // expect: loop
again:
  sum -= 1;
  if (sum > 0) goto again;  // expect: loop
  out[0] = sum;
}
