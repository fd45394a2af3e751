// SPDX-License-Identifier: Apache-2.0
// Sum of two numbers of the shader unit, rounded to nearest even.
//
// Formula     z_o = round(x_i + y_i); the difference of equal numbers is +0.
// Structure   Order by magnitude; align the smaller one, what falls off as a sticky bit; add or subtract; normalise; round: a clock each.
// Latency     rt_float_pkg::AddLatency, II 1, never stalls.
// Counterpart float_add in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_add (
    input  logic                 clk_i,
    input  rt_float_pkg::float_t x_i,
    input  rt_float_pkg::float_t y_i,
    output rt_float_pkg::float_t z_o
);
  import rt_float_pkg::*;
  typedef logic [SumBits-1:0] sum_t;

  // Order.
  parts_t x, y;
  logic   swap;
  assign x    = read(x_i);
  assign y    = read(y_i);
  assign swap = {x.exponent, x.significand} < {y.exponent, y.significand};  // neither exponent is negative
  parts_t large_q;
  logic small_negative_q;
  significand_t small_q;
  logic [ExponentBits-1:0] difference_q;
  always_ff @(posedge clk_i) begin
    large_q      <= swap ? y : x;
    small_negative_q <= swap ? x.negative : y.negative;
    small_q      <= swap ? x.significand : y.significand;
    difference_q <= swap ? ExponentBits'(y.exponent - x.exponent) : ExponentBits'(x.exponent - y.exponent);
  end

  // Align.
  sum_t wide, aligned, fallen;
  logic far;
  assign wide    = sum_t'({small_q, GuardBits'(0)});
  assign far     = difference_q >= ExponentBits'(SumBits);
  assign aligned = far ? '0 : wide >> difference_q[4:0];
  assign fallen  = far ? wide : wide & ~(sum_t'('1) << difference_q[4:0]);
  parts_t large_aligned_q;
  sum_t   small_aligned_q;
  logic   subtract_q, small_negative_aligned_q;
  always_ff @(posedge clk_i) begin
    large_aligned_q  <= large_q;
    small_aligned_q  <= aligned | sum_t'(fallen != '0);
    subtract_q       <= large_q.negative ^ small_negative_q;
    small_negative_aligned_q <= small_negative_q;
  end

  // Add.
  sum_t large_wide, sum_q;
  logic negative_q, small_negative_sum_q;
  exponent_t exponent_q;
  assign large_wide = sum_t'({large_aligned_q.significand, GuardBits'(0)});
  always_ff @(posedge clk_i) begin
    sum_q                <= subtract_q ? large_wide - small_aligned_q : large_wide + small_aligned_q;
    negative_q           <= large_aligned_q.negative;
    small_negative_sum_q <= small_negative_aligned_q;
    exponent_q           <= large_aligned_q.exponent;
  end

  // Normalise.
  logic               carried;
  logic [        4:0] zeros;
  logic [SumBits-2:0] normal;
  assign carried = sum_q[SumBits-1];
  assign zeros   = leading_zeros(sum_q[SumBits-2:0]);
  assign normal  = carried ? {sum_q[SumBits-1:2], sum_q[1] || sum_q[0]} : sum_q[SumBits-2:0] << zeros;
  unrounded_t unrounded_q;
  float_t z_q;
  always_ff @(posedge clk_i) begin
    unrounded_q <= '{
        negative: sum_q == '0 ? negative_q && small_negative_sum_q : negative_q,
        zero: sum_q == '0,
        greatest: 1'b0,
        exponent: carried ? exponent_q + exponent_t'(1) : exponent_q - exponent_t'({1'b0, zeros}),
        significand: normal[SumBits-2:GuardBits],
        half: normal[GuardBits-1],
        rest: normal[GuardBits-2:0] != '0
    };
    z_q <= round(unrounded_q);
  end
  assign z_o = z_q;
endmodule
