// Pipe of contexts: those that are ready enter one a clock, walk through the stages, and leave, are parked in a cache, or become ready again.
//
// Purpose     What every unit that works on contexts does the same way: ready, look up, park, retry. The unit adds what it keeps of a context and
//             what it does in each stage. Stage 0 is the output of rt_ready.
// Stages      stage_*_o[k] is what stands in stage k; stage_error_o says that what the context waited for could not be read. With park_i[k] the
//             context in stage k leaves, because a cache has it and will wake it. retry_i puts the context of the last stage back into a
//             queue, with its error: nothing of it has changed, so nothing has to stall. again_i does the same for one that has got on.
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
    input  logic                               again_i,  // it has got on and has more to do: back into a queue as well
    output logic                               idle_o
);
  localparam int unsigned Last = Stages - 1;
  `RT_ASSERT_INIT(StagesKnown, Stages >= 2)
  typedef logic [ContextBits-1:0] context_t;

  logic [Last:1]     valid_q, error_q;
  context_t [Last:1] context_q;
  logic              retry_q, retry_error_q, ready_idle;
  context_t          retry_context_q;
  rt_ready #(
      .Contexts(Contexts),
      .Pushes  (2),
      .Wakes   (Wakes)
  ) u_ready (
      .clk_i,
      .rst_ni,
      .push_valid_i  ({retry_q, push_valid_i}),
      .push_context_i({retry_context_q, push_context_i}),
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
    retry_q         <= (retry_i || again_i) && rst_ni;
    retry_context_q <= stage_context_o[Last];
    retry_error_q   <= stage_error_o[Last];
  end
  assign idle_o = ready_idle && stage_valid_o == '0 && !retry_q;

`ifndef SYNTHESIS
  // The longest that a context has been here without getting on (rt_run_checker holds it against its bound).
  logic [31:0] clock_q, longest_q, came_at_q[Contexts];
  logic        gets_on;
  assign gets_on = stage_valid_o[Last] && !park_i[Last] && !retry_i;
  always_ff @(posedge clk_i) begin
    clock_q <= clock_q + 1;
    if (push_valid_i) came_at_q[push_context_i] <= clock_q;
    if (gets_on && again_i) came_at_q[stage_context_o[Last]] <= clock_q;
    if (gets_on && clock_q - came_at_q[stage_context_o[Last]] > longest_q) longest_q <= clock_q - came_at_q[stage_context_o[Last]];
    if (!rst_ni) begin
      clock_q   <= '0;
      longest_q <= '0;
    end
  end
`endif

  `RT_ASSERT(RetriesWhatIsThere, !(retry_i || again_i) || (stage_valid_o[Last] && !park_i[Last]))
  `RT_ASSERT(ParksWhatIsThere, (park_i & ~stage_valid_o) == '0)
endmodule
