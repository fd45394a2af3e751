// SPDX-License-Identifier: Apache-2.0
// First-in first-out buffer behind a register, for what comes from far away or late: a place is kept for what is in the register.
//
// Use         in_valid_i only while in_ready_o; in_ready_o falls early, by the word in the register and Ahead more that are on their way when it falls.
// Cuts        valid, data and ready, as rt_fifo; the input goes into a register and nowhere else.
// Latency     2. Throughput 1 a clock for Depth >= Ahead + 3.
// Capacity    Depth entries.
`include "rt_assert.svh"
module rt_queue #(
    parameter int unsigned Depth = 4,
    parameter int unsigned Ahead = 0,
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
  `RT_ASSERT_INIT(DepthEnough, Depth >= Ahead + 2)

  logic  late_valid_q, room;
  data_t late_q;
  logic [$clog2(Depth+1)-1:0] usage;

  assign in_ready_o = 32'(usage) <= Depth - 2 - Ahead;
  always_ff @(posedge clk_i) begin
    late_valid_q <= in_valid_i && rst_ni;
    late_q       <= in_data_i;
  end

  rt_fifo #(
      .Depth (Depth),
      .data_t(data_t)
  ) u_fifo (
      .clk_i,
      .rst_ni,
      .in_valid_i (late_valid_q),
      .in_ready_o (room),
      .in_data_i  (late_q),
      .out_valid_o,
      .out_ready_i,
      .out_data_o,
      .usage_o    (usage)
  );

  `RT_ASSERT(HasRoom, !late_valid_q || room)
endmodule
