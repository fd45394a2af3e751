// SPDX-License-Identifier: Apache-2.0
// Pipe of contexts: those that are ready enter one a clock, walk through the stages, and leave, are parked in a cache, or become ready again.
//
// Purpose     What every unit that works on contexts does the same way: ready, look up, park, retry. The unit adds what it keeps of a context and
//             what it does in each stage. Stage 0 is the output of rt_ready.
// Stages      stage_*_o[k] is what stands in stage k; stage_error_o says that what the context waited for could not be read. With park_i[k] the
//             context in stage k leaves, because a cache has it and will wake it. retry_i puts the context of the last stage back into a
//             queue, with its error: nothing of it has changed, so nothing has to stall. With again_i one that has got on and has more to do comes
//             again, behind those that have been pushed.
// Back-pressure   go_i says that the last stage can pass contexts on. While it cannot, nobody enters: who looks up in vain takes lines from others.
// Age         While hold_i is 1 nobody new enters, so that those who are inside get on before anybody else (rt_generation); empty_o: nobody is inside,
//             that is in the stages, in a cache, or tried again. A context that comes again in the very clock of a push enters in spite of hold_i.
// Latency     3 from a push to stage 0, 1 from a wake; a stage a clock; 1 from retry_i to the queue.
// Capacity    A context is in one place at a time, so every queue has room for it.
// Counterpart the loop over contexts in hls/top/trace.cpp.
`include "rt_assert.svh"
module rt_context_pipe #(
    parameter int unsigned Contexts = 32,
    parameter int unsigned Stages = 6,
    parameter int unsigned Wakes = 1,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               hold_i,
    input  logic                               go_i,
    output logic                               empty_o,
    input  logic                               push_valid_i,
    input  logic [ContextBits-1:0]             push_context_i,
    input  logic [Wakes-1:0]                   wake_valid_i,
    output logic [Wakes-1:0]                   wake_ready_o,
    input  logic [Wakes-1:0][ContextBits-1:0]  wake_context_i,
    input  logic [Wakes-1:0]                   wake_error_i,
    output logic [Stages-1:0]                  stage_valid_o,
    output logic [Stages-1:0][ContextBits-1:0] stage_context_o,
    output logic [Stages-1:0]                  stage_error_o,
    input  logic [Stages-1:0]                  park_i,
    input  logic                               retry_i,
    input  logic                               again_i,  // it has got on and has more to do
    output logic                               idle_o
);
  localparam int unsigned Last = Stages - 1;
  `RT_ASSERT_INIT(StagesKnown, Stages >= 2)
  typedef logic [ContextBits-1:0] context_t;

  logic [Last:1]     valid_q, error_q;
  context_t [Last:1] context_q;
  logic              retry_q, again_q, retry_error_q, ready_idle, entered, gets_on, left_q, again_met;
  context_t          retry_context_q, getting_on, push_context;
  logic              push_valid;
  assign getting_on   = stage_context_o[Last];
  assign gets_on      = stage_valid_o[Last] && !park_i[Last] && !retry_i;
  assign push_valid   = push_valid_i || again_q;
  assign push_context = push_valid_i ? push_context_i : retry_context_q;
  assign again_met    = again_q && push_valid_i;
  rt_ready #(
      .Contexts(Contexts),
      .Pushes  (2),
      .Wakes   (Wakes)
  ) u_ready (
      .clk_i,
      .rst_ni,
      .hold_i,
      .go_i,
      .entered_o     (entered),
      .push_valid_i  ({retry_q || again_met, push_valid}),
      .push_context_i({retry_context_q, push_context}),
      .push_error_i  ({retry_error_q, 1'b0}),
      .wake_valid_i,
      .wake_ready_o,
      .wake_context_i,
      .wake_error_i,
      .valid_o       (stage_valid_o[0]),
      .context_o     (stage_context_o[0]),
      .error_o       (stage_error_o[0]),
      .idle_o        (ready_idle)
  );
  assign stage_valid_o[Last:1]   = valid_q;
  assign stage_context_o[Last:1] = context_q;
  assign stage_error_o[Last:1]   = error_q;
  always_ff @(posedge clk_i) begin
    for (int unsigned k = 1; k <= Last; k++) begin
      valid_q[k]   <= stage_valid_o[k-1] && !park_i[k-1] && rst_ni;
      context_q[k] <= stage_context_o[k-1];
      error_q[k]   <= stage_error_o[k-1];
    end
    retry_q         <= retry_i && rst_ni;
    again_q         <= again_i && rst_ni;
    retry_context_q <= getting_on;
    retry_error_q   <= stage_error_o[Last];
  end
  assign idle_o = ready_idle && stage_valid_o == '0 && !retry_q && !again_q;

  // Those inside.
  logic [ContextBits:0] inside_q;
  logic                 empty_q;
  always_ff @(posedge clk_i) begin
    left_q   <= gets_on && rst_ni;
    inside_q <= inside_q + (ContextBits + 1)'(entered) - (ContextBits + 1)'(left_q && !again_met);
    empty_q  <= inside_q == '0;
    if (!rst_ni) inside_q <= '0;
  end
  assign empty_o = empty_q;

  `RT_ASSERT(InsideIsKnown, !left_q || inside_q != '0)
  `RT_ASSERT(RetriesWhatIsThere, !(retry_i || again_i) || (stage_valid_o[Last] && !park_i[Last]))
  `RT_ASSERT(ParksWhatIsThere, (park_i & ~stage_valid_o) == '0)
endmodule
