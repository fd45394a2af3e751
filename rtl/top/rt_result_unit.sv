// Result unit: keeps the best hit of every context and decides what a context does when its leaf is done.
//
// Purpose     R0 takes an event: a result of rt_tri_test (tri_*), or a context that ends or leaves a leaf without tests (direct_*), and
//             reads what is known of the context. R1 compares, updates the best hit and, if this was the last of the leaf, either
//             finishes the ray (finish_*, with the best hit) or sends the context back to its lane (return_*).
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

  localparam int unsigned FinishDepth = 8;
  localparam int unsigned FinishUsageBits = $clog2(FinishDepth + 1);

  // --- R0 ---
  logic                       r0_valid, room;
  context_t                   r0_context;
  logic [FinishUsageBits-1:0] finish_usage;
  // R1 may hold one that is not counted yet.
  assign room           = finish_usage < FinishUsageBits'(FinishDepth - 1);
  assign direct_ready_o = room;
  assign tri_ready_o    = room && !direct_valid_i;
  assign r0_valid       = room && (direct_valid_i || tri_valid_i);
  assign r0_context     = direct_valid_i ? direct_context_i : tri_context_i;

  // --- R1 ---
  logic                                  r1_valid_q, r1_direct_q, r1_test_q, r1_last_q;
  context_t                              r1_context_q;
  rt_contract_pkg::status_t              r1_event_q;
  rt_contract_pkg::tri_test_out_record_t r1_tri_q;
  best_t                                 r1_best, r1_candidate, r1_new;
  rt_core_pkg::leave_t                   r1_leave;
  rt_core_pkg::ray_info_t                r1_ray;
  logic [Contexts-1:0]                   has_hit_q;
  logic                                  r1_had, r1_has, r1_nearer, r1_accept, r1_ends, r1_finish;
  rt_contract_pkg::node_index_t          r1_target;
  finish_t                               finish_in, finish_out;

  assign r1_candidate = '{
          t: r1_tri_q.t,
          id: r1_tri_q.id,
          edge_u: r1_tri_q.edge_u,
          edge_v: r1_tri_q.edge_v,
          dz: r1_tri_q.dz,
          exponent_u: r1_tri_q.exponent_u,
          exponent_v: r1_tri_q.exponent_v
      };
  assign r1_had = has_hit_q[r1_context_q];
  always_comb begin
    if (r1_had) r1_nearer = r1_tri_q.t < r1_best.t || (r1_tri_q.t == r1_best.t && r1_tri_q.id < r1_best.id);
    else r1_nearer = r1_tri_q.t < r1_ray.t_max || (r1_tri_q.t == r1_ray.t_max && r1_tri_q.id < rt_contract_pkg::NoTriangle);
  end
  assign r1_accept = r1_valid_q && !r1_direct_q && r1_test_q && r1_tri_q.hit[0] && r1_nearer && !(r1_ray.any[0] && r1_had);
  assign r1_has    = r1_had || r1_accept;
  always_comb begin
    r1_new = r1_accept ? r1_candidate : r1_best;
    if (!r1_has) begin
      r1_new   = '0;
      r1_new.t = r1_ray.t_max;
    end
  end

  assign r1_target = parent_links_i ? r1_leave.node : r1_leave.link;
  // Nothing behind the exit can be nearer, or there is nowhere to go.
  assign r1_ends = !r1_leave.exit.exits[0] || signed'({2'b0, r1_new.t}) <= signed'({r1_leave.exit.t_exit[27], r1_leave.exit.t_exit}) ||
      r1_target == '0;
  assign r1_finish = (r1_ray.any[0] && r1_has) || r1_event_q != rt_core_pkg::EventGoOn || r1_ends;

  always_comb begin
    finish_in.best = r1_new;
    finish_in.ray  = r1_ray.index;
    if (r1_event_q == rt_core_pkg::EventGoOn || r1_event_q == rt_core_pkg::EventFinish || (r1_ray.any[0] && r1_has)) begin
      finish_in.status = rt_contract_pkg::status_t'(r1_has ? rt_contract_pkg::StatusHit : rt_contract_pkg::StatusMiss);
    end else begin
      finish_in.status = r1_event_q;
    end
    return_o.plane  = r1_leave.exit.plane;
    return_o.face   = r1_leave.exit.face;
    return_o.t      = r1_leave.exit.t_exit;
    return_o.steps  = r1_leave.steps;
    return_o.fault  = rt_core_pkg::EventGoOn;
    return_o.up     = parent_links_i;
    return_o.parent = r1_leave.parent;
    return_o.node   = r1_target;
  end
  assign return_valid_o   = r1_valid_q && r1_last_q && !r1_finish;
  assign return_context_o = r1_context_q;
  assign free_valid_o     = r1_valid_q && r1_last_q && r1_finish;
  assign free_context_o   = r1_context_q;
  assign has_hit_o        = has_hit_q;

  always_ff @(posedge clk_i) begin
    r1_valid_q   <= r0_valid;
    r1_direct_q  <= direct_valid_i;
    r1_context_q <= r0_context;
    r1_test_q    <= tri_test_i;
    r1_last_q    <= direct_valid_i || tri_last_i;
    r1_event_q   <= direct_valid_i ? direct_event_i : tri_event_i;
    r1_tri_q     <= tri_data_i;
    if (r1_accept) has_hit_q[r1_context_q] <= 1'b1;
    if (ray_valid_i) has_hit_q[ray_context_i] <= 1'b0;
    if (!rst_ni) r1_valid_q <= 1'b0;
  end

  // Two results of one context may follow each other directly.
  rt_ram_sdp #(
      .Depth  (Contexts),
      .Forward(1'b1),
      .data_t (best_t)
  ) u_best (
      .clk_i,
      .rst_ni,
      .write_en_i  (r1_accept),
      .write_addr_i(r1_context_q),
      .write_data_i(r1_candidate),
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
      .in_data_i  (finish_in),
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
  `RT_ASSERT(StartIsNotRunning, !(ray_valid_i && r1_valid_q && r1_context_q == ray_context_i))
endmodule
