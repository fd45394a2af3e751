// SPDX-License-Identifier: Apache-2.0
// Round-robin arbiter that chooses a clock ahead, for inputs that are far from each other: NumInputs streams into one.
//
// Rule        Of the inputs that are valid, without the one that is served in this clock, the first after the one chosen last is served in the next
//             clock, if room_i is 1 now. So a single input is served every other clock, and every valid one after at most NumInputs - 1 others.
// Output      A word that is chosen is taken: out_valid_o has no ready. room_i has to count the one word that may be on its way (rt_queue, Ahead = 1).
// Cuts        in_ready_o and out_valid_o are registers; data pass through a choice between registers' words.
// Latency     1. Throughput 1 a clock for two inputs or more.
`include "rt_assert.svh"
module rt_turns #(
    parameter int unsigned NumInputs = 2,
    parameter type data_t = logic
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic  [NumInputs-1:0] in_valid_i,
    output logic  [NumInputs-1:0] in_ready_o,
    input  data_t                 in_data_i  [NumInputs],
    input  logic                  room_i,
    output logic                  out_valid_o,
    output data_t                 out_data_o
);
  `RT_ASSERT_INIT(NumInputsPositive, NumInputs >= 1)

  logic [NumInputs-1:0] grant_q, after_q;  // one-hot or none; the inputs behind the one chosen last
  logic [NumInputs-1:0] waiting, masked, pool, chosen;
  assign waiting = in_valid_i & ~grant_q;
  assign masked  = waiting & after_q;
  assign pool    = masked != '0 ? masked : waiting;
  assign chosen  = room_i ? pool & (~pool + 1'b1) : '0;
  always_ff @(posedge clk_i) begin
    grant_q <= chosen;
    if (chosen != '0) after_q <= ~(chosen | (chosen - 1'b1));
    if (!rst_ni) begin
      grant_q <= '0;
      after_q <= '1;
    end
  end

  assign in_ready_o  = grant_q;
  assign out_valid_o = grant_q != '0;
  always_comb begin
    out_data_o = in_data_i[0];
    for (int unsigned i = 1; i < NumInputs; i++) if (grant_q[i]) out_data_o = in_data_i[i];
  end

`ifndef SYNTHESIS
  for (genvar i = 0; i < int'(NumInputs); i++) begin : gen_check
    data_t data;
    assign data = in_data_i[i];
    `RT_ASSERT_STREAM(InputHeld, in_valid_i[i], in_ready_o[i], data)
  end
`endif
  `RT_ASSERT(OneReady, $onehot0(in_ready_o))
  `RT_ASSERT(ChosenIsValid, (grant_q & ~in_valid_i) == '0)
endmodule
