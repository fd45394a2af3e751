// SPDX-License-Identifier: Apache-2.0
// Reciprocal square root of a number of the shader unit, correctly rounded.
//
// Formula     y_o = round(1 / sqrt(x_i)); of zeros and negative numbers the greatest number.
// Structure   The largest root with root^2 significand <= 2^73 (2^72 where the exponent is odd), 26 bits, one a clock:
//               rest = (2^73 - root^2 significand) / 4^place, product = root significand; a bit is set where rest >= 4 product + significand.
//             No root lies half way, so its lowest bit rounds.
// Latency     rt_float_pkg::RsqLatency, II 1, never stalls.
// Counterpart float_rsq in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_rsq (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  rt_float_pkg::float_t x_i,
    output rt_float_pkg::float_t y_o
);
  import rt_float_pkg::*;
  localparam int unsigned RestBits = 2 * SignificandBits + 6;
  typedef struct packed {
    logic [RestBits-1:0]     rest;
    logic [RestBits-3:0]     product;
    logic [QuotientBits-1:0] root;
    significand_t            significand;
  } step_t;
  typedef struct packed {
    logic      greatest;
    exponent_t exponent;
  } side_t;

  parts_t x;
  logic odd;  // the field; the exponent itself is even
  side_t side, side_root;
  assign x   = read(x_i);
  assign odd = x.exponent[0];
  exponent_t twice;
  assign twice = exponent_t'(3 * Bias) - x.exponent + exponent_t'({1'b0, !odd});
  assign side  = '{greatest: x.negative || x.significand == '0, exponent: twice >>> 1};
  rt_delay #(
      .Cycles(RsqLatency - 1),
      .data_t(side_t)
  ) u_side (
      .clk_i,
      .rst_ni,
      .data_i(side),
      .data_o(side_root)
  );

  function automatic step_t step(step_t from);
    logic [RestBits-1:0] rest, taken;
    rest  = from.rest << 2;
    taken = {from.product, 2'b00} + RestBits'(from.significand);
    step  = '{rest: rest, product: from.product << 1, root: from.root << 1, significand: from.significand};
    if (rest >= taken) begin
      step.rest    = rest - taken;
      step.product = step.product + (RestBits - 2)'(from.significand);
      step.root[0] = 1'b1;
    end
  endfunction
  step_t step_q[QuotientBits+1];
  always_ff @(posedge clk_i) begin
    step_q[0] <= '{rest: RestBits'(odd ? 2 : 1) << (SignificandBits - 4), product: '0, root: '0, significand: x.significand};
    for (int unsigned i = 0; i < QuotientBits; i++) step_q[i+1] <= step(step_q[i]);
  end

  logic [QuotientBits-1:0] root;
  logic                    power;  // of four
  float_t                  y_q;
  assign root  = step_q[QuotientBits].root;
  assign power = root[QuotientBits-1];
  always_ff @(posedge clk_i) begin
    y_q <= round('{
        negative: 1'b0,
        zero: 1'b0,
        greatest: side_root.greatest,
        exponent: side_root.exponent - exponent_t'({1'b0, !power}),
        significand: power ? root[QuotientBits-1:2] : root[QuotientBits-2:1],
        half: !power && root[0],
        rest: 1'b1
    });
  end
  assign y_o = y_q;
endmodule
