// SPDX-License-Identifier: Apache-2.0
// The ray of an object behind the transform: what rt_instance_enter and the core of two levels, which shares the transform, do with S and D.
//
// Rows        S = M o + b and D = M d of an input come from outside, exact: axis 0 in clock rt_stage_pkg::EnterRows after it has entered (enter_o), axes 1 and
//             2 in the two clocks behind.
// Formula     X_i = floor(D_i 2^(e_i - L - 5)) with L so that the largest has 53 bits; k = L + [sum g_i^2 > 2^18],
//             g_i an upper bound of |X_i| with 9 bits; A_i = X_i >> (1 + k - L), d'_i = round(A_i 2^-25), reciprocals as in ray_setup;
//             near and far of the box, scaled by 2^-s and grown by SlabPad; q = max(0, floor(16 near 2^s)); o'_i = round((S_i 2^e_i + q A_i) 2^-31);
//             t_max = (reach << k) - 1 - (q << 20). Without an entry every field but bad is 0.
// Structure   One axis a clock through one datapath, as in ray_setup. Four times what depends on all axes is gathered from the three (gather_* below): an
//             axis waits until that is known, two clocks and a register later. Names end with what rt_stage_pkg says of the clock.
// Latency     rt_stage_pkg::InstanceEnterLatency, II rt_stage_pkg::InstanceEnterInterval, DSP blocks rt_stage_pkg::ObjectRayBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/instance_enter.hpp, golden/engine/stages/instance_enter.hpp. Source: Wald et al. 2003; Schmittler et al. 2004.
`include "rt_assert.svh"
module rt_object_ray #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                         clk_i,
    input  logic                                         rst_ni,
    input  logic                                         in_valid_i,
    output logic                                         in_ready_o,
    input  rt_contract_pkg::instance_enter_in_record_t   in_data_i,
    input  tag_t                                         in_tag_i,
    output logic                                         enter_o,
    input  logic signed [rt_stage_pkg::EnterSumBits-1:0] place_i,
    input  logic signed [rt_stage_pkg::EnterSumBits-1:0] course_i,
    output logic                                         out_valid_o,
    input  logic                                         out_ready_i,
    output rt_contract_pkg::instance_enter_out_record_t  out_data_o,
    output tag_t                                         out_tag_o
);
  localparam int unsigned PlaceUnit = rt_contract_pkg::InstanceCoefficientFrac + rt_contract_pkg::PositionFrac;
  localparam int unsigned CourseUnit = rt_contract_pkg::InstanceCoefficientFrac + rt_contract_pkg::DirectionFrac;
  localparam int unsigned ExponentMax = 32'(rt_contract_pkg::RowExponentMax);
  localparam int unsigned ScaleMax = 32'(rt_contract_pkg::EntryScaleMax);
  localparam int unsigned SpreadMax = rt_contract_pkg::EntrySpreadMax;
  localparam int unsigned PointBits = rt_contract_pkg::PositionBits;  // of origins and directions
  localparam int unsigned SumBits = rt_stage_pkg::EnterSumBits;
  localparam int unsigned SizeBits = 7;                               // of a size and an exponent
  localparam int unsigned LongBits = 52;                              // A
  localparam int unsigned LongFrac = 51;
  localparam int unsigned FineBits = LongBits + 1;                    // X
  localparam int unsigned BoundFrac = 9;                              // of g
  localparam int unsigned BoundBits = BoundFrac + 2;                  // and a sign bit of 0
  localparam int unsigned SquaresBits = 2 * BoundBits;
  localparam int unsigned PlaceBits = SumBits + ExponentMax;          // S with its exponent
  localparam int unsigned OriginShift = PlaceUnit - rt_contract_pkg::PositionFrac;
  localparam int unsigned OriginBits = OriginShift + PointBits;       // bits of S and q A that the origin depends on
  localparam int unsigned LowBits = rt_stage_pkg::EnterStepBits - 1;  // of the lower piece of A
  localparam int unsigned StartBits = rt_contract_pkg::EntryStartBits + 1;  // q, or more than fits
  localparam int unsigned StepShift = rt_contract_pkg::TFrac - rt_contract_pkg::EntryStartFrac;
  localparam int unsigned SlabBits = rt_contract_pkg::TBits + 1;
  localparam int unsigned ReachBits = rt_contract_pkg::TReachBits + ScaleMax;
  // D << CourseUp, then >> (level - exponent - CourseDown): the latter is 0 to 32.
  localparam int unsigned CourseDown = CourseUnit - 1 - ExponentMax;
  localparam int unsigned CourseUp = LongFrac + 1 - CourseDown;
  localparam int unsigned DownBits = 6;

  typedef logic signed [SumBits-1:0] sum_t;
  typedef logic signed [FineBits-1:0] fine_t;
  typedef logic signed [LongBits-1:0] long_t;
  typedef logic signed [PlaceBits-1:0] place_t;
  typedef logic signed [OriginBits-1:0] origin_sum_t;
  typedef logic signed [StartBits+rt_stage_pkg::EnterStepBits-1:0] step_t;
  typedef logic signed [SlabBits-1:0] slab_t;
  typedef logic [SizeBits-1:0] size_t;
  typedef rt_contract_pkg::position_t position_t;
  typedef rt_contract_pkg::direction_t direction_t;
  typedef rt_contract_pkg::box_face_t [1:0] faces_t;
  typedef struct packed {
    rt_contract_pkg::row_exponent_t exponent;
    faces_t box;
  } row_t;
  typedef struct packed {
    rt_contract_pkg::entry_scale_t scale;
    logic bad;
  } verdict_t;
  typedef struct packed {
    direction_t direction;
    rt_contract_pkg::reciprocal_t reciprocal;
    rt_contract_pkg::recip_shift_t shift;
    logic zero;
    logic negative;
  } course_out_t;
  typedef struct packed {
    course_out_t course;
    position_t origin;
  } axis_out_t;
  typedef struct packed {
    rt_contract_pkg::t_limit_t t_max;
    rt_contract_pkg::entry_scale_t scale;
    rt_contract_pkg::entry_start_t start;
    logic enters;
    logic bad;
  } group_out_t;
  typedef struct packed {
    group_out_t group;
    axis_out_t [2:0] axis;
  } result_t;

  // Bits without the sign.
  function automatic size_t size_of(sum_t value);
    size_of = '0;
    for (int unsigned i = 0; i < SumBits - 1; i++) if (value[i] != value[SumBits-1]) size_of = size_t'(i + 1);
  endfunction

  // ------------------------------------------------------------------------------------------------------------------ where the axes are
  // token_q[t]: the first axis of an input is in clock t. The last one is two clocks behind.
  logic enter;
  localparam int unsigned Tokens = rt_stage_pkg::EnterPlane + 3;
  logic [Tokens-1:0] token;
  logic [Tokens-1:1] token_q;
  assign token = {token_q, enter};
  always_ff @(posedge clk_i) token_q <= rst_ni ? token[Tokens-2:0] : '0;

  // ---------------------------------------------------------------------------------------------------- what waits, one axis a clock
  rt_contract_pkg::row_exponent_t [2:0] e_q;
  rt_contract_pkg::box_face_t [5:0] box_q;
  sum_t place_rows, course_rows;
  assign place_rows  = place_i;
  assign course_rows = course_i;
  always_ff @(posedge clk_i) begin
    e_q   <= enter ? in_data_i.e : {5'b0, e_q[2:1]};
    box_q <= enter ? in_data_i.box : {16'b0, box_q[5:2]};
  end
  assign enter_o = enter;

  // ------------------------------------------------------------------------------------------------------------------ sizes: L and s
  row_t row_size, row_level;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterSize - 2),
      .data_t(row_t)
  ) u_row_size (
      .clk_i,
      .rst_ni,
      .data_i('{exponent: e_q[0], box: box_q[1:0]}),
      .data_o(row_size)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterLevel - (rt_stage_pkg::EnterSize - 1)),
      .data_t(row_t)
  ) u_row_level (
      .clk_i,
      .rst_ni,
      .data_i(row_size),
      .data_o(row_level)
  );
  size_t place_bits_q, course_bits_q, place_size_q, course_size_q;
  logic large_q;
  always_ff @(posedge clk_i) begin
    place_bits_q  <= size_of(place_rows);
    course_bits_q <= size_of(course_rows);
    place_size_q  <= place_bits_q + size_t'(row_size.exponent);
    course_size_q <= course_bits_q + size_t'(row_size.exponent);
    large_q       <= row_size.exponent > rt_contract_pkg::RowExponentMax;
  end
  size_t place_run_q, course_run_q, place_run, course_run, place_level_q, course_level_q;
  logic large_run_q, large_run, large_level_q, first_size;
  assign first_size = token[rt_stage_pkg::EnterSize];
  assign place_run  = first_size || place_size_q > place_run_q ? place_size_q : place_run_q;
  assign course_run = first_size || course_size_q > course_run_q ? course_size_q : course_run_q;
  assign large_run  = large_q || (large_run_q && !first_size);
  always_ff @(posedge clk_i) begin
    place_run_q  <= place_run;
    course_run_q <= course_run;
    large_run_q  <= large_run;
    if (token[rt_stage_pkg::EnterSize+2]) begin
      place_level_q  <= place_run;
      course_level_q <= course_run;
      large_level_q  <= large_run;
    end
  end

  // ------------------------------------------------------------------------------------------------------------------ X, S with its exponent
  sum_t place_level, course_level;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterLevel - rt_stage_pkg::EnterRows),
      .data_t(sum_t)
  ) u_place_level (
      .clk_i,
      .rst_ni,
      .data_i(place_rows),
      .data_o(place_level)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterLevel - rt_stage_pkg::EnterRows),
      .data_t(sum_t)
  ) u_course_level (
      .clk_i,
      .rst_ni,
      .data_i(course_rows),
      .data_o(course_level)
  );
  typedef logic signed [SumBits+CourseUp-1:0] wide_t;
  typedef struct packed {
    place_t place;
    faces_t box;
    rt_contract_pkg::entry_scale_t spread;
  } slab_in_t;
  sum_t place_1q, course_1q;
  row_t row_1q;
  logic [DownBits-1:0] down_1q;
  rt_contract_pkg::entry_scale_t spread_1q;
  logic spread_bad_1q, large_1q;
  wide_t course_2q;
  place_t place_2q;
  row_t row_2q;
  logic [2:0] down_2q;
  rt_contract_pkg::entry_scale_t spread_2q;
  logic bad_2q, bad_3q;
  fine_t fine_q;
  slab_in_t slab_in_q;
  always_ff @(posedge clk_i) begin
    place_1q      <= place_level;
    course_1q     <= course_level;
    row_1q        <= row_level;
    down_1q       <= DownBits'(course_level_q) - DownBits'(row_level.exponent) - DownBits'(CourseDown);
    spread_1q     <= place_level_q > size_t'(PlaceUnit + 1) ?
        rt_contract_pkg::EntryScaleBits'(place_level_q - size_t'(PlaceUnit + 1)) : '0;
    spread_bad_1q <= place_level_q > size_t'(PlaceUnit + 1 + SpreadMax);
    large_1q      <= large_level_q;

    course_2q <= (wide_t'(course_1q) <<< CourseUp) >>> {down_1q[DownBits-1:3], 3'b0};
    place_2q  <= place_t'(place_1q) <<< {row_1q.exponent[3:2], 2'b0};
    row_2q    <= row_1q;
    down_2q   <= down_1q[2:0];
    spread_2q <= spread_1q;
    bad_2q    <= spread_bad_1q || large_1q;

    fine_q    <= fine_t'(course_2q >>> down_2q);
    slab_in_q <= '{place: place_2q <<< row_2q.exponent[1:0], box: row_2q.box, spread: spread_2q};
    bad_3q    <= bad_2q;
  end

  // ------------------------------------------------------------------------------------------------------------------ length: k
  logic [BoundFrac:0] coarse, magnitude;
  logic signed [BoundBits-1:0] bound_q;
  logic signed [2*BoundBits-1:0] square;
  logic [SquaresBits-1:0] squares_run_q, squares_run;
  logic longer_q;
  assign coarse    = fine_q[FineBits-1-:BoundFrac+1];
  assign magnitude = coarse[BoundFrac] ? ~coarse : coarse;
  always_ff @(posedge clk_i) bound_q <= BoundBits'(magnitude) + 1'b1;
  rt_mul #(
      .ABits(BoundBits),
      .BBits(BoundBits)
  ) u_square (
      .clk_i,
      .a_i(bound_q),
      .b_i(bound_q),
      .p_o(square)
  );
  assign squares_run = (token[rt_stage_pkg::EnterSquare] ? '0 : squares_run_q) + SquaresBits'(unsigned'(square));
  always_ff @(posedge clk_i) begin
    squares_run_q <= squares_run;
    if (token[rt_stage_pkg::EnterSquare+2]) longer_q <= squares_run > SquaresBits'(1 << (2 * BoundFrac));
  end

  // ------------------------------------------------------------------------------------------------------------------ A, d'
  typedef struct packed {
    size_t level;
    logic bad;
    fine_t fine;
  } norm_in_t;
  norm_in_t norm;
  size_t level_1q, level_2q, level_3q;
  always_ff @(posedge clk_i) begin
    level_1q <= course_level_q;
    level_2q <= level_1q;
    level_3q <= level_2q;
  end
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterNorm - rt_stage_pkg::EnterFine),
      .data_t(norm_in_t)
  ) u_norm (
      .clk_i,
      .rst_ni,
      .data_i('{level: level_3q, bad: bad_3q, fine: fine_q}),
      .data_o(norm)
  );
  size_t scale_sum;
  long_t along_q;
  verdict_t verdict_q;
  direction_t course_q;
  assign scale_sum = norm.level + size_t'(longer_q);
  always_ff @(posedge clk_i) begin
    along_q   <= long_t'(longer_q ? norm.fine >>> 2 : norm.fine >>> 1);
    verdict_q <= '{
        scale: rt_contract_pkg::EntryScaleBits'(scale_sum - size_t'(CourseUnit)),
        bad: norm.bad || scale_sum < size_t'(CourseUnit) || scale_sum > size_t'(CourseUnit + ScaleMax)
    };
    course_q <= direction_t'((along_q + (long_t'(1) <<< (LongFrac - rt_contract_pkg::DirectionFrac - 1))) >>>
                             (LongFrac - rt_contract_pkg::DirectionFrac));
  end

  // ------------------------------------------------------------------------------------------------------------------ slabs
  course_out_t course_d, course_slab_q, course_out;
  rt_contract_pkg::reciprocal_t reciprocal_q;
  rt_contract_pkg::recip_shift_t shift_q;
  logic zero_q;
  direction_t course_late;
  rt_reciprocal u_reciprocal (
      .clk_i,
      .rst_ni,
      .direction_i (course_q),
      .reciprocal_o(course_d.reciprocal),
      .shift_o     (course_d.shift),
      .zero_o      (course_d.zero),
      .negative_o  (course_d.negative)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::ReciprocalLatency),
      .data_t(direction_t)
  ) u_course_late (
      .clk_i,
      .rst_ni,
      .data_i(course_q),
      .data_o(course_late)
  );
  assign course_d.direction = course_late;

  slab_in_t slab;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterReciprocal - 2 - rt_stage_pkg::EnterFine),
      .data_t(slab_in_t)
  ) u_slab (
      .clk_i,
      .rst_ni,
      .data_i(slab_in_q),
      .data_o(slab)
  );
  localparam int unsigned FaceShift = rt_contract_pkg::PositionFrac - rt_contract_pkg::BoxFaceFrac;
  position_t at_1q, lower_1q, upper_1q, at_2q, lower_2q, upper_2q, at_3q, first_q, last_q;
  logic outside_q, outside_plane;
  always_ff @(posedge clk_i) begin
    at_1q    <= position_t'(slab.place >>> (7'(OriginShift) + 7'(slab.spread)));
    lower_1q <= (position_t'(slab.box[0]) <<< FaceShift) >>> slab.spread;
    upper_1q <= (position_t'(slab.box[1]) <<< FaceShift) >>> slab.spread;

    at_2q         <= at_1q;
    lower_2q      <= lower_1q - rt_contract_pkg::SlabPad;
    upper_2q      <= upper_1q + rt_contract_pkg::SlabPad;
    course_slab_q <= course_d;

    at_3q          <= at_2q;
    first_q        <= course_slab_q.negative ? upper_2q : lower_2q;
    last_q         <= course_slab_q.negative ? lower_2q : upper_2q;
    outside_q      <= course_slab_q.zero && (at_2q < lower_2q || at_2q > upper_2q);
    reciprocal_q   <= course_slab_q.reciprocal;
    shift_q        <= course_slab_q.shift;
    zero_q         <= course_slab_q.zero;
  end
  slab_t first_t, last_t, near_d, far_d;
  rt_t_plane #(
      .TBits(SlabBits)
  ) u_first (
      .clk_i,
      .rst_ni,
      .plane_i     (first_q),
      .origin_i    (at_3q),
      .reciprocal_i(reciprocal_q),
      .shift_i     (shift_q),
      .t_o         (first_t)
  );
  rt_t_plane #(
      .TBits(SlabBits)
  ) u_last (
      .clk_i,
      .rst_ni,
      .plane_i     (last_q),
      .origin_i    (at_3q),
      .reciprocal_i(reciprocal_q),
      .shift_i     (shift_q),
      .t_o         (last_t)
  );
  logic zero_plane;
  rt_delay #(
      .Cycles(rt_stage_pkg::TPlaneLatency),
      .data_t(logic [1:0])
  ) u_zero (
      .clk_i,
      .rst_ni,
      .data_i({zero_q, outside_q}),
      .data_o({zero_plane, outside_plane})
  );
  localparam slab_t SlabLowest = {1'b1, {(SlabBits - 1) {1'b0}}};
  localparam slab_t SlabHighest = {1'b0, {(SlabBits - 1) {1'b1}}};
  slab_t near_run_q, far_run_q, near_q, far_q;
  logic outside_run_q, outside_d, outside_all_q, first_plane;
  assign first_plane = token[rt_stage_pkg::EnterPlane];
  always_comb begin
    near_d = zero_plane ? SlabLowest : first_t;
    far_d  = zero_plane ? SlabHighest : last_t;
    if (!first_plane && near_run_q > near_d) near_d = near_run_q;
    if (!first_plane && far_run_q < far_d) far_d = far_run_q;
    outside_d = outside_plane || (outside_run_q && !first_plane);
  end
  always_ff @(posedge clk_i) begin
    near_run_q    <= near_d;
    far_run_q     <= far_d;
    outside_run_q <= outside_d;
    if (token[rt_stage_pkg::EnterPlane+2]) begin
      near_q        <= near_d;
      far_q         <= far_d;
      outside_all_q <= outside_d;
    end
  end

  // ------------------------------------------------------------------------------------------------------------------ q, what is left of the reach
  verdict_t verdict_near;
  rt_contract_pkg::entry_scale_t spread_near;
  rt_contract_pkg::t_reach_t reach_q, reach_near;
  always_ff @(posedge clk_i) if (enter) reach_q <= in_data_i.reach;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterNear - 1),
      .data_t(rt_contract_pkg::t_reach_t)
  ) u_reach (
      .clk_i,
      .rst_ni,
      .data_i(reach_q),
      .data_o(reach_near)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterNear - rt_stage_pkg::EnterNorm - 1),
      .data_t(verdict_t)
  ) u_verdict (
      .clk_i,
      .rst_ni,
      .data_i(verdict_q),
      .data_o(verdict_near)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterNear - rt_stage_pkg::EnterReciprocal + 2),
      .data_t(rt_contract_pkg::entry_scale_t)
  ) u_spread (
      .clk_i,
      .rst_ni,
      .data_i(slab.spread),
      .data_o(spread_near)
  );
  typedef logic [SlabBits-2:0] way_t;
  way_t way_1q;
  rt_contract_pkg::entry_scale_t back_1q;
  verdict_t verdict_1q, verdict_2q, verdict_3q;
  logic meets_1q, meets_2q, meets_3q;
  logic [StartBits-1:0] start_q, start_3q;
  logic [rt_contract_pkg::TReachBits+2:0] reach_1q;
  logic [2:0] reach_up_1q;
  logic [ReachBits-1:0] reach_2q;
  logic signed [ReachBits:0] left_q;
  group_out_t group_q, group;
  logic enters_origin;
  always_ff @(posedge clk_i) begin
    way_1q      <= near_q < 0 ? '0 : near_q[SlabBits-2:0];
    back_1q     <= rt_contract_pkg::EntryScaleBits'(StepShift) - spread_near;
    verdict_1q  <= verdict_near;
    meets_1q    <= !outside_all_q && near_q <= far_q && far_q >= 0;
    reach_1q    <= (rt_contract_pkg::TReachBits + 3)'(reach_near) << verdict_near.scale[1:0];
    reach_up_1q <= verdict_near.scale[4:2];

    start_q    <= StartBits'(way_1q >> back_1q);
    reach_2q   <= ReachBits'(reach_1q) << {reach_up_1q, 2'b0};
    verdict_2q <= verdict_1q;
    meets_2q   <= meets_1q;

    left_q     <= {1'b0, reach_2q} - {1'b0, start_q, {StepShift{1'b0}}} - 1'b1;
    start_3q   <= start_q;
    verdict_3q <= verdict_2q;
    meets_3q   <= meets_2q && !verdict_2q.bad;

    group_q     <= '0;
    group_q.bad <= verdict_3q.bad;
    if (meets_3q && !start_3q[StartBits-1] && left_q >= 0) begin
      group_q.enters <= 1'b1;
      group_q.start  <= start_3q[StartBits-2:0];
      group_q.scale  <= verdict_3q.scale;
      group_q.t_max  <= left_q[ReachBits-1:rt_contract_pkg::TLimitBits] != '0 ? '1 : left_q[rt_contract_pkg::TLimitBits-1:0];
    end
  end
  localparam int unsigned GroupReady = rt_stage_pkg::EnterStart + 2;
  rt_delay #(
      .Cycles(rt_stage_pkg::InstanceEnterDepth - GroupReady),
      .data_t(group_out_t)
  ) u_group (
      .clk_i,
      .rst_ni,
      .data_i(group_q),
      .data_o(group)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterOrigin - GroupReady),
      .data_t(logic)
  ) u_enters (
      .clk_i,
      .rst_ni,
      .data_i(group_q.enters),
      .data_o(enters_origin)
  );

  // ------------------------------------------------------------------------------------------------------------------ o' = S + q A
  long_t along_start;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterStart - rt_stage_pkg::EnterNorm - 1),
      .data_t(long_t)
  ) u_along (
      .clk_i,
      .rst_ni,
      .data_i(along_q),
      .data_o(along_start)
  );
  step_t step_low;
  logic signed [StartBits+rt_lib_pkg::DspBits-1:0] step_high, step_high_q;
  rt_mul #(
      .ABits(StartBits),
      .BBits(rt_stage_pkg::EnterStepBits)
  ) u_step_low (
      .clk_i,
      .a_i({1'b0, start_q[StartBits-2:0]}),
      .b_i({1'b0, along_start[LowBits-1:0]}),
      .p_o(step_low)
  );
  rt_mul #(
      .ABits(StartBits),
      .BBits(rt_lib_pkg::DspBits)
  ) u_step_high (
      .clk_i,
      .a_i({1'b0, start_q[StartBits-2:0]}),
      .b_i(along_start[LongBits-1:LowBits]),
      .p_o(step_high)
  );
  origin_sum_t place_step;
  step_t step_q;
  position_t origin_out_q;
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterStep - (rt_stage_pkg::EnterReciprocal - 2)),
      .data_t(origin_sum_t)
  ) u_place_step (
      .clk_i,
      .rst_ni,
      .data_i(slab.place[OriginBits-1:0]),
      .data_o(place_step)
  );
  always_ff @(posedge clk_i) begin
    step_high_q  <= step_high;
    step_q       <= step_low + (step_t'(step_high_q) <<< LowBits);
    origin_out_q <= position_t'((step_t'(place_step) + step_q + (step_t'(1) <<< (OriginShift - 1))) >>> OriginShift);
  end

  // ------------------------------------------------------------------------------------------------------------------ the stream
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterOrigin - rt_stage_pkg::EnterReciprocal),
      .data_t(course_out_t)
  ) u_course_out (
      .clk_i,
      .rst_ni,
      .data_i(course_slab_q),
      .data_o(course_out)
  );
  axis_out_t [2:0] axis_q;
  result_t result_in, result;
  axis_out_t axis_d;
  assign axis_d = enters_origin ? '{course: course_out, origin: origin_out_q} : '0;
  always_ff @(posedge clk_i) axis_q <= {axis_d, axis_q[2:1]};
  assign result_in = '{group: group, axis: axis_q};

  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::InstanceEnterDepth),
      .Interval(rt_stage_pkg::InstanceEnterInterval),
      .tag_t   (tag_t),
      .data_t  (result_t)
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i,
      .enter_o    (enter),
      .pipe_data_i(result_in),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o,
      .out_data_o (result)
  );

  always_comb begin
    out_data_o        = '0;
    out_data_o.bad    = result.group.bad;
    out_data_o.enters = result.group.enters;
    out_data_o.start  = result.group.start;
    out_data_o.scale  = result.group.scale;
    out_data_o.t_max  = result.group.t_max;
    for (int unsigned axis = 0; axis < 3; axis++) begin
      out_data_o.origin[axis]     = result.axis[axis].origin;
      out_data_o.direction[axis]  = result.axis[axis].course.direction;
      out_data_o.reciprocal[axis] = result.axis[axis].course.reciprocal;
      out_data_o.shift[axis]      = result.axis[axis].course.shift;
      out_data_o.zero[axis]       = result.axis[axis].course.zero;
      out_data_o.negative[axis]   = result.axis[axis].course.negative;
    end
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
