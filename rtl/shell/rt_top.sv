// SPDX-License-Identifier: Apache-2.0
// Top of the core: AXI4-Lite registers, AXI4 master, interrupt.
//
// Purpose     Registers (rtl/shell, generated from rt_regs.rdl), the AXI master and its orderly stop around rt_core.
// Reads       ARID = {source, miss register}; answers are taken in every clock (RREADY is 1 out of reset) in any order between ids.
//             Bursts are INCR, aligned, of at most 128 bytes, and stay within 4 KB.
// Writes      Lines of 64 bytes with strobes (rt_hit_sink), one id.
// Soft reset  No new transaction is offered, those in flight are completed and dropped, then rt_core is reset. What the slave has been
//             offered is never taken back, so the bus never sees a broken rule.
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

  // --- the core, the source of its rays and the sink of its hits ---
  logic                          core_reset, drain, can_run, start_q, busy, rays_start, source_done, drained, sink_idle, sink_empty;
  rt_core_pkg::run_t             run;
  rt_core_pkg::run_status_t      status;
  logic                          ray_valid, ray_ready, hit_valid, hit_ready, write_fault;
  rt_core_pkg::tagged_ray_t      ray;
  rt_core_pkg::tagged_hit_t      hit;
  rt_core_pkg::ray_tag_t         write_fault_tag;
  logic [1:0]                    read_valid, read_ready;
  rt_core_pkg::read_request_t    read_request[2];
  rt_core_pkg::fill_t            fill_q;
  logic [DataBits-1:0]           fill_data_q;
  rt_config_pkg::counter_steps_t core_steps, steps;
  localparam int unsigned FromCore = 0;
  localparam int unsigned FromSource = 1;
  localparam int unsigned AddrHighBits = AddrBits - 32;

  // Configuration registers do not change during a run (swwe), so nobody keeps a copy.
  assign run = '{
          image_base: {regs.image_base_hi.value.value[AddrHighBits-1:0], regs.image_base_lo.value.value[31:6], 6'b0},
          image_lines: regs.image_lines.value.value,
          parent_links: regs.control.parent_links.value,
          use_mailbox: regs.control.use_mailbox.value,
          own_step_limit: regs.control.own_step_limit.value,
          step_limit: regs.step_limit.value.value
      };
  // Through a register, in which the run before it counts as forgotten; a start is ignored while anything else goes on.
  always_ff @(posedge clk_i) start_q <= regs.control.start.value && can_run && !status.busy && rst_ni;
  assign busy = status.busy || !can_run || regs.control.start.value || start_q;

  rt_core #(
      .Config(Config)
  ) u_core (
      .clk_i,
      .rst_ni        (!core_reset),
      .start_i       (start_q),
      .run_i         (run),
      .status_o      (status),
      .rays_start_o  (rays_start),
      .sources_done_i(source_done),
      .drained_o     (drained),
      .sinks_done_i  (sink_empty),
      .ray_valid_i   (ray_valid),
      .ray_ready_o   (ray_ready),
      .ray_i         (ray),
      .hit_valid_o   (hit_valid),
      .hit_ready_i   (hit_ready),
      .hit_o         (hit),
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
      .start_i      (rays_start),
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
      .ray_ready_i  (ray_ready),
      .ray_o        (ray)
  );
  rt_hit_sink #(
      .DataBits(DataBits),
      .Lines   (Config.hit_lines)
  ) u_sink (
      .clk_i,
      .rst_ni,
      .base_i     ({regs.hit_base_hi.value.value[AddrHighBits-1:0], regs.hit_base_lo.value.value[31:4], 4'b0}),
      .flush_i    (drained),
      .drop_i     (drain),
      .in_valid_i (hit_valid),
      .in_ready_o (hit_ready),
      .in_data_i  (hit),
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
  logic                  write_fault_q;
  rt_core_pkg::ray_tag_t write_fault_tag_q;
  always_ff @(posedge clk_i) begin
    if (write_fault && !write_fault_q) begin
      write_fault_q     <= 1'b1;
      write_fault_tag_q <= write_fault_tag;
    end
    if (status.started || core_reset) write_fault_q <= 1'b0;
    if (core_reset) write_fault_tag_q <= '0;
  end

  // --- reads ---
  logic                       chosen_valid, chosen_ready, reading, chosen_index_unused;
  rt_core_pkg::read_request_t chosen, ar;
  rt_arbiter #(
      .NumInputs(2),
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
    steps.bus_blocked = rt_config_pkg::counter_step_t'(!axi_r_valid_i && !written && reading);
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
    regs_in.version.image.next             = 8'(rt_contract_pkg::ImageVersion);
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
    regs_in.fault_ray.ray.next             = status.fault_tag;
    regs_in.write_fault_ray.ray.next       = write_fault_tag_q;
    regs_in.counters.rd_ack                = counter_done;
    regs_in.counters.rd_data               = counter_data;
    regs_in.counters.wr_ack                = counter_refused_q;
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
