// Counters of a run: every one is 32 bits, cleared by clear_i, adds its increment in every clock while enable_i, wraps.
//
// Purpose     Where the clocks of a frame go. Increments, clear_i and enable_i are registered first, so that counting is in nobody's timing path;
//             increments may be larger than one (lanes, contexts).
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
  logic                clear_q, enable_q;

  always_ff @(posedge clk_i) begin
    step_q   <= step_i;
    clear_q  <= clear_i;
    enable_q <= enable_i && !clear_i;
    for (int unsigned i = 0; i < Count; i++) begin
      if (clear_q) count_q[i] <= '0;
      else if (enable_q) count_q[i] <= count_q[i] + 32'(step_q[i]);
    end
  end
  assign count_o = count_q;
endmodule
