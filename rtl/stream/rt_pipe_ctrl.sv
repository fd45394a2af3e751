// SPDX-License-Identifier: Apache-2.0
// Credit control: makes a stream stage out of a datapath that has a fixed latency and never stalls.
//
// Purpose     The datapath runs free (no enable, no ready chain); this module decides when an input may enter and catches the results.
//
//               in_valid_i/in_ready_o --+--> [ datapath, Latency clocks, free running ] --> pipe_data_i --> result FIFO --> out_*
//               in_tag_i ---------------+--------------------> tag FIFO (written on entry, read with the result) ---------> out_tag_o
//
//             An input enters when a credit is left, that is, when the result FIFO has a place for it. rt_lib_pkg::pipe_credits of them
//             cover the round trip, so the stage runs at its full rate after any stall. Spare ones are for a user that refuses inputs which find
//             no credit, and takes results now and then a clock later.
// Interval    A datapath that works on one input for several clocks says so: the next input enters Interval clocks later at the earliest.
//             enter_o tells it that an input enters in this clock.
// Datapath    Registers its inputs in every clock; pipe_data_i belongs to what was at its inputs Latency clocks before.
// Tag         Whatever has to come out with the result unchanged. It waits in a memory and costs no registers in the datapath.
// Cuts        valid, data, tag and ready: in_ready_o and out_valid_o are registers. out_data_o and out_tag_o are asynchronous reads of the memories.
// Latency     Latency + 1 (rt_lib_pkg::pipe_latency) for the whole stage. II Interval.
`include "rt_assert.svh"
module rt_pipe_ctrl #(
    parameter int unsigned Latency = 1,
    parameter int unsigned Interval = 1,
    parameter int unsigned Spare = 0,
    parameter type tag_t = logic,
    parameter type data_t = logic
) (
    input  logic  clk_i,
    input  logic  rst_ni,
    input  logic  in_valid_i,
    output logic  in_ready_o,
    input  tag_t  in_tag_i,
    output logic  enter_o,
    input  data_t pipe_data_i,
    output logic  out_valid_o,
    input  logic  out_ready_i,
    output tag_t  out_tag_o,
    output data_t out_data_o
);
  `RT_ASSERT_INIT(LatencyPositive, Latency >= 1)
  `RT_ASSERT_INIT(IntervalPositive, Interval >= 1 && Interval <= Latency)

  localparam int unsigned Credits = rt_lib_pkg::pipe_credits(Latency, Interval) + Spare;
  localparam int unsigned PtrBits = $clog2(Credits);
  localparam int unsigned CountBits = $clog2(Credits + 1);
  localparam logic [PtrBits-1:0] Last = PtrBits'(Credits - 1);

  (* ram_style = "distributed" *) tag_t tag_mem_q[Credits];
  (* ram_style = "distributed" *) data_t data_mem_q[Credits];
  logic [PtrBits-1:0] enter_ptr_q, done_ptr_q, leave_ptr_q;
  logic [CountBits-1:0] credit_q, held_q;
  logic [Latency-1:0] flight_q;
  logic in_ready_q, out_valid_q;
  logic enter, done, leave, entered_q;
  tag_t tag_q;

  assign in_ready_o  = in_ready_q;
  assign out_valid_o = out_valid_q;
  assign enter       = in_valid_i && in_ready_q;
  assign enter_o     = enter;
  assign done        = flight_q[Latency-1];
  assign leave       = out_valid_q && out_ready_i;
  assign out_tag_o   = tag_mem_q[leave_ptr_q];
  assign out_data_o  = data_mem_q[leave_ptr_q];

  if (Latency == 1) begin : gen_flight_one
    always_ff @(posedge clk_i) flight_q <= rst_ni && enter;
  end else begin : gen_flight
    always_ff @(posedge clk_i) flight_q <= rst_ni ? {flight_q[Latency-2:0], enter} : '0;
  end

  // The clocks in which an earlier input keeps the entrance busy.
  logic busy_next;
  if (Interval == 1) begin : gen_every_clock
    assign busy_next = 1'b0;
  end else begin : gen_interval
    localparam int unsigned WaitBits = $clog2(Interval + 1);
    logic [WaitBits-1:0] wait_q;
    assign busy_next = enter || wait_q > WaitBits'(1);
    always_ff @(posedge clk_i) begin
      if (enter) wait_q <= WaitBits'(Interval - 1);
      else if (wait_q != '0) wait_q <= wait_q - 1'b1;
      if (!rst_ni) wait_q <= '0;
    end
  end

  always_ff @(posedge clk_i) begin
    // A tag is written a clock after it has entered, and read after Latency + 1 at the earliest.
    entered_q <= enter && rst_ni;
    tag_q     <= in_tag_i;
    if (entered_q) begin
      tag_mem_q[enter_ptr_q] <= tag_q;
      enter_ptr_q            <= enter_ptr_q == Last ? '0 : enter_ptr_q + 1'b1;
    end
    if (done) begin
      data_mem_q[done_ptr_q] <= pipe_data_i;
      done_ptr_q             <= done_ptr_q == Last ? '0 : done_ptr_q + 1'b1;
    end
    if (leave) leave_ptr_q <= leave_ptr_q == Last ? '0 : leave_ptr_q + 1'b1;
    // enter and leave may come late: what they lead to is found beside them.
    if (enter && !leave) credit_q <= credit_q - 1'b1;
    if (leave && !enter) credit_q <= credit_q + 1'b1;
    if (done && !leave) held_q <= held_q + 1'b1;
    if (leave && !done) held_q <= held_q - 1'b1;
    in_ready_q  <= (leave || credit_q != CountBits'(enter)) && !busy_next;
    out_valid_q <= done || (leave ? held_q > CountBits'(1) : held_q != '0);
    if (!rst_ni) begin
      enter_ptr_q <= '0;
      done_ptr_q  <= '0;
      leave_ptr_q <= '0;
      credit_q    <= CountBits'(Credits);
      held_q      <= '0;
      in_ready_q  <= 1'b0;
      out_valid_q <= 1'b0;
    end
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_tag_i)
  `RT_ASSERT_STREAM(OutputHeld, out_valid_o, out_ready_i, out_tag_o)
  `RT_ASSERT_STREAM(ResultHeld, out_valid_o, out_ready_i, out_data_o)
  `RT_ASSERT(ResultHasRoom, !done || held_q != CountBits'(Credits))
  `RT_ASSERT(CreditsConserved, 32'(credit_q) + 32'(held_q) + $countones(flight_q) == Credits)
endmodule
