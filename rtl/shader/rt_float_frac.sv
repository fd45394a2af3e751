// SPDX-License-Identifier: Apache-2.0
// What a number of the shader unit has behind the point.
//
// Formula     y_o = round(x_i - floor(x_i)), below 1: what would round to 1 is the number before it.
// Structure   The bits of |x| behind the point, normalised; for a negative number 1 minus that.
// Latency     rt_float_pkg::FracLatency, II 1, never stalls.
// Counterpart float_frac in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_frac (
    input  logic                 clk_i,
    input  rt_float_pkg::float_t x_i,
    output rt_float_pkg::float_t y_o
);
  import rt_float_pkg::*;
  // Bits behind the point.
  parts_t       x;
  exponent_t    whole;  // bits before it
  significand_t kept;
  parts_t       part_q;
  assign x     = read(x_i);
  assign whole = x.exponent - exponent_t'(Bias - 1);
  always_comb begin
    kept = x.significand;
    for (int unsigned i = 0; i < SignificandBits; i++) begin
      if (exponent_t'(i) < whole) kept[SignificandBits-1-i] = 1'b0;
    end
  end
  always_ff @(posedge clk_i) part_q <= '{negative: x.negative, exponent: x.exponent, significand: kept};

  // Normalised.
  logic [4:0] zeros;
  logic [FractionBits-1:0] normal;
  float_t size_q;
  logic one_minus_q;
  assign zeros  = leading_zeros({part_q.significand, GuardBits'(0)});
  assign normal = FractionBits'(part_q.significand << zeros);
  always_ff @(posedge clk_i) begin
    size_q <= part_q.significand == '0 ? '0 : '{
            negative: part_q.negative,
            exponent: ExponentBits'(part_q.exponent - exponent_t'({1'b0, zeros})),
            fraction: normal
        };
    one_minus_q <= part_q.negative && part_q.significand != '0;
  end

  // A positive one plus 0 is itself.
  float_t sum, y_q;
  rt_float_add u_add (
      .clk_i,
      .x_i(one_minus_q ? One : '0),
      .y_i(size_q),
      .z_o(sum)
  );
  always_ff @(posedge clk_i) y_q <= sum == One ? BelowOne : sum;
  assign y_o = y_q;
endmodule
