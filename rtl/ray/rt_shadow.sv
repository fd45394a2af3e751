// SPDX-License-Identifier: Apache-2.0
// Between the core and rt_shade: sends a ray from each hit towards the light, and the hit on when it is known whether that ray was stopped.
//
// Formula     origin = floor(o + (t - min(t, 2^-12)) d + 1/2) on the grid, wrapped; direction = light, no component below -(1 - 2^-12); t_max all of it.
//             Passed by where the light is 0, or the origin lies outside of the root box on some axis and the direction does not lead back.
// Slots       A sample has one ray in the core at a time, and its slot says which: u_kept holds the hit while the second one is away. The rays of the samples
//             are in u_rays, written as they leave rt_raster (place_valid_i).
// Deadlock    A hit is taken whenever the sink takes samples, whatever becomes of rays: u_pending has a place for every slot. So the core is emptied of its
//             hits although it may not take rays, and there are never more rays than slots.
// Off         Without shadows hits pass in the same way, one in three clocks.
// End         busy_o: a sample is between rt_raster and rt_shade. There is another ray to come while it is.
// Counterpart hls/stages/shadow.hpp, golden/engine/stages/shadow.hpp.
`include "rt_assert.svh"
module rt_shadow (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  rt_contract_pkg::frame_record_t   frame_i,  // as box_i, constant while anything is inside
    input  rt_contract_pkg::position_t [5:0] box_i,
    output logic                             busy_o,
    input  logic                             place_valid_i,
    input  rt_core_pkg::tagged_ray_t         place_ray_i,
    input  logic                             hit_valid_i,
    output logic                             hit_ready_o,
    input  rt_core_pkg::tagged_hit_t         hit_i,
    input  rt_contract_pkg::triangle_index_t hit_number_i,  // of its instance
    output logic                             ray_valid_o,
    input  logic                             ray_ready_i,
    output rt_core_pkg::tagged_ray_t         ray_o,
    output logic                             out_valid_o,
    input  logic                             out_ready_i,
    output rt_core_pkg::sample_t             out_o
);
  localparam int unsigned SlotBits = rt_core_pkg::PixelSlotBits;
  localparam int unsigned PositionBits = rt_contract_pkg::PositionBits;
  localparam int unsigned DirectionBits = rt_contract_pkg::DirectionBits;
  localparam int unsigned AlongBits = rt_contract_pkg::TLimitBits + 1;
  localparam int unsigned WayBits = AlongBits + DirectionBits;
  localparam int unsigned MulLatency = rt_lib_pkg::mul_latency(AlongBits, DirectionBits);
  typedef rt_core_pkg::pixel_slot_t slot_t;
  typedef struct packed {
    logic                             lit;  // a ray towards the light is away
    rt_contract_pkg::triangle_id_t    id;
    rt_contract_pkg::triangle_index_t number;
    rt_contract_pkg::t_limit_t        t;
  } kept_t;
  typedef struct packed {
    rt_contract_pkg::pixel_index_t     pixel;
    rt_contract_pkg::direction_t [2:0] direction;
    rt_contract_pkg::position_t [2:0]  origin;
  } ray_t;
  typedef struct packed {
    slot_t                     slot;
    rt_contract_pkg::t_limit_t t;
  } pending_t;

  // --- hits, and rays that meet nothing before they are sent ---
  typedef enum logic [1:0] {
    Clear,  // slot after slot
    Wait,
    Look,   // what is kept of the slot is there
    Act     // a ray, or the sample goes on
  } state_e;
  state_e                state_q;
  slot_t                 slot_q, slot;
  logic                  shadows_q, passed_valid, passed_ready, asks_q, pending_room, take;
  rt_core_pkg::ray_tag_t passed_tag;
  rt_core_pkg::sample_t  in, in_q, out_q;
  kept_t                 kept;
  always_comb begin
    in = '{
        tag: hit_i.tag,
        hit: hit_i.hit.status == rt_contract_pkg::status_t'(rt_contract_pkg::StatusHit),
        shadow: 1'b0,
        id: hit_i.hit.id,
        number: hit_number_i,
        t: hit_i.hit.t
    };
    if (passed_valid) begin
      in     = '0;
      in.tag = passed_tag;
    end
  end
  assign slot         = in.tag[rt_core_pkg::TagBits-1-:SlotBits];
  assign take         = state_q == Wait && (passed_valid || hit_valid_i);
  assign passed_ready = state_q == Wait;
  assign hit_ready_o  = state_q == Wait && !passed_valid;
  rt_ram_sdp #(
      .Depth (rt_core_pkg::PixelSlots),
      .data_t(kept_t)
  ) u_kept (
      .clk_i,
      .rst_ni,
      .write_en_i  (state_q == Clear || state_q == Act),
      .write_addr_i(slot_q),
      .write_data_i(state_q == Act && asks_q ? '{lit: 1'b1, id: in_q.id, number: in_q.number, t: in_q.t} : '0),
      .read_en_i   (take),
      .read_addr_i (slot),
      .read_data_o (kept)
  );
  always_ff @(posedge clk_i) begin
    shadows_q <= frame_i.shadows[0] && frame_i.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelColour);
    case (state_q)
      Clear: begin
        slot_q <= slot_q + 1'b1;
        if (slot_q == '1) state_q <= Wait;
      end
      Wait: begin
        slot_q <= slot;
        in_q   <= in;
        if (take) state_q <= Look;
      end
      Look: begin
        asks_q  <= !kept.lit && in_q.hit && shadows_q;
        out_q   <= kept.lit ? '{tag: in_q.tag, hit: 1'b1, shadow: in_q.hit, id: kept.id, number: kept.number, t: kept.t} : in_q;
        state_q <= Act;
      end
      default: if (asks_q || out_ready_i) state_q <= Wait;
    endcase
    if (start_i) begin
      state_q <= Clear;
      slot_q  <= '0;
    end
    if (!rst_ni) state_q <= Wait;
  end
  assign out_valid_o = state_q == Act && !asks_q;
  assign out_o       = out_q;

  // --- rays towards the light ---
  typedef enum logic [1:0] {
    Next,
    Feed,    // axis by axis into the product
    Gather,  // and out of it
    Offer
  } towards_e;
  towards_e            towards_q;
  logic                pending_valid, pending_take;
  pending_t            pending;
  slot_t               pending_slot_q;
  ray_t                ray;
  rt_contract_pkg::t_limit_t back;
  logic [1:0]          axis_q;
  logic [MulLatency+1:0] way_valid_q;  // a product for each bit, and its way behind it
  logic [1:0]          way_axis_q;
  logic signed [AlongBits-1:0] along_q;
  logic signed [DirectionBits-1:0] feed_q;
  logic signed [WayBits-1:0] product, way_q;
  rt_contract_pkg::position_t [2:0] origin_q;
  rt_contract_pkg::direction_t [2:0] light;
  logic                passes, passes_q;
  logic [$clog2(rt_core_pkg::PixelSlots+1)-1:0] pending_usage_unused;
  rt_fifo #(
      .Depth   (rt_core_pkg::PixelSlots),
      .BlockRam(1'b1),
      .data_t  (pending_t)
  ) u_pending (
      .clk_i,
      .rst_ni,
      .in_valid_i (state_q == Act && asks_q),
      .in_ready_o (pending_room),
      .in_data_i  ('{slot: slot_q, t: in_q.t}),
      .out_valid_o(pending_valid),
      .out_ready_i(pending_take),
      .out_data_o (pending),
      .usage_o    (pending_usage_unused)
  );
  rt_ram_sdp #(
      .Depth (rt_core_pkg::PixelSlots),
      .data_t(ray_t)
  ) u_rays (
      .clk_i,
      .rst_ni,
      .write_en_i  (place_valid_i),
      .write_addr_i(place_ray_i.tag[rt_core_pkg::TagBits-1-:SlotBits]),
      .write_data_i('{
          pixel: rt_contract_pkg::pixel_index_t'(place_ray_i.tag),
          direction: place_ray_i.direction,
          origin: place_ray_i.origin
      }),
      .read_en_i   (pending_take),
      .read_addr_i (pending.slot),
      .read_data_o (ray)
  );
  assign pending_take = pending_valid && towards_q == Next;
  assign back         = pending.t < rt_contract_pkg::ShadowBack ? pending.t : rt_contract_pkg::ShadowBack;
  rt_mul #(
      .ABits(AlongBits),
      .BBits(DirectionBits)
  ) u_way (
      .clk_i,
      .a_i(along_q),
      .b_i(feed_q),
      .p_o(product)
  );
  always_comb begin
    passes = frame_i.light == '0;
    for (int unsigned a = 0; a < 3; a++) begin
      // The least code is one too many: the ray would be longer than 1 along this axis.
      light[a] = rt_contract_pkg::direction_t'(signed'(frame_i.light[a])) << (rt_contract_pkg::DirectionFrac - rt_contract_pkg::NormalFrac);
      if (frame_i.light[a] == {1'b1, (rt_contract_pkg::NormalBits - 1)'(0)}) begin
        light[a] = rt_contract_pkg::direction_t'(signed'({1'b1, (rt_contract_pkg::NormalBits - 2)'(0), 1'b1})) <<
            (rt_contract_pkg::DirectionFrac - rt_contract_pkg::NormalFrac);
      end
      if (signed'(origin_q[a]) < signed'(box_i[2*a]) && signed'(light[a]) <= 0) passes = 1'b1;
      if (signed'(origin_q[a]) > signed'(box_i[2*a+1]) && signed'(light[a]) >= 0) passes = 1'b1;
    end
  end
  logic gathered_q;
  always_ff @(posedge clk_i) begin
    if (pending_take) begin
      pending_slot_q <= pending.slot;
      along_q   <= AlongBits'({1'b0, pending.t - back});
    end
    feed_q      <= signed'(ray.direction[axis_q]);
    way_valid_q <= {way_valid_q[MulLatency:0], towards_q == Feed};
    way_q       <= product + (WayBits'(1) <<< (rt_contract_pkg::DirectionFrac - 1));
    gathered_q  <= way_valid_q[MulLatency+1] && way_axis_q == 2'(rt_core_pkg::Axes - 1);
    if (way_valid_q[MulLatency+1]) begin
      way_axis_q           <= way_axis_q + 1'b1;
      origin_q[way_axis_q] <= ray.origin[way_axis_q] + PositionBits'(way_q >>> rt_contract_pkg::DirectionFrac);
    end
    passes_q <= passes;
    case (towards_q)
      Next: begin
        axis_q     <= '0;
        way_axis_q <= '0;
        if (pending_take) towards_q <= Feed;
      end
      Feed: begin
        if (axis_q == 2'(rt_core_pkg::Axes - 1)) towards_q <= Gather;
        else axis_q <= axis_q + 1'b1;
      end
      Gather: if (gathered_q) towards_q <= Offer;
      default: if (passes_q ? passed_ready : ray_ready_i) towards_q <= Next;
    endcase
    if (!rst_ni) begin
      towards_q   <= Next;
      way_valid_q <= '0;
      gathered_q  <= 1'b0;
    end
  end
  assign passed_valid = towards_q == Offer && passes_q;
  assign passed_tag   = {pending_slot_q, ray.pixel};
  assign ray_valid_o  = towards_q == Offer && !passes_q;
  assign ray_o = '{
          tag: {pending_slot_q, ray.pixel},
          error: 1'b0,
          any: 1'b1,
          t_max: '1,
          direction: light,
          origin: origin_q
      };

  // --- samples on their way ---
  logic [SlotBits:0] inside_q;
  logic              leaves;
  assign leaves = out_valid_o && out_ready_i;
  always_ff @(posedge clk_i) begin
    if (place_valid_i && !leaves) inside_q <= inside_q + 1'b1;
    if (leaves && !place_valid_i) inside_q <= inside_q - 1'b1;
    if (!rst_ni) inside_q <= '0;
  end
  assign busy_o = inside_q != '0;

  `RT_ASSERT(PendingHasRoom, !(state_q == Act && asks_q) || pending_room)
  `RT_ASSERT(StartsEmpty, !start_i || !busy_o)
  `RT_ASSERT_STREAM(Rays, ray_valid_o, ray_ready_i, ray_o)
  `RT_ASSERT_STREAM(Samples, out_valid_o, out_ready_i, out_o)
endmodule
