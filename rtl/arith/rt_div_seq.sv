// SPDX-License-Identifier: Apache-2.0
// Sequential exact division of unsigned integers: one restoring step, used for one division at a time.
//
// Formula     out_quot_o = floor(in_num_i / in_den_i), out_rem_o = in_num_i - out_quot_o * in_den_i.
// Overflow    Where the quotient does not fit QuotBits (in_den_i = 0 included): out_overflow_o = 1, out_quot_o all ones, out_rem_o undefined.
// Tag         in_tag_i comes out with the result it belongs to.
// Latency     rt_lib_pkg::div_steps + 1 clocks from acceptance to valid; II rt_lib_pkg::div_seq_interval(QuotBits, BitsPerStep).
// Cuts        valid, data and ready: in_ready_o and out_valid_o are functions of registers only.
// Counterpart rt_div: the same numbers at II 1.
`include "rt_assert.svh"
module rt_div_seq #(
    parameter int unsigned NumBits = 54,
    parameter int unsigned DenBits = 27,
    parameter int unsigned QuotBits = 28,
    parameter int unsigned BitsPerStep = 1,
    parameter type tag_t = logic
) (
    input  logic                clk_i,
    input  logic                rst_ni,
    input  logic                in_valid_i,
    output logic                in_ready_o,
    input  logic [ NumBits-1:0] in_num_i,
    input  logic [ DenBits-1:0] in_den_i,
    input  tag_t                in_tag_i,
    output logic                out_valid_o,
    input  logic                out_ready_i,
    output logic [QuotBits-1:0] out_quot_o,
    output logic [ DenBits-1:0] out_rem_o,
    output logic                out_overflow_o,
    output tag_t                out_tag_o
);
  `RT_ASSERT_INIT(BitsPerStepKnown, BitsPerStep == 1 || BitsPerStep == 2)
  `RT_ASSERT_INIT(WidthsPositive, NumBits >= 1 && DenBits >= 1 && QuotBits >= 1)

  localparam int unsigned Steps = rt_lib_pkg::div_steps(QuotBits, BitsPerStep);
  localparam int unsigned ShiftBits = Steps * BitsPerStep;  // QuotBits, rounded up to whole steps
  localparam int unsigned WideBits = NumBits + DenBits;  // holds numerator and denominator
  localparam int unsigned CountBits = $clog2(Steps + 1);

  typedef enum logic [1:0] {
    Idle,
    Busy,
    Done
  } state_e;

  state_e state_q;
  logic [CountBits-1:0] left_q;  // steps to do
  logic [DenBits-1:0] den_q, rem_q, rem_d;
  logic [ShiftBits-1:0] shift_q, shift_d;
  logic [WideBits-1:0] top_q;
  logic overflow;
  tag_t tag_q;

  always_comb begin
    logic [DenBits:0] wide, difference;
    rem_d   = rem_q;
    shift_d = shift_q;
    for (int unsigned b = 0; b < BitsPerStep; b++) begin
      wide       = {rem_d, shift_d[ShiftBits-1]};
      difference = wide - {1'b0, den_q};
      rem_d      = difference[DenBits] ? wide[DenBits-1:0] : difference[DenBits-1:0];
      shift_d    = ShiftBits'({shift_d, !difference[DenBits]});
    end
  end

  assign overflow = top_q >= WideBits'(den_q);

  always_ff @(posedge clk_i) begin
    case (state_q)
      Idle: begin
        if (in_valid_i) state_q <= Busy;
        left_q  <= CountBits'(Steps);
        den_q   <= in_den_i;
        rem_q   <= DenBits'(WideBits'(in_num_i) >> ShiftBits);
        shift_q <= ShiftBits'(WideBits'(in_num_i));
        top_q   <= WideBits'(in_num_i) >> QuotBits;
        tag_q   <= in_tag_i;
      end
      Busy: begin
        left_q  <= left_q - 1'b1;
        rem_q   <= rem_d;
        shift_q <= shift_d | {ShiftBits{left_q == CountBits'(1) && overflow}};
        if (left_q == CountBits'(1)) state_q <= Done;
      end
      default: if (out_ready_i) state_q <= Idle;
    endcase
    if (!rst_ni) state_q <= Idle;
  end

  assign in_ready_o     = state_q == Idle;
  assign out_valid_o    = state_q == Done;
  assign out_quot_o     = shift_q[QuotBits-1:0];
  assign out_rem_o      = rem_q;
  assign out_overflow_o = overflow;
  assign out_tag_o      = tag_q;

  `RT_ASSERT_STREAM(NumHeld, in_valid_i, in_ready_o, in_num_i)
  `RT_ASSERT_STREAM(DenHeld, in_valid_i, in_ready_o, in_den_i)
  `RT_ASSERT_STREAM(QuotHeld, out_valid_o, out_ready_i, out_quot_o)
  `RT_ASSERT_STREAM(TagHeld, out_valid_o, out_ready_i, out_tag_o)
endmodule
