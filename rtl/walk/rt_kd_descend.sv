// SPDX-License-Identifier: Apache-2.0
// kd_descend: one interior node on the way down.
//
// Formula     near if t < t_plane(split), else far; a tie goes far. A direction of zero: near if origin < split.
//             The near child is the left one, or the right one if the direction is negative. node = 2 * child + right.
// Latency     rt_stage_pkg::KdDescendLatency, II rt_stage_pkg::KdDescendInterval, DSP blocks rt_stage_pkg::KdDescendBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/kd_descend.hpp, golden/engine/stages/kd_descend.hpp. Source: Lee 2007, section 3; Foley & Sugerman 2005, section 3.
`include "rt_assert.svh"
module rt_kd_descend #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   in_valid_i,
    output logic                                   in_ready_o,
    input  rt_contract_pkg::kd_descend_in_record_t in_data_i,
    input  tag_t                                   in_tag_i,
    output logic                                   out_valid_o,
    input  logic                                   out_ready_i,
    output rt_contract_pkg::kd_descend_out_record_t out_data_o,
    output tag_t                                   out_tag_o
);
  typedef struct packed {
    rt_contract_pkg::t_t t;
    logic zero;
    logic negative;
    logic below;  // origin < split
  } late_t;
  typedef struct packed {
    tag_t tag;
    rt_contract_pkg::pair_index_t child;
  } pass_t;

  // A register before the comparison: what comes in has been chosen in the same clock.
  typedef struct packed {
    rt_contract_pkg::t_t t;
    logic zero;
    logic negative;
    rt_contract_pkg::position_t origin;
    rt_contract_pkg::position_t split;
  } early_t;

  early_t early_q;
  late_t late_in, late;
  pass_t pass_in, pass;
  rt_contract_pkg::t_t plane;
  logic near, right_in, right, enter_unused;

  rt_t_plane u_plane (
      .clk_i,
      .rst_ni,
      .plane_i     (in_data_i.split),
      .origin_i    (in_data_i.origin),
      .reciprocal_i(in_data_i.reciprocal),
      .shift_i     (in_data_i.shift),
      .t_o         (plane)
  );

  always_ff @(posedge clk_i) begin
    early_q <= '{
            t: in_data_i.t,
            zero: in_data_i.zero,
            negative: in_data_i.negative,
            origin: in_data_i.origin,
            split: in_data_i.split
        };
  end
  assign late_in = '{t: early_q.t, zero: early_q.zero, negative: early_q.negative, below: early_q.origin < early_q.split};
  rt_delay #(
      .Cycles(rt_stage_pkg::TPlaneLatency - 1),
      .data_t(late_t)
  ) u_late (
      .clk_i,
      .rst_ni,
      .data_i(late_in),
      .data_o(late)
  );

  assign near     = late.zero ? late.below : late.t < plane;
  assign right_in = near == late.negative;

  assign pass_in = '{tag: in_tag_i, child: in_data_i.child};
  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::KdDescendDepth),
      .Interval(rt_stage_pkg::KdDescendInterval),
      .Spare   (rt_stage_pkg::StepSpare),
      .tag_t   (pass_t),
      .data_t  (logic)
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i   (pass_in),
      .enter_o    (enter_unused),
      .pipe_data_i(right_in),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o  (pass),
      .out_data_o (right)
  );

  assign out_tag_o  = pass.tag;
  assign out_data_o = '{padding: '0, node: {pass.child, right}};

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
