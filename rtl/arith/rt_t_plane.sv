// SPDX-License-Identifier: Apache-2.0
// t_plane: distance along a ray to an axis-aligned plane.
//
// Formula     t = floor((plane - origin) * reciprocal / 2^shift), saturated to TBits, Q4.24 as a rule. plane - origin wraps to Q3.24, as in hls/.
// Latency     rt_stage_pkg::TPlaneLatency. II 1, never stalls. DSP blocks rt_stage_pkg::ProductBlocks.
// Counterpart t_plane in hls/include/arithmetic.hpp.
module rt_t_plane #(
    parameter int unsigned TBits = rt_contract_pkg::TBits
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,
    input  rt_contract_pkg::position_t    plane_i,
    input  rt_contract_pkg::position_t    origin_i,
    input  rt_contract_pkg::reciprocal_t  reciprocal_i,
    input  rt_contract_pkg::recip_shift_t shift_i,
    output logic signed [TBits-1:0]       t_o
);
  localparam int unsigned ProductBits = rt_contract_pkg::PositionBits + rt_contract_pkg::ReciprocalBits;
  localparam int unsigned OverflowBits = ProductBits - TBits + 1;  // sign of t and everything above it

  rt_contract_pkg::position_t distance_q;
  rt_contract_pkg::reciprocal_t reciprocal_q;
  rt_contract_pkg::recip_shift_t shift;
  logic signed [ProductBits-1:0] product, shifted_q;
  logic signed [TBits-1:0] t_q;
  logic fits;

  rt_mul #(
      .ABits(rt_contract_pkg::PositionBits),
      .BBits(rt_contract_pkg::ReciprocalBits)
  ) u_mul (
      .clk_i,
      .a_i(distance_q),
      .b_i(reciprocal_q),
      .p_o(product)
  );

  rt_delay #(
      .Cycles(1 + rt_stage_pkg::ProductLatency),
      .data_t(rt_contract_pkg::recip_shift_t)
  ) u_shift (
      .clk_i,
      .rst_ni,
      .data_i(shift_i),
      .data_o(shift)
  );

  assign fits = shifted_q[ProductBits-1-:OverflowBits] == '0 || shifted_q[ProductBits-1-:OverflowBits] == '1;

  always_ff @(posedge clk_i) begin
    distance_q   <= plane_i - origin_i;
    reciprocal_q <= reciprocal_i;
    shifted_q    <= product >>> shift;
    t_q          <= fits ? shifted_q[TBits-1:0] : {shifted_q[ProductBits-1], {(TBits - 1) {!shifted_q[ProductBits-1]}}};
  end

  assign t_o = t_q;
endmodule
