// SPDX-License-Identifier: Apache-2.0
// Pipelined signed multiplier of registered partial products, each of which fits one 18 x 18 DSP block.
//
// Formula     p_o = a_i * b_i, signed, exact, ABits + BBits bits.
// Structure   An operand of more than 18 bits is split into its low 17 bits (unsigned) and the rest (signed). Operand registers, one
//             product register a piece, then the adders, one level a clock, so each block has registers on both sides:
//               a1 b1 2^34 + a0 b0  (adjacent bit fields: no adder)  +  (a1 b0 + a0 b1) 2^17
// Latency     rt_lib_pkg::mul_latency(ABits, BBits): 2 for one block, 3 for two, 4 for four. II 1, never stalls.
// DSP blocks  rt_lib_pkg::mul_blocks(ABits, BBits).
`include "rt_assert.svh"
module rt_mul #(
    parameter int unsigned ABits = 27,
    parameter int unsigned BBits = 27
) (
    input  logic                            clk_i,
    input  logic signed [ABits-1:0]         a_i,
    input  logic signed [BBits-1:0]         b_i,
    output logic signed [(ABits+BBits)-1:0] p_o
);
  `RT_ASSERT_INIT(OperandsFit, ABits >= 2 && BBits >= 2 && ABits <= rt_lib_pkg::MulMaxBits && BBits <= rt_lib_pkg::MulMaxBits)

  localparam int unsigned PieceBits = rt_lib_pkg::PieceBits;
  localparam int unsigned ProductBits = ABits + BBits;
  localparam bit SplitA = rt_lib_pkg::mul_pieces(ABits) == 2;
  localparam bit SplitB = rt_lib_pkg::mul_pieces(BBits) == 2;

  if (SplitA && SplitB) begin : gen_four
    localparam int unsigned AHighBits = ABits - PieceBits;
    localparam int unsigned BHighBits = BBits - PieceBits;
    logic signed [PieceBits:0] a_low_q, b_low_q;  // sign bit 0
    logic signed [AHighBits-1:0] a_high_q;
    logic signed [BHighBits-1:0] b_high_q;
    logic [2*PieceBits-1:0] low_q;  // the sign bits of its operands are 0
    logic signed [AHighBits+PieceBits:0] high_low_q;
    logic signed [BHighBits+PieceBits:0] low_high_q;
    logic signed [AHighBits+BHighBits-1:0] high_q;
    localparam int unsigned MiddleBits = (AHighBits > BHighBits ? AHighBits : BHighBits) + PieceBits + 2;
    logic signed [MiddleBits-1:0] middle_q;
    logic signed [ProductBits-1:0] outer_q, p_q;
    always_ff @(posedge clk_i) begin
      a_low_q    <= signed'({1'b0, a_i[PieceBits-1:0]});
      b_low_q    <= signed'({1'b0, b_i[PieceBits-1:0]});
      a_high_q   <= a_i[ABits-1:PieceBits];
      b_high_q   <= b_i[BBits-1:PieceBits];
      low_q      <= a_low_q * b_low_q;
      high_low_q <= a_high_q * b_low_q;
      low_high_q <= a_low_q * b_high_q;
      high_q     <= a_high_q * b_high_q;
      middle_q   <= MiddleBits'(high_low_q) + MiddleBits'(low_high_q);
      outer_q    <= {high_q, low_q};
      p_q        <= outer_q + signed'({ProductBits'(middle_q) << PieceBits});
    end
    assign p_o = p_q;
  end else if (SplitA || SplitB) begin : gen_two
    // The long operand is split, whichever port it came by.
    localparam int unsigned LongBits = SplitA ? ABits : BBits;
    localparam int unsigned ShortBits = SplitA ? BBits : ABits;
    localparam int unsigned HighBits = LongBits - PieceBits;
    logic signed [LongBits-1:0] long;
    logic signed [ShortBits-1:0] short, short_q;
    logic signed [PieceBits:0] low_q;  // sign bit 0
    logic signed [HighBits-1:0] high_q;
    logic signed [ShortBits+PieceBits:0] low_product_q;
    logic signed [ShortBits+HighBits-1:0] high_product_q;
    logic signed [ProductBits-1:0] p_q;
    if (SplitA) begin : gen_long_a
      assign long  = a_i;
      assign short = b_i;
    end else begin : gen_long_b
      assign long  = b_i;
      assign short = a_i;
    end
    always_ff @(posedge clk_i) begin
      low_q          <= signed'({1'b0, long[PieceBits-1:0]});
      high_q         <= long[LongBits-1:PieceBits];
      short_q        <= short;
      low_product_q  <= low_q * short_q;
      high_product_q <= high_q * short_q;
      p_q            <= (ProductBits'(high_product_q) <<< PieceBits) + ProductBits'(low_product_q);
    end
    assign p_o = p_q;
  end else begin : gen_one
    logic signed [ABits-1:0] a_q;
    logic signed [BBits-1:0] b_q;
    logic signed [ProductBits-1:0] p_q;
    always_ff @(posedge clk_i) begin
      a_q <= a_i;
      b_q <= b_i;
      p_q <= a_q * b_q;
    end
    assign p_o = p_q;
  end
endmodule
