// Counters of a run: every one is 32 bits, cleared by clear_i, adds its increment in every clock while enable_i, wraps.
//
// Purpose     Where the clocks of a frame go. Increments are registered first, so that counting is in nobody's timing path; they may be
//             larger than one (lanes, contexts).
module rt_counters #(
    parameter int unsigned Count = 8,
    parameter int unsigned StepBits = 9
) (
    input  logic                clk_i,
    input  logic                clear_i,
    input  logic                enable_i,
    input  logic [StepBits-1:0] step_i [Count],
    output logic [31:0]         count_o[Count]
);
  logic [StepBits-1:0] step_q [Count];
  logic [31:0]         count_q[Count];

  always_ff @(posedge clk_i) begin
    for (int unsigned i = 0; i < Count; i++) begin
      step_q[i]  <= (enable_i && !clear_i) ? step_i[i] : '0;
      count_q[i] <= clear_i ? '0 : count_q[i] + 32'(step_q[i]);
    end
  end
  assign count_o = count_q;
endmodule
