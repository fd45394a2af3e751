// SPDX-License-Identifier: Apache-2.0
// Counters of a run: every one is 32 bits, cleared by clear_i, adds its increment in every clock while enable_i, wraps.
//
// Purpose     Where the clocks of a frame go. One memory of sums with one adder: it visits a counter in each clock, and what has come since the
//             last visit waits in a few bits for each. A register and an adder of 32 bits for each of 34 counters, and a choice among all of them
//             to read one, cost 1,200 LUTs and 900 registers more on an ECP5, and the densest wires on it.
// Timing      Increments, clear_i and enable_i are registered first, so that counting is in nobody's timing path; increments may be larger than
//             one (lanes, contexts), up to MaxStep.
// Reading     read_i for one clock; the answer (read_done_o for one clock) comes at the next visit, at most Count + 4 clocks later, and holds
//             all that was counted up to that visit. One read at a time. Reset clears.
`include "rt_assert.svh"
module rt_counters #(
    parameter int unsigned Count = 8,
    parameter int unsigned StepBits = 9,
    parameter logic [Count-1:0][StepBits-1:0] MaxStep = '1,
    localparam int unsigned IndexBits = $clog2(Count)
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 clear_i,
    input  logic                 enable_i,
    input  logic [Count-1:0][StepBits-1:0] step_i,
    input  logic                 read_i,
    input  logic [IndexBits-1:0] read_index_i,
    output logic                 read_done_o,
    output logic [31:0]          read_data_o
);
  typedef logic [IndexBits-1:0] index_t;
  localparam int unsigned WaitingBits = StepBits + IndexBits + 1;
  localparam index_t Last = index_t'(Count - 1);

  logic                   clear_q, enable_q;
  index_t                 s0_index_q, s1_index_q, s2_index_q, s3_index_q;
  logic                   s1_fresh_q, s2_fresh_q;
  logic [WaitingBits-1:0] waiting[Count];
  logic [WaitingBits-1:0] s1_waiting_q, s2_waiting_q;
  logic [31:0]            s1_stored, s2_stored_q, s3_sum_q;
  logic [IndexBits:0]     fresh_left_q;  // so many visits find a sum of the run before

  always_ff @(posedge clk_i) begin
    clear_q  <= clear_i || !rst_ni;
    enable_q <= enable_i && !clear_i && rst_ni;
  end

  // --- what waits for the next visit ---
  for (genvar i = 0; i < int'(Count); i++) begin : gen_waiting
    localparam logic [StepBits-1:0] Most = MaxStep[i];
    localparam int unsigned ThisStepBits = $clog2(32'(Most) + 1);
    localparam int unsigned Bits = $clog2(32'(Most) * Count + 1);
    logic [StepBits-1:0]     step;
    logic [ThisStepBits-1:0] step_q;
    logic [Bits-1:0]         waiting_q;
    assign step = step_i[i];
    always_ff @(posedge clk_i) begin
      step_q <= step[ThisStepBits-1:0];
      if (clear_q) waiting_q <= '0;
      else waiting_q <= (s0_index_q == index_t'(i) ? '0 : waiting_q) + (enable_q ? Bits'(step_q) : '0);
    end
    assign waiting[i] = WaitingBits'(waiting_q);
    `RT_ASSERT(StepFits, !enable_i || step <= Most)
  end

  // --- S0 choose, S1 the sum is there, S2 add, S3 store: a counter is visited again when that is past ---
  rt_ram_sdp #(
      .Depth (Count),
      .data_t(logic [31:0])
  ) u_sums (
      .clk_i,
      .rst_ni,
      .write_en_i  (1'b1),
      .write_addr_i(s3_index_q),
      .write_data_i(s3_sum_q),
      .read_en_i   (1'b1),
      .read_addr_i (s0_index_q),
      .read_data_o (s1_stored)
  );
  always_ff @(posedge clk_i) begin
    s0_index_q   <= s0_index_q == Last ? '0 : s0_index_q + 1'b1;
    s1_index_q   <= s0_index_q;
    s1_waiting_q <= waiting[s0_index_q];
    s1_fresh_q   <= fresh_left_q != '0;
    s2_index_q   <= s1_index_q;
    s2_waiting_q <= s1_waiting_q;
    s2_fresh_q   <= s1_fresh_q;
    s2_stored_q  <= s1_stored;
    s3_index_q   <= s2_index_q;
    s3_sum_q     <= (s2_fresh_q ? '0 : s2_stored_q) + 32'(s2_waiting_q);
    if (clear_q) fresh_left_q <= (IndexBits + 1)'(Count);
    else if (fresh_left_q != '0) fresh_left_q <= fresh_left_q - 1'b1;
    // Every index stays below Count.
    if (!rst_ni) begin
      s0_index_q <= '0;
      s1_index_q <= '0;
      s2_index_q <= '0;
      s3_index_q <= '0;
    end
  end

  // --- reading: with the visit that begins after the request ---
  logic   asked_q, s1_answer_q, s2_answer_q, s3_answer_q;
  index_t asked_index_q;
  always_ff @(posedge clk_i) begin
    s1_answer_q <= asked_q && s0_index_q == asked_index_q;
    s2_answer_q <= s1_answer_q;
    s3_answer_q <= s2_answer_q;
    if (asked_q && s0_index_q == asked_index_q) asked_q <= 1'b0;
    if (read_i) begin
      asked_q       <= 1'b1;
      asked_index_q <= read_index_i;
    end
    if (!rst_ni) begin
      asked_q     <= 1'b0;
      s1_answer_q <= 1'b0;
      s2_answer_q <= 1'b0;
      s3_answer_q <= 1'b0;
    end
  end
  assign read_done_o = s3_answer_q;
  assign read_data_o = s3_sum_q;

  `RT_ASSERT_INIT(VisitsApart, Count >= 5)
  `RT_ASSERT(OneRead, !read_i || !(asked_q || s1_answer_q || s2_answer_q))
  `RT_ASSERT(ReadInRange, !read_i || 32'(read_index_i) < Count)
endmodule
