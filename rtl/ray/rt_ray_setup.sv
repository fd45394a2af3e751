// SPDX-License-Identifier: Apache-2.0
// ray_setup: reciprocals of the direction, and whether the ray can be traced.
//
// Formula     per axis, D = |direction code|: R = min(floor(2^52 / (D << e)), 2^26 - 1) with the sign of the direction, D << e in [2^26, 2^27);
//             shift = 26 - e. A zero direction gives R = 0 and shift = 0. valid = origin inside the box, bounds included, and some direction not zero.
// Structure   One rt_reciprocal for the three axes, one axis a clock. What passes unchanged waits beside the pipeline.
// Latency     rt_stage_pkg::RaySetupLatency, II rt_stage_pkg::RaySetupInterval (the three axes share one divider), no DSP block.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/ray_setup.hpp, golden/engine/stages/ray_setup.hpp. Source: Lee 2007, section 3; Amanatides & Woo 1987.
`include "rt_assert.svh"
module rt_ray_setup #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   in_valid_i,
    output logic                                   in_ready_o,
    input  rt_contract_pkg::ray_setup_in_record_t  in_data_i,
    input  tag_t                                   in_tag_i,
    output logic                                   out_valid_o,
    input  logic                                   out_ready_i,
    output rt_contract_pkg::ray_setup_out_record_t out_data_o,
    output tag_t                                   out_tag_o
);
  typedef struct packed {
    rt_contract_pkg::recip_shift_t shift;
    logic zero;
    logic negative;
    logic outside;
  } axis_flags_t;
  typedef struct packed {
    axis_flags_t flags;
    rt_contract_pkg::reciprocal_t reciprocal;
  } axis_result_t;
  typedef struct packed {
    tag_t tag;
    rt_contract_pkg::flag_t any;
    rt_contract_pkg::t_limit_t t_max;
    rt_contract_pkg::direction_t [2:0] direction;
    rt_contract_pkg::position_t [2:0] origin;
  } pass_t;

  logic enter;

  // ------------------------------------------------------------------------------------------------- one axis a clock, lowest first
  rt_contract_pkg::direction_t [2:0] direction_q;
  rt_contract_pkg::position_t [2:0] origin_q;
  rt_contract_pkg::position_t [5:0] box_q;
  always_ff @(posedge clk_i) begin
    direction_q <= enter ? in_data_i.direction : {rt_contract_pkg::direction_t'(0), direction_q[2:1]};
    origin_q    <= enter ? in_data_i.origin : {rt_contract_pkg::position_t'(0), origin_q[2:1]};
    box_q       <= enter ? in_data_i.box : {{2{rt_contract_pkg::position_t'(0)}}, box_q[5:2]};
  end

  rt_contract_pkg::direction_t direction;
  rt_contract_pkg::position_t origin, lower, upper;
  assign direction = direction_q[0];
  assign origin    = origin_q[0];
  assign lower     = box_q[0];
  assign upper     = box_q[1];

  axis_flags_t flags;
  rt_contract_pkg::reciprocal_t reciprocal;
  rt_reciprocal u_reciprocal (
      .clk_i,
      .rst_ni,
      .direction_i (direction),
      .reciprocal_o(reciprocal),
      .shift_o     (flags.shift),
      .zero_o      (flags.zero),
      .negative_o  (flags.negative)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::ReciprocalLatency),
      .data_t(logic)
  ) u_outside (
      .clk_i,
      .rst_ni,
      .data_i(origin < lower || origin > upper),
      .data_o(flags.outside)
  );

  // The result of axis 0 is two clocks older than that of axis 2.
  axis_result_t [2:0] result_q, result;
  always_ff @(posedge clk_i) result_q <= {axis_result_t'{flags: flags, reciprocal: reciprocal}, result_q[2:1]};

  // ---------------------------------------------------------------------------------------------------------------------- the stream
  pass_t pass_in, pass;
  assign pass_in = '{
          tag: in_tag_i,
          any: in_data_i.any,
          t_max: in_data_i.t_max,
          direction: in_data_i.direction,
          origin: in_data_i.origin
      };
  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::RaySetupDepth),
      .Interval(rt_stage_pkg::RaySetupInterval),
      .tag_t   (pass_t),
      .data_t  (axis_result_t [2:0])
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i   (pass_in),
      .enter_o    (enter),
      .pipe_data_i(result_q),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o  (pass),
      .out_data_o (result)
  );

  assign out_tag_o = pass.tag;
  always_comb begin
    out_data_o           = '0;
    out_data_o.origin    = pass.origin;
    out_data_o.direction = pass.direction;
    out_data_o.t_max     = pass.t_max;
    out_data_o.any       = pass.any;
    for (int unsigned axis = 0; axis < 3; axis++) begin
      out_data_o.reciprocal[axis] = result[axis].reciprocal;
      out_data_o.shift[axis]      = result[axis].flags.shift;
      out_data_o.zero[axis]       = result[axis].flags.zero;
      out_data_o.negative[axis]   = result[axis].flags.negative;
    end
    out_data_o.valid = !(result[0].flags.outside || result[1].flags.outside || result[2].flags.outside) &&
        !(result[0].flags.zero && result[1].flags.zero && result[2].flags.zero);
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
