// SPDX-License-Identifier: Apache-2.0
// Leaf unit: reads the record of the leaf a context has arrived at and computes where the ray leaves it.
//
// Purpose     One context a clock: P0 read the goal   P1 -   P2 check, look up   P3 -   P4 read state and ray
//             P5 cache answers   P6 enter rt_leaf_exit. What comes out is kept as how the leaf is left (leave_*, for the result unit) and what is to be
//             tested (references, iter_*). Leaves without references, and contexts that end here, go to the result unit at once (out_*).
// Returns     With Config.leaf_returns the unit knows how near the best hit is (near_*, with every launch). A context that has met a leaf without
//             references, and goes on behind it, goes back to its lane from here (return_*); the result unit would do the same.
// Reads       As much of a record as its size code says; the code is part of the cache's key.
// Misses      Parked in the cache and woken. Retry as in rt_lane.
// Order       Of statuses as in hls/top/trace.cpp: index, kind, t_exit < t, count.
// Two levels  The ray of the level is read. A leaf that a context comes back to goes on with the reference behind the one that sent it away, and is not
//             counted again. The first leaf of an object may be broken: the ray passes the object's root box by, within the tolerance of its entry, and is
//             finished with the object.
// Counterpart arrive_at_leaf in hls/top/trace.cpp. Source: Lee 2007, section 3.
`include "rt_assert.svh"
module rt_leaf_unit #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned Levels = Config.levels,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts),
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               flush_i,
    output logic                               flushing_o,
    input  logic                               hold_i,   // age (rt_context_pipe)
    output logic                               empty_o,
    input  rt_core_pkg::image_view_t           view_i,
    input  logic                               parent_links_i,
    // An axis of a new ray.
    input  logic                               axis_valid_i,
    input  logic [ContextBits-1:0]             axis_context_i,
    input  logic [1:0]                         axis_number_i,
    input  logic                               axis_level_i,
    input  rt_core_pkg::walk_axis_t            axis_i,
    // Arrivals, always accepted.
    input  logic                               in_valid_i,
    input  logic [ContextBits-1:0]             in_context_i,
    input  rt_core_pkg::arrival_t              in_data_i,
    // A context enters an object: how many references of its leaf are done.
    input  logic                               entered_valid_i,
    input  logic [ContextBits-1:0]             entered_context_i,
    input  rt_contract_pkg::triangle_index_t   entered_next_i,
    // Leaves with something to test.
    output logic                               iter_valid_o,
    output logic [ContextBits-1:0]             iter_context_o,
    // References, written before iter_valid_o.
    output logic                               references_valid_o,
    output logic [ContextBits-1:0]             references_context_o,
    output rt_core_pkg::references_t           references_o,
    // How the leaf is left.
    output logic                               leave_valid_o,
    output logic [ContextBits-1:0]             leave_context_o,
    output rt_core_pkg::leave_t                leave_o,
    // A context is launched: what an exit has to lie before.
    input  logic                               near_valid_i,
    input  logic [ContextBits-1:0]             near_context_i,
    input  rt_contract_pkg::t_limit_t          near_i,
    // Contexts that go on from a leaf without references.
    output logic                               return_valid_o,
    input  logic                               return_ready_i,
    output logic [ContextBits-1:0]             return_context_o,
    output rt_core_pkg::launch_t               return_o,
    // Contexts with nothing to test: EventGoOn leaves the leaf, otherwise a status.
    output logic                               out_valid_o,
    input  logic                               out_ready_i,
    output logic [ContextBits-1:0]             out_context_o,
    output rt_contract_pkg::status_t           out_event_o,
    output logic                               fetch_valid_o,
    input  logic                               fetch_ready_i,
    output rt_core_pkg::leaf_key_t             fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0] fetch_mshr_o,
    input  logic                               fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0] fill_mshr_i,
    input  logic [DataBits-1:0]                fill_data_i,
    input  logic                               fill_last_i,
    input  logic                               fill_error_i,
    output rt_core_pkg::unit_events_t          events_o,
    output logic                               leaf_o,
    output logic                               idle_o  // no context is here, no read is in flight
);
  typedef logic [ContextBits-1:0] context_t;
  // What P2 looks up, and what P6 goes on from.
  typedef struct packed {
    logic                         beyond;  // there is no such leaf
    logic [1:0]                   beats;   // of the record that are needed
    rt_core_pkg::leaf_size_t      size;
    rt_contract_pkg::pair_index_t leaf;
  } goal_t;
  typedef struct packed {
    rt_contract_pkg::node_index_t node;
    rt_contract_pkg::t_t          t;
    logic [31:0]                  steps;
  } state_t;
  typedef struct packed {
    context_t                           ctx;
    rt_contract_pkg::status_t           fault;
    logic                               bad_kind;
    logic                               fresh;
    logic                               nothing;  // all references are done
    logic [31:0]                        steps;
    rt_contract_pkg::triangle_index_t   count;
    rt_contract_pkg::node_index_t       node;
    rt_contract_pkg::node_index_t       parent;
    logic [2:0]                         upper;
    rt_contract_pkg::node_index_t [2:0] link;  // of the face the ray could leave through, by axis
    rt_contract_pkg::t_limit_t          t_near;
  } tag_t;

  // --- who is ready, and the stages ---
  localparam int unsigned Stages = 7;
  logic [Stages-1:0]     stage_valid, stage_error, park;
  context_t [Stages-1:0] stage_context;
  logic                  retry, enter_ready, pipe_idle, cache_idle;
  logic                  wake_valid, wake_ready, wake_error;
  context_t              wake_context;
  logic                  in_valid_q;
  context_t              in_context_q;
  rt_context_pipe #(
      .Contexts(Contexts),
      .Stages  (Stages)
  ) u_pipe (
      .clk_i,
      .rst_ni,
      .hold_i,
      .go_i           (enter_ready),
      .empty_o,
      .push_valid_i   (in_valid_q),
      .push_context_i (in_context_q),
      .wake_valid_i   (wake_valid),
      .wake_ready_o   (wake_ready),
      .wake_context_i (wake_context),
      .wake_error_i   (wake_error),
      .stage_valid_o  (stage_valid),
      .stage_context_o(stage_context),
      .stage_error_o  (stage_error),
      .park_i         (park),
      .retry_i        (retry),
      .again_i        (1'b0),
      .idle_o         (pipe_idle)
  );

  // --- P1, P2: what it looks up is there in P2 ---
  logic                     p2_look;
  goal_t                    p1_goal, p2_goal_q;
  rt_contract_pkg::status_t p2_fault;
  always_comb begin
    p2_fault = rt_core_pkg::EventGoOn;
    if (stage_error[2]) p2_fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBusError);
    else if (p2_goal_q.beyond) p2_fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadIndex);
  end
  assign p2_look = stage_valid[2] && p2_fault == rt_core_pkg::EventGoOn;

  rt_core_pkg::leaf_key_t p2_key;
  assign p2_key.leaf  = p2_goal_q.leaf;
  assign p2_key.beats = p2_goal_q.beats;

  // What can be said of an arrival is said before it is stored: a block RAM answers late. Planes, links and kind are always read, the parent where
  // walks climb, and as many references as there are. Refs end at bits 380, 428, 452.
  rt_core_pkg::arrival_t in_data_q;
  goal_t                 in_goal;
  state_t                in_state, p5_state, p6_state_q;
  always_ff @(posedge clk_i) begin
    in_valid_q   <= in_valid_i && rst_ni;
    in_context_q <= in_context_i;
    in_data_q    <= in_data_i;
  end
  always_comb begin
    in_goal.leaf   = in_data_q.leaf;
    in_goal.size   = in_data_q.size;
    in_goal.beyond = 32'(in_data_q.leaf) >= view_i.leaf_count;
    in_goal.beats  = 2'd3;
    if (in_data_q.size <= 3'd4) in_goal.beats = 2'd2;
    if (in_data_q.size <= 3'd2) in_goal.beats = 2'd1;
    if (in_data_q.size == '0 && !parent_links_i) in_goal.beats = 2'd0;
  end
  assign in_state = '{node: in_data_q.node, t: in_data_q.t, steps: in_data_q.steps};

  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(goal_t)
  ) u_arrival_goal (
      .clk_i,
      .rst_ni,
      .write_en_i  (in_valid_q),
      .write_addr_i(in_context_q),
      .write_data_i(in_goal),
      .read_en_i   (stage_valid[0]),
      .read_addr_i (stage_context[0]),
      .read_data_o (p1_goal)
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(state_t)
  ) u_arrival_state (
      .clk_i,
      .rst_ni,
      .write_en_i  (in_valid_q),
      .write_addr_i(in_context_q),
      .write_data_i(in_state),
      .read_en_i   (stage_valid[4]),
      .read_addr_i (stage_context[4]),
      .read_data_o (p5_state)
  );

  // --- two levels: how the context has come here, and how much of the leaf is done ---
  typedef struct packed {
    logic level;
    logic fresh;
    logic resumes;
  } way_t;
  way_t                             p6_way;
  logic                             p4_level;
  rt_contract_pkg::triangle_index_t p6_first;
  if (Levels > 1) begin : gen_way
    way_t                             p3_way, p4_way_q, p5_way_q, p6_way_q;
    rt_contract_pkg::triangle_index_t p5_first, p6_first_q;
    rt_ram_lut #(
        .Depth (Contexts),
        .data_t(way_t)
    ) u_way (
        .clk_i,
        .rst_ni,
        .write_en_i  (in_valid_q),
        .write_addr_i(in_context_q),
        .write_data_i('{level: in_data_q.level, fresh: in_data_q.fresh, resumes: in_data_q.resumes}),
        .read_addr_i (stage_context[3]),
        .read_data_o (p3_way)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_contract_pkg::triangle_index_t)
    ) u_first (
        .clk_i,
        .rst_ni,
        .write_en_i  (entered_valid_i),
        .write_addr_i(entered_context_i),
        .write_data_i(entered_next_i),
        .read_en_i   (stage_valid[4]),
        .read_addr_i (stage_context[4]),
        .read_data_o (p5_first)
    );
    always_ff @(posedge clk_i) begin
      p4_way_q   <= p3_way;
      p5_way_q   <= p4_way_q;
      p6_way_q   <= p5_way_q;
      p6_first_q <= p5_way_q.resumes ? p5_first : '0;
    end
    assign p4_level = p4_way_q.level;
    assign p6_way   = p6_way_q;
    assign p6_first = p6_first_q;
  end else begin : gen_one_way
    assign p4_level = 1'b0;
    assign p6_way   = '0;
    assign p6_first = '0;
  end

  // --- how far the ray goes; it changes in no other place than a launch, as a context is in one place at a time ---
  rt_contract_pkg::t_limit_t p6_near;
  if (Config.leaf_returns != 0) begin : gen_near
    rt_contract_pkg::t_limit_t p5_near, p6_near_q;
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_contract_pkg::t_limit_t)
    ) u_near (
        .clk_i,
        .rst_ni,
        .write_en_i  (near_valid_i),
        .write_addr_i(near_context_i),
        .write_data_i(near_i),
        .read_en_i   (stage_valid[4]),
        .read_addr_i (stage_context[4]),
        .read_data_o (p5_near)
    );
    always_ff @(posedge clk_i) p6_near_q <= p5_near;
    assign p6_near = p6_near_q;
  end else begin : gen_no_near
    assign p6_near = '0;
  end

  // --- P3, P4: on the way; state and ray are there in P5 ---
  rt_core_pkg::leaf_size_t  p3_size_q, p4_size_q;
  rt_contract_pkg::status_t p3_fault_q, p4_fault_q;
  rt_core_pkg::walk_axis_t [rt_core_pkg::Axes-1:0] p5_axes;

  logic                                  p5_look, p5_hit, enter;
  rt_core_pkg::leaf_size_t               p5_size_q;
  rt_contract_pkg::status_t              p5_fault_q;
  rt_contract_pkg::leaf_record_t         p5_leaf;
  rt_contract_pkg::leaf_exit_in_record_t exit_in;
  rt_contract_pkg::leaf_exit_out_record_t exit_out;
  tag_t                                  tag_in, tag_out;
  rt_contract_pkg::triangle_index_t      p6_count;
  logic                                  exit_valid, exit_take;

  rt_cache #(
      .Lines       (Config.leaf_lines),
      .Ways        (Config.ways),
      .KeyBits     ($bits(rt_core_pkg::leaf_key_t)),
      .DataBits    (DataBits),
      .WordBits    (512),
      .WordsPerLine(1),
      .Mshrs       (Config.mshrs),
      .Waiters     (Contexts)
  ) u_cache (
      .clk_i,
      .rst_ni,
      .flush_i,
      .flushing_o,
      .keep_i      (hold_i),
      .req_valid_i (p2_look),
      .req_key_i   (p2_key),
      .req_word_i  (1'b0),
      .req_waiter_i(stage_context[2]),
      .rsp_valid_o (p5_look),
      .rsp_hit_o   (p5_hit),
      .rsp_data_o  (p5_leaf),
      .wake_valid_o (wake_valid),
      .wake_ready_i (wake_ready),
      .wake_waiter_o(wake_context),
      .wake_error_o (wake_error),
      .fetch_valid_o,
      .fetch_ready_i,
      .fetch_key_o,
      .fetch_mshr_o,
      .miss_o      (events_o.miss),
      .fill_valid_i,
      .fill_mshr_i,
      .fill_data_i,
      .fill_last_i,
      .fill_error_i,
      .idle_o      (cache_idle)
  );
  localparam int unsigned RayBits = $clog2(Levels * Contexts);
  rt_ray_ram #(
      .Contexts(Levels * Contexts),
      .axis_t  (rt_core_pkg::walk_axis_t)
  ) u_ray (
      .clk_i,
      .rst_ni,
      .write_en_i     (axis_valid_i),
      .write_context_i(RayBits'({axis_level_i, axis_context_i})),
      .write_axis_i   (axis_number_i),
      .write_data_i   (axis_i),
      .read_en_i      (stage_valid[4]),
      .read_context_i (RayBits'({p4_level, stage_context[4]})),
      .read_data_o    (p5_axes)
  );

  // --- P5: without a look-up there is a fault; after a miss the cache has the context ---
  always_comb begin
    park    = '0;
    park[5] = p5_look && !p5_hit;
  end
  rt_core_pkg::leaf_size_t      p6_size_q;
  rt_contract_pkg::status_t     p6_fault_q;
  rt_contract_pkg::leaf_record_t p6_leaf_q;
  rt_core_pkg::walk_ray_t       p6_ray_q;
  always_ff @(posedge clk_i) begin
    p6_size_q    <= p5_size_q;
    p6_state_q   <= p5_state;
    p6_fault_q   <= p5_fault_q;
    p6_leaf_q    <= p5_leaf;
    p6_ray_q     <= rt_core_pkg::walk_ray_of(p5_axes);
  end

  // --- P6 ---
  logic        p6_instances;
  logic [31:0] p6_steps;
  always_comb begin
    exit_in            = '0;
    exit_in.bound      = p6_leaf_q.bound;
    exit_in.origin     = p6_ray_q.origin;
    exit_in.reciprocal = p6_ray_q.reciprocal;
    exit_in.shift      = p6_ray_q.shift;
    exit_in.zero       = p6_ray_q.zero;
    exit_in.negative   = p6_ray_q.negative;
    exit_in.t          = p6_state_q.t;
    tag_in.ctx     = stage_context[6];
    tag_in.fault       = p6_fault_q;
    tag_in.bad_kind    = p6_leaf_q.kind != rt_contract_pkg::axis_t'(rt_contract_pkg::KindTriangles) && (!p6_instances || p6_way.level);
    tag_in.fresh       = p6_way.fresh;
    tag_in.nothing     = Levels > 1 && p6_count <= p6_first;
    tag_in.steps       = p6_steps;
    tag_in.count       = p6_count;
    tag_in.node        = p6_state_q.node;
    tag_in.parent      = p6_leaf_q.parent;
    tag_in.upper       = ~p6_ray_q.negative;
    tag_in.t_near      = p6_near;
    for (int unsigned axis = 0; axis < 3; axis++) begin
      tag_in.link[axis] = p6_ray_q.negative[axis] ? p6_leaf_q.link[2*axis] : p6_leaf_q.link[2*axis+1];
    end
  end
  // Steps before reference 0: those that were done before the context came back are behind it already.
  assign p6_instances = Levels > 1 && view_i.two_levels && p6_leaf_q.kind == rt_contract_pkg::axis_t'(rt_contract_pkg::KindInstance);
  assign p6_steps     = p6_state_q.steps - 32'(p6_first);
  assign p6_count  = p6_size_q < rt_core_pkg::leaf_size_t'(rt_contract_pkg::LeafLong) ?
                       rt_contract_pkg::triangle_index_t'(p6_size_q) : p6_leaf_q.count;
  assign enter     = stage_valid[6] && enter_ready;
  assign retry     = stage_valid[6] && !enter_ready;

  rt_leaf_exit #(
      .tag_t(tag_t)
  ) u_exit (
      .clk_i,
      .rst_ni,
      .in_valid_i (enter),
      .in_ready_o (enter_ready),
      .in_data_i  (exit_in),
      .in_tag_i   (tag_in),
      .out_valid_o(exit_valid),
      .out_ready_i(exit_take),
      .out_data_o (exit_out),
      .out_tag_o  (tag_out)
  );
  assign references_valid_o   = enter;
  assign references_context_o = stage_context[6];
  assign references_o = '{
          level: p6_way.level,
          instances: p6_instances,
          first: p6_first,
          steps: p6_steps,
          list_base: p6_leaf_q.list_base,
          count: p6_count,
          refs: p6_leaf_q.refs
      };

  // --- what the stage says ---
  rt_contract_pkg::status_t result;
  logic                     at_once;
  always_comb begin
    result = tag_out.fault;
    if (tag_out.fault == rt_core_pkg::EventGoOn) begin
      if (tag_out.bad_kind) result = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRecord);
      else if (exit_out.broken) begin
        result = Levels > 1 && tag_out.fresh ? rt_core_pkg::EventFinish : rt_contract_pkg::status_t'(rt_contract_pkg::StatusInvariant);
      end
    end
    leave_o.exit   = exit_out;
    leave_o.link   = '0;
    // Where no axis exits, face is 0 and the link is not used.
    for (int unsigned axis = 0; axis < 3; axis++) begin
      if (exit_out.face[2:1] == 2'(axis)) leave_o.link = tag_out.link[axis];
    end
    leave_o.parent = tag_out.parent;
    leave_o.node   = tag_out.node;
    // A first leaf that is broken has no tests.
    leave_o.steps  = tag_out.steps + (Levels > 1 && tag_out.fresh && exit_out.broken ? 32'd0 : 32'(tag_out.count));
  end
  assign at_once         = result != rt_core_pkg::EventGoOn || (Levels > 1 ? tag_out.nothing : tag_out.count == '0);
  assign iter_valid_o    = exit_valid && exit_take && !at_once;
  assign iter_context_o  = tag_out.ctx;
  assign leave_valid_o   = exit_valid && exit_take;
  assign leave_context_o = tag_out.ctx;
  // Whatever it is, it leaves the stage only if it could be something for each queue: so the stage need not wait for what it is.
  typedef struct packed {
    context_t                 ctx;
    rt_contract_pkg::status_t event_code;
  } direct_t;
  direct_t out_data;
  logic    out_room, return_room, returns;
  assign exit_take = out_room && return_room;
  rt_queue #(
      .Depth (4),
      .data_t(direct_t)
  ) u_out (
      .clk_i,
      .rst_ni,
      .in_valid_i (exit_valid && exit_take && at_once && !returns),
      .in_ready_o (out_room),
      .in_data_i  ('{ctx: tag_out.ctx, event_code: result}),
      .out_valid_o,
      .out_ready_i,
      .out_data_o (out_data)
  );
  if (Config.leaf_returns != 0) begin : gen_returns
    typedef struct packed {
      context_t                     ctx;
      rt_core_pkg::leave_t          leave;
      rt_contract_pkg::node_index_t target;
      rt_contract_pkg::t_limit_t    t_near;
    } return_t;
    return_t return_in, return_out;
    always_comb begin
      return_in.ctx    = tag_out.ctx;
      return_in.leave  = leave_o;
      return_in.target = parent_links_i ? leave_o.node : leave_o.link;
      return_in.t_near = tag_out.t_near;
      // The rule of the result unit: where to go, and nothing behind the exit is beyond the best hit.
      returns = result == rt_core_pkg::EventGoOn && tag_out.count == '0 && exit_out.exits[0] && return_in.target != '0 &&
          signed'({2'b0, tag_out.t_near}) > signed'({exit_out.t_exit[27], exit_out.t_exit});
      return_o        = '0;
      return_o.plane  = return_out.leave.exit.plane;
      return_o.face   = return_out.leave.exit.face;
      return_o.t      = return_out.leave.exit.t_exit;
      return_o.steps  = return_out.leave.steps;
      return_o.fault  = rt_core_pkg::EventGoOn;
      return_o.up     = parent_links_i;
      return_o.parent = return_out.leave.parent;
      return_o.node   = return_out.target;
      return_o.t_near = return_out.t_near;
    end
    rt_queue #(
        .Depth (4),
        .data_t(return_t)
    ) u_returns (
        .clk_i,
        .rst_ni,
        .in_valid_i (exit_valid && exit_take && returns),
        .in_ready_o (return_room),
        .in_data_i  (return_in),
        .out_valid_o(return_valid_o),
        .out_ready_i(return_ready_i),
        .out_data_o (return_out)
    );
    assign return_context_o = return_out.ctx;
  end else begin : gen_no_returns
    assign returns          = 1'b0;
    assign return_room      = 1'b1;
    assign return_valid_o   = 1'b0;
    assign return_context_o = '0;
    assign return_o         = '0;
  end
  assign out_context_o = out_data.ctx;
  assign out_event_o   = out_data.event_code;

  always_ff @(posedge clk_i) begin
    p2_goal_q  <= p1_goal;
    p3_size_q  <= p2_goal_q.size;
    p3_fault_q <= p2_fault;
    p4_size_q  <= p3_size_q;
    p4_fault_q <= p3_fault_q;
    p5_size_q  <= p4_size_q;
    p5_fault_q <= p4_fault_q;
  end

  assign events_o.hit     = p5_look && p5_hit;
  assign events_o.busy    = enter;
  assign events_o.starved = !stage_valid[0];
  assign leaf_o           = enter && p6_fault_q == rt_core_pkg::EventGoOn && !p6_way.resumes;

  assign idle_o           = pipe_idle && cache_idle && !in_valid_i && !in_valid_q && !exit_valid && !out_valid_o && !return_valid_o;

  // The face belongs to the side the ray moves to, so the three links kept are enough.
  `RT_ASSERT(FaceIsOnExitSide, !exit_valid || !exit_out.exits || exit_out.face[0] == tag_out.upper[exit_out.face[2:1]])
endmodule
