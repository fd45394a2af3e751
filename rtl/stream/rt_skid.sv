// SPDX-License-Identifier: Apache-2.0
// Skid buffer (spill register): a stream register that cuts every combinational path.
//
// Cuts        valid, data and ready: each output is a register or a function of registers only.
// Latency     1. Throughput 1 a clock at any stall pattern, and 2 places; or with HalfRate 1 every other clock, and 1 place of half the logic.
// Counterpart Cummings; spill_register of pulp-platform/common_cells.
`include "rt_assert.svh"
module rt_skid #(
    parameter bit HalfRate = 1'b0,
    parameter type data_t = logic
) (
    input  logic  clk_i,
    input  logic  rst_ni,
    input  logic  in_valid_i,
    output logic  in_ready_o,
    input  data_t in_data_i,
    output logic  out_valid_o,
    input  logic  out_ready_i,
    output data_t out_data_o
);
  data_t out_q;
  logic  out_valid_q;
  assign out_valid_o = out_valid_q;
  assign out_data_o  = out_q;

  if (HalfRate) begin : gen_half
    assign in_ready_o = !out_valid_q;
    always_ff @(posedge clk_i) begin
      out_valid_q <= rst_ni && (out_valid_q ? !out_ready_i : in_valid_i);
      if (!out_valid_q) out_q <= in_data_i;
    end
  end else begin : gen_full
    // `spill` takes the one beat that arrives in the clock in which the output stalls.
    data_t spill_q;
    logic  spill_valid_q;
    assign in_ready_o = !spill_valid_q;

    always_ff @(posedge clk_i) begin
      if (out_ready_i || !out_valid_q) begin
        out_valid_q   <= spill_valid_q || in_valid_i;
        out_q         <= spill_valid_q ? spill_q : in_data_i;
        spill_valid_q <= 1'b0;
      end else if (in_valid_i && !spill_valid_q) begin
        spill_valid_q <= 1'b1;
        spill_q       <= in_data_i;
      end
      if (!rst_ni) begin
        out_valid_q   <= 1'b0;
        spill_valid_q <= 1'b0;
      end
    end
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
  `RT_ASSERT_STREAM(OutputHeld, out_valid_o, out_ready_i, out_data_o)
endmodule
