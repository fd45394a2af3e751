// SPDX-License-Identifier: Apache-2.0
// Ray source of the AXI shell: reads the rays of a run in bursts and gives them to the core as a stream, tagged with their number.
//
// Order       row_i = 0: one after the other. Otherwise the rays are an image with rows of row_i, visited in tiles of TileWidth x TileHeight,
//             row by row: neighbours above and below need the same leaves and triangles as those beside, and are visited while these are
//             cached. Tiles are high, so that an image has few bands of them: what lies across two bands is fetched twice.
//             Any row_i is safe: every index below count_i is visited once (rows are ignored where their sums could overflow).
// Reads       Whole granules that hold the fields; where that leaves out the end of a record, one ray a burst. Otherwise at most RaysPerBurst
//             rays, within an aligned block of as many, so that no burst crosses 4 KB; as many in flight as there is room
//             for their beats. One id, so the answers come in order; u_order remembers which rays they are.
// Rate        The first burst of a tile's row in Settle + 1 clocks: index and address are found step by step, each in a register. The others in as many, or,
//             where a burst is one ray, in one clock each: what was found grows by one. A ray is put together beat by beat, in RayBeats clocks.
// Faults      A ray that could not be read is marked, and goes on.
// End         done_o from the clock after start_i until all rays are handed over is 0.
`include "rt_assert.svh"
module rt_ray_source #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,
    input  logic [31:0]                      count_i,
    input  logic [31:0]                      row_i,
    output logic                             done_o,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             ray_valid_o,
    input  logic                             ray_ready_i,
    output rt_core_pkg::tagged_ray_t         ray_o
);
  localparam int unsigned QueueRays = 16;
  localparam int unsigned FieldBits = 3 * rt_contract_pkg::PositionBits + 3 * rt_contract_pkg::DirectionBits +
                                      rt_contract_pkg::TLimitBits + rt_contract_pkg::FlagBits;
  // A granule may hold two rays; then a burst begins with a ray that is not wanted where the first wanted one is the second of its granule, and may
  // end with one.
  localparam int unsigned GranuleRays = Config.granule_bytes > rt_contract_pkg::RayBytes ? Config.granule_bytes / rt_contract_pkg::RayBytes : 1;
  `RT_ASSERT_INIT(GranuleOfRaysKnown, GranuleRays <= 2)
  localparam int unsigned RayBeats = GranuleRays > 1 ? rt_contract_pkg::RayBytes * 8 / DataBits :
      rt_core_pkg::read_bytes((FieldBits + 7) / 8, Config.granule_bytes) * 8 / DataBits;
  localparam int unsigned RaysPerBurst = RayBeats * DataBits == rt_contract_pkg::RayBytes * 8 ? 4 : 1;
  localparam int unsigned BeatBits = $clog2(RayBeats);
  localparam int unsigned RayShift = $clog2(rt_contract_pkg::RayBytes);
  localparam int unsigned RoomBits = $clog2(QueueRays + 1);

  // --- requests: a position in the image, advanced by a burst or to the next row of the tile ---
  localparam int unsigned TileWidth = 4;
  localparam int unsigned TileHeight = 64;
  localparam int unsigned TileBits = $clog2(TileWidth);
  localparam int unsigned LineBits = $clog2(TileHeight);
  typedef struct packed {
    logic [31:0] index;  // of the first ray that is wanted
    logic [2:0]  count;  // of these
    logic        skip;   // a ray before them is not
    logic [2:0]  total;  // rays that are read
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
  // The next ray of the row, whose burst is one as well.
  localparam bit SingleRays = RaysPerBurst == 1 && GranuleRays == 1;
  logic next_in_row;

  // What follows from the position, a register after each sum or comparison; settle_q counts down until all of it is there.
  localparam int unsigned Settle = 5;
  localparam int unsigned SettleBits = $clog2(Settle + 1);
  logic [SettleBits-1:0]            settle_q;
  logic [31:0]                      row_q, tile_q, tile_left_q, index_q, in_row_q, in_list_q;
  logic [32:0]                      behind;  // rays of the list from the next index_q on; negative where there are none
  localparam int unsigned AddrUnits = rt_core_pkg::AddrBits - RayShift;
  logic [33:0]                      behind_sum;
  logic [AddrUnits:0]               addr_sum;
  logic [TileBits:0]                done_ahead;
  logic [rt_core_pkg::AddrBits-1:0] addr_q;
  logic [2:0]                       to_boundary, burst_q, total;
  logic                             skip;
  logic [TileBits:0]                in_tile_q;
  logic                             last_tile_q;
  // What follows from the position takes the next ray in the clock in which it is reached, through the carries: count_i - index_q - next_in_row, and so on.
  assign done_ahead  = done_q + (TileBits + 1)'(next_in_row);
  assign behind_sum  = {33'(count_i), 1'b1} + {~33'(index_q), !next_in_row};
  assign behind      = behind_sum[33:1];
  assign addr_sum    = {base_i[rt_core_pkg::AddrBits-1:RayShift], 1'b1} + {AddrUnits'(index_q), next_in_row};
  assign to_boundary = RaysPerBurst > 1 ? 3'(RaysPerBurst) - 3'(addr_q[RayShift+:2]) : 3'd1;
  assign skip        = GranuleRays > 1 && addr_q[RayShift];
  assign total       = GranuleRays > 1 ? (burst_q + 3'(skip) + 3'd1) & 3'b110 : burst_q;
  always_ff @(posedge clk_i) begin
    // A band of tiles beyond the last ray still fits 32 bits.
    row_q <= (row_i < count_i && count_i[31:31-LineBits] == '0) ? row_i : '0;
    // 1: the tile's row. Without rows there is one, of all rays.
    tile_q      <= line_q + column_q;
    tile_left_q <= (row_q == '0 ? count_i : row_q) - column_q;
    in_tile_q   <= (TileBits + 1)'(TileWidth) - done_ahead;
    // 2
    index_q     <= tile_q + 32'(done_ahead);
    in_row_q    <= tile_left_q - 32'(done_ahead);
    last_tile_q <= row_q != '0 && (tile_left_q[31:TileBits] == '0 || tile_left_q == 32'(TileWidth));
    // 3
    in_list_q <= behind[32] ? '0 : behind[31:0];
    addr_q    <= {addr_sum[AddrUnits:1], RayShift'(0)};
    // 4
    burst_q <= smallest(to_boundary, in_tile_q, in_row_q, in_list_q);
  end
  function automatic logic [2:0] smallest(logic [2:0] boundary, logic [TileBits:0] tile, logic [31:0] image_row, logic [31:0] list);
    smallest = boundary;
    if ((TileBits + 1)'(smallest) > tile) smallest = tile[2:0];
    if (image_row[31:3] == '0 && smallest > image_row[2:0]) smallest = image_row[2:0];
    if (list[31:3] == '0 && smallest > list[2:0]) smallest = list[2:0];
  endfunction

  assign next_in_row = SingleRays && fetch_go && !row_ends;

  assign fetch_open = settle_q == '0 && left_q != '0 && room_q >= RoomBits'(RaysPerBurst) && order_room && (!fetch_valid_q || fetch_ready_i);
  assign fetch_go   = fetch_open && burst_q != '0;
  assign row_ends   = fetch_open && ((TileBits + 1)'(burst_q) == in_tile_q || 32'(burst_q) == in_row_q || 32'(burst_q) == in_list_q);
  assign last_line  = row_q == '0 || line_number_q == LineBits'(TileHeight - 1);
  always_ff @(posedge clk_i) begin
    if (start_i || (fetch_open && !next_in_row)) settle_q <= SettleBits'(Settle);
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
    room_q <= room_q - (fetch_go ? RoomBits'(total) : '0) + RoomBits'(ray_leaves_q);
    if (fetch_go) begin
      fetch_valid_q <= 1'b1;
      fetch_q <= '{
          addr: addr_q & ~(skip ? rt_core_pkg::AddrBits'(rt_contract_pkg::RayBytes) : '0),
          len: RaysPerBurst == 1 ? 8'(RayBeats - 1) : (8'(total) << BeatBits) - 8'd1,
          source: rt_core_pkg::SourceBits'(rt_config_pkg::SourceRay),
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
      .in_data_i  ('{index: index_q, count: burst_q, skip: skip, total: total}),
      .out_valid_o(order_valid),
      .out_ready_i(burst_ends),
      .out_data_o (order),
      .usage_o    (order_usage_unused)
  );
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_o       = fetch_q;

  // --- answers: beats wait in a block RAM, and are put together to a ray from the clock on in which rt_ray_setup takes the one before ---
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
  logic                              ray_valid_q, ray_error_q, ray_taken, last_beat, wanted;
  logic [31:0]                       ray_index_q;
  logic [2:0]                        ray_number_q;  // rays of the oldest burst before this one
  rt_contract_pkg::ray_record_t      ray;
  assign beat_take  = !ray_valid_q || ray_taken;
  assign last_beat  = beat_valid && beat_take && beat_q == BeatBits'(RayBeats - 1);
  assign burst_ends = last_beat && ray_number_q + 3'd1 == order.total;
  assign wanted     = ray_number_q >= 3'(order.skip) && ray_number_q < order.count + 3'(order.skip);
  assign ray        = rt_contract_pkg::RayUsedBits'(gather_q);
  always_ff @(posedge clk_i) begin
    if (beat_take) begin
      ray_valid_q <= last_beat && wanted;
      ray_index_q <= order.index + 32'(3'(ray_number_q - 3'(order.skip)));  // of a wanted ray it is not negative
    end
    if (beat_valid && beat_take) begin
      gather_q    <= {beat.data, gather_q[RayBeats-1:1]};
      beat_q      <= last_beat ? '0 : beat_q + 1'b1;
      ray_error_q <= beat.error || (beat_q != '0 && ray_error_q);
    end
    if (last_beat) ray_number_q <= burst_ends ? '0 : ray_number_q + 3'd1;
    if (!rst_ni) begin
      ray_valid_q  <= 1'b0;
      beat_q       <= '0;
      ray_number_q <= '0;
    end
  end
  always_ff @(posedge clk_i) ray_leaves_q <= (ray_taken || (last_beat && !wanted)) && rst_ni;

  assign ray_taken   = ray_valid_q && ray_ready_i;
  assign ray_valid_o = ray_valid_q;
  assign ray_o = '{
          tag: ray_index_q,
          error: ray_error_q,
          any: ray.any,
          t_max: ray.t_max,
          direction: ray.direction,
          origin: ray.origin
      };
  assign done_o = left_q == '0 && !order_valid && !ray_valid_q;

  `RT_ASSERT(RayIsExpected, !last_beat || order_valid)
  `RT_ASSERT(BeatsHaveRoom, !fill_valid_q || beat_room)
  `RT_ASSERT_STREAM(Rays, ray_valid_o, ray_ready_i, ray_o)
endmodule
