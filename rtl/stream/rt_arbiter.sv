// SPDX-License-Identifier: Apache-2.0
// Round-robin arbiter: merges NumInputs streams into one, with lock.
//
// Rule        The first valid input after the one served last wins. A choice that was offered stays until it is accepted (lock), and with
//             in_last_i = 0 until the beat with in_last_i = 1 of the same input was accepted (bursts stay together; tie to '1 for single beats).
//             Every valid input is served after at most NumInputs - 1 others.
// Cuts        Nothing: valid, data and ready pass combinationally. Put an rt_skid behind it where a chain would form.
// Latency     0. Throughput 1 a clock.
`include "rt_assert.svh"
module rt_arbiter #(
    parameter int unsigned NumInputs = 2,
    parameter type data_t = logic,
    localparam int unsigned IndexBits = NumInputs > 1 ? $clog2(NumInputs) : 1
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic  [NumInputs-1:0] in_valid_i,
    output logic  [NumInputs-1:0] in_ready_o,
    input  data_t                 in_data_i  [NumInputs],
    input  logic  [NumInputs-1:0] in_last_i,
    output logic                  out_valid_o,
    input  logic                  out_ready_i,
    output data_t                 out_data_o,
    output logic  [IndexBits-1:0] out_index_o
);
  `RT_ASSERT_INIT(NumInputsPositive, NumInputs >= 1)

  logic [NumInputs-1:0] after_q;  // inputs behind the one served last
  logic [NumInputs-1:0] masked, pool;
  logic [IndexBits-1:0] first, index, index_q;
  logic locked_q;

  assign masked = in_valid_i & after_q;
  assign pool   = masked != '0 ? masked : in_valid_i;

  always_comb begin
    first = '0;
    for (int i = int'(NumInputs) - 1; i >= 0; i--) begin
      if (pool[i]) first = IndexBits'(i);
    end
  end

  assign index       = locked_q ? index_q : first;
  assign out_index_o = index;
  assign out_valid_o = in_valid_i[index];
  assign out_data_o  = in_data_i[index];

  always_comb begin
    in_ready_o        = '0;
    in_ready_o[index] = out_ready_i && out_valid_o;
  end

  always_ff @(posedge clk_i) begin
    if (out_valid_o) begin
      index_q  <= index;
      locked_q <= !(out_ready_i && in_last_i[index]);
      if (out_ready_i && in_last_i[index]) begin
        for (int i = 0; i < int'(NumInputs); i++) after_q[i] <= i > int'(index);
      end
    end
    if (!rst_ni) begin
      locked_q <= 1'b0;
      index_q  <= '0;
      after_q  <= '1;
    end
  end

`ifndef SYNTHESIS
  for (genvar i = 0; i < int'(NumInputs); i++) begin : gen_check
    data_t data;
    assign data = in_data_i[i];
    `RT_ASSERT_STREAM(InputHeld, in_valid_i[i], in_ready_o[i], data)
  end
`endif
  `RT_ASSERT_STREAM(OutputHeld, out_valid_o, out_ready_i, out_data_o)
  `RT_ASSERT_STREAM(IndexHeld, out_valid_o, out_ready_i, out_index_o)
  `RT_ASSERT(OneReady, $onehot0(in_ready_o))
endmodule
