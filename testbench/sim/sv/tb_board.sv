// SPDX-License-Identifier: Apache-2.0
// Serial receivers and senders at three rates, and the board's memory behind its multiplexer, for tests/board/board_units_test.cpp.
//
// Serial      Divisors 4, 4.67 and 26.67 clocks a bit; pins come out and go in, so that the bench can bend what travels between them.
// Memory      Two masters with every field as a port of its own.
`include "rt_assert.svh"
module tb_board #(
    localparam int unsigned Lines = 3,
    localparam int unsigned Masters = rt_board_pkg::Masters,
    localparam int unsigned MemoryBytes = 8192,
    localparam logic [rt_board_pkg::AddrBits-1:0] MemoryBase = 40'h12_8000_0000
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    // Serial.
    input  logic [Lines-1:0]                    tx_valid_i,
    output logic [Lines-1:0]                    tx_ready_o,
    input  logic [Lines-1:0][7:0]               tx_data_i,
    output logic [Lines-1:0]                    tx_pin_o,
    input  logic [Lines-1:0]                    rx_pin_i,
    output logic [Lines-1:0]                    rx_valid_o,
    output logic [Lines-1:0][7:0]               rx_data_o,
    output logic [Lines-1:0]                    rx_error_o,
    output int                                  divisor_o [Lines],
    // Memory.
    output logic [39:0]                         base_o,
    output int                                  bytes_o,
    input  logic [Masters-1:0]                  ar_valid_i,
    output logic [Masters-1:0]                  ar_ready_o,
    input  logic [6:0]                          ar_id_i    [Masters],
    input  logic [39:0]                         ar_addr_i  [Masters],
    input  logic [7:0]                          ar_len_i   [Masters],
    input  logic [2:0]                          ar_size_i  [Masters],
    input  logic [1:0]                          ar_burst_i [Masters],
    output logic [Masters-1:0]                  r_valid_o,
    input  logic [Masters-1:0]                  r_ready_i,
    output logic [6:0]                          r_id_o,
    output logic [63:0]                         r_data_o,
    output logic [1:0]                          r_resp_o,
    output logic                                r_last_o,
    input  logic [Masters-1:0]                  aw_valid_i,
    output logic [Masters-1:0]                  aw_ready_o,
    input  logic [6:0]                          aw_id_i    [Masters],
    input  logic [39:0]                         aw_addr_i  [Masters],
    input  logic [7:0]                          aw_len_i   [Masters],
    input  logic [2:0]                          aw_size_i  [Masters],
    input  logic [1:0]                          aw_burst_i [Masters],
    input  logic [Masters-1:0]                  w_valid_i,
    output logic [Masters-1:0]                  w_ready_o,
    input  logic [63:0]                         w_data_i   [Masters],
    input  logic [7:0]                          w_strb_i   [Masters],
    input  logic [Masters-1:0]                  w_last_i,
    output logic [Masters-1:0]                  b_valid_o,
    input  logic [Masters-1:0]                  b_ready_i,
    output logic [6:0]                          b_id_o,
    output logic [1:0]                          b_resp_o
);
  for (genvar i = 0; i < int'(Lines); i++) begin : gen_line
    localparam int unsigned Divisor = i == 0 ? 1024 : i == 1 ? 1195 : 6827;
    assign divisor_o[i] = int'(Divisor);
    rt_uart_tx #(
        .Divisor(Divisor)
    ) u_tx (
        .clk_i,
        .rst_ni,
        .in_valid_i(tx_valid_i[i]),
        .in_ready_o(tx_ready_o[i]),
        .in_data_i (tx_data_i[i]),
        .tx_o      (tx_pin_o[i])
    );
    rt_uart_rx #(
        .Divisor(Divisor)
    ) u_rx (
        .clk_i,
        .rst_ni,
        .rx_i       (rx_pin_i[i]),
        .out_valid_o(rx_valid_o[i]),
        .out_data_o (rx_data_o[i]),
        .out_error_o(rx_error_o[i])
    );
  end

  rt_board_pkg::address_t [Masters-1:0] ar, aw;
  rt_board_pkg::write_t [Masters-1:0] w;
  rt_board_pkg::read_t r, mem_r;
  rt_board_pkg::answer_t b, mem_b;
  rt_board_pkg::address_t mem_ar, mem_aw;
  rt_board_pkg::write_t mem_w;
  logic mem_ar_valid, mem_ar_ready, mem_r_valid, mem_r_ready, mem_aw_valid, mem_aw_ready, mem_w_valid, mem_w_ready, mem_b_valid, mem_b_ready;
  always_comb begin
    for (int i = 0; i < int'(Masters); i++) begin
      ar[i] = '{id: {1'b0, ar_id_i[i]}, addr: ar_addr_i[i], len: ar_len_i[i], size: ar_size_i[i], burst: ar_burst_i[i]};
      aw[i] = '{id: {1'b0, aw_id_i[i]}, addr: aw_addr_i[i], len: aw_len_i[i], size: aw_size_i[i], burst: aw_burst_i[i]};
      w[i]  = '{data: w_data_i[i], strb: w_strb_i[i], last: w_last_i[i]};
    end
  end
  assign {r_id_o, r_data_o, r_resp_o, r_last_o} = {r.id[6:0], r.data, r.resp, r.last};
  assign {b_id_o, b_resp_o} = {b.id[6:0], b.resp};
  assign base_o             = MemoryBase;
  assign bytes_o            = int'(MemoryBytes);

  rt_axi_mux u_mux (
      .clk_i,
      .rst_ni,
      .ar_valid_i,
      .ar_ready_o,
      .ar_i      (ar),
      .r_valid_o,
      .r_ready_i,
      .r_o       (r),
      .aw_valid_i,
      .aw_ready_o,
      .aw_i      (aw),
      .w_valid_i,
      .w_ready_o,
      .w_i       (w),
      .b_valid_o,
      .b_ready_i,
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
      .rst_ni,
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
endmodule
