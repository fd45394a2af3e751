// Result unit: keeps the best hit of every context and decides what a context does when its leaf is done.
//
// Purpose     R0 takes an event: a result of rt_tri_test (tri_*), or a context that ends or leaves a leaf without tests (direct_*), and
//             reads what is known of the context; it is there in R2. R3 compares and updates the best hit. R4 decides, if this was the last of the
//             leaf, and R5 either finishes the ray (finish_*, with the best hit) or sends the context back to its lane (return_*).
// Hazard      Results of one context may follow each other directly: a best hit goes from R3 to the memory and to whoever has read it too early,
//             in R0 to R2.
// Order       Direct events go first; a context is never in both at once. Lower t wins, on equal t the lower id; an any-hit ray keeps
//             the first accepted one, also over an error met behind it.
// Rates       One event a clock. finish_* stalls it, return_* is always accepted.
// Counterpart is_nearer, leave_leaf in hls.
`include "rt_assert.svh"
module rt_result_unit #(
    parameter rt_core_pkg::config_t Config = rt_core_pkg::ConfigEcp5,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                                  clk_i,
    input  logic                                  rst_ni,
    input  logic                                  parent_links_i,
    input  logic                                  ray_valid_i,
    input  logic [ContextBits-1:0]                ray_context_i,
    input  rt_core_pkg::ray_info_t                ray_i,
    input  logic                                  leave_valid_i,
    input  logic [ContextBits-1:0]                leave_context_i,
    input  rt_core_pkg::leave_t                   leave_i,
    input  logic                                  direct_valid_i,
    output logic                                  direct_ready_o,
    input  logic [ContextBits-1:0]                direct_context_i,
    input  rt_contract_pkg::status_t              direct_event_i,
    input  logic                                  tri_valid_i,
    output logic                                  tri_ready_o,
    input  rt_contract_pkg::tri_test_out_record_t tri_data_i,
    input  logic [ContextBits-1:0]                tri_context_i,
    input  logic                                  tri_test_i,
    input  logic                                  tri_last_i,
    input  rt_contract_pkg::status_t              tri_event_i,
    output logic [Contexts-1:0]                   has_hit_o,
    output logic                                  return_valid_o,
    output logic [ContextBits-1:0]                return_context_o,
    output rt_core_pkg::launch_t                  return_o,
    output logic                                  finish_valid_o,
    input  logic                                  finish_ready_i,
    output rt_contract_pkg::hit_finish_in_record_t finish_o,
    output logic [31:0]                           finish_ray_o,
    // The context is free again.
    output logic                                  free_valid_o,
    output logic [ContextBits-1:0]                free_context_o
);
  typedef logic [ContextBits-1:0] context_t;
  typedef struct packed {
    rt_contract_pkg::t_limit_t       t;
    rt_contract_pkg::triangle_id_t   id;
    rt_contract_pkg::edge_t          edge_u;
    rt_contract_pkg::edge_t          edge_v;
    rt_contract_pkg::row_direction_t dz;
    rt_contract_pkg::exponent_t      exponent_u;
    rt_contract_pkg::exponent_t      exponent_v;
  } best_t;
  typedef struct packed {
    rt_contract_pkg::status_t status;
    best_t                    best;
    logic [31:0]              ray;
  } finish_t;

  localparam int unsigned FinishDepth = 16;
  localparam int unsigned InFlight = 6;  // R0 .. R5 may hold finished rays that are not counted yet
  localparam int unsigned FinishUsageBits = $clog2(FinishDepth + 1);

  // --- R0 ---
  logic                       r0_valid, room;
  context_t                   r0_context;
  logic [FinishUsageBits-1:0] finish_usage;
  assign room           = finish_usage <= FinishUsageBits'(FinishDepth - InFlight);
  assign direct_ready_o = room;
  assign tri_ready_o    = room && !direct_valid_i;
  assign r0_valid       = room && (direct_valid_i || tri_valid_i);
  assign r0_context     = direct_valid_i ? direct_context_i : tri_context_i;

  typedef struct packed {
    logic                     direct;
    logic                     test;
    logic                     last;
    context_t                 ctx;
    rt_contract_pkg::status_t event_code;
  } event_t;

  // --- R1, R2: what is known of the context ---
  logic                                  r1_valid_q, r2_valid_q, r2_had_q;
  event_t                                r1_q, r2_q;
  rt_contract_pkg::tri_test_out_record_t r1_tri_q, r2_tri_q;
  best_t                                 r1_best, r2_best_q;
  rt_core_pkg::leave_t                   r1_leave, r2_leave_q;
  rt_core_pkg::ray_info_t                r1_ray, r2_ray_q;
  logic [Contexts-1:0]                   has_hit_q;  // a clock after R3
  logic                                  accepted_q;
  context_t                              accepted_context_q;
  // A best hit that is newer than what has been read: R3 accepts one while its context is in this stage.
  logic                                  r0_newer, r1_newer, r2_newer, r1_newer_q, r2_newer_q;
  best_t                                 r1_newest_q, r2_newest_q;

  // --- R3: compare ---
  logic                                  r3_valid_q, r3_had_q, r3_nearer, r3_accept;
  event_t                                r3_q;
  rt_contract_pkg::tri_test_out_record_t r3_tri_q;
  best_t                                 r3_best_q, r3_candidate, r3_new;  // without a hit: no triangle at t_max
  rt_core_pkg::leave_t                   r3_leave_q;
  rt_core_pkg::ray_info_t                r3_ray_q;

  assign r3_candidate = '{
          t: r3_tri_q.t,
          id: r3_tri_q.id,
          edge_u: r3_tri_q.edge_u,
          edge_v: r3_tri_q.edge_v,
          dz: r3_tri_q.dz,
          exponent_u: r3_tri_q.exponent_u,
          exponent_v: r3_tri_q.exponent_v
      };
  assign r3_nearer = r3_tri_q.t < r3_best_q.t || (r3_tri_q.t == r3_best_q.t && r3_tri_q.id < r3_best_q.id);
  assign r3_accept = r3_valid_q && !r3_q.direct && r3_q.test && r3_tri_q.hit[0] && r3_nearer && !(r3_ray_q.any[0] && r3_had_q);
  assign r3_new    = r3_accept ? r3_candidate : r3_best_q;

  assign r0_newer = r3_accept && r3_q.ctx == r0_context;
  assign r1_newer = r3_accept && r3_q.ctx == r1_q.ctx;
  assign r2_newer = r3_accept && r3_q.ctx == r2_q.ctx;

  // --- R4: what to do ---
  logic                         r4_valid_q, r4_has_q, r4_ends, r4_finish;
  event_t                       r4_q;
  best_t                        r4_best_q;
  rt_core_pkg::leave_t          r4_leave_q;
  rt_core_pkg::ray_info_t       r4_ray_q;
  rt_contract_pkg::node_index_t r4_target;

  assign r4_target = parent_links_i ? r4_leave_q.node : r4_leave_q.link;
  // Nothing behind the exit can be nearer, or there is nowhere to go.
  assign r4_ends = !r4_leave_q.exit.exits[0] ||
      signed'({2'b0, r4_best_q.t}) <= signed'({r4_leave_q.exit.t_exit[27], r4_leave_q.exit.t_exit}) || r4_target == '0;
  assign r4_finish = (r4_ray_q.any[0] && r4_has_q) || r4_q.event_code != rt_core_pkg::EventGoOn || r4_ends;

  // --- R5: do it ---
  logic                 return_valid_q, free_valid_q;
  context_t             r5_context_q;
  rt_core_pkg::launch_t return_q;
  finish_t              finish_q, finish_out;
  assign return_valid_o   = return_valid_q;
  assign return_context_o = r5_context_q;
  assign return_o         = return_q;
  assign free_valid_o     = free_valid_q;
  assign free_context_o   = r5_context_q;
  assign has_hit_o        = has_hit_q;

  always_ff @(posedge clk_i) begin
    r1_valid_q <= r0_valid;
    r1_q <= '{
        direct: direct_valid_i,
        test: tri_test_i,
        last: direct_valid_i || tri_last_i,
        ctx: r0_context,
        event_code: direct_valid_i ? direct_event_i : tri_event_i
    };
    r1_tri_q    <= tri_data_i;
    r1_newer_q  <= r0_newer;
    r1_newest_q <= r3_candidate;
    r2_valid_q  <= r1_valid_q;
    r2_q        <= r1_q;
    r2_tri_q    <= r1_tri_q;
    r2_had_q    <= has_hit_q[r1_q.ctx] || r1_newer || r1_newer_q;
    r2_leave_q  <= r1_leave;
    r2_ray_q    <= r1_ray;
    r2_best_q   <= r1_best;
    r2_newer_q  <= r1_newer || r1_newer_q;
    r2_newest_q <= r1_newer ? r3_candidate : r1_newest_q;
    r3_valid_q  <= r2_valid_q;
    r3_q        <= r2_q;
    r3_tri_q    <= r2_tri_q;
    r3_had_q    <= r2_had_q || r2_newer;
    r3_leave_q  <= r2_leave_q;
    r3_ray_q    <= r2_ray_q;
    r3_best_q   <= r2_best_q;
    if (!r2_had_q) begin
      r3_best_q    <= '0;
      r3_best_q.t  <= r2_ray_q.t_max;
      r3_best_q.id <= rt_contract_pkg::NoTriangle;
    end
    if (r2_newer_q) r3_best_q <= r2_newest_q;
    if (r2_newer) r3_best_q <= r3_candidate;
    accepted_q         <= r3_accept && rst_ni;
    accepted_context_q <= r3_q.ctx;
    if (accepted_q) has_hit_q[accepted_context_q] <= 1'b1;
    if (ray_valid_i) has_hit_q[ray_context_i] <= 1'b0;

    r4_valid_q <= r3_valid_q && r3_q.last;
    r4_q       <= r3_q;
    r4_has_q   <= r3_had_q || r3_accept;
    r4_best_q  <= r3_new;
    r4_leave_q <= r3_leave_q;
    r4_ray_q   <= r3_ray_q;

    return_valid_q  <= r4_valid_q && !r4_finish;
    free_valid_q    <= r4_valid_q && r4_finish;
    r5_context_q    <= r4_q.ctx;
    return_q.plane  <= r4_leave_q.exit.plane;
    return_q.face   <= r4_leave_q.exit.face;
    return_q.t      <= r4_leave_q.exit.t_exit;
    return_q.steps  <= r4_leave_q.steps;
    return_q.fault  <= rt_core_pkg::EventGoOn;
    return_q.up     <= parent_links_i;
    return_q.parent <= r4_leave_q.parent;
    return_q.node   <= r4_target;
    finish_q.best   <= r4_best_q;
    finish_q.ray    <= r4_ray_q.index;
    if (!r4_has_q) finish_q.best.id <= '0;
    if (r4_q.event_code == rt_core_pkg::EventGoOn || r4_q.event_code == rt_core_pkg::EventFinish || (r4_ray_q.any[0] && r4_has_q)) begin
      finish_q.status <= rt_contract_pkg::status_t'(r4_has_q ? rt_contract_pkg::StatusHit : rt_contract_pkg::StatusMiss);
    end else begin
      finish_q.status <= r4_q.event_code;
    end
    if (!rst_ni) begin
      r1_valid_q     <= 1'b0;
      r2_valid_q     <= 1'b0;
      r3_valid_q     <= 1'b0;
      r4_valid_q     <= 1'b0;
      return_valid_q <= 1'b0;
      free_valid_q   <= 1'b0;
    end
  end

  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(best_t)
  ) u_best (
      .clk_i,
      .rst_ni,
      .write_en_i  (r3_accept),
      .write_addr_i(r3_q.ctx),
      .write_data_i(r3_candidate),
      .read_en_i   (r0_valid),
      .read_addr_i (r0_context),
      .read_data_o (r1_best)
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_core_pkg::leave_t)
  ) u_leave (
      .clk_i,
      .rst_ni,
      .write_en_i  (leave_valid_i),
      .write_addr_i(leave_context_i),
      .write_data_i(leave_i),
      .read_en_i   (r0_valid),
      .read_addr_i (r0_context),
      .read_data_o (r1_leave)
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_core_pkg::ray_info_t)
  ) u_info (
      .clk_i,
      .rst_ni,
      .write_en_i  (ray_valid_i),
      .write_addr_i(ray_context_i),
      .write_data_i(ray_i),
      .read_en_i   (r0_valid),
      .read_addr_i (r0_context),
      .read_data_o (r1_ray)
  );

  logic finish_room;
  rt_fifo #(
      .Depth (FinishDepth),
      .data_t(finish_t)
  ) u_finish (
      .clk_i,
      .rst_ni,
      .in_valid_i (free_valid_o),
      .in_ready_o (finish_room),
      .in_data_i  (finish_q),
      .out_valid_o(finish_valid_o),
      .out_ready_i(finish_ready_i),
      .out_data_o (finish_out),
      .usage_o    (finish_usage)
  );
  always_comb begin
    finish_o            = '0;
    finish_o.status     = finish_out.status;
    finish_o.t          = finish_out.best.t;
    finish_o.id         = finish_out.best.id;
    finish_o.edge_u     = finish_out.best.edge_u;
    finish_o.edge_v     = finish_out.best.edge_v;
    finish_o.dz         = finish_out.best.dz;
    finish_o.exponent_u = finish_out.best.exponent_u;
    finish_o.exponent_v = finish_out.best.exponent_v;
  end
  assign finish_ray_o = finish_out.ray;

  `RT_ASSERT(FinishHasRoom, !free_valid_o || finish_room)
  `RT_ASSERT(StartIsNotRunning, !(ray_valid_i && ((r1_valid_q && r1_q.ctx == ray_context_i) ||
                                                  (r2_valid_q && r2_q.ctx == ray_context_i) ||
                                                  (r3_valid_q && r3_q.ctx == ray_context_i) ||
                                                  (r4_valid_q && r4_q.ctx == ray_context_i))))
endmodule
