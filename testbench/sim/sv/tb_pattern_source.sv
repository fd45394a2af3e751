// SPDX-License-Identifier: Apache-2.0
// Source of rays from a test pattern: what a source of the core has to do, and no more.
//
// Pattern     Ray (x, y), x first: code c is base_i[c] + x * step_x_i[c] + y * step_y_i[c]; codes 0 to 2 are the origin, 3 to 5 the direction. Its tag is
//             {y, x}; it wants any hit where x and y are odd, and where mark_i is set every ray with x % 8 = 5 counts as one that could not be read.
// Stream      start_i begins with count_i rays; stop_i forgets those that have not been offered. In rest_i of 256 clocks no new ray is offered.
module tb_pattern_source (
    input  logic                     clk_i,
    input  logic                     rst_ni,
    input  logic                     start_i,
    input  logic                     stop_i,
    input  logic [31:0]              count_i,
    input  logic [15:0]              width_i,
    input  logic signed [31:0]       base_i      [6],
    input  logic signed [31:0]       step_x_i    [6],
    input  logic signed [31:0]       step_y_i    [6],
    input  rt_contract_pkg::t_limit_t t_max_i,
    input  logic                     mark_i,
    input  logic [7:0]               rest_i,
    output logic                     done_o,
    output logic                     ray_valid_o,
    input  logic                     ray_ready_i,
    output rt_core_pkg::tagged_ray_t ray_o
);
  logic [31:0]               left_q, random_q;
  logic [15:0]               x_q, y_q;
  logic signed [31:0]        row_q[6], code_q[6];
  logic                      row_ends;
  rt_core_pkg::tagged_ray_t  ray;
  assign row_ends = x_q == width_i - 1'b1;
  assign done_o   = left_q == '0 && !ray_valid_o;
  always_comb begin
    ray.tag   = {y_q, x_q};
    ray.error = mark_i && x_q[2:0] == 3'd5;
    ray.any   = x_q[0] && y_q[0];
    ray.t_max = t_max_i;
    for (int unsigned a = 0; a < 3; a++) begin
      ray.origin[a]    = rt_contract_pkg::position_t'(code_q[a]);
      ray.direction[a] = rt_contract_pkg::direction_t'(code_q[a+3]);
    end
  end
  always_ff @(posedge clk_i) begin
    random_q <= random_q * 32'd1664525 + 32'd1013904223;
    if (!ray_valid_o || ray_ready_i) begin
      ray_valid_o <= 1'b0;
      if (left_q != '0 && !stop_i && random_q[31:24] >= rest_i) begin
        ray_valid_o <= 1'b1;
        ray_o       <= ray;
        left_q      <= left_q - 1'b1;
        x_q         <= row_ends ? '0 : x_q + 1'b1;
        if (row_ends) y_q <= y_q + 1'b1;
        for (int unsigned c = 0; c < 6; c++) begin
          code_q[c] <= (row_ends ? row_q[c] + step_y_i[c] : code_q[c] + step_x_i[c]);
          if (row_ends) row_q[c] <= row_q[c] + step_y_i[c];
        end
      end
    end
    if (stop_i) left_q <= '0;
    if (start_i) begin
      left_q <= count_i;
      x_q    <= '0;
      y_q    <= '0;
      row_q  <= base_i;
      code_q <= base_i;
    end
    if (!rst_ni) begin
      left_q      <= '0;
      ray_valid_o <= 1'b0;
    end
  end
endmodule
