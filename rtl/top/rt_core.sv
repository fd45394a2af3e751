// Core: the units of a run and the wires between them. Everything in here is reset by a soft reset; AXI and registers are in rt_top.
//
//   rt_ray_unit --launch--> lanes (rt_lane x N) --arrival--> rt_leaf_unit --> rt_reference_unit --> rt_tri_test --> rt_result_unit
//                             ^                                  |                                                   |   |
//                             |                                  +---- leaves without references, faults -----------+   |
//                             +------------------------------ return ----------------------------------------------------+
//   rt_result_unit --finish--> rt_hit_finish --> hits
//
// Deadlock    Whoever holds a context always has a place for it (a state RAM and a queue or list); answers of the memory are always taken; the only
//             stream that can stall is the one of finished rays, and it waits for nothing but the write channel.
// Counterpart hls/top/trace.cpp. Source: Lee 2007, section 4.
`include "rt_assert.svh"
module rt_core #(
    parameter rt_core_pkg::config_t Config = rt_core_pkg::ConfigEcp5,
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               start_i,
    input  logic [rt_core_pkg::AddrBits-1:0]   image_base_i,
    input  logic [31:0]                        image_lines_i,
    input  logic [rt_core_pkg::AddrBits-1:0]   ray_base_i,
    input  logic [31:0]                        ray_count_i,
    input  logic [31:0]                        ray_row_i,
    input  logic                               parent_links_i,
    input  logic                               mailbox_i,
    input  logic                               own_step_limit_i,
    input  logic [31:0]                        step_limit_i,
    // Status.
    output logic                               started_o,
    output logic                               busy_o,
    output logic                               done_o,
    output logic [1:0]                         image_fault_o,
    output logic                               ray_fault_o,
    output rt_contract_pkg::status_t           first_fault_o,
    output logic [31:0]                        fault_ray_o,
    output logic                               write_fault_o,
    output logic [31:0]                        write_fault_ray_o,
    // Read requests.
    output logic                               read_valid_o,
    input  logic                               read_ready_i,
    output rt_core_pkg::read_request_t         read_o,
    // Answers, always taken.
    input  logic [rt_core_pkg::Sources-1:0]    fill_valid_i,  // one bit for each source of requests
    input  logic [rt_core_pkg::MshrIdBits-1:0] fill_mshr_i,
    input  logic [DataBits-1:0]                fill_data_i,
    input  logic                               fill_last_i,
    input  logic                               fill_error_i,
    // Hits.
    output logic                               hit_valid_o,
    input  logic                               hit_ready_i,
    output rt_contract_pkg::hit_record_t       hit_o,
    output logic [31:0]                        hit_ray_o,
    input  logic                               hit_written_i,
    input  logic                               write_fault_i,
    input  logic [31:0]                        write_fault_ray_i,
    output rt_core_pkg::counter_step_t         counter_step_o[rt_core_pkg::CounterCount]
);
  localparam int unsigned Lanes = Config.lanes;
  localparam int unsigned Contexts = Lanes * Config.contexts_per_lane;
  localparam int unsigned ContextBits = $clog2(Contexts);
  localparam int unsigned LaneContextBits = $clog2(Config.contexts_per_lane);
  `RT_ASSERT_INIT(LanesKnown, Lanes >= 1 && Lanes <= 8)
  `RT_ASSERT_INIT(ContextsPowerOfTwo, Config.contexts_per_lane == (1 << LaneContextBits))
  `RT_ASSERT_INIT(DataBitsKnown, DataBits == 64 || DataBits == 128)
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
  localparam int unsigned ResetLane = 10;
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

  // Answers of the memory, on their way from unit to unit: registers for the header, rays and nodes, for leaves, for lists and triangles.
  typedef struct packed {
    logic [rt_core_pkg::Sources-1:0]    valid;  // one bit for each source of requests
    logic [rt_core_pkg::MshrIdBits-1:0] mshr;
    logic                               last;
    logic                               error;
    logic [DataBits-1:0]                data;
  } fill_t;
  fill_t near_fill_q, leaf_fill_q, far_fill_q;
  always_ff @(posedge clk_i) begin
    near_fill_q <= '{valid: fill_valid_i, mshr: fill_mshr_i, last: fill_last_i, error: fill_error_i, data: fill_data_i};
    leaf_fill_q <= near_fill_q;
    far_fill_q  <= leaf_fill_q;
    if (!wires_rst_n) begin
      near_fill_q.valid <= '0;
      leaf_fill_q.valid <= '0;
      far_fill_q.valid  <= '0;
    end
  end

  rt_core_pkg::image_view_t view;
  logic                     flush, rays_start;
  logic [2:0]               unit_flush, flushing;  // nodes, leaves, lists and triangles
  rt_copies #(
      .Copies(3)
  ) u_flushes (
      .clk_i,
      .data_i(flush),
      .data_o(unit_flush)
  );

  localparam int unsigned ReadIndexBits = $clog2(rt_core_pkg::Sources);
  logic [ReadIndexBits-1:0] read_index_unused;
  logic                     end_index_unused;

  // --- read requests: one round-robin choice of all units, which have a register each, behind the sum that is the address; another behind it ---
  logic                       chosen_read_valid, chosen_read_ready;
  rt_core_pkg::read_request_t chosen_read;
  localparam int unsigned Sources = rt_core_pkg::Sources;
  logic [Sources-1:0]         source_valid, source_ready, waiting_valid, waiting_ready;
  rt_core_pkg::read_request_t source_request[Sources], waiting_request[Sources];
  for (genvar s = 0; s < int'(Sources); s++) begin : gen_request
    rt_skid #(
        .data_t(rt_core_pkg::read_request_t)
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
    request.len    = 8'((bytes * 8 + DataBits - 1) / DataBits - 1);
    request.source = rt_core_pkg::SourceBits'(source);
    request.mshr   = mshr;
  endfunction

  // What the host sets before the start, once more on its way.
  logic parent_links_q, mailbox_q;
  always_ff @(posedge clk_i) begin
    parent_links_q <= parent_links_i;
    mailbox_q      <= mailbox_i;
  end

  // --- control ---
  rt_core_pkg::unit_events_t lane_events[Lanes];
  rt_core_pkg::unit_events_t leaf_events, reference_events;
  logic                      hit_taken, hit_fault;
  assign hit_taken = hit_valid_o && hit_ready_i;
  assign hit_fault = hit_taken && hit_o.status > status_t'(rt_contract_pkg::StatusHit);

  rt_control #(
      .DataBits(DataBits)
  ) u_control (
      .clk_i,
      .rst_ni            (rst_n[ResetControl]),
      .start_i,
      .image_base_i,
      .image_lines_i,
      .ray_count_i,
      .own_step_limit_i,
      .step_limit_i,
      .fetch_valid_o     (source_valid[rt_core_pkg::SourceHeader]),
      .fetch_ready_i     (source_ready[rt_core_pkg::SourceHeader]),
      .fetch_o           (source_request[rt_core_pkg::SourceHeader]),
      .fill_valid_i      (near_fill_q.valid[rt_core_pkg::SourceHeader]),
      .fill_data_i       (near_fill_q.data),
      .fill_last_i       (near_fill_q.last),
      .fill_error_i      (near_fill_q.error),
      .view_o            (view),
      .flush_o           (flush),
      .flushing_i        (flushing != '0),
      .rays_start_o      (rays_start),
      .hit_written_i,
      .ray_fault_i       (hit_fault),
      .ray_fault_status_i(hit_o.status),
      .ray_fault_ray_i   (hit_ray_o),
      .write_fault_i,
      .write_fault_ray_i,
      .started_o,
      .busy_o,
      .done_o,
      .image_fault_o,
      .ray_fault_o,
      .first_fault_o,
      .fault_ray_o,
      .write_fault_o,
      .write_fault_ray_o
  );

  // --- rays ---
  logic                    ray_valid, ray_ready, ray_go, free_valid;
  context_t                ray_context, free_context;
  rt_core_pkg::launch_t    ray_launch;
  logic                    axis_valid;
  rt_core_pkg::ray_axis_t  axis;
  rt_core_pkg::ray_info_t  ray_info;
  logic [ContextBits:0]    contexts_used;

  rt_ray_unit #(
      .Config(Config)
  ) u_rays (
      .clk_i,
      .rst_ni          (rst_n[ResetRays]),
      .start_i         (rays_start),
      .base_i          (ray_base_i),
      .count_i         (ray_count_i),
      .row_i           (ray_row_i),
      .box_i           (view.box),
      .fetch_valid_o   (source_valid[rt_core_pkg::SourceRay]),
      .fetch_ready_i   (source_ready[rt_core_pkg::SourceRay]),
      .fetch_o         (source_request[rt_core_pkg::SourceRay]),
      .fill_valid_i    (near_fill_q.valid[rt_core_pkg::SourceRay]),
      .fill_data_i     (near_fill_q.data),
      .fill_error_i    (near_fill_q.error),
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

  // --- launches: returns from leaves first; through a register, as they go to all lanes and units ---
  logic                   return_valid, return_valid_q, launch_ray_q;
  context_t               return_context, return_context_q, launch_context, launch_context_q;
  logic [Lanes-1:0]       launch_valid_q;
  rt_core_pkg::launch_t   return_launch, return_launch_q, launch_q;
  rt_core_pkg::ray_info_t ray_info_q;
  logic                   axis_valid_q;
  context_t               axis_context_q;
  rt_core_pkg::ray_axis_t axis_q;
  always_ff @(posedge clk_i) begin
    return_valid_q   <= return_valid && wires_rst_n;
    return_context_q <= return_context;
    return_launch_q  <= return_launch;
  end
  assign ray_ready      = !return_valid_q;
  assign ray_go         = ray_valid && ray_ready;
  assign launch_context = return_valid_q ? return_context_q : ray_context;
  always_ff @(posedge clk_i) begin
    for (int unsigned l = 0; l < Lanes; l++) begin
      launch_valid_q[l] <= (return_valid_q || ray_go) && 32'(launch_context) >> LaneContextBits == l && wires_rst_n;
    end
    launch_ray_q     <= ray_go && wires_rst_n;
    launch_context_q <= launch_context;
    launch_q         <= return_valid_q ? return_launch_q : ray_launch;
    ray_info_q       <= ray_info;
    axis_valid_q     <= axis_valid && wires_rst_n;
    axis_context_q   <= ray_context;
    axis_q           <= axis;
  end
  // A second one for leaves and references, and in every lane.
  logic                   stored_ray_q, stored_any_q, stored_axis_valid_q;
  context_t               stored_context_q;
  rt_core_pkg::ray_axis_t stored_axis_q;
  always_ff @(posedge clk_i) begin
    stored_ray_q        <= launch_ray_q && wires_rst_n;
    stored_any_q        <= ray_info_q.any;
    stored_axis_valid_q <= axis_valid_q && wires_rst_n;
    stored_context_q    <= axis_context_q;
    stored_axis_q       <= axis_q;
  end

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
    logic                               lane_valid_q, lane_axis_valid_q;
    logic [LaneContextBits-1:0]         lane_context_q, lane_axis_context_q, out_context;
    rt_core_pkg::launch_t               lane_launch_q;
    rt_core_pkg::ray_axis_t             lane_axis_q;
    arrival_t                           lane_arrival;
    logic                               lane_out_valid, lane_out_ready;
    rt_contract_pkg::pair_index_t       pair;
    rt_core_pkg::image_view_t           lane_view;
    always_comb begin
      lane_view            = view;
      lane_view.pair_count = lane_limits[l].pair_count;
      lane_view.step_limit = lane_limits[l].step_limit;
    end
    // Loaded for this lane only.
    always_ff @(posedge clk_i) begin
      lane_valid_q        <= launch_valid_q[l] && rst_n[ResetLane+l];
      lane_axis_valid_q   <= axis_valid_q && 32'(axis_context_q) >> LaneContextBits == l && rst_n[ResetLane+l];
      lane_axis_context_q <= axis_context_q[LaneContextBits-1:0];
      lane_axis_q         <= axis_q;
      if (launch_valid_q[l]) begin
        lane_context_q <= launch_context_q[LaneContextBits-1:0];
        lane_launch_q  <= launch_q;
      end
    end
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
        .view_i          (lane_view),
        .axis_valid_i    (lane_axis_valid_q),
        .axis_context_i  (lane_axis_context_q),
        .axis_number_i   (lane_axis_q.axis),
        .axis_i          (lane_axis_q.walk),
        .launch_valid_i  (lane_valid_q),
        .launch_context_i(lane_context_q),
        .launch_i        (lane_launch_q),
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
        .up_o            (lane_up[l])
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
      .fetch_valid_o(source_valid[rt_core_pkg::SourceNode]),
      .fetch_ready_i(source_ready[rt_core_pkg::SourceNode]),
      .fetch_key_o  (node_key),
      .fetch_mshr_o (node_mshr),
      .miss_o       (node_miss),
      .fill_valid_i (near_fill_q.valid[rt_core_pkg::SourceNode]),
      .fill_mshr_i  (near_fill_q.mshr),
      .fill_data_i  (near_fill_q.data),
      .fill_last_i  (near_fill_q.last),
      .fill_error_i (near_fill_q.error)
  );
  assign source_request[rt_core_pkg::SourceNode] = request(
      view.pair_base, 30'({node_key, (LinePairBits + 4)'(0)}), 16 * LinePairs, rt_core_pkg::SourceNode, node_mshr);

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
    context_t ctx;
    status_t  event_code;
  } direct_t;
  logic [1:0] end_valid, end_ready;
  direct_t    end_data[2];
  logic       chosen_valid, chosen_ready, direct_valid, direct_ready;
  direct_t    chosen, direct;
  assign end_valid[0]  = arrival_valid && arrival_ends;
  assign end_data[0]   = '{ctx: arrival.ctx, event_code: arrival.arrival.event_code};
  assign arrival_ready = !arrival_ends || end_ready[0];
  rt_arbiter #(
      .NumInputs(2),
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

  // --- leaves ---
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
      .view_i              (view),
      .parent_links_i      (parent_links_q),
      .axis_valid_i        (stored_axis_valid_q),
      .axis_context_i      (stored_context_q),
      .axis_number_i       (stored_axis_q.axis),
      .axis_i              (stored_axis_q.walk),
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
      .out_valid_o         (end_valid[1]),
      .out_ready_i         (end_ready[1]),
      .out_context_o       (end_data[1].ctx),
      .out_event_o         (end_data[1].event_code),
      .fetch_valid_o       (source_valid[rt_core_pkg::SourceLeaf]),
      .fetch_ready_i       (source_ready[rt_core_pkg::SourceLeaf]),
      .fetch_key_o         (leaf_key),
      .fetch_mshr_o        (leaf_mshr),
      .fill_valid_i        (leaf_fill_q.valid[rt_core_pkg::SourceLeaf]),
      .fill_mshr_i         (leaf_fill_q.mshr),
      .fill_data_i         (leaf_fill_q.data),
      .fill_last_i         (leaf_fill_q.last),
      .fill_error_i        (leaf_fill_q.error),
      .events_o            (leaf_events),
      .leaf_o              (leaf_counted)
  );
  assign source_request[rt_core_pkg::SourceLeaf] =
      request(view.leaf_base, {1'b0, leaf_key.leaf, {rt_core_pkg::LineShift{1'b0}}},
              rt_core_pkg::LeafReadBytes + 8 * 32'(leaf_key.beats), rt_core_pkg::SourceLeaf, leaf_mshr);

  // --- references and tests ---
  logic                     iter_valid_q, references_valid_q, leave_valid_q;
  context_t                 iter_context_q, references_context_q, leave_context_q;
  rt_core_pkg::references_t references_q;
  rt_core_pkg::leave_t      leave_q;
  always_ff @(posedge clk_i) begin
    leave_valid_q        <= leave_valid && wires_rst_n;
    leave_context_q      <= leave_context;
    leave_q              <= leave;
    iter_valid_q         <= iter_valid && wires_rst_n;
    iter_context_q       <= iter_context;
    references_valid_q   <= references_valid && wires_rst_n;
    references_context_q <= references_context;
    references_q         <= references;
  end
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
  logic [23:0]                           list_key, triangle_key;
  logic [rt_core_pkg::MshrIdBits-1:0]    list_mshr, triangle_mshr;
  rt_reference_unit #(
      .Config(Config)
  ) u_references (
      .clk_i,
      .rst_ni                (rst_n[ResetReferences]),
      .flush_i               (unit_flush[2]),
      .flushing_o            (flushing[2]),
      .view_i                (view),
      .mailbox_i             (mailbox_q),
      .axis_valid_i          (stored_axis_valid_q),
      .ray_context_i         (stored_context_q),
      .axis_number_i         (stored_axis_q.axis),
      .axis_i                ('{direction: stored_axis_q.direction, origin: stored_axis_q.walk.origin}),
      .ray_valid_i           (stored_ray_q),
      .ray_any_i             (stored_any_q),
      .references_valid_i    (references_valid_q),
      .references_context_i  (references_context_q),
      .references_i          (references_q),
      .in_valid_i            (iter_valid_q),
      .in_context_i          (iter_context_q),
      .has_hit_i             (has_hit),
      .out_valid_o           (test_valid),
      .out_ready_i           (test_ready),
      .out_data_o            (test_data),
      .out_context_o         (test_tag.ctx),
      .out_test_o            (test_tag.test),
      .out_last_o            (test_tag.last),
      .out_event_o           (test_tag.event_code),
      .list_fetch_valid_o    (source_valid[rt_core_pkg::SourceList]),
      .list_fetch_ready_i    (source_ready[rt_core_pkg::SourceList]),
      .list_fetch_key_o      (list_key),
      .list_fetch_mshr_o     (list_mshr),
      .list_fill_valid_i     (far_fill_q.valid[rt_core_pkg::SourceList]),
      .triangle_fetch_valid_o(source_valid[rt_core_pkg::SourceTriangle]),
      .triangle_fetch_ready_i(source_ready[rt_core_pkg::SourceTriangle]),
      .triangle_fetch_key_o  (triangle_key),
      .triangle_fetch_mshr_o (triangle_mshr),
      .triangle_fill_valid_i (far_fill_q.valid[rt_core_pkg::SourceTriangle]),
      .fill_mshr_i           (far_fill_q.mshr),
      .fill_data_i           (far_fill_q.data),
      .fill_last_i           (far_fill_q.last),
      .fill_error_i          (far_fill_q.error),
      .events_o              (reference_events),
      .list_hit_o            (list_hit),
      .list_miss_o           (list_miss),
      .skipped_o             (skipped)
  );
  assign source_request[rt_core_pkg::SourceList] =
      request(view.list_base, {list_key, {rt_core_pkg::LineShift{1'b0}}}, 64, rt_core_pkg::SourceList, list_mshr);
  assign source_request[rt_core_pkg::SourceTriangle] =
      request(view.triangle_base, {triangle_key, {rt_core_pkg::LineShift{1'b0}}}, rt_contract_pkg::TriangleUsedBits / 8, rt_core_pkg::SourceTriangle, triangle_mshr);

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
  rt_tri_test #(
      .tag_t(test_tag_t)
  ) u_tri_test (
      .clk_i,
      .rst_ni     (rst_n[ResetTests]),
      .in_valid_i (entering_valid),
      .in_ready_o (entering_ready),
      .in_data_i  (entering.data),
      .in_tag_i   (entering.tag),
      .out_valid_o(tri_valid),
      .out_ready_i(tri_ready),
      .out_data_o (tri_data),
      .out_tag_o  (tri_tag)
  );

  // --- results ---
  logic                                  finish_valid, finish_ready;
  rt_contract_pkg::hit_finish_in_record_t finish;
  logic [31:0]                           finish_ray;
  rt_result_unit #(
      .Config(Config)
  ) u_results (
      .clk_i,
      .rst_ni              (rst_n[ResetResults]),
      .parent_links_i      (parent_links_q),
      .ray_valid_i     (launch_ray_q),
      .ray_context_i   (launch_context_q),
      .ray_i           (ray_info_q),
      .leave_valid_i   (leave_valid_q),
      .leave_context_i (leave_context_q),
      .leave_i         (leave_q),
      .direct_valid_i  (direct_valid),
      .direct_ready_o  (direct_ready),
      .direct_context_i(direct.ctx),
      .direct_event_i  (direct.event_code),
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
      .finish_ray_o    (finish_ray),
      .free_valid_o    (free_valid),
      .free_context_o  (free_context)
  );

  rt_hit_finish #(
      .tag_t(logic [31:0])
  ) u_hit_finish (
      .clk_i,
      .rst_ni     (rst_n[ResetFinish]),
      .in_valid_i (finish_valid),
      .in_ready_o (finish_ready),
      .in_data_i  (finish),
      .in_tag_i   (finish_ray),
      .out_valid_o(hit_valid_o),
      .out_ready_i(hit_ready_i),
      .out_data_o (hit_o),
      .out_tag_o  (hit_ray_o)
  );

  // --- counters: the order is that of the register map (rt_top) ---
  function automatic rt_core_pkg::counter_step_t one(logic event_bit);
    return rt_core_pkg::counter_step_t'(event_bit);
  endfunction
  logic [Lanes-1:0] lane_hit, lane_busy, lane_starved;
  logic             leaf_blocked, reference_blocked, test_busy, test_starved;
  for (genvar l = 0; l < int'(Lanes); l++) begin : gen_events
    always_ff @(posedge clk_i) begin
      lane_hit[l]     <= lane_events[l].hit;
      lane_busy[l]    <= lane_events[l].busy;
      lane_starved[l] <= !lane_events[l].busy && lane_events[l].starved;
    end
  end
  assign leaf_blocked      = !leaf_events.busy && !leaf_events.starved;
  assign reference_blocked = !reference_events.busy && !reference_events.starved;
  assign test_busy         = test_valid;
  assign test_starved      = !test_valid && reference_events.starved;
  rt_core_pkg::counter_step_t counter_step[rt_core_pkg::CounterCount];
  always_ff @(posedge clk_i) counter_step_o <= counter_step;
  always_comb begin
    for (int unsigned i = 0; i < rt_core_pkg::CounterCount; i++) counter_step[i] = '0;
    counter_step[0]  = one(1'b1);
    counter_step[1]  = one(hit_taken);
    counter_step[2]  = one(hit_fault);
    counter_step[3]  = rt_core_pkg::counter_step_t'($countones(lane_down));
    counter_step[4]  = rt_core_pkg::counter_step_t'($countones(lane_up));
    counter_step[5]  = one(leaf_counted);
    counter_step[6]  = one(test_valid && test_tag.test);
    counter_step[7]  = one(skipped);
    counter_step[8]  = rt_core_pkg::counter_step_t'($countones(lane_hit));
    counter_step[9]  = one(node_miss);
    counter_step[10] = one(leaf_events.hit);
    counter_step[11] = one(leaf_events.miss);
    counter_step[12] = one(list_hit);
    counter_step[13] = one(list_miss);
    counter_step[14] = one(reference_events.hit);
    counter_step[15] = one(reference_events.miss);
    // 16, 17, 27 .. 29: the bus, in rt_top.
    counter_step[18] = rt_core_pkg::counter_step_t'($countones(lane_busy));
    counter_step[19] = rt_core_pkg::counter_step_t'($countones(lane_starved));
    counter_step[20] = rt_core_pkg::counter_step_t'($countones(~(lane_busy | lane_starved)));
    counter_step[21] = one(leaf_events.busy);
    counter_step[22] = one(!leaf_events.busy && leaf_events.starved);
    counter_step[23] = one(leaf_blocked);
    counter_step[24] = one(test_busy);
    counter_step[25] = one(test_starved);
    counter_step[26] = one(!test_busy && !test_starved);
    counter_step[30] = one(reference_events.busy);
    counter_step[31] = one(!reference_events.busy && reference_events.starved);
    counter_step[32] = one(reference_blocked);
    counter_step[33] = rt_core_pkg::counter_step_t'(contexts_used);
  end
endmodule
