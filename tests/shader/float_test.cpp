// The shader unit's numbers: integer functions of the kernels against host doubles rounded once, in every bit; doubles against exact integers where a
// double could mislead. RETRACE_VECTORS sets the number of vectors for each operation, RETRACE_ALL_SIGNIFICANDS goes through all arguments of
// reciprocal and root.
#include "hls/shader/float.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cinttypes>

#include "golden/shader/float.hpp"
#include "hls/include/stream.hpp"
#include "testbench/kit/float_vectors.hpp"

extern "C" void float_top(hls::stream<ap_uint<256>>& in, hls::stream<ap_uint<64>>& out);

namespace retrace {
namespace {

std::uint64_t vectors() {
  const char* text = std::getenv("RETRACE_VECTORS");
  return text ? std::strtoull(text, nullptr, 0) : 200'000;
}
std::uint32_t bits(const hls::float_t& x) { return static_cast<std::uint32_t>(x.to_uint()); }
float read(std::uint32_t x) { return golden::float_read(x); }

class Float : public testing::Test {
 protected:
  Float() : seed_(test_seed()), random_(seed_) {}
  void TearDown() override {
    if (HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%" PRIu64 "\n", seed_);
  }

  /// Draws operands and holds kernel against golden until one differs.
  template <typename Kernel, typename Golden>
  void same(Kernel kernel, Golden golden) {
    for (std::uint64_t i = 0, count = vectors(); i < count; ++i) {
      const std::uint32_t x = float_vector(random_), y = float_partner(random_, x), z = float_partner(random_, y);
      const std::uint32_t got = kernel(x, y, z), expected = golden(x, y, z);
      ASSERT_EQ(got, expected) << std::hex << "0x" << x << " 0x" << y << " 0x" << z << std::dec << ", vector " << i
                               << ", seed " << seed_;
    }
  }

  std::uint64_t seed_;
  Random random_;
};

// The two expressions are of the bits x, y, z; `read` makes numbers of them.
#define RETRACE_SAME(of_kernel, of_golden)                                                       \
  same([](std::uint32_t x, [[maybe_unused]] std::uint32_t y,                                     \
          [[maybe_unused]] std::uint32_t z) { return bits(hls::of_kernel); },                    \
       [](std::uint32_t x, [[maybe_unused]] std::uint32_t y, [[maybe_unused]] std::uint32_t z) { \
         return golden::float_bits(golden::of_golden);                                           \
       })

TEST_F(Float, mul) { RETRACE_SAME(float_mul(x, y), float_mul(read(x), read(y))); }
TEST_F(Float, add) { RETRACE_SAME(float_add(x, y), float_add(read(x), read(y))); }
TEST_F(Float, mad) { RETRACE_SAME(float_mad(x, y, z), float_mad(read(x), read(y), read(z))); }
TEST_F(Float, rcp) { RETRACE_SAME(float_rcp(x), float_rcp(read(x))); }
TEST_F(Float, rsq) { RETRACE_SAME(float_rsq(x), float_rsq(read(x))); }
TEST_F(Float, frac) { RETRACE_SAME(float_frac(x), float_frac(read(x))); }
TEST_F(Float, canonical) { RETRACE_SAME(float_canonical(x), float_round(read(x))); }
TEST_F(Float, saturate) { RETRACE_SAME(float_saturate(hls::float_canonical(x)), float_saturate(read(x))); }

TEST_F(Float, dot) {
  same(
      [](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
        const hls::float_t a[4]{x, y, z, x ^ z}, b[4]{y, z, y, x};
        return bits(hls::float_dot(a, b));
      },
      [](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
        const float a[4]{read(x), read(y), read(z), read(x ^ z)}, b[4]{read(y), read(z), read(y), read(x)};
        return golden::float_bits(golden::float_dot(a, b));
      });
}

TEST_F(Float, top) {
  ::hls::stream<ap_uint<256>> in;
  ::hls::stream<ap_uint<64>> out;
  for (int i = 0; i < 700; ++i) {
    const std::uint32_t x = float_vector(random_), y = float_partner(random_, x), z = float_partner(random_, y),
                        w = x ^ z;
    const int operation = i % 7;
    ap_uint<256> input = operation;
    for (const std::uint32_t operand : {w, z, y, x}) {
      input <<= 32;
      input |= ap_uint<256>(operand);
    }
    in.write(input);
    float_top(in, out);
    const float a[4]{read(x), read(y), read(z), read(w)}, b[4]{read(y), read(z), read(w), read(x)};
    const std::array<float, 7> expected{
        golden::float_mul(a[0], a[1]), golden::float_add(a[0], a[1]), golden::float_mad(a[0], a[1], a[2]),
        golden::float_dot(a, b),       golden::float_rcp(a[0]),       golden::float_rsq(a[0]),
        golden::float_frac(a[0])};
    ASSERT_EQ(out.read().to_uint64(), golden::float_bits(expected[static_cast<std::size_t>(operation)]))
        << "operation " << operation << ", seed " << seed_;
  }
}

TEST_F(Float, scale) {
  for (int power = -1; power <= 2; ++power) {
    same([=](std::uint32_t x, std::uint32_t, std::uint32_t) { return bits(hls::float_scale(x, power)); },
         [=](std::uint32_t x, std::uint32_t, std::uint32_t) {
           return golden::float_bits(golden::float_scale(read(x), power));
         });
  }
}

TEST_F(Float, classes_and_indices) {
  same([](std::uint32_t x, std::uint32_t, std::uint32_t) { return hls::float_class(x).to_uint(); },
       [](std::uint32_t x, std::uint32_t, std::uint32_t) { return golden::float_class(read(x)); });
  same([](std::uint32_t x, std::uint32_t, std::uint32_t) { return hls::float_index(x).to_uint(); },
       [](std::uint32_t x, std::uint32_t, std::uint32_t) { return golden::float_index(read(x)); });
  same([](std::uint32_t x, std::uint32_t, std::uint32_t) { return bits(hls::float_from_index(x & 0xffffff)); },
       [](std::uint32_t x, std::uint32_t, std::uint32_t) {
         return golden::float_bits(golden::float_from_index(x & 0xffffff));
       });
}

// A double that is wrong beyond the place half way would mislead golden: 1 / sqrt(x) against integers. All of them: 2^24 arguments.
TEST_F(Float, no_root_is_too_close_to_half_way) {
  const bool all = std::getenv("RETRACE_ALL_SIGNIFICANDS") != nullptr;
  const std::uint64_t count = all ? std::uint64_t{1} << 24 : vectors();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t index = all ? i : random_.below(std::uint64_t{1} << 24);
    const auto x = static_cast<std::uint32_t>((126u + (index >> 23)) << 23 | (index & 0x7fffff));
    const float root = golden::float_rsq(read(x));
    ASSERT_EQ(bits(hls::float_rsq(x)), golden::float_bits(root)) << std::hex << x << ", seed " << seed_;
    ASSERT_EQ(bits(hls::float_rcp(x)), golden::float_bits(golden::float_rcp(read(x))))
        << std::hex << x << ", seed " << seed_;
    // (root - half a place)^2 x < 1 < (root + half a place)^2 x, in units of 2^-26; a place is twice as wide from 1 up.
    const auto r = static_cast<std::uint64_t>(std::ldexp(static_cast<double>(root), 26));
    const auto value = static_cast<unsigned __int128>(std::ldexp(static_cast<double>(read(x)), 24));
    const unsigned __int128 one = static_cast<unsigned __int128>(1) << 76;
    const unsigned __int128 low = r - (root > 1 ? 4 : 2), high = r + (root < 1 ? 2 : 4);
    ASSERT_LT(low * low * value, one) << std::hex << x << ", seed " << seed_;
    ASSERT_GT(high * high * value, one) << std::hex << x << ", seed " << seed_;
  }
}

TEST_F(Float, ends_of_the_range) {
  const std::uint32_t least = 0x00800000, greatest = 0x7f7fffff, one = 0x3f800000, minus = 0x80000000;
  EXPECT_EQ(bits(hls::float_mul(greatest, greatest)), greatest);
  EXPECT_EQ(bits(hls::float_mul(greatest, greatest ^ minus)), greatest ^ minus);
  EXPECT_EQ(bits(hls::float_mul(least, 0x3f000000)), 0u);  // 2^-127
  EXPECT_EQ(bits(hls::float_mul(least, 0x3f7fffff)), 0u);  // 2^-126 - 2^-150
  EXPECT_EQ(bits(hls::float_mul(0x00ffffff, 0x3f000000)),
            0u);  // half way below 2^-126 is 24 bits wide: exact, too small
  EXPECT_EQ(bits(hls::float_mul(0x00800001, 0x3f7ffffe)), 0x00800000u);  // 2^-126 (1 - 2^-46) rounds up to it
  EXPECT_EQ(bits(hls::float_add(greatest, greatest)), greatest);
  EXPECT_EQ(bits(hls::float_add(least, 0x80800001)), minus);  // a difference without a number is a zero of its sign
  EXPECT_EQ(bits(hls::float_add(one, one ^ minus)), 0u);
  EXPECT_EQ(bits(hls::float_add(minus, minus)), minus);
  EXPECT_EQ(bits(hls::float_rcp(0)), greatest);
  EXPECT_EQ(bits(hls::float_rcp(minus)), greatest ^ minus);
  EXPECT_EQ(bits(hls::float_rcp(greatest)), 0u);
  EXPECT_EQ(bits(hls::float_rsq(0xbf800000)), greatest);
  EXPECT_EQ(bits(hls::float_frac(0x80800000)), one - 1);  // just below 0: just below 1
  EXPECT_EQ(bits(hls::float_mul(0x7fc00000, 0)), 0u);     // a NaN reads as the greatest number
  EXPECT_EQ(bits(hls::float_index(0x4b800000)), 1u << 24);
  EXPECT_EQ(bits(hls::float_index(0x4b7fffff)), (1u << 24) - 1);
}

}  // namespace
}  // namespace retrace
