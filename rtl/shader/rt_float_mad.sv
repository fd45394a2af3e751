// SPDX-License-Identifier: Apache-2.0
// Product and sum of numbers of the shader unit, each rounded.
//
// Formula     r_o = round(round(x_i * y_i) + z_i).
// Latency     rt_float_pkg::MadLatency, II 1, never stalls.
// Counterpart float_mad in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_mad (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  rt_float_pkg::float_t x_i,
    input  rt_float_pkg::float_t y_i,
    input  rt_float_pkg::float_t z_i,
    output rt_float_pkg::float_t r_o
);
  import rt_float_pkg::*;
  float_t product, addend;
  rt_float_mul u_mul (
      .clk_i,
      .rst_ni,
      .x_i,
      .y_i,
      .z_o(product)
  );
  rt_delay #(
      .Cycles(MulLatency),
      .data_t(float_t)
  ) u_addend (
      .clk_i,
      .rst_ni,
      .data_i(z_i),
      .data_o(addend)
  );
  rt_float_add u_add (
      .clk_i,
      .x_i(product),
      .y_i(addend),
      .z_o(r_o)
  );
endmodule
