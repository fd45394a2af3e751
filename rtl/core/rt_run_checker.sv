// SPDX-License-Identifier: Apache-2.0
// Checker of a run, for simulation: what must be true at its end, and how long a ray may take on its way.
//
// End         When all rays have retired: no context holds a ray, nothing waits in a unit, no miss register fetches, every beat that was asked for has come,
//             hits = rays. Checked again when the run is done.
// Wait        A context that has come to a unit gets on there within 2^GenerationBits + 2 * Drain clocks, those not counted in which the sink holds up a hit:
//             at worst it comes in a drain, waits for the whole of it, and is the last to get on in the next. Drain = 2 * Contexts * (Line + Turn): every
//             line that comes lets at least one get on, and none needs more than two in a unit (docs/core.md). Line = (Registers + 1) * (Held + 4) +
//             Answer: behind the requests of all miss registers. Held is the longest that the memory has let a request stand in this run, Answer the
//             longest from a request to its last beat; Turn is what a line may be kept for nobody, and what a context needs to come back.
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
    // Sink and contexts: no hit is taken; who comes to a unit, who gets on there.
    input logic                                              stalled_i,
    input logic [Config.lanes+1:0]                           comes_i,
    input logic [Config.lanes+1:0][$clog2(Config.lanes*Config.contexts_per_lane)-1:0] coming_i,
    input logic [Config.lanes+1:0]                           gets_on_i,
    input logic [Config.lanes+1:0][$clog2(Config.lanes*Config.contexts_per_lane)-1:0] getting_on_i
);
  logic [31:0] rays_q, hits_q, asked_q, came_q, launched_q, freed_q;
  logic        ended_q, read_taken;
  assign read_taken = read_valid_i && read_ready_i;
  localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane;
  localparam int unsigned Pipes = Config.lanes + 2;
  localparam int unsigned Registers = 3 * Config.mshrs + 4 + 1;  // of nodes, leaves, triangles, lists, and the header
  localparam int unsigned Lease = 512;
  localparam int unsigned Turn = Lease + 128;
  localparam int unsigned Ids = 1 << (rt_core_pkg::SourceBits + rt_core_pkg::MshrIdBits);
  logic [31:0]                   clock_q, held_q, longest_held_q, answer_q, asked_at_q[Ids];
  logic [rt_core_pkg::IdBits-1:0] fill_id;
  always_comb begin
    fill_id = rt_core_pkg::IdBits'(fill_i.mshr);
    for (int unsigned s = 0; s < rt_config_pkg::CoreSources; s++) if (fill_i.valid[s]) fill_id = {rt_core_pkg::SourceBits'(s), fill_i.mshr};
  end
  // Every id has one request at a time.
  always_ff @(posedge clk_i) begin
    clock_q <= clock_q + 1;
    held_q  <= read_valid_i && !read_ready_i ? held_q + 1 : '0;
    if (held_q > longest_held_q) longest_held_q <= held_q;
    if (read_taken) asked_at_q[{read_i.source, read_i.mshr}] <= clock_q - held_q;
    if (fill_i.valid[rt_config_pkg::CoreSources-1:0] != '0 && fill_i.last && clock_q - asked_at_q[fill_id] > answer_q) answer_q <= clock_q - asked_at_q[fill_id];
    if (!rst_ni) begin
      clock_q  <= '0;
      held_q   <= '0;
      answer_q <= '0;
      longest_held_q <= '0;
    end
  end
  // Waits, in clocks in which the sink takes hits or none is there.
  logic [31:0] flowing_q, longest_q, came_at_q[Pipes][Contexts], line, bound;
  assign line  = (Registers + 1) * (longest_held_q + 4) + answer_q;
  assign bound = (32'd1 << rt_core_pkg::GenerationBits) + 2 * 2 * Contexts * (line + Turn);
  always_ff @(posedge clk_i) begin
    if (!stalled_i) flowing_q <= flowing_q + 1;
    for (int unsigned p = 0; p < Pipes; p++) begin
      if (comes_i[p]) came_at_q[p][coming_i[p]] <= flowing_q;
      if (gets_on_i[p] && flowing_q - came_at_q[p][getting_on_i[p]] > longest_q) longest_q <= flowing_q - came_at_q[p][getting_on_i[p]];
    end
    if (!rst_ni) begin
      flowing_q <= '0;
      longest_q <= '0;
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
  `RT_ASSERT(WaitIsBounded, !ended_q || longest_q <= bound)
  `RT_ASSERT(EndUnitsAreIdle, !ended_q || idle_i)
endmodule
