// SPDX-License-Identifier: Apache-2.0
// Write bursts on the native write port of a DRAM controller (LiteDRAM): beats of a word become one write.
//
// Combining   The beats of a burst that fall into one word are one command; a word of which no byte is written is none. With words narrower than a beat
//             each beat is as many commands.
// Native      The controller takes the data of a command when it likes, but cannot wait for them: they are in their queue before the command is offered.
// Answers     When the last command of a burst has been accepted: from then on any read of any port comes behind it. Bursts that are refused (resp) are
//             swallowed and answered.
// hold_i      As in rt_dram_read_port.
// Order       Bursts in the order of their addresses. A burst ends with w.last, whatever its length said, and stays within its 4 KB.
// Latency     2 clocks from the last beat of a word to its command. Throughput 1 beat a clock (a word a clock where words are narrower).
`include "rt_assert.svh"
module rt_dram_writes #(
    parameter int unsigned WordBits = 128,
    parameter int unsigned WordAddrBits = 25,
    parameter int unsigned Queue = 16,
    localparam int unsigned IdBits = rt_board_pkg::MuxIdBits,
    localparam int unsigned BeatAddrBits = WordAddrBits + $clog2(WordBits) - $clog2(rt_board_pkg::DataBits)
) (
    input  logic                    clk_i,
    input  logic                    rst_ni,
    // Bursts and their beats.
    input  logic                    aw_valid_i,
    output logic                    aw_ready_o,
    input  logic [      IdBits-1:0] aw_id_i,
    input  logic [BeatAddrBits-1:0] aw_beat_i,
    input  logic [             1:0] aw_resp_i,
    input  logic                    w_valid_i,
    output logic                    w_ready_o,
    input  rt_board_pkg::write_t    w_i,
    output logic                    b_valid_o,
    input  logic                    b_ready_i,
    output rt_board_pkg::answer_t   b_o,
    // Native port.
    input  logic                    hold_i,
    output logic                    cmd_valid_o,
    input  logic                    cmd_ready_i,
    output logic [WordAddrBits-1:0] cmd_addr_o,
    output logic                    word_valid_o,
    input  logic                    word_ready_i,
    output logic [    WordBits-1:0] word_o,
    output logic [  WordBits/8-1:0] strobe_o
);
  localparam int unsigned DataBits = rt_board_pkg::DataBits;
  localparam int unsigned BeatsPerWord = WordBits > DataBits ? WordBits / DataBits : 1;
  localparam int unsigned WordsPerBeat = WordBits < DataBits ? DataBits / WordBits : 1;
  localparam int unsigned LaneBits = BeatsPerWord > 1 ? $clog2(BeatsPerWord) : 1;
  localparam int unsigned PartBits = WordsPerBeat > 1 ? $clog2(WordsPerBeat) : 1;
  localparam int unsigned PageBeatBits = 12 - $clog2(DataBits / 8);

  `RT_ASSERT_INIT(WordKnown, WordBits == 32 || WordBits == 64 || WordBits == 128)

  typedef struct packed {
    logic [WordBits-1:0]   data;
    logic [WordBits/8-1:0] strobe;
  } word_t;
  typedef struct packed {
    logic                    none;  // nothing to write
    logic                    last;  // of its burst
    logic [1:0]              resp;
    logic [IdBits-1:0]       id;
    logic [WordAddrBits-1:0] addr;
  } command_t;

  // --- beats into words ---
  // While no burst is under way the next one's beats come at its address, afterwards one by one.
  logic started_q, beat_take, word_done;
  logic [BeatAddrBits-1:0] beat, beat_q;
  logic command_in_ready, word_in_ready, push, has_bytes, part_last;
  command_t command_in, command;
  word_t word_in, word;
  assign beat = started_q ? beat_q : aw_beat_i;

  if (BeatsPerWord > 1) begin : gen_combine
    word_t gathered_q;
    logic [LaneBits-1:0] lane;
    assign lane = beat[LaneBits-1:0];
    always_comb begin
      word_in = gathered_q;
      for (int unsigned i = 0; i < BeatsPerWord; i++) begin
        if (lane == LaneBits'(i)) begin
          word_in.data[DataBits*i+:DataBits]         = w_i.data;
          word_in.strobe[DataBits/8*i+:DataBits/8]   = w_i.strb;
        end
      end
    end
    assign part_last = 1'b1;
    assign word_done = w_i.last || lane == '1;
    assign command_in.addr = beat[BeatAddrBits-1:LaneBits];
    always_ff @(posedge clk_i) begin
      if (beat_take) begin
        gathered_q.data   <= word_in.data;
        gathered_q.strobe <= word_done ? '0 : word_in.strobe;
      end
      if (!rst_ni) gathered_q.strobe <= '0;
    end
  end else if (WordsPerBeat > 1) begin : gen_split
    logic [PartBits-1:0] part_q;
    logic [WordsPerBeat-1:0][WordBits-1:0] parts;
    logic [WordsPerBeat-1:0][WordBits/8-1:0] part_strobes;
    assign parts           = w_i.data;
    assign part_strobes    = w_i.strb;
    assign word_in.data    = parts[part_q];
    assign word_in.strobe  = part_strobes[part_q];
    assign part_last       = part_q == '1;
    assign word_done       = 1'b1;
    assign command_in.addr = {beat, part_q};
    always_ff @(posedge clk_i) begin
      if (push) part_q <= part_q + 1'b1;
      if (!rst_ni) part_q <= '0;
    end
  end else begin : gen_equal
    assign word_in         = '{data: w_i.data, strobe: w_i.strb};
    assign part_last       = 1'b1;
    assign word_done       = 1'b1;
    assign command_in.addr = beat;
  end

  assign has_bytes       = word_in.strobe != '0 && aw_resp_i == rt_board_pkg::RespOkay;
  assign command_in.none = !has_bytes;
  assign command_in.last = w_i.last && part_last;
  assign command_in.resp = aw_resp_i;
  assign command_in.id   = aw_id_i;
  // Places are registers, so a beat waits for what was there before this clock.
  assign push            = aw_valid_i && w_valid_i && word_done && command_in_ready && word_in_ready;
  assign beat_take       = aw_valid_i && w_valid_i && (word_done ? push && part_last : 1'b1);
  assign w_ready_o       = beat_take;
  assign aw_ready_o      = beat_take && w_i.last;
  always_ff @(posedge clk_i) begin
    if (beat_take) begin
      started_q                <= !w_i.last;
      beat_q                   <= beat;
      beat_q[PageBeatBits-1:0] <= beat[PageBeatBits-1:0] + 1'b1;
    end
    if (!rst_ni) started_q <= 1'b0;
  end

  // --- commands and their data ---
  logic command_valid, command_take, offered_q, b_ready, go;
  rt_fifo #(
      .Depth (Queue),
      .data_t(command_t)
  ) u_commands (
      .clk_i,
      .rst_ni,
      .in_valid_i (push),
      .in_ready_o (command_in_ready),
      .in_data_i  (command_in),
      .out_valid_o(command_valid),
      .out_ready_i(command_take),
      .out_data_o (command),
      .usage_o    ()
  );
  rt_fifo #(
      .Depth (Queue),
      .data_t(word_t)
  ) u_words (
      .clk_i,
      .rst_ni,
      .in_valid_i (push && has_bytes),
      .in_ready_o (word_in_ready),
      .in_data_i  (word_in),
      .out_valid_o(word_valid_o),
      .out_ready_i(word_ready_i),
      .out_data_o (word),
      .usage_o    ()
  );
  assign word_o       = word.data;
  assign strobe_o     = word.strobe;
  // Answers have a place before the command is offered.
  assign go           = command_valid && b_ready && (offered_q || !hold_i);
  assign cmd_valid_o  = go && !command.none;
  assign cmd_addr_o   = command.addr;
  assign command_take = go && (command.none || cmd_ready_i);
  always_ff @(posedge clk_i) begin
    offered_q <= cmd_valid_o && !cmd_ready_i;
    if (!rst_ni) offered_q <= 1'b0;
  end

  rt_fifo #(
      .Depth (4),
      .data_t(rt_board_pkg::answer_t)
  ) u_answers (
      .clk_i,
      .rst_ni,
      .in_valid_i (command_take && command.last),
      .in_ready_o (b_ready),
      .in_data_i  ('{id: command.id, resp: command.resp}),
      .out_valid_o(b_valid_o),
      .out_ready_i(b_ready_i),
      .out_data_o (b_o),
      .usage_o    ()
  );

  `RT_ASSERT_STREAM(CommandHeld, cmd_valid_o, cmd_ready_i, cmd_addr_o)
  `RT_ASSERT(DataAreThere, !word_ready_i || word_valid_o)
endmodule
