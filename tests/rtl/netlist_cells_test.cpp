// The project's models of ECP5 cells against what the vendor documents: products of signed and unsigned operands; widths, byte enables, write
// mode, start contents and held outputs of the block RAM; and that a mode they do not model stops the simulation. RETRACE_SEED.
#include <gtest/gtest.h>

#include <array>

#include "testbench/kit/random.hpp"
#include "testbench/sim/clocked.hpp"
#include "Vtb_cells.h"

namespace retrace::cosim {
namespace {

constexpr int kWords = 1024;
constexpr std::uint32_t kHalf = (1u << 18) - 1;
constexpr std::uint64_t kWide = (std::uint64_t{1} << 36) - 1;

class NetlistCells : public testing::Test {
 protected:
  NetlistCells() : seed_(test_seed()), random_(seed_), bench_(seed_) {
    bench_->mul_source_i = 0;
    bench_->mul_enable_i = 1;
    bench_->a_enable_i = bench_->a_write_i = bench_->b_enable_i = bench_->b_write_i = bench_->b_reset_i = 0;
    bench_->a_addr_i = bench_->b_addr_i = 0;
    bench_.reset(1);
    // As tb_cells.sv starts them.
    for (int i = 0; i < 16; ++i) {
      start_[i] = 5 + 11 * i;
      start_[kWords - 16 + i] = (kHalf - 3 * i) & kHalf;
    }
  }

  static std::uint64_t mask(unsigned enables) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 4; ++i)
      if (enables >> i & 1) bits |= std::uint64_t{0x1ff} << (9 * i);
    return bits;
  }

  std::uint64_t seed_;
  Random random_;
  Clocked<Vtb_cells> bench_;
  std::array<std::uint32_t, kWords> start_{};
};

TEST_F(NetlistCells, ProductsOfSignedAndUnsignedOperands) {
  const auto operand = [&] {
    constexpr std::array<std::uint32_t, 6> kEnds{0, 1, 0x1ffff, 0x20000, 0x20001, 0x3ffff};
    return random_.below(4) == 0 ? kEnds[random_.below(kEnds.size())]
                                 : static_cast<std::uint32_t>(random_.below(kHalf + 1));
  };
  const auto value = [](std::uint32_t code, bool is_signed) {
    return is_signed && (code >> 17) ? std::int64_t{code} - (1 << 18) : std::int64_t{code};
  };
  std::array<std::uint64_t, 3> products{};  // of this clock, and of those before
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t a = operand(), b = operand();
    const bool signed_a = random_.below(2), signed_b = random_.below(2);
    bench_->mul_a_i = a;
    bench_->mul_b_i = b;
    bench_->mul_signed_a_i = signed_a;
    bench_->mul_signed_b_i = signed_b;
    bench_.settle();
    products = {static_cast<std::uint64_t>(value(a, signed_a) * value(b, signed_b)) & kWide, products[0], products[1]};
    ASSERT_EQ(bench_->mul_p_o[0], products[0])
        << a << " (signed " << signed_a << ") * " << b << " (signed " << signed_b << "), seed " << seed_;
    if (i >= 2) {
      ASSERT_EQ(bench_->mul_p_o[1], products[1]) << "registers of the inputs, seed " << seed_;
      ASSERT_EQ(bench_->mul_p_o[2], products[1]) << "register of the output, seed " << seed_;
      ASSERT_EQ(bench_->mul_p_o[3], products[2]) << "registers of both, seed " << seed_;
    }
    bench_.step();
  }
  EXPECT_FALSE(bench_.failed());
}

// Both RAMs share the ports of the bench: the wide one takes bits 13 .. 5 as the word and 3 .. 0 as byte enables, the narrow one 13 .. 4 and 1 .. 0.
TEST_F(NetlistCells, BlockRamsReadAndWriteWords) {
  std::array<std::uint32_t, kWords> wide = start_, narrow = start_;
  std::uint64_t wide_out = 0;
  std::uint32_t narrow_a_out = 0, narrow_b_out = 0;
  std::uint64_t wide_late = 0;  // with output registers: the outputs of the clock before
  std::uint32_t narrow_b_late = 0;
  int collisions = 0, writes = 0;
  for (int clock = 0; clock < 50000; ++clock) {
    const bool a_enable = random_.below(4) != 0, a_write = random_.below(3) != 0, b_enable = random_.below(4) != 0;
    // Few words: reads meet what was written, and collide.
    const auto word = [&] {
      return static_cast<unsigned>(random_.below(2) ? random_.below(40) : kWords - 1 - random_.below(40));
    };
    const unsigned enables = random_.below(16), word_a = word(), word_b = random_.below(8) == 0 ? word_a : word();
    const std::uint64_t data = random_.bits() & kWide, bits = mask(enables);
    bench_->a_enable_i = a_enable;
    bench_->a_write_i = a_write;
    bench_->a_addr_i = static_cast<std::uint16_t>(word_a << 4 | enables);
    bench_->b_enable_i = b_enable;
    bench_->b_addr_i = static_cast<std::uint16_t>(word_b << 4);
    bench_->data_i = data;
    bench_.step();

    wide_late = wide_out;
    narrow_b_late = narrow_b_out;
    const bool write = a_enable && a_write;
    const unsigned low_a = word_a & ~1u, low_b = word_b & ~1u;
    if (b_enable) {
      const bool collides = write && enables != 0 && low_a == low_b;
      wide_out = collides ? ~data & kWide : std::uint64_t{wide[low_b + 1]} << 18 | wide[low_b];
      const bool narrow_collides = write && (enables & 3) != 0 && word_a == word_b;
      narrow_b_out = narrow_collides ? ~data & kHalf : narrow[word_b];
      collisions += collides + narrow_collides;
    }
    if (a_enable) narrow_a_out = narrow[word_a];  // the word as it was before the write
    if (write) {
      const std::uint64_t old = std::uint64_t{wide[low_a + 1]} << 18 | wide[low_a], now = (old & ~bits) | (data & bits);
      wide[low_a] = now & kHalf;
      wide[low_a + 1] = static_cast<std::uint32_t>(now >> 18);
      narrow[word_a] = static_cast<std::uint32_t>((narrow[word_a] & ~bits) | (data & bits)) & kHalf;
      ++writes;
    }
    ASSERT_EQ(bench_->wide_o, wide_out) << "clock " << clock << ", seed " << seed_;
    ASSERT_EQ(bench_->narrow_a_o, narrow_a_out) << "clock " << clock << ", seed " << seed_;
    ASSERT_EQ(bench_->narrow_b_o, narrow_b_out) << "clock " << clock << ", seed " << seed_;
    ASSERT_EQ(bench_->wide_late_o, wide_late) << "clock " << clock << ", seed " << seed_;
    ASSERT_EQ(bench_->narrow_b_late_o, narrow_b_late) << "clock " << clock << ", seed " << seed_;
  }
  EXPECT_GT(collisions, 100);
  EXPECT_GT(writes, 10000);
  EXPECT_FALSE(bench_.failed());
}

TEST_F(NetlistCells, CascadedOperandsStop) {
  bench_->mul_source_i = 1;
  bench_.step();
  EXPECT_TRUE(bench_.failed());
}

TEST_F(NetlistCells, DisabledRegistersStop) {
  bench_->mul_enable_i = 0;
  bench_.step();
  EXPECT_TRUE(bench_.failed());
}

TEST_F(NetlistCells, PortBWritingStops) {
  bench_->b_write_i = 1;
  bench_.step();
  EXPECT_TRUE(bench_.failed());
}

TEST_F(NetlistCells, ResetsStop) {
  bench_->b_reset_i = 1;
  bench_.step();
  EXPECT_TRUE(bench_.failed());
}

}  // namespace
}  // namespace retrace::cosim
