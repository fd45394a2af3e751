// SPDX-License-Identifier: Apache-2.0
// Result unit: keeps the best hit of every context and decides what a context does when its leaf is done.
//
// Purpose     R0 takes an event: a result of rt_tri_test (tri_*), or a context that ends or leaves a leaf without tests (direct_*), and
//             reads what is known of the context; it is there in R2. R3 compares with the best hit, R4 keeps the better one. R5 decides, if this was
//             the last of the leaf, and R6 either finishes the ray (finish_*, with the best hit) or sends the context back to its lane (return_*).
// Hazard      A result waits in R0 while one of its context is in R1 to R4. Those of one context are further apart in rt_reference_unit, so that
//             this happens only where results have been held up.
// Order       Direct events go first; a context is never in both at once. Lower t wins, on equal t the lower id; an any-hit ray keeps
//             the first accepted one, also over an error met behind it.
// Two levels  Inside an object the candidate is compared with what is as good there as the best hit: t_max of the object's ray, until the object has one. The
//             hit that is kept has t and the id of the world. A tree that is done sends the context back to the leaf that it came from.
// Rates       One event a clock. finish_* stalls it, return_* is always accepted.
// Pause       pause_i keeps further events back, so that no return goes to the lanes seven clocks later.
// Counterpart is_nearer, leave_leaf, leave_tree in hls.
`include "rt_assert.svh"
module rt_result_unit #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam bit TwoLevels = Config.levels > 1,
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
    input  logic                                  direct_climbed_i,  // at the root of its tree, after direct_steps_i
    input  logic [31:0]                           direct_steps_i,
    input  logic                                  tri_valid_i,
    output logic                                  tri_ready_o,
    input  rt_contract_pkg::tri_test_out_record_t tri_data_i,
    input  logic [ContextBits-1:0]                tri_context_i,
    input  logic                                  tri_test_i,
    input  logic                                  tri_last_i,
    input  rt_contract_pkg::status_t              tri_event_i,
    // A leaf of the top tree is reached: where its objects send the context back to.
    input  logic                                  save_valid_i,
    input  logic [ContextBits-1:0]                save_context_i,
    input  rt_core_pkg::saved_t                   save_i,
    input  logic                                  entered_valid_i,
    input  logic [ContextBits-1:0]                entered_context_i,
    input  rt_core_pkg::entered_t                 entered_i,
    input  logic                                  pause_i,
    output logic                                  found_valid_o,
    output logic [ContextBits-1:0]                found_context_o,
    output rt_core_pkg::found_t                   found_o,
    output logic [Contexts-1:0]                   has_hit_o,
    output logic                                  return_valid_o,
    output logic [ContextBits-1:0]                return_context_o,
    output rt_core_pkg::launch_t                  return_o,
    output logic                                  finish_valid_o,
    input  logic                                  finish_ready_i,
    output rt_contract_pkg::hit_finish_in_record_t finish_o,
    output rt_core_pkg::ray_tag_t                 finish_tag_o,
    output rt_contract_pkg::triangle_index_t      finish_number_o,  // of the instance that is hit
    // The context is free again.
    output logic                                  free_valid_o,
    output logic [ContextBits-1:0]                free_context_o,
    output rt_core_pkg::unit_events_t             events_o  // busy: an event is taken
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
    rt_contract_pkg::status_t         status;
    best_t                            best;
    rt_core_pkg::ray_tag_t            tag;
    rt_contract_pkg::triangle_index_t number;
  } finish_t;

  // What a candidate has to come before.
  typedef struct packed {
    rt_contract_pkg::t_limit_t     t;
    rt_contract_pkg::triangle_id_t id;
  } near_t;

  localparam int unsigned FinishDepth = 16;
  localparam int unsigned InFlight = 7;  // R0 .. R6 may hold finished rays that are not counted yet
  localparam int unsigned FinishUsageBits = $clog2(FinishDepth + 1);

  typedef struct packed {
    logic                     direct;
    logic                     test;
    logic                     last;
    context_t                 ctx;
    rt_contract_pkg::status_t event_code;
  } event_t;
  typedef struct packed {
    event_t                                what;
    rt_contract_pkg::tri_test_out_record_t data;
  } result_t;

  // --- R0 ---
  logic                       r0_valid, r0_conflict, room_q, result_valid, result_take;
  result_t                    result;
  event_t                     r0_event;
  context_t                   r0_context;
  logic [FinishUsageBits-1:0] finish_usage;
  rt_skid #(
      .data_t(result_t)
  ) u_result (
      .clk_i,
      .rst_ni,
      .in_valid_i (tri_valid_i),
      .in_ready_o (tri_ready_o),
      .in_data_i  ('{
          what: '{direct: 1'b0, test: tri_test_i, last: tri_last_i, ctx: tri_context_i, event_code: tri_event_i},
          data: tri_data_i
      }),
      .out_valid_o(result_valid),
      .out_ready_i(result_take),
      .out_data_o (result)
  );
  assign direct_ready_o = room_q;
  assign result_take    = room_q && !direct_valid_i && !r0_conflict;
  assign r0_valid       = room_q && (direct_valid_i || (result_valid && !r0_conflict));
  always_comb begin
    r0_event = result.what;
    if (direct_valid_i) r0_event = '{direct: 1'b1, test: 1'b0, last: 1'b1, ctx: direct_context_i, event_code: direct_event_i};
    r0_context = r0_event.ctx;
  end

  always_comb begin
    events_o         = '0;
    events_o.busy    = r0_valid;
    events_o.starved = !direct_valid_i && !result_valid;
  end

  // --- R1, R2: what is known of the context ---
  logic                                  r1_valid_q, r2_valid_q, r2_had_q;
  event_t                                r1_q, r2_q;
  rt_contract_pkg::tri_test_out_record_t r1_tri_q, r2_tri_q;
  best_t                                 r1_best, r2_best_q;
  rt_core_pkg::leave_t                   r1_leave, r2_leave_q;
  rt_core_pkg::ray_info_t                r1_ray, r2_ray_q;
  logic [Contexts-1:0]                   has_hit_q;

  // --- two levels (below) ---
  near_t                        r3_near;
  best_t                        r4_new;  // as the world sees it
  logic                         r5_level, r5_climbed, r5_at_root;
  rt_contract_pkg::t_limit_t    r5_near_t;
  logic [31:0]                  r5_steps;
  rt_core_pkg::saved_t          r5_saved;
  rt_contract_pkg::pair_index_t r5_root;
  rt_contract_pkg::triangle_index_t r5_number;

  // --- R3: compare ---
  logic                                  r3_valid_q, r3_had_q;
  event_t                                r3_q;
  rt_contract_pkg::tri_test_out_record_t r3_tri_q;
  best_t                                 r3_best_q;  // without a hit: no triangle at t_max
  rt_core_pkg::leave_t                   r3_leave_q;
  rt_core_pkg::ray_info_t                r3_ray_q;

  // --- R4: keep the better one ---
  logic                   r4_valid_q, r4_had_q, r4_candidate_q, r4_less_q, r4_same_q, r4_lower_id_q, r4_accept;
  event_t                 r4_q;
  best_t                  r4_new_q, r4_best_q;
  rt_core_pkg::leave_t    r4_leave_q;
  rt_core_pkg::ray_info_t r4_ray_q;
  assign r4_accept = r4_candidate_q && (r4_less_q || (r4_same_q && r4_lower_id_q));

  assign r0_conflict = (r1_valid_q && r1_q.ctx == result.what.ctx) || (r2_valid_q && r2_q.ctx == result.what.ctx) ||
                       (r3_valid_q && r3_q.ctx == result.what.ctx) || (r4_valid_q && r4_q.ctx == result.what.ctx);

  // --- R5: what to do ---
  logic                         r5_last_q, r5_has_q, r5_ends, r5_finish, r5_leaves_tree;
  event_t                       r5_q;
  best_t                        r5_best_q;
  rt_core_pkg::leave_t          r5_leave_q;
  rt_core_pkg::ray_info_t       r5_ray_q;
  rt_contract_pkg::node_index_t r5_target;

  assign r5_target = parent_links_i ? r5_leave_q.node : r5_leave_q.link;
  // Nothing behind the exit can be nearer, or there is nowhere to go.
  assign r5_ends = !r5_leave_q.exit.exits[0] ||
      signed'({2'b0, r5_near_t}) <= signed'({r5_leave_q.exit.t_exit[27], r5_leave_q.exit.t_exit}) || r5_at_root;
  assign r5_leaves_tree = r5_level && !(r5_ray_q.any[0] && r5_has_q) &&
      (r5_q.event_code == rt_core_pkg::EventFinish || (r5_q.event_code == rt_core_pkg::EventGoOn && r5_ends));
  assign r5_finish = (r5_ray_q.any[0] && r5_has_q) || ((r5_q.event_code != rt_core_pkg::EventGoOn || r5_ends) && !r5_leaves_tree);

  // --- R6: do it ---
  logic                 return_valid_q, free_valid_q;
  context_t             r6_context_q;
  rt_core_pkg::launch_t return_q;
  finish_t              finish_q, finish_out;
  assign return_valid_o   = return_valid_q;
  assign return_context_o = r6_context_q;
  assign return_o         = return_q;
  assign free_valid_o     = free_valid_q;
  assign free_context_o   = r6_context_q;
  assign has_hit_o        = has_hit_q;

  always_ff @(posedge clk_i) begin
    room_q     <= finish_usage <= FinishUsageBits'(FinishDepth - InFlight - 1) && !pause_i;
    r1_valid_q <= r0_valid;
    r1_q       <= r0_event;
    r1_tri_q   <= result.data;
    r2_valid_q <= r1_valid_q;
    r2_q       <= r1_q;
    r2_tri_q   <= r1_tri_q;
    r2_had_q   <= has_hit_q[r1_q.ctx];
    r2_leave_q <= r1_leave;
    r2_ray_q   <= r1_ray;
    r2_best_q  <= r1_best;
    r3_valid_q <= r2_valid_q;
    r3_q       <= r2_q;
    r3_tri_q   <= r2_tri_q;
    r3_had_q   <= r2_had_q;
    r3_leave_q <= r2_leave_q;
    r3_ray_q   <= r2_ray_q;
    r3_best_q  <= r2_best_q;
    if (!r2_had_q) begin
      r3_best_q    <= '0;
      r3_best_q.t  <= r2_ray_q.t_max;
      r3_best_q.id <= rt_contract_pkg::NoTriangle;
    end

    r4_valid_q     <= r3_valid_q;
    r4_q           <= r3_q;
    r4_had_q       <= r3_had_q;
    r4_candidate_q <= r3_valid_q && !r3_q.direct && r3_q.test && r3_tri_q.hit[0] && !(r3_ray_q.any[0] && r3_had_q);
    r4_less_q      <= r3_tri_q.t < r3_near.t;
    r4_same_q      <= r3_tri_q.t == r3_near.t;
    r4_lower_id_q  <= r3_tri_q.id < r3_near.id;
    r4_best_q      <= r3_best_q;
    r4_leave_q     <= r3_leave_q;
    r4_ray_q       <= r3_ray_q;
    r4_new_q       <= '{
            t: r3_tri_q.t,
            id: r3_tri_q.id,
            edge_u: r3_tri_q.edge_u,
            edge_v: r3_tri_q.edge_v,
            dz: r3_tri_q.dz,
            exponent_u: r3_tri_q.exponent_u,
            exponent_v: r3_tri_q.exponent_v
        };
    if (r4_accept) has_hit_q[r4_q.ctx] <= 1'b1;
    if (ray_valid_i) has_hit_q[ray_context_i] <= 1'b0;

    r5_last_q  <= r4_valid_q && r4_q.last;
    r5_q       <= r4_q;
    r5_has_q   <= r4_had_q || r4_accept;
    r5_best_q  <= r4_accept ? r4_new : r4_best_q;
    r5_leave_q <= r4_leave_q;
    r5_ray_q   <= r4_ray_q;

    return_valid_q  <= r5_last_q && !r5_finish;
    free_valid_q    <= r5_last_q && r5_finish;
    r6_context_q    <= r5_q.ctx;
    return_q.plane  <= r5_leave_q.exit.plane;
    return_q.face   <= r5_leave_q.exit.face;
    return_q.t      <= r5_leave_q.exit.t_exit;
    return_q.steps  <= r5_leave_q.steps;
    return_q.fault  <= rt_core_pkg::EventGoOn;
    return_q.up     <= parent_links_i;
    return_q.parent <= r5_leave_q.parent;
    return_q.node   <= r5_target;
    return_q.t_near <= Config.leaf_returns != 0 ? r5_near_t : '0;
    return_q.tree   <= '0;
    if (TwoLevels) begin
      return_q.tree.level <= r5_level;
      return_q.tree.root  <= r5_level ? r5_root : '0;
      if (r5_leaves_tree) begin
        return_q.tree         <= '0;
        return_q.tree.resumes <= 1'b1;
        return_q.t            <= r5_saved.t;
        return_q.node         <= r5_saved.node;
        return_q.up           <= 1'b0;
        if (r5_climbed) return_q.steps <= r5_steps;
      end
    end
    finish_q.best   <= r5_best_q;
    finish_q.tag    <= r5_ray_q.tag;
    finish_q.number <= r5_number;
    if (!r5_has_q) finish_q.best.id <= '0;
    if (r5_q.event_code == rt_core_pkg::EventGoOn || r5_q.event_code == rt_core_pkg::EventFinish || (r5_ray_q.any[0] && r5_has_q)) begin
      finish_q.status <= rt_contract_pkg::status_t'(r5_has_q ? rt_contract_pkg::StatusHit : rt_contract_pkg::StatusMiss);
    end else begin
      finish_q.status <= r5_q.event_code;
    end
    if (!rst_ni) begin
      room_q         <= 1'b0;
      r1_valid_q     <= 1'b0;
      r2_valid_q     <= 1'b0;
      r3_valid_q     <= 1'b0;
      r4_valid_q     <= 1'b0;
      r4_candidate_q <= 1'b0;
      r5_last_q      <= 1'b0;
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
      .write_en_i  (r4_accept),
      .write_addr_i(r4_q.ctx),
      .write_data_i(r4_new),
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

  if (TwoLevels) begin : gen_levels
    localparam int unsigned StepShift = rt_contract_pkg::TLimitFrac - rt_contract_pkg::EntryStartFrac;
    localparam int unsigned WayBits = rt_contract_pkg::EntryStartBits + StepShift + 1;
    logic [Contexts-1:0]              level_q, had_near_q;
    logic                             r1_climbed_q, r2_climbed_q, r3_climbed_q, r4_climbed_q, r5_climbed_q;
    logic [31:0]                      r1_steps_q, r2_steps_q, r3_steps_q, r4_steps_q, r5_steps_q;
    logic                             r2_level_q, r3_level_q, r4_level_q, r5_level_q, r2_had_near_q, leaves_tree_q;
    near_t                            r4_new_near, r1_near, r2_near_q, r3_near_q, r4_near_q;
    rt_core_pkg::entered_t            r1_entered, r2_entered_q, r3_entered_q, r4_entered_q;
    rt_core_pkg::saved_t              r1_saved, r2_saved_q, r3_saved_q, r4_saved_q, r5_saved_q;
    rt_contract_pkg::triangle_index_t r1_instance, r2_instance_q, r3_instance_q, r4_instance_q, r4_found_in_q, r5_number_q;
    rt_contract_pkg::pair_index_t     r5_root_q;
    logic [WayBits-1:0]               r3_way_q;  // t of the candidate from the start of the world's ray, in steps of the object's
    rt_contract_pkg::t_limit_t        r4_world_t_q, r5_near_t_q;
    rt_contract_pkg::triangle_id_t    r4_world_id_q;

    always_ff @(posedge clk_i) begin
      r1_climbed_q  <= direct_valid_i && direct_climbed_i;
      r1_steps_q    <= direct_steps_i;
      r2_climbed_q  <= r1_climbed_q;
      r2_steps_q    <= r1_steps_q;
      r2_level_q    <= level_q[r1_q.ctx];
      r2_had_near_q <= had_near_q[r1_q.ctx];
      r2_near_q     <= r1_near;
      r2_entered_q  <= r1_entered;
      r2_saved_q    <= r1_saved;
      r2_instance_q <= r1_instance;
      r3_climbed_q  <= r2_climbed_q;
      r3_steps_q    <= r2_steps_q;
      r3_level_q    <= r2_level_q;
      r3_entered_q  <= r2_entered_q;
      r3_saved_q    <= r2_saved_q;
      r3_instance_q <= r2_had_q ? r2_instance_q : '0;
      r3_way_q      <= WayBits'({r2_entered_q.start, StepShift'(0)}) + WayBits'(r2_tri_q.t);
      if (r2_level_q) begin
        r3_near_q <= r2_had_near_q ? r2_near_q : '{t: r2_entered_q.t_max, id: rt_contract_pkg::NoTriangle};
      end else begin
        r3_near_q <= r2_had_q ? '{t: r2_best_q.t, id: r2_best_q.id} : '{t: r2_ray_q.t_max, id: rt_contract_pkg::NoTriangle};
      end
      r4_climbed_q  <= r3_climbed_q;
      r4_steps_q    <= r3_steps_q;
      r4_level_q    <= r3_level_q;
      r4_near_q     <= r3_near_q;
      r4_entered_q  <= r3_entered_q;
      r4_saved_q    <= r3_saved_q;
      r4_instance_q <= r3_level_q ? r3_entered_q.number : r3_instance_q;
      r4_world_t_q  <= rt_contract_pkg::t_limit_t'(r3_way_q >> r3_entered_q.scale);
      r4_world_id_q <= r3_tri_q.id + r3_entered_q.first_id;
      r4_found_in_q <= r3_instance_q;
      r5_number_q   <= r4_accept ? r4_instance_q : r4_found_in_q;
      r5_climbed_q  <= r4_climbed_q;
      r5_steps_q    <= r4_steps_q;
      r5_level_q    <= r4_level_q;
      r5_near_t_q   <= r4_accept ? r4_new_q.t : r4_near_q.t;
      r5_saved_q    <= r4_saved_q;
      r5_root_q     <= r4_entered_q.root;
      leaves_tree_q <= r5_last_q && r5_leaves_tree && rst_ni;
      if (r4_accept && r4_level_q) had_near_q[r4_q.ctx] <= 1'b1;
      if (leaves_tree_q) level_q[r6_context_q] <= 1'b0;
      if (ray_valid_i) level_q[ray_context_i] <= 1'b0;
      if (entered_valid_i) begin
        level_q[entered_context_i]    <= 1'b1;
        had_near_q[entered_context_i] <= 1'b0;
      end
    end
    assign r3_near     = r3_near_q;
    assign r4_new_near = '{t: r4_new_q.t, id: r4_new_q.id};
    always_comb begin
      r4_new = r4_new_q;
      if (r4_level_q) begin
        r4_new.t  = r4_world_t_q;
        r4_new.id = r4_world_id_q;
      end
    end
    assign r5_level        = r5_level_q;
    assign r5_climbed      = r5_climbed_q;
    assign r5_steps        = r5_steps_q;
    assign r5_saved        = r5_saved_q;
    assign r5_root         = r5_root_q;
    assign r5_number       = r5_number_q;
    assign r5_near_t       = r5_near_t_q;
    assign r5_at_root      = parent_links_i && r5_level_q ? r5_target == {r5_root_q, 1'b0} : r5_target == '0;
    assign found_valid_o   = r4_accept;
    assign found_context_o = r4_q.ctx;
    assign found_o         = '{t: r4_new.t, number: r4_instance_q};

    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(near_t)
    ) u_near (
        .clk_i,
        .rst_ni,
        .write_en_i  (r4_accept),
        .write_addr_i(r4_q.ctx),
        .write_data_i(r4_new_near),
        .read_en_i   (r0_valid),
        .read_addr_i (r0_context),
        .read_data_o (r1_near)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_contract_pkg::triangle_index_t)
    ) u_instance (
        .clk_i,
        .rst_ni,
        .write_en_i  (r4_accept),
        .write_addr_i(r4_q.ctx),
        .write_data_i(r4_instance_q),
        .read_en_i   (r0_valid),
        .read_addr_i (r0_context),
        .read_data_o (r1_instance)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_core_pkg::entered_t)
    ) u_entered (
        .clk_i,
        .rst_ni,
        .write_en_i  (entered_valid_i),
        .write_addr_i(entered_context_i),
        .write_data_i(entered_i),
        .read_en_i   (r0_valid),
        .read_addr_i (r0_context),
        .read_data_o (r1_entered)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_core_pkg::saved_t)
    ) u_saved (
        .clk_i,
        .rst_ni,
        .write_en_i  (save_valid_i),
        .write_addr_i(save_context_i),
        .write_data_i(save_i),
        .read_en_i   (r0_valid),
        .read_addr_i (r0_context),
        .read_data_o (r1_saved)
    );
  end else begin : gen_one_level
    assign r3_near         = '{t: r3_best_q.t, id: r3_best_q.id};
    assign r4_new          = r4_new_q;
    assign r5_level        = 1'b0;
    assign r5_climbed      = 1'b0;
    assign r5_steps        = '0;
    assign r5_saved        = '0;
    assign r5_root         = '0;
    assign r5_number       = '0;
    assign r5_near_t       = r5_best_q.t;
    assign r5_at_root      = r5_target == '0;
    assign found_valid_o   = 1'b0;
    assign found_context_o = '0;
    assign found_o         = '0;
  end

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
  assign finish_tag_o    = finish_out.tag;
  assign finish_number_o = finish_out.number;

  `RT_ASSERT(FinishHasRoom, !free_valid_o || finish_room)
  `RT_ASSERT(StartIsNotRunning, !(ray_valid_i && ((r1_valid_q && r1_q.ctx == ray_context_i) ||
                                                  (r2_valid_q && r2_q.ctx == ray_context_i) ||
                                                  (r3_valid_q && r3_q.ctx == ray_context_i) ||
                                                  (r4_valid_q && r4_q.ctx == ray_context_i) ||
                                                  (r5_last_q && r5_q.ctx == ray_context_i))))
endmodule
