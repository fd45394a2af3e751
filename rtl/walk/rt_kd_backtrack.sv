// SPDX-License-Identifier: Apache-2.0
// kd_backtrack: one step up the parent links.
//
// Formula     matched = the parent's axis is the exit face's axis, its split equals the face's plane as an integer, and we are its near child;
//             then the next node is its far child, otherwise the parent. finished = not matched and the parent is the root. bad = the parent is a leaf.
// Latency     rt_stage_pkg::KdBacktrackLatency, II rt_stage_pkg::KdBacktrackInterval, no DSP block.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/kd_backtrack.hpp, golden/engine/stages/kd_backtrack.hpp. Source: Lee 2007, section 3; Foley & Sugerman 2005, section 3.2.
`include "rt_assert.svh"
module rt_kd_backtrack #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                      clk_i,
    input  logic                                      rst_ni,
    input  logic                                      in_valid_i,
    output logic                                      in_ready_o,
    input  rt_contract_pkg::kd_backtrack_in_record_t  in_data_i,
    input  tag_t                                      in_tag_i,
    output logic                                      out_valid_o,
    input  logic                                      out_ready_i,
    output rt_contract_pkg::kd_backtrack_out_record_t out_data_o,
    output tag_t                                      out_tag_o
);
  rt_contract_pkg::kd_backtrack_out_record_t turn_d, turn_q;
  rt_contract_pkg::axis_t axis;
  logic upper;  // we leave through an upper side, moving up the axis, so the near child is the left one
  logic right, enter_unused;

  assign {axis, upper} = in_data_i.face;
  assign right = in_data_i.node[0];

  always_comb begin
    turn_d          = '0;
    turn_d.bad      = in_data_i.parent_axis == rt_contract_pkg::AxisLeaf;
    turn_d.matched  = in_data_i.parent_axis == axis && in_data_i.parent_split == in_data_i.plane && right != upper;
    turn_d.finished = !turn_d.matched && in_data_i.parent == '0;
    turn_d.node     = turn_d.matched ? {in_data_i.parent_child, upper} : in_data_i.parent;
  end
  always_ff @(posedge clk_i) turn_q <= turn_d;

  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::KdBacktrackDepth),
      .Interval(rt_stage_pkg::KdBacktrackInterval),
      .Spare   (rt_stage_pkg::StepSpare),
      .tag_t   (tag_t),
      .data_t  (rt_contract_pkg::kd_backtrack_out_record_t)
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i,
      .enter_o    (enter_unused),
      .pipe_data_i(turn_q),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o,
      .out_data_o
  );

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
