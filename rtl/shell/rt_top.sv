// SPDX-License-Identifier: Apache-2.0
// Top of the core: AXI4-Lite registers, AXI4 master, interrupt.
//
// Purpose     Registers (rtl/shell, generated from rt_regs.rdl), the AXI master and its orderly stop around rt_core.
// Reads       ARID = {source, miss register}; answers are taken in every clock (RREADY is 1 out of reset) in any order between ids.
//             Bursts are INCR, aligned, of at most 128 bytes, and stay within 4 KB.
// Writes      Lines of 64 bytes with strobes (rt_hit_sink), one id.
// Soft reset  No new transaction is offered, those in flight are completed and dropped, then rt_core is reset. What the slave has been
//             offered is never taken back, so the bus never sees a broken rule.
// Pixels      With Config.pixels, control.on_chip takes rays from rt_raster and gives hits to rt_shade; pixels leave by the same rt_hit_sink as hits do. Two
//             frame buffers in turn; status.front is the one that was drawn last. Without, none of it is there.
// Interrupt   irq_o = control.irq_enable and status.done.
// Config      A named configuration; the macro RT_CONFIG chooses another default for tools that cannot pass a record.
`include "rt_assert.svh"
`ifndef RT_CONFIG
`define RT_CONFIG ConfigEcp5
`endif
module rt_top #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::`RT_CONFIG,
    localparam int unsigned DataBits = Config.data_bits,
    localparam int unsigned AddrBits = rt_core_pkg::AddrBits,
    localparam int unsigned IdBits = rt_core_pkg::IdBits,
    localparam int unsigned RegAddrBits = rt_regs_pkg::RT_REGS_MIN_ADDR_WIDTH
) (
    input  logic                   clk_i,
    input  logic                   rst_ni,
    output logic                   irq_o,
    // AXI4-Lite slave.
    input  logic                   axil_aw_valid_i,
    output logic                   axil_aw_ready_o,
    input  logic [RegAddrBits-1:0] axil_aw_addr_i,
    input  logic [2:0]             axil_aw_prot_i,
    input  logic                   axil_w_valid_i,
    output logic                   axil_w_ready_o,
    input  logic [31:0]            axil_w_data_i,
    input  logic [3:0]             axil_w_strb_i,
    output logic                   axil_b_valid_o,
    input  logic                   axil_b_ready_i,
    output logic [1:0]             axil_b_resp_o,
    input  logic                   axil_ar_valid_i,
    output logic                   axil_ar_ready_o,
    input  logic [RegAddrBits-1:0] axil_ar_addr_i,
    input  logic [2:0]             axil_ar_prot_i,
    output logic                   axil_r_valid_o,
    input  logic                   axil_r_ready_i,
    output logic [31:0]            axil_r_data_o,
    output logic [1:0]             axil_r_resp_o,
    // AXI4 master.
    output logic                   axi_ar_valid_o,
    input  logic                   axi_ar_ready_i,
    output logic [IdBits-1:0]      axi_ar_id_o,
    output logic [AddrBits-1:0]    axi_ar_addr_o,
    output logic [7:0]             axi_ar_len_o,
    output logic [2:0]             axi_ar_size_o,
    output logic [1:0]             axi_ar_burst_o,
    input  logic                   axi_r_valid_i,
    output logic                   axi_r_ready_o,
    input  logic [IdBits-1:0]      axi_r_id_i,
    input  logic [DataBits-1:0]    axi_r_data_i,
    input  logic [1:0]             axi_r_resp_i,
    input  logic                   axi_r_last_i,
    output logic                   axi_aw_valid_o,
    input  logic                   axi_aw_ready_i,
    output logic [IdBits-1:0]      axi_aw_id_o,
    output logic [AddrBits-1:0]    axi_aw_addr_o,
    output logic [7:0]             axi_aw_len_o,
    output logic [2:0]             axi_aw_size_o,
    output logic [1:0]             axi_aw_burst_o,
    output logic                   axi_w_valid_o,
    input  logic                   axi_w_ready_i,
    output logic [DataBits-1:0]    axi_w_data_o,
    output logic [DataBits/8-1:0]  axi_w_strb_o,
    output logic                   axi_w_last_o,
    input  logic                   axi_b_valid_i,
    output logic                   axi_b_ready_o,
    input  logic [IdBits-1:0]      axi_b_id_i,
    input  logic [1:0]             axi_b_resp_i
);
  localparam logic [1:0] BurstIncr = 2'b01;

  // These records are not packed: Verilator 5.006 writes invalid C++ to count their toggles.
  // verilator coverage_off
  rt_regs_pkg::rt_regs__in_t  regs_in;
  rt_regs_pkg::rt_regs__out_t regs;
  // verilator coverage_on

  localparam bit          Pixels = Config.pixels != 0;
  localparam int unsigned Readers = 4;
  localparam int unsigned FromCore = 0;
  localparam int unsigned FromSource = 1;
  localparam int unsigned FromShade = 2;  // materials, and behind it instances
  `RT_ASSERT_INIT(PixelsKnown, Config.pixels <= 1)

  // --- the core, the source of its rays and the sink of its hits ---
  logic                          core_reset, drain, can_run, start_q, busy, rays_start, source_done, drained, sink_idle, sink_empty;
  rt_core_pkg::run_t             run;
  rt_core_pkg::run_status_t      status;
  logic                          ray_valid, ray_ready, hit_valid, write_fault;
  rt_core_pkg::tagged_ray_t      ray;
  rt_core_pkg::tagged_hit_t      hit;
  rt_core_pkg::ray_tag_t         write_fault_tag;
  logic [Readers-1:0]            read_valid, read_ready;
  rt_core_pkg::read_request_t    read_request[Readers];
  rt_core_pkg::fill_t            fill_q;
  logic [DataBits-1:0]           fill_data_q;
  rt_config_pkg::counter_steps_t core_steps, steps;
  logic                             on_chip, raster_done, raster_valid, shade_ready, sink_ready, shade_idle;
  rt_contract_pkg::triangle_index_t hit_number;
  logic                             frame_fault, camera_fault, material_fault, pixel_valid, wide_pixel, front_q;
  rt_core_pkg::tagged_ray_t         raster_ray;
  logic                             camera_valid, camera_ready, made_valid, made_ready;
  rt_core_pkg::camera_ray_t         camera_ray;
  rt_core_pkg::made_ray_t           made_ray;
  rt_core_pkg::pixel_t              pixel;
  rt_contract_pkg::position_t [5:0] box;
  logic [AddrBits-1:0]              hit_base;
  logic                             picture_read, picture_written;
  logic [31:0]                      picture_data;
  localparam int unsigned AddrHighBits = AddrBits - 32;

  // Configuration registers do not change during a run (swwe), so nobody keeps a copy.
  assign run = '{
          image_base: {regs.image_base_hi.value.value[AddrHighBits-1:0], regs.image_base_lo.value.value[31:6], 6'b0},
          image_lines: regs.image_lines.value.value,
          parent_links: regs.control.parent_links.value,
          use_mailbox: regs.control.use_mailbox.value,
          own_step_limit: regs.control.own_step_limit.value,
          step_limit: regs.step_limit.value.value,
          any_origin: on_chip
      };
  // Through a register, in which the run before it counts as forgotten; a start is ignored while anything else goes on.
  always_ff @(posedge clk_i) start_q <= regs.control.start.value && can_run && !status.busy && rst_ni;
  assign busy = status.busy || !can_run || regs.control.start.value || start_q;

  logic [AddrBits-1:0] ray_hit_base;
  assign ray_hit_base = {regs.hit_base_hi.value.value[AddrHighBits-1:0], regs.hit_base_lo.value.value[31:4], 4'b0};

  rt_core #(
      .Config(Config)
  ) u_core (
      .clk_i,
      .rst_ni        (!core_reset),
      .start_i       (start_q),
      .run_i         (run),
      .status_o      (status),
      .rays_start_o  (rays_start),
      .sources_done_i(on_chip ? raster_done : source_done),
      .box_o         (box),
      .drained_o     (drained),
      .sinks_done_i  (sink_empty),
      .ray_valid_i   (on_chip ? raster_valid : ray_valid),
      .ray_ready_o   (ray_ready),
      .ray_i         (on_chip ? raster_ray : ray),
      .hit_valid_o   (hit_valid),
      .hit_ready_i   (on_chip ? shade_ready : sink_ready),
      .hit_o         (hit),
      .hit_number_o  (hit_number),
      .camera_valid_i(camera_valid),
      .camera_ready_o(camera_ready),
      .camera_i      (camera_ray),
      .made_valid_o  (made_valid),
      .made_ready_i  (made_ready),
      .made_o        (made_ray),
      .read_valid_o  (read_valid[FromCore]),
      .read_ready_i  (read_ready[FromCore]),
      .read_o        (read_request[FromCore]),
      .fill_i        (fill_q),
      .fill_data_i   (fill_data_q),
      .steps_o       (core_steps)
  );
  rt_ray_source #(
      .Config(Config)
  ) u_source (
      .clk_i,
      .rst_ni       (!core_reset),
      .start_i      (rays_start && !on_chip),
      .base_i       ({regs.ray_base_hi.value.value[AddrHighBits-1:0], regs.ray_base_lo.value.value[31:5], 5'b0}),
      .count_i      (regs.ray_count.value.value),
      .row_i        (regs.ray_row.value.value),
      .done_o       (source_done),
      .fetch_valid_o(read_valid[FromSource]),
      .fetch_ready_i(read_ready[FromSource]),
      .fetch_o      (read_request[FromSource]),
      .fill_valid_i (fill_q.valid[rt_config_pkg::SourceRay]),
      .fill_error_i (fill_q.error),
      .fill_data_i  (fill_data_q),
      .ray_valid_o  (ray_valid),
      .ray_ready_i  (ray_ready && !on_chip),
      .ray_o        (ray)
  );

  // --- rays from a camera, pixels from hits ---
  if (Pixels) begin : gen_pixels
    // The registers as they stand in the map, from the first word up.
    typedef struct packed {
      logic [511:0]     camera;
      logic [1:0][63:0] frame_base;
      logic [31:0]      instance_count;
      logic [31:0]      material_count;
      logic [63:0]      material_base;
      logic [255:0]     frame;
    } pictures_t;
    rt_contract_pkg::camera_record_t camera;
    rt_contract_pkg::frame_record_t  frame;
    logic                            miss_valid, miss_ready, place_valid, finished_valid;
    rt_core_pkg::ray_tag_t           miss;
    rt_core_pkg::pixel_slot_t        place_slot, finished_slot;
    rt_core_pkg::pixel_place_t       place;
    logic                            done_before_q, drawn_q;
    logic [AddrBits-1:0]             frame_base[2];
    logic [AddrBits-1:0]             material_base;
    logic [31:0]                     material_count, instance_count;
    logic                            camera_done, shadow_busy, sample_valid, sample_ready;
    logic [1:0]                      source_valid, source_ready, fetch_valid, fetch_ready;
    logic                            source_index_unused;
    rt_core_pkg::tagged_ray_t        source[2];
    rt_core_pkg::sample_t            sample;
    rt_core_pkg::read_request_t      fetch[2];
    pictures_t                       pictures;
    rt_picture_regs u_registers (
        .clk_i,
        .rst_ni,
        .open_i      (!busy),
        .req_i       (regs.pictures.req),
        .write_i     (regs.pictures.req_is_wr),
        .index_i     (regs.pictures.addr[6:2]),
        .data_i      (regs.pictures.wr_data),
        .bits_i      (regs.pictures.wr_biten),
        .read_done_o (picture_read),
        .write_done_o(picture_written),
        .data_o      (picture_data),
        .words_o     (pictures)
    );
    assign camera          = pictures.camera;
    assign frame           = pictures.frame;
    assign material_count  = pictures.material_count;
    assign instance_count  = pictures.instance_count;
    assign material_base   = {pictures.material_base[AddrBits-1:6], 6'b0};
    for (genvar b = 0; b < 2; b++) begin : gen_base
      assign frame_base[b] = {pictures.frame_base[b][AddrBits-1:6], 6'b0};
    end
    assign on_chip    = regs.control.on_chip.value;
    assign wide_pixel = frame.kind == rt_contract_pkg::pixel_kind_t'(rt_contract_pkg::PixelHit);
    assign hit_base   = on_chip ? frame_base[!front_q] : ray_hit_base;
    // A core of two levels has what makes an object's ray, and makes the camera's with it.
    rt_raster #(
        .Own(Config.levels == 1)
    ) u_raster (
        .clk_i,
        .rst_ni          (!core_reset),
        .start_i         (rays_start && on_chip),
        .camera_i        (camera),
        .frame_i         (frame),
        .box_i           (box),
        .done_o          (camera_done),
        .fault_o         (frame_fault),
        .bad_o           (camera_fault),
        .finished_valid_i(finished_valid),
        .finished_slot_i (finished_slot),
        .place_valid_o   (place_valid),
        .place_slot_o    (place_slot),
        .place_o         (place),
        .ray_valid_o     (source_valid[1]),
        .ray_ready_i     (source_ready[1]),
        .ray_o           (source[1]),
        .miss_valid_o    (miss_valid),
        .miss_ready_i    (miss_ready),
        .miss_o          (miss),
        .camera_valid_o  (camera_valid),
        .camera_ready_i  (camera_ready),
        .camera_o        (camera_ray),
        .made_valid_i    (made_valid),
        .made_ready_o    (made_ready),
        .made_i          (made_ray)
    );
    // A sample may send another ray until it has reached rt_shade.
    assign raster_done = camera_done && !shadow_busy;
    rt_arbiter #(
        .NumInputs(2),
        .data_t   (rt_core_pkg::tagged_ray_t)
    ) u_rays (
        .clk_i,
        .rst_ni     (!core_reset),
        .in_valid_i (source_valid),
        .in_ready_o (source_ready),
        .in_data_i  (source),
        .in_last_i  ('1),
        .out_valid_o(raster_valid),
        .out_ready_i(ray_ready && on_chip),
        .out_data_o (raster_ray),
        .out_index_o(source_index_unused)
    );
    rt_shadow u_shadow (
        .clk_i,
        .rst_ni       (!core_reset),
        .start_i      (rays_start && on_chip),
        .frame_i      (frame),
        .box_i        (box),
        .busy_o       (shadow_busy),
        .place_valid_i(place_valid),
        .place_ray_i  (source[1]),
        .hit_valid_i  (hit_valid && on_chip),
        .hit_ready_o  (shade_ready),
        .hit_i        (hit),
        .hit_number_i (hit_number),
        .ray_valid_o  (source_valid[0]),
        .ray_ready_i  (source_ready[0]),
        .ray_o        (source[0]),
        .out_valid_o  (sample_valid),
        .out_ready_i  (sample_ready),
        .out_o        (sample)
    );
    for (genvar r = 0; r < 2; r++) begin : gen_fetch
      assign read_valid[FromShade+r]   = fetch_valid[r];
      assign fetch_ready[r]            = read_ready[FromShade+r];
      assign read_request[FromShade+r] = fetch[r];
    end
    rt_shade #(
        .DataBits    (DataBits),
        .GranuleBytes(Config.granule_bytes),
        .TwoLevels   (Config.levels > 1)
    ) u_shade (
        .clk_i,
        .rst_ni          (!core_reset),
        .start_i         (rays_start && on_chip),
        .frame_i         (frame),
        .base_i          (material_base),
        .count_i         (material_count),
        .placed_i        (instance_count),
        .idle_o          (shade_idle),
        .unknown_o       (material_fault),
        .hit_valid_i     (sample_valid),
        .hit_ready_o     (sample_ready),
        .hit_i           (sample),
        .miss_valid_i    (miss_valid),
        .miss_ready_o    (miss_ready),
        .miss_i          (miss),
        .place_valid_i   (place_valid),
        .place_slot_i    (place_slot),
        .place_i         (place),
        .finished_valid_o(finished_valid),
        .finished_slot_o (finished_slot),
        .fetch_valid_o   (fetch_valid),
        .fetch_ready_i   (fetch_ready),
        .fetch_o         (fetch),
        .fill_valid_i    ({fill_q.valid[rt_config_pkg::SourcePlaced], fill_q.valid[rt_config_pkg::SourceMaterial]}),
        .fill_error_i    (fill_q.error),
        .fill_data_i     (fill_data_q),
        .pixel_valid_o   (pixel_valid),
        .pixel_ready_i   (sink_ready && on_chip),
        .pixel_o         (pixel)
    );
    // The other frame buffer, when a run has drawn a frame.
    always_ff @(posedge clk_i) begin
      done_before_q <= status.done;
      if (rays_start) drawn_q <= on_chip;
      if (frame_fault || status.started || core_reset) drawn_q <= 1'b0;
      if (status.done && !done_before_q && drawn_q) front_q <= !front_q;
      if (!rst_ni) front_q <= 1'b1;
    end
  end else begin : gen_no_pixels
    rt_contract_pkg::position_t [5:0] box_unused;
    rt_contract_pkg::triangle_index_t number_unused;
    assign box_unused     = box;
    assign number_unused  = hit_number;
    assign on_chip        = 1'b0;
    assign raster_done    = 1'b1;
    assign raster_valid   = 1'b0;
    assign raster_ray     = '0;
    logic camera_unused;
    assign camera_unused  = ^{camera_ready, made_valid, made_ray};
    assign camera_valid   = 1'b0;
    assign camera_ray     = '0;
    assign made_ready     = 1'b0;
    assign shade_ready    = 1'b0;
    assign shade_idle     = 1'b1;
    assign frame_fault    = 1'b0;
    assign camera_fault   = 1'b0;
    assign material_fault = 1'b0;
    assign pixel_valid    = 1'b0;
    assign pixel          = '0;
    assign wide_pixel     = 1'b0;
    assign front_q        = 1'b0;
    assign hit_base       = ray_hit_base;
    assign picture_data   = '0;
    always_ff @(posedge clk_i) begin
      picture_read    <= regs.pictures.req && !regs.pictures.req_is_wr && rst_ni;
      picture_written <= regs.pictures.req && regs.pictures.req_is_wr && rst_ni;
    end
    for (genvar r = FromShade; r < int'(Readers); r++) begin : gen_no_reader
      assign read_valid[r]   = 1'b0;
      assign read_request[r] = '0;
    end
  end
  rt_hit_sink #(
      .DataBits(DataBits),
      .Lines   (Config.hit_lines),
      .Grain   (Pixels ? 1 : 4)
  ) u_sink (
      .clk_i,
      .rst_ni,
      .base_i     (hit_base),
      .words_log2_i(on_chip ? {1'b0, wide_pixel} : 2'd2),
      .flush_i    (on_chip ? drained && shade_idle : source_done),  // hits of the last rays leave while the others of them are traced
      .drop_i     (drain),
      .in_valid_i (on_chip ? pixel_valid : hit_valid),
      .in_ready_o (sink_ready),
      .in_data_i  (on_chip ? {pixel.tag, 64'b0, pixel.data} : hit),
      .aw_valid_o (axi_aw_valid_o),
      .aw_ready_i (axi_aw_ready_i),
      .aw_addr_o  (axi_aw_addr_o),
      .aw_len_o   (axi_aw_len_o),
      .w_valid_o  (axi_w_valid_o),
      .w_ready_i  (axi_w_ready_i),
      .w_data_o   (axi_w_data_o),
      .w_strb_o   (axi_w_strb_o),
      .w_last_o   (axi_w_last_o),
      .b_valid_i  (axi_b_valid_i),
      .b_ready_o  (axi_b_ready_o),
      .b_error_i  (axi_b_resp_i[1]),
      .idle_o     (sink_idle),
      .empty_o    (sink_empty),
      .fault_o    (write_fault),
      .fault_tag_o(write_fault_tag)
  );
  assign axi_aw_id_o    = '0;
  assign axi_aw_size_o  = 3'($clog2(DataBits / 8));
  assign axi_aw_burst_o = BurstIncr;

  // Sticky until the next start, and until a soft reset.
  logic                  write_fault_q, frame_fault_q, camera_fault_q, material_fault_q;
  rt_core_pkg::ray_tag_t write_fault_tag_q;
  always_ff @(posedge clk_i) begin
    if (write_fault && !write_fault_q) begin
      write_fault_q     <= 1'b1;
      write_fault_tag_q <= write_fault_tag;
    end
    if (frame_fault) frame_fault_q <= 1'b1;
    if (camera_fault) camera_fault_q <= 1'b1;
    if (material_fault) material_fault_q <= 1'b1;
    if (status.started || core_reset) begin
      write_fault_q    <= 1'b0;
      frame_fault_q    <= 1'b0;
      camera_fault_q   <= 1'b0;
      material_fault_q <= 1'b0;
    end
    if (core_reset) write_fault_tag_q <= '0;
  end

  // --- reads ---
  logic                       chosen_valid, chosen_ready, reading;
  logic [1:0]                 chosen_index_unused;
  rt_core_pkg::read_request_t chosen, ar;
  rt_arbiter #(
      .NumInputs(Readers),
      .data_t   (rt_core_pkg::read_request_t)
  ) u_read_arbiter (
      .clk_i,
      .rst_ni     (!core_reset),
      .in_valid_i (read_valid),
      .in_ready_o (read_ready),
      .in_data_i  (read_request),
      .in_last_i  ('1),
      .out_valid_o(chosen_valid),
      .out_ready_i(chosen_ready),
      .out_data_o (chosen),
      .out_index_o(chosen_index_unused)
  );
  rt_isolate u_isolate (
      .clk_i,
      .rst_ni,
      .soft_reset_i(regs.control.soft_reset.value),
      .core_reset_o(core_reset),
      .drain_o     (drain),
      .run_o       (can_run),
      .sink_idle_i (sink_idle),
      .read_valid_i(chosen_valid),
      .read_ready_o(chosen_ready),
      .read_i      (chosen),
      .bus_valid_o (axi_ar_valid_o),
      .bus_ready_i (axi_ar_ready_i),
      .bus_o       (ar),
      .answered_i  (fill_q.valid != '0 && fill_q.last),
      .reading_o   (reading)
  );
  assign axi_ar_id_o    = {ar.source, ar.mshr};
  assign axi_ar_addr_o  = ar.addr;
  assign axi_ar_len_o   = ar.len;
  assign axi_ar_size_o  = 3'($clog2(DataBits / 8));
  assign axi_ar_burst_o = BurstIncr;
  assign axi_r_ready_o  = 1'b1;
  always_ff @(posedge clk_i) begin
    for (int unsigned s = 0; s < rt_config_pkg::Sources; s++) begin
      fill_q.valid[s] <= rst_ni && axi_r_valid_i && axi_r_id_i[IdBits-1:rt_core_pkg::MshrIdBits] == rt_core_pkg::SourceBits'(s);
    end
    fill_q.mshr  <= axi_r_id_i[rt_core_pkg::MshrIdBits-1:0];
    fill_q.last  <= axi_r_last_i;
    fill_q.error <= axi_r_resp_i[1];
    fill_data_q  <= axi_r_data_i;
  end

  // --- counters ---
  logic        counter_done, counter_refused_q, written;
  logic [31:0] counter_data;
  assign written = axi_w_valid_o && axi_w_ready_i;
  always_comb begin
    steps             = core_steps;
    steps.read_beats  = rt_config_pkg::counter_step_t'(axi_r_valid_i);
    steps.write_beats = rt_config_pkg::counter_step_t'(written);
    // Busy: a beat either way, as memories share their bandwidth between the two.
    steps.bus_busy    = rt_config_pkg::counter_step_t'(axi_r_valid_i || written);
    steps.bus_starved = rt_config_pkg::counter_step_t'(!axi_r_valid_i && !written && !reading);
  end
  rt_counters #(
      .Count   (rt_config_pkg::CounterCount),
      .StepBits(rt_config_pkg::CounterStepBits),
      .MaxStep (rt_config_pkg::counter_max_steps(Config))
  ) u_counters (
      .clk_i,
      .rst_ni,
      .clear_i     (status.started),
      .enable_i    (status.busy),
      .step_i      (steps),
      .read_i      (regs.counters.req && !regs.counters.req_is_wr),
      .read_index_i(regs.counters.addr[7:2]),
      .read_done_o (counter_done),
      .read_data_o (counter_data)
  );
  // A counter cannot be written; the bus wants an answer.
  always_ff @(posedge clk_i) counter_refused_q <= regs.counters.req && regs.counters.req_is_wr && rst_ni;

  // --- registers ---
  always_comb begin
    regs_in.version.image.next             = Config.levels > 1 ? 8'(rt_contract_pkg::ImageVersionTwoLevels) : 8'(rt_contract_pkg::ImageVersion);
    regs_in.build.lanes.next              = 8'(Config.lanes);
    regs_in.build.contexts.next           = 12'(Config.lanes * Config.contexts_per_lane);
    regs_in.build.data_bytes.next         = 6'(DataBits / 8);
    regs_in.build.mail_entries.next            = 6'(Config.mail_entries);
    regs_in.status.busy.next               = busy;
    regs_in.status.done.next               = status.done && !start_q;
    regs_in.status.image_fault.next        = status.image_fault;
    regs_in.status.ray_fault.next          = status.ray_fault;
    regs_in.status.write_fault.next        = write_fault_q;
    regs_in.status.first_fault.next        = status.first_fault;
    regs_in.features.pixels.next           = Pixels;
    regs_in.status.front.next              = front_q;
    regs_in.status.frame_fault.next        = frame_fault_q;
    regs_in.status.camera_fault.next       = camera_fault_q;
    regs_in.status.material_fault.next     = material_fault_q;
    regs_in.fault_ray.ray.next             = status.fault_tag;
    regs_in.write_fault_ray.ray.next       = write_fault_tag_q;
    regs_in.counters.rd_ack                = counter_done;
    regs_in.counters.rd_data               = counter_data;
    regs_in.counters.wr_ack                = counter_refused_q;
    regs_in.pictures.rd_ack                = picture_read;
    regs_in.pictures.rd_data               = picture_data;
    regs_in.pictures.wr_ack                = picture_written;
    // What a run is given is not written while one lasts.
    regs_in.control.parent_links.swwe = !busy;
    regs_in.control.use_mailbox.swwe = !busy;
    regs_in.control.own_step_limit.swwe = !busy;
    regs_in.image_base_lo.value.swwe = !busy;
    regs_in.image_base_hi.value.swwe = !busy;
    regs_in.image_lines.value.swwe = !busy;
    regs_in.ray_base_lo.value.swwe = !busy;
    regs_in.ray_base_hi.value.swwe = !busy;
    regs_in.ray_count.value.swwe = !busy;
    regs_in.ray_row.value.swwe = !busy;
    regs_in.hit_base_lo.value.swwe = !busy;
    regs_in.hit_base_hi.value.swwe = !busy;
    regs_in.step_limit.value.swwe = !busy;
    regs_in.control.on_chip.swwe = Pixels && !busy;
  end
  assign irq_o = regs.control.irq_enable.value && status.done && !start_q;

  rt_regs u_regs (
      .clk           (clk_i),
      .rst           (!rst_ni),
      .s_axil_awready(axil_aw_ready_o),
      .s_axil_awvalid(axil_aw_valid_i),
      .s_axil_awaddr (axil_aw_addr_i),
      .s_axil_awprot (axil_aw_prot_i),
      .s_axil_wready (axil_w_ready_o),
      .s_axil_wvalid (axil_w_valid_i),
      .s_axil_wdata  (axil_w_data_i),
      .s_axil_wstrb  (axil_w_strb_i),
      .s_axil_bready (axil_b_ready_i),
      .s_axil_bvalid (axil_b_valid_o),
      .s_axil_bresp  (axil_b_resp_o),
      .s_axil_arready(axil_ar_ready_o),
      .s_axil_arvalid(axil_ar_valid_i),
      .s_axil_araddr (axil_ar_addr_i),
      .s_axil_arprot (axil_ar_prot_i),
      .s_axil_rready (axil_r_ready_i),
      .s_axil_rvalid (axil_r_valid_o),
      .s_axil_rdata  (axil_r_data_o),
      .s_axil_rresp  (axil_r_resp_o),
      .hwif_in       (regs_in),
      .hwif_out      (regs)
  );

  // --- rules of the bus that this side can check ---
  `RT_ASSERT_STREAM(ReadAddressHeld, axi_ar_valid_o, axi_ar_ready_i, axi_ar_addr_o)
  `RT_ASSERT_STREAM(WriteAddressHeld, axi_aw_valid_o, axi_aw_ready_i, axi_aw_addr_o)
  `RT_ASSERT_STREAM(WriteDataHeld, axi_w_valid_o, axi_w_ready_i, axi_w_data_o)
  `RT_ASSERT(ReadWithin4K, !axi_ar_valid_o ||
      32'(axi_ar_addr_o[11:0]) + (32'(axi_ar_len_o) + 32'd1) * (DataBits / 8) <= 32'd4096)
  `RT_ASSERT(WriteAnswerHasOurId, !axi_b_valid_i || axi_b_id_i == '0)
endmodule
