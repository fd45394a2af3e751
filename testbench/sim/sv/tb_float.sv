// SPDX-License-Identifier: Apache-2.0
// The units of the shader's arithmetic side by side, each with the same operands a clock (tests/rtl/rtl_float_test.cpp). The latencies are outputs, so that
// the test need not repeat them.
module tb_float (
    input  logic        clk_i,
    input  logic        rst_ni,
    input  logic [31:0] x_i,
    input  logic [31:0] y_i,
    input  logic [31:0] z_i,
    input  logic [31:0] w_i,
    output logic [31:0] mul_o,
    output logic [31:0] add_o,
    output logic [31:0] mad_o,
    output logic [31:0] dot_o,
    output logic [31:0] rcp_o,
    output logic [31:0] rsq_o,
    output logic [31:0] frac_o,
    output logic [ 3:0] class_o,
    output logic [31:0] latency_o[7]
);
  import rt_float_pkg::*;
  rt_float_mul u_mul (
      .clk_i,
      .rst_ni,
      .x_i,
      .y_i,
      .z_o(mul_o)
  );
  rt_float_add u_add (
      .clk_i,
      .x_i,
      .y_i,
      .z_o(add_o)
  );
  rt_float_mad u_mad (
      .clk_i,
      .rst_ni,
      .x_i,
      .y_i,
      .z_i,
      .r_o(mad_o)
  );
  rt_float_dot u_dot (
      .clk_i,
      .rst_ni,
      .x_i({w_i, z_i, y_i, x_i}),
      .y_i({x_i, w_i, z_i, y_i}),
      .r_o(dot_o)
  );
  rt_float_rcp u_rcp (
      .clk_i,
      .rst_ni,
      .x_i,
      .y_o(rcp_o)
  );
  rt_float_rsq u_rsq (
      .clk_i,
      .rst_ni,
      .x_i,
      .y_o(rsq_o)
  );
  rt_float_frac u_frac (
      .clk_i,
      .x_i,
      .y_o(frac_o)
  );
  assign class_o   = class_of(x_i[31], x_i[30:23]);
  assign latency_o = '{MulLatency, AddLatency, MadLatency, DotLatency, RcpLatency, RsqLatency, FracLatency};
endmodule
