// SPDX-License-Identifier: Apache-2.0
// The one transformation unit of a core of two levels: a ray into a triangle's space, for its test, or into that of an instance's object.
//
// Formula     place = M o + b and course = M d, three rows, exact. An instance: S and D as rt_object_ray wants them. A triangle, u, v, n: position
//             = floor(place 2^-26 + 1/2) and direction likewise, wrapped to 27 bits, as rt_row_product gives them.
// Choice      entry_i: the instance; otherwise the triangle. One of either in a clock; nothing is held up.
// Latency     rt_stage_pkg::TransformLatency. II 1, never stalls. DSP blocks: 18 products of 32 x 27 bits, four each, as many as rt_tri_test has by itself.
// Source      Schmittler et al. 2004: one unit transforms rays for triangles and for objects.
module rt_transform (
    input  logic                                                 clk_i,
    input  logic                                                 rst_ni,
    input  logic                                                 entry_i,
    input  rt_contract_pkg::instance_enter_in_record_t           instance_i,
    input  rt_contract_pkg::tri_test_in_record_t                 triangle_i,
    output logic [2:0][rt_stage_pkg::EnterSumBits-1:0]           place_o,
    output logic [2:0][rt_stage_pkg::EnterSumBits-1:0]           course_o,
    output rt_contract_pkg::row_position_t [2:0]                 position_o,
    output rt_contract_pkg::row_direction_t [2:0]                direction_o
);
  localparam int unsigned RowBits = rt_contract_pkg::InstanceCoefficientBits;
  localparam int unsigned PointBits = rt_contract_pkg::PositionBits;
  localparam int unsigned ProductBits = RowBits + PointBits;
  localparam int unsigned SumBits = rt_stage_pkg::EnterSumBits;
  localparam int unsigned RowShift = rt_contract_pkg::CoefficientFrac;
  localparam int unsigned OffsetShift = RowShift + rt_contract_pkg::PositionFrac - rt_contract_pkg::OffsetFrac;
  // Half of the last bit of a triangle's result, in units of its offset.
  localparam int unsigned HalfShift = RowShift - 1 - OffsetShift;
  typedef logic signed [RowBits-1:0] coefficient_t;
  typedef logic signed [PointBits-1:0] point_t;
  typedef logic signed [SumBits-1:0] sum_t;
  typedef logic signed [rt_contract_pkg::InstanceOffsetBits-1:0] term_t;

  // --- the choice ---
  logic entry_q, entry;
  coefficient_t row_q[3][3];
  point_t origin_q[3], direction_q[3];
  term_t term_q[3], term[3];
  rt_contract_pkg::coefficient_t [2:0][2:0] rows;
  rt_contract_pkg::offset_t [2:0] offsets;
  assign rows    = {triangle_i.n, triangle_i.v, triangle_i.u};
  assign offsets = {triangle_i.offset_n, triangle_i.offset_v, triangle_i.offset_u};
  always_ff @(posedge clk_i) begin
    entry_q <= entry_i;
    for (int unsigned i = 0; i < 3; i++) begin
      for (int unsigned j = 0; j < 3; j++) row_q[i][j] <= entry_i ? signed'(instance_i.m[3*i+j]) : coefficient_t'(signed'(rows[i][j]));
      // The rounding constant joins a triangle's offset.
      term_q[i]      <= entry_i ? signed'(instance_i.b[i]) : term_t'(signed'(offsets[i])) + (term_t'(1) <<< HalfShift);
      origin_q[i]    <= entry_i ? signed'(instance_i.origin[i]) : signed'(triangle_i.origin[i]);
      direction_q[i] <= entry_i ? signed'(instance_i.direction[i]) : signed'(triangle_i.direction[i]);
    end
  end
  rt_delay #(
      .Cycles(rt_stage_pkg::EnterMulLatency),
      .data_t(logic)
  ) u_entry (
      .clk_i,
      .rst_ni,
      .data_i(entry_q),
      .data_o(entry)
  );

  // --- three rows ---
  sum_t half;
  assign half = entry ? '0 : sum_t'(1) <<< (RowShift - 1);
  for (genvar i = 0; i < 3; i++) begin : gen_row
    logic signed [ProductBits-1:0] place_product[3], course_product[3];
    sum_t place_low_q, place_high_q, course_low_q, course_high_q, place_q, course_q;
    for (genvar j = 0; j < 3; j++) begin : gen_product
      rt_mul #(
          .ABits(RowBits),
          .BBits(PointBits)
      ) u_place (
          .clk_i,
          .a_i(row_q[i][j]),
          .b_i(origin_q[j]),
          .p_o(place_product[j])
      );
      rt_mul #(
          .ABits(RowBits),
          .BBits(PointBits)
      ) u_course (
          .clk_i,
          .a_i(row_q[i][j]),
          .b_i(direction_q[j]),
          .p_o(course_product[j])
      );
    end
    rt_delay #(
        .Cycles(rt_stage_pkg::EnterMulLatency),
        .data_t(term_t)
    ) u_term (
        .clk_i,
        .rst_ni,
        .data_i(term_q[i]),
        .data_o(term[i])
    );
    always_ff @(posedge clk_i) begin
      place_low_q   <= sum_t'(place_product[0]) + sum_t'(place_product[1]);
      place_high_q  <= sum_t'(place_product[2]) + (entry ? sum_t'(term[i]) <<< rt_contract_pkg::PositionFrac : sum_t'(term[i]) <<< OffsetShift);
      course_low_q  <= sum_t'(course_product[0]) + sum_t'(course_product[1]);
      course_high_q <= sum_t'(course_product[2]) + half;
      place_q       <= place_low_q + place_high_q;
      course_q      <= course_low_q + course_high_q;
    end
    assign place_o[i]     = place_q;
    assign course_o[i]    = course_q;
    assign position_o[i]  = place_q[RowShift+:rt_contract_pkg::RowPositionBits];
    assign direction_o[i] = course_q[RowShift+:rt_contract_pkg::RowDirectionBits];
  end
endmodule
