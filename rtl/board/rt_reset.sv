// SPDX-License-Identifier: Apache-2.0
// Reset of a board: synchronised, released only after its causes have been quiet for a while.
//
// Rule        rst_no is 0 from the clock after a cause was seen until good_i has been 1 for 2^QuietBits clocks: bounces of a button
//             and a clock that is not steady yet are over by then.
// Inputs      good_i may change at any time (PLL lock, buttons); two registers against metastability.
// Start       Registers start as 0 when the part is configured, so the board begins in reset.
`include "rt_assert.svh"
module rt_reset #(
    parameter int unsigned QuietBits = 16
) (
    input  logic clk_i,
    input  logic good_i,
    output logic rst_no
);
  `RT_ASSERT_INIT(QuietPositive, QuietBits >= 1)

  (* ASYNC_REG = "TRUE" *) logic [1:0] good_q = '0;
  logic [QuietBits:0] quiet_q = '0;

  always_ff @(posedge clk_i) begin
    good_q <= {good_q[0], good_i};
    if (!quiet_q[QuietBits]) quiet_q <= quiet_q + 1'b1;
    if (!good_q[1]) quiet_q <= '0;
  end
  assign rst_no = quiet_q[QuietBits];
endmodule
