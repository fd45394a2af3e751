// SPDX-License-Identifier: Apache-2.0
// The PLL of an ECP5 as the tools see it from outside: ports and parameters, no contents.
//
// Purpose     Lint and synthesis find the vendor's cell here; place and route knows what is in it (Lattice FPGA-TN-02200). The name is the vendor's.
(* blackbox *)
module EHXPLLL #(
    parameter int    CLKI_DIV = 1,
    parameter int    CLKFB_DIV = 1,
    parameter int    CLKOP_DIV = 8,
    parameter        CLKOP_ENABLE = "ENABLED",
    parameter int    CLKOP_CPHASE = 0,
    parameter int    CLKOP_FPHASE = 0,
    parameter        FEEDBK_PATH = "CLKOP",
    parameter        OUTDIVIDER_MUXA = "DIVA",
    parameter        OUTDIVIDER_MUXB = "DIVB",
    parameter        OUTDIVIDER_MUXC = "DIVC",
    parameter        OUTDIVIDER_MUXD = "DIVD",
    parameter        STDBY_ENABLE = "DISABLED",
    parameter        DPHASE_SOURCE = "DISABLED",
    parameter        PLLRST_ENA = "DISABLED",
    parameter        INTFB_WAKE = "DISABLED"
) (
    input  logic CLKI,
    input  logic CLKFB,
    input  logic PHASESEL1,
    input  logic PHASESEL0,
    input  logic PHASEDIR,
    input  logic PHASESTEP,
    input  logic PHASELOADREG,
    input  logic STDBY,
    input  logic PLLWAKESYNC,
    input  logic RST,
    input  logic ENCLKOP,
    output logic CLKOP,
    output logic LOCK
);
endmodule
