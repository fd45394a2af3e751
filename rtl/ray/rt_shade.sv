// SPDX-License-Identifier: Apache-2.0
// Sink of samples that makes pixels of them: looks up how the instance is turned and the material, lights it (rt_light), gathers the samples of a pixel.
//
// Samples     Hits from rt_shadow, misses from rt_raster, each with the tag {slot, pixel}. Every sample takes the same way, so nothing overtakes.
// Table       With two levels, records instance_shade by instance number, as many as placed_i; then those of materials, by triangle id or where the
//             instance's record says. count_i of 8 bytes in all. Read where a colour is wanted and something is hit (rt_lookup).
// Pixels      A word for each slot holds the sum and the number of its samples so far. With the last one the pixel leaves: 32 bits, or 64 of pixel_hit.
//             finished_* tells rt_raster that the slot is free again. Clear: every slot, from start_i on; samples wait.
// Rate        One sample in four clocks.
// Faults      unknown_o: what is hit has no material, or a record could not be read; it looks like the background.
// End         idle_o: no sample is inside.
// Counterpart hls/top/pixels.cpp (retrace_shade), golden/engine/stages/shade.hpp.
`include "rt_assert.svh"
module rt_shade #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned GranuleBytes = 8,
    parameter bit TwoLevels = 1'b0
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  rt_contract_pkg::frame_record_t   frame_i,  // as the others, constant while anything is inside
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,   // of the table, a multiple of 64
    input  logic [31:0]                      count_i,
    input  logic [31:0]                      placed_i,
    output logic                             idle_o,
    output logic                             unknown_o,
    input  logic                             hit_valid_i,
    output logic                             hit_ready_o,
    input  rt_core_pkg::sample_t             hit_i,
    input  logic                             miss_valid_i,
    output logic                             miss_ready_o,
    input  rt_core_pkg::ray_tag_t            miss_i,
    input  logic                             place_valid_i,
    input  rt_core_pkg::pixel_slot_t         place_slot_i,
    input  rt_core_pkg::pixel_place_t        place_i,
    output logic                             finished_valid_o,
    output rt_core_pkg::pixel_slot_t         finished_slot_o,
    // Materials, then instances.
    output logic [1:0]                       fetch_valid_o,
    input  logic [1:0]                       fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o[2],
    input  logic [1:0]                       fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             pixel_valid_o,
    input  logic                             pixel_ready_i,
    output rt_core_pkg::pixel_t              pixel_o
);
  localparam int unsigned Waiting = 16;
  localparam int unsigned SlotBits = rt_core_pkg::PixelSlotBits;
  localparam int unsigned OfMaterials = 0;
  localparam int unsigned OfInstances = 1;
  typedef rt_contract_pkg::shade_t shade_t;
  typedef rt_core_pkg::sample_t sample_t;
  // With the light as what is hit sees it, and the place of its material.
  typedef struct packed {
    sample_t                    sample;
    rt_core_pkg::turned_t [2:0] light;
    logic [31:0]                index;
    logic                       known;  // where the material stands
  } placed_t;

  // --- samples in: hits and misses in turn, then a register ---
  logic    coloured, chosen_valid, chosen_ready, in_valid, in_ready, index_unused;
  sample_t offered[2], chosen, in;
  assign coloured   = frame_i.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelColour);
  assign offered[0] = hit_i;
  always_comb begin
    offered[1]     = '0;
    offered[1].tag = miss_i;
  end
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

  // --- where the material stands, and how its light falls ---
  logic    placed_valid, placed_ready, turn_failed;
  placed_t placed;
  rt_core_pkg::turned_t [2:0] light;
  for (genvar a = 0; a < 3; a++) begin : gen_light
    assign light[a] = rt_core_pkg::turned_t'(signed'(frame_i.light[a]));
  end
  if (TwoLevels) begin : gen_instances
    localparam int unsigned RecordBits = 8 * rt_contract_pkg::InstanceShadeBytes;
    typedef struct packed {
      sample_t                          sample;
      logic                             turns;
      logic                             failed;
      rt_contract_pkg::material_index_t material;
    } turning_t;
    logic                                   found_valid, found_ready, found_wanted, found_error;
    sample_t                                found;
    logic [RecordBits-1:0]                  found_bits;
    rt_contract_pkg::instance_shade_record_t record;
    turning_t                               turning;
    rt_contract_pkg::material_index_t       index;
    assign index = rt_contract_pkg::material_index_t'(turning.sample.id) + turning.material;
    rt_core_pkg::turned_t [2:0]             turned;
    rt_lookup #(
        .DataBits    (DataBits),
        .GranuleBytes(GranuleBytes),
        .RecordBytes (rt_contract_pkg::InstanceShadeBytes),
        .KeyBits     (rt_contract_pkg::TriangleIndexBits),
        .Waiting     (Waiting),
        .Source      (rt_config_pkg::SourcePlaced),
        .tag_t       (sample_t)
    ) u_instances (
        .clk_i,
        .rst_ni,
        .start_i,
        .base_i,
        .failed_o     (turn_failed),
        .in_valid_i   (in_valid),
        .in_ready_o   (in_ready),
        .in_wanted_i  (in.hit && coloured && 32'(in.number) < placed_i),
        .in_key_i     (in.number),
        .in_tag_i     (in),
        .fetch_valid_o(fetch_valid_o[OfInstances]),
        .fetch_ready_i(fetch_ready_i[OfInstances]),
        .fetch_o      (fetch_o[OfInstances]),
        .fill_valid_i (fill_valid_i[OfInstances]),
        .fill_error_i,
        .fill_data_i,
        .out_valid_o  (found_valid),
        .out_ready_i  (found_ready),
        .out_wanted_o (found_wanted),
        .out_error_o  (found_error),
        .out_record_o (found_bits),
        .out_tag_o    (found)
    );
    assign record = found_bits;
    rt_turn #(
        .tag_t(turning_t)
    ) u_turn (
        .clk_i,
        .rst_ni,
        .light_i    (frame_i.light),
        .in_valid_i (found_valid),
        .in_ready_o (found_ready),
        .in_data_i  (record.turn),
        .in_tag_i   ('{sample: found, turns: found_wanted, failed: found_wanted && found_error, material: record.material}),
        .out_valid_o(placed_valid),
        .out_ready_i(placed_ready),
        .out_data_o (turned),
        .out_tag_o  (turning)
    );
    always_comb begin
      placed = '{sample: turning.sample, light: light, index: turning.sample.id, known: !turning.failed};
      if (turning.turns) begin
        placed.light = turned;
        placed.index = 32'(index);
      end
    end
  end else begin : gen_no_instances
    logic        fill_unused;
    logic [31:0] placed_unused;
    assign fill_unused                = fill_valid_i[OfInstances] ^ fetch_ready_i[OfInstances];
    assign placed_unused              = placed_i;
    assign turn_failed                = 1'b0;
    assign placed_valid               = in_valid;
    assign in_ready                   = placed_ready;
    assign placed                     = '{sample: in, light: light, index: in.id, known: 1'b1};
    assign fetch_valid_o[OfInstances] = 1'b0;
    assign fetch_o[OfInstances]       = '0;
  end

  // --- the material, and what it looks like ---
  typedef struct packed {
    sample_t sample;
    logic    lit;
  } lit_sample_t;
  logic                               has_material, missing, material_failed, material_valid, material_ready, material_wanted, material_error;
  placed_t                            placed_lit;
  rt_contract_pkg::material_record_t  material;
  logic                               lit_valid, lit_ready;
  lit_sample_t                        lit;
  shade_t [2:0]                       lit_colour;
  assign has_material = placed.sample.hit && coloured && placed.known && placed.index < count_i;
  assign missing      = placed.sample.hit && coloured && placed.known && !has_material;
  assign unknown_o    = (placed_valid && placed_ready && missing) || material_failed || turn_failed;
  rt_lookup #(
      .DataBits    (DataBits),
      .GranuleBytes(GranuleBytes),
      .RecordBytes (rt_contract_pkg::MaterialBytes),
      .KeyBits     (32),
      .Waiting     (Waiting),
      .Source      (rt_config_pkg::SourceMaterial),
      .tag_t       (placed_t)
  ) u_materials (
      .clk_i,
      .rst_ni,
      .start_i,
      .base_i,
      .failed_o     (material_failed),
      .in_valid_i   (placed_valid),
      .in_ready_o   (placed_ready),
      .in_wanted_i  (has_material),
      .in_key_i     (placed.index),
      .in_tag_i     (placed),
      .fetch_valid_o(fetch_valid_o[OfMaterials]),
      .fetch_ready_i(fetch_ready_i[OfMaterials]),
      .fetch_o      (fetch_o[OfMaterials]),
      .fill_valid_i (fill_valid_i[OfMaterials]),
      .fill_error_i,
      .fill_data_i,
      .out_valid_o  (material_valid),
      .out_ready_i  (material_ready),
      .out_wanted_o (material_wanted),
      .out_error_o  (material_error),
      .out_record_o (material),
      .out_tag_o    (placed_lit)
  );
  rt_light #(
      .tag_t(lit_sample_t)
  ) u_light (
      .clk_i,
      .rst_ni,
      .frame_i,
      .in_valid_i (material_valid),
      .in_ready_o (material_ready),
      .in_data_i  (material),
      .in_light_i (placed_lit.light),
      .in_shadow_i(placed_lit.sample.shadow),
      .in_tag_i   ('{sample: placed_lit.sample, lit: material_wanted && !material_error}),
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
  // That of the pixel's first sample.
  assign slot      = (lit.sample.tag[rt_core_pkg::TagBits-1-:SlotBits] >> frame_i.samples) << frame_i.samples;
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
  localparam int unsigned InsideBits = 8;
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

  `RT_ASSERT_INIT(InsideFits, 2 * (Waiting + 1) + rt_lib_pkg::pipe_credits(rt_stage_pkg::TurnDepth, 3) +
                  rt_lib_pkg::pipe_credits(rt_stage_pkg::LightDepth, 1) + 8 < (1 << InsideBits))
  `RT_ASSERT(StartsEmpty, !start_i || idle_o)
  `RT_ASSERT_STREAM(Pixels, pixel_valid_o, pixel_ready_i, pixel_o)
endmodule
