// Ray unit: reads rays in bursts, prepares them (rt_ray_setup) and gives each a free context.
//
// Order       row_i = 0: one after the other. Otherwise the rays are an image with rows of row_i, visited in tiles of TileWidth x TileHeight,
//             row by row: neighbours above and below need the same leaves and triangles as those beside, and are visited while these are
//             cached. Tiles are high, so that an image has few bands of them: what lies across two bands is fetched twice.
//             Any row_i is safe: every index below count_i is visited once (rows are ignored where their sums could overflow).
// Reads       Only the beats that hold fields; where that leaves out the end of a record, one ray a burst. Otherwise at most RaysPerBurst
//             rays, within an aligned block of as many, so that no burst crosses 4 KB; as many in flight as there is room
//             for their beats. One id, so the answers come in order; u_order remembers which rays they are.
// Rate        One burst in Settle + 1 clocks, one launch in RayBeats + 1 or three (rt_ray_setup): a ray is traced for many more, so index and
//             address are found step by step, each in a register, and a ray is put together beat by beat.
// Context     The first rays go to the lanes in turn, BlockRays to each; the following ones get contexts in the order in which they became free.
// Launch      The axes of a ray go out first, one in a clock, to the units that keep them; launch_valid_o with the last one, and with everything else.
//             A unit may take axes of a context whenever they come: it has no ray until the launch.
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
    input  logic [31:0]                      row_i,
    input  rt_contract_pkg::position_t [5:0] box_i,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic [DataBits-1:0]              fill_data_i,
    input  logic                             fill_error_i,
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
  localparam int unsigned QueueRays = 16;
  localparam int unsigned FieldBits = 3 * rt_contract_pkg::PositionBits + 3 * rt_contract_pkg::DirectionBits +
                                      rt_contract_pkg::TLimitBits + rt_contract_pkg::FlagBits;
  localparam int unsigned RayBeats = (FieldBits + DataBits - 1) / DataBits;
  localparam int unsigned RaysPerBurst = RayBeats * DataBits == rt_contract_pkg::RayBytes * 8 ? 4 : 1;
  localparam int unsigned BeatBits = $clog2(RayBeats);
  localparam int unsigned RayShift = $clog2(rt_contract_pkg::RayBytes);
  localparam int unsigned RoomBits = $clog2(QueueRays + 1);
  localparam int unsigned BlockBits = $clog2(BlockRays);
  localparam int unsigned LaneBits = Config.lanes > 1 ? $clog2(Config.lanes) : 1;

  typedef struct packed {
    logic        error;
    logic [31:0] index;
  } tag_t;

  // --- requests: a position in the image, advanced by a burst or to the next row of the tile ---
  localparam int unsigned TileWidth = 4;
  localparam int unsigned TileHeight = 64;
  localparam int unsigned TileBits = $clog2(TileWidth);
  localparam int unsigned LineBits = $clog2(TileHeight);
  typedef struct packed {
    logic [31:0] index;
    logic [2:0]  count;
  } order_t;
  logic [31:0]                      left_q;      // rays not asked for
  logic [31:0]                      band_q;      // index of the first ray of the row of tiles
  logic [31:0]                      line_q;      // index of the first ray of the row
  logic [31:0]                      column_q;    // of the tile
  logic [LineBits-1:0]              line_number_q;
  logic [TileBits:0]                done_q;      // rays of this row of the tile
  logic [RoomBits-1:0]              room_q;      // rays that may still be asked for
  logic                             fetch_go, fetch_open, ray_leaves_q, order_room, order_valid, row_ends, last_line, burst_ends;
  logic                             fetch_valid_q;
  rt_core_pkg::read_request_t       fetch_q;
  order_t                           order;

  // What follows from the position, a register after each sum or comparison; settle_q counts down until all of it is there.
  localparam int unsigned Settle = 5;
  localparam int unsigned SettleBits = $clog2(Settle + 1);
  logic [SettleBits-1:0]            settle_q;
  logic [31:0]                      row_q, tile_q, tile_left_q, index_q, in_row_q, in_list_q;
  logic [rt_core_pkg::AddrBits-1:0] addr_q;
  logic [2:0]                       to_boundary, burst_q;
  logic [TileBits:0]                in_tile_q;
  logic                             last_tile_q;
  assign to_boundary = RaysPerBurst > 1 ? 3'(RaysPerBurst) - 3'(addr_q[RayShift+:2]) : 3'd1;
  always_ff @(posedge clk_i) begin
    // A band of tiles beyond the last ray still fits 32 bits.
    row_q <= (row_i < count_i && count_i[31:31-LineBits] == '0) ? row_i : '0;
    // 1: the tile's row. Without rows there is one, of all rays.
    tile_q      <= line_q + column_q;
    tile_left_q <= (row_q == '0 ? count_i : row_q) - column_q;
    in_tile_q   <= (TileBits + 1)'(TileWidth) - done_q;
    // 2
    index_q     <= tile_q + 32'(done_q);
    in_row_q    <= tile_left_q - 32'(done_q);
    last_tile_q <= row_q != '0 && tile_left_q <= 32'(TileWidth);
    // 3
    in_list_q <= index_q < count_i ? count_i - index_q : '0;
    addr_q    <= base_i + rt_core_pkg::AddrBits'({index_q, RayShift'(0)});
    // 4
    burst_q <= smallest(to_boundary, in_tile_q, in_row_q, in_list_q);
  end
  function automatic logic [2:0] smallest(logic [2:0] boundary, logic [TileBits:0] tile, logic [31:0] image_row, logic [31:0] list);
    smallest = boundary;
    if ((TileBits + 1)'(smallest) > tile) smallest = tile[2:0];
    if (32'(smallest) > image_row) smallest = image_row[2:0];
    if (32'(smallest) > list) smallest = list[2:0];
  endfunction

  assign fetch_open = settle_q == '0 && left_q != '0 && room_q >= RoomBits'(RaysPerBurst) && order_room && (!fetch_valid_q || fetch_ready_i);
  assign fetch_go   = fetch_open && burst_q != '0;
  assign row_ends   = fetch_open && ((TileBits + 1)'(burst_q) == in_tile_q || 32'(burst_q) == in_row_q || 32'(burst_q) == in_list_q);
  assign last_line  = row_q == '0 || line_number_q == LineBits'(TileHeight - 1);
  always_ff @(posedge clk_i) begin
    if (start_i || fetch_open) settle_q <= SettleBits'(Settle);
    else if (settle_q != '0) settle_q <= settle_q - 1'b1;
    if (start_i) begin
      left_q        <= count_i;
      band_q        <= '0;
      line_q        <= '0;
      column_q      <= '0;
      line_number_q <= '0;
      done_q        <= '0;
    end else begin
      if (fetch_go) left_q <= left_q - 32'(burst_q);
      if (row_ends) begin
        done_q        <= '0;
        line_number_q <= last_line ? '0 : line_number_q + 1'b1;
        line_q        <= last_line ? band_q : line_q + row_q;
        if (last_line) begin
          column_q <= column_q + 32'(TileWidth);
          if (last_tile_q) begin
            column_q <= '0;
            band_q   <= line_q + row_q;
            line_q   <= line_q + row_q;
          end
        end
      end else if (fetch_go) begin
        done_q <= done_q + (TileBits + 1)'(burst_q);
      end
    end
    room_q <= room_q - (fetch_go ? RoomBits'(burst_q) : '0) + RoomBits'(ray_leaves_q);
    if (fetch_go) begin
      fetch_valid_q <= 1'b1;
      fetch_q <= '{
          addr: addr_q,
          len: RaysPerBurst == 1 ? 8'(RayBeats - 1) : (8'(burst_q) << BeatBits) - 8'd1,
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
  // Rays in bursts of one at worst.
  localparam int unsigned OrderBits = $clog2(QueueRays + 1);
  logic [OrderBits-1:0] order_usage_unused;
  rt_fifo #(
      .Depth (QueueRays),
      .data_t(order_t)
  ) u_order (
      .clk_i,
      .rst_ni,
      .in_valid_i (fetch_go),
      .in_ready_o (order_room),
      .in_data_i  ('{index: index_q, count: burst_q}),
      .out_valid_o(order_valid),
      .out_ready_i(burst_ends),
      .out_data_o (order),
      .usage_o    (order_usage_unused)
  );
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_o       = fetch_q;

  // --- answers: beats wait in a block RAM, and are put together to a ray when rt_ray_setup has taken the one before ---
  typedef struct packed {
    logic                error;
    logic [DataBits-1:0] data;
  } beat_t;
  localparam int unsigned QueueBeats = QueueRays * RayBeats;
  beat_t                          fill_q, beat;
  logic                           fill_valid_q, beat_room, beat_valid, beat_take;
  logic [$clog2(QueueBeats+1)-1:0] beat_usage_unused;
  always_ff @(posedge clk_i) begin
    fill_valid_q <= fill_valid_i && rst_ni;
    fill_q       <= '{error: fill_error_i, data: fill_data_i};
  end
  rt_fifo #(
      .Depth   (QueueBeats),
      .BlockRam(1'b1),
      .data_t  (beat_t)
  ) u_beats (
      .clk_i,
      .rst_ni,
      .in_valid_i (fill_valid_q),
      .in_ready_o (beat_room),
      .in_data_i  (fill_q),
      .out_valid_o(beat_valid),
      .out_ready_i(beat_take),
      .out_data_o (beat),
      .usage_o    (beat_usage_unused)
  );

  logic [RayBeats-1:0][DataBits-1:0] gather_q;
  logic [BeatBits-1:0]               beat_q;  // of the ray that is being put together
  logic                              gathered_q, ray_valid_q, ray_error_q, ray_taken, last_beat;
  logic [31:0]                       ray_index_q;
  logic [2:0]                        ray_number_q;  // rays of the oldest burst before this one
  rt_contract_pkg::ray_record_t      ray;
  assign beat_take = !gathered_q && !ray_valid_q;
  assign last_beat = beat_valid && beat_take && beat_q == BeatBits'(RayBeats - 1);
  assign burst_ends = gathered_q && ray_number_q + 3'd1 == order.count;
  assign ray       = rt_contract_pkg::RayUsedBits'(gather_q);
  always_ff @(posedge clk_i) begin
    gathered_q <= last_beat;
    if (ray_taken) ray_valid_q <= 1'b0;
    if (beat_valid && beat_take) begin
      gather_q    <= {beat.data, gather_q[RayBeats-1:1]};
      beat_q      <= last_beat ? '0 : beat_q + 1'b1;
      ray_error_q <= beat.error || (beat_q != '0 && ray_error_q);
    end
    if (gathered_q) begin
      ray_valid_q  <= 1'b1;
      ray_index_q  <= order.index + 32'(ray_number_q);
      ray_number_q <= burst_ends ? '0 : ray_number_q + 3'd1;
    end
    if (!rst_ni) begin
      gathered_q   <= 1'b0;
      ray_valid_q  <= 1'b0;
      beat_q       <= '0;
      ray_number_q <= '0;
    end
  end
  always_ff @(posedge clk_i) ray_leaves_q <= ray_taken && rst_ni;

  rt_contract_pkg::ray_setup_in_record_t  setup_in;
  rt_contract_pkg::ray_setup_out_record_t setup_out;
  tag_t                                   setup_tag;
  logic                                   setup_valid, setup_ready, setup_take;
  assign ray_taken = ray_valid_q && setup_ready;
  always_comb begin
    setup_in           = '0;
    setup_in.origin    = ray.origin;
    setup_in.direction = ray.direction;
    setup_in.t_max     = ray.t_max;
    setup_in.any       = ray.any;
    setup_in.box       = box_i;
  end
  rt_ray_setup #(
      .tag_t(tag_t)
  ) u_setup (
      .clk_i,
      .rst_ni,
      .in_valid_i (ray_valid_q),
      .in_ready_o (setup_ready),
      .in_data_i  (setup_in),
      .in_tag_i   ('{error: ray_error_q, index: ray_index_q}),
      .out_valid_o(setup_valid),
      .out_ready_i(setup_take),
      .out_data_o (setup_out),
      .out_tag_o  (setup_tag)
  );

  // --- a free context, before a ray needs it: one that no ray has had yet, then those that were freed, in that order ---
  localparam int unsigned LaneContextBits = $clog2(Config.contexts_per_lane);
  logic [ContextBits-1:0]              next_context_q, freed_context;
  logic                                next_valid_q, launch, freed_valid, freed_take, freed_room, new_left_q;
  logic [ContextBits:0]                used_q;
  logic [$clog2(Contexts+1)-1:0]       freed_usage_unused;
  // The next context that has had no ray: BlockRays of a lane, then as many of the next lane.
  logic [BlockBits-1:0]                new_in_block_q;
  logic [LaneBits-1:0]                 new_lane_q;
  logic [LaneContextBits-1:BlockBits]  new_block_q;
  logic                                new_taken, new_block_ends, new_turn_ends;
  assign new_taken      = !next_valid_q && new_left_q;
  assign new_block_ends = new_taken && new_in_block_q == '1;
  assign new_turn_ends  = new_block_ends && new_lane_q == LaneBits'(Config.lanes - 1);
  assign freed_take = !next_valid_q && !new_left_q && freed_valid;
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
    if (launch) next_valid_q <= 1'b0;
    if (!next_valid_q) begin
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
    info_o = '{index: setup_tag.index, any: setup_out.any, t_max: setup_out.t_max};
  end

  `RT_ASSERT(RayIsExpected, !gathered_q || order_valid)
  `RT_ASSERT(BeatsHaveRoom, !fill_valid_q || beat_room)
  `RT_ASSERT(FreesWhatIsUsed, !free_valid_i || (used_q != '0 && freed_room))
  `RT_ASSERT(BlockIsPowerOfTwo, BlockRays == (1 << BlockBits))
endmodule
