// SPDX-License-Identifier: Apache-2.0
// rt_dram_port in front of LiteDRAM's controller and model of a DRAM (testbench/sim/dram/generated); the macro RT_DRAM_MODEL names its module.
module tb_dram #(
    parameter int unsigned WordBits = 128,
    parameter int unsigned BankShift = 11,
    parameter longint unsigned Bytes = 64'h200_0000,
    parameter logic [rt_board_pkg::AddrBits-1:0] Base = 40'h00_8000_0000,
    localparam int unsigned ReadPorts = 4,
    localparam int unsigned IdBits = rt_board_pkg::MuxIdBits,
    localparam int unsigned AddrBits = rt_board_pkg::AddrBits,
    localparam int unsigned DataBits = rt_board_pkg::DataBits,
    localparam int unsigned WordAddrBits = $clog2(Bytes) - $clog2(WordBits / 8)
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  ar_valid_i,
    output logic                  ar_ready_o,
    input  logic [IdBits-1:0]     ar_id_i,
    input  logic [AddrBits-1:0]   ar_addr_i,
    input  logic [7:0]            ar_len_i,
    input  logic [2:0]            ar_size_i,
    input  logic [1:0]            ar_burst_i,
    output logic                  r_valid_o,
    input  logic                  r_ready_i,
    output logic [IdBits-1:0]     r_id_o,
    output logic [DataBits-1:0]   r_data_o,
    output logic [1:0]            r_resp_o,
    output logic                  r_last_o,
    input  logic                  aw_valid_i,
    output logic                  aw_ready_o,
    input  logic [IdBits-1:0]     aw_id_i,
    input  logic [AddrBits-1:0]   aw_addr_i,
    input  logic [7:0]            aw_len_i,
    input  logic [2:0]            aw_size_i,
    input  logic [1:0]            aw_burst_i,
    input  logic                  w_valid_i,
    output logic                  w_ready_o,
    input  logic [DataBits-1:0]   w_data_i,
    input  logic [DataBits/8-1:0] w_strb_i,
    input  logic                  w_last_i,
    output logic                  b_valid_o,
    input  logic                  b_ready_i,
    output logic [IdBits-1:0]     b_id_o,
    output logic [1:0]            b_resp_o,
    output logic [AddrBits-1:0]   base_o,
    output logic [AddrBits-1:0]   bytes_o
);
  rt_board_pkg::read_t r;
  rt_board_pkg::answer_t b;
  logic [ReadPorts-1:0] read_valid, read_ready, read_word_valid;
  logic [ReadPorts-1:0][WordAddrBits-1:0] read_addr;
  logic [ReadPorts-1:0][WordBits-1:0] read_word;
  logic write_valid, write_ready, write_word_valid, write_word_ready;
  logic [WordAddrBits-1:0] write_addr;
  logic [WordBits-1:0] write_word;
  logic [WordBits/8-1:0] write_strobe;
  assign base_o  = Base;
  assign bytes_o = AddrBits'(Bytes);
  assign r_id_o         = r.id;
  assign r_data_o       = r.data;
  assign r_resp_o       = r.resp;
  assign r_last_o       = r.last;
  assign b_id_o         = b.id;
  assign b_resp_o       = b.resp;
  rt_dram_port #(
      .ReadPorts(ReadPorts),
      .WordBits (WordBits),
      .BankShift(BankShift),
      .Bytes    (Bytes),
      .Base     (Base)
  ) u_port (
      .clk_i,
      .rst_ni,
      .ready_i           (1'b1),
      .ar_valid_i,
      .ar_ready_o,
      .ar_i              ('{id: ar_id_i, addr: ar_addr_i, len: ar_len_i, size: ar_size_i, burst: ar_burst_i}),
      .r_valid_o,
      .r_ready_i,
      .r_o               (r),
      .aw_valid_i,
      .aw_ready_o,
      .aw_i              ('{id: aw_id_i, addr: aw_addr_i, len: aw_len_i, size: aw_size_i, burst: aw_burst_i}),
      .w_valid_i,
      .w_ready_o,
      .w_i               ('{data: w_data_i, strb: w_strb_i, last: w_last_i}),
      .b_valid_o,
      .b_ready_i,
      .b_o               (b),
      .read_valid_o      (read_valid),
      .read_ready_i      (read_ready),
      .read_addr_o       (read_addr),
      .read_word_valid_i (read_word_valid),
      .read_word_i       (read_word),
      .write_valid_o     (write_valid),
      .write_ready_i     (write_ready),
      .write_addr_o      (write_addr),
      .write_word_valid_o(write_word_valid),
      .write_word_ready_i(write_word_ready),
      .write_word_o      (write_word),
      .write_strobe_o    (write_strobe)
  );
  `RT_DRAM_MODEL u_dram (
      .sys_clk       (clk_i),
      .sys_rst       (!rst_ni),
      .p0_cmd_valid  (read_valid[0]),
      .p0_cmd_ready  (read_ready[0]),
      .p0_cmd_we     (1'b0),
      .p0_cmd_addr   (read_addr[0]),
      .p0_wdata_valid(1'b0),
      .p0_wdata_ready(),
      .p0_wdata_we   ('0),
      .p0_wdata_data ('0),
      .p0_rdata_valid(read_word_valid[0]),
      .p0_rdata_data (read_word[0]),
      .p1_cmd_valid  (read_valid[1]),
      .p1_cmd_ready  (read_ready[1]),
      .p1_cmd_we     (1'b0),
      .p1_cmd_addr   (read_addr[1]),
      .p1_wdata_valid(1'b0),
      .p1_wdata_ready(),
      .p1_wdata_we   ('0),
      .p1_wdata_data ('0),
      .p1_rdata_valid(read_word_valid[1]),
      .p1_rdata_data (read_word[1]),
      .p2_cmd_valid  (read_valid[2]),
      .p2_cmd_ready  (read_ready[2]),
      .p2_cmd_we     (1'b0),
      .p2_cmd_addr   (read_addr[2]),
      .p2_wdata_valid(1'b0),
      .p2_wdata_ready(),
      .p2_wdata_we   ('0),
      .p2_wdata_data ('0),
      .p2_rdata_valid(read_word_valid[2]),
      .p2_rdata_data (read_word[2]),
      .p3_cmd_valid  (read_valid[3]),
      .p3_cmd_ready  (read_ready[3]),
      .p3_cmd_we     (1'b0),
      .p3_cmd_addr   (read_addr[3]),
      .p3_wdata_valid(1'b0),
      .p3_wdata_ready(),
      .p3_wdata_we   ('0),
      .p3_wdata_data ('0),
      .p3_rdata_valid(read_word_valid[3]),
      .p3_rdata_data (read_word[3]),
      .p4_cmd_valid  (write_valid),
      .p4_cmd_ready  (write_ready),
      .p4_cmd_we     (1'b1),
      .p4_cmd_addr   (write_addr),
      .p4_wdata_valid(write_word_valid),
      .p4_wdata_ready(write_word_ready),
      .p4_wdata_we   (write_strobe),
      .p4_wdata_data (write_word),
      .p4_rdata_valid(),
      .p4_rdata_data ()
  );
endmodule
