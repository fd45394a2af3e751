// SPDX-License-Identifier: Apache-2.0
// rt_dram_port with every signal as a port of its own: AXI4 in front, native ports behind.
module tb_dram_port #(
    parameter int unsigned ReadPorts = 4,
    parameter int unsigned WordBits = 128,
    parameter int unsigned BankShift = 8,
    parameter longint unsigned Bytes = 64'd65536,
    parameter int unsigned Patience = 64,
    localparam int unsigned IdBits = rt_board_pkg::MuxIdBits,
    localparam int unsigned AddrBits = rt_board_pkg::AddrBits,
    localparam int unsigned DataBits = rt_board_pkg::DataBits,
    localparam int unsigned WordAddrBits = $clog2(Bytes) - $clog2(WordBits / 8)
) (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   ready_i,
    input  logic                                   ar_valid_i,
    output logic                                   ar_ready_o,
    input  logic [IdBits-1:0]                      ar_id_i,
    input  logic [AddrBits-1:0]                    ar_addr_i,
    input  logic [7:0]                             ar_len_i,
    input  logic [2:0]                             ar_size_i,
    input  logic [1:0]                             ar_burst_i,
    output logic                                   r_valid_o,
    input  logic                                   r_ready_i,
    output logic [IdBits-1:0]                      r_id_o,
    output logic [DataBits-1:0]                    r_data_o,
    output logic [1:0]                             r_resp_o,
    output logic                                   r_last_o,
    input  logic                                   aw_valid_i,
    output logic                                   aw_ready_o,
    input  logic [IdBits-1:0]                      aw_id_i,
    input  logic [AddrBits-1:0]                    aw_addr_i,
    input  logic [7:0]                             aw_len_i,
    input  logic [2:0]                             aw_size_i,
    input  logic [1:0]                             aw_burst_i,
    input  logic                                   w_valid_i,
    output logic                                   w_ready_o,
    input  logic [DataBits-1:0]                    w_data_i,
    input  logic [DataBits/8-1:0]                  w_strb_i,
    input  logic                                   w_last_i,
    output logic                                   b_valid_o,
    input  logic                                   b_ready_i,
    output logic [IdBits-1:0]                      b_id_o,
    output logic [1:0]                             b_resp_o,
    output logic [ReadPorts-1:0]                   read_valid_o,
    input  logic [ReadPorts-1:0]                   read_ready_i,
    output logic [ReadPorts-1:0][31:0]             read_addr_o,
    input  logic [ReadPorts-1:0]                   read_word_valid_i,
    input  logic [ReadPorts-1:0][WordBits-1:0]     read_word_i,
    output logic                                   write_valid_o,
    input  logic                                   write_ready_i,
    output logic [31:0]                            write_addr_o,
    output logic                                   write_word_valid_o,
    input  logic                                   write_word_ready_i,
    output logic [WordBits-1:0]                    write_word_o,
    output logic [31:0]                            write_strobe_o
);
  rt_board_pkg::read_t r;
  rt_board_pkg::answer_t b;
  logic [ReadPorts-1:0][WordAddrBits-1:0] read_addr;
  logic [WordAddrBits-1:0] write_addr;
  logic [WordBits/8-1:0] write_strobe;
  rt_dram_port #(
      .ReadPorts(ReadPorts),
      .WordBits (WordBits),
      .BankShift(BankShift),
      .Bytes    (Bytes),
      .Patience (Patience)
  ) u_port (
      .clk_i,
      .rst_ni,
      .ready_i,
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
      .read_valid_o,
      .read_ready_i,
      .read_addr_o       (read_addr),
      .read_word_valid_i,
      .read_word_i,
      .write_valid_o,
      .write_ready_i,
      .write_addr_o      (write_addr),
      .write_word_valid_o,
      .write_word_ready_i,
      .write_word_o,
      .write_strobe_o    (write_strobe)
  );
  assign r_id_o         = r.id;
  assign r_data_o       = r.data;
  assign r_resp_o       = r.resp;
  assign r_last_o       = r.last;
  assign b_id_o         = b.id;
  assign b_resp_o       = b.resp;
  assign write_addr_o   = 32'(write_addr);
  assign write_strobe_o = 32'(write_strobe);
  for (genvar i = 0; i < int'(ReadPorts); i++) begin : gen_addr
    assign read_addr_o[i] = 32'(read_addr[i]);
  end
endmodule
