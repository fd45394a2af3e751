// SPDX-License-Identifier: Apache-2.0
// Dot product of four components of the shader unit. Products of fewer components have zeros, or a 1, in the others.
//
// Formula     r_o = (x0 y0 + x1 y1) + (x2 y2 + x3 y3), each product and each sum rounded.
// Latency     rt_float_pkg::DotLatency, II 1, never stalls.
// Counterpart float_dot in hls/shader/float.hpp and golden/shader/float.hpp.
module rt_float_dot (
    input  logic                       clk_i,
    input  logic                       rst_ni,
    input  rt_float_pkg::float_t [3:0] x_i,
    input  rt_float_pkg::float_t [3:0] y_i,
    output rt_float_pkg::float_t       r_o
);
  import rt_float_pkg::*;
  float_t [3:0] product;
  float_t [1:0] sum;
  for (genvar c = 0; c < 4; c++) begin : gen_product
    rt_float_mul u_mul (
        .clk_i,
        .rst_ni,
        .x_i(x_i[c]),
        .y_i(y_i[c]),
        .z_o(product[c])
    );
  end
  for (genvar p = 0; p < 2; p++) begin : gen_sum
    rt_float_add u_add (
        .clk_i,
        .x_i(product[2*p]),
        .y_i(product[2*p+1]),
        .z_o(sum[p])
    );
  end
  rt_float_add u_add (
      .clk_i,
      .x_i(sum[0]),
      .y_i(sum[1]),
      .z_o(r_o)
  );
endmodule
