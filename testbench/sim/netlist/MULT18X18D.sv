// SPDX-License-Identifier: Apache-2.0
// MULT18X18D: 18 x 18 multiplier of an ECP5's DSP slice, as scripts/synthesis.py uses it: registers of A and B together, of P, all or none; no
// pipeline register, no cascade, C unused.
//
// Formula     P = A * B, exact, 36 bits; an operand is two's complement if its SIGNED pin is 1, otherwise unsigned.
// Registers   A and B with REG_INPUTA_CLK and REG_INPUTB_CLK, P with REG_OUTPUT_CLK: CLK0, rising edge, loaded in every clock.
// Modes       Any other mode is an error: registers and bypass at elaboration, cascade (SOURCEA, SOURCEB), enables and resets in simulation.
//             Ports that this model lacks (other clocks, cascade) cannot be connected.
// Source      Lattice TN1267, ECP5 and ECP5-5G sysDSP Usage Guide, MULT18X18D; parameters and their defaults as in Yosys' cells_bb.v.
module MULT18X18D #(
    parameter REG_INPUTA_CLK = "NONE",
    parameter REG_INPUTA_CE = "CE0",
    parameter REG_INPUTA_RST = "RST0",
    parameter REG_INPUTB_CLK = "NONE",
    parameter REG_INPUTB_CE = "CE0",
    parameter REG_INPUTB_RST = "RST0",
    parameter REG_INPUTC_CLK = "NONE",
    parameter REG_PIPELINE_CLK = "NONE",
    parameter REG_OUTPUT_CLK = "NONE",
    parameter REG_OUTPUT_CE = "CE0",
    parameter REG_OUTPUT_RST = "RST0",
    parameter GSR = "ENABLED",
    parameter MULT_BYPASS = "DISABLED",
    parameter SOURCEB_MODE = "B_SHIFT"
) (
    input A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0,
    input B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0,
    input C17, C16, C15, C14, C13, C12, C11, C10, C9, C8, C7, C6, C5, C4, C3, C2, C1, C0,
    input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB, CLK0, CE0, RST0,
    output P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
    output P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0
);
  localparam bit RegisterInputs = REG_INPUTA_CLK == "CLK0";
  localparam bit RegisterOutput = REG_OUTPUT_CLK == "CLK0";
  if (REG_INPUTA_CLK != REG_INPUTB_CLK || (REG_INPUTA_CLK != "NONE" && !RegisterInputs) || REG_INPUTC_CLK != "NONE") begin : gen_no_input_registers
    $error("MULT18X18D: input registers are modelled for A and B together, on CLK0");
  end
  if (REG_PIPELINE_CLK != "NONE" || (REG_OUTPUT_CLK != "NONE" && !RegisterOutput)) begin : gen_no_output_registers
    $error("MULT18X18D: pipeline registers, and output registers on another clock than CLK0, are not modelled");
  end
  if (REG_INPUTA_CE != "CE0" || REG_INPUTB_CE != "CE0" || REG_OUTPUT_CE != "CE0" || REG_INPUTA_RST != "RST0" || REG_INPUTB_RST != "RST0" ||
      REG_OUTPUT_RST != "RST0") begin : gen_no_controls
    $error("MULT18X18D: enables and resets other than CE0 and RST0 are not modelled");
  end
  if (MULT_BYPASS != "DISABLED" || SOURCEB_MODE != "B_SHIFT") begin : gen_no_bypass
    $error("MULT18X18D: MULT_BYPASS and other sources of B are not modelled");
  end

  logic signed [18:0] a, b;  // one bit more, so that an unsigned operand is positive
  logic signed [18:0] a_q, b_q;
  logic signed [37:0] p;
  logic [35:0] p_q;
  assign a = {SIGNEDA & A17, A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0};
  assign b = {SIGNEDB & B17, B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0};
  always_ff @(posedge CLK0) begin
    a_q <= a;
    b_q <= b;
    p_q <= p[35:0];
    if ((RegisterInputs || RegisterOutput) && (!CE0 || RST0)) $error("MULT18X18D: disabled and reset registers are not modelled");
  end
  assign p = RegisterInputs ? a_q * b_q : a * b;
  assign {P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
          P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0} = RegisterOutput ? p_q : p[35:0];

  always_comb begin
    if (SOURCEA || SOURCEB) $error("MULT18X18D: cascaded operands are not modelled");
  end
endmodule
