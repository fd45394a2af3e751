// SPDX-License-Identifier: Apache-2.0
// Core: rays in, hits out, one memory port. Knows neither where rays come from nor where hits go; AXI, registers and soft reset are in rt_top.
//
//   rays --> rt_launch --launch--> lanes (rt_lane x N) --arrival--> rt_leaf_unit --> rt_reference_unit --> rt_tri_test --> rt_result_unit
//                                   ^                                  |                                                   |   |
//                                   |                                  +---- leaves without references, faults -----------+   |
//                                   +------------------------------ return ----------------------------------------------------+
//   rt_result_unit --finish--> rt_hit_finish --> hits
//   with Config.leaf_returns: rt_leaf_unit --return--> lanes, from leaves without references
//   of two levels: rt_reference_unit --instance--> rt_entry --launch--> lanes; passed by: back to rt_reference_unit, or --> rt_result_unit
//
// Reset       Each unit has a register of it, so a start counts from the second clock after it.
// Run         start_i with run_i -> rays_start_o, from then on rays are taken -> sources_done_i and every ray has retired: drained_o -> sinks_done_i: done.
// Streams     rays with a tag in, hits with the same tag out, in any order.
// Memory      Requests and the beats of their answers; answers are always taken, in any order between {source, mshr}.
// Deadlock    Whoever holds a context has a place reserved wherever it can go: a word in a state RAM, and in each queue or list as many places as there are
//             contexts. Answers of the memory are taken in every clock. A ray is taken only into a free context, and a context is freed when its hit has a
//             place in the finish queue. So the only stream that can be held up is that of the hits, by their sink; a sink must not wait
//             for a ray to be taken (docs/core.md).
// Two levels  With Config.levels = 2 units keep the object's ray of a context beside the world's; with 1 nothing of it is there. With 2 and pixels the
//             unit that makes an object's ray also makes those of a camera (camera_*, made_*), in order.
// Counterpart hls/top/trace.cpp. Source: Lee 2007, section 4.
`include "rt_assert.svh"
module rt_core #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,
    input  logic                          start_i,
    input  rt_core_pkg::run_t             run_i,
    output rt_core_pkg::run_status_t      status_o,
    output logic                          rays_start_o,
    input  logic                          sources_done_i,
    output rt_contract_pkg::position_t [5:0] box_o,  // of the image, from rays_start_o on
    output logic                          drained_o,
    input  logic                          sinks_done_i,
    input  logic                          ray_valid_i,
    output logic                          ray_ready_o,
    input  rt_core_pkg::tagged_ray_t      ray_i,
    output logic                          hit_valid_o,
    input  logic                          hit_ready_i,
    output rt_core_pkg::tagged_hit_t      hit_o,
    output rt_contract_pkg::triangle_index_t hit_number_o,  // of the instance that is hit; 0 where there is none
    input  logic                          camera_valid_i,
    output logic                          camera_ready_o,
    input  rt_core_pkg::camera_ray_t      camera_i,
    output logic                          made_valid_o,
    input  logic                          made_ready_i,
    output rt_core_pkg::made_ray_t        made_o,
    output logic                          read_valid_o,
    input  logic                          read_ready_i,
    output rt_core_pkg::read_request_t    read_o,
    input  rt_core_pkg::fill_t            fill_i,
    input  logic [DataBits-1:0]           fill_data_i,
    output rt_config_pkg::counter_steps_t steps_o  // those of the shell are 0
);
  localparam int unsigned Lanes = Config.lanes;
  localparam int unsigned Levels = Config.levels;
  localparam int unsigned Contexts = Lanes * Config.contexts_per_lane;
  localparam int unsigned ContextBits = $clog2(Contexts);
  localparam int unsigned LaneContextBits = $clog2(Config.contexts_per_lane);
  `RT_ASSERT_INIT(LanesKnown, Lanes >= 1 && Lanes <= 8)
  `RT_ASSERT_INIT(ContextsPowerOfTwo, Config.contexts_per_lane == (1 << LaneContextBits))
  `RT_ASSERT_INIT(ContextsFit, Contexts <= 512)
  `RT_ASSERT_INIT(LevelsKnown, Levels == 1 || Levels == 2)
  `RT_ASSERT_INIT(LeafReturnsOfOneLevel, Config.leaf_returns == 0 || (Config.leaf_returns == 1 && Levels == 1))
  `RT_ASSERT_INIT(ContextsOfLevelsFit, Levels == 1 || Contexts <= 128)
  `RT_ASSERT_INIT(DataBitsKnown, DataBits == 64 || DataBits == 128)
  `RT_ASSERT_INIT(GranuleKnown, (Config.granule_bytes == 8 || Config.granule_bytes == 16 || Config.granule_bytes == 64) && Config.granule_bytes * 8 >= DataBits)
  typedef logic [ContextBits-1:0] context_t;
  typedef rt_contract_pkg::status_t status_t;

  // A reset for each unit.
  localparam int unsigned ResetWires = 0;  // what stands between the units
  localparam int unsigned ResetRequests = 1;
  localparam int unsigned ResetControl = 2;
  localparam int unsigned ResetRays = 3;
  localparam int unsigned ResetNodes = 4;
  localparam int unsigned ResetLeaves = 5;
  localparam int unsigned ResetReferences = 6;
  localparam int unsigned ResetTests = 7;
  localparam int unsigned ResetResults = 8;
  localparam int unsigned ResetFinish = 9;
  localparam int unsigned ResetEntry = 10;
  localparam int unsigned ResetLane = 10 + Levels - 1;
  logic [ResetLane+Lanes-1:0] rst_n;
  logic                       wires_rst_n;
  rt_copies #(
      .Copies(ResetLane + Lanes),
      .Start (1'b0)
  ) u_resets (
      .clk_i,
      .data_i(rst_ni),
      .data_o(rst_n)
  );
  assign wires_rst_n = rst_n[ResetWires];

  // Answers of the memory, on their way from unit to unit: the header and nodes, then leaves, then lists and triangles.
  typedef struct packed {
    rt_core_pkg::fill_t  info;
    logic [DataBits-1:0] data;
  } fill_t;
  localparam int unsigned FillPlaces = 3;
  localparam int unsigned Near = 1;
  localparam int unsigned Leaf = 2;
  localparam int unsigned Far = 3;
  logic [FillPlaces:0][rt_config_pkg::Sources-1:0] fill_valid;
  fill_t                                           fill[FillPlaces+1];
  assign fill_valid[0] = fill_i.valid;
  assign fill[0]       = '{info: fill_i, data: fill_data_i};
  for (genvar i = 0; i < int'(FillPlaces); i++) begin : gen_fill
    rt_hop #(
        .Depth (Config.fill_hops),
        .Valids(rt_config_pkg::Sources),
        .data_t(fill_t)
    ) u_hop (
        .clk_i,
        .rst_ni (wires_rst_n),
        .valid_i(fill_valid[i]),
        .data_i (fill[i]),
        .valid_o(fill_valid[i+1]),
        .data_o (fill[i+1])
    );
  end

  rt_core_pkg::image_view_t view;
  // The box in which a ray has to begin.
  rt_contract_pkg::position_t [5:0] launch_box;
  localparam rt_contract_pkg::position_t LowestPosition = {1'b1, (rt_contract_pkg::PositionBits - 1)'(0)};
  assign launch_box = run_i.any_origin ? {3{~LowestPosition, LowestPosition}} : view.box;
  assign box_o      = view.box;
  logic                     flush;
  logic [2:0]               unit_flush, flushing;  // nodes, leaves, lists and triangles
  rt_copies #(
      .Copies(3)
  ) u_flushes (
      .clk_i,
      .data_i(flush),
      .data_o(unit_flush)
  );

  localparam int unsigned ReadIndexBits = $clog2(rt_config_pkg::CoreSources);
  logic [ReadIndexBits-1:0] read_index_unused;

  // --- read requests: one round-robin choice of all units, which have a register each, behind the sum that is the address; another behind it ---
  logic                       chosen_read_valid, chosen_read_ready;
  rt_core_pkg::read_request_t chosen_read;
  localparam int unsigned Sources = rt_config_pkg::CoreSources;
  logic [Sources-1:0]         source_valid, source_ready, waiting_valid, waiting_ready;
  rt_core_pkg::read_request_t source_request[Sources], waiting_request[Sources];
  for (genvar s = 0; s < int'(Sources); s++) begin : gen_request
    // Only nodes are read in as little as a clock; what others read keeps the bus for several.
    rt_skid #(
        .HalfRate(s != rt_config_pkg::SourceNode),
        .data_t  (rt_core_pkg::read_request_t)
    ) u_skid (
        .clk_i,
        .rst_ni     (rst_n[ResetRequests]),
        .in_valid_i (source_valid[s]),
        .in_ready_o (source_ready[s]),
        .in_data_i  (source_request[s]),
        .out_valid_o(waiting_valid[s]),
        .out_ready_i(waiting_ready[s]),
        .out_data_o (waiting_request[s])
    );
  end
  rt_arbiter #(
      .NumInputs(Sources),
      .data_t   (rt_core_pkg::read_request_t)
  ) u_read_arbiter (
      .clk_i,
      .rst_ni     (rst_n[ResetRequests]),
      .in_valid_i (waiting_valid),
      .in_ready_o (waiting_ready),
      .in_data_i  (waiting_request),
      .in_last_i  ('1),
      .out_valid_o(chosen_read_valid),
      .out_ready_i(chosen_read_ready),
      .out_data_o (chosen_read),
      .out_index_o(read_index_unused)
  );
  rt_skid #(
      .data_t(rt_core_pkg::read_request_t)
  ) u_read_skid (
      .clk_i,
      .rst_ni     (rst_n[ResetRequests]),
      .in_valid_i (chosen_read_valid),
      .in_ready_o (chosen_read_ready),
      .in_data_i  (chosen_read),
      .out_valid_o(read_valid_o),
      .out_ready_i(read_ready_i),
      .out_data_o (read_o)
  );
  function automatic rt_core_pkg::read_request_t request(logic [rt_core_pkg::AddrBits-1:0] base, logic [29:0] offset,
                                                         int unsigned bytes, int unsigned source,
                                                         logic [rt_core_pkg::MshrIdBits-1:0] mshr);
    request.addr   = base + rt_core_pkg::AddrBits'(offset);
    request.len    = 8'(rt_core_pkg::read_bytes(bytes, Config.granule_bytes) * 8 / DataBits - 1);
    request.source = rt_core_pkg::SourceBits'(source);
    request.mshr   = mshr;
  endfunction

  // What the host sets before the start, once more on its way.
  logic parent_links_q, mailbox_q;
  always_ff @(posedge clk_i) begin
    parent_links_q <= run_i.parent_links;
    mailbox_q      <= run_i.use_mailbox;
  end

  // --- control ---
  rt_core_pkg::unit_events_t lane_events[Lanes];
  rt_core_pkg::unit_events_t leaf_events, reference_events, result_events;
  logic                      ray_taken, hit_taken, hit_fault, rays_open;
  assign ray_taken = ray_valid_i && ray_ready_o;
  assign hit_taken = hit_valid_o && hit_ready_i;
  assign hit_fault = hit_taken && hit_o.hit.status > status_t'(rt_contract_pkg::StatusHit);

  rt_control #(
      .DataBits(DataBits),
      .Levels  (Levels),
      .InFlight(Contexts + 64)  // what rt_ray_setup, the finish queue and rt_hit_finish hold beside
  ) u_control (
      .clk_i,
      .rst_ni       (rst_n[ResetControl]),
      .start_i,
      .run_i,
      .status_o,
      .fetch_valid_o(source_valid[rt_config_pkg::SourceHeader]),
      .fetch_ready_i(source_ready[rt_config_pkg::SourceHeader]),
      .fetch_o      (source_request[rt_config_pkg::SourceHeader]),
      .fill_valid_i (fill_valid[Near][rt_config_pkg::SourceHeader]),
      .fill_data_i  (fill[Near].data),
      .fill_last_i  (fill[Near].info.last),
      .fill_error_i (fill[Near].info.error),
      .view_o       (view),
      .flush_o      (flush),
      .flushing_i   (flushing != '0),
      .rays_start_o,
      .rays_open_o  (rays_open),
      .sources_done_i,
      .drained_o,
      .sinks_done_i,
      .ray_taken_i  (ray_taken),
      .hit_taken_i  (hit_taken),
      .hit_fault_i  (hit_fault),
      .hit_i        (hit_o)
  );

  // --- rays ---
  logic                    ray_valid, ray_ready, ray_go, free_valid;
  context_t                ray_context, free_context;
  rt_core_pkg::launch_t    ray_launch;
  logic                    axis_valid;
  rt_core_pkg::ray_axis_t  axis;
  rt_core_pkg::ray_info_t  ray_info;
  logic [ContextBits:0]    contexts_used;

  logic launch_ray_ready;
  assign ray_ready_o = launch_ray_ready && rays_open;
  rt_launch #(
      .Config(Config)
  ) u_launch (
      .clk_i,
      .rst_ni          (rst_n[ResetRays]),
      .box_i           (launch_box),
      .ray_valid_i     (ray_valid_i && rays_open),
      .ray_ready_o     (launch_ray_ready),
      .ray_i,
      .axis_valid_o    (axis_valid),
      .axis_o          (axis),
      .launch_valid_o  (ray_valid),
      .launch_ready_i  (ray_ready),
      .launch_context_o(ray_context),
      .launch_o        (ray_launch),
      .info_o          (ray_info),
      .free_valid_i    (free_valid),
      .free_context_i  (free_context),
      .used_o          (contexts_used)
  );

  // --- an object is entered (below): the axes of its ray travel between those of new rays ---
  logic                             entry_axis_valid, entry_axis_ready, entry_launch_valid, entry_go, entry_axis_go, entry_pause, entry_idle;
  context_t                         entry_context;
  rt_core_pkg::ray_axis_t           entry_axis;
  rt_core_pkg::launch_t             entry_launch;

  // --- launches: returns from leaves first, then objects; through a register, as they go to all lanes and units ---
  logic                   return_valid, return_valid_q, leaf_return_valid, leaf_return_ready, leaf_return_pause;
  context_t               return_context, return_context_q, leaf_return_context, launch_context;
  rt_core_pkg::launch_t   return_launch, return_launch_q, leaf_return_launch;
  assign leaf_return_ready = !return_valid;
  always_ff @(posedge clk_i) begin
    return_valid_q   <= (return_valid || leaf_return_valid) && wires_rst_n;
    return_context_q <= return_valid ? return_context : leaf_return_context;
    return_launch_q  <= return_valid ? return_launch : leaf_return_launch;
  end
  // Those of the result unit go first; who waits for long in the leaf unit stops its events.
  if (Config.leaf_returns != 0) begin : gen_leaf_returns
    logic [3:0] waits_q;
    always_ff @(posedge clk_i) begin
      if (!leaf_return_valid || leaf_return_ready || !wires_rst_n) waits_q <= '0;
      else if (waits_q != '1) waits_q <= waits_q + 1'b1;
    end
    assign leaf_return_pause = waits_q == '1;
  end else begin : gen_no_leaf_returns
    assign leaf_return_pause = 1'b0;
  end
  // rt_launch sends two axes in a row and waits with the last one; a launch of an object needs the last one's clock.
  assign entry_axis_ready = (!axis_valid || axis.axis == 2'(rt_core_pkg::Axes - 1)) && !(entry_launch_valid && return_valid_q);
  assign entry_axis_go    = entry_axis_valid && entry_axis_ready;
  assign entry_go         = entry_launch_valid && entry_axis_ready;
  assign ray_ready      = !return_valid_q && !entry_axis_go;
  assign ray_go         = ray_valid && ray_ready;
  assign launch_context = return_valid_q ? return_context_q : entry_go ? entry_context : ray_context;
  // What is launched, and an axis of a ray, each on its way: first from the launch on, then once more for leaves and references, and in every lane.
  typedef struct packed {
    context_t               ctx;
    rt_core_pkg::launch_t   launch;
    rt_core_pkg::ray_info_t info;
  } launched_t;
  typedef struct packed {
    context_t               ctx;
    logic                   level;
    rt_core_pkg::ray_axis_t axis;
  } axis_t;
  logic [Lanes-1:0] launch_lanes, launched_lanes;
  logic             launched_ray, launched_axis_valid, stored_ray, stored_axis_valid;
  launched_t        launched, stored;
  axis_t            launched_axis, stored_axis;
  always_comb begin
    for (int unsigned l = 0; l < Lanes; l++) launch_lanes[l] = (return_valid_q || entry_go || ray_go) && 32'(launch_context) >> LaneContextBits == l;
  end
  rt_hop #(
      .Depth (Config.launch_hops),
      .Valids(Lanes + 1),
      .data_t(launched_t)
  ) u_launched (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i({ray_go, launch_lanes}),
      .data_i ('{ctx: launch_context, launch: return_valid_q ? return_launch_q : entry_go ? entry_launch : ray_launch, info: ray_info}),
      .valid_o({launched_ray, launched_lanes}),
      .data_o (launched)
  );
  rt_hop #(
      .Depth (Config.launch_hops),
      .data_t(axis_t)
  ) u_launched_axis (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(axis_valid || entry_axis_go),
      .data_i ('{ctx: entry_axis_go ? entry_context : ray_context, level: entry_axis_go, axis: entry_axis_go ? entry_axis : axis}),
      .valid_o(launched_axis_valid),
      .data_o (launched_axis)
  );
  rt_hop #(
      .Depth (Config.launch_hops),
      .data_t(launched_t)
  ) u_stored (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(launched_ray),
      .data_i (launched),
      .valid_o(stored_ray),
      .data_o (stored)
  );
  rt_hop #(
      .Depth (Config.launch_hops),
      .data_t(axis_t)
  ) u_stored_axis (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(launched_axis_valid),
      .data_i (launched_axis),
      .valid_o(stored_axis_valid),
      .data_o (stored_axis)
  );

  // What the end of a run asks: nothing is anywhere.
  logic [Lanes-1:0] lanes_idle;
  logic             nodes_idle, leaves_idle, references_idle;

  // --- generations: all pipes of contexts at once ---
  localparam int unsigned HoldLeaf = Lanes;
  localparam int unsigned HoldReferences = Lanes + 1;
  localparam int unsigned HoldNodes = Lanes + 2;
  logic               hold;
  logic [Lanes+1:0]   pipe_empty;
  logic [HoldNodes:0] unit_hold;
  rt_generation #(
      .Pipes     (Lanes + 2),
      .PeriodBits(rt_core_pkg::GenerationBits)
  ) u_generation (
      .clk_i,
      .rst_ni (wires_rst_n),
      .empty_i(pipe_empty),
      .hold_o (hold)
  );
  rt_copies #(
      .Copies(HoldNodes + 1)
  ) u_holds (
      .clk_i,
      .data_i(hold),
      .data_o(unit_hold)
  );

  // --- lanes ---
  typedef struct packed {
    context_t              ctx;
    rt_core_pkg::arrival_t arrival;
  } arrival_t;
  logic [Lanes-1:0] out_valid, out_ready, lane_down, lane_up;
  localparam int unsigned LinePairs = Config.node_line_pairs;
  localparam int unsigned LinePairBits = $clog2(LinePairs);
  localparam int unsigned LineWordBits = LinePairs > 1 ? LinePairBits : 1;
  localparam int unsigned NodeKeyBits = rt_contract_pkg::PairIndexBits - LinePairBits;
  `RT_ASSERT_INIT(LineIsGranules, 16 * LinePairs >= Config.granule_bytes)
  `RT_ASSERT_INIT(LinePairsKnown, LinePairs == 1 || LinePairs == 2 || LinePairs == 4)
  logic [Lanes-1:0]                                        look_valid, look_answer, look_hit;
  logic [Lanes-1:0][NodeKeyBits-1:0]                       look_key;
  logic [Lanes-1:0][LineWordBits-1:0]                      look_word;
  logic [Lanes-1:0][LaneContextBits-1:0]                   look_waiter, node_wake_context;
  logic [Lanes-1:0][rt_contract_pkg::NodePairUsedBits-1:0] look_data;
  logic [Lanes-1:0]                                        node_wake_valid, node_wake_ready, node_wake_error;
  function automatic context_t out_context_of(int unsigned lane, logic [LaneContextBits-1:0] lane_context);
    return context_t'(lane * Config.contexts_per_lane) | context_t'(lane_context);
  endfunction
  arrival_t         out_arrival[Lanes];
  // What every step is compared with.
  typedef struct packed {
    logic [31:0] pair_count;
    logic [31:0] step_limit;
  } limits_t;
  limits_t [Lanes-1:0] lane_limits;
  rt_copies #(
      .Copies(Lanes),
      .data_t(logic [$bits(limits_t)-1:0])
  ) u_limits (
      .clk_i,
      .data_i({view.pair_count, view.step_limit}),
      .data_o(lane_limits)
  );
  for (genvar l = 0; l < int'(Lanes); l++) begin : gen_lane
    logic                               lane_valid, lane_axis_valid;
    logic [LaneContextBits-1:0]         out_context;
    launched_t                          lane_launched;
    axis_t                              lane_axis;
    arrival_t                           lane_arrival;
    logic                               lane_out_valid, lane_out_ready;
    rt_contract_pkg::pair_index_t       pair;
    rt_core_pkg::image_view_t           lane_view;
    always_comb begin
      lane_view            = view;
      lane_view.pair_count = lane_limits[l].pair_count;
      lane_view.step_limit = lane_limits[l].step_limit;
    end
    rt_hop #(
        .Depth (Config.launch_hops),
        .data_t(launched_t)
    ) u_launched (
        .clk_i,
        .rst_ni (rst_n[ResetLane+l]),
        .valid_i(launched_lanes[l]),
        .data_i (launched),
        .valid_o(lane_valid),
        .data_o (lane_launched)
    );
    rt_hop #(
        .Depth (Config.launch_hops),
        .data_t(axis_t)
    ) u_axis (
        .clk_i,
        .rst_ni (rst_n[ResetLane+l]),
        .valid_i(launched_axis_valid && 32'(launched_axis.ctx) >> LaneContextBits == l),
        .data_i (launched_axis),
        .valid_o(lane_axis_valid),
        .data_o (lane_axis)
    );
    assign lane_arrival.ctx = out_context_of(l, out_context);
    rt_skid #(
        .data_t(arrival_t)
    ) u_arrival_skid (
        .clk_i,
        .rst_ni     (rst_n[ResetLane+l]),
        .in_valid_i (lane_out_valid),
        .in_ready_o (lane_out_ready),
        .in_data_i  (lane_arrival),
        .out_valid_o(out_valid[l]),
        .out_ready_i(out_ready[l]),
        .out_data_o (out_arrival[l])
    );
    rt_lane #(
        .Config(Config)
    ) u_lane (
        .clk_i,
        .rst_ni          (rst_n[ResetLane+l]),
        .hold_i          (unit_hold[l]),
        .empty_o         (pipe_empty[l]),
        .view_i          (lane_view),
        .axis_valid_i    (lane_axis_valid),
        .axis_context_i  (lane_axis.ctx[LaneContextBits-1:0]),
        .axis_number_i   (lane_axis.axis.axis),
        .axis_level_i    (lane_axis.level),
        .axis_i          (lane_axis.axis.walk),
        .launch_valid_i  (lane_valid),
        .launch_context_i(lane_launched.ctx[LaneContextBits-1:0]),
        .launch_i        (lane_launched.launch),
        .out_valid_o     (lane_out_valid),
        .out_ready_i     (lane_out_ready),
        .out_context_o   (out_context),
        .out_data_o      (lane_arrival.arrival),
        .look_valid_o    (look_valid[l]),
        .look_pair_o     (pair),
        .look_context_o  (look_waiter[l]),
        .look_valid_i    (look_answer[l]),
        .look_hit_i      (look_hit[l]),
        .look_data_i     (look_data[l]),
        .wake_valid_i    (node_wake_valid[l]),
        .wake_ready_o    (node_wake_ready[l]),
        .wake_context_i  (node_wake_context[l]),
        .wake_error_i    (node_wake_error[l]),
        .events_o        (lane_events[l]),
        .down_o          (lane_down[l]),
        .up_o            (lane_up[l]),
        .idle_o          (lanes_idle[l])
    );
    assign look_key[l]    = pair[rt_contract_pkg::PairIndexBits-1:LinePairBits];
    assign look_word[l]   = LinePairs > 1 ? pair[LineWordBits-1:0] : '0;
  end

  // --- node cache: one for all lanes, so that a line is fetched once ---
  logic [NodeKeyBits-1:0]             node_key;
  logic [rt_core_pkg::MshrIdBits-1:0] node_mshr;
  logic                               node_miss;
  rt_cache #(
      .Ports       (Lanes),
      .Lines       (Config.node_pairs / LinePairs),
      .Ways        (Config.ways),
      .KeyBits     (NodeKeyBits),
      .DataBits    (DataBits),
      .WordBits    (rt_contract_pkg::NodePairUsedBits),
      .WordsPerLine(LinePairs),
      .Mshrs       (Config.mshrs),
      .Waiters     (Config.contexts_per_lane)
  ) u_node_cache (
      .clk_i,
      .rst_ni       (rst_n[ResetNodes]),
      .flush_i      (unit_flush[0]),
      .flushing_o   (flushing[0]),
      .keep_i       (unit_hold[HoldNodes]),
      .req_valid_i  (look_valid),
      .req_key_i    (look_key),
      .req_word_i   (look_word),
      .req_waiter_i (look_waiter),
      .rsp_valid_o  (look_answer),
      .rsp_hit_o    (look_hit),
      .rsp_data_o   (look_data),
      .wake_valid_o (node_wake_valid),
      .wake_ready_i (node_wake_ready),
      .wake_waiter_o(node_wake_context),
      .wake_error_o (node_wake_error),
      .fetch_valid_o(source_valid[rt_config_pkg::SourceNode]),
      .fetch_ready_i(source_ready[rt_config_pkg::SourceNode]),
      .fetch_key_o  (node_key),
      .fetch_mshr_o (node_mshr),
      .miss_o       (node_miss),
      .fill_valid_i (fill_valid[Near][rt_config_pkg::SourceNode]),
      .fill_mshr_i  (fill[Near].info.mshr),
      .fill_data_i  (fill[Near].data),
      .fill_last_i  (fill[Near].info.last),
      .fill_error_i (fill[Near].info.error),
      .idle_o       (nodes_idle)
  );
  assign source_request[rt_config_pkg::SourceNode] = request(
      view.pair_base, 30'({node_key, (LinePairBits + 4)'(0)}), 16 * LinePairs, rt_config_pkg::SourceNode, node_mshr);

  // --- arrivals: to the leaf unit, or straight to the result unit ---
  logic     first_valid, arrival_room, arrival_valid, arrival_ready, arrival_ends;
  arrival_t first_arrival, arrival;
  rt_turns #(
      .NumInputs(Lanes),
      .data_t   (arrival_t)
  ) u_arrival_turns (
      .clk_i,
      .rst_ni     (wires_rst_n),
      .in_valid_i (out_valid),
      .in_ready_o (out_ready),
      .in_data_i  (out_arrival),
      .room_i     (arrival_room),
      .out_valid_o(first_valid),
      .out_data_o (first_arrival)
  );
  rt_queue #(
      .Depth (8),
      .Ahead (1),
      .data_t(arrival_t)
  ) u_arrivals (
      .clk_i,
      .rst_ni     (wires_rst_n),
      .in_valid_i (first_valid),
      .in_ready_o (arrival_room),
      .in_data_i  (first_arrival),
      .out_valid_o(arrival_valid),
      .out_ready_i(arrival_ready),
      .out_data_o (arrival)
  );
  assign arrival_ends = arrival.arrival.event_code != rt_core_pkg::EventGoOn;

  typedef struct packed {
    context_t    ctx;
    status_t     event_code;
    logic        climbed;  // the root of an object's tree was reached, after so many steps
    logic [31:0] steps;
  } direct_t;
  localparam int unsigned EndArrival = 0;
  localparam int unsigned EndLeaf = 1;
  localparam int unsigned EndEntry = 2;
  localparam int unsigned Ends = 1 + Levels;
  logic [Ends-1:0]         end_valid, end_ready;
  direct_t                 end_data[Ends];
  logic [$clog2(Ends)-1:0] end_index_unused;
  logic                    chosen_valid, chosen_ready, direct_valid, direct_ready;
  direct_t                 chosen, direct;
  assign end_valid[EndArrival] = arrival_valid && arrival_ends;
  assign end_data[EndArrival]  = '{
          ctx: arrival.ctx,
          event_code: arrival.arrival.event_code,
          climbed: Levels > 1 && arrival.arrival.event_code == rt_core_pkg::EventFinish,
          steps: Levels > 1 ? arrival.arrival.steps : '0
      };
  assign arrival_ready = !arrival_ends || end_ready[EndArrival];
  rt_arbiter #(
      .NumInputs(Ends),
      .data_t   (direct_t)
  ) u_end_arbiter (
      .clk_i,
      .rst_ni     (wires_rst_n),
      .in_valid_i (end_valid),
      .in_ready_o (end_ready),
      .in_data_i  (end_data),
      .in_last_i  ('1),
      .out_valid_o(chosen_valid),
      .out_ready_i(chosen_ready),
      .out_data_o (chosen),
      .out_index_o(end_index_unused)
  );
  rt_skid #(
      .data_t(direct_t)
  ) u_end_skid (
      .clk_i,
      .rst_ni     (wires_rst_n),
      .in_valid_i (chosen_valid),
      .in_ready_o (chosen_ready),
      .in_data_i  (chosen),
      .out_valid_o(direct_valid),
      .out_ready_i(direct_ready),
      .out_data_o (direct)
  );

  // --- who has entered an object: to those who keep something of it ---
  typedef struct packed {
    context_t                         ctx;
    rt_contract_pkg::triangle_index_t next;
    rt_core_pkg::entered_t            entered;
  } entered_t;
  logic     entered_valid;
  entered_t entered;

  // --- leaves ---
  context_t                           leaf_end_context;
  status_t                            leaf_end_event;
  logic                               iter_valid, references_valid, leave_valid, leaf_counted;
  context_t                           iter_context, references_context, leave_context;
  rt_core_pkg::references_t           references;
  rt_core_pkg::leave_t                leave;
  rt_core_pkg::leaf_key_t             leaf_key;
  logic [rt_core_pkg::MshrIdBits-1:0] leaf_mshr;
  rt_leaf_unit #(
      .Config(Config)
  ) u_leaf (
      .clk_i,
      .rst_ni              (rst_n[ResetLeaves]),
      .flush_i             (unit_flush[1]),
      .flushing_o          (flushing[1]),
      .hold_i              (unit_hold[HoldLeaf]),
      .empty_o             (pipe_empty[HoldLeaf]),
      .view_i              (view),
      .parent_links_i      (parent_links_q),
      .axis_valid_i        (stored_axis_valid),
      .axis_context_i      (stored_axis.ctx),
      .axis_number_i       (stored_axis.axis.axis),
      .axis_level_i        (stored_axis.level),
      .axis_i              (stored_axis.axis.walk),
      .entered_valid_i     (entered_valid),
      .entered_context_i   (entered.ctx),
      .entered_next_i      (entered.next),
      .near_valid_i        (launched_lanes != '0),
      .near_context_i      (launched.ctx),
      .near_i              (launched.launch.t_near),
      .return_valid_o      (leaf_return_valid),
      .return_ready_i      (leaf_return_ready),
      .return_context_o    (leaf_return_context),
      .return_o            (leaf_return_launch),
      .in_valid_i          (arrival_valid && !arrival_ends),
      .in_context_i        (arrival.ctx),
      .in_data_i           (arrival.arrival),
      .iter_valid_o        (iter_valid),
      .iter_context_o      (iter_context),
      .references_valid_o  (references_valid),
      .references_context_o(references_context),
      .references_o        (references),
      .leave_valid_o       (leave_valid),
      .leave_context_o     (leave_context),
      .leave_o             (leave),
      .out_valid_o         (end_valid[EndLeaf]),
      .out_ready_i         (end_ready[EndLeaf]),
      .out_context_o       (leaf_end_context),
      .out_event_o         (leaf_end_event),
      .fetch_valid_o       (source_valid[rt_config_pkg::SourceLeaf]),
      .fetch_ready_i       (source_ready[rt_config_pkg::SourceLeaf]),
      .fetch_key_o         (leaf_key),
      .fetch_mshr_o        (leaf_mshr),
      .fill_valid_i        (fill_valid[Leaf][rt_config_pkg::SourceLeaf]),
      .fill_mshr_i         (fill[Leaf].info.mshr),
      .fill_data_i         (fill[Leaf].data),
      .fill_last_i         (fill[Leaf].info.last),
      .fill_error_i        (fill[Leaf].info.error),
      .events_o            (leaf_events),
      .leaf_o              (leaf_counted),
      .idle_o              (leaves_idle)
  );
  assign end_data[EndLeaf] = '{ctx: leaf_end_context, event_code: leaf_end_event, climbed: 1'b0, steps: '0};
  assign source_request[rt_config_pkg::SourceLeaf] =
      request(view.leaf_base, {1'b0, leaf_key.leaf, {rt_core_pkg::LineShift{1'b0}}},
              rt_core_pkg::LeafReadBytes + 8 * 32'(leaf_key.beats), rt_config_pkg::SourceLeaf, leaf_mshr);

  // --- references and tests ---
  typedef struct packed {
    context_t            ctx;
    rt_core_pkg::leave_t leave;
  } leave_t;
  typedef struct packed {
    context_t                 ctx;
    rt_core_pkg::references_t references;
  } references_t;
  logic        left_valid, begin_valid, listed_valid;
  context_t    begin_context;
  leave_t      left;
  references_t listed;
  rt_hop #(
      .Depth (Config.leaf_hops),
      .data_t(leave_t)
  ) u_left (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(leave_valid),
      .data_i ('{ctx: leave_context, leave: leave}),
      .valid_o(left_valid),
      .data_o (left)
  );
  rt_hop #(
      .Depth (Config.leaf_hops),
      .data_t(context_t)
  ) u_begin (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(iter_valid),
      .data_i (iter_context),
      .valid_o(begin_valid),
      .data_o (begin_context)
  );
  rt_hop #(
      .Depth (Config.leaf_hops),
      .data_t(references_t)
  ) u_listed (
      .clk_i,
      .rst_ni (wires_rst_n),
      .valid_i(references_valid),
      .data_i ('{ctx: references_context, references: references}),
      .valid_o(listed_valid),
      .data_o (listed)
  );
  typedef struct packed {
    context_t ctx;
    logic     test;
    logic     last;
    status_t  event_code;
  } test_tag_t;
  logic                                  test_valid, test_ready, tri_valid, tri_ready;
  logic                                  list_hit, list_miss, skipped;
  rt_contract_pkg::tri_test_in_record_t  test_data;
  rt_contract_pkg::tri_test_out_record_t tri_data;
  test_tag_t                             test_tag, tri_tag;
  logic [Contexts-1:0]                   has_hit;
  localparam int unsigned RecordKeyBits = rt_contract_pkg::TriangleIndexBits + Levels - 1;
  logic [23:0]                           list_key;
  logic [RecordKeyBits-1:0]              triangle_key;
  logic                                  enter_valid, enter_ready, enter_refused, entry_passed, entry_stands, next_valid, next_ready, found_valid;
  rt_contract_pkg::instance_enter_in_record_t enter_data;
  context_t                              enter_context, found_context;
  rt_core_pkg::entry_t                   enter_entry;
  rt_core_pkg::found_t                   found;
  logic [rt_core_pkg::MshrIdBits-1:0]    list_mshr, triangle_mshr;
  rt_reference_unit #(
      .Config(Config)
  ) u_references (
      .clk_i,
      .rst_ni                (rst_n[ResetReferences]),
      .flush_i               (unit_flush[2]),
      .flushing_o            (flushing[2]),
      .hold_i                (unit_hold[HoldReferences]),
      .empty_o               (pipe_empty[HoldReferences]),
      .view_i                (view),
      .mailbox_i             (mailbox_q),
      .axis_valid_i          (stored_axis_valid),
      .ray_context_i         (stored_axis.ctx),
      .axis_number_i         (stored_axis.axis.axis),
      .axis_level_i          (stored_axis.level),
      .axis_i                ('{direction: stored_axis.axis.direction, origin: stored_axis.axis.walk.origin}),
      .ray_valid_i           (stored_ray),
      .ray_any_i             (stored.info.any),
      .ray_t_max_i           (stored.info.t_max),
      .references_valid_i    (listed_valid),
      .references_context_i  (listed.ctx),
      .references_i          (listed.references),
      .in_valid_i            (begin_valid),
      .in_context_i          (begin_context),
      .next_valid_i          (next_valid),
      .next_ready_o          (next_ready),
      .next_context_i        (entry_context),
      .entered_valid_i       (entered_valid),
      .entered_context_i     (entered.ctx),
      .has_hit_i             (has_hit),
      .found_valid_i         (found_valid),
      .found_context_i       (found_context),
      .found_i               (found),
      .enter_valid_o         (enter_valid),
      .enter_ready_i         (enter_ready),
      .enter_data_o          (enter_data),
      .enter_context_o       (enter_context),
      .enter_o               (enter_entry),
      .enter_refused_o       (enter_refused),
      .out_valid_o           (test_valid),
      .out_ready_i           (test_ready),
      .out_data_o            (test_data),
      .out_context_o         (test_tag.ctx),
      .out_test_o            (test_tag.test),
      .out_last_o            (test_tag.last),
      .out_event_o           (test_tag.event_code),
      .list_fetch_valid_o    (source_valid[rt_config_pkg::SourceList]),
      .list_fetch_ready_i    (source_ready[rt_config_pkg::SourceList]),
      .list_fetch_key_o      (list_key),
      .list_fetch_mshr_o     (list_mshr),
      .list_fill_valid_i     (fill_valid[Far][rt_config_pkg::SourceList]),
      .triangle_fetch_valid_o(source_valid[rt_config_pkg::SourceTriangle]),
      .triangle_fetch_ready_i(source_ready[rt_config_pkg::SourceTriangle]),
      .triangle_fetch_key_o  (triangle_key),
      .triangle_fetch_mshr_o (triangle_mshr),
      .triangle_fill_valid_i (fill_valid[Far][rt_config_pkg::SourceTriangle]),
      .fill_mshr_i           (fill[Far].info.mshr),
      .fill_data_i           (fill[Far].data),
      .fill_last_i           (fill[Far].info.last),
      .fill_error_i          (fill[Far].info.error),
      .events_o              (reference_events),
      .list_hit_o            (list_hit),
      .list_miss_o           (list_miss),
      .skipped_o             (skipped),
      .idle_o                (references_idle)
  );
  assign source_request[rt_config_pkg::SourceList] =
      request(view.list_base, {list_key, {rt_core_pkg::LineShift{1'b0}}}, 64, rt_config_pkg::SourceList, list_mshr);
  localparam int unsigned TriangleBytes = rt_contract_pkg::TriangleUsedBits / 8;
  if (Levels > 1) begin : gen_record_request
    assign source_request[rt_config_pkg::SourceTriangle] = triangle_key[RecordKeyBits-1] ?
        request(view.instance_base, {triangle_key[23:0], {rt_core_pkg::LineShift{1'b0}}}, rt_contract_pkg::InstanceBytes, rt_config_pkg::SourceTriangle, triangle_mshr) :
        request(view.triangle_base, {triangle_key[23:0], {rt_core_pkg::LineShift{1'b0}}}, TriangleBytes, rt_config_pkg::SourceTriangle, triangle_mshr);
  end else begin : gen_triangle_request
    assign source_request[rt_config_pkg::SourceTriangle] =
        request(view.triangle_base, {triangle_key, {rt_core_pkg::LineShift{1'b0}}}, TriangleBytes, rt_config_pkg::SourceTriangle, triangle_mshr);
  end

  // --- entries, and tests ---
  logic tests_wait;
  if (Levels > 1) begin : gen_entry
    // An entry goes before a test, so tests wait.
    typedef struct packed {
      test_tag_t                            tag;
      rt_contract_pkg::tri_test_in_record_t data;
    } test_t;
    test_t entering;
    logic  entering_valid, entering_ready;
    rt_queue #(
        .Depth (4),
        .data_t(test_t)
    ) u_tests (
        .clk_i,
        .rst_ni     (wires_rst_n),
        .in_valid_i (test_valid),
        .in_ready_o (test_ready),
        .in_data_i  ('{tag: test_tag, data: test_data}),
        .out_valid_o(entering_valid),
        .out_ready_i(entering_ready),
        .out_data_o (entering)
    );
    assign tests_wait = entering_valid;

    rt_core_pkg::entered_t            entry_entered;
    rt_contract_pkg::triangle_index_t entry_entered_next;
    logic                                       transform_entry, unit_ready, test_enters_unused;
    rt_contract_pkg::instance_enter_in_record_t entry_record;
    logic [2:0][rt_stage_pkg::EnterSumBits-1:0] place, course;
    rt_contract_pkg::row_position_t [2:0]       test_position;
    rt_contract_pkg::row_direction_t [2:0]      test_direction;
    rt_transform u_transform (
        .clk_i,
        .rst_ni     (rst_n[ResetEntry]),
        .entry_i    (transform_entry),
        .instance_i (entry_record),
        .triangle_i (entering.data),
        .place_o    (place),
        .course_o   (course),
        .position_o (test_position),
        .direction_o(test_direction)
    );
    rt_entry #(
        .Config(Config)
    ) u_entry (
        .clk_i,
        .rst_ni        (rst_n[ResetEntry]),
        .in_valid_i    (enter_valid),
        .in_ready_o    (enter_ready),
        .in_data_i     (enter_data),
        .in_context_i  (enter_context),
        .in_entry_i    (enter_entry),
        .camera_valid_i,
        .camera_ready_o,
        .camera_i,
        .made_valid_o,
        .made_ready_i,
        .made_o,
        .enter_o       (transform_entry),
        .record_o      (entry_record),
        .place_i       (place),
        .course_i      (course),
        .context_o     (entry_context),
        .axis_valid_o  (entry_axis_valid),
        .axis_ready_i  (entry_axis_ready),
        .axis_o        (entry_axis),
        .launch_valid_o(entry_launch_valid),
        .launch_o      (entry_launch),
        .entered_o     (entry_entered),
        .entered_next_o(entry_entered_next),
        .next_valid_o  (next_valid),
        .next_ready_i  (next_ready),
        .out_valid_o   (end_valid[EndEntry]),
        .out_ready_i   (end_ready[EndEntry]),
        .out_event_o   (end_data[EndEntry].event_code),
        .pause_o       (entry_pause),
        .idle_o        (entry_idle)
    );
    assign end_data[EndEntry].ctx     = entry_context;
    assign end_data[EndEntry].climbed = 1'b0;
    assign end_data[EndEntry].steps   = '0;
    rt_hop #(
        .Depth (Config.launch_hops),
        .data_t(entered_t)
    ) u_entered (
        .clk_i,
        .rst_ni (wires_rst_n),
        .valid_i(entry_go),
        .data_i ('{ctx: entry_context, next: entry_entered_next, entered: entry_entered}),
        .valid_o(entered_valid),
        .data_o (entered)
    );

    // The transform serves tests and entries; an entry, which is not held, goes first.
    assign entering_ready = unit_ready && !transform_entry;
    assign entry_passed   = (next_valid && next_ready) || (end_valid[EndEntry] && end_ready[EndEntry]);
    assign entry_stands   = (entry_axis_valid && !entry_axis_ready) || (next_valid && !next_ready) || (end_valid[EndEntry] && !end_ready[EndEntry]);
    rt_unit_test #(
        .RowsLatency(rt_stage_pkg::TransformLatency),
        .tag_t      (test_tag_t)
    ) u_tri_test (
        .clk_i,
        .rst_ni     (rst_n[ResetTests]),
        .in_valid_i (entering_valid && entering_ready),
        .in_ready_o (unit_ready),
        .in_data_i  (entering.data),
        .in_tag_i   (entering.tag),
        .enter_o    (test_enters_unused),
        .origin_i   (test_position),
        .direction_i(test_direction),
        .out_valid_o(tri_valid),
        .out_ready_i(tri_ready),
        .out_data_o (tri_data),
        .out_tag_o  (tri_tag)
    );
  end else begin : gen_no_entry
    assign enter_ready        = 1'b1;
    logic camera_unused;
    assign camera_unused      = ^{camera_valid_i, camera_i, made_ready_i};
    assign camera_ready_o     = 1'b0;
    assign made_valid_o       = 1'b0;
    assign made_o             = '0;
    assign entry_passed       = 1'b0;
    assign entry_stands       = 1'b0;
    assign entry_context      = '0;
    assign entry_axis_valid   = 1'b0;
    assign entry_axis         = '0;
    assign entry_launch_valid = 1'b0;
    assign entry_launch       = '0;
    assign next_valid         = 1'b0;
    assign entry_pause        = 1'b0;
    assign entry_idle         = 1'b1;
    assign entered_valid      = 1'b0;
    assign entered            = '0;

    rt_tri_test #(
        .InputHops(1),
        .Spare    (rt_stage_pkg::TestSpare),
        .tag_t    (test_tag_t)
    ) u_tri_test (
        .clk_i,
        .rst_ni     (rst_n[ResetTests]),
        .in_valid_i (test_valid),
        .in_ready_o (test_ready),
        .in_data_i  (test_data),
        .in_tag_i   (test_tag),
        .out_valid_o(tri_valid),
        .out_ready_i(tri_ready),
        .out_data_o (tri_data),
        .out_tag_o  (tri_tag)
    );
    assign tests_wait = test_valid;
  end

  // --- results ---
  logic                                  finish_valid, finish_ready;
  rt_contract_pkg::hit_finish_in_record_t finish;
  typedef struct packed {
    rt_contract_pkg::triangle_index_t number;
    rt_core_pkg::ray_tag_t            tag;
  } finish_tag_t;
  finish_tag_t                           finish_tag, hit_tag;
  rt_result_unit #(
      .Config(Config)
  ) u_results (
      .clk_i,
      .rst_ni              (rst_n[ResetResults]),
      .parent_links_i      (parent_links_q),
      .ray_valid_i     (launched_ray),
      .ray_context_i   (launched.ctx),
      .ray_i           (launched.info),
      .leave_valid_i   (left_valid),
      .leave_context_i (left.ctx),
      .leave_i         (left.leave),
      .direct_valid_i  (direct_valid),
      .direct_ready_o  (direct_ready),
      .direct_context_i(direct.ctx),
      .direct_event_i  (direct.event_code),
      .direct_climbed_i(direct.climbed),
      .direct_steps_i  (direct.steps),
      .save_valid_i    (arrival_valid && !arrival_ends && !arrival.arrival.level),
      .save_context_i  (arrival.ctx),
      .save_i          ('{node: arrival.arrival.node, t: arrival.arrival.t}),
      .entered_valid_i (entered_valid),
      .entered_context_i(entered.ctx),
      .entered_i       (entered.entered),
      .pause_i             (entry_pause || leaf_return_pause),
      .found_valid_o   (found_valid),
      .found_context_o (found_context),
      .found_o         (found),
      .tri_valid_i     (tri_valid),
      .tri_ready_o     (tri_ready),
      .tri_data_i      (tri_data),
      .tri_context_i   (tri_tag.ctx),
      .tri_test_i      (tri_tag.test),
      .tri_last_i      (tri_tag.last),
      .tri_event_i     (tri_tag.event_code),
      .has_hit_o       (has_hit),
      .return_valid_o  (return_valid),
      .return_context_o(return_context),
      .return_o        (return_launch),
      .finish_valid_o  (finish_valid),
      .finish_ready_i  (finish_ready),
      .finish_o        (finish),
      .finish_tag_o    (finish_tag.tag),
      .finish_number_o (finish_tag.number),
      .free_valid_o    (free_valid),
      .free_context_o  (free_context),
      .events_o        (result_events)
  );

  rt_hit_finish #(
      .tag_t(finish_tag_t)
  ) u_hit_finish (
      .clk_i,
      .rst_ni     (rst_n[ResetFinish]),
      .in_valid_i (finish_valid),
      .in_ready_o (finish_ready),
      .in_data_i  (finish),
      .in_tag_i   (finish_tag),
      .out_valid_o(hit_valid_o),
      .out_ready_i(hit_ready_i),
      .out_data_o (hit_o.hit),
      .out_tag_o  (hit_tag)
  );
  assign hit_o.tag    = hit_tag.tag;
  assign hit_number_o = hit_tag.number;

  // --- counters: the order is that of the register map (rt_top) ---
  function automatic rt_config_pkg::counter_step_t one(logic event_bit);
    return rt_config_pkg::counter_step_t'(event_bit);
  endfunction
  logic [Lanes-1:0] lane_hit, lane_busy, lane_starved;
  for (genvar l = 0; l < int'(Lanes); l++) begin : gen_events
    always_ff @(posedge clk_i) begin
      lane_hit[l]     <= lane_events[l].hit;
      lane_busy[l]    <= lane_events[l].busy;
      lane_starved[l] <= !lane_events[l].busy && lane_events[l].starved;
    end
  end
  rt_config_pkg::counter_steps_t steps;
  always_ff @(posedge clk_i) steps_o <= steps;
  always_comb begin
    steps                   = '0;
    steps.clocks            = one(1'b1);
    steps.rays              = one(hit_taken);
    steps.faults            = one(hit_fault);
    steps.down              = rt_config_pkg::counter_step_t'($countones(lane_down));
    steps.up                = rt_config_pkg::counter_step_t'($countones(lane_up));
    steps.leaf              = one(leaf_counted);
    steps.tests             = one(test_valid && test_tag.test);
    steps.skipped           = one(skipped);
    steps.node_hits         = rt_config_pkg::counter_step_t'($countones(lane_hit));
    steps.node_misses       = one(node_miss);
    steps.leaf_hits         = one(leaf_events.hit);
    steps.leaf_misses       = one(leaf_events.miss);
    steps.list_hits         = one(list_hit);
    steps.list_misses       = one(list_miss);
    steps.triangle_hits     = one(reference_events.hit);
    steps.triangle_misses   = one(reference_events.miss);
    steps.lane_busy         = rt_config_pkg::counter_step_t'($countones(lane_busy));
    steps.lane_starved      = rt_config_pkg::counter_step_t'($countones(lane_starved));
    steps.leaf_busy         = one(leaf_events.busy);
    steps.leaf_starved      = one(!leaf_events.busy && leaf_events.starved);
    steps.test_busy         = one(test_valid);
    steps.test_starved      = one(!test_valid && reference_events.starved);
    steps.reference_busy    = one(reference_events.busy);
    steps.reference_starved = one(!reference_events.busy && reference_events.starved);
    steps.result_busy       = one(result_events.busy);
    steps.result_starved    = one(!result_events.busy && result_events.starved);
    steps.context_clocks    = rt_config_pkg::counter_step_t'(contexts_used);
    steps.entries           = one(enter_valid);
    steps.entry_passed      = one(entry_passed);
    steps.entry_refused     = one(enter_refused);
    steps.entry_blocked     = one(entry_stands);
  end

  // --- at the end of a run nothing is anywhere ---
`ifndef SYNTHESIS
  localparam int unsigned Pipes = Lanes + 2;
  logic [Pipes-1:0]                  comes, gets_on;
  logic [Pipes-1:0][ContextBits-1:0] coming, getting_on;
  assign {comes[Lanes], coming[Lanes]}               = {u_leaf.u_pipe.push_valid, u_leaf.u_pipe.push_context};
  assign {gets_on[Lanes], getting_on[Lanes]}         = {u_leaf.u_pipe.gets_on, u_leaf.u_pipe.getting_on};
  assign {comes[Lanes+1], coming[Lanes+1]}           = {u_references.u_pipe.push_valid, u_references.u_pipe.push_context};
  assign {gets_on[Lanes+1], getting_on[Lanes+1]}     = {u_references.u_pipe.gets_on, u_references.u_pipe.getting_on};
  for (genvar l = 0; l < int'(Lanes); l++) begin : gen_wait
    assign {comes[l], coming[l]}       = {gen_lane[l].u_lane.u_pipe.push_valid, context_t'(gen_lane[l].u_lane.u_pipe.push_context)};
    assign {gets_on[l], getting_on[l]} = {gen_lane[l].u_lane.u_pipe.gets_on, context_t'(gen_lane[l].u_lane.u_pipe.getting_on)};
  end
  rt_run_checker #(
      .Config(Config)
  ) u_checker (
      .clk_i,
      .rst_ni,
      .started_i   (status_o.started),
      .drained_i   (drained_o),
      .done_i      (status_o.done),
      .ray_taken_i (ray_taken),
      .hit_taken_i (hit_taken),
      .read_valid_i(read_valid_o),
      .read_ready_i,
      .read_i      (read_o),
      .fill_i      (fill_i),
      .contexts_i  (32'(contexts_used)),
      .idle_i      (lanes_idle == '1 && nodes_idle && leaves_idle && references_idle && !arrival_valid && !first_valid && !direct_valid && !tri_valid && !tests_wait && entry_idle),
      .freed_i     (free_valid),
      .launched_i  (ray_go),
      .stalled_i   (hit_valid_o && !hit_ready_i),
      .comes_i     (comes),
      .coming_i    (coming),
      .gets_on_i   (gets_on),
      .getting_on_i(getting_on)
  );
`endif
endmodule
