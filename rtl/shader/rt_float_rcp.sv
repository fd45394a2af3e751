// SPDX-License-Identifier: Apache-2.0
// Reciprocal of a number of the shader unit, correctly rounded.
//
// Formula     y_o = round(1 / x_i); of a zero the greatest number of its sign.
// Structure   2^48 divided by the significand, 26 bits; no quotient lies half way, so its lowest bit rounds.
// Latency     rt_float_pkg::RcpLatency, II 1, never stalls.
// Counterpart float_rcp in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_rcp (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  rt_float_pkg::float_t x_i,
    output rt_float_pkg::float_t y_o
);
  import rt_float_pkg::*;
  localparam int unsigned NumBits = 2 * SignificandBits + 1;
  typedef struct packed {
    logic      negative;
    logic      zero;
    exponent_t exponent;
  } side_t;

  parts_t x;
  side_t side, side_quotient;
  assign x    = read(x_i);
  assign side = '{negative: x.negative, zero: x.significand == '0, exponent: exponent_t'(2 * Bias) - x.exponent};
  logic [QuotientBits-1:0] quotient;
  significand_t remainder_unused;  // no quotient lies half way
  logic overflow_unused;  // only of a zero
  rt_div #(
      .NumBits (NumBits),
      .DenBits (SignificandBits),
      .QuotBits(QuotientBits)
  ) u_div (
      .clk_i,
      .num_i(NumBits'(1) << (NumBits - 1)),
      .den_i(x.significand),
      .quot_o(quotient),
      .rem_o(remainder_unused),
      .overflow_o(overflow_unused)
  );
  rt_delay #(
      .Cycles(RcpLatency - 1),
      .data_t(side_t)
  ) u_side (
      .clk_i,
      .rst_ni,
      .data_i(side),
      .data_o(side_quotient)
  );
  logic   power;  // of two
  float_t y_q;
  assign power = quotient[QuotientBits-1];
  always_ff @(posedge clk_i) begin
    y_q <= round('{
        negative: side_quotient.negative,
        zero: 1'b0,
        greatest: side_quotient.zero,
        exponent: side_quotient.exponent - exponent_t'({1'b0, !power}),
        significand: power ? quotient[QuotientBits-1:2] : quotient[QuotientBits-2:1],
        half: !power && quotient[0],
        rest: 1'b1
    });
  end
  assign y_o = y_q;
endmodule
