// Calls that are decided at run time.
struct shape {
  virtual int area() const { return 0; }  // expect: virtual
  virtual ~shape() {}                     // expect: virtual
};
struct square : shape {
  int side = 1;
  int area() const override { return side * side; }  // expect: virtual
};
struct base {
  int x;
};
struct left : virtual base {};  // expect: virtual

extern "C" void virtual_top(const shape& any, int* out) {
  out[0] = any.area();                                      // expect: virtual
  const square* exact = dynamic_cast<const square*>(&any);  // expect: virtual
  try {                                                     // expect: virtual
    if (exact == nullptr) throw 1;                          // expect: virtual
  } catch (int) {
    out[1] = 1;
  }
}
