// Ray unit: reads rays in bursts, prepares them (rt_ray_setup) and gives each a free context.
//
// Reads       Blocks of RaysPerBurst rays, aligned, so that no burst crosses 4 KB; as many in flight as the ray FIFO has room for.
//             One id, so the answers come in order.
// Context     Consecutive rays go to one lane, BlockRays at a time, as long as it has a free context; otherwise to any lane.
// Launch      launch_valid_o with everything that the units keep of a ray; all of them take it in the same clock.
// Faults      A ray that could not be read, or that rt_ray_setup rejects, is launched with the fault and ends at once in its lane.
`include "rt_assert.svh"
module rt_ray_unit #(
    parameter rt_core_pkg::config_t Config = rt_core_pkg::ConfigEcp5,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts),
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,
    input  logic [31:0]                      count_i,
    input  rt_contract_pkg::position_t [5:0] box_i,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic [DataBits-1:0]              fill_data_i,
    input  logic                             fill_error_i,
    output logic                             launch_valid_o,
    input  logic                             launch_ready_i,
    output logic [ContextBits-1:0]           launch_context_o,
    output rt_core_pkg::launch_t             launch_o,
    output rt_core_pkg::walk_ray_t           walk_ray_o,
    output rt_core_pkg::test_ray_t           test_ray_o,
    output rt_core_pkg::ray_info_t           info_o,
    input  logic                             free_valid_i,
    input  logic [ContextBits-1:0]           free_context_i,
    output logic [ContextBits:0]             used_o  // contexts that hold a ray
);
  localparam int unsigned RaysPerBurst = 4;
  localparam int unsigned BlockRays = 8;
  localparam int unsigned QueueRays = 16;
  localparam int unsigned RayBeats = rt_contract_pkg::RayUsedBits / DataBits;
  localparam int unsigned BeatBits = $clog2(RayBeats);
  localparam int unsigned RayShift = $clog2(rt_contract_pkg::RayBytes);
  localparam int unsigned RoomBits = $clog2(QueueRays + 1);
  localparam int unsigned ContextsPerLane = Config.contexts_per_lane;
  localparam int unsigned BlockBits = $clog2(BlockRays);
  localparam int unsigned LaneBits = Config.lanes > 1 ? $clog2(Config.lanes) : 1;

  typedef struct packed {
    logic                        error;
    rt_contract_pkg::ray_record_t ray;
  } read_t;
  typedef struct packed {
    logic        error;
    logic [31:0] index;
  } tag_t;

  // --- requests ---
  logic [31:0]                      left_q;
  logic [rt_core_pkg::AddrBits-1:0] addr_q;
  logic [RoomBits-1:0]              room_q;  // rays that may still be asked for
  logic [2:0]                       to_boundary, burst;
  logic                             fetch_go, ray_leaves;
  logic                             fetch_valid_q;
  rt_core_pkg::read_request_t       fetch_q;

  assign to_boundary = 3'(RaysPerBurst) - 3'(addr_q[RayShift+:2]);
  assign burst       = left_q < 32'(to_boundary) ? left_q[2:0] : to_boundary;
  assign fetch_go    = left_q != '0 && room_q >= RoomBits'(RaysPerBurst) && (!fetch_valid_q || fetch_ready_i);
  always_ff @(posedge clk_i) begin
    if (start_i) begin
      left_q <= count_i;
      addr_q <= base_i;
    end else if (fetch_go) begin
      left_q <= left_q - 32'(burst);
      addr_q <= addr_q + rt_core_pkg::AddrBits'({burst, RayShift'(0)});
    end
    room_q <= room_q - (fetch_go ? RoomBits'(burst) : '0) + RoomBits'(ray_leaves);
    if (fetch_go) begin
      fetch_valid_q <= 1'b1;
      fetch_q <= '{
          addr: addr_q,
          len: 8'(int'(burst) * RayBeats - 1),
          source: rt_core_pkg::SourceBits'(rt_core_pkg::SourceRay),
          mshr: '0
      };
    end else if (fetch_ready_i) fetch_valid_q <= 1'b0;
    if (!rst_ni) begin
      left_q        <= '0;
      room_q        <= RoomBits'(QueueRays);
      fetch_valid_q <= 1'b0;
    end
  end
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_o       = fetch_q;

  // --- answers: beats to rays ---
  logic [rt_contract_pkg::RayUsedBits-1:0] gather_q;
  logic [BeatBits-1:0]                     beat_q;
  logic                                    error_q, push_q, push_error_q;
  always_ff @(posedge clk_i) begin
    push_q <= 1'b0;
    if (fill_valid_i) begin
      gather_q     <= {fill_data_i, gather_q[rt_contract_pkg::RayUsedBits-1:DataBits]};
      beat_q       <= beat_q + 1'b1;
      push_q       <= beat_q == BeatBits'(RayBeats - 1);
      push_error_q <= error_q || fill_error_i;
      error_q      <= beat_q != BeatBits'(RayBeats - 1) && (error_q || fill_error_i);
    end
    if (!rst_ni) begin
      beat_q  <= '0;
      push_q  <= 1'b0;
      error_q <= 1'b0;
    end
  end

  logic  queue_valid, queue_ready, setup_ready, push_room;
  read_t queue_data;
  logic [RoomBits-1:0] queue_usage_unused;
  rt_fifo #(
      .Depth (QueueRays),
      .data_t(read_t)
  ) u_queue (
      .clk_i,
      .rst_ni,
      .in_valid_i (push_q),
      .in_ready_o (push_room),
      .in_data_i  ('{error: push_error_q, ray: gather_q}),
      .out_valid_o(queue_valid),
      .out_ready_i(queue_ready),
      .out_data_o (queue_data),
      .usage_o    (queue_usage_unused)
  );
  assign queue_ready = setup_ready;
  assign ray_leaves  = queue_valid && queue_ready;

  logic [31:0] index_q;
  always_ff @(posedge clk_i) begin
    if (start_i) index_q <= '0;
    else if (ray_leaves) index_q <= index_q + 1'b1;
  end

  rt_contract_pkg::ray_setup_in_record_t  setup_in;
  rt_contract_pkg::ray_setup_out_record_t setup_out;
  tag_t                                   setup_tag;
  logic                                   setup_valid, setup_take;
  always_comb begin
    setup_in           = '0;
    setup_in.origin    = queue_data.ray.origin;
    setup_in.direction = queue_data.ray.direction;
    setup_in.t_max     = queue_data.ray.t_max;
    setup_in.any       = queue_data.ray.any;
    setup_in.box       = box_i;
  end
  rt_ray_setup #(
      .tag_t(tag_t)
  ) u_setup (
      .clk_i,
      .rst_ni,
      .in_valid_i (queue_valid),
      .in_ready_o (setup_ready),
      .in_data_i  (setup_in),
      .in_tag_i   ('{error: queue_data.error, index: index_q}),
      .out_valid_o(setup_valid),
      .out_ready_i(setup_take),
      .out_data_o (setup_out),
      .out_tag_o  (setup_tag)
  );

  // --- a free context ---
  logic [Contexts-1:0]    free_q, free_d, in_lane, pool, picked;
  logic [LaneBits-1:0]    lane_q;
  logic [BlockBits-1:0]   block_q;
  logic [ContextBits-1:0] pick;
  logic                   pick_valid, launch;
  logic [ContextBits:0]   used_q;

  always_comb begin
    for (int unsigned i = 0; i < Contexts; i++) in_lane[i] = free_q[i] && LaneBits'(i / ContextsPerLane) == lane_q;
  end
  assign pool = in_lane != '0 ? in_lane : free_q;
  rt_pick #(
      .Count(Contexts)
  ) u_pick (
      .clk_i,
      .rst_ni,
      .pool_i  (pool),
      .take_i  (launch),
      .valid_o (pick_valid),
      .onehot_o(picked),
      .index_o (pick)
  );
  assign launch_valid_o = setup_valid && pick_valid;
  assign launch         = launch_valid_o && launch_ready_i;
  assign setup_take     = pick_valid && launch_ready_i;

  always_comb begin
    free_d = launch ? free_q & ~picked : free_q;
    if (free_valid_i) free_d[free_context_i] = 1'b1;
  end
  always_ff @(posedge clk_i) begin
    free_q <= free_d;
    used_q <= used_q + (ContextBits + 1)'(launch) - (ContextBits + 1)'(free_valid_i);
    if (launch) begin
      block_q <= block_q + 1'b1;
      if (block_q == '1) lane_q <= lane_q == LaneBits'(Config.lanes - 1) ? '0 : lane_q + 1'b1;
    end
    if (!rst_ni) begin
      free_q  <= '1;
      used_q  <= '0;
      lane_q  <= '0;
      block_q <= '0;
    end
  end
  assign used_o = used_q;

  assign launch_context_o = pick;
  always_comb begin
    launch_o = '0;
    if (setup_tag.error) launch_o.fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBusError);
    else if (!setup_out.valid[0]) launch_o.fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRay);
    walk_ray_o = '{
        negative: setup_out.negative,
        zero: setup_out.zero,
        shift: setup_out.shift,
        reciprocal: setup_out.reciprocal,
        origin: setup_out.origin
    };
    test_ray_o = '{any: setup_out.any, direction: setup_out.direction, origin: setup_out.origin};
    info_o     = '{index: setup_tag.index, any: setup_out.any, t_max: setup_out.t_max};
  end

  `RT_ASSERT(QueueHasRoom, !push_q || push_room)
  `RT_ASSERT(FreesWhatIsUsed, !free_valid_i || !free_q[free_context_i])
  `RT_ASSERT(BlockIsPowerOfTwo, BlockRays == (1 << BlockBits))
endmodule
