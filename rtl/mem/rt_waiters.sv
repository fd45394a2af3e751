// SPDX-License-Identifier: Apache-2.0
// Who waits at one port of a cache: for a line, to try again at once, or to try again when a miss register is free.
//
// Line        A list for each miss register (MSHR): first and last waiter of each, and who comes after a waiter, in small RAMs. line_* appends to the
//             list of an MSHR, not after it has ended. When it has, its list is walked, a waiter a clock; until that begins waiting_o keeps the MSHR
//             from being taken.
// Again       again_*: a queue. Later: later_*: a queue, whose head is woken with retry_i.
// Wake        wake_*: a stream of waiters, each with the word that its line could not be read. The three sources take turns.
// Capacity    A waiter is in one place at a time, so whoever is named is always taken.
// Source      Kroft 1981 (miss registers); lists through the waiters as in Scheurich & Dubois 1988.
`include "rt_assert.svh"
module rt_waiters #(
    parameter int unsigned Mshrs = 4,
    parameter int unsigned Waiters = 32,
    localparam int unsigned MshrBits = $clog2(Mshrs),
    localparam int unsigned WaiterBits = Waiters > 1 ? $clog2(Waiters) : 1
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  line_valid_i,
    input  logic [MshrBits-1:0]   line_mshr_i,
    input  logic [WaiterBits-1:0] line_waiter_i,
    input  logic                  again_valid_i,
    input  logic [WaiterBits-1:0] again_waiter_i,
    input  logic                  later_valid_i,
    input  logic [WaiterBits-1:0] later_waiter_i,
    output logic                  later_o,    // somebody waits for a free MSHR
    input  logic                  retry_i,
    output logic                  retried_o,
    input  logic [Mshrs-1:0]      ended_i,    // no line is being fetched
    input  logic [Mshrs-1:0]      error_i,    // the line that was fetched could not be read
    output logic [Mshrs-1:0]      waiting_o,
    output logic                  wake_valid_o,
    input  logic                  wake_ready_i,
    output logic [WaiterBits-1:0] wake_waiter_o,
    output logic                  wake_error_o
);
  typedef logic [MshrBits-1:0] mshr_t;
  typedef logic [WaiterBits-1:0] waiter_t;
  typedef struct packed {
    logic    error;
    waiter_t waiter;
  } wake_t;
  localparam int unsigned FromLine = 0;
  localparam int unsigned FromAgain = 1;
  localparam int unsigned FromLater = 2;
  localparam int unsigned Sources = 3;
  logic [Sources-1:0] source_valid, source_ready;
  wake_t              source[Sources];

  // --- lists ---
  logic [Mshrs-1:0] has_q;
  waiter_t          walk_first, walk_last, line_last, walk_next_waiter;
  logic             walk_q, walk_begins, walk_error_q;  // a list is being walked
  mshr_t            walk_next;
  waiter_t          walk_waiter_q, walk_last_q;
  logic [Mshrs-1:0] to_walk;

  assign to_walk     = has_q & ended_i;
  assign walk_begins = !walk_q && to_walk != '0;
  always_comb begin
    walk_next = '0;
    for (int unsigned m = 0; m < Mshrs; m++) if (to_walk[m]) walk_next = mshr_t'(m);
    waiting_o = has_q;
  end
  assign source_valid[FromLine] = walk_q;
  assign source[FromLine]       = '{error: walk_error_q, waiter: walk_waiter_q};
  always_ff @(posedge clk_i) begin
    if (line_valid_i) has_q[line_mshr_i] <= 1'b1;
    if (walk_begins) begin
      walk_q           <= 1'b1;
      walk_error_q     <= error_i[walk_next];
      walk_waiter_q    <= walk_first;
      walk_last_q      <= walk_last;
      has_q[walk_next] <= 1'b0;
    end else if (walk_q && source_ready[FromLine]) begin
      walk_q        <= walk_waiter_q != walk_last_q;
      walk_waiter_q <= walk_next_waiter;
    end
    if (!rst_ni) begin
      has_q  <= '0;
      walk_q <= 1'b0;
    end
  end

  rt_ram_lut #(
      .Depth (Mshrs),
      .data_t(waiter_t)
  ) u_first (
      .clk_i,
      .rst_ni,
      .write_en_i  (line_valid_i && !has_q[line_mshr_i]),
      .write_addr_i(line_mshr_i),
      .write_data_i(line_waiter_i),
      .read_addr_i (walk_next),
      .read_data_o (walk_first)
  );
  rt_ram_lut #(
      .Depth (Mshrs),
      .data_t(waiter_t)
  ) u_last (
      .clk_i,
      .rst_ni,
      .write_en_i  (line_valid_i),
      .write_addr_i(line_mshr_i),
      .write_data_i(line_waiter_i),
      .read_addr_i (walk_next),
      .read_data_o (walk_last)
  );
  rt_ram_lut #(
      .Depth (Mshrs),
      .data_t(waiter_t)
  ) u_line_last (
      .clk_i,
      .rst_ni,
      .write_en_i  (line_valid_i),
      .write_addr_i(line_mshr_i),
      .write_data_i(line_waiter_i),
      .read_addr_i (line_mshr_i),
      .read_data_o (line_last)
  );
  rt_ram_lut #(
      .Depth (Waiters),
      .data_t(waiter_t)
  ) u_next (
      .clk_i,
      .rst_ni,
      .write_en_i  (line_valid_i && has_q[line_mshr_i]),
      .write_addr_i(line_last),
      .write_data_i(line_waiter_i),
      .read_addr_i (walk_waiter_q),
      .read_data_o (walk_next_waiter)
  );

  // --- queues ---
  localparam int unsigned UsageBits = $clog2(Waiters + 1);
  logic                 again_room, later_room, later_valid, retry_q;
  logic [UsageBits-1:0] again_usage_unused, later_usage_unused;
  waiter_t              again_waiter, later_waiter, retry_waiter_q;
  rt_fifo #(
      .Depth (Waiters),
      .data_t(waiter_t)
  ) u_again (
      .clk_i,
      .rst_ni,
      .in_valid_i (again_valid_i),
      .in_ready_o (again_room),
      .in_data_i  (again_waiter_i),
      .out_valid_o(source_valid[FromAgain]),
      .out_ready_i(source_ready[FromAgain]),
      .out_data_o (again_waiter),
      .usage_o    (again_usage_unused)
  );
  assign source[FromAgain] = '{error: 1'b0, waiter: again_waiter};

  rt_fifo #(
      .Depth (Waiters),
      .data_t(waiter_t)
  ) u_later (
      .clk_i,
      .rst_ni,
      .in_valid_i (later_valid_i),
      .in_ready_o (later_room),
      .in_data_i  (later_waiter_i),
      .out_valid_o(later_valid),
      .out_ready_i(retried_o),
      .out_data_o (later_waiter),
      .usage_o    (later_usage_unused)
  );
  assign later_o                 = later_valid && !retry_q;
  assign retried_o               = later_o && retry_i;
  assign source_valid[FromLater] = retry_q;
  assign source[FromLater]       = '{error: 1'b0, waiter: retry_waiter_q};
  always_ff @(posedge clk_i) begin
    if (retried_o) begin
      retry_q        <= 1'b1;
      retry_waiter_q <= later_waiter;
    end else if (source_ready[FromLater]) begin
      retry_q <= 1'b0;
    end
    if (!rst_ni) retry_q <= 1'b0;
  end

  // --- one of the three; the stream begins in registers ---
  localparam int unsigned OutDepth = 2;
  logic                            chosen_valid, chosen_ready;
  wake_t                           chosen, wake;
  logic [$clog2(Sources)-1:0]      chosen_index_unused;
  logic [$clog2(OutDepth + 1)-1:0] out_usage_unused;
  rt_arbiter #(
      .NumInputs(Sources),
      .data_t   (wake_t)
  ) u_arbiter (
      .clk_i,
      .rst_ni,
      .in_valid_i (source_valid),
      .in_ready_o (source_ready),
      .in_data_i  (source),
      .in_last_i  ('1),
      .out_valid_o(chosen_valid),
      .out_ready_i(chosen_ready),
      .out_data_o (chosen),
      .out_index_o(chosen_index_unused)
  );
  rt_fifo #(
      .Depth (OutDepth),
      .data_t(wake_t)
  ) u_out (
      .clk_i,
      .rst_ni,
      .in_valid_i (chosen_valid),
      .in_ready_o (chosen_ready),
      .in_data_i  (chosen),
      .out_valid_o(wake_valid_o),
      .out_ready_i(wake_ready_i),
      .out_data_o (wake),
      .usage_o    (out_usage_unused)
  );
  assign wake_waiter_o = wake.waiter;
  assign wake_error_o  = wake.error;

  `RT_ASSERT(QueuesHaveRoom, (!again_valid_i || again_room) && (!later_valid_i || later_room))
  `RT_ASSERT(WaitsWhereALineIsFetched, !line_valid_i || !ended_i[line_mshr_i])
endmodule
