// SPDX-License-Identifier: Apache-2.0
// A whole board but its clock and pins: core, on-chip memory, serial link, lamps.
//
// Purpose     What every board shares; a board's own top (rt_ulx3s) adds pins, clock and reset. Simulated as it is (testbench/sim/board).
// Memory      MemoryBytes of block RAM from MemoryBase hold image, rays and hits; anything else is answered with DECERR. A board with a
//             memory of its own puts its controller in the place of rt_board_memory.
// Serial      BaudHz at ClockHz, 8 data bits, no parity, 1 stop bit; Divisor (clocks a bit, in 256ths) follows unless it is given.
// Lamps       led_o, from the lowest: heartbeat; frame received; link damaged (a frame or byte of the last 0.1 s); core busy; run done;
//             fault (the host has read a fault from the core's status, until the next start); 0, for the board's own use; a frame has been served.
// Config      A named configuration with a bus of 8 bytes; the macro RT_CONFIG chooses another default for tools that cannot pass a record.
`include "rt_assert.svh"
`ifndef RT_CONFIG
`define RT_CONFIG ConfigEcp5
`endif
module rt_board #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::`RT_CONFIG,
    parameter int unsigned MemoryBytes = 32768,
    parameter logic [rt_board_pkg::AddrBits-1:0] MemoryBase = 40'h00_8000_0000,
    parameter int unsigned ClockHz = 80_000_000,
    parameter int unsigned BaudHz = 3_000_000,
    parameter int unsigned Divisor = 32'((64'(ClockHz) * 256 + 64'(BaudHz) / 2) / 64'(BaudHz)),
    parameter int unsigned BufferBytes = 2048,
    localparam int unsigned Lamps = 8
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic             uart_rx_i,
    output logic             uart_tx_o,
    output logic             irq_o,
    output logic [Lamps-1:0] led_o
);
  localparam int unsigned RegAddrBits = rt_regs_pkg::RT_REGS_MIN_ADDR_WIDTH;
  localparam int unsigned Core = rt_board_pkg::MasterCore;
  localparam int unsigned Link = rt_board_pkg::MasterLink;
  localparam int unsigned Masters = rt_board_pkg::Masters;

  `RT_ASSERT_INIT(BusIsEightBytes, Config.data_bits == rt_board_pkg::DataBits)

  logic [Masters-1:0] ar_valid, ar_ready, r_valid, r_ready, aw_valid, aw_ready, w_valid, w_ready, b_valid, b_ready;
  rt_board_pkg::address_t [Masters-1:0] ar, aw;
  rt_board_pkg::write_t [Masters-1:0] w;
  rt_board_pkg::read_t r;
  rt_board_pkg::answer_t b;

  // A reset for each part of the board, all a clock behind rst_ni.
  localparam int unsigned ResetLink = 0;
  localparam int unsigned ResetCore = 1;
  localparam int unsigned ResetMemory = 2;
  localparam int unsigned ResetLamps = 3;
  localparam int unsigned Resets = 4;
  logic [Resets-1:0] rst_n;
  rt_copies #(
      .Copies(Resets),
      .Start (1'b0)
  ) u_resets (
      .clk_i,
      .data_i(rst_ni),
      .data_o(rst_n)
  );

  // --- serial line ---
  logic in_valid, in_error, out_valid, out_ready;
  logic [7:0] in_data, out_data;
  logic frame_good, frame_bad;
  rt_uart_rx #(
      .Divisor(Divisor)
  ) u_uart_rx (
      .clk_i,
      .rst_ni     (rst_n[ResetLink]),
      .rx_i       (uart_rx_i),
      .out_valid_o(in_valid),
      .out_data_o (in_data),
      .out_error_o(in_error)
  );
  rt_uart_tx #(
      .Divisor(Divisor)
  ) u_uart_tx (
      .clk_i,
      .rst_ni    (rst_n[ResetLink]),
      .in_valid_i(out_valid),
      .in_ready_o(out_ready),
      .in_data_i (out_data),
      .tx_o      (uart_tx_o)
  );

  // --- link ---
  logic lite_aw_valid, lite_aw_ready, lite_w_valid, lite_w_ready, lite_b_valid, lite_b_ready;
  logic lite_ar_valid, lite_ar_ready, lite_r_valid, lite_r_ready;
  logic [RegAddrBits-1:0] lite_aw_addr, lite_ar_addr;
  logic [31:0] lite_w_data, lite_r_data;
  logic [1:0] lite_b_resp, lite_r_resp;
  rt_link #(
      .BufferBytes(BufferBytes),
      .MemoryBytes(MemoryBytes),
      .MemoryBase (MemoryBase),
      .ClockHz    (ClockHz)
  ) u_link (
      .clk_i,
      .rst_ni         (rst_n[ResetLink]),
      .in_valid_i     (in_valid),
      .in_data_i      (in_data),
      .in_error_i     (in_error),
      .out_valid_o    (out_valid),
      .out_ready_i    (out_ready),
      .out_data_o     (out_data),
      .irq_i          (irq_o),
      .good_o         (frame_good),
      .bad_o          (frame_bad),
      .axil_aw_valid_o(lite_aw_valid),
      .axil_aw_ready_i(lite_aw_ready),
      .axil_aw_addr_o (lite_aw_addr),
      .axil_w_valid_o (lite_w_valid),
      .axil_w_ready_i (lite_w_ready),
      .axil_w_data_o  (lite_w_data),
      .axil_b_valid_i (lite_b_valid),
      .axil_b_ready_o (lite_b_ready),
      .axil_b_resp_i  (lite_b_resp),
      .axil_ar_valid_o(lite_ar_valid),
      .axil_ar_ready_i(lite_ar_ready),
      .axil_ar_addr_o (lite_ar_addr),
      .axil_r_valid_i (lite_r_valid),
      .axil_r_ready_o (lite_r_ready),
      .axil_r_data_i  (lite_r_data),
      .axil_r_resp_i  (lite_r_resp),
      .ar_valid_o     (ar_valid[Link]),
      .ar_ready_i     (ar_ready[Link]),
      .ar_o           (ar[Link]),
      .r_valid_i      (r_valid[Link]),
      .r_ready_o      (r_ready[Link]),
      .r_i            (r),
      .aw_valid_o     (aw_valid[Link]),
      .aw_ready_i     (aw_ready[Link]),
      .aw_o           (aw[Link]),
      .w_valid_o      (w_valid[Link]),
      .w_ready_i      (w_ready[Link]),
      .w_o            (w[Link]),
      .b_valid_i      (b_valid[Link]),
      .b_ready_o      (b_ready[Link]),
      .b_i            (b)
  );

  // --- core ---
  logic [rt_board_pkg::IdBits-1:0] core_ar_id, core_aw_id;
  rt_top #(
      .Config(Config)
  ) u_top (
      .clk_i,
      .rst_ni         (rst_n[ResetCore]),
      .irq_o,
      .axil_aw_valid_i(lite_aw_valid),
      .axil_aw_ready_o(lite_aw_ready),
      .axil_aw_addr_i (lite_aw_addr),
      .axil_aw_prot_i ('0),
      .axil_w_valid_i (lite_w_valid),
      .axil_w_ready_o (lite_w_ready),
      .axil_w_data_i  (lite_w_data),
      .axil_w_strb_i  ('1),
      .axil_b_valid_o (lite_b_valid),
      .axil_b_ready_i (lite_b_ready),
      .axil_b_resp_o  (lite_b_resp),
      .axil_ar_valid_i(lite_ar_valid),
      .axil_ar_ready_o(lite_ar_ready),
      .axil_ar_addr_i (lite_ar_addr),
      .axil_ar_prot_i ('0),
      .axil_r_valid_o (lite_r_valid),
      .axil_r_ready_i (lite_r_ready),
      .axil_r_data_o  (lite_r_data),
      .axil_r_resp_o  (lite_r_resp),
      .axi_ar_valid_o (ar_valid[Core]),
      .axi_ar_ready_i (ar_ready[Core]),
      .axi_ar_id_o    (core_ar_id),
      .axi_ar_addr_o  (ar[Core].addr),
      .axi_ar_len_o   (ar[Core].len),
      .axi_ar_size_o  (ar[Core].size),
      .axi_ar_burst_o (ar[Core].burst),
      .axi_r_valid_i  (r_valid[Core]),
      .axi_r_ready_o  (r_ready[Core]),
      .axi_r_id_i     (r.id[rt_board_pkg::IdBits-1:0]),
      .axi_r_data_i   (r.data),
      .axi_r_resp_i   (r.resp),
      .axi_r_last_i   (r.last),
      .axi_aw_valid_o (aw_valid[Core]),
      .axi_aw_ready_i (aw_ready[Core]),
      .axi_aw_id_o    (core_aw_id),
      .axi_aw_addr_o  (aw[Core].addr),
      .axi_aw_len_o   (aw[Core].len),
      .axi_aw_size_o  (aw[Core].size),
      .axi_aw_burst_o (aw[Core].burst),
      .axi_w_valid_o  (w_valid[Core]),
      .axi_w_ready_i  (w_ready[Core]),
      .axi_w_data_o   (w[Core].data),
      .axi_w_strb_o   (w[Core].strb),
      .axi_w_last_o   (w[Core].last),
      .axi_b_valid_i  (b_valid[Core]),
      .axi_b_ready_o  (b_ready[Core]),
      .axi_b_id_i     (b.id[rt_board_pkg::IdBits-1:0]),
      .axi_b_resp_i   (b.resp)
  );
  assign ar[Core].id = {1'b0, core_ar_id};
  assign aw[Core].id = {1'b0, core_aw_id};

  // --- memory ---
  logic mem_ar_valid, mem_ar_ready, mem_r_valid, mem_r_ready, mem_aw_valid, mem_aw_ready, mem_w_valid, mem_w_ready, mem_b_valid, mem_b_ready;
  rt_board_pkg::address_t mem_ar, mem_aw;
  rt_board_pkg::read_t mem_r;
  rt_board_pkg::write_t mem_w;
  rt_board_pkg::answer_t mem_b;
  rt_axi_mux u_mux (
      .clk_i,
      .rst_ni    (rst_n[ResetMemory]),
      .ar_valid_i(ar_valid),
      .ar_ready_o(ar_ready),
      .ar_i      (ar),
      .r_valid_o (r_valid),
      .r_ready_i (r_ready),
      .r_o       (r),
      .aw_valid_i(aw_valid),
      .aw_ready_o(aw_ready),
      .aw_i      (aw),
      .w_valid_i (w_valid),
      .w_ready_o (w_ready),
      .w_i       (w),
      .b_valid_o (b_valid),
      .b_ready_i (b_ready),
      .b_o       (b),
      .ar_valid_o(mem_ar_valid),
      .ar_ready_i(mem_ar_ready),
      .ar_o      (mem_ar),
      .r_valid_i (mem_r_valid),
      .r_ready_o (mem_r_ready),
      .r_i       (mem_r),
      .aw_valid_o(mem_aw_valid),
      .aw_ready_i(mem_aw_ready),
      .aw_o      (mem_aw),
      .w_valid_o (mem_w_valid),
      .w_ready_i (mem_w_ready),
      .w_o       (mem_w),
      .b_valid_i (mem_b_valid),
      .b_ready_o (mem_b_ready),
      .b_i       (mem_b)
  );
  rt_board_memory #(
      .Bytes(MemoryBytes),
      .Base (MemoryBase)
  ) u_memory (
      .clk_i,
      .rst_ni    (rst_n[ResetMemory]),
      .ar_valid_i(mem_ar_valid),
      .ar_ready_o(mem_ar_ready),
      .ar_i      (mem_ar),
      .r_valid_o (mem_r_valid),
      .r_ready_i (mem_r_ready),
      .r_o       (mem_r),
      .aw_valid_i(mem_aw_valid),
      .aw_ready_o(mem_aw_ready),
      .aw_i      (mem_aw),
      .w_valid_i (mem_w_valid),
      .w_ready_o (mem_w_ready),
      .w_i       (mem_w),
      .b_valid_o (mem_b_valid),
      .b_ready_i (mem_b_ready),
      .b_o       (mem_b)
  );

  // --- lamps ---
  // A pulse is shown for 2^ShowBits clocks; the core's registers are watched on their way to and from the link (addresses and fields of
  // rt_regs.rdl).
  localparam int unsigned ShowBits = 23;
  localparam int unsigned BeatBits = 26;
  localparam logic [RegAddrBits-1:0] ControlAddr = RegAddrBits'('h010);
  localparam logic [RegAddrBits-1:0] StatusAddr = RegAddrBits'('h014);
  localparam int unsigned ControlStart = 0;

  logic [BeatBits-1:0] beat_q;
  logic [ShowBits-1:0] good_left_q, bad_left_q;
  struct packed {
    logic good;
    logic bad;
  } seen_q;
  logic good_q, bad_q;
  logic busy_q, fault_q, of_status_q, served_q, start;
  assign start = lite_w_valid && lite_w_ready && lite_aw_addr == ControlAddr && lite_w_data[ControlStart];
  always_ff @(posedge clk_i) begin
    beat_q <= beat_q + 1'b1;
    // Twice, as the lamps may be far from the link.
    seen_q <= '{good: frame_good, bad: frame_bad || (in_valid && in_error)};
    good_q <= seen_q.good;
    bad_q  <= seen_q.bad;
    if (good_left_q != '0) good_left_q <= good_left_q - 1'b1;
    if (bad_left_q != '0) bad_left_q <= bad_left_q - 1'b1;
    if (good_q) good_left_q <= '1;
    if (bad_q) bad_left_q <= '1;
    if (good_q) served_q <= 1'b1;
    if (lite_ar_valid && lite_ar_ready) of_status_q <= lite_ar_addr == StatusAddr;
    if (lite_r_valid && lite_r_ready && of_status_q) begin
      busy_q  <= lite_r_data[0];
      fault_q <= lite_r_data[5:4] != '0 || lite_r_data[9:8] != '0;
    end
    if (irq_o) busy_q <= 1'b0;
    if (start) begin
      busy_q  <= 1'b1;
      fault_q <= 1'b0;
    end
    if (!rst_n[ResetLamps]) begin
      seen_q      <= '0;
      good_q      <= 1'b0;
      bad_q       <= 1'b0;
      beat_q      <= '0;
      good_left_q <= '0;
      bad_left_q  <= '0;
      busy_q      <= 1'b0;
      fault_q     <= 1'b0;
      of_status_q <= 1'b0;
      served_q    <= 1'b0;
    end
  end
  assign led_o = {served_q, 1'b0, fault_q, irq_o, busy_q, bad_left_q != '0, good_left_q != '0, beat_q[BeatBits-1]};
endmodule
