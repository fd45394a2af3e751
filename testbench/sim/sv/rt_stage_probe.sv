// SPDX-License-Identifier: Apache-2.0
// Tells C++ what a stage takes and what it gives (testbench/sim/core/stage_watch.hpp). Bound into every stage of the models of the core
// (rt_stage_probe_bind.sv); silent unless C++ was watching at the last reset, so that other runs pay for one flag.
module rt_stage_probe #(
    parameter int unsigned Stage   = 0,
    parameter int unsigned InBits  = 1,
    parameter int unsigned OutBits = 1
) (
    input logic               clk_i,
    input logic               rst_ni,
    input logic               in_valid_i,
    input logic               in_ready_o,
    input logic [InBits-1:0]  in_data_i,
    input logic               out_valid_o,
    input logic               out_ready_i,
    input logic [OutBits-1:0] out_data_o
);
  localparam int unsigned Bits = 1024;  // the widest record of a stage
  if (InBits > Bits || OutBits > Bits) $fatal(0, "rt_stage_probe: a record is wider than %0d bits", Bits);

  import "DPI-C" function bit retrace_watches_stages();
  import "DPI-C" function void retrace_stage_takes(input int stage, input bit [Bits-1:0] data);
  import "DPI-C" function void retrace_stage_gives(input int stage, input bit [Bits-1:0] data);

  logic watched_q;
  always @(posedge clk_i) begin
    if (!rst_ni) watched_q <= retrace_watches_stages();
    else if (watched_q) begin
      if (out_valid_o && out_ready_i) retrace_stage_gives(Stage, Bits'(out_data_o));
      if (in_valid_i && in_ready_o) retrace_stage_takes(Stage, Bits'(in_data_i));
    end
  end
endmodule
