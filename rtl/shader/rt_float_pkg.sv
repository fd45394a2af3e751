// SPDX-License-Identifier: Apache-2.0
// Numbers of the shader unit: sign, exponent, fraction; their parts, rounding, latencies of the units.
//
// Format      hls/shader/float.hpp: round to nearest even, no subnormals, no infinity, no NaN; an exponent field of 0 reads as zero, one of all ones as
//             the greatest number.
// Latency     Clocks from operands to the result; every unit takes operands each clock and never stalls.
package rt_float_pkg;

  localparam int unsigned ExponentBits = rt_shader_pkg::ExponentBits;
  localparam int unsigned FractionBits = rt_shader_pkg::FractionBits;
  localparam int unsigned SignificandBits = FractionBits + 1;
  localparam int unsigned GuardBits = 3;  // below the significand of a sum: two and a sticky one
  localparam int unsigned SumBits = SignificandBits + GuardBits + 1;
  localparam int unsigned QuotientBits = SignificandBits + 2;
  localparam int unsigned WorkBits = ExponentBits + 3;
  localparam int ExponentMax = (1 << ExponentBits) - 2;  // of a number
  localparam int Bias = (1 << (ExponentBits - 1)) - 1;

  typedef logic signed [WorkBits-1:0] exponent_t;  // biased, with room beyond both ends
  typedef logic [SignificandBits-1:0] significand_t;
  typedef struct packed {
    logic                    negative;
    logic [ExponentBits-1:0] exponent;
    logic [FractionBits-1:0] fraction;
  } float_t;
  typedef struct packed {
    logic         negative;
    exponent_t    exponent;
    significand_t significand;  // with its leading 1; 0 for zero
  } parts_t;
  // What is left to round.
  typedef struct packed {
    logic         negative;
    logic         zero;      // the result is a zero
    logic         greatest;  // the result is the greatest number
    exponent_t    exponent;
    significand_t significand;
    logic         half;
    logic         rest;
  } unrounded_t;

  localparam float_t One = '{negative: 1'b0, exponent: ExponentBits'(Bias), fraction: '0};
  localparam float_t BelowOne = '{negative: 1'b0, exponent: ExponentBits'(Bias - 1), fraction: '1};

  function automatic float_t greatest(logic negative);
    return '{negative: negative, exponent: ExponentBits'(ExponentMax), fraction: '1};
  endfunction

  function automatic parts_t read(float_t x);
    read.negative    = x.negative;
    read.exponent    = exponent_t'({1'b0, x.exponent});
    read.significand = {1'b1, x.fraction};
    if (x.exponent == '0) read.significand = '0;
    if (x.exponent == '1) begin
      read.exponent    = exponent_t'(ExponentMax);
      read.significand = '1;
    end
  endfunction

  function automatic float_t round(unrounded_t from);
    logic [SignificandBits:0] rounded;
    exponent_t                exponent;
    rounded  = (SignificandBits + 1)'(from.significand) + (SignificandBits + 1)'(from.half && (from.rest || from.significand[0]));
    exponent = from.exponent + exponent_t'({1'b0, rounded[SignificandBits]});  // a carry leaves a fraction of 0
    round    = '{negative: from.negative, exponent: exponent[ExponentBits-1:0], fraction: rounded[FractionBits-1:0]};
    if (from.greatest || exponent > exponent_t'(ExponentMax)) round = greatest(from.negative);
    if (from.zero || (!from.greatest && exponent <= 0)) round = '{negative: from.negative, exponent: '0, fraction: '0};
  endfunction

  // One bit of four: rt_shader_pkg::Class*.
  function automatic logic [3:0] class_of(logic negative, logic [ExponentBits-1:0] exponent);
    class_of = '0;
    if (exponent == '0) class_of[rt_shader_pkg::ClassZero] = 1'b1;
    else if (negative) class_of[rt_shader_pkg::ClassNegative] = 1'b1;
    else if (exponent >= ExponentBits'(Bias)) class_of[rt_shader_pkg::ClassOneUp] = 1'b1;
    else class_of[rt_shader_pkg::ClassFraction] = 1'b1;
  endfunction

  // Zeros in front of a significand, as the counts of powers of two that a shift by halves takes.
  function automatic logic [4:0] leading_zeros(logic [SumBits-2:0] x);
    logic [SumBits-2:0] left;
    left = x;
    for (int i = 4; i >= 0; i--) begin
      leading_zeros[i] = (left >> (SumBits - 1 - (1 << i))) == '0;
      if (leading_zeros[i]) left = left << (1 << i);
    end
  endfunction

  // The operands of rt_mul carry a sign bit of 0; then one clock to normalise, one to round.
  localparam int unsigned MulLatency = rt_lib_pkg::mul_latency(SignificandBits + 1, SignificandBits + 1) + 2;
  localparam int unsigned AddLatency = 5;
  localparam int unsigned MadLatency = MulLatency + AddLatency;
  localparam int unsigned DotLatency = MulLatency + 2 * AddLatency;
  localparam int unsigned RcpLatency = rt_lib_pkg::div_latency(QuotientBits, 1) + 1;
  localparam int unsigned RsqLatency = QuotientBits + 2;
  localparam int unsigned FracLatency = 2 + AddLatency + 1;

endpackage
