// SPDX-License-Identifier: Apache-2.0
// Source of rays from a camera: the samples of a frame, in tiles.
//
// Formula     x = 256 px + offset_x - 128 width, y likewise; a camera's ray from (0, 0, 0) towards (x, y, 2^19) 2^-20, or from (x, y, 0) 2^-20 straight ahead;
//             it becomes a ray of the grid as in rt_instance_enter. Passed by where the origin lies outside of the root box on some axis and the direction does
//             not lead back, so that what is left does not break a walk.
// Order       Tiles in rows, pixels of a tile in rows, samples of a pixel one after the other.
// Tag         {slot, pixel}: the sink gathers the samples of a pixel by its slot, whose lower bits are the sample.
// Slots       A pixel takes the slot that has been free for longest, and none while all are taken; it has as many as it has samples, and its first one stands
//             for it. finished_valid_i frees it. The sink waits for no ray: it finishes pixels whatever happens here.
// Streams     rays to the core; misses, samples that meet no box, to the sink. place_*: what the sink needs for a depth, in the clock in which the ray is offered.
// Faults      fault_o: the frame is none that can be drawn (sizes, samples, kind); nothing is made of it. bad_o: a sample's camera is none that a host writes; a miss.
// End         done_o from the clock after start_i until all samples are handed over is 0.
// Rate        One sample in three clocks.
// Own         1: rows and an rt_object_ray of its own. 0: camera_* goes to those of a core of two levels (rt_entry), and the rays come back as made_*, in order.
// Counterpart hls/stages/raster.hpp, golden/engine/stages/raster.hpp.
`include "rt_assert.svh"
module rt_raster #(
    parameter bit Own = 1'b1
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  rt_contract_pkg::camera_record_t  camera_i,  // as the others, constant while done_o is 0
    input  rt_contract_pkg::frame_record_t   frame_i,
    input  rt_contract_pkg::position_t [5:0] box_i,
    output logic                             done_o,
    output logic                             fault_o,
    output logic                             bad_o,
    input  logic                             finished_valid_i,
    input  rt_core_pkg::pixel_slot_t         finished_slot_i,
    output logic                             place_valid_o,
    output rt_core_pkg::pixel_slot_t         place_slot_o,
    output rt_core_pkg::pixel_place_t        place_o,
    output logic                             ray_valid_o,
    input  logic                             ray_ready_i,
    output rt_core_pkg::tagged_ray_t         ray_o,
    output logic                             miss_valid_o,
    input  logic                             miss_ready_i,
    output rt_core_pkg::ray_tag_t            miss_o,
    output logic                             camera_valid_o,
    input  logic                             camera_ready_i,
    output rt_core_pkg::camera_ray_t         camera_o,
    input  logic                             made_valid_i,
    output logic                             made_ready_o,
    input  rt_core_pkg::made_ray_t           made_i
);
  localparam int unsigned PlaceLog2 = 8;  // places in a pixel
  localparam int unsigned CameraFrac = 20;
  localparam int unsigned SizeBits = rt_contract_pkg::FrameSizeBits;
  localparam int unsigned SlotBits = rt_core_pkg::PixelSlotBits;
  typedef logic [SizeBits-1:0] size_t;
  typedef rt_contract_pkg::pixel_index_t pixel_t;
  typedef rt_contract_pkg::camera_step_t step_t;
  typedef rt_contract_pkg::position_t position_t;
  typedef rt_contract_pkg::direction_t direction_t;

  // --- what frames can be drawn ---
  localparam int unsigned Side = 1 << rt_contract_pkg::FrameSizeLog2;
  localparam int unsigned AreaBits = 2 * (SizeBits + 1);
  localparam int unsigned CheckClocks = rt_lib_pkg::mul_latency(SizeBits + 1, SizeBits + 1) + 1;
  logic signed [AreaBits-1:0] area;
  logic                       fits;
  rt_mul #(
      .ABits(SizeBits + 1),
      .BBits(SizeBits + 1)
  ) u_area (
      .clk_i,
      .a_i({1'b0, frame_i.width}),
      .b_i({1'b0, frame_i.height}),
      .p_o(area)
  );
  assign fits = frame_i.width <= SizeBits'(Side) && frame_i.height <= SizeBits'(Side) && area != '0 &&
                area <= AreaBits'(1 << rt_contract_pkg::FramePixelsLog2) && 32'(frame_i.samples) <= 32'(rt_contract_pkg::SamplesLog2Max) &&
                frame_i.kind <= rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelHit) &&
                (frame_i.samples == '0 || frame_i.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelColour));

  // --- where in the frame; a register behind each sum, settle_q counts down until all of it is there ---
  typedef enum logic [1:0] {
    Idle,
    Check,
    Run
  } state_e;
  localparam int unsigned Settle = 2;
  localparam int unsigned WaitBits = $clog2((CheckClocks > Settle ? CheckClocks : Settle) + 1);
  state_e              state_q;
  logic [WaitBits-1:0] settle_q;
  size_t               x_q, y_q, tile_x_q, tile_y_q;
  pixel_t              row_q, tile_row_q;  // first pixels of the row at hand, and of the first row of the tile
  logic [1:0]          sample_q;
  logic [SlotBits-1:0] slot_q;
  // What follows from it.
  size_t  tile_right_q, tile_below_q, next_x_q, next_y_q;
  pixel_t pixel_q, next_row_q;
  step_t  step_x_q, step_y_q;
  logic   ends_row, ends_tile, ends_band, ends_frame, last_sample, advance, open, enter_valid, enter_ready;
  function automatic step_t step_of(size_t pixel, rt_contract_pkg::shade_t offset, size_t size);
    step_of = step_t'({pixel, offset}) - step_t'({size, (PlaceLog2 - 1)'(0)});
  endfunction
  always_ff @(posedge clk_i) begin
    tile_right_q <= tile_x_q + (SizeBits'(1) << frame_i.tile_x);
    tile_below_q <= tile_y_q + (SizeBits'(1) << frame_i.tile_y);
    next_x_q     <= x_q + 1'b1;
    next_y_q     <= y_q + 1'b1;
    next_row_q   <= row_q + pixel_t'(frame_i.width);
    pixel_q      <= row_q + pixel_t'(x_q);
    step_x_q     <= step_of(x_q, frame_i.offset_x[sample_q], frame_i.width);
    step_y_q     <= step_of(y_q, frame_i.offset_y[sample_q], frame_i.height);
  end
  assign last_sample = sample_q == 2'((3'd1 << frame_i.samples) - 3'd1);
  assign ends_row    = next_x_q == tile_right_q || next_x_q == frame_i.width;
  assign ends_tile   = ends_row && (next_y_q == tile_below_q || next_y_q == frame_i.height);
  assign ends_band   = ends_tile && next_x_q == frame_i.width;
  assign ends_frame  = ends_band && next_y_q == frame_i.height;
  assign enter_valid = state_q == Run && settle_q == '0 && open;
  assign advance     = enter_valid && enter_ready;
  always_ff @(posedge clk_i) begin
    if (settle_q != '0) settle_q <= settle_q - 1'b1;
    case (state_q)
      Idle: begin
        x_q        <= '0;
        y_q        <= '0;
        tile_x_q   <= '0;
        tile_y_q   <= '0;
        row_q      <= '0;
        tile_row_q <= '0;
        sample_q   <= '0;
        if (start_i) begin
          state_q  <= Check;
          settle_q <= WaitBits'(CheckClocks);
        end
      end
      Check: if (settle_q == '0) state_q <= fits ? Run : Idle;
      default:
      if (advance) begin
        settle_q <= WaitBits'(Settle);
        sample_q <= last_sample ? '0 : sample_q + 1'b1;
        if (last_sample) begin
          x_q <= next_x_q;
          if (ends_row) begin
            x_q   <= tile_x_q;
            y_q   <= next_y_q;
            row_q <= next_row_q;
          end
          if (ends_tile) begin
            tile_x_q <= ends_band ? '0 : next_x_q;
            x_q      <= ends_band ? '0 : next_x_q;
            y_q      <= ends_band ? next_y_q : tile_y_q;
            row_q    <= ends_band ? next_row_q : tile_row_q;
          end
          if (ends_band) begin
            tile_y_q   <= next_y_q;
            tile_row_q <= next_row_q;
          end
          if (ends_frame) state_q <= Idle;
        end
      end
    endcase
    if (!rst_ni) begin
      state_q  <= Idle;
      settle_q <= '0;
    end
  end
  assign fault_o = state_q == Check && settle_q == '0 && !fits;

  // --- slots: those that no pixel has had yet, then those that were freed ---
  logic [SlotBits:0]   new_q;  // the next of the former
  logic                slot_valid_q, new_left, freed_valid, freed_take, freed_room;
  logic [SlotBits-1:0] freed_slot;
  logic [$clog2(rt_core_pkg::PixelSlots+1)-1:0] freed_usage_unused;
  assign new_left   = !new_q[SlotBits];
  assign freed_take = !slot_valid_q && !new_left;
  assign open       = slot_valid_q;
  rt_fifo #(
      .Depth   (rt_core_pkg::PixelSlots),
      .BlockRam(1'b1),
      .data_t  (logic [SlotBits-1:0])
  ) u_freed (
      .clk_i,
      .rst_ni     (rst_ni && !start_i),
      .in_valid_i (finished_valid_i),
      .in_ready_o (freed_room),
      .in_data_i  (finished_slot_i),
      .out_valid_o(freed_valid),
      .out_ready_i(freed_take),
      .out_data_o (freed_slot),
      .usage_o    (freed_usage_unused)
  );
  always_ff @(posedge clk_i) begin
    if (!slot_valid_q) begin
      slot_valid_q <= new_left || freed_valid;
      slot_q       <= new_left ? new_q[SlotBits-1:0] : freed_slot;
      if (new_left) new_q <= new_q + ((SlotBits + 1)'(1) << frame_i.samples);
    end
    if (advance && last_sample) slot_valid_q <= 1'b0;
    if (!rst_ni || start_i) begin
      slot_valid_q <= 1'b0;
      new_q        <= '0;
    end
  end
  `RT_ASSERT(FreedHasRoom, !finished_valid_i || freed_room)

  // --- from the camera to the grid ---
  rt_core_pkg::camera_ray_t  camera;
  rt_core_pkg::made_ray_t    entry;
  logic                      entry_valid, entry_ready, orthographic;
  assign orthographic = camera_i.orthographic[0];
  assign camera.tag   = {slot_q | SlotBits'(sample_q), pixel_q};
  if (Own) begin : gen_own
    // The rows of rt_instance_enter, one axis a clock, of rays that have x and y in the origin or in the direction and 0 or 1/2 otherwise: two products.
    localparam int unsigned SumBits = rt_stage_pkg::EnterSumBits;
    localparam int unsigned StepBits = rt_contract_pkg::CameraStepBits;
    localparam int unsigned ProductBits = rt_contract_pkg::InstanceCoefficientBits + StepBits;
    typedef logic signed [SumBits-1:0] sum_t;
    logic       enter;
    logic [1:0] axis_q, axis;
    step_t      x_step_q, y_step_q;
    logic signed [ProductBits-1:0] x_product, y_product;
    sum_t       steps_q, constant_q, ahead_q, ahead_before_q, moved_q;
    always_ff @(posedge clk_i) begin
      if (enter) begin
        x_step_q <= step_x_q;
        y_step_q <= step_y_q;
      end
      if (axis_q != 2'd2) axis_q <= axis_q + 1'b1;
      if (enter) axis_q <= '0;
    end
    rt_mul #(
        .ABits(rt_contract_pkg::InstanceCoefficientBits),
        .BBits(StepBits)
    ) u_x (
        .clk_i,
        .a_i(camera_i.m[3*axis_q]),
        .b_i(x_step_q),
        .p_o(x_product)
    );
    rt_mul #(
        .ABits(rt_contract_pkg::InstanceCoefficientBits),
        .BBits(StepBits)
    ) u_y (
        .clk_i,
        .a_i(camera_i.m[3*axis_q+1]),
        .b_i(y_step_q),
        .p_o(y_product)
    );
    rt_delay #(
        .Cycles(rt_lib_pkg::mul_latency(rt_contract_pkg::InstanceCoefficientBits, StepBits)),
        .data_t(logic [1:0])
    ) u_axis (
        .clk_i,
        .rst_ni,
        .data_i(axis_q),
        .data_o(axis)
    );
    always_ff @(posedge clk_i) begin
      steps_q        <= sum_t'(x_product) + sum_t'(y_product);
      constant_q     <= sum_t'(signed'(camera_i.b[axis])) <<< rt_contract_pkg::PositionFrac;
      ahead_before_q <= sum_t'(signed'(camera_i.m[3*axis+2])) <<< (rt_contract_pkg::DirectionFrac - 1);
      moved_q        <= orthographic ? constant_q + (steps_q <<< (rt_contract_pkg::PositionFrac - CameraFrac)) : constant_q;
      ahead_q        <= orthographic ? ahead_before_q : ahead_before_q + (steps_q <<< (rt_contract_pkg::DirectionFrac - CameraFrac));
    end
    `RT_ASSERT_INIT(RowsInTime, 1 + rt_lib_pkg::mul_latency(rt_contract_pkg::InstanceCoefficientBits, StepBits) + 2 == rt_stage_pkg::EnterRows)
    rt_contract_pkg::instance_enter_out_record_t ray;
    rt_core_pkg::ray_tag_t tag;
    always_comb begin
      camera.data       = '0;
      camera.data.e     = camera_i.e;
      camera.data.box   = camera_i.box;
      camera.data.reach = camera_i.reach;
      entry             = rt_core_pkg::made_ray_of(tag, ray);
    end
    rt_object_ray #(
        .tag_t(rt_core_pkg::ray_tag_t)
    ) u_enter (
        .clk_i,
        .rst_ni,
        .in_valid_i (enter_valid),
        .in_ready_o (enter_ready),
        .in_data_i  (camera.data),
        .in_tag_i   (camera.tag),
        .enter_o    (enter),
        .place_i    (moved_q),
        .course_i   (ahead_q),
        .out_valid_o(entry_valid),
        .out_ready_i(entry_ready),
        .out_data_o (ray),
        .out_tag_o  (tag)
    );
    logic shared_unused;
    assign shared_unused  = ^{camera_ready_i, made_valid_i, made_i};
    assign camera_valid_o = 1'b0;
    assign made_ready_o   = 1'b0;
  end else begin : gen_shared
    always_comb begin
      camera.data       = '0;
      camera.data.m     = camera_i.m;
      camera.data.b     = camera_i.b;
      camera.data.e     = camera_i.e;
      camera.data.box   = camera_i.box;
      camera.data.reach = camera_i.reach;
      if (orthographic) begin
        camera.data.origin[0] = position_t'(signed'(step_x_q)) <<< (rt_contract_pkg::PositionFrac - CameraFrac);
        camera.data.origin[1] = position_t'(signed'(step_y_q)) <<< (rt_contract_pkg::PositionFrac - CameraFrac);
      end else begin
        camera.data.direction[0] = direction_t'(signed'(step_x_q)) <<< (rt_contract_pkg::DirectionFrac - CameraFrac);
        camera.data.direction[1] = direction_t'(signed'(step_y_q)) <<< (rt_contract_pkg::DirectionFrac - CameraFrac);
      end
      camera.data.direction[2] = direction_t'(1) <<< (rt_contract_pkg::DirectionFrac - 1);
    end
    assign camera_valid_o = enter_valid;
    assign enter_ready    = camera_ready_i;
    assign entry_valid    = made_valid_i;
    assign made_ready_o   = entry_ready;
    assign entry          = made_i;
  end
  assign camera_o = camera;

  // --- rays and misses ---
  logic                       passes, ray_valid_q, miss_valid_q;
  rt_core_pkg::tagged_ray_t   ray_q;
  rt_core_pkg::pixel_place_t  place_q;
  logic                       place_valid_q;
  always_comb begin
    passes = !entry.enters;
    for (int unsigned a = 0; a < 3; a++) begin
      if (signed'(entry.origin[a]) < signed'(box_i[2*a]) && signed'(entry.direction[a]) <= 0) passes = 1'b1;
      if (signed'(entry.origin[a]) > signed'(box_i[2*a+1]) && signed'(entry.direction[a]) >= 0) passes = 1'b1;
    end
  end
  assign entry_ready = (!ray_valid_q || ray_ready_i) && (!miss_valid_q || miss_ready_i);
  always_ff @(posedge clk_i) begin
    place_valid_q <= 1'b0;
    if (ray_ready_i) ray_valid_q <= 1'b0;
    if (miss_ready_i) miss_valid_q <= 1'b0;
    if (entry_valid && entry_ready) begin
      ray_valid_q   <= !passes;
      place_valid_q <= !passes;
      miss_valid_q  <= passes;
      place_q       <= '{start: entry.start, scale: entry.scale};
      ray_q         <= '{
          tag: entry.tag,
          error: 1'b0,
          any: '0,
          t_max: entry.t_max,
          direction: entry.direction,
          origin: entry.origin
      };
    end
    if (!rst_ni) begin
      ray_valid_q   <= 1'b0;
      miss_valid_q  <= 1'b0;
      place_valid_q <= 1'b0;
    end
  end
  assign bad_o         = entry_valid && entry_ready && entry.bad;
  assign ray_valid_o   = ray_valid_q;
  assign ray_o         = ray_q;
  assign miss_valid_o  = miss_valid_q;
  assign miss_o        = ray_q.tag;
  assign place_valid_o = place_valid_q;
  assign place_slot_o  = ray_q.tag[rt_core_pkg::TagBits-1-:SlotBits];
  assign place_o       = place_q;

  // Samples on their way to rays.
  localparam int unsigned InsideBits = 6;
  logic [InsideBits-1:0] inside_q;
  logic                  leaves;
  assign leaves = entry_valid && entry_ready;
  always_ff @(posedge clk_i) begin
    if (advance && !leaves) inside_q <= inside_q + 1'b1;
    if (leaves && !advance) inside_q <= inside_q - 1'b1;
    if (!rst_ni) inside_q <= '0;
  end
  assign done_o = state_q == Idle && inside_q == '0 && !ray_valid_q && !miss_valid_q;

  `RT_ASSERT_INIT(InsideFits, rt_lib_pkg::pipe_credits(rt_stage_pkg::InstanceEnterDepth, rt_stage_pkg::InstanceEnterInterval) < (1 << InsideBits))
  `RT_ASSERT_INIT(TagFits, SlotBits + rt_contract_pkg::PixelIndexBits == rt_core_pkg::TagBits)
  `RT_ASSERT_STREAM(Rays, ray_valid_o, ray_ready_i, ray_o)
  `RT_ASSERT_STREAM(Misses, miss_valid_o, miss_ready_i, miss_o)
endmodule
