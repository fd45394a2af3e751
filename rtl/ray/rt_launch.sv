// SPDX-License-Identifier: Apache-2.0
// Launch: takes rays from a source, prepares them (rt_ray_setup) and gives each a free context.
//
// Context     The first rays go to the lanes in turn, BlockRays to each; the following ones get contexts in the order in which they became free.
// Launch      The axes of a ray go out first, one in a clock, to the units that keep them; launch_valid_o with the last one, and with everything else.
//             A unit may take axes of a context whenever they come: it has no ray until the launch.
// Rate        One launch in three clocks or in the interval of rt_ray_setup, whichever is longer.
// Faults      A ray that could not be read, or that rt_ray_setup rejects, is launched with the fault and ends at once in its lane.
`include "rt_assert.svh"
module rt_launch #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  rt_contract_pkg::position_t [5:0] box_i,
    input  logic                             ray_valid_i,
    output logic                             ray_ready_o,
    input  rt_core_pkg::tagged_ray_t         ray_i,
    output logic                             axis_valid_o,
    output rt_core_pkg::ray_axis_t           axis_o,
    output logic                             launch_valid_o,
    input  logic                             launch_ready_i,
    output logic [ContextBits-1:0]           launch_context_o,  // of the axes, too
    output rt_core_pkg::launch_t             launch_o,
    output rt_core_pkg::ray_info_t           info_o,
    input  logic                             free_valid_i,
    input  logic [ContextBits-1:0]           free_context_i,
    output logic [ContextBits:0]             used_o  // contexts that hold a ray
);
  localparam int unsigned BlockRays = 8;
  localparam int unsigned BlockBits = $clog2(BlockRays);
  localparam int unsigned LaneBits = Config.lanes > 1 ? $clog2(Config.lanes) : 1;
  localparam int unsigned LaneContextBits = $clog2(Config.contexts_per_lane);
  // Otherwise a block of rays is all of a lane's contexts, and there is no number of the block.
  `RT_ASSERT_INIT(BlockIsPowerOfTwo, BlockRays == (1 << BlockBits))
  `RT_ASSERT_INIT(ContextsEnough, Config.contexts_per_lane >= 2 * BlockRays)

  typedef struct packed {
    logic                  error;
    rt_core_pkg::ray_tag_t tag;
  } tag_t;

  rt_contract_pkg::ray_setup_in_record_t  setup_in;
  rt_contract_pkg::ray_setup_out_record_t setup_out;
  tag_t                                   setup_tag;
  logic                                   setup_valid, setup_take;
  always_comb begin
    setup_in           = '0;
    setup_in.origin    = ray_i.origin;
    setup_in.direction = ray_i.direction;
    setup_in.t_max     = ray_i.t_max;
    setup_in.any       = ray_i.any;
    setup_in.box       = box_i;
  end
  rt_ray_setup #(
      .tag_t(tag_t)
  ) u_setup (
      .clk_i,
      .rst_ni,
      .in_valid_i (ray_valid_i),
      .in_ready_o (ray_ready_o),
      .in_data_i  (setup_in),
      .in_tag_i   ('{error: ray_i.error, tag: ray_i.tag}),
      .out_valid_o(setup_valid),
      .out_ready_i(setup_take),
      .out_data_o (setup_out),
      .out_tag_o  (setup_tag)
  );

  // --- a free context, before a ray needs it: one that no ray has had yet, then those that were freed, in that order ---
  logic [ContextBits-1:0]              next_context_q, freed_context;
  logic                                next_valid_q, launch, freed_valid, freed_take, freed_room, new_left_q;
  logic [ContextBits:0]                used_q;
  logic [$clog2(Contexts+1)-1:0]       freed_usage_unused;
  // The next context that has had no ray: BlockRays of a lane, then as many of the next lane.
  logic [BlockBits-1:0]                new_in_block_q;
  logic [LaneBits-1:0]                 new_lane_q;
  logic [LaneContextBits-1:BlockBits]  new_block_q;
  logic                                next_open, new_taken, new_block_ends, new_turn_ends;
  assign next_open      = !next_valid_q || launch;
  assign new_taken      = next_open && new_left_q;
  assign new_block_ends = new_taken && new_in_block_q == '1;
  assign new_turn_ends  = new_block_ends && new_lane_q == LaneBits'(Config.lanes - 1);
  assign freed_take = next_open && !new_left_q && freed_valid;
  rt_fifo #(
      .Depth (Contexts),
      .data_t(logic [ContextBits-1:0])
  ) u_freed (
      .clk_i,
      .rst_ni,
      .in_valid_i (free_valid_i),
      .in_ready_o (freed_room),
      .in_data_i  (free_context_i),
      .out_valid_o(freed_valid),
      .out_ready_i(freed_take),
      .out_data_o (freed_context),
      .usage_o    (freed_usage_unused)
  );
  logic [1:0] axis_q;
  logic       axis_is_last;
  assign axis_is_last   = axis_q == 2'(rt_core_pkg::Axes - 1);
  assign axis_valid_o   = setup_valid && next_valid_q;
  assign launch_valid_o = axis_valid_o && axis_is_last;
  assign launch         = launch_valid_o && launch_ready_i;
  assign setup_take     = next_valid_q && launch_ready_i && axis_is_last;
  always_ff @(posedge clk_i) begin
    if (axis_valid_o && !axis_is_last) axis_q <= axis_q + 1'b1;
    if (launch || !rst_ni) axis_q <= '0;
    used_q <= used_q + (ContextBits + 1)'(launch) - (ContextBits + 1)'(free_valid_i);
    if (next_open) begin
      next_valid_q   <= new_left_q || freed_valid;
      next_context_q <= new_left_q ? ContextBits'({new_lane_q, new_block_q, new_in_block_q}) : freed_context;
    end
    if (new_taken) new_in_block_q <= new_in_block_q + 1'b1;
    if (new_block_ends) new_lane_q <= new_turn_ends ? '0 : new_lane_q + 1'b1;
    if (new_turn_ends) begin
      new_block_q <= new_block_q + 1'b1;
      new_left_q  <= new_block_q != '1;
    end
    if (!rst_ni) begin
      used_q         <= '0;
      new_in_block_q <= '0;
      new_lane_q     <= '0;
      new_block_q    <= '0;
      new_left_q     <= 1'b1;
      next_valid_q   <= 1'b0;
    end
  end
  assign used_o = used_q;

  assign launch_context_o = next_context_q;
  always_comb begin
    launch_o = '0;
    if (Config.leaf_returns != 0) launch_o.t_near = setup_out.t_max;
    if (setup_tag.error) launch_o.fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBusError);
    else if (!setup_out.valid[0]) launch_o.fault = rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRay);
    axis_o = '{
        axis: axis_q,
        direction: setup_out.direction[axis_q],
        walk: '{
            negative: setup_out.negative[axis_q],
            zero: setup_out.zero[axis_q],
            shift: setup_out.shift[axis_q],
            reciprocal: setup_out.reciprocal[axis_q],
            origin: setup_out.origin[axis_q]
        }
    };
    info_o = '{tag: setup_tag.tag, any: setup_out.any, t_max: setup_out.t_max};
  end

  `RT_ASSERT(FreesWhatIsUsed, !free_valid_i || (used_q != '0 && freed_room))
endmodule
