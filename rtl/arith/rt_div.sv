// SPDX-License-Identifier: Apache-2.0
// Pipelined exact division of unsigned integers: restoring, BitsPerStep quotient bits a stage.
//
// Formula     quot_o = floor(num_i / den_i), rem_o = num_i - quot_o * den_i.
// Overflow    Where the quotient does not fit QuotBits (den_i = 0 included): overflow_o = 1, quot_o all ones, rem_o undefined.
// Latency     rt_lib_pkg::div_latency(QuotBits, BitsPerStep): operand registers, then one clock a stage. II 1, never stalls.
// Timing      One subtraction of DenBits + 1 bits between registers, two of them in a row with BitsPerStep = 2.
// Counterpart rt_div_seq: the same numbers from one shared step.
`include "rt_assert.svh"
module rt_div #(
    parameter int unsigned NumBits = 54,
    parameter int unsigned DenBits = 27,
    parameter int unsigned QuotBits = 28,
    parameter int unsigned BitsPerStep = 1
) (
    input  logic                clk_i,
    input  logic [ NumBits-1:0] num_i,
    input  logic [ DenBits-1:0] den_i,
    output logic [QuotBits-1:0] quot_o,
    output logic [ DenBits-1:0] rem_o,
    output logic                overflow_o
);
  `RT_ASSERT_INIT(BitsPerStepKnown, BitsPerStep == 1 || BitsPerStep == 2)
  `RT_ASSERT_INIT(WidthsPositive, NumBits >= 1 && DenBits >= 1 && QuotBits >= 1)

  localparam int unsigned Steps = rt_lib_pkg::div_steps(QuotBits, BitsPerStep);
  localparam int unsigned ShiftBits = Steps * BitsPerStep;  // QuotBits, rounded up to whole steps
  localparam int unsigned WideBits = NumBits + DenBits;  // holds numerator and denominator

  // Stage i of the pipeline holds what entered i clocks ago. Numerator bits leave `shift` at the top, quotient bits enter at the bottom.
  logic [DenBits-1:0] den_q[Steps+1];
  logic [DenBits-1:0] rem_q[Steps+1];
  logic [DenBits-1:0] rem_d[Steps];
  logic [ShiftBits-1:0] shift_q[Steps+1];
  logic [ShiftBits-1:0] shift_d[Steps];
  logic [WideBits-1:0] top_q;  // the numerator above the quotient; it must be below the denominator
  logic [Steps-1:0] overflow_d, overflow_q;

  assign overflow_d = Steps'({overflow_q, top_q >= WideBits'(den_q[0])});

  for (genvar i = 0; i < int'(Steps); i++) begin : gen_step
    always_comb begin
      logic [DenBits:0] wide, difference;
      rem_d[i]   = rem_q[i];
      shift_d[i] = shift_q[i];
      for (int unsigned b = 0; b < BitsPerStep; b++) begin
        wide       = {rem_d[i], shift_d[i][ShiftBits-1]};
        difference = wide - {1'b0, den_q[i]};
        rem_d[i]   = difference[DenBits] ? wide[DenBits-1:0] : difference[DenBits-1:0];
        shift_d[i] = ShiftBits'({shift_d[i], !difference[DenBits]});
      end
    end
  end

  always_ff @(posedge clk_i) begin
    den_q[0]   <= den_i;
    rem_q[0]   <= DenBits'(WideBits'(num_i) >> ShiftBits);
    shift_q[0] <= ShiftBits'(WideBits'(num_i));
    top_q      <= WideBits'(num_i) >> QuotBits;
    overflow_q <= overflow_d;
    for (int unsigned i = 0; i < Steps; i++) begin
      den_q[i+1]   <= den_q[i];
      rem_q[i+1]   <= rem_d[i];
      shift_q[i+1] <= shift_d[i] | {ShiftBits{i == Steps - 1 && overflow_d[Steps-1]}};
    end
  end

  assign quot_o     = shift_q[Steps][QuotBits-1:0];
  assign rem_o      = rem_q[Steps];
  assign overflow_o = overflow_q[Steps-1];
endmodule
