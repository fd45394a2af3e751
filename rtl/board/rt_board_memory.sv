// SPDX-License-Identifier: Apache-2.0
// On-chip memory behind an AXI4 slave: holds image, rays and hits where a board has no other memory.
//
// Range       Bytes bytes from Base (a multiple of Bytes, which is a power of two of at least 4096). A burst that begins elsewhere is answered
//             with DECERR in every beat and changes nothing.
// Bursts      INCR of whole beats (8 bytes) within 4 KB, as AXI has it; any other kind or size, and a burst that crosses 4 KB (so also one that
//             crosses the end of the memory), is answered with SLVERR in every beat and changes nothing. Addresses are aligned down to a beat.
//             Byte strobes count.
// Order       Reads in the order of their addresses, writes likewise, whatever their ids: ids only travel. A read and a write of the same
//             word in the same clock: the read waits a clock, so it returns old or new data, never a mixture (NearBits of the word are compared:
//             some others wait as well).
// Throughput  One beat read and one written a clock, up to Queue bursts (reads: two more) waiting each way; no gap between bursts.
// Latency     Read: 6 clocks from the address to its first beat. Write: its answer 2 clocks after the last beat.
// Cuts        Every valid, data and ready path.
// Structure   One RAM a byte of the beat; their outputs are registered once more, because the larger memories are many blocks wide.
`include "rt_assert.svh"
module rt_board_memory #(
    parameter int unsigned Bytes = 32768,
    parameter logic [rt_board_pkg::AddrBits-1:0] Base = '0,
    parameter int unsigned Queue = 8
) (
    input  logic                   clk_i,
    input  logic                   rst_ni,
    input  logic                   ar_valid_i,
    output logic                   ar_ready_o,
    input  rt_board_pkg::address_t ar_i,
    output logic                   r_valid_o,
    input  logic                   r_ready_i,
    output rt_board_pkg::read_t    r_o,
    input  logic                   aw_valid_i,
    output logic                   aw_ready_o,
    input  rt_board_pkg::address_t aw_i,
    input  logic                   w_valid_i,
    output logic                   w_ready_o,
    input  rt_board_pkg::write_t   w_i,
    output logic                   b_valid_o,
    input  logic                   b_ready_i,
    output rt_board_pkg::answer_t  b_o
);
  localparam int unsigned PageBits = 12;
  localparam int unsigned SizeBits = $clog2(Bytes);
  localparam int unsigned BeatShift = 3;
  localparam int unsigned WordBits = SizeBits - BeatShift;
  localparam int unsigned PageWordBits = PageBits - BeatShift;
  localparam int unsigned NearBits = 4;
  localparam int unsigned ReadPlaces = 8;  // beats on their way out: RAM, register, queue

  `RT_ASSERT_INIT(PowerOfTwo, Bytes == 32'd1 << SizeBits && SizeBits >= PageBits)
  `RT_ASSERT_INIT(BaseAligned, Base[SizeBits-1:0] == '0)

  // A burst as the memory walks through it.
  typedef struct packed {
    logic [rt_board_pkg::MuxIdBits-1:0] id;
    logic [WordBits-1:0]                word;
    logic [7:0]                         len;
    logic [1:0]                         resp;
  } burst_t;

  function automatic burst_t burst_of(rt_board_pkg::address_t a);
    burst_t b;
    logic   crosses;  // 4 KB
    crosses = {1'b0, a.addr[PageBits-1:BeatShift]} + (PageWordBits + 1)'(a.len) >= (PageWordBits + 1)'(1 << PageWordBits);
    b.id   = a.id;
    b.word = a.addr[SizeBits-1:BeatShift];
    b.len  = a.len;
    b.resp = rt_board_pkg::RespOkay;
    if (a.addr[rt_board_pkg::AddrBits-1:SizeBits] != Base[rt_board_pkg::AddrBits-1:SizeBits]) b.resp = rt_board_pkg::RespDecErr;
    else if (a.burst != rt_board_pkg::BurstIncr || a.size != rt_board_pkg::SizeBeat || crosses) b.resp = rt_board_pkg::RespSlvErr;
    return b;
  endfunction

  // The next beat: within the page, so no burst leaves the memory, not even one whose data go on behind its length.
  function automatic logic [WordBits-1:0] next_word(logic [WordBits-1:0] word);
    logic [WordBits-1:0] next;
    next                    = word;
    next[PageWordBits-1:0]  = word[PageWordBits-1:0] + 1'b1;
    return next;
  endfunction

  // --- writes ---
  logic aw_valid, aw_take, aw_load, w_valid, w_take, write_fire, b_ready;
  burst_t aw, aw_q;
  rt_board_pkg::write_t w;
  logic aw_active_q, write_last;
  logic [WordBits-1:0] write_word_q;
  logic [rt_board_pkg::StrobeBits-1:0] write_strobe_q;
  logic [rt_board_pkg::DataBits-1:0] write_data_q;
  logic write_q;
  rt_board_pkg::answer_t b;

  rt_fifo #(
      .Depth (Queue),
      .data_t(burst_t)
  ) u_aw (
      .clk_i,
      .rst_ni,
      .in_valid_i (aw_valid_i),
      .in_ready_o (aw_ready_o),
      .in_data_i  (burst_of(aw_i)),
      .out_valid_o(aw_valid),
      .out_ready_i(aw_take),
      .out_data_o (aw),
      .usage_o    ()
  );
  rt_skid #(
      .data_t(rt_board_pkg::write_t)
  ) u_w (
      .clk_i,
      .rst_ni,
      .in_valid_i (w_valid_i),
      .in_ready_o (w_ready_o),
      .in_data_i  (w_i),
      .out_valid_o(w_valid),
      .out_ready_i(w_take),
      .out_data_o (w)
  );

  // The last beat needs a place for the answer. The burst ends with w.last, whatever its length said: a master that disagrees with itself
  // must not shift the bursts behind it.
  assign write_last = w.last;
  assign w_take     = aw_active_q && (!write_last || b_ready);
  assign write_fire = w_valid && w_take;
  assign aw_load    = !aw_active_q || (write_fire && write_last);
  assign aw_take    = aw_load;
  assign b.id       = aw_q.id;
  assign b.resp     = aw_q.resp;

  always_ff @(posedge clk_i) begin
    if (aw_load) begin
      aw_active_q <= aw_valid;
      aw_q        <= aw;
    end else if (write_fire) begin
      aw_q.word <= next_word(aw_q.word);
      aw_q.len  <= aw_q.len - 1'b1;
    end
    write_q        <= write_fire && aw_q.resp == rt_board_pkg::RespOkay;
    write_word_q   <= aw_q.word;
    write_data_q   <= w.data;
    write_strobe_q <= w.strb;
    if (!rst_ni) begin
      aw_active_q <= 1'b0;
      write_q     <= 1'b0;
    end
  end

  rt_fifo #(
      .Depth (2),
      .data_t(rt_board_pkg::answer_t)
  ) u_b (
      .clk_i,
      .rst_ni,
      .in_valid_i (write_fire && write_last),
      .in_ready_o (b_ready),
      .in_data_i  (b),
      .out_valid_o(b_valid_o),
      .out_ready_i(b_ready_i),
      .out_data_o (b_o),
      .usage_o    ()
  );

  // --- reads ---
  typedef struct packed {
    logic [rt_board_pkg::MuxIdBits-1:0] id;
    logic [1:0]                         resp;
    logic                               last;
  } beat_t;
  logic waiting_valid, waiting_ready, ar_valid, ar_load, ar_active_q, ar_last_q, read_fire, room_q;
  burst_t waiting, ar, ar_q;
  logic [$clog2(ReadPlaces+1)-1:0] ahead_q;  // beats issued and not yet taken
  logic read_1q, read_2q;
  beat_t beat_1q, beat_2q;
  logic [rt_board_pkg::DataBits-1:0] ram_data, data_2q;
  rt_board_pkg::read_t r_in;
  logic r_taken, r_in_ready;

  rt_fifo #(
      .Depth (Queue),
      .data_t(burst_t)
  ) u_ar (
      .clk_i,
      .rst_ni,
      .in_valid_i (ar_valid_i),
      .in_ready_o (ar_ready_o),
      .in_data_i  (burst_of(ar_i)),
      .out_valid_o(waiting_valid),
      .out_ready_i(waiting_ready),
      .out_data_o (waiting),
      .usage_o    ()
  );
  rt_skid #(
      .data_t(burst_t)
  ) u_next (
      .clk_i,
      .rst_ni,
      .in_valid_i (waiting_valid),
      .in_ready_o (waiting_ready),
      .in_data_i  (waiting),
      .out_valid_o(ar_valid),
      .out_ready_i(ar_load),
      .out_data_o (ar)
  );

  assign read_fire = ar_active_q && room_q && !(write_q && write_word_q[NearBits-1:0] == ar_q.word[NearBits-1:0]);
  assign ar_load   = !ar_active_q || (read_fire && ar_last_q);
  assign r_taken   = r_valid_o && r_ready_i;

  always_ff @(posedge clk_i) begin
    if (ar_load) begin
      ar_active_q <= ar_valid;
      ar_q        <= ar;
      ar_last_q   <= ar.len == '0;
    end else if (read_fire) begin
      ar_q.word <= next_word(ar_q.word);
      ar_q.len  <= ar_q.len - 1'b1;
      ar_last_q <= ar_q.len == 8'd1;
    end
    // One more beat may be issued in this clock.
    room_q  <= ahead_q < ($clog2(ReadPlaces + 1))'(ReadPlaces - 1);
    ahead_q <= ahead_q + ($clog2(ReadPlaces + 1))'(read_fire) - ($clog2(ReadPlaces + 1))'(r_taken);
    read_1q <= read_fire;
    beat_1q <= '{id: ar_q.id, resp: ar_q.resp, last: ar_last_q};
    read_2q <= read_1q;
    beat_2q <= beat_1q;
    data_2q <= ram_data;
    if (!rst_ni) begin
      ar_active_q <= 1'b0;
      ahead_q     <= '0;
      room_q      <= 1'b0;
      read_1q     <= 1'b0;
      read_2q     <= 1'b0;
    end
  end

  for (genvar i = 0; i < int'(rt_board_pkg::StrobeBits); i++) begin : gen_byte
    rt_ram_sdp #(
        .Depth (Bytes / rt_board_pkg::StrobeBits),
        .data_t(logic [7:0])
    ) u_ram (
        .clk_i,
        .rst_ni,
        .write_en_i  (write_q && write_strobe_q[i]),
        .write_addr_i(write_word_q),
        .write_data_i(write_data_q[8*i+:8]),
        .read_en_i   (read_fire),
        .read_addr_i (ar_q.word),
        .read_data_o (ram_data[8*i+:8])
    );
  end

  // Nothing of the memory leaves through an error.
  assign r_in = '{id: beat_2q.id, data: beat_2q.resp == rt_board_pkg::RespOkay ? data_2q : '0, resp: beat_2q.resp, last: beat_2q.last};
  rt_fifo #(
      .Depth (ReadPlaces),
      .data_t(rt_board_pkg::read_t)
  ) u_r (
      .clk_i,
      .rst_ni,
      .in_valid_i (read_2q),
      .in_ready_o (r_in_ready),
      .in_data_i  (r_in),
      .out_valid_o(r_valid_o),
      .out_ready_i(r_ready_i),
      .out_data_o (r_o),
      .usage_o    ()
  );

  `RT_ASSERT_STREAM(ReadAddressHeld, ar_valid_i, ar_ready_o, ar_i)
  `RT_ASSERT_STREAM(WriteAddressHeld, aw_valid_i, aw_ready_o, aw_i)
  `RT_ASSERT_STREAM(ReadHeld, r_valid_o, r_ready_i, r_o)
  `RT_ASSERT_STREAM(AnswerHeld, b_valid_o, b_ready_i, b_o)
  `RT_ASSERT(BeatHasAPlace, !read_2q || r_in_ready)
  `RT_ASSERT(LastMatchesLength, !write_fire || write_last == (aw_q.len == '0))
endmodule
