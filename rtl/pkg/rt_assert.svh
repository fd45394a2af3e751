// SPDX-License-Identifier: Apache-2.0
// Assertion macros of the core.
//
// Purpose     One spelling for interface rules and parameter checks. They use clk_i and rst_ni of the module they stand in.
// Simulation  Verilator runs them with --assert; a failure prints module path and name and ends the simulation with an error.
// Synthesis   Empty when SYNTHESIS is defined, except RT_ASSERT_INIT: a wrong parameter is an error in every tool.
`ifndef RT_ASSERT_SVH
`define RT_ASSERT_SVH

// Parameter check at elaboration: Cond must be constant.
`define RT_ASSERT_INIT(Name, Cond) \
  if (!(Cond)) begin : gen_``Name``_failed \
    $fatal(1, `"parameter check Name failed: Cond`"); \
  end

`ifdef SYNTHESIS
`define RT_ASSERT(Name, Prop)
`define RT_ASSERT_STREAM(Name, Valid, Ready, Data)
`else
// Prop holds at every clock edge out of reset.
`define RT_ASSERT(Name, Prop) \
  Name : assert property (@(posedge clk_i) disable iff (!rst_ni) (Prop)) \
    else $error(`"assertion Name failed`");

// A stream: valid stays until it is accepted, and the data with it. The antecedent names rst_ni because the clock before may have been in reset.
`define RT_ASSERT_STREAM(Name, Valid, Ready, Data) \
  Name``_valid_held : assert property (@(posedge clk_i) disable iff (!rst_ni) \
      ((rst_ni && (Valid) && !(Ready)) |=> (Valid))) \
    else $error(`"assertion Name: valid dropped before it was accepted`"); \
  Name``_data_stable : assert property (@(posedge clk_i) disable iff (!rst_ni) \
      ((rst_ni && (Valid) && !(Ready)) |=> $stable(Data))) \
    else $error(`"assertion Name: data changed before they were accepted`");
`endif

`endif
