// SPDX-License-Identifier: Apache-2.0
// DRAM behind a board's AXI4: core and link on one side, the native ports of a LiteDRAM controller on the other.
//
// Purpose     Takes the place of rt_board_memory where a board has a memory of its own. Reads are spread over ReadPorts ports by the bank they fall
//             into, so that banks work beside each other; writes have a port of their own.
// Range       Bytes bytes from Base (a multiple of Bytes, a power of two of at least 4096); elsewhere DECERR in every beat and no effect. SLVERR where a
//             burst is not INCR of whole beats, crosses 4 KB, or comes while ready_i is 0: the controller has not been initialised yet.
// Words       Address bits from BankShift up are the number of the bank (LiteDRAM's ROW_BANK_COL): $clog2 of the bytes of a row of one bank.
// Order       Reads of one id in order (rt_dram_order), beats of different ids may be mixed, at word boundaries and where a port has nothing more to give.
//             A read behind the answer of a write sees it: the controller keeps the order of a bank's commands.
// Patience    LiteDRAM lets a port keep a bank while it has commands for it. A command that has waited Patience clocks stops new commands of all other
//             ports until it is accepted, so each waits at most Patience clocks and what the others have queued, times the number of ports.
// Cuts        Every valid, data and ready path of the AXI side.
// Latency     Beside the controller's: 3 clocks to a read command, 2 from its word to the beat, 3 from a beat to a write command.
`include "rt_assert.svh"
module rt_dram_port #(
    parameter int unsigned ReadPorts = 4,
    parameter int unsigned WordBits = 128,
    parameter int unsigned BankShift = 11,
    parameter longint unsigned Bytes = 64'h2000_0000,
    parameter logic [rt_board_pkg::AddrBits-1:0] Base = 40'h00_8000_0000,
    parameter int unsigned Patience = 64,
    parameter int unsigned Places = 16,
    localparam int unsigned SizeBits = $clog2(Bytes),
    localparam int unsigned WordAddrBits = SizeBits - $clog2(WordBits / 8)
) (
    input  logic                                    clk_i,
    input  logic                                    rst_ni,
    input  logic                                    ready_i,
    input  logic                                    ar_valid_i,
    output logic                                    ar_ready_o,
    input  rt_board_pkg::address_t                  ar_i,
    output logic                                    r_valid_o,
    input  logic                                    r_ready_i,
    output rt_board_pkg::read_t                     r_o,
    input  logic                                    aw_valid_i,
    output logic                                    aw_ready_o,
    input  rt_board_pkg::address_t                  aw_i,
    input  logic                                    w_valid_i,
    output logic                                    w_ready_o,
    input  rt_board_pkg::write_t                    w_i,
    output logic                                    b_valid_o,
    input  logic                                    b_ready_i,
    output rt_board_pkg::answer_t                   b_o,
    // Native read ports.
    output logic [ReadPorts-1:0]                    read_valid_o,
    input  logic [ReadPorts-1:0]                    read_ready_i,
    output logic [ReadPorts-1:0][WordAddrBits-1:0]  read_addr_o,
    input  logic [ReadPorts-1:0]                    read_word_valid_i,
    input  logic [ReadPorts-1:0][WordBits-1:0]      read_word_i,
    // Native write port.
    output logic                                    write_valid_o,
    input  logic                                    write_ready_i,
    output logic [WordAddrBits-1:0]                 write_addr_o,
    output logic                                    write_word_valid_o,
    input  logic                                    write_word_ready_i,
    output logic [WordBits-1:0]                     write_word_o,
    output logic [WordBits/8-1:0]                   write_strobe_o
);
  localparam int unsigned PageBits = 12;
  localparam int unsigned BeatShift = 3;
  localparam int unsigned BeatAddrBits = SizeBits - BeatShift;
  localparam int unsigned PageBeatBits = PageBits - BeatShift;
  // Bursts that are refused are answered by one port more.
  localparam int unsigned Answerers = ReadPorts + 1;
  localparam int unsigned Refused = ReadPorts;
  localparam int unsigned SelectBits = $clog2(Answerers);
  localparam int unsigned BankBits = ReadPorts > 1 ? $clog2(ReadPorts) : 1;
  localparam int unsigned WaitBits = $clog2(Patience + 1);
  localparam int unsigned Commanders = ReadPorts + 1;
  localparam int unsigned Writer = ReadPorts;

  `RT_ASSERT_INIT(PowerOfTwo, Bytes == 64'd1 << SizeBits && SizeBits >= PageBits && SizeBits < rt_board_pkg::AddrBits)
  `RT_ASSERT_INIT(BaseAligned, Base[SizeBits-1:0] == '0)
  `RT_ASSERT_INIT(PortsPowerOfTwo, ReadPorts == 32'd1 << $clog2(ReadPorts))
  `RT_ASSERT_INIT(BanksInside, BankShift > $clog2(WordBits / 8) && BankShift + BankBits <= SizeBits)

  typedef struct packed {
    logic [rt_board_pkg::MuxIdBits-1:0] id;
    logic [BeatAddrBits-1:0]            beat;
    logic [7:0]                         len;
    logic [1:0]                         resp;
  } burst_t;

  function automatic burst_t burst_of(rt_board_pkg::address_t a, logic initialised);
    burst_t b;
    logic   crosses;  // 4 KB
    crosses = {1'b0, a.addr[PageBits-1:BeatShift]} + (PageBeatBits + 1)'(a.len) >= (PageBeatBits + 1)'(1 << PageBeatBits);
    b.id   = a.id;
    b.beat = a.addr[SizeBits-1:BeatShift];
    b.len  = a.len;
    b.resp = rt_board_pkg::RespOkay;
    if (a.addr[rt_board_pkg::AddrBits-1:SizeBits] != Base[rt_board_pkg::AddrBits-1:SizeBits]) b.resp = rt_board_pkg::RespDecErr;
    else if (a.burst != rt_board_pkg::BurstIncr || a.size != rt_board_pkg::SizeBeat || crosses || !initialised) b.resp = rt_board_pkg::RespSlvErr;
    return b;
  endfunction

  logic ready_q;
  always_ff @(posedge clk_i) ready_q <= ready_i;

  // --- reads: to the port of their bank ---
  logic ar_valid, ar_take, order_go;
  burst_t ar_in, ar;
  logic [SelectBits-1:0] select;
  logic [Answerers-1:0] answerer_ready, answer_valid, answer_ready, answer_last;
  rt_board_pkg::read_t answer[Answerers];
  logic r_valid, r_ready;
  rt_board_pkg::read_t r;

  // What a register has accepted stays as it was classified.
  assign ar_in = burst_of(ar_i, ready_q);
  rt_skid #(
      .data_t(burst_t)
  ) u_ar_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (ar_valid_i && ar_ready_o),
      .in_ready_o (ar_ready_o),
      .in_data_i  (ar_in),
      .out_valid_o(ar_valid),
      .out_ready_i(ar_take),
      .out_data_o (ar)
  );

  if (ReadPorts > 1) begin : gen_bank
    assign select = ar.resp != rt_board_pkg::RespOkay ? SelectBits'(Refused) : SelectBits'(ar.beat[BankShift-BeatShift+:BankBits]);
  end else begin : gen_one
    assign select = ar.resp != rt_board_pkg::RespOkay ? SelectBits'(Refused) : '0;
  end
  assign ar_take = ar_valid && order_go && answerer_ready[select];

  rt_dram_order #(
      .IdBits(rt_board_pkg::MuxIdBits),
      .Ports (Answerers)
  ) u_order (
      .clk_i,
      .rst_ni,
      .id_i     (ar.id),
      .port_i   (select),
      .go_o     (order_go),
      .set_i    (ar_take),
      .done_i   (r_valid && r_ready && r.last),
      .done_id_i(r.id)
  );

  // --- patience: one of those that have waited too long stops all others ---
  logic [Commanders-1:0] cmd_waits, hold, first_late, late_q;
  logic [WaitBits-1:0] wait_q[Commanders];
  assign cmd_waits = {write_valid_o && !write_ready_i, read_valid_o & ~read_ready_i};
  always_comb begin
    first_late = '0;
    for (int unsigned i = 0; i < Commanders; i++) begin
      if (first_late == '0) first_late[i] = cmd_waits[i] && wait_q[i] == WaitBits'(Patience);
    end
  end
  always_ff @(posedge clk_i) begin
    for (int unsigned i = 0; i < Commanders; i++) begin
      if (!cmd_waits[i]) wait_q[i] <= '0;
      else if (wait_q[i] != WaitBits'(Patience)) wait_q[i] <= wait_q[i] + 1'b1;
    end
    // The late one stays so until it is accepted; another takes its place then.
    late_q <= late_q != '0 ? late_q & cmd_waits : first_late;
    if (!rst_ni) begin
      late_q <= '0;
      for (int unsigned i = 0; i < Commanders; i++) wait_q[i] <= '0;
    end
  end
  for (genvar i = 0; i < int'(Commanders); i++) begin : gen_hold
    assign hold[i] = late_q != '0 && !late_q[i];
  end

  for (genvar i = 0; i < int'(ReadPorts); i++) begin : gen_port
    logic more;
    rt_dram_read_port #(
        .WordBits    (WordBits),
        .WordAddrBits(WordAddrBits),
        .Places      (Places)
    ) u_port (
        .clk_i,
        .rst_ni,
        .in_valid_i  (ar_valid && order_go && select == SelectBits'(i)),
        .in_ready_o  (answerer_ready[i]),
        .in_id_i     (ar.id),
        .in_beat_i   (ar.beat),
        .in_len_i    (ar.len),
        .hold_i      (hold[i]),
        .cmd_valid_o (read_valid_o[i]),
        .cmd_ready_i (read_ready_i[i]),
        .cmd_addr_o  (read_addr_o[i]),
        .word_valid_i(read_word_valid_i[i]),
        .word_i      (read_word_i[i]),
        .out_valid_o (answer_valid[i]),
        .out_ready_i (answer_ready[i]),
        .out_data_o  (answer[i]),
        .more_o      (more)
    );
    assign answer_last[i] = !more;
  end

  // --- bursts that are refused: as many beats as were asked for, of zeros ---
  logic refused_valid, refused_take;
  burst_t refused;
  logic [7:0] refused_beat_q;
  rt_fifo #(
      .Depth (2),
      .data_t(burst_t)
  ) u_refused (
      .clk_i,
      .rst_ni,
      .in_valid_i (ar_valid && order_go && select == SelectBits'(Refused)),
      .in_ready_o (answerer_ready[Refused]),
      .in_data_i  (ar),
      .out_valid_o(refused_valid),
      .out_ready_i(refused_take && answer[Refused].last),
      .out_data_o (refused),
      .usage_o    ()
  );
  assign answer_valid[Refused] = refused_valid;
  assign answer[Refused]       = '{id: refused.id, data: '0, resp: refused.resp, last: refused_beat_q == refused.len};
  assign answer_last[Refused]  = answer[Refused].last;
  assign refused_take          = refused_valid && answer_ready[Refused];
  always_ff @(posedge clk_i) begin
    if (refused_take) refused_beat_q <= answer[Refused].last ? '0 : refused_beat_q + 1'b1;
    if (!rst_ni) refused_beat_q <= '0;
  end

  rt_arbiter #(
      .NumInputs(Answerers),
      .data_t   (rt_board_pkg::read_t)
  ) u_answers (
      .clk_i,
      .rst_ni,
      .in_valid_i (answer_valid),
      .in_ready_o (answer_ready),
      .in_data_i  (answer),
      .in_last_i  (answer_last),
      .out_valid_o(r_valid),
      .out_ready_i(r_ready),
      .out_data_o (r),
      .out_index_o()
  );
  rt_skid #(
      .data_t(rt_board_pkg::read_t)
  ) u_r_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (r_valid),
      .in_ready_o (r_ready),
      .in_data_i  (r),
      .out_valid_o(r_valid_o),
      .out_ready_i(r_ready_i),
      .out_data_o (r_o)
  );

  // --- writes ---
  logic aw_valid, aw_ready, w_valid, w_ready;
  burst_t aw_in, aw;
  rt_board_pkg::write_t w;
  assign aw_in = burst_of(aw_i, ready_q);
  rt_fifo #(
      .Depth (4),
      .data_t(burst_t)
  ) u_aw (
      .clk_i,
      .rst_ni,
      .in_valid_i (aw_valid_i && aw_ready_o),
      .in_ready_o (aw_ready_o),
      .in_data_i  (aw_in),
      .out_valid_o(aw_valid),
      .out_ready_i(aw_ready),
      .out_data_o (aw),
      .usage_o    ()
  );
  rt_skid #(
      .data_t(rt_board_pkg::write_t)
  ) u_w_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (w_valid_i),
      .in_ready_o (w_ready_o),
      .in_data_i  (w_i),
      .out_valid_o(w_valid),
      .out_ready_i(w_ready),
      .out_data_o (w)
  );
  rt_dram_writes #(
      .WordBits    (WordBits),
      .WordAddrBits(WordAddrBits)
  ) u_writes (
      .clk_i,
      .rst_ni,
      .aw_valid_i  (aw_valid),
      .aw_ready_o  (aw_ready),
      .aw_id_i     (aw.id),
      .aw_beat_i   (aw.beat),
      .aw_resp_i   (aw.resp),
      .w_valid_i   (w_valid),
      .w_ready_o   (w_ready),
      .w_i         (w),
      .b_valid_o,
      .b_ready_i,
      .b_o,
      .hold_i      (hold[Writer]),
      .cmd_valid_o (write_valid_o),
      .cmd_ready_i (write_ready_i),
      .cmd_addr_o  (write_addr_o),
      .word_valid_o(write_word_valid_o),
      .word_ready_i(write_word_ready_i),
      .word_o      (write_word_o),
      .strobe_o    (write_strobe_o)
  );

  `RT_ASSERT_STREAM(ReadAddressHeld, ar_valid_i, ar_ready_o, ar_i)
  `RT_ASSERT_STREAM(WriteAddressHeld, aw_valid_i, aw_ready_o, aw_i)
  `RT_ASSERT_STREAM(ReadHeld, r_valid_o, r_ready_i, r_o)
  `RT_ASSERT_STREAM(AnswerHeld, b_valid_o, b_ready_i, b_o)
  `RT_ASSERT(OneIsLate, $onehot0(late_q))
endmodule
