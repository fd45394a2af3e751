// Memory that is not there at synthesis.
#include <stdlib.h>

typedef int* (*allocator)(unsigned long);
#define MAKE new int

extern "C" void heap_top(int* out, int count) {
  int* one = MAKE;                                       // expect: heap
  int* many = new int[8];                                // expect: heap
  int* old = static_cast<int*>(malloc(16));              // expect: heap
  int* big = static_cast<int*>(::calloc(4, 4));          // expect: heap
  int* stack = static_cast<int*>(__builtin_alloca(16));  // expect: heap
  int several[count];                                    // expect: heap
  several[0] = 1;                                        // expect: heap
  out[0] = *one + *many + *old + *big + *stack;
  delete one;     // expect: heap
  delete[] many;  // expect: heap
  free(old);      // expect: heap
}
