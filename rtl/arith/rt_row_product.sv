// SPDX-License-Identifier: Apache-2.0
// row_product: one row of a unit-triangle transform times a point or a direction.
//
// Formula     sum = row . point + offset; out = floor(sum / 2^26 + 1/2), wrapped to 27 bits (nearest, ties up). The offset is Q3.29 against the 50
//             fraction bits of coefficient times position; directions take offset 0.
// Latency     rt_stage_pkg::RowLatency. II 1, never stalls. DSP blocks 3 * rt_stage_pkg::ProductBlocks.
// Counterpart row_product in hls/include/arithmetic.hpp.
module rt_row_product (
    input  logic                                                           clk_i,
    input  logic                                                           rst_ni,
    input  rt_contract_pkg::coefficient_t                            [2:0] row_i,
    input  logic                          [2:0][rt_contract_pkg::PositionBits-1:0] point_i,
    input  rt_contract_pkg::offset_t                                       offset_i,
    output logic signed                   [rt_contract_pkg::RowPositionBits-1:0] result_o
);
  localparam int unsigned ProductBits = rt_contract_pkg::CoefficientBits + rt_contract_pkg::PositionBits;
  localparam int unsigned RowShift = rt_contract_pkg::CoefficientFrac;
  localparam int unsigned OffsetShift = RowShift + rt_contract_pkg::PositionFrac - rt_contract_pkg::OffsetFrac;
  localparam int unsigned ResultBits = rt_contract_pkg::RowPositionBits;
  localparam int unsigned SumBits = RowShift + ResultBits;  // the result wraps, so bits above it never count
  // Half of the last bit of the result, in units of the offset.
  localparam int unsigned HalfShift = RowShift - 1 - OffsetShift;
  typedef logic signed [rt_contract_pkg::OffsetBits:0] rounded_t;

  logic signed [ProductBits-1:0] product[3];
  rounded_t rounded_q, rounded;
  logic signed [SumBits-1:0] low_q, high_q;
  logic signed [ResultBits-1:0] result_q;

  for (genvar i = 0; i < 3; i++) begin : gen_product
    rt_mul #(
        .ABits(rt_contract_pkg::CoefficientBits),
        .BBits(rt_contract_pkg::PositionBits)
    ) u_mul (
        .clk_i,
        .a_i(row_i[i]),
        .b_i(point_i[i]),
        .p_o(product[i])
    );
  end

  // The rounding constant joins the offset while the products are on their way.
  rt_delay #(
      .Cycles(rt_stage_pkg::ProductLatency - 1),
      .data_t(rounded_t)
  ) u_rounded (
      .clk_i,
      .rst_ni,
      .data_i(rounded_q),
      .data_o(rounded)
  );

  always_ff @(posedge clk_i) begin
    rounded_q <= rounded_t'(offset_i) + (rounded_t'(1) <<< HalfShift);
    low_q     <= SumBits'(product[0]) + SumBits'(product[1]);
    high_q    <= SumBits'(product[2]) + (SumBits'(rounded) <<< OffsetShift);
    result_q  <= ResultBits'((low_q + high_q) >>> RowShift);
  end

  assign result_o = result_q;
endmodule
