// ap_int and ap_uint for C simulation: what the kernels' subset of C++ uses of the vendor's integers, on the machine's own. Same values in every bit
// as the headers that synthesis and the export's testbenches use (tests/csim/ap_int_values.cpp is built with both), at several times their speed.
// Widths to 128 bits are numbers; wider ones are words of a bus: joined, shifted, cut and compared for equality.
#ifndef RETRACE_AP_INT_H
#define RETRACE_AP_INT_H

#include <cstdint>
#include <type_traits>

// The kernels are expressions of many small steps: each is an instruction or two only where it is compiled in place.
#define RETRACE_AP_INLINE __attribute__((always_inline)) constexpr

template <int Bits, bool Signed>
struct ap_int_base;
template <int Bits>
struct ap_int;
template <int Bits>
struct ap_uint;

namespace ap_simulation {

// Words in memory are where 64-bit words are.
typedef __int128 int128_t __attribute__((aligned(8)));
typedef unsigned __int128 uint128_t __attribute__((aligned(8)));

constexpr int greater(int a, int b) { return a > b ? a : b; }

/// A bus wider than 128 bits, lowest limb first. Bits above its width are 0.
template <int Bits>
struct Wide {
  static constexpr int kLimbs = (Bits + 63) / 64;
  std::uint64_t limb[kLimbs];

  RETRACE_AP_INLINE std::uint64_t at(int i) const { return i < kLimbs ? limb[i] : 0; }
  RETRACE_AP_INLINE void trim() {
    if constexpr (Bits % 64 != 0) limb[kLimbs - 1] &= ~std::uint64_t{0} >> (64 - Bits % 64);
  }
};

template <int Bits, bool Signed>
struct Storage {
  static_assert(!Signed || Bits <= 128, "a signed number has 128 bits at most");
  using type = std::conditional_t<
      (Bits <= 32), std::conditional_t<Signed, std::int32_t, std::uint32_t>,
      std::conditional_t<
          (Bits <= 64), std::conditional_t<Signed, std::int64_t, std::uint64_t>,
          std::conditional_t<(Bits <= 128), std::conditional_t<Signed, int128_t, uint128_t>, Wide<Bits>>>>;
};
template <int Bits, bool Signed>
using storage_t = typename Storage<Bits, Signed>::type;

template <class T>
constexpr bool kIsNative = std::is_integral_v<T> || std::is_same_v<std::remove_cv_t<T>, __int128> ||
                           std::is_same_v<std::remove_cv_t<T>, unsigned __int128>;

template <class T>
constexpr bool kIsSigned = T(-1) < T(0);

/// The machine's integer as the number it stands for in an expression.
template <class T>
using native_t =
    ap_int_base<std::is_same_v<std::remove_cv_t<T>, bool> ? 1 : static_cast<int>(8 * sizeof(T)), kIsSigned<T>>;

/// One bit of a number that can be written.
template <int Bits, bool Signed>
struct BitOf {
  ap_int_base<Bits, Signed>& number;
  int index;

  RETRACE_AP_INLINE operator bool() const { return ((number >> index).low() & 1) != 0; }
  RETRACE_AP_INLINE BitOf& operator=(bool bit) {
    ap_int_base<Bits, Signed> mask = 1;
    mask <<= index;
    number &= ~mask;
    if (bit) number |= mask;
    return *this;
  }
  RETRACE_AP_INLINE BitOf& operator=(const BitOf& other) { return *this = static_cast<bool>(other); }
};

/// Bits `high` to `low` of a number, as an unsigned number of its width.
template <int Bits, bool Signed>
struct RangeOf {
  ap_int_base<Bits, Signed>& number;
  int high, low;

  RETRACE_AP_INLINE ap_uint<Bits> mask() const {
    ap_uint<Bits> ones = ~ap_uint<Bits>(0);
    return ones >> (Bits - 1 - (high - low));
  }
  RETRACE_AP_INLINE ap_uint<Bits> get() const {
    const ap_uint<Bits> all = number;
    return (all >> low) & mask();
  }
  template <int Width>
  RETRACE_AP_INLINE operator ap_uint<Width>() const {
    return get();
  }
  RETRACE_AP_INLINE operator std::uint64_t() const { return get().to_uint64(); }
  template <class T>
  RETRACE_AP_INLINE RangeOf& operator=(const T& value) {
    const ap_uint<Bits> bits = ap_uint<Bits>(value) & mask();
    ap_uint<Bits> all = number;
    all &= ~(mask() << low);
    all |= bits << low;
    number = all;
    return *this;
  }
  RETRACE_AP_INLINE RangeOf& operator=(const RangeOf& other) { return *this = other.get(); }
};

}  // namespace ap_simulation

/// An integer of `Bits` bits: two's complement if signed. Whatever is assigned keeps its lowest bits.
template <int Bits, bool Signed>
struct ap_int_base {
  static_assert(Bits >= 1, "an integer has a bit");
  static constexpr int width = Bits;
  static constexpr bool kIsWide = Bits > 128;
  using storage = ap_simulation::storage_t<Bits, Signed>;
  using bits_t = ap_simulation::storage_t<Bits, false>;
  static constexpr int kStorageBits = static_cast<int>(8 * sizeof(storage));

  storage value;

  ap_int_base() = default;
  template <class T, std::enable_if_t<ap_simulation::kIsNative<T>, int> = 0>
  RETRACE_AP_INLINE ap_int_base(T number) : value() {
    set(number);
  }
  template <class T, std::enable_if_t<std::is_enum_v<T> && std::is_convertible_v<T, long long>, long> = 0>
  RETRACE_AP_INLINE ap_int_base(T name) : value() {
    set(static_cast<long long>(name));
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int_base(const ap_int_base<OtherBits, OtherSigned>& other) : value() {
    set_from(other);
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int_base(const ap_simulation::RangeOf<OtherBits, OtherSigned>& range) : value() {
    set_from(range.get());
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int_base(const ap_simulation::BitOf<OtherBits, OtherSigned>& bit) : value() {
    set(static_cast<bool>(bit));
  }

  /// The lowest 64 bits.
  RETRACE_AP_INLINE std::uint64_t low() const {
    if constexpr (kIsWide) {
      return value.limb[0];
    } else {
      return static_cast<std::uint64_t>(value);
    }
  }
  RETRACE_AP_INLINE std::uint64_t to_uint64() const { return low(); }
  RETRACE_AP_INLINE std::int64_t to_int64() const { return static_cast<std::int64_t>(low()); }
  RETRACE_AP_INLINE unsigned to_uint() const { return static_cast<unsigned>(low()); }
  constexpr int to_int() const { return static_cast<int>(low()); }

  /// As a native integer, or as a condition; of a wider one, headers differ in what that is.
  RETRACE_AP_INLINE operator std::conditional_t<(Bits > 64), std::uint64_t, storage>() const {
    static_assert(Bits <= 64, "an integer of more than 64 bits has no native counterpart");
    return value;
  }
  RETRACE_AP_INLINE bool operator!() const { return *this == 0; }

  RETRACE_AP_INLINE ap_simulation::BitOf<Bits, Signed> operator[](int index) { return {*this, index}; }
  RETRACE_AP_INLINE bool operator[](int index) const { return ((*this >> index).low() & 1) != 0; }
  RETRACE_AP_INLINE ap_simulation::RangeOf<Bits, Signed> range(int high, int low) { return {*this, high, low}; }
  RETRACE_AP_INLINE ap_uint<Bits> range(int high, int low) const {
    ap_int_base copy = *this;
    return ap_simulation::RangeOf<Bits, Signed>{copy, high, low}.get();
  }

  RETRACE_AP_INLINE ap_int_base operator<<(int by) const { return by < 0 ? right(-by) : left(by); }
  RETRACE_AP_INLINE ap_int_base operator>>(int by) const { return by < 0 ? left(-by) : right(by); }
  RETRACE_AP_INLINE ap_int_base left(int by) const {
    ap_int_base result;
    if constexpr (kIsWide) {
      const int limbs = by / 64, bits = by % 64;
      for (int i = storage::kLimbs - 1; i >= 0; --i) {
        const std::uint64_t upper = i >= limbs ? value.limb[i - limbs] : 0;
        const std::uint64_t lower = i > limbs ? value.limb[i - limbs - 1] : 0;
        result.value.limb[i] = bits == 0 ? upper : upper << bits | lower >> (64 - bits);
      }
      result.value.trim();
    } else {
      result.value = by >= Bits ? storage(0) : wrapped(static_cast<bits_t>(static_cast<bits_t>(value) << by));
    }
    return result;
  }
  RETRACE_AP_INLINE ap_int_base right(int by) const {
    ap_int_base result;
    if constexpr (kIsWide) {
      const int limbs = by / 64, bits = by % 64;
      for (int i = 0; i < storage::kLimbs; ++i) {
        const std::uint64_t lower = value.at(i + limbs), upper = value.at(i + limbs + 1);
        result.value.limb[i] = bits == 0 ? lower : lower >> bits | upper << (64 - bits);
      }
    } else {
      result.value = by >= Bits ? (value < 0 ? storage(-1) : storage(0)) : static_cast<storage>(value >> by);
    }
    return result;
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int_base operator<<(const ap_int_base<OtherBits, OtherSigned>& by) const {
    if constexpr (OtherSigned || OtherBits > 31) {
      return *this << by.to_int();
    } else {
      return left(by.to_int());
    }
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int_base operator>>(const ap_int_base<OtherBits, OtherSigned>& by) const {
    if constexpr (OtherSigned || OtherBits > 31) {
      return *this >> by.to_int();
    } else {
      return right(by.to_int());
    }
  }
  template <class T>
  RETRACE_AP_INLINE ap_int_base& operator<<=(const T& by) {
    return *this = *this << by;
  }
  template <class T>
  RETRACE_AP_INLINE ap_int_base& operator>>=(const T& by) {
    return *this = *this >> by;
  }

  RETRACE_AP_INLINE ap_int_base operator~() const {
    ap_int_base result;
    if constexpr (kIsWide) {
      for (int i = 0; i < storage::kLimbs; ++i) result.value.limb[i] = ~value.limb[i];
      result.value.trim();
    } else {
      result.value = wrapped(static_cast<bits_t>(~static_cast<bits_t>(value)));
    }
    return result;
  }
  RETRACE_AP_INLINE ap_int_base<Bits + 1, true> operator-() const {
    ap_int_base<Bits + 1, true> result = 0;
    result -= *this;
    return result;
  }
  RETRACE_AP_INLINE ap_int_base operator+() const { return *this; }
  RETRACE_AP_INLINE ap_int_base& operator++() { return *this += 1; }
  RETRACE_AP_INLINE ap_int_base& operator--() { return *this -= 1; }

  // The lowest bits of a sum, a difference and a product depend on nothing but the lowest bits of the operands.
  template <class T>
  RETRACE_AP_INLINE ap_int_base& operator+=(const T& other) {
    value = wrapped(static_cast<bits_t>(static_cast<bits_t>(value) + static_cast<bits_t>(ap_int_base(other).value)));
    return *this;
  }
  template <class T>
  RETRACE_AP_INLINE ap_int_base& operator-=(const T& other) {
    value = wrapped(static_cast<bits_t>(static_cast<bits_t>(value) - static_cast<bits_t>(ap_int_base(other).value)));
    return *this;
  }
  template <class T>
  RETRACE_AP_INLINE ap_int_base& operator*=(const T& other) {
    value = wrapped(static_cast<bits_t>(static_cast<bits_t>(value) * static_cast<bits_t>(ap_int_base(other).value)));
    return *this;
  }
#define RETRACE_AP_BITWISE(op)                                                                       \
  template <class T>                                                                                 \
  RETRACE_AP_INLINE ap_int_base& operator op##=(const T& other) {                                    \
    const ap_int_base that(other);                                                                   \
    if constexpr (kIsWide) {                                                                         \
      for (int i = 0; i < storage::kLimbs; ++i) value.limb[i] = value.limb[i] op that.value.limb[i]; \
    } else {                                                                                         \
      value = static_cast<storage>(value op that.value);                                             \
    }                                                                                                \
    return *this;                                                                                    \
  }
  RETRACE_AP_BITWISE(&)
  RETRACE_AP_BITWISE(|)
  RETRACE_AP_BITWISE(^)
#undef RETRACE_AP_BITWISE

 private:
  template <int, bool>
  friend struct ap_int_base;

  static RETRACE_AP_INLINE storage wrapped(bits_t bits) {
    if constexpr (Bits == kStorageBits) {
      return static_cast<storage>(bits);
    } else if constexpr (Signed) {
      return static_cast<storage>(static_cast<storage>(bits << (kStorageBits - Bits)) >> (kStorageBits - Bits));
    } else {
      return static_cast<storage>(bits & static_cast<bits_t>(static_cast<bits_t>(~bits_t(0)) >> (kStorageBits - Bits)));
    }
  }
  template <class T>
  RETRACE_AP_INLINE void set(T number) {
    if constexpr (kIsWide) {
      const std::uint64_t sign = ap_simulation::kIsSigned<T> && number < T(0) ? ~std::uint64_t{0} : 0;
      for (int i = 0; i < storage::kLimbs; ++i) value.limb[i] = sign;
      value.limb[0] = static_cast<std::uint64_t>(number);
      if constexpr (sizeof(T) == 16) value.limb[1] = static_cast<std::uint64_t>(number >> 64);
      value.trim();
    } else {
      value = wrapped(static_cast<bits_t>(number));
    }
  }
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE void set_from(const ap_int_base<OtherBits, OtherSigned>& other) {
    if constexpr (kIsWide && ap_int_base<OtherBits, OtherSigned>::kIsWide) {
      for (int i = 0; i < storage::kLimbs; ++i) value.limb[i] = other.value.at(i);
      value.trim();
    } else if constexpr (ap_int_base<OtherBits, OtherSigned>::kIsWide) {
      if constexpr (Bits <= 64) {
        set(other.value.limb[0]);
      } else {
        set(static_cast<unsigned __int128>(other.value.limb[1]) << 64 | other.value.limb[0]);
      }
    } else if constexpr (!kIsWide && Bits >= OtherBits && (Signed == OtherSigned || (Signed && Bits > OtherBits))) {
      value = static_cast<storage>(other.value);  // every value has its place
    } else {
      set(other.value);
    }
  }
};

template <int Bits>
struct ap_int : ap_int_base<Bits, true> {
  using ap_int_base<Bits, true>::ap_int_base;
  ap_int() = default;
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_int(const ap_int_base<OtherBits, OtherSigned>& other) : ap_int_base<Bits, true>(other) {}
};

template <int Bits>
struct ap_uint : ap_int_base<Bits, false> {
  using ap_int_base<Bits, false>::ap_int_base;
  ap_uint() = default;
  template <int OtherBits, bool OtherSigned>
  RETRACE_AP_INLINE ap_uint(const ap_int_base<OtherBits, OtherSigned>& other) : ap_int_base<Bits, false>(other) {}
};

namespace ap_simulation {

/// The width of both operands as numbers of the same sign.
template <int A, bool SignedA, int B, bool SignedB>
constexpr int kCommonBits = greater(A + (SignedB && !SignedA), B + (SignedA && !SignedB));

template <int A, bool SignedA, int B, bool SignedB>
using sum_t = ap_int_base<kCommonBits<A, SignedA, B, SignedB> + 1, SignedA || SignedB>;
template <int A, bool SignedA, int B, bool SignedB>
using difference_t = ap_int_base<kCommonBits<A, SignedA, B, SignedB> + 1, true>;
template <int A, bool SignedA, int B, bool SignedB>
using product_t = ap_int_base<A + B, SignedA || SignedB>;
template <int A, bool SignedA, int B, bool SignedB>
using logic_t = ap_int_base<kCommonBits<A, SignedA, B, SignedB>, SignedA || SignedB>;

template <int A, bool SignedA, int B, bool SignedB>
RETRACE_AP_INLINE bool equal(const ap_int_base<A, SignedA>& a, const ap_int_base<B, SignedB>& b) {
  if constexpr (A > 128 || B > 128) {
    const ap_uint<greater(A, B)> wide_a(a), wide_b(b);
    for (int i = 0; i < Wide<greater(A, B)>::kLimbs; ++i)
      if (wide_a.value.limb[i] != wide_b.value.limb[i]) return false;
    return true;
  } else {
    using common = storage_t<kCommonBits<A, SignedA, B, SignedB>, SignedA || SignedB>;
    return static_cast<common>(a.value) == static_cast<common>(b.value);
  }
}
template <int A, bool SignedA, int B, bool SignedB>
RETRACE_AP_INLINE bool less(const ap_int_base<A, SignedA>& a, const ap_int_base<B, SignedB>& b) {
  static_assert(A <= 128 && B <= 128, "words of a bus have no order");
  using common = storage_t<kCommonBits<A, SignedA, B, SignedB>, SignedA || SignedB>;
  return static_cast<common>(a.value) < static_cast<common>(b.value);
}

}  // namespace ap_simulation

// Operators between two numbers, and between a number and the machine's integers.
#define RETRACE_AP_MIXED(result, op)                                                              \
  template <int A, bool SignedA, class T, std::enable_if_t<ap_simulation::kIsNative<T>, int> = 0> \
  RETRACE_AP_INLINE auto operator op(const ap_int_base<A, SignedA>& a, T b)                       \
      ->decltype(a op ap_simulation::native_t<T>(b)) {                                            \
    return a op ap_simulation::native_t<T>(b);                                                    \
  }                                                                                               \
  template <int B, bool SignedB, class T, std::enable_if_t<ap_simulation::kIsNative<T>, int> = 0> \
  RETRACE_AP_INLINE auto operator op(T a, const ap_int_base<B, SignedB>& b)                       \
      ->decltype(ap_simulation::native_t<T>(a) op b) {                                            \
    return ap_simulation::native_t<T>(a) op b;                                                    \
  }
#define RETRACE_AP_BINARY(result, op)                                                                             \
  template <int A, bool SignedA, int B, bool SignedB>                                                             \
  RETRACE_AP_INLINE ap_simulation::result<A, SignedA, B, SignedB> operator op(const ap_int_base<A, SignedA>& a,   \
                                                                              const ap_int_base<B, SignedB>& b) { \
    ap_simulation::result<A, SignedA, B, SignedB> value(a);                                                       \
    value op## = b;                                                                                               \
    return value;                                                                                                 \
  }                                                                                                               \
  RETRACE_AP_MIXED(result, op)
// Headers differ in what a comparison of a signed number with an unsigned one is that has as many bits, so there is none.
#define RETRACE_AP_COMPARE(op, expression)                                                                 \
  template <int A, bool SignedA, int B, bool SignedB>                                                      \
  RETRACE_AP_INLINE bool operator op(const ap_int_base<A, SignedA>& a, const ap_int_base<B, SignedB>& b) { \
    static_assert(SignedA == SignedB || (SignedA ? A > B : B > A),                                         \
                  "a signed number is compared with a wider unsigned one");                                \
    return expression;                                                                                     \
  }                                                                                                        \
  template <int A, bool SignedA, class T, std::enable_if_t<ap_simulation::kIsNative<T>, int> = 0>          \
  RETRACE_AP_INLINE bool operator op(const ap_int_base<A, SignedA>& a, T number) {                         \
    const ap_simulation::native_t<T> b = number;                                                           \
    return expression;                                                                                     \
  }                                                                                                        \
  template <int B, bool SignedB, class T, std::enable_if_t<ap_simulation::kIsNative<T>, int> = 0>          \
  RETRACE_AP_INLINE bool operator op(T number, const ap_int_base<B, SignedB>& b) {                         \
    const ap_simulation::native_t<T> a = number;                                                           \
    return expression;                                                                                     \
  }

RETRACE_AP_BINARY(sum_t, +)
RETRACE_AP_BINARY(difference_t, -)
RETRACE_AP_BINARY(product_t, *)
RETRACE_AP_BINARY(logic_t, &)
RETRACE_AP_BINARY(logic_t, |)
RETRACE_AP_BINARY(logic_t, ^)
RETRACE_AP_COMPARE(==, ap_simulation::equal(a, b))
RETRACE_AP_COMPARE(!=, !ap_simulation::equal(a, b))
RETRACE_AP_COMPARE(<, ap_simulation::less(a, b))
RETRACE_AP_COMPARE(>, ap_simulation::less(b, a))
RETRACE_AP_COMPARE(<=, !ap_simulation::less(b, a))
RETRACE_AP_COMPARE(>=, !ap_simulation::less(a, b))
#undef RETRACE_AP_BINARY
#undef RETRACE_AP_COMPARE
#undef RETRACE_AP_MIXED

#endif  // RETRACE_AP_INT_H
