// SPDX-License-Identifier: Apache-2.0
// Product of two numbers of the shader unit, rounded to nearest even.
//
// Formula     z_o = round(x_i * y_i).
// Latency     rt_float_pkg::MulLatency, II 1, never stalls.
// DSP blocks  rt_lib_pkg::mul_blocks(25, 25): four.
// Counterpart float_mul in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_mul (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  rt_float_pkg::float_t x_i,
    input  rt_float_pkg::float_t y_i,
    output rt_float_pkg::float_t z_o
);
  import rt_float_pkg::*;
  localparam int unsigned OperandBits = SignificandBits + 1;
  localparam int unsigned ProductBits = 2 * SignificandBits;
  typedef struct packed {
    logic      negative;
    logic      zero;
    exponent_t exponent;
  } side_t;

  parts_t x, y;
  side_t side, side_product;
  assign x    = read(x_i);
  assign y    = read(y_i);
  assign side = '{
          negative: x.negative ^ y.negative,
          zero: x.significand == '0 || y.significand == '0,
          exponent: x.exponent + y.exponent - exponent_t'(Bias)
      };

  logic signed [2*OperandBits-1:0] product;
  rt_mul #(
      .ABits(OperandBits),
      .BBits(OperandBits)
  ) u_product (
      .clk_i,
      .a_i(signed'({1'b0, x.significand})),
      .b_i(signed'({1'b0, y.significand})),
      .p_o(product)
  );
  rt_delay #(
      .Cycles(MulLatency - 2),
      .data_t(side_t)
  ) u_side (
      .clk_i,
      .rst_ni,
      .data_i(side),
      .data_o(side_product)
  );

  logic carried;
  logic [ProductBits-1:0] normal;
  unrounded_t unrounded_q;
  float_t z_q;
  assign carried = product[ProductBits-1];
  assign normal  = carried ? product[ProductBits-1:0] : product[ProductBits-1:0] << 1;
  always_ff @(posedge clk_i) begin
    unrounded_q <= '{
        negative: side_product.negative,
        zero: side_product.zero,
        greatest: 1'b0,
        exponent: side_product.exponent + exponent_t'({1'b0, carried}),
        significand: normal[ProductBits-1:SignificandBits],
        half: normal[SignificandBits-1],
        rest: normal[SignificandBits-2:0] != '0
    };
    z_q <= round(unrounded_q);
  end
  assign z_o = z_q;
endmodule
