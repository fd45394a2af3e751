// SPDX-License-Identifier: Apache-2.0
// First-in first-out buffer of Depth entries, in registers / distributed RAM or in block RAM.
//
// Cuts        valid, data and ready: in_ready_o and out_valid_o are functions of registers only. With BlockRam = 0 the data come from an asynchronous
//             read of the memory.
// Latency     1 (BlockRam = 0) or 3 (BlockRam = 1: written, read, in the output buffer).
// Throughput  1 a clock for Depth >= 2.
// Capacity    Depth entries; with BlockRam = 1 three more in the output buffer.
// usage_o     Entries that in_ready_o counts (without the output buffer), for thresholds.
`include "rt_assert.svh"
module rt_fifo #(
    parameter int unsigned Depth = 2,
    parameter bit BlockRam = 1'b0,
    parameter type data_t = logic,
    localparam int unsigned UsageBits = $clog2(Depth + 1)
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 in_valid_i,
    output logic                 in_ready_o,
    input  data_t                in_data_i,
    output logic                 out_valid_o,
    input  logic                 out_ready_i,
    output data_t                out_data_o,
    output logic [UsageBits-1:0] usage_o
);
  `RT_ASSERT_INIT(DepthPositive, Depth >= 1)

  localparam int unsigned PtrBits = Depth > 1 ? $clog2(Depth) : 1;
  localparam logic [PtrBits-1:0] Last = PtrBits'(Depth - 1);

  logic [PtrBits-1:0] write_ptr_q, read_ptr_q;
  logic [UsageBits-1:0] usage_q;
  logic full_q;
  logic push, pop, grows, shrinks;

  assign in_ready_o = !full_q;
  assign push = in_valid_i && in_ready_o;
  assign usage_o = usage_q;
  // push and pop may come late: what they lead to is found beside them.
  assign grows   = push && !pop;
  assign shrinks = pop && !push;

  always_ff @(posedge clk_i) begin
    if (grows) usage_q <= usage_q + 1'b1;
    if (shrinks) usage_q <= usage_q - 1'b1;
    full_q <= grows ? usage_q == UsageBits'(Depth - 1) : full_q && !shrinks;
    if (push) write_ptr_q <= write_ptr_q == Last ? '0 : write_ptr_q + 1'b1;
    if (pop) read_ptr_q <= read_ptr_q == Last ? '0 : read_ptr_q + 1'b1;
    if (!rst_ni) begin
      usage_q     <= '0;
      full_q      <= 1'b0;
      write_ptr_q <= '0;
      read_ptr_q  <= '0;
    end
  end

  if (BlockRam) begin : gen_block_ram
    // Words on their way from the RAM to the output. Issue and read take a clock each, so three places keep the output busy.
    localparam int unsigned OutputBuffer = 3;
    data_t buffer_q[OutputBuffer];
    logic [1:0] buffer_write_q, buffer_read_q;
    logic [1:0] ahead_q, held_q, held_d;  // words read and not yet taken; those of them that are in the buffer
    logic issue, arrives_q, take, out_valid_q;
    data_t read_data;

    assign issue       = usage_q != '0 && ahead_q != 2'(OutputBuffer);
    assign pop         = issue;
    assign take        = out_valid_q && out_ready_i;
    assign held_d      = held_q + 2'(arrives_q) - 2'(take);
    assign out_valid_o = out_valid_q;
    assign out_data_o  = buffer_q[buffer_read_q];

    always_ff @(posedge clk_i) begin
      arrives_q   <= issue;
      ahead_q     <= ahead_q + 2'(issue) - 2'(take);
      held_q      <= held_d;
      out_valid_q <= held_d != '0;
      if (arrives_q) begin
        buffer_q[buffer_write_q] <= read_data;
        buffer_write_q           <= buffer_write_q == 2'(OutputBuffer - 1) ? '0 : buffer_write_q + 1'b1;
      end
      if (take) buffer_read_q <= buffer_read_q == 2'(OutputBuffer - 1) ? '0 : buffer_read_q + 1'b1;
      if (!rst_ni) begin
        arrives_q      <= 1'b0;
        ahead_q        <= '0;
        held_q         <= '0;
        out_valid_q    <= 1'b0;
        buffer_write_q <= '0;
        buffer_read_q  <= '0;
      end
    end

    // A word is read one clock after it was written at the earliest, so the two ports never meet on one address.
    rt_ram_sdp #(
        .Depth (Depth),
        .data_t(data_t)
    ) u_ram (
        .clk_i,
        .rst_ni,
        .write_en_i  (push),
        .write_addr_i(write_ptr_q),
        .write_data_i(in_data_i),
        .read_en_i   (issue),
        .read_addr_i (read_ptr_q),
        .read_data_o (read_data)
    );

    `RT_ASSERT(BufferHasRoom, !arrives_q || held_q != 2'(OutputBuffer))
    `RT_ASSERT(BufferCounted, ahead_q == held_q + 2'(arrives_q))
  end else begin : gen_registers
    (* ram_style = "distributed" *) data_t mem_q[Depth];
    logic empty_q;

    assign out_valid_o = !empty_q;
    assign pop         = out_valid_o && out_ready_i;
    assign out_data_o  = mem_q[read_ptr_q];

    always_ff @(posedge clk_i) begin
      if (push) mem_q[write_ptr_q] <= in_data_i;
      empty_q <= shrinks ? usage_q == UsageBits'(1) : empty_q && !grows;
      if (!rst_ni) empty_q <= 1'b1;
    end
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
  `RT_ASSERT_STREAM(OutputHeld, out_valid_o, out_ready_i, out_data_o)
  `RT_ASSERT(UsageBound, usage_q <= UsageBits'(Depth))
endmodule
