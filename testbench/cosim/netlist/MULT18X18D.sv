// MULT18X18D: 18 x 18 multiplier of an ECP5's DSP slice, as Yosys uses it: all registers bypassed, no cascade, C unused.
//
// Formula     P = A * B, exact, 36 bits; an operand is two's complement if its SIGNED pin is 1, otherwise unsigned.
// Modes       Any other mode is an error: registers and bypass at elaboration, cascade (SOURCEA, SOURCEB) in simulation. Ports that this
//             model lacks (clocks, cascade) cannot be connected.
// Source      Lattice TN1267, ECP5 and ECP5-5G sysDSP Usage Guide, MULT18X18D; parameters and their defaults as in Yosys' cells_bb.v.
module MULT18X18D #(
    parameter REG_INPUTA_CLK = "NONE",
    parameter REG_INPUTB_CLK = "NONE",
    parameter REG_INPUTC_CLK = "NONE",
    parameter REG_PIPELINE_CLK = "NONE",
    parameter REG_OUTPUT_CLK = "NONE",
    parameter MULT_BYPASS = "DISABLED",
    parameter SOURCEB_MODE = "B_SHIFT"
) (
    input A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0,
    input B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0,
    input C17, C16, C15, C14, C13, C12, C11, C10, C9, C8, C7, C6, C5, C4, C3, C2, C1, C0,
    input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB,
    output P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
    output P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0
);
  if (REG_INPUTA_CLK != "NONE" || REG_INPUTB_CLK != "NONE" || REG_INPUTC_CLK != "NONE") begin : gen_no_input_registers
    $error("MULT18X18D: input registers are not modelled");
  end
  if (REG_PIPELINE_CLK != "NONE" || REG_OUTPUT_CLK != "NONE") begin : gen_no_output_registers
    $error("MULT18X18D: pipeline and output registers are not modelled");
  end
  if (MULT_BYPASS != "DISABLED" || SOURCEB_MODE != "B_SHIFT") begin : gen_no_bypass
    $error("MULT18X18D: MULT_BYPASS and other sources of B are not modelled");
  end

  logic signed [18:0] a, b;  // one bit more, so that an unsigned operand is positive
  logic signed [37:0] p;
  assign a = {SIGNEDA & A17, A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0};
  assign b = {SIGNEDB & B17, B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0};
  assign p = a * b;
  assign {P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
          P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0} = p[35:0];

  always_comb begin
    if (SOURCEA || SOURCEB) $error("MULT18X18D: cascaded operands are not modelled");
  end
endmodule
