// The shader unit's arithmetic in SystemVerilog against the kernels' integer functions in every bit, operands every clock, each result after the latency
// that its package states (testbench/sim/sv/tb_float.sv). tests/shader/float_test.cpp holds the kernels against host doubles. RETRACE_VECTORS sets the
// number of vectors.
#include <gtest/gtest.h>

#include <array>
#include <cinttypes>
#include <vector>

#include "hls/shader/float.hpp"
#include "testbench/kit/float_vectors.hpp"
#include "testbench/sim/clocked.hpp"
#include "Vtb_float.h"

namespace retrace {
namespace {

constexpr std::array kNames{"mul", "add", "mad", "dot", "rcp", "rsq", "frac"};
using Results = std::array<std::uint32_t, kNames.size()>;
using Operands = std::array<std::uint32_t, 4>;

std::uint32_t bits(const hls::float_t& x) { return static_cast<std::uint32_t>(x.to_uint()); }

Results kernel(const Operands& in) {
  const hls::float_t x = in[0], y = in[1], z = in[2], w = in[3];
  const hls::float_t a[4]{x, y, z, w}, b[4]{y, z, w, x};
  return {bits(hls::float_mul(x, y)), bits(hls::float_add(x, y)), bits(hls::float_mad(x, y, z)),
          bits(hls::float_dot(a, b)), bits(hls::float_rcp(x)),    bits(hls::float_rsq(x)),
          bits(hls::float_frac(x))};
}

TEST(RtlFloat, every_unit_gives_the_bits_of_the_kernel) {
  const char* text = std::getenv("RETRACE_VECTORS");
  const std::uint64_t count = text ? std::strtoull(text, nullptr, 0) : 100'000;
  const std::uint64_t seed = test_seed();
  Random random(seed);
  cosim::Clocked<Vtb_float> bench(seed);
  bench.reset();
  constexpr std::size_t kKept = 64;  // beyond every latency
  std::array<Operands, kKept> operands{};
  std::array<Results, kKept> expected{};
  for (std::uint64_t clock = 0; clock < count + kKept; ++clock) {
    Operands& in = operands[clock % kKept];
    in[0] = float_vector(random);
    for (std::size_t i = 1; i < in.size(); ++i) in[i] = float_partner(random, in[i - 1]);
    expected[clock % kKept] = kernel(in);
    bench->x_i = in[0];
    bench->y_i = in[1];
    bench->z_i = in[2];
    bench->w_i = in[3];
    bench.settle();
    ASSERT_EQ(bench->class_o, hls::float_class(in[0]).to_uint()) << std::hex << in[0] << ", seed " << seed;
    const Results got{bench->mul_o, bench->add_o, bench->mad_o, bench->dot_o,
                      bench->rcp_o, bench->rsq_o, bench->frac_o};
    for (std::size_t unit = 0; unit < kNames.size(); ++unit) {
      const std::uint64_t latency = bench->latency_o[unit];
      ASSERT_LT(latency, kKept);
      if (clock < latency) continue;
      const std::size_t at = (clock - latency) % kKept;
      ASSERT_EQ(got[unit], expected[at][unit])
          << kNames[unit] << std::hex << " of 0x" << operands[at][0] << " 0x" << operands[at][1] << " 0x"
          << operands[at][2] << " 0x" << operands[at][3] << std::dec << ", vector " << clock - latency << ", seed "
          << seed;
    }
    bench.rise();
  }
  EXPECT_FALSE(bench.failed()) << "an assertion of the RTL; seed " << seed;
}

}  // namespace
}  // namespace retrace
