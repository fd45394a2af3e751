// SPDX-License-Identifier: Apache-2.0
// Lane of traversal: one step down or up for one of its contexts in every clock.
//
// Purpose     A context belongs to one lane for the whole of its ray. Those that can go on stand in queues (rt_ready); each clock one of them
//             leaves its queue and goes through
//               S0 read the goal   S1 look up the node pair   S2 -   S3 read the state   S4 cache answers   S5 checks; enter rt_kd_descend / rt_kd_backtrack
//             and is ready again when the stage's result has been written to its state. At a leaf, or when it ends, it leaves through out_*.
// Node cache  One for all lanes, with a port for each (rt_core): a context that misses is parked there; the lane goes on with others.
// Retry       Where S5 cannot pass its context on (the stage or the queue is full), the context just becomes ready again: nothing of it
//             has changed. So nothing in the lane ever stalls. While the queue of arrivals is full nobody looks up.
// Launch      launch_* puts a context into a state and makes it ready: a new ray, or a return from its leaf. Always accepted; results of the
//             stages wait meanwhile, as there is one memory of states.
// Statuses    As hls/top/trace.cpp orders them: step limit, then index, then what was read. A context's limit and index are checked before its
//             state is written, so that nothing but the look-up stands behind reading it.
// Two levels  A launch names the tree: the ray of its level is read, a climb ends at its root, and a context that is back from an object must find the
//             leaf that it left.
// Counterpart step_down, step_up in hls/top/trace.cpp. Source: Lee 2007, section 3.
`include "rt_assert.svh"
module rt_lane #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned Levels = Config.levels,
    localparam int unsigned Contexts = Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               hold_i,   // age (rt_context_pipe)
    output logic                               empty_o,
    input  rt_core_pkg::image_view_t           view_i,
    // An axis of a new ray; all of them are there when it is launched.
    input  logic                               axis_valid_i,
    input  logic [ContextBits-1:0]             axis_context_i,
    input  logic [1:0]                         axis_number_i,
    input  logic                               axis_level_i,
    input  rt_core_pkg::walk_axis_t            axis_i,
    // Where a context goes on.
    input  logic                               launch_valid_i,
    input  logic [ContextBits-1:0]             launch_context_i,
    input  rt_core_pkg::launch_t               launch_i,
    // Contexts that have arrived at a leaf or end.
    output logic                               out_valid_o,
    input  logic                               out_ready_i,
    output logic [ContextBits-1:0]             out_context_o,
    output rt_core_pkg::arrival_t              out_data_o,
    // Node cache.
    output logic                               look_valid_o,
    output rt_contract_pkg::pair_index_t       look_pair_o,
    output logic [ContextBits-1:0]             look_context_o,
    input  logic                               look_valid_i,  // three clocks later
    input  logic                               look_hit_i,
    input  logic [127:0]                       look_data_i,
    input  logic                               wake_valid_i,
    output logic                               wake_ready_o,
    input  logic [ContextBits-1:0]             wake_context_i,
    input  logic                               wake_error_i,
    // Counters.
    output rt_core_pkg::unit_events_t          events_o,
    output logic                               down_o,
    output logic                               up_o,
    output logic                               idle_o  // no context is here
);
  typedef logic [ContextBits-1:0] context_t;
  logic pipe_idle;
  // Written by launches and by every step: what S1 looks up, and what S5 goes on from.
  typedef struct packed {
    rt_contract_pkg::status_t     event_code;  // not EventGoOn: what the context ends with
    rt_contract_pkg::pair_index_t pair;        // to look up: of `parent` on the way up, otherwise of `node`
  } goal_t;
  typedef struct packed {
    logic [31:0]                  steps;
    logic                         up;
    rt_contract_pkg::node_index_t parent;
    rt_contract_pkg::node_index_t node;
  } state_t;
  // Written by launches only.
  typedef struct packed {
    rt_contract_pkg::position_t plane;
    rt_contract_pkg::face_t     face;
    rt_contract_pkg::t_t        t;
  } segment_t;
  // What the next step will find: the limit of steps, or a pair beyond the image.
  typedef struct packed {
    context_t    ctx;
    logic [31:0] steps;
    logic        at_limit;
    logic        child_beyond;
  } descend_tag_t;
  typedef struct packed {
    context_t                     ctx;
    logic [31:0]                  steps;
    logic                         at_limit;
    logic                         child_beyond;
    logic                         grandparent_beyond;
    logic                         at_root;  // `parent` is the root of an object's tree, or of the only one
    rt_contract_pkg::node_index_t grandparent;
  } backtrack_tag_t;

  function automatic rt_contract_pkg::status_t event_of(rt_contract_pkg::status_t fault, logic at_limit, logic beyond);
    if (fault != rt_core_pkg::EventGoOn) return fault;
    if (at_limit) return rt_contract_pkg::status_t'(rt_contract_pkg::StatusStepLimit);
    if (beyond) return rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadIndex);
    return rt_core_pkg::EventGoOn;
  endfunction
  function automatic logic is_beyond(rt_contract_pkg::pair_index_t pair, logic [31:0] count);
    return 32'(pair) >= count;
  endfunction

  // --- who is ready, and the stages ---
  localparam int unsigned Stages = 6;
  logic [Stages-1:0]     stage_valid, stage_error, park;
  context_t [Stages-1:0] stage_context;
  logic                  state_write_en_q, retry, out_ready;
  context_t              state_context_q;
  rt_context_pipe #(
      .Contexts(Contexts),
      .Stages  (Stages)
  ) u_pipe (
      .clk_i,
      .rst_ni,
      .hold_i,
      .go_i           (out_ready),
      .empty_o,
      .push_valid_i   (state_write_en_q),
      .push_context_i (state_context_q),
      .wake_valid_i,
      .wake_ready_o,
      .wake_context_i,
      .wake_error_i,
      .stage_valid_o  (stage_valid),
      .stage_context_o(stage_context),
      .stage_error_o  (stage_error),
      .park_i         (park),
      .retry_i        (retry),
      .again_i        (1'b0),
      .idle_o         (pipe_idle)
  );

  // --- S1: what it looks up is there ---
  goal_t                       s0_goal, s1_goal_q;
  rt_contract_pkg::status_t    s1_event;
  logic                        s1_look;

  // Whoever had a look-up that met an error was going on before it.
  always_comb begin
    s1_event = s1_goal_q.event_code;
    if (stage_error[1] && s1_goal_q.event_code == rt_core_pkg::EventGoOn) s1_event = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBusError);
  end
  assign s1_look = stage_valid[1] && s1_event == rt_core_pkg::EventGoOn;

  // --- S2, S3, S4: on the way; state, ray and segment are there in S4, where the cache answers ---
  state_t                   s3_state, s4_state_q;
  rt_contract_pkg::status_t s2_event_q, s3_event_q, s4_event_q;
  rt_core_pkg::walk_axis_t [rt_core_pkg::Axes-1:0] s4_axes;
  rt_core_pkg::walk_ray_t   s4_ray;
  segment_t                 s4_segment;

  assign look_valid_o   = s1_look;
  assign look_pair_o    = s1_goal_q.pair;
  assign look_context_o = stage_context[1];

  // --- S5: on to the stages ---
  logic                              s5_look_q, s5_hit_q, s5_valid;
  state_t                            s5_state_q;
  rt_contract_pkg::status_t          s5_event_q;
  rt_contract_pkg::node_pair_record_t s5_pair_q;
  rt_core_pkg::walk_ray_t            s5_ray_q;
  segment_t                          s5_segment_q;
  logic                              s5_right, s5_at_leaf, s5_out, s5_down, s5_up;
  rt_contract_pkg::position_t        s5_split;
  rt_contract_pkg::axis_t            s5_axis;
  rt_contract_pkg::pair_index_t      s5_child;
  logic [31:0]                       s4_steps_q, s5_steps_q;  // with this one
  rt_core_pkg::leaf_size_t           s5_size;
  rt_core_pkg::tree_t                s3_tree_q, s5_tree_q;
  logic                              s5_at_root_q, s5_ended;
  logic                              s5_at_limit_q, s5_child_beyond, s5_grandparent_beyond;

  // Without a look-up there is an event; after a miss the cache has the context.
  assign s5_valid   = stage_valid[5] && !park[5];
  always_comb begin
    park    = '0;
    park[5] = s5_look_q && !s5_hit_q;
  end
  assign s5_right   = s5_state_q.up ? s5_state_q.parent[0] : s5_state_q.node[0];
  assign s5_split   = s5_right ? s5_pair_q.right_split : s5_pair_q.left_split;
  assign s5_axis    = s5_right ? s5_pair_q.right_axis : s5_pair_q.left_axis;
  assign s5_child   = s5_right ? s5_pair_q.right_child : s5_pair_q.left_child;
  assign s5_size    = unsigned'(s5_split) < rt_contract_pkg::PositionBits'(rt_contract_pkg::LeafLong) ?
                        rt_core_pkg::leaf_size_t'(s5_split) : rt_core_pkg::leaf_size_t'(rt_contract_pkg::LeafLong);
  assign s5_child_beyond       = is_beyond(s5_child, view_i.pair_count);
  assign s5_grandparent_beyond = is_beyond(s5_pair_q.parent[23:1], view_i.pair_count);
  assign s5_at_leaf = s5_axis == rt_contract_pkg::AxisLeaf;
  assign s5_ended   = s5_event_q != rt_core_pkg::EventGoOn;
  assign s5_out     = s5_valid && (s5_ended || (!s5_state_q.up && (s5_at_leaf || s5_tree_q.resumes)));
  assign s5_up      = s5_valid && !s5_out && s5_state_q.up;
  assign s5_down    = s5_valid && !s5_out && !s5_state_q.up;

  // Stages: entered only when they are ready, replayed otherwise.
  rt_contract_pkg::kd_descend_in_record_t   descend_in;
  rt_contract_pkg::kd_descend_out_record_t  descend_out;
  rt_contract_pkg::kd_backtrack_in_record_t backtrack_in;
  rt_contract_pkg::kd_backtrack_out_record_t backtrack_out;
  descend_tag_t   descend_tag;
  backtrack_tag_t backtrack_tag;
  logic descend_ready, descend_enter, descend_valid, descend_take;
  logic backtrack_ready, backtrack_enter, backtrack_valid, backtrack_take;

  always_comb begin
    descend_in       = '0;
    descend_in.split = s5_split;
    descend_in.child = s5_child;
    descend_in.t     = s5_segment_q.t;
    for (int unsigned axis = 0; axis < 3; axis++) begin
      if (s5_axis == 2'(axis)) begin
        descend_in.origin     = s5_ray_q.origin[axis];
        descend_in.reciprocal = s5_ray_q.reciprocal[axis];
        descend_in.shift      = s5_ray_q.shift[axis];
        descend_in.zero       = s5_ray_q.zero[axis];
        descend_in.negative   = s5_ray_q.negative[axis];
      end
    end
    backtrack_in              = '0;
    backtrack_in.face         = s5_segment_q.face;
    backtrack_in.plane        = s5_segment_q.plane;
    backtrack_in.node         = s5_state_q.node;
    backtrack_in.parent       = s5_state_q.parent;
    backtrack_in.parent_split = s5_split;
    backtrack_in.parent_axis  = s5_axis;
    backtrack_in.parent_child = s5_child;
  end
  assign descend_enter   = s5_down && descend_ready;
  assign backtrack_enter = s5_up && backtrack_ready;
  assign retry = (s5_down && !descend_ready) || (s5_up && !backtrack_ready) || (s5_out && !out_ready);

  rt_kd_descend #(
      .tag_t(descend_tag_t)
  ) u_descend (
      .clk_i,
      .rst_ni,
      .in_valid_i (descend_enter),
      .in_ready_o (descend_ready),
      .in_data_i  (descend_in),
      .in_tag_i   ('{ctx: stage_context[5], steps: s5_steps_q, at_limit: s5_at_limit_q, child_beyond: s5_child_beyond}),
      .out_valid_o(descend_valid),
      .out_ready_i(descend_take),
      .out_data_o (descend_out),
      .out_tag_o  (descend_tag)
  );

  rt_kd_backtrack #(
      .tag_t(backtrack_tag_t)
  ) u_backtrack (
      .clk_i,
      .rst_ni,
      .in_valid_i (backtrack_enter),
      .in_ready_o (backtrack_ready),
      .in_data_i  (backtrack_in),
      .in_tag_i   ('{
          ctx: stage_context[5],
          steps: s5_steps_q,
          at_limit: s5_at_limit_q,
          child_beyond: s5_child_beyond,
          grandparent_beyond: s5_grandparent_beyond,
          at_root: s5_at_root_q,
          grandparent: s5_pair_q.parent
      }),
      .out_valid_o(backtrack_valid),
      .out_ready_i(backtrack_take),
      .out_data_o (backtrack_out),
      .out_tag_o  (backtrack_tag)
  );

  typedef struct packed {
    context_t              ctx;
    rt_core_pkg::arrival_t arrival;
  } out_t;
  out_t out_in, out_data;
  always_comb begin
    out_in.ctx                = stage_context[5];
    out_in.arrival.event_code = s5_event_q;
    out_in.arrival.leaf       = s5_child;
    out_in.arrival.size       = s5_size;
    out_in.arrival.node       = s5_state_q.node;
    out_in.arrival.t          = s5_segment_q.t;
    out_in.arrival.steps      = s5_steps_q;
    out_in.arrival.level      = s5_tree_q.level;
    out_in.arrival.fresh      = s5_tree_q.fresh;
    out_in.arrival.resumes    = s5_tree_q.resumes;
    if (Levels > 1) begin
      // The memory has changed under the ray.
      if (!s5_ended && !s5_at_leaf) out_in.arrival.event_code = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRecord);
      if (s5_event_q == rt_core_pkg::EventFinish) out_in.arrival.steps = s5_state_q.steps;
    end
  end
  rt_queue #(
      .Depth (4),
      .data_t(out_t)
  ) u_out (
      .clk_i,
      .rst_ni,
      .in_valid_i (s5_out && out_ready),
      .in_ready_o (out_ready),
      .in_data_i  (out_in),
      .out_valid_o,
      .out_ready_i,
      .out_data_o (out_data)
  );
  assign out_context_o = out_data.ctx;
  assign out_data_o    = out_data.arrival;

  // --- state: what a launch says, what a step leaves, on the way up first; the others wait. Through a register ---
  rt_contract_pkg::pair_index_t launch_pair;
  state_t                       launch_state;
  goal_t                        launch_goal;
  assign launch_pair = launch_i.up ? launch_i.parent[23:1] : launch_i.node[23:1];
  assign launch_goal = '{
          event_code: event_of(launch_i.fault, launch_i.steps >= view_i.step_limit, is_beyond(launch_pair, view_i.pair_count)),
          pair: launch_pair
      };
  assign launch_state = '{steps: launch_i.steps, up: launch_i.up, parent: launch_i.parent, node: launch_i.node};
  state_t                   state_write, state_write_q;
  goal_t                    goal_write, goal_write_q;
  context_t                 state_context;
  rt_contract_pkg::status_t backtrack_fault;
  assign backtrack_take = !launch_valid_i;
  assign descend_take   = !launch_valid_i && !backtrack_valid;
  always_ff @(posedge clk_i) begin
    state_write_en_q <= (launch_valid_i || backtrack_valid || descend_valid) && rst_ni;
    state_context_q  <= state_context;
    state_write_q    <= state_write;
    goal_write_q     <= goal_write;
  end
  always_comb begin
    backtrack_fault = rt_core_pkg::EventGoOn;
    if (backtrack_out.bad) backtrack_fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRecord);
    else if (Levels > 1 ? !backtrack_out.matched && backtrack_tag.at_root : backtrack_out.finished) backtrack_fault = rt_core_pkg::EventFinish;
    state_context = descend_tag.ctx;
    state_write   = '{steps: descend_tag.steps, up: 1'b0, parent: '0, node: descend_out.node};
    goal_write    = '{event_code: event_of(rt_core_pkg::EventGoOn, descend_tag.at_limit, descend_tag.child_beyond), pair: descend_out.node[23:1]};
    if (backtrack_valid) begin
      state_context = backtrack_tag.ctx;
      state_write   = '{steps: backtrack_tag.steps, up: !backtrack_out.matched, parent: backtrack_tag.grandparent, node: backtrack_out.node};
      goal_write    = '{
              event_code: event_of(
              backtrack_fault,
              backtrack_tag.at_limit,
              backtrack_out.matched ? backtrack_tag.child_beyond : backtrack_tag.grandparent_beyond
              ),
              pair: backtrack_out.matched ? backtrack_out.node[23:1] : backtrack_tag.grandparent[23:1]
          };
    end
    if (launch_valid_i) begin
      state_context = launch_context_i;
      state_write   = launch_state;
      goal_write    = launch_goal;
    end
  end

  rt_ram_lut #(
      .Depth (Contexts),
      .data_t(goal_t)
  ) u_goal (
      .clk_i,
      .rst_ni,
      .write_en_i  (state_write_en_q),
      .write_addr_i(state_context_q),
      .write_data_i(goal_write_q),
      .read_addr_i (stage_context[0]),
      .read_data_o (s0_goal)
  );
  rt_ram_lut #(
      .Depth (Contexts),
      .data_t(state_t)
  ) u_state (
      .clk_i,
      .rst_ni,
      .write_en_i  (state_write_en_q),
      .write_addr_i(state_context_q),
      .write_data_i(state_write_q),
      .read_addr_i (stage_context[3]),
      .read_data_o (s3_state)
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(segment_t)
  ) u_segment (
      .clk_i,
      .rst_ni,
      .write_en_i  (launch_valid_i),
      .write_addr_i(launch_context_i),
      .write_data_i('{plane: launch_i.plane, face: launch_i.face, t: launch_i.t}),
      .read_en_i   (stage_valid[3]),
      .read_addr_i (stage_context[3]),
      .read_data_o (s4_segment)
  );
  // The object's ray beside the world's.
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
      .read_en_i      (stage_valid[3]),
      .read_context_i (RayBits'({s3_tree_q.level, stage_context[3]})),
      .read_data_o    (s4_axes)
  );
  assign s4_ray = rt_core_pkg::walk_ray_of(s4_axes);

  // --- which tree; written by launches only ---
  if (Levels > 1) begin : gen_tree
    rt_core_pkg::tree_t s2_tree, s4_tree_q;
    rt_ram_lut #(
        .Depth (Contexts),
        .data_t(rt_core_pkg::tree_t)
    ) u_tree (
        .clk_i,
        .rst_ni,
        .write_en_i  (launch_valid_i),
        .write_addr_i(launch_context_i),
        .write_data_i(launch_i.tree),
        .read_addr_i (stage_context[2]),
        .read_data_o (s2_tree)
    );
    always_ff @(posedge clk_i) begin
      s3_tree_q    <= s2_tree;
      s4_tree_q    <= s3_tree_q;
      s5_tree_q    <= s4_tree_q;
      s5_at_root_q <= s4_state_q.parent == {s4_tree_q.root, 1'b0};
    end
  end else begin : gen_one_tree
    assign s3_tree_q    = '0;
    assign s5_tree_q    = '0;
    assign s5_at_root_q = 1'b0;
  end

  always_ff @(posedge clk_i) begin
    s1_goal_q    <= s0_goal;
    s2_event_q   <= s1_event;
    s3_event_q   <= s2_event_q;
    s4_state_q   <= s3_state;
    s4_event_q   <= s3_event_q;
    s5_look_q    <= look_valid_i;
    s5_hit_q     <= look_hit_i;
    s5_pair_q    <= look_data_i;
    s5_state_q   <= s4_state_q;
    s5_steps_q   <= s4_steps_q;
    s5_at_limit_q <= s4_steps_q >= view_i.step_limit;
    s4_steps_q   <= s3_state.steps + 32'd1;
    s5_event_q   <= s4_event_q;
    s5_ray_q     <= s4_ray;
    s5_segment_q <= s4_segment;
  end

  assign events_o.hit     = s5_look_q && s5_hit_q;
  assign events_o.miss    = 1'b0;  // counted where lines are fetched
  assign events_o.busy    = s5_valid && !retry;
  assign events_o.starved = !stage_valid[0];
  assign down_o           = descend_enter;
  assign up_o             = backtrack_enter;
  assign idle_o           = pipe_idle && !descend_valid && !backtrack_valid && !out_valid_o && !launch_valid_i;
endmodule
