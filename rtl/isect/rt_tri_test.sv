// SPDX-License-Identifier: Apache-2.0
// tri_test: unit-triangle test.
//
// Formula     o' = M o + m, d' = M d (six rt_row_product); signs of o'z and d'z flipped so that d'z > 0
//             U = o'u d'z - o'z d'u,  V = o'v d'z - o'z d'v,  W = (d'z >> eu) - U - (V >> (eu - ev))
//             hit if d'z > 0, o'z <= 0, -EpsUv <= U <= (d'z >> eu) + EpsUv, -EpsUv <= V <= (d'z >> ev) + EpsUv, W >= -EpsW, t < 8;
//             t = floor(-o'z / d'z). Without a hit every field but the id is 0.
// Structure   Six rt_row_product, and rt_unit_test behind them.
// Input       InputHops registers between the inputs and the rows, for a long wire. An input has its credit before it sets out, so they never stall.
// Latency     rt_stage_pkg::TriTestLatency and InputHops, II rt_stage_pkg::TriTestInterval, DSP blocks rt_stage_pkg::TriTestBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/tri_test.hpp, golden/engine/stages/tri_test.hpp. Source: Arenberg 1988; Woop et al. 2005, section 3.2; Schmittler et al. 2004.
module rt_tri_test #(
    parameter int unsigned InputHops = 0,
    parameter int unsigned Spare = 0,  // places for results beyond the round trip
    parameter type tag_t = logic [15:0]
) (
    input  logic                                  clk_i,
    input  logic                                  rst_ni,
    input  logic                                  in_valid_i,
    output logic                                  in_ready_o,
    input  rt_contract_pkg::tri_test_in_record_t  in_data_i,
    input  tag_t                                  in_tag_i,
    output logic                                  out_valid_o,
    input  logic                                  out_ready_i,
    output rt_contract_pkg::tri_test_out_record_t out_data_o,
    output tag_t                                  out_tag_o
);
  rt_contract_pkg::tri_test_in_record_t in_data;
  logic                                 hop_valid_unused;
  rt_hop #(
      .Depth (InputHops),
      .data_t(rt_contract_pkg::tri_test_in_record_t)
  ) u_input (
      .clk_i,
      .rst_ni,
      .valid_i(1'b0),
      .data_i (in_data_i),
      .valid_o(hop_valid_unused),
      .data_o (in_data)
  );
  rt_contract_pkg::row_position_t [2:0] origin;  // u, v, z
  rt_contract_pkg::row_direction_t [2:0] direction;
  rt_row_product u_origin_u (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.u),
      .point_i (in_data.origin),
      .offset_i(in_data.offset_u),
      .result_o(origin[0])
  );
  rt_row_product u_origin_v (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.v),
      .point_i (in_data.origin),
      .offset_i(in_data.offset_v),
      .result_o(origin[1])
  );
  rt_row_product u_origin_z (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.n),
      .point_i (in_data.origin),
      .offset_i(in_data.offset_n),
      .result_o(origin[2])
  );
  rt_row_product u_direction_u (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.u),
      .point_i (in_data.direction),
      .offset_i('0),
      .result_o(direction[0])
  );
  rt_row_product u_direction_v (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.v),
      .point_i (in_data.direction),
      .offset_i('0),
      .result_o(direction[1])
  );
  rt_row_product u_direction_z (
      .clk_i,
      .rst_ni,
      .row_i   (in_data.n),
      .point_i (in_data.direction),
      .offset_i('0),
      .result_o(direction[2])
  );

  logic enter_unused;
  rt_unit_test #(
      .RowsLatency(rt_stage_pkg::RowLatency + InputHops),
      .Spare      (Spare),
      .tag_t      (tag_t)
  ) u_test (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_data_i,
      .in_tag_i,
      .enter_o    (enter_unused),
      .origin_i   (origin),
      .direction_i(direction),
      .out_valid_o,
      .out_ready_i,
      .out_data_o,
      .out_tag_o
  );
endmodule
