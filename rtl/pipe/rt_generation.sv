// SPDX-License-Identifier: Apache-2.0
// Generations of contexts: every Period clocks nobody new enters a pipe of contexts until all who were inside have got on.
//
// Purpose     A context that misses, or finds a stage full, tries again among others and may lose to them for as long as new ones come. Those of one
//             generation are finite in number, and while hold_o is 1 the caches keep every line until it was hit (rt_cache, keep_i), so each
//             line that comes lets at least one of them get on: the wait of each is bounded (docs/core.md). It costs a counter; no context has an age.
// Hold        hold_o is a register; it reaches the pipes within Settle clocks, and what they say of themselves counts from then on.
`include "rt_assert.svh"
module rt_generation #(
    parameter int unsigned Pipes = 3,
    parameter int unsigned PeriodBits = 15
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic [Pipes-1:0] empty_i,
    output logic             hold_o
);
  localparam int unsigned Settle = 8;
  logic [PeriodBits-1:0] clock_q;
  logic [Settle-1:0]     held_q;
  logic                  hold_q;
  always_ff @(posedge clk_i) begin
    clock_q <= hold_q ? '0 : clock_q + 1'b1;
    held_q  <= Settle'({held_q, hold_q});
    if (clock_q == '1) hold_q <= 1'b1;
    else if (held_q[Settle-1] && empty_i == '1) hold_q <= 1'b0;
    if (!rst_ni) begin
      clock_q <= '0;
      held_q  <= '0;
      hold_q  <= 1'b0;
    end
  end
  assign hold_o = hold_q;
endmodule
