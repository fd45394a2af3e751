// SPDX-License-Identifier: Apache-2.0
// Sink of hits that makes pixels of them: reads the material of what is hit, lights it (rt_light), gathers the samples of a pixel.
//
// Samples     Hits from the core, misses from rt_raster, each with the tag {slot, pixel}. Every sample takes the same way, so nothing overtakes.
// Materials   8 bytes by triangle id, read where a colour is wanted and something is hit; not again for the same triangle as before. Up to Waiting reads are in
//             flight; one id, so the answers come in order. They are taken in every clock: each has its place in u_materials.
// Pixels      A word for each slot holds the sum and the number of its samples so far. With the last one the pixel leaves: 32 bits, or 64 of pixel_hit.
//             finished_* tells rt_raster that the slot is free again. Clear: every slot, from start_i on; samples wait.
// Rate        One sample in four clocks.
// Faults      unknown_o: what is hit has no material, or it could not be read; it looks like the background.
// End         idle_o: no sample is inside.
// Counterpart hls/top/pixels.cpp (retrace_shade), golden/engine/stages/shade.hpp.
`include "rt_assert.svh"
module rt_shade #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned GranuleBytes = 8
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  rt_contract_pkg::frame_record_t   frame_i,  // as the others, constant while anything is inside
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,   // of the materials, a multiple of 64
    input  logic [31:0]                      count_i,
    output logic                             idle_o,
    output logic                             unknown_o,
    input  logic                             hit_valid_i,
    output logic                             hit_ready_o,
    input  rt_core_pkg::tagged_hit_t         hit_i,
    input  logic                             miss_valid_i,
    output logic                             miss_ready_o,
    input  rt_core_pkg::ray_tag_t            miss_i,
    input  logic                             place_valid_i,
    input  rt_core_pkg::pixel_slot_t         place_slot_i,
    input  rt_core_pkg::pixel_place_t        place_i,
    output logic                             finished_valid_o,
    output rt_core_pkg::pixel_slot_t         finished_slot_o,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             pixel_valid_o,
    input  logic                             pixel_ready_i,
    output rt_core_pkg::pixel_t              pixel_o
);
  localparam int unsigned Waiting = 16;
  localparam int unsigned SlotBits = rt_core_pkg::PixelSlotBits;
  localparam int unsigned MaterialBits = 8 * rt_contract_pkg::MaterialBytes;
  localparam int unsigned MaterialShift = $clog2(rt_contract_pkg::MaterialBytes);
  localparam int unsigned ReadBytes = rt_core_pkg::read_bytes(rt_contract_pkg::MaterialBytes, GranuleBytes);
  localparam int unsigned Beats = ReadBytes * 8 / DataBits;
  localparam int unsigned BeatBits = Beats > 1 ? $clog2(Beats) : 1;
  localparam int unsigned PerBeat = DataBits / MaterialBits;
  localparam int unsigned PartBits = PerBeat > 1 ? $clog2(PerBeat) : 1;
  localparam int unsigned GranuleShift = $clog2(ReadBytes);
  typedef rt_contract_pkg::shade_t shade_t;
  typedef struct packed {
    rt_core_pkg::ray_tag_t         tag;
    logic                          hit;
    rt_contract_pkg::triangle_id_t id;
    rt_contract_pkg::t_limit_t     t;
  } sample_t;
  typedef struct packed {
    sample_t sample;
    logic    lit;    // has a material
    logic    fresh;  // that is read for it
  } waiting_t;
  typedef struct packed {
    logic [BeatBits-1:0] beat;
    logic [PartBits-1:0] part;
  } where_t;
  typedef struct packed {
    logic                              error;
    rt_contract_pkg::material_record_t record;
  } material_t;

  // --- samples in: hits and misses in turn, then a register, then whether there is a material ---
  logic    coloured, chosen_valid, chosen_ready, in_valid, in_ready, index_unused;
  sample_t offered[2], chosen, in;
  assign coloured   = frame_i.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelColour);
  assign offered[0] = '{
          tag: hit_i.tag,
          hit: hit_i.hit.status == rt_contract_pkg::status_t'(rt_contract_pkg::StatusHit),
          id: hit_i.hit.id,
          t: hit_i.hit.t
      };
  assign offered[1] = '{tag: miss_i, hit: 1'b0, id: '0, t: '0};
  logic [1:0] offered_ready;
  rt_arbiter #(
      .NumInputs(2),
      .data_t   (sample_t)
  ) u_samples (
      .clk_i,
      .rst_ni,
      .in_valid_i ({miss_valid_i, hit_valid_i}),
      .in_ready_o (offered_ready),
      .in_data_i  (offered),
      .in_last_i  ('1),
      .out_valid_o(chosen_valid),
      .out_ready_i(chosen_ready),
      .out_data_o (chosen),
      .out_index_o(index_unused)
  );
  assign hit_ready_o  = offered_ready[0];
  assign miss_ready_o = offered_ready[1];
  rt_skid #(
      .data_t(sample_t)
  ) u_in (
      .clk_i,
      .rst_ni,
      .in_valid_i (chosen_valid),
      .in_ready_o (chosen_ready),
      .in_data_i  (chosen),
      .out_valid_o(in_valid),
      .out_ready_i(in_ready),
      .out_data_o (in)
  );
  logic    known_valid_q, known_q, same_q, known_go, last_valid_q, waiting_room, fetch_free, where_room;
  sample_t known_sample_q;
  logic [31:0] last_id_q, last_id_d;
  logic        last_valid_d, fetch_go, fill_keep, fill_error;
  assign in_ready = !known_valid_q || known_go;
  assign known_go = known_valid_q && waiting_room && (!known_q || same_q || (fetch_free && where_room));
  always_ff @(posedge clk_i) begin
    if (in_ready) begin
      known_valid_q  <= in_valid;
      known_sample_q <= in;
      known_q        <= in.hit && coloured && in.id < count_i;
      // Of the sample before this one, which has passed or passes in this clock.
      same_q         <= last_valid_d && last_id_d == in.id;
    end
    last_valid_q <= last_valid_d;
    last_id_q    <= last_id_d;
    if (!rst_ni) known_valid_q <= 1'b0;
  end
  assign fetch_go     = known_go && known_q && !same_q;
  assign last_valid_d = !start_i && rst_ni && (last_valid_q || fetch_go);
  assign last_id_d    = fetch_go ? known_sample_q.id : last_id_q;
  assign unknown_o    = (known_go && known_sample_q.hit && coloured && !known_q) || (fill_keep && fill_error);

  // --- reads ---
  logic                             fetch_valid_q;
  logic [rt_core_pkg::AddrBits-1:0] fetch_addr_q;
  logic [rt_core_pkg::AddrBits-1:0] material_addr;
  where_t                           where_in, where;
  logic                             where_valid, fill_last;
  logic [BeatBits-1:0]              beat_q;
  assign material_addr = base_i + rt_core_pkg::AddrBits'({known_sample_q.id, MaterialShift'(0)});
  assign fetch_free    = !fetch_valid_q || fetch_ready_i;
  always_ff @(posedge clk_i) begin
    if (fetch_ready_i) fetch_valid_q <= 1'b0;
    if (fetch_go) begin
      fetch_valid_q <= 1'b1;
      fetch_addr_q  <= {material_addr[rt_core_pkg::AddrBits-1:GranuleShift], GranuleShift'(0)};
    end
    if (!rst_ni) fetch_valid_q <= 1'b0;
  end
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_o = '{
          addr: fetch_addr_q,
          len: 8'(Beats - 1),
          source: rt_core_pkg::SourceBits'(rt_config_pkg::SourceMaterial),
          mshr: '0
      };
  always_comb begin
    where_in = '0;
    if (PerBeat > 1) where_in.part = PartBits'(known_sample_q.id);
    if (Beats > 1) where_in.beat = BeatBits'(known_sample_q.id >> (PerBeat > 1 ? PartBits : 0));
  end
  localparam int unsigned UsageBits = $clog2(Waiting + 1);
  logic [UsageBits-1:0] where_usage_unused, waiting_usage_unused, material_usage_unused;
  rt_fifo #(
      .Depth (Waiting),
      .data_t(where_t)
  ) u_where (
      .clk_i,
      .rst_ni,
      .in_valid_i (fetch_go),
      .in_ready_o (where_room),
      .in_data_i  (where_in),
      .out_valid_o(where_valid),
      .out_ready_i(fill_valid_i && fill_last),
      .out_data_o (where),
      .usage_o    (where_usage_unused)
  );
  // Of the beats of an answer one is kept; an error in any of them is one of all.
  logic      error_q, material_room, material_valid, material_take;
  material_t material_in, material_next, material_q;
  logic [DataBits-1:0] kept_q, kept;
  assign fill_last  = beat_q == BeatBits'(Beats - 1);
  assign kept       = Beats == 1 || beat_q == where.beat ? fill_data_i : kept_q;
  assign fill_error = fill_error_i || error_q;
  assign fill_keep  = fill_valid_i && fill_last;
  always_ff @(posedge clk_i) begin
    if (fill_valid_i) begin
      kept_q  <= kept;
      beat_q  <= fill_last ? '0 : beat_q + 1'b1;
      error_q <= fill_error && !fill_last;
    end
    if (!rst_ni) begin
      beat_q  <= '0;
      error_q <= 1'b0;
    end
  end
  assign material_in = '{
          error: fill_error,
          record: kept[(PerBeat > 1 ? MaterialBits * where.part : 0)+:MaterialBits]
      };
  rt_fifo #(
      .Depth (Waiting),
      .data_t(material_t)
  ) u_materials (
      .clk_i,
      .rst_ni,
      .in_valid_i (fill_keep),
      .in_ready_o (material_room),
      .in_data_i  (material_in),
      .out_valid_o(material_valid),
      .out_ready_i(material_take),
      .out_data_o (material_next),
      .usage_o    (material_usage_unused)
  );

  // --- samples wait for their materials, then they are lit ---
  waiting_t waiting;
  logic     waiting_valid, waiting_take, light_in_ready;
  rt_fifo #(
      .Depth (Waiting),
      .data_t(waiting_t)
  ) u_waiting (
      .clk_i,
      .rst_ni,
      .in_valid_i (known_go),
      .in_ready_o (waiting_room),
      .in_data_i  ('{sample: known_sample_q, lit: known_q, fresh: known_q && !same_q}),
      .out_valid_o(waiting_valid),
      .out_ready_i(waiting_take),
      .out_data_o (waiting),
      .usage_o    (waiting_usage_unused)
  );
  typedef struct packed {
    sample_t sample;
    logic    lit;
  } lit_sample_t;
  logic         light_in_valid, lit_valid, lit_ready;
  material_t    material;
  lit_sample_t  lit;
  shade_t [2:0] lit_colour;
  assign material       = waiting.fresh ? material_next : material_q;
  assign light_in_valid = waiting_valid && (!waiting.fresh || material_valid);
  assign waiting_take   = light_in_valid && light_in_ready;
  assign material_take  = waiting_take && waiting.fresh;
  always_ff @(posedge clk_i) if (material_take) material_q <= material_next;
  rt_light #(
      .tag_t(lit_sample_t)
  ) u_light (
      .clk_i,
      .rst_ni,
      .frame_i,
      .in_valid_i (light_in_valid),
      .in_ready_o (light_in_ready),
      .in_data_i  (material.record),
      .in_tag_i   ('{sample: waiting.sample, lit: waiting.lit && !material.error}),
      .out_valid_o(lit_valid),
      .out_ready_i(lit_ready),
      .out_data_o (lit_colour),
      .out_tag_o  (lit)
  );

  // --- pixels: a word for each slot ---
  localparam int unsigned CountBits = 2;
  localparam int unsigned PartSumBits = rt_contract_pkg::ShadeBits + 2;
  localparam int unsigned DepthBits = rt_contract_pkg::EntryStartBits + rt_contract_pkg::TFrac - rt_contract_pkg::EntryStartFrac + 1;
  typedef struct packed {
    logic [CountBits-1:0]        count;
    logic [2:0][PartSumBits-1:0] sum;
  } gathered_t;
  typedef enum logic [2:0] {
    Clear,  // slot after slot
    Wait,   // for a sample; reads its slot
    Sum,    // what the slot held is there
    Store,  // back into the slot; the pixel leaves with its last sample
    Leave   // until it is taken
  } state_e;
  state_e                    state_q;
  rt_core_pkg::pixel_slot_t  slot_q, slot;
  gathered_t                 gathered, sum_d, sum_q;
  rt_core_pkg::pixel_place_t place;
  lit_sample_t               sample_q;
  shade_t [2:0]              colour_q;
  shade_t                    shown;
  logic [DepthBits-1:0]      along_q;
  logic [31:0]               depth;
  rt_contract_pkg::entry_scale_t scale_q;
  logic                      last, store;
  rt_core_pkg::pixel_t       pixel_q;
  assign slot      = lit.sample.tag[rt_core_pkg::TagBits-1-:SlotBits];
  assign lit_ready = state_q == Wait;
  assign store     = state_q == Store;
  assign last      = sum_q.count == CountBits'((3'd1 << frame_i.samples) - 3'd1);
  rt_ram_sdp #(
      .Depth (rt_core_pkg::PixelSlots),
      .data_t(gathered_t)
  ) u_slots (
      .clk_i,
      .rst_ni,
      .write_en_i  (store || state_q == Clear),
      .write_addr_i(slot_q),
      .write_data_i(store && !last ? '{count: sum_q.count + 1'b1, sum: sum_q.sum} : '0),
      .read_en_i   (state_q == Wait),
      .read_addr_i (slot),
      .read_data_o (gathered)
  );
  rt_ram_sdp #(
      .Depth (rt_core_pkg::PixelSlots),
      .data_t(rt_core_pkg::pixel_place_t)
  ) u_places (
      .clk_i,
      .rst_ni,
      .write_en_i  (place_valid_i),
      .write_addr_i(place_slot_i),
      .write_data_i(place_i),
      .read_en_i   (state_q == Wait),
      .read_addr_i (slot),
      .read_data_o (place)
  );
  always_comb begin
    sum_d = gathered;
    shown = '0;
    for (int unsigned c = 0; c < 3; c++) begin
      shown        = sample_q.lit ? colour_q[c] : frame_i.background[c];
      sum_d.sum[c] = gathered.sum[c] + PartSumBits'(shown);
    end
  end
  assign depth = sample_q.sample.hit ? 32'(along_q >> scale_q) : '1;
  always_ff @(posedge clk_i) begin
    sum_q   <= sum_d;
    along_q <= DepthBits'({place.start, (rt_contract_pkg::TFrac - rt_contract_pkg::EntryStartFrac)'(0)}) + DepthBits'(sample_q.sample.t);
    scale_q <= place.scale;
    if (store) begin
      pixel_q.tag  <= rt_core_pkg::ray_tag_t'(rt_contract_pkg::pixel_index_t'(sample_q.sample.tag));
      pixel_q.data <= {sample_q.sample.hit ? sample_q.sample.id : rt_contract_pkg::NoTriangle, depth};
      if (coloured) begin
        pixel_q.data[31:24] <= '1;
        for (int unsigned c = 0; c < 3; c++) pixel_q.data[8*c+:8] <= 8'(sum_q.sum[c] >> frame_i.samples);
      end
      if (frame_i.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelId)) begin
        pixel_q.data[31:0] <= sample_q.sample.hit ? sample_q.sample.id : rt_contract_pkg::NoTriangle;
      end
    end
    case (state_q)
      Clear: begin
        slot_q <= slot_q + 1'b1;
        if (slot_q == '1) state_q <= Wait;
      end
      Wait: begin
        slot_q <= slot;
        sample_q <= lit;
        colour_q <= lit_colour;
        if (lit_valid) state_q <= Sum;
      end
      Sum: state_q <= Store;
      Store: state_q <= last ? Leave : Wait;
      default: if (pixel_ready_i) state_q <= Wait;
    endcase
    if (start_i) begin
      state_q <= Clear;
      slot_q  <= '0;
    end
    if (!rst_ni) state_q <= Wait;
  end
  assign pixel_valid_o    = state_q == Leave;
  assign pixel_o          = pixel_q;
  assign finished_valid_o = state_q == Store && last;
  assign finished_slot_o  = slot_q;

  // Samples inside: those that wait, and those on the way between.
  localparam int unsigned InsideBits = 7;
  logic [InsideBits-1:0] inside_q;
  logic                  comes, leaves;
  assign comes  = chosen_valid && chosen_ready;
  assign leaves = (state_q == Store && !last) || (state_q == Leave && pixel_ready_i);
  always_ff @(posedge clk_i) begin
    if (comes && !leaves) inside_q <= inside_q + 1'b1;
    if (leaves && !comes) inside_q <= inside_q - 1'b1;
    if (!rst_ni) inside_q <= '0;
  end
  assign idle_o = inside_q == '0;

  `RT_ASSERT_INIT(InsideFits, Waiting + rt_lib_pkg::pipe_credits(rt_stage_pkg::LightDepth, 1) + 8 < (1 << InsideBits))
  `RT_ASSERT_INIT(DataBitsKnown, DataBits == 64 || DataBits == 128)
  `RT_ASSERT(StartsEmpty, !start_i || idle_o)
  `RT_ASSERT(AnswerIsExpected, !fill_valid_i || where_valid)
  `RT_ASSERT(MaterialHasRoom, !fill_keep || material_room)
  `RT_ASSERT(MaterialIsThere, !waiting_take || !waiting.fresh || material_valid)
  `RT_ASSERT_STREAM(Pixels, pixel_valid_o, pixel_ready_i, pixel_o)
  `RT_ASSERT_STREAM(Reads, fetch_valid_o, fetch_ready_i, fetch_o)
endmodule
