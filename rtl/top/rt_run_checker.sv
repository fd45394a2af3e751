// Checker of a run, for simulation: what must be true at its end, and how long a ray may take on its way.
//
// End         When all rays have retired: no context holds a ray, nothing waits in a unit, no miss register fetches, every beat that was asked for has come,
//             hits = rays. Checked again when the run is done.
// Wait        A context that has come to a unit gets on there within Contexts * (Answer + Turn) + 2 * Lease clocks: at worst it waits for a miss register behind
//             all others, each of which fetches a line alone; Answer is the longest that a request has waited for its last beat in this run, Turn what a
//             context needs to come back and look again, Lease the time after which the caches let go of lines that nobody came for.
`include "rt_assert.svh"
module rt_run_checker #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5
) (
    input logic                       clk_i,
    input logic                       rst_ni,
    input logic                       started_i,
    input logic                       drained_i,
    input logic                       done_i,
    input logic                       ray_taken_i,
    input logic                       hit_taken_i,
    input logic                       read_valid_i,
    input logic                       read_ready_i,
    input rt_core_pkg::read_request_t read_i,
    input rt_core_pkg::fill_t         fill_i,
    input logic [31:0]                contexts_i,
    input logic                       idle_i,
    input logic                       launched_i,
    input logic                       freed_i,
    input logic [31:0]                longest_wait_i
);
  logic [31:0] rays_q, hits_q, asked_q, came_q, launched_q, freed_q;
  logic        ended_q, read_taken;
  assign read_taken = read_valid_i && read_ready_i;
  localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane;
  localparam int unsigned Turn = 64;
  localparam int unsigned Lease = 4096;
  localparam int unsigned Ids = 1 << (rt_core_pkg::SourceBits + rt_core_pkg::MshrIdBits);
  logic [31:0]                   clock_q, held_q, answer_q, asked_at_q[Ids];
  logic [rt_core_pkg::IdBits-1:0] fill_id;
  always_comb begin
    fill_id = rt_core_pkg::IdBits'(fill_i.mshr);
    for (int unsigned s = 0; s < rt_config_pkg::CoreSources; s++) if (fill_i.valid[s]) fill_id = {rt_core_pkg::SourceBits'(s), fill_i.mshr};
  end
  // Every id has one request at a time.
  always_ff @(posedge clk_i) begin
    clock_q <= clock_q + 1;
    held_q  <= read_valid_i && !read_ready_i ? held_q + 1 : '0;
    if (read_taken) asked_at_q[{read_i.source, read_i.mshr}] <= clock_q - held_q;
    if (fill_i.valid[rt_config_pkg::CoreSources-1:0] != '0 && fill_i.last && clock_q - asked_at_q[fill_id] > answer_q) answer_q <= clock_q - asked_at_q[fill_id];
    if (!rst_ni) begin
      clock_q  <= '0;
      held_q   <= '0;
      answer_q <= '0;
    end
  end
  always_ff @(posedge clk_i) begin
    ended_q <= drained_i || (done_i && ended_q);
    if (ray_taken_i) rays_q <= rays_q + 1;
    if (hit_taken_i) hits_q <= hits_q + 1;
    if (launched_i) launched_q <= launched_q + 1;
    if (freed_i) freed_q <= freed_q + 1;
    if (read_taken) asked_q <= asked_q + 32'(read_i.len) + 1;
    if (fill_i.valid[rt_config_pkg::CoreSources-1:0] != '0) came_q <= came_q + 1;
    if (!rst_ni || started_i) begin
      rays_q     <= '0;
      hits_q     <= '0;
      asked_q    <= '0;
      came_q     <= '0;
      launched_q <= '0;
      freed_q    <= '0;
      ended_q    <= 1'b0;
    end
  end
  `RT_ASSERT(EndHitsAreRays, !ended_q || (hits_q == rays_q && launched_q == rays_q && freed_q == rays_q))
  `RT_ASSERT(EndReadsAreFills, !ended_q || asked_q == came_q)
  `RT_ASSERT(EndContextsAreFree, !ended_q || contexts_i == 0)
  `RT_ASSERT(WaitIsBounded, !ended_q || longest_wait_i <= Contexts * (answer_q + Turn) + 2 * Lease)
  `RT_ASSERT(EndUnitsAreIdle, !ended_q || idle_i)
endmodule
