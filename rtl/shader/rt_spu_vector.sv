// SPDX-License-Identifier: Apache-2.0
// Four lanes of the shader unit's arithmetic: one operation a clock on vectors of four numbers.
//
// Formula     mov a, frac a - floor(a), add a + b, mul a b, mad a b + c, dot products in all components; rounded as hls/shader/float.hpp says.
// Structure   A multiplier and an adder a lane: a 1 + b, a b + (-0), which changes no product; the adders of lanes 0 and 2 and one more make a dot product.
// Operands    Canonical numbers. op_i is an arithmetic operation; of any other the result has no meaning.
// Latency     rt_spu_pkg::VectorLatency, II 1, never stalls.
// Counterpart spu_compute in hls/shader/spu.hpp.
module rt_spu_vector (
    input  logic                clk_i,
    input  logic                rst_ni,
    input  logic [4:0]          op_i,
    input  rt_spu_pkg::vector_t a_i,
    input  rt_spu_pkg::vector_t b_i,
    input  rt_spu_pkg::vector_t c_i,
    output rt_spu_pkg::vector_t r_o
);
  import rt_float_pkg::*;
  import rt_spu_pkg::vector_t;
  localparam float_t MinusZero = '{negative: 1'b1, exponent: '0, fraction: '0};
  typedef struct packed {
    logic dot;
    logic frac;
  } kind_t;

  // Operands.
  vector_t x_d, y_d, z_d, x_q, y_q, z_q;
  kind_t kind_d, kind_q;
  always_comb begin
    x_d         = a_i;
    y_d         = b_i;
    z_d         = c_i;
    kind_d      = '{dot: 1'b0, frac: 1'b0};
    case (32'(op_i))
      rt_shader_pkg::OpMul: z_d = {4{MinusZero}};
      rt_shader_pkg::OpMad: z_d = c_i;
      rt_shader_pkg::OpAdd: begin
        y_d = {4{One}};
        z_d = b_i;
      end
      rt_shader_pkg::OpDp2h: begin
        kind_d.dot = 1'b1;
        y_d[2]     = One;
        x_d[3]     = '0;
        y_d[3]     = '0;
      end
      rt_shader_pkg::OpDp3: begin
        kind_d.dot = 1'b1;
        x_d[3]     = '0;
        y_d[3]     = '0;
      end
      rt_shader_pkg::OpDp3h: begin
        kind_d.dot = 1'b1;
        y_d[3]     = One;
      end
      rt_shader_pkg::OpDp4: kind_d.dot = 1'b1;
      default: begin
        kind_d.frac = 32'(op_i) == rt_shader_pkg::OpFrac;
        y_d         = {4{One}};
        z_d         = {4{MinusZero}};
      end
    endcase
  end
  always_ff @(posedge clk_i) begin
    x_q    <= x_d;
    y_q    <= y_d;
    z_q    <= z_d;
    kind_q <= kind_d;
  end

  // Products, and what is added to them.
  vector_t product, addend, other, sum, sum_late, fraction, fraction_late;
  kind_t kind_sum, kind_last;
  float_t dot;
  rt_delay #(
      .Cycles(MulLatency),
      .data_t(vector_t)
  ) u_addend (
      .clk_i,
      .rst_ni,
      .data_i(z_q),
      .data_o(addend)
  );
  rt_delay #(
      .Cycles(MulLatency),
      .data_t(kind_t)
  ) u_kind_sum (
      .clk_i,
      .rst_ni,
      .data_i(kind_q),
      .data_o(kind_sum)
  );
  assign other = {
    addend[3], kind_sum.dot ? product[3] : addend[2], addend[1], kind_sum.dot ? product[1] : addend[0]
  };
  for (genvar c = 0; c < 4; c++) begin : gen_lane
    rt_float_mul u_mul (
        .clk_i,
        .rst_ni,
        .x_i(x_q[c]),
        .y_i(y_q[c]),
        .z_o(product[c])
    );
    rt_float_add u_add (
        .clk_i,
        .x_i(product[c]),
        .y_i(other[c]),
        .z_o(sum[c])
    );
    rt_float_frac u_frac (
        .clk_i,
        .x_i(x_q[c]),
        .y_o(fraction[c])
    );
  end
  rt_float_add u_dot (
      .clk_i,
      .x_i(sum[0]),
      .y_i(sum[2]),
      .z_o(dot)
  );

  // All are as late as the dot product.
  rt_delay #(
      .Cycles(AddLatency),
      .data_t(vector_t)
  ) u_sum (
      .clk_i,
      .rst_ni,
      .data_i(sum),
      .data_o(sum_late)
  );
  rt_delay #(
      .Cycles(DotLatency - FracLatency),
      .data_t(vector_t)
  ) u_fraction (
      .clk_i,
      .rst_ni,
      .data_i(fraction),
      .data_o(fraction_late)
  );
  rt_delay #(
      .Cycles(DotLatency - MulLatency),
      .data_t(kind_t)
  ) u_kind_last (
      .clk_i,
      .rst_ni,
      .data_i(kind_sum),
      .data_o(kind_last)
  );
  vector_t r_q;
  always_ff @(posedge clk_i) r_q <= kind_last.dot ? {4{dot}} : kind_last.frac ? fraction_late : sum_late;
  assign r_o = r_q;
endmodule
