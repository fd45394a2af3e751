// Functions that come back to themselves: directly, through another, as an operator, in a template, and a call that nobody can follow.
struct number {
  int value;
};
inline int factorial(int n) {
  return n < 2 ? 1 : n * factorial(n - 1);  // expect: recursion
}

int odd(int n);
int even(int n) {
  return n == 0 ? 1 : odd(n - 1);  // expect: recursion
}
int odd(int n) {
  return n == 0 ? 0 : even(n - 1);  // expect: recursion
}

inline number operator+(const number& a, const number& b) {
  if (b.value == 0) return a;
  const number c = {a.value + 1}, d = {b.value - 1};
  return c + d;  // expect: recursion
}

template <typename Value>
Value halve(Value value) {
  return value == 0 ? value : halve(Value(value / 2));  // expect: recursion
}

#define CALL(function, value) function(value)
inline int hidden(int n) {
  return n == 0 ? 0 : CALL(hidden, n - 1);  // expect: recursion
}

extern "C" void recursion_top(int* out, int (*function)(int)) {
  const number one = {1};
  out[0] = factorial(3) + even(4) + (one + one).value + halve(8) + hidden(2);
  out[1] = function(1);  // expect: recursion
}
