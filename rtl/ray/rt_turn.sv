// SPDX-License-Identifier: Apache-2.0
// Light as an object sees it: a rotation, of the kind that a record instance_shade holds.
//
// Formula     turned[i] = floor((turn[3 i] light[0] + turn[3 i + 1] light[1] + turn[3 i + 2] light[2]) 2^-10), exact in TurnedBits.
// Latency     rt_lib_pkg::pipe_latency(rt_stage_pkg::TurnDepth), II 3. DSP blocks: 3.
// Cuts        valid, data and ready (rt_pipe_ctrl). light_i does not change while anything is inside.
// Counterpart turned_light in hls/stages/shade.hpp, golden/engine/stages/shade.hpp.
module rt_turn #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,
    input  rt_contract_pkg::normal_t [2:0] light_i,
    input  logic                          in_valid_i,
    output logic                          in_ready_o,
    input  rt_contract_pkg::turn_t [8:0]  in_data_i,
    input  tag_t                          in_tag_i,
    output logic                          out_valid_o,
    input  logic                          out_ready_i,
    output rt_core_pkg::turned_t [2:0]    out_data_o,
    output tag_t                          out_tag_o
);
  localparam int unsigned ProductBits = rt_contract_pkg::TurnBits + rt_contract_pkg::NormalBits;
  localparam int unsigned SumBits = ProductBits + 2;
  typedef logic signed [SumBits-1:0] sum_t;
  // Row by row: the first as it comes, the others wait.
  logic                            enter;
  rt_contract_pkg::turn_t [2:0]    row;
  rt_contract_pkg::turn_t [8:3]    turn_q;
  logic signed [2:0][ProductBits-1:0] product;
  sum_t                            sum;
  rt_core_pkg::turned_t [2:0]      turned_q;
  always_ff @(posedge clk_i) turn_q <= enter ? in_data_i[8:3] : {turn_q[8:6], turn_q[8:6]};
  assign row = enter ? in_data_i[2:0] : turn_q[5:3];
  for (genvar j = 0; j < 3; j++) begin : gen_term
    rt_mul #(
        .ABits(rt_contract_pkg::TurnBits),
        .BBits(rt_contract_pkg::NormalBits)
    ) u_product (
        .clk_i,
        .a_i(row[j]),
        .b_i(light_i[j]),
        .p_o(product[j])
    );
  end
  assign sum = sum_t'(signed'(product[0])) + sum_t'(signed'(product[1])) + sum_t'(signed'(product[2]));
  // The rows come one after the other; after the last one they stand in their places.
  always_ff @(posedge clk_i) turned_q <= {rt_core_pkg::turned_t'(sum >>> rt_contract_pkg::TurnFrac), turned_q[2:1]};
  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::TurnDepth),
      .Interval(3),
      .tag_t   (tag_t),
      .data_t  (rt_core_pkg::turned_t [2:0])
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i,
      .enter_o    (enter),
      .pipe_data_i(turned_q),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o,
      .out_data_o
  );
endmodule
