// SPDX-License-Identifier: Apache-2.0
// instance_enter: a ray of the world becomes a ray of an instance's object, or passes its box by.
//
// Formula     S = M o + b and D = M d, exact; X_i = floor(D_i 2^(e_i - L - 5)) with L so that the largest has 53 bits; k = L + [sum g_i^2 > 2^18],
//             g_i an upper bound of |X_i| with 9 bits; A_i = X_i >> (1 + k - L), d'_i = round(A_i 2^-25), reciprocals as in ray_setup;
//             near and far of the box, scaled by 2^-s and grown by SlabPad; q = max(0, floor(16 near 2^s)); o'_i = round((S_i 2^e_i + q A_i) 2^-31);
//             t_max = (reach << k) - 1 - (q << 20). Without an entry every field but bad is 0.
// Structure   Rows, one axis a clock, and rt_object_ray behind them.
// Latency     rt_stage_pkg::InstanceEnterLatency, II rt_stage_pkg::InstanceEnterInterval, DSP blocks rt_stage_pkg::InstanceEnterBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/instance_enter.hpp, golden/engine/stages/instance_enter.hpp. Source: Wald et al. 2003; Schmittler et al. 2004.
module rt_instance_enter #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                         clk_i,
    input  logic                                         rst_ni,
    input  logic                                         in_valid_i,
    output logic                                         in_ready_o,
    input  rt_contract_pkg::instance_enter_in_record_t   in_data_i,
    input  tag_t                                         in_tag_i,
    output logic                                         out_valid_o,
    input  logic                                         out_ready_i,
    output rt_contract_pkg::instance_enter_out_record_t  out_data_o,
    output tag_t                                         out_tag_o
);
  localparam int unsigned PointBits = rt_contract_pkg::PositionBits;  // of origins and directions
  localparam int unsigned SumBits = rt_stage_pkg::EnterSumBits;
  localparam int unsigned MulLatency = rt_stage_pkg::EnterMulLatency;
  typedef logic signed [SumBits-1:0] sum_t;

  rt_contract_pkg::instance_coefficient_t [8:0] m_q;
  rt_contract_pkg::instance_offset_t [2:0] b_q;
  rt_contract_pkg::position_t [2:0] origin_q;
  rt_contract_pkg::direction_t [2:0] direction_q;
  logic enter;
  always_ff @(posedge clk_i) begin
    m_q   <= {96'b0, m_q[8:3]};
    b_q   <= {34'b0, b_q[2:1]};
    if (enter) begin
      m_q         <= in_data_i.m;
      b_q         <= in_data_i.b;
      origin_q    <= in_data_i.origin;
      direction_q <= in_data_i.direction;
    end
  end

  localparam int unsigned ProductBits = rt_contract_pkg::InstanceCoefficientBits + PointBits;
  logic signed [ProductBits-1:0] place_product[3], course_product[3];
  for (genvar i = 0; i < 3; i++) begin : gen_product
    rt_mul #(
        .ABits(rt_contract_pkg::InstanceCoefficientBits),
        .BBits(PointBits)
    ) u_place (
        .clk_i,
        .a_i(m_q[i]),
        .b_i(origin_q[i]),
        .p_o(place_product[i])
    );
    rt_mul #(
        .ABits(rt_contract_pkg::InstanceCoefficientBits),
        .BBits(PointBits)
    ) u_course (
        .clk_i,
        .a_i(m_q[i]),
        .b_i(direction_q[i]),
        .p_o(course_product[i])
    );
  end
  rt_contract_pkg::instance_offset_t b;
  rt_delay #(
      .Cycles(MulLatency),
      .data_t(rt_contract_pkg::instance_offset_t)
  ) u_b (
      .clk_i,
      .rst_ni,
      .data_i(b_q[0]),
      .data_o(b)
  );
  sum_t place_low_q, place_high_q, course_low_q, course_high_q, place_rows_q, course_rows_q;
  always_ff @(posedge clk_i) begin
    place_low_q   <= sum_t'(place_product[0]) + sum_t'(place_product[1]);
    place_high_q  <= sum_t'(place_product[2]) + (sum_t'(b) <<< rt_contract_pkg::PositionFrac);
    course_low_q  <= sum_t'(course_product[0]) + sum_t'(course_product[1]);
    course_high_q <= sum_t'(course_product[2]);
    place_rows_q  <= place_low_q + place_high_q;
    course_rows_q <= course_low_q + course_high_q;
  end

  rt_object_ray #(
      .tag_t(tag_t)
  ) u_ray (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_data_i,
      .in_tag_i,
      .enter_o (enter),
      .place_i (place_rows_q),
      .course_i(course_rows_q),
      .out_valid_o,
      .out_ready_i,
      .out_data_o,
      .out_tag_o
  );
endmodule
