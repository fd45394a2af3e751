// SPDX-License-Identifier: Apache-2.0
// Models of the ECP5 cells in a netlist, as Yosys ships them (LUT4, PFUMX, L6MUX21, CCU2C, TRELLIS_FF, TRELLIS_DPR16X4). Yosys has no
// models of MULT18X18D and DP16KD; those are in this folder. Needs the folder of common_sim.vh in the include path and NO_INCLUDES defined.
`include "common_sim.vh"
`include "ccu2c_sim.vh"
