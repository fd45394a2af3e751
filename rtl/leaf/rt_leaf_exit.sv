// SPDX-License-Identifier: Apache-2.0
// leaf_exit: where a ray leaves a leaf's cell.
//
// Formula     (t_exit, face) = min over the axes of t_plane(bound on the exit side); the lowest axis wins a tie; axes of direction zero do not exit.
//             broken = exits and t_exit < t. Without an exit every field is 0.
// Latency     rt_stage_pkg::LeafExitLatency, II rt_stage_pkg::LeafExitInterval, DSP blocks rt_stage_pkg::LeafExitBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/leaf_exit.hpp, golden/engine/stages/leaf_exit.hpp. Source: Lee 2007, section 3; Kay & Kajiya 1986 (slabs).
`include "rt_assert.svh"
module rt_leaf_exit #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   in_valid_i,
    output logic                                   in_ready_o,
    input  rt_contract_pkg::leaf_exit_in_record_t  in_data_i,
    input  tag_t                                   in_tag_i,
    output logic                                   out_valid_o,
    input  logic                                   out_ready_i,
    output rt_contract_pkg::leaf_exit_out_record_t out_data_o,
    output tag_t                                   out_tag_o
);
  typedef struct packed {
    rt_contract_pkg::position_t [2:0] plane;
    logic [2:0] upper;
    logic [2:0] zero;
  } sides_t;
  typedef struct packed {
    sides_t sides;
    rt_contract_pkg::t_t t;
  } late_t;

  rt_contract_pkg::position_t [2:0] plane_q, origin_q;
  rt_contract_pkg::reciprocal_t [2:0] reciprocal_q;
  rt_contract_pkg::recip_shift_t [2:0] shift_q;
  logic [2:0] upper_q, zero_q;
  rt_contract_pkg::t_t t_q;
  late_t late_in, late;
  sides_t sides_q;
  rt_contract_pkg::t_t t_plane[3];
  rt_contract_pkg::t_t t_plane_q[3];
  rt_contract_pkg::leaf_exit_out_record_t exit_d, exit_q;
  logic enter_unused;

  for (genvar axis = 0; axis < 3; axis++) begin : gen_axis
    always_ff @(posedge clk_i) begin
      upper_q[axis] <= !in_data_i.negative[axis];
      plane_q[axis] <= in_data_i.negative[axis] ? in_data_i.bound[2*axis] : in_data_i.bound[2*axis+1];
    end
    rt_t_plane u_plane (
        .clk_i,
        .rst_ni,
        .plane_i     (plane_q[axis]),
        .origin_i    (origin_q[axis]),
        .reciprocal_i(reciprocal_q[axis]),
        .shift_i     (shift_q[axis]),
        .t_o         (t_plane[axis])
    );
  end
  always_ff @(posedge clk_i) begin
    origin_q     <= in_data_i.origin;
    reciprocal_q <= in_data_i.reciprocal;
    shift_q      <= in_data_i.shift;
    zero_q       <= in_data_i.zero;
    t_q          <= in_data_i.t;
  end
  assign late_in = '{sides: '{plane: plane_q, upper: upper_q, zero: zero_q}, t: t_q};

  rt_delay #(
      .Cycles(rt_stage_pkg::TPlaneLatency),
      .data_t(late_t)
  ) u_late (
      .clk_i,
      .rst_ni,
      .data_i(late_in),
      .data_o(late)
  );

  // All comparisons side by side, the choice a clock later.
  logic one_below_zero_q, two_below_zero_q, two_below_one_q;
  logic [2:0] broken_q;
  always_ff @(posedge clk_i) begin
    one_below_zero_q <= t_plane[1] < t_plane[0];
    two_below_zero_q <= t_plane[2] < t_plane[0];
    two_below_one_q  <= t_plane[2] < t_plane[1];
    for (int unsigned axis = 0; axis < 3; axis++) broken_q[axis] <= t_plane[axis] < late.t;
    t_plane_q <= t_plane;
    sides_q   <= late.sides;
  end

  logic [1:0] first;  // of axes 0 and 1
  logic [1:0] best;
  always_comb begin
    first = !sides_q.zero[1] && (sides_q.zero[0] || one_below_zero_q) ? 2'd1 : 2'd0;
    best  = first;
    if (!sides_q.zero[2]) begin
      if (sides_q.zero[1:0] == 2'b11) best = 2'd2;
      else if (first == 2'd1 ? two_below_one_q : two_below_zero_q) best = 2'd2;
    end
    exit_d = '0;
    if (sides_q.zero != 3'b111) begin
      exit_d.t_exit = t_plane_q[best];
      exit_d.face   = {best, sides_q.upper[best]};
      exit_d.plane  = sides_q.plane[best];
      exit_d.exits  = 1'b1;
      exit_d.broken = broken_q[best];
    end
  end
  always_ff @(posedge clk_i) exit_q <= exit_d;

  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::LeafExitDepth),
      .Interval(rt_stage_pkg::LeafExitInterval),
      .tag_t   (tag_t),
      .data_t  (rt_contract_pkg::leaf_exit_out_record_t)
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i,
      .enter_o    (enter_unused),
      .pipe_data_i(exit_q),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o,
      .out_data_o
  );

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
