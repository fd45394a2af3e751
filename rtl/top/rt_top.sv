// Top of the core: AXI4-Lite registers, AXI4 master, interrupt.
//
// Purpose     Registers (rtl/regs, generated from rt_regs.rdl), the AXI master and its orderly stop around rt_core.
// Reads       ARID = {source, miss register}; answers are taken in every clock (RREADY is 1 out of reset) in any order between ids.
//             Bursts are INCR, aligned, of at most 128 bytes, and stay within 4 KB.
// Writes      16 bytes a hit, one id.
// Soft reset  No new transaction is offered, those in flight are completed and dropped, then rt_core is reset. What the slave has been
//             offered is never taken back, so the bus never sees a broken rule.
// Interrupt   irq_o = control.irq_enable and status.done.
// Config      A named configuration; the macro RT_CONFIG chooses another default for tools that cannot pass a record.
`include "rt_assert.svh"
`ifndef RT_CONFIG
`define RT_CONFIG ConfigEcp5
`endif
module rt_top #(
    parameter rt_core_pkg::config_t Config = rt_core_pkg::`RT_CONFIG,
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
  localparam int unsigned OutstandingBits = 10;

  // These records are not packed: Verilator 5.006 writes invalid C++ to count their toggles.
  // verilator coverage_off
  rt_regs_pkg::rt_regs__in_t  regs_in;
  rt_regs_pkg::rt_regs__out_t regs;
  // verilator coverage_on

  // --- reset of the core, a register away from it: after this one's reset, and as a soft reset: stop, drain, reset ---
  typedef enum logic [1:0] {
    Run,
    Drain,
    Reset
  } stop_e;
  stop_e                      stop_q;
  logic                       core_ready_q, draining_q;
  logic                       core_reset_q = 1'b1;
  logic [2:0]                 reset_left_q;
  logic [1:0]                 settled_q;  // rt_core hands its reset on to its units a clock later
  logic [OutstandingBits-1:0] outstanding_q;
  logic                       writer_idle, read_offered_q, read_pending;

  always_ff @(posedge clk_i) begin
    case (stop_q)
      Run: if (regs.control.soft_reset.value) stop_q <= Drain;
      Drain: if (draining_q && outstanding_q == '0 && !read_pending && writer_idle) stop_q <= Reset;
      default: begin
        reset_left_q <= reset_left_q - 1'b1;
        if (reset_left_q == '0) stop_q <= Run;
      end
    endcase
    if (stop_q != Reset) reset_left_q <= '1;
    draining_q   <= stop_q != Run;
    core_reset_q <= stop_q == Reset;
    settled_q    <= {settled_q[0], stop_q == Run};
    core_ready_q <= settled_q == '1 && stop_q == Run;
    if (!rst_ni) begin
      stop_q       <= Reset;
      draining_q   <= 1'b1;
      core_reset_q <= 1'b1;
      settled_q    <= '0;
      core_ready_q <= 1'b0;
    end
  end

  // --- core ---
  logic                              start_q, started, busy, done, ray_fault, write_fault, writer_fault, hit_written;
  logic [1:0]                        image_fault;
  rt_contract_pkg::status_t          first_fault;
  logic [31:0]                       fault_ray, write_fault_ray, writer_fault_ray, hit_ray;
  logic                              read_valid, read_ready, hit_valid, hit_ready;
  rt_core_pkg::read_request_t        read_request, ar;
  rt_contract_pkg::hit_record_t      hit;
  rt_core_pkg::counter_step_t        core_step[rt_core_pkg::CounterCount];
  rt_core_pkg::counter_step_t        step[rt_core_pkg::CounterCount];
  logic                              counter_done, counter_refused_q;
  logic [31:0]                       counter_data;
  logic                              r_valid_q, r_last_q, r_error_q;
  logic [rt_core_pkg::Sources-1:0]    r_source_q;
  logic [rt_core_pkg::MshrIdBits-1:0] r_mshr_q;
  logic [DataBits-1:0]               r_data_q;

  // Through a register, in which the run before it counts as forgotten; a start is ignored while anything else goes on.
  always_ff @(posedge clk_i) start_q <= regs.control.start.value && core_ready_q && stop_q == Run && !regs.control.soft_reset.value && !busy && rst_ni;
  rt_core #(
      .Config(Config)
  ) u_core (
      .clk_i,
      .rst_ni           (!core_reset_q),
      .start_i          (start_q),
      .image_base_i     ({regs.image_base_hi.value.value[AddrBits-33:0], regs.image_base_lo.value.value[31:6], 6'b0}),
      .image_lines_i    (regs.image_lines.value.value),
      .ray_base_i       ({regs.ray_base_hi.value.value[AddrBits-33:0], regs.ray_base_lo.value.value[31:5], 5'b0}),
      .ray_count_i      (regs.ray_count.value.value),
      .ray_row_i        (regs.ray_row.value.value),
      .parent_links_i   (regs.control.parent_links.value),
      .mailbox_i        (regs.control.use_mailbox.value),
      .own_step_limit_i (regs.control.own_step_limit.value),
      .step_limit_i     (regs.step_limit.value.value),
      .started_o        (started),
      .busy_o           (busy),
      .done_o           (done),
      .image_fault_o    (image_fault),
      .ray_fault_o      (ray_fault),
      .first_fault_o    (first_fault),
      .fault_ray_o      (fault_ray),
      .write_fault_o    (write_fault),
      .write_fault_ray_o(write_fault_ray),
      .read_valid_o     (read_valid),
      .read_ready_i     (read_ready),
      .read_o           (read_request),
      .fill_valid_i     (r_source_q),
      .fill_mshr_i      (r_mshr_q),
      .fill_data_i      (r_data_q),
      .fill_last_i      (r_last_q),
      .fill_error_i     (r_error_q),
      .hit_valid_o      (hit_valid),
      .hit_ready_i      (hit_ready && !draining_q),
      .hit_o            (hit),
      .hit_ray_o        (hit_ray),
      .hit_written_i    (hit_written),
      .write_fault_i    (writer_fault),
      .write_fault_ray_i(writer_fault_ray),
      .counter_step_o   (core_step)
  );

  // --- reads ---
  logic read_gate, skid_in_ready;
  // A request that has been offered is not taken back when the drain begins.
  assign read_gate    = !draining_q || read_offered_q;
  assign read_ready   = skid_in_ready && read_gate;
  assign read_pending = read_offered_q || axi_ar_valid_o;
  rt_skid #(
      .data_t(rt_core_pkg::read_request_t)
  ) u_read_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (read_valid && read_gate),
      .in_ready_o (skid_in_ready),
      .in_data_i  (read_request),
      .out_valid_o(axi_ar_valid_o),
      .out_ready_i(axi_ar_ready_i),
      .out_data_o (ar)
  );
  assign axi_ar_id_o    = {ar.source, ar.mshr};
  assign axi_ar_addr_o  = ar.addr;
  assign axi_ar_len_o   = ar.len;
  assign axi_ar_size_o  = 3'($clog2(DataBits / 8));
  assign axi_ar_burst_o = BurstIncr;
  assign axi_r_ready_o  = 1'b1;

  logic ar_accepted, r_finished;
  assign ar_accepted = axi_ar_valid_o && axi_ar_ready_i;
  assign r_finished  = r_valid_q && r_last_q;
  always_ff @(posedge clk_i) begin
    read_offered_q <= read_valid && read_gate && !skid_in_ready;
    outstanding_q  <= outstanding_q + OutstandingBits'(ar_accepted) - OutstandingBits'(r_finished);
    r_valid_q      <= axi_r_valid_i;
    r_mshr_q       <= axi_r_id_i[rt_core_pkg::MshrIdBits-1:0];
    for (int unsigned s = 0; s < rt_core_pkg::Sources; s++) begin
      r_source_q[s] <= axi_r_valid_i && axi_r_id_i[IdBits-1:rt_core_pkg::MshrIdBits] == rt_core_pkg::SourceBits'(s);
    end
    r_data_q       <= axi_r_data_i;
    r_last_q       <= axi_r_last_i;
    r_error_q      <= axi_r_resp_i[1];
    if (!rst_ni) begin
      read_offered_q <= 1'b0;
      outstanding_q  <= '0;
      r_valid_q      <= 1'b0;
      r_source_q     <= '0;
    end
  end

  // --- writes ---
  rt_hit_writer #(
      .DataBits(DataBits)
  ) u_writer (
      .clk_i,
      .rst_ni,
      .base_i     ({regs.hit_base_hi.value.value[AddrBits-33:0], regs.hit_base_lo.value.value[31:4], 4'b0}),
      .in_valid_i (hit_valid && !draining_q),
      .in_ready_o (hit_ready),
      .in_hit_i   (hit),
      .in_ray_i   (hit_ray),
      .aw_valid_o (axi_aw_valid_o),
      .aw_ready_i (axi_aw_ready_i),
      .aw_addr_o  (axi_aw_addr_o),
      .aw_len_o   (axi_aw_len_o),
      .w_valid_o  (axi_w_valid_o),
      .w_ready_i  (axi_w_ready_i),
      .w_data_o   (axi_w_data_o),
      .w_last_o   (axi_w_last_o),
      .b_valid_i  (axi_b_valid_i),
      .b_ready_o  (axi_b_ready_o),
      .b_error_i  (axi_b_resp_i[1]),
      .idle_o     (writer_idle),
      .written_o  (hit_written),
      .fault_o    (writer_fault),
      .fault_ray_o(writer_fault_ray)
  );
  assign axi_aw_id_o    = '0;
  assign axi_aw_size_o  = 3'($clog2(DataBits / 8));
  assign axi_aw_burst_o = BurstIncr;
  assign axi_w_strb_o   = '1;

  // --- counters ---
  always_comb begin
    step     = core_step;
    step[16] = rt_core_pkg::counter_step_t'(axi_r_valid_i);
    step[17] = rt_core_pkg::counter_step_t'(axi_w_valid_o && axi_w_ready_i);
    // Busy: a beat either way, as memories share their bandwidth between the two.
    step[27] = rt_core_pkg::counter_step_t'(axi_r_valid_i || (axi_w_valid_o && axi_w_ready_i));
    step[28] = rt_core_pkg::counter_step_t'(!axi_r_valid_i && !(axi_w_valid_o && axi_w_ready_i) && outstanding_q == '0);
    step[29] = rt_core_pkg::counter_step_t'(!axi_r_valid_i && !(axi_w_valid_o && axi_w_ready_i) && outstanding_q != '0);
  end
  rt_counters #(
      .Count   (rt_core_pkg::CounterCount),
      .StepBits(rt_core_pkg::CounterStepBits),
      .MaxStep (rt_core_pkg::counter_max_step(Config))
  ) u_counters (
      .clk_i,
      .rst_ni,
      .clear_i     (started),
      .enable_i    (busy),
      .step_i      (step),
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
    regs_in.status.busy.next               = busy || stop_q != Run || !core_ready_q || regs.control.soft_reset.value || regs.control.start.value || start_q;
    regs_in.status.done.next               = done && !start_q;
    regs_in.status.image_fault.next        = image_fault;
    regs_in.status.ray_fault.next          = ray_fault;
    regs_in.status.write_fault.next        = write_fault;
    regs_in.status.first_fault.next        = first_fault;
    regs_in.fault_ray.ray.next             = fault_ray;
    regs_in.write_fault_ray.ray.next       = write_fault_ray;
    regs_in.counters.rd_ack                = counter_done;
    regs_in.counters.rd_data               = counter_data;
    regs_in.counters.wr_ack                = counter_refused_q;
  end
  assign irq_o = regs.control.irq_enable.value && done && !start_q;

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
  `RT_ASSERT(AnswerWasAsked, !axi_r_valid_i || outstanding_q != '0)
  `RT_ASSERT(WriteAnswerHasOurId, !axi_b_valid_i || axi_b_id_i == '0)
endmodule
