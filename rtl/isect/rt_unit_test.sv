// SPDX-License-Identifier: Apache-2.0
// The unit-triangle test behind the transform: what rt_tri_test and the core of two levels, which shares the transform, do with a ray in a triangle's space.
//
// Formula     signs of o'z and d'z flipped so that d'z > 0
//             U = o'u d'z - o'z d'u,  V = o'v d'z - o'z d'v,  W = (d'z >> eu) - U - (V >> (eu - ev))
//             hit if d'z > 0, o'z <= 0, -EpsUv <= U <= (d'z >> eu) + EpsUv, -EpsUv <= V <= (d'z >> ev) + EpsUv, W >= -EpsW, t < 8;
//             t = floor(-o'z / d'z). Without a hit every field but the id is 0.
// Rows        o' = M o + m and d' = M d of an input come from outside, RowsLatency clocks after it has entered (enter_o), and in every clock.
// Structure   Clock by clock: rows (RowsLatency), flip (TriFlip), products and U, V (TriEdge), V aligned, W, verdict (TriVerdict). The division starts
//             right after the flip, before the verdict is known, so its clocks are not added to those of U, V and W.
// Latency     rt_stage_pkg::TriTestLatency, with RowsLatency for RowLatency. II rt_stage_pkg::TriTestInterval.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/tri_test.hpp, golden/engine/stages/tri_test.hpp. Source: Arenberg 1988; Woop et al. 2005, section 3.2; Schmittler et al. 2004.
`include "rt_assert.svh"
module rt_unit_test #(
    parameter int unsigned RowsLatency = rt_stage_pkg::RowLatency,
    parameter int unsigned Spare = 0,  // places for results beyond the round trip
    parameter type tag_t = logic [15:0]
) (
    input  logic                                  clk_i,
    input  logic                                  rst_ni,
    input  logic                                  in_valid_i,
    output logic                                  in_ready_o,
    input  rt_contract_pkg::tri_test_in_record_t  in_data_i,
    input  tag_t                                  in_tag_i,
    output logic                                  enter_o,
    input  rt_contract_pkg::row_position_t [2:0]  origin_i,     // u, v, z
    input  rt_contract_pkg::row_direction_t [2:0] direction_i,
    output logic                                  out_valid_o,
    input  logic                                  out_ready_i,
    output rt_contract_pkg::tri_test_out_record_t out_data_o,
    output tag_t                                  out_tag_o
);
  // Clocks that rows take longer here than in the stage.
  localparam int unsigned RowsMore = RowsLatency - rt_stage_pkg::RowLatency;
  `RT_ASSERT_INIT(RowsKnown, RowsLatency >= rt_stage_pkg::RowLatency)
  `RT_ASSERT_INIT(DivisionCoversVerdict, rt_stage_pkg::TriTestDepth >= rt_stage_pkg::TriVerdict)

  localparam int unsigned ProductBits = rt_contract_pkg::RowPositionBits + rt_contract_pkg::RowDirectionBits;
  localparam int unsigned EdgeBits = rt_contract_pkg::EdgeBits;
  localparam int unsigned SumBits = rt_contract_pkg::EdgeSumBits;
  localparam int unsigned AlignShift = rt_contract_pkg::PositionFrac + rt_contract_pkg::ExponentBias;
  localparam int unsigned TQuotBits = rt_stage_pkg::TriQuotBits;
  localparam int unsigned DenBits = rt_contract_pkg::RowDirectionBits - 1;  // d'z of a hit is positive
  localparam int unsigned NumBits = rt_contract_pkg::RowPositionBits + rt_contract_pkg::CoefficientFrac;
  typedef logic signed [ProductBits-1:0] product_t;
  typedef struct packed {
    rt_contract_pkg::exponent_t u;
    rt_contract_pkg::exponent_t v;
  } exponents_t;
  typedef struct packed {
    logic hit;
    rt_contract_pkg::edge_t edge_u;
    rt_contract_pkg::edge_t edge_v;
    rt_contract_pkg::row_direction_t dz;
    exponents_t exponents;
  } candidate_t;
  typedef struct packed {
    tag_t tag;
    rt_contract_pkg::triangle_id_t id;
  } pass_t;
  typedef struct packed {
    candidate_t candidate;
    rt_contract_pkg::t_limit_t t;
  } result_t;

  // ------------------------------------------------------------------------------------------------------------------- the flip
  rt_contract_pkg::row_position_t origin_z;
  rt_contract_pkg::row_direction_t direction_z;
  assign origin_z    = origin_i[2];
  assign direction_z = direction_i[2];
  rt_contract_pkg::row_position_t ou_q, ov_q, oz_q, height_q;  // height = -o'z
  rt_contract_pkg::row_direction_t du_q, dv_q, dz_q;
  always_ff @(posedge clk_i) begin
    ou_q     <= origin_i[0];
    ov_q     <= origin_i[1];
    du_q     <= direction_i[0];
    dv_q     <= direction_i[1];
    oz_q     <= direction_z < 0 ? -origin_z : origin_z;
    height_q <= direction_z < 0 ? origin_z : -origin_z;
    dz_q     <= direction_z < 0 ? -direction_z : direction_z;
  end

  // ------------------------------------------------------------------------------------------------------------- edge functions
  product_t ou_dz, oz_du, ov_dz, oz_dv;
  rt_mul u_ou_dz (
      .clk_i,
      .a_i(ou_q),
      .b_i(dz_q),
      .p_o(ou_dz)
  );
  rt_mul u_oz_du (
      .clk_i,
      .a_i(oz_q),
      .b_i(du_q),
      .p_o(oz_du)
  );
  rt_mul u_ov_dz (
      .clk_i,
      .a_i(ov_q),
      .b_i(dz_q),
      .p_o(ov_dz)
  );
  rt_mul u_oz_dv (
      .clk_i,
      .a_i(oz_q),
      .b_i(dv_q),
      .p_o(oz_dv)
  );

  // d'z and the exponents wait for the edge functions; d'z is aligned and gets its tolerance in the two clocks before they are there.
  localparam int unsigned DzWait = rt_stage_pkg::ProductLatency - 1;
  exponents_t exponents_in, exponents_align, exponents_edge, exponents_late;
  rt_contract_pkg::row_direction_t dz_align, dz_late;
  assign exponents_in = '{u: in_data_i.exponent_u, v: in_data_i.exponent_v};
  rt_delay #(
      .Cycles(rt_stage_pkg::TriFlip + RowsMore + DzWait),
      .data_t(exponents_t)
  ) u_exponents_align (
      .clk_i,
      .rst_ni,
      .data_i(exponents_in),
      .data_o(exponents_align)
  );
  rt_delay #(
      .Cycles(2),
      .data_t(exponents_t)
  ) u_exponents_edge (
      .clk_i,
      .rst_ni,
      .data_i(exponents_align),
      .data_o(exponents_edge)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::TriVerdict - rt_stage_pkg::TriEdge - 1),
      .data_t(exponents_t)
  ) u_exponents_late (
      .clk_i,
      .rst_ni,
      .data_i(exponents_edge),
      .data_o(exponents_late)
  );
  rt_delay #(
      .Cycles(DzWait),
      .data_t(rt_contract_pkg::row_direction_t)
  ) u_dz_align (
      .clk_i,
      .rst_ni,
      .data_i(dz_q),
      .data_o(dz_align)
  );
  rt_delay #(
      .Cycles(rt_stage_pkg::TriVerdict - rt_stage_pkg::TriFlip - DzWait - 1),
      .data_t(rt_contract_pkg::row_direction_t)
  ) u_dz_late (
      .clk_i,
      .rst_ni,
      .data_i(dz_align),
      .data_o(dz_late)
  );

  // What does not depend on the edge functions is judged early and waits as one bit.
  logic facing_q, facing;
  always_ff @(posedge clk_i) begin
    facing_q <= dz_q > 0 && oz_q <= 0 && unsigned'(height_q) < {dz_q[DenBits-1:0], 1'b0};
  end
  rt_delay #(
      .Cycles(rt_stage_pkg::TriVerdict - rt_stage_pkg::TriFlip - 2),
      .data_t(logic)
  ) u_facing (
      .clk_i,
      .rst_ni,
      .data_i(facing_q),
      .data_o(facing)
  );

  // Registers by the clock in which they hold their value, counted from TriEdge.
  typedef logic signed [rt_contract_pkg::RowDirectionBits+AlignShift:0] one_t;  // d'z in the fraction bits of U, one bit for the tolerance
  one_t one_u_q, one_v_q;                          // -1: U and V where u and v are 1
  one_t limit_w_q, highest_u_q, highest_v_q;       //  0: with their tolerances
  rt_contract_pkg::edge_t edge_u_q, edge_v_q;      //  0
  logic signed [SumBits-1:0] rest_q;               // +1: limit - U, so that W >= -EpsW is rest >= aligned V
  rt_contract_pkg::edge_t aligned_v_q;             // +1
  logic u_inside_q, v_inside_q;                    // +1
  rt_contract_pkg::edge_t edge_u_1q, edge_v_1q;    // +1
  logic uv_inside_q, w_inside_q;                   // +2
  rt_contract_pkg::edge_t edge_u_2q, edge_v_2q;    // +2
  candidate_t candidate_q;                         // +3 = TriVerdict
  rt_contract_pkg::exponent_t difference;
  one_t one;
  assign one        = one_t'(dz_align) <<< AlignShift;
  assign difference = exponents_edge.u - exponents_edge.v;
  always_ff @(posedge clk_i) begin
    one_u_q <= one >>> exponents_align.u;
    one_v_q <= one >>> exponents_align.v;

    limit_w_q   <= one_u_q + one_t'(rt_contract_pkg::EpsW);
    highest_u_q <= one_u_q + one_t'(rt_contract_pkg::EpsUv);
    highest_v_q <= one_v_q + one_t'(rt_contract_pkg::EpsUv);
    edge_u_q    <= EdgeBits'(ou_dz) - EdgeBits'(oz_du);
    edge_v_q    <= EdgeBits'(ov_dz) - EdgeBits'(oz_dv);

    rest_q      <= SumBits'(limit_w_q) - SumBits'(edge_u_q);
    aligned_v_q <= edge_v_q >>> difference;
    u_inside_q  <= edge_u_q >= -rt_contract_pkg::EpsUv && edge_u_q <= EdgeBits'(highest_u_q);
    v_inside_q  <= edge_v_q >= -rt_contract_pkg::EpsUv && edge_v_q <= EdgeBits'(highest_v_q);
    edge_u_1q   <= edge_u_q;
    edge_v_1q   <= edge_v_q;

    w_inside_q  <= rest_q >= SumBits'(aligned_v_q);
    uv_inside_q <= u_inside_q && v_inside_q;
    edge_u_2q   <= edge_u_1q;
    edge_v_2q   <= edge_v_1q;

    candidate_q <= facing && uv_inside_q && w_inside_q ?
        '{hit: 1'b1, edge_u: edge_u_2q, edge_v: edge_v_2q, dz: dz_late, exponents: exponents_late} : '0;
  end

  // ------------------------------------------------------------------------------------------------------------------ t = -o'z / d'z
  logic [TQuotBits-1:0] quotient;
  logic [DenBits-1:0] remainder_unused;
  logic overflow_unused;  // a hit has -o'z < 2 d'z
  rt_div #(
      .NumBits    (NumBits),
      .DenBits    (DenBits),
      .QuotBits   (TQuotBits),
      .BitsPerStep(rt_stage_pkg::DivBitsPerStep)
  ) u_div (
      .clk_i,
      .num_i     ({height_q, {rt_contract_pkg::CoefficientFrac{1'b0}}}),
      .den_i     (dz_q[DenBits-1:0]),
      .quot_o    (quotient),
      .rem_o     (remainder_unused),
      .overflow_o(overflow_unused)
  );

  candidate_t candidate;
  rt_delay #(
      .Cycles(rt_stage_pkg::TriTestDepth - rt_stage_pkg::TriVerdict),
      .data_t(candidate_t)
  ) u_candidate (
      .clk_i,
      .rst_ni,
      .data_i(candidate_q),
      .data_o(candidate)
  );

  // ---------------------------------------------------------------------------------------------------------------------- the stream
  pass_t pass_in, pass;
  result_t result_in, result;
  assign pass_in   = '{tag: in_tag_i, id: in_data_i.id};
  assign result_in = '{candidate: candidate, t: candidate.hit ? quotient : '0};
  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::TriTestDepth + RowsMore),
      .Interval(rt_stage_pkg::TriTestInterval),
      .Spare   (Spare),
      .tag_t   (pass_t),
      .data_t  (result_t)
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i   (pass_in),
      .enter_o,
      .pipe_data_i(result_in),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o  (pass),
      .out_data_o (result)
  );

  assign out_tag_o = pass.tag;
  always_comb begin
    out_data_o            = '0;
    out_data_o.hit        = result.candidate.hit;
    out_data_o.t          = result.t;
    out_data_o.id         = pass.id;
    out_data_o.edge_u     = result.candidate.edge_u;
    out_data_o.edge_v     = result.candidate.edge_v;
    out_data_o.dz         = result.candidate.dz;
    out_data_o.exponent_u = result.candidate.exponents.u;
    out_data_o.exponent_v = result.candidate.exponents.v;
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
endmodule
