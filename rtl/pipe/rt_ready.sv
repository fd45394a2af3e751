// SPDX-License-Identifier: Apache-2.0
// Contexts that can go on, in the order in which they became ready.
//
// Inputs      Pushes: at most one context a clock each, always taken, with a queue for each. Wakes: streams, such as those of a cache. They take turns.
// Hold        While hold_i is 1 the first push queue stands still, but for a context that it has offered already. While go_i is 0 nobody leaves.
// Output      One context a clock, from registers, with the word that what it waited for could not be read.
// Latency     2 from a push, 1 from a wake. Throughput 1 a clock.
// Capacity    A context is in one place at a time, so its queue has room.
`include "rt_assert.svh"
module rt_ready #(
    parameter int unsigned Contexts = 32,
    parameter int unsigned Pushes = 2,
    parameter int unsigned Wakes = 1,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                              clk_i,
    input  logic                              rst_ni,
    input  logic                              hold_i,
    input  logic                              go_i,
    output logic                              entered_o,  // a context of the first push queue leaves it
    input  logic [Pushes-1:0]                 push_valid_i,
    input  logic [Pushes-1:0][ContextBits-1:0] push_context_i,
    input  logic [Pushes-1:0]                 push_error_i,
    input  logic [Wakes-1:0]                  wake_valid_i,
    output logic [Wakes-1:0]                  wake_ready_o,
    input  logic [Wakes-1:0][ContextBits-1:0] wake_context_i,
    input  logic [Wakes-1:0]                  wake_error_i,
    output logic                              valid_o,
    output logic [ContextBits-1:0]            context_o,
    output logic                              error_o,
    output logic                              idle_o    // no context waits or leaves
);
  localparam int unsigned Sources = Pushes + Wakes;
  localparam int unsigned SourceBits = Sources > 1 ? $clog2(Sources) : 1;
  typedef struct packed {
    logic                   error;
    logic [ContextBits-1:0] ctx;
  } ready_t;
  logic [Sources-1:0]    source_valid, source_ready;
  ready_t                source[Sources], chosen, chosen_q;
  logic                  chosen_valid, valid_q, offered_q;
  logic [Pushes-1:0]     queue_valid, queue_ready;
  logic [SourceBits-1:0] chosen_index_unused;

  for (genvar i = 0; i < int'(Pushes); i++) begin : gen_push
    logic                        room;
    logic [$clog2(Contexts+1)-1:0] usage_unused;
    rt_fifo #(
        .Depth (Contexts),
        .data_t(ready_t)
    ) u_queue (
        .clk_i,
        .rst_ni,
        .in_valid_i (push_valid_i[i]),
        .in_ready_o (room),
        .in_data_i  ('{error: push_error_i[i], ctx: push_context_i[i]}),
        .out_valid_o(queue_valid[i]),
        .out_ready_i(queue_ready[i]),
        .out_data_o (source[i]),
        .usage_o    (usage_unused)
    );
    `RT_ASSERT(QueueHasRoom, !push_valid_i[i] || room)
  end
  always_comb begin
    source_valid    = {wake_valid_i, queue_valid};
    source_valid[0] = queue_valid[0] && (!hold_i || offered_q);
  end
  assign queue_ready = source_ready[Pushes-1:0];
  assign entered_o   = queue_ready[0];
  for (genvar i = 0; i < int'(Wakes); i++) begin : gen_wake
    assign wake_ready_o[i]        = source_ready[Pushes+i];
    assign source[Pushes+i]       = '{error: wake_error_i[i], ctx: wake_context_i[i]};
  end

  rt_arbiter #(
      .NumInputs(Sources),
      .data_t   (ready_t)
  ) u_arbiter (
      .clk_i,
      .rst_ni,
      .in_valid_i (source_valid),
      .in_ready_o (source_ready),
      .in_data_i  (source),
      .in_last_i  ('1),
      .out_valid_o(chosen_valid),
      .out_ready_i(go_i),
      .out_data_o (chosen),
      .out_index_o(chosen_index_unused)
  );
  always_ff @(posedge clk_i) begin
    valid_q   <= chosen_valid && go_i && rst_ni;
    chosen_q  <= chosen;
    offered_q <= source_valid[0] && !source_ready[0] && rst_ni;
  end
  assign valid_o   = valid_q;
  assign context_o = chosen_q.ctx;
  assign error_o   = chosen_q.error;
  assign idle_o    = queue_valid == '0 && wake_valid_i == '0 && !valid_q;
endmodule
