// SPDX-License-Identifier: Apache-2.0
// Joins the core and the link into one AXI4 master for the board's memory.
//
// Reads       Round robin between the two; the upper bit of the id (rt_board_pkg::Master*) brings an answer back to who asked.
// Writes      Addresses round robin; data follow in the order of the accepted addresses, a burst at a time, so a master must send the data
//             of a burst it was granted without waiting for anything of the other one (both do).
// Cuts        Addresses, write data and answers pass a register each way (rt_skid); no master sees the other's ready in the same clock.
// Latency     1 clock each way.
`include "rt_assert.svh"
module rt_axi_mux #(
    parameter int unsigned Queue = 16,
    localparam int unsigned Masters = rt_board_pkg::Masters
) (
    input  logic                                 clk_i,
    input  logic                                 rst_ni,
    // From the masters.
    input  logic                   [Masters-1:0] ar_valid_i,
    output logic                   [Masters-1:0] ar_ready_o,
    input  rt_board_pkg::address_t [Masters-1:0] ar_i,
    output logic                   [Masters-1:0] r_valid_o,
    input  logic                   [Masters-1:0] r_ready_i,
    output rt_board_pkg::read_t                  r_o,
    input  logic                   [Masters-1:0] aw_valid_i,
    output logic                   [Masters-1:0] aw_ready_o,
    input  rt_board_pkg::address_t [Masters-1:0] aw_i,
    input  logic                   [Masters-1:0] w_valid_i,
    output logic                   [Masters-1:0] w_ready_o,
    input  rt_board_pkg::write_t   [Masters-1:0] w_i,
    output logic                   [Masters-1:0] b_valid_o,
    input  logic                   [Masters-1:0] b_ready_i,
    output rt_board_pkg::answer_t                b_o,
    // To the memory.
    output logic                                 ar_valid_o,
    input  logic                                 ar_ready_i,
    output rt_board_pkg::address_t               ar_o,
    input  logic                                 r_valid_i,
    output logic                                 r_ready_o,
    input  rt_board_pkg::read_t                  r_i,
    output logic                                 aw_valid_o,
    input  logic                                 aw_ready_i,
    output rt_board_pkg::address_t               aw_o,
    output logic                                 w_valid_o,
    input  logic                                 w_ready_i,
    output rt_board_pkg::write_t                 w_o,
    input  logic                                 b_valid_i,
    output logic                                 b_ready_o,
    input  rt_board_pkg::answer_t                b_i
);
  localparam int unsigned SelectBit = rt_board_pkg::MuxIdBits - 1;

  `RT_ASSERT_INIT(TwoMasters, Masters == 2)

  // --- addresses, each with its master in the id ---
  rt_board_pkg::address_t ar_in[Masters];
  rt_board_pkg::address_t aw_in[Masters];
  for (genvar i = 0; i < int'(Masters); i++) begin : gen_master
    always_comb begin
      ar_in[i]               = ar_i[i];
      ar_in[i].id[SelectBit] = 1'(i);
      aw_in[i]               = aw_i[i];
      aw_in[i].id[SelectBit] = 1'(i);
    end
  end

  logic ar_valid, ar_ready, aw_valid, aw_ready, order_in_ready, aw_skid_ready;
  logic aw_index;
  rt_board_pkg::address_t ar, aw;
  rt_arbiter #(
      .NumInputs(Masters),
      .data_t   (rt_board_pkg::address_t)
  ) u_ar_arbiter (
      .clk_i,
      .rst_ni,
      .in_valid_i (ar_valid_i),
      .in_ready_o (ar_ready_o),
      .in_data_i  (ar_in),
      .in_last_i  ('1),
      .out_valid_o(ar_valid),
      .out_ready_i(ar_ready),
      .out_data_o (ar),
      .out_index_o()
  );
  rt_skid #(
      .data_t(rt_board_pkg::address_t)
  ) u_ar_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (ar_valid),
      .in_ready_o (ar_ready),
      .in_data_i  (ar),
      .out_valid_o(ar_valid_o),
      .out_ready_i(ar_ready_i),
      .out_data_o (ar_o)
  );
  rt_arbiter #(
      .NumInputs(Masters),
      .data_t   (rt_board_pkg::address_t)
  ) u_aw_arbiter (
      .clk_i,
      .rst_ni,
      .in_valid_i (aw_valid_i),
      .in_ready_o (aw_ready_o),
      .in_data_i  (aw_in),
      .in_last_i  ('1),
      .out_valid_o(aw_valid),
      .out_ready_i(aw_ready),
      .out_data_o (aw),
      .out_index_o(aw_index)
  );
  // An address goes on together with the note whose data come next. Both places are registers, so neither waits for the other's ready.
  assign aw_ready = aw_skid_ready && order_in_ready;
  rt_skid #(
      .data_t(rt_board_pkg::address_t)
  ) u_aw_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (aw_valid && order_in_ready),
      .in_ready_o (aw_skid_ready),
      .in_data_i  (aw),
      .out_valid_o(aw_valid_o),
      .out_ready_i(aw_ready_i),
      .out_data_o (aw_o)
  );

  // --- write data ---
  logic order_valid, order, w_valid, w_ready;
  rt_fifo #(
      .Depth (Queue),
      .data_t(logic)
  ) u_order (
      .clk_i,
      .rst_ni,
      .in_valid_i (aw_valid && aw_skid_ready),
      .in_ready_o (order_in_ready),
      .in_data_i  (aw_index),
      .out_valid_o(order_valid),
      .out_ready_i(w_valid && w_ready && w_i[order].last),
      .out_data_o (order),
      .usage_o    ()
  );
  assign w_valid = order_valid && w_valid_i[order];
  always_comb begin
    w_ready_o        = '0;
    w_ready_o[order] = order_valid && w_ready;
  end
  rt_skid #(
      .data_t(rt_board_pkg::write_t)
  ) u_w_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (w_valid),
      .in_ready_o (w_ready),
      .in_data_i  (w_i[order]),
      .out_valid_o(w_valid_o),
      .out_ready_i(w_ready_i),
      .out_data_o (w_o)
  );

  // --- answers ---
  logic r_valid, b_valid;
  rt_skid #(
      .data_t(rt_board_pkg::read_t)
  ) u_r_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (r_valid_i),
      .in_ready_o (r_ready_o),
      .in_data_i  (r_i),
      .out_valid_o(r_valid),
      .out_ready_i(r_ready_i[r_o.id[SelectBit]]),
      .out_data_o (r_o)
  );
  rt_skid #(
      .data_t(rt_board_pkg::answer_t)
  ) u_b_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (b_valid_i),
      .in_ready_o (b_ready_o),
      .in_data_i  (b_i),
      .out_valid_o(b_valid),
      .out_ready_i(b_ready_i[b_o.id[SelectBit]]),
      .out_data_o (b_o)
  );
  always_comb begin
    r_valid_o                    = '0;
    r_valid_o[r_o.id[SelectBit]] = r_valid;
    b_valid_o                    = '0;
    b_valid_o[b_o.id[SelectBit]] = b_valid;
  end

  `RT_ASSERT(OneOwner, $onehot0(r_valid_o) && $onehot0(b_valid_o))
endmodule
