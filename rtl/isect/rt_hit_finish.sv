// SPDX-License-Identifier: Apache-2.0
// hit_finish: barycentric coordinates of the best hit, once a ray.
//
// Formula     u = U 2^(eu - bias) / d'z, rounded toward zero and saturated to [0, 1]; v likewise. Anything but StatusHit gives an empty record
//             with its status.
// Range       With StatusHit, dz >= 0 (0 saturates).
// Structure   One datapath for u and v, one a clock: capture, room, shift, divide, saturate. The quotient has 24 bits; when it does not fit,
//             the result is 1.
// Latency     rt_stage_pkg::HitFinishLatency, II rt_stage_pkg::HitFinishInterval (u and v share one divider), no DSP block.
// Cuts        valid, data and ready (rt_pipe_ctrl).
// Counterpart hls/stages/hit_finish.hpp, golden/engine/stages/hit_finish.hpp. Source: Woop et al. 2005, section 3.2.
`include "rt_assert.svh"
module rt_hit_finish #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   in_valid_i,
    output logic                                   in_ready_o,
    input  rt_contract_pkg::hit_finish_in_record_t in_data_i,
    input  tag_t                                   in_tag_i,
    output logic                                   out_valid_o,
    input  logic                                   out_ready_i,
    output rt_contract_pkg::hit_record_t           out_data_o,
    output tag_t                                   out_tag_o
);
  localparam int unsigned QuotBits = rt_stage_pkg::HitQuotBits;
  localparam int unsigned DenBits = rt_contract_pkg::RowDirectionBits + rt_contract_pkg::ExponentBias;
  localparam int unsigned NumBits = DenBits + QuotBits;  // a numerator beyond them has a quotient of 1 or more
  typedef logic [NumBits-1:0] numerator_t;
  typedef logic [DenBits-1:0] denominator_t;
  typedef struct packed {
    logic positive;
    logic over;
  } verdict_t;
  typedef struct packed {
    tag_t tag;
    rt_contract_pkg::status_t status;
    rt_contract_pkg::t_limit_t t;
    rt_contract_pkg::triangle_id_t id;
  } pass_t;

  logic enter, is_hit;
  assign is_hit = in_data_i.status == rt_contract_pkg::status_t'(rt_contract_pkg::StatusHit);

  // ------------------------------------------------------------------------------------------------------------- u, a clock later v
  rt_contract_pkg::edge_t [1:0] edge_q;
  rt_contract_pkg::exponent_t [1:0] exponent_q;
  rt_contract_pkg::row_direction_t dz_q, dz_2q, dz_3q;
  logic is_hit_q;
  always_ff @(posedge clk_i) begin
    if (enter) begin
      edge_q     <= {in_data_i.edge_v, in_data_i.edge_u};
      exponent_q <= {in_data_i.exponent_v, in_data_i.exponent_u};
      dz_q       <= in_data_i.dz;
      is_hit_q   <= is_hit;
    end else begin
      edge_q[0]     <= edge_q[1];
      exponent_q[0] <= exponent_q[1];
    end
  end

  // numerator = edge << exponent; what is shifted beyond NumBits shows in `lost`, the edge shifted right by the room that is left.
  rt_contract_pkg::edge_t edge_2q, lost_q;
  rt_contract_pkg::exponent_t exponent_2q, room_2q;
  numerator_t numerator_q;
  verdict_t verdict_2q, verdict_3q, verdict_4q, verdict;
  always_ff @(posedge clk_i) begin
    edge_2q     <= edge_q[0];
    exponent_2q <= exponent_q[0];
    room_2q     <= rt_contract_pkg::exponent_t'(NumBits) - exponent_q[0];
    dz_2q       <= dz_q;
    verdict_2q  <= '{positive: is_hit_q && edge_q[0] > 0, over: 32'(exponent_q[0]) >= NumBits};

    numerator_q <= numerator_t'(edge_2q) << exponent_2q;
    lost_q      <= edge_2q >>> room_2q;
    dz_3q       <= dz_2q;
    verdict_3q  <= verdict_2q;

    verdict_4q      <= verdict_3q;
    verdict_4q.over <= verdict_3q.over || lost_q != '0;
  end

  logic [QuotBits-1:0] quotient;
  denominator_t remainder_unused;
  logic overflow;
  rt_div #(
      .NumBits    (NumBits),
      .DenBits    (DenBits),
      .QuotBits   (QuotBits),
      .BitsPerStep(rt_stage_pkg::DivBitsPerStep)
  ) u_div (
      .clk_i,
      .num_i     (numerator_q),
      .den_i     (denominator_t'(dz_3q) << rt_contract_pkg::ExponentBias),
      .quot_o    (quotient),
      .rem_o     (remainder_unused),
      .overflow_o(overflow)
  );

  rt_delay #(
      .Cycles(rt_stage_pkg::HitDivLatency - 1),
      .data_t(verdict_t)
  ) u_verdict (
      .clk_i,
      .rst_ni,
      .data_i(verdict_4q),
      .data_o(verdict)
  );

  // u is a clock older than v.
  rt_contract_pkg::barycentric_t [1:0] uv_q, uv;
  rt_contract_pkg::barycentric_t value;
  always_comb begin
    value = {1'b0, quotient};
    if (verdict.over || overflow) value = {1'b1, {QuotBits{1'b0}}};
    if (!verdict.positive) value = '0;
  end
  always_ff @(posedge clk_i) uv_q <= {value, uv_q[1]};

  // ---------------------------------------------------------------------------------------------------------------------- the stream
  pass_t pass_in, pass;
  assign pass_in = '{
          tag: in_tag_i,
          status: in_data_i.status,
          t: is_hit ? in_data_i.t : '0,
          id: is_hit ? in_data_i.id : rt_contract_pkg::NoTriangle
      };
  rt_pipe_ctrl #(
      .Latency (rt_stage_pkg::HitFinishDepth),
      .Interval(rt_stage_pkg::HitFinishInterval),
      .tag_t   (pass_t),
      .data_t  (rt_contract_pkg::barycentric_t [1:0])
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i   (pass_in),
      .enter_o    (enter),
      .pipe_data_i(uv_q),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o  (pass),
      .out_data_o (uv)
  );

  assign out_tag_o = pass.tag;
  always_comb begin
    out_data_o        = '0;
    out_data_o.t      = pass.t;
    out_data_o.status = pass.status;
    out_data_o.id     = pass.id;
    out_data_o.u      = uv[0];
    out_data_o.v      = uv[1];
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
  `RT_ASSERT(DzInRange, !in_valid_i || !is_hit || in_data_i.dz >= 0)
endmodule
