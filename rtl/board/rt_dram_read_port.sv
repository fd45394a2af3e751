// SPDX-License-Identifier: Apache-2.0
// One native read port of a DRAM controller (LiteDRAM): read bursts become commands a word each, and words become beats again.
//
// Native      A command is a word address; the controller answers the commands of a port in order, any number of clocks later, and its answer
//             cannot be held. So a command is offered only when its word has a place (Places).
// Words       WordBits of 32, 64 or 128 against beats of 64: a word holds two beats, or a beat takes two words.
// hold_i      No new command is offered; one that was offered stays until it is accepted.
// more_o      Beside a beat: the next beat of the same burst is there as well, so the reads of other ports do not have to come in between.
// Latency     1 clock from the request to its first command, 1 from the last word of a beat to the beat.
// Throughput  A command a clock, a beat a clock. Bursts waits: Queue whose commands are not out, Bursts that are not answered.
`include "rt_assert.svh"
module rt_dram_read_port #(
    parameter int unsigned WordBits = 128,
    parameter int unsigned WordAddrBits = 25,
    parameter int unsigned Places = 16,
    parameter int unsigned Queue = 4,
    parameter int unsigned Bursts = 16,
    localparam int unsigned IdBits = rt_board_pkg::MuxIdBits,
    localparam int unsigned BeatAddrBits = WordAddrBits + $clog2(WordBits) - $clog2(rt_board_pkg::DataBits)
) (
    input  logic                    clk_i,
    input  logic                    rst_ni,
    // Bursts: the first beat, as its number in the memory, and beats - 1.
    input  logic                    in_valid_i,
    output logic                    in_ready_o,
    input  logic [      IdBits-1:0] in_id_i,
    input  logic [BeatAddrBits-1:0] in_beat_i,
    input  logic [             7:0] in_len_i,
    // Native port.
    input  logic                    hold_i,
    output logic                    cmd_valid_o,
    input  logic                    cmd_ready_i,
    output logic [WordAddrBits-1:0] cmd_addr_o,
    input  logic                    word_valid_i,
    input  logic [    WordBits-1:0] word_i,
    // Beats.
    output logic                    out_valid_o,
    input  logic                    out_ready_i,
    output rt_board_pkg::read_t     out_data_o,
    output logic                    more_o
);
  localparam int unsigned DataBits = rt_board_pkg::DataBits;
  localparam int unsigned BeatsPerWord = WordBits > DataBits ? WordBits / DataBits : 1;
  localparam int unsigned WordsPerBeat = WordBits < DataBits ? DataBits / WordBits : 1;
  localparam int unsigned LaneBits = BeatsPerWord > 1 ? $clog2(BeatsPerWord) : 1;
  localparam int unsigned HeldBits = $clog2(Places + 1);
  // A burst stays within 4 KB, so only these bits of a word's address change.
  localparam int unsigned StepBits = 12 - $clog2(WordBits / 8);

  `RT_ASSERT_INIT(WordKnown, WordBits == 32 || WordBits == 64 || WordBits == 128)
  `RT_ASSERT_INIT(BeatHasPlaces, Places >= WordsPerBeat && Places >= 2)

  // --- commands ---
  typedef struct packed {
    logic [WordAddrBits-1:0] first;
    logic [StepBits-1:0]     last;   // words - 1
  } words_t;
  typedef struct packed {
    logic [IdBits-1:0]   id;
    logic [LaneBits-1:0] lane;
    logic [7:0]          len;
  } burst_t;
  words_t words_in, words;
  burst_t burst_in, burst;
  logic words_in_ready, words_valid, burst_in_ready, burst_valid, burst_pop, cmd_take, words_done, offered_q;
  logic [StepBits-1:0] step_q;
  logic [HeldBits-1:0] held_q;  // words commanded and not yet given away
  logic word_pop;

  if (BeatsPerWord > 1) begin : gen_wide
    assign words_in.first = in_beat_i[BeatAddrBits-1:LaneBits];
    assign words_in.last  = StepBits'(({1'b0, in_len_i} + 9'(in_beat_i[LaneBits-1:0])) >> LaneBits);
    assign burst_in.lane  = in_beat_i[LaneBits-1:0];
  end else if (WordsPerBeat > 1) begin : gen_narrow
    assign words_in.first = {in_beat_i, {$clog2(WordsPerBeat) {1'b0}}};
    assign words_in.last  = StepBits'({in_len_i, {$clog2(WordsPerBeat) {1'b1}}});
    assign burst_in.lane  = '0;
  end else begin : gen_equal
    assign words_in.first = in_beat_i;
    assign words_in.last  = StepBits'(in_len_i);
    assign burst_in.lane  = '0;
  end
  assign burst_in.id  = in_id_i;
  assign burst_in.len = in_len_i;
  assign in_ready_o   = words_in_ready && burst_in_ready;

  rt_fifo #(
      .Depth (Queue),
      .data_t(words_t)
  ) u_words (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i && burst_in_ready),
      .in_ready_o (words_in_ready),
      .in_data_i  (words_in),
      .out_valid_o(words_valid),
      .out_ready_i(words_done),
      .out_data_o (words),
      .usage_o    ()
  );
  assign cmd_valid_o = words_valid && held_q != HeldBits'(Places) && (offered_q || !hold_i);
  assign cmd_take    = cmd_valid_o && cmd_ready_i;
  assign words_done  = cmd_take && step_q == words.last;
  assign cmd_addr_o  = {words.first[WordAddrBits-1:StepBits], words.first[StepBits-1:0] + step_q};

  always_ff @(posedge clk_i) begin
    offered_q <= cmd_valid_o && !cmd_ready_i;
    held_q    <= held_q + HeldBits'(cmd_take) - (word_pop ? HeldBits'(WordsPerBeat) : '0);
    if (cmd_take) step_q <= words_done ? '0 : step_q + 1'b1;
    if (!rst_ni) begin
      offered_q <= 1'b0;
      held_q    <= '0;
      step_q    <= '0;
    end
  end

  // --- answers: kept as whole beats, so that they leave as fast as the bus takes them ---
  localparam int unsigned KeptBits = BeatsPerWord * DataBits;
  localparam int unsigned Kept = Places / WordsPerBeat;
  localparam int unsigned UsageBits = $clog2(Kept + 1);
  logic kept_in_valid, kept_in_ready, kept_valid;
  logic [KeptBits-1:0] kept_in, kept;
  logic [UsageBits-1:0] usage;
  if (WordsPerBeat > 1) begin : gen_gather
    localparam int unsigned PartBits = $clog2(WordsPerBeat);
    logic [PartBits-1:0] part_q;
    logic [WordsPerBeat-1:0][WordBits-1:0] parts, parts_q;
    always_comb begin
      parts         = parts_q;
      parts[part_q] = word_i;
    end
    always_ff @(posedge clk_i) begin
      if (word_valid_i) begin
        parts_q <= parts;
        part_q  <= part_q + 1'b1;
      end
      if (!rst_ni) part_q <= '0;
    end
    assign kept_in_valid = word_valid_i && part_q == '1;
    assign kept_in       = parts;
  end else begin : gen_words
    assign kept_in_valid = word_valid_i;
    assign kept_in       = word_i;
  end
  rt_fifo #(
      .Depth (Kept),
      .data_t(logic [KeptBits-1:0])
  ) u_kept (
      .clk_i,
      .rst_ni,
      .in_valid_i (kept_in_valid),
      .in_ready_o (kept_in_ready),
      .in_data_i  (kept_in),
      .out_valid_o(kept_valid),
      .out_ready_i(word_pop),
      .out_data_o (kept),
      .usage_o    (usage)
  );

  // --- beats ---
  rt_fifo #(
      .Depth (Bursts),
      .data_t(burst_t)
  ) u_bursts (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i && words_in_ready),
      .in_ready_o (burst_in_ready),
      .in_data_i  (burst_in),
      .out_valid_o(burst_valid),
      .out_ready_i(burst_pop),
      .out_data_o (burst),
      .usage_o    ()
  );
  logic started_q, out_take, lane_last;
  logic [7:0] beat_q;
  logic [LaneBits-1:0] lane, lane_q;
  logic [BeatsPerWord-1:0][DataBits-1:0] lanes;
  assign lanes       = kept;
  assign lane        = started_q ? lane_q : burst.lane;
  assign lane_last   = BeatsPerWord == 1 || lane == LaneBits'(BeatsPerWord - 1);
  assign out_valid_o = kept_valid;
  assign out_take    = out_valid_o && out_ready_i;
  assign out_data_o  = '{
          id: burst.id,
          data: lanes[lane],
          resp: rt_board_pkg::RespOkay,
          last: beat_q == burst.len
      };
  assign more_o      = !out_data_o.last && (!lane_last || usage > UsageBits'(1));
  assign word_pop    = out_take && (lane_last || out_data_o.last);
  assign burst_pop   = out_take && out_data_o.last;

  always_ff @(posedge clk_i) begin
    if (out_take) begin
      started_q <= !out_data_o.last;
      beat_q    <= out_data_o.last ? '0 : beat_q + 1'b1;
      lane_q    <= BeatsPerWord == 1 ? '0 : lane + 1'b1;
    end
    if (!rst_ni) begin
      started_q <= 1'b0;
      beat_q    <= '0;
      lane_q    <= '0;
    end
  end

  `RT_ASSERT_STREAM(CommandHeld, cmd_valid_o, cmd_ready_i, cmd_addr_o)
  `RT_ASSERT(WordHasAPlace, !kept_in_valid || kept_in_ready)
  `RT_ASSERT(WordWasAskedFor, !word_valid_i || held_q != '0)
  `RT_ASSERT(WordHasABurst, !kept_valid || burst_valid)
  `RT_ASSERT(BurstWithinPage, !in_valid_i || {1'b0, words_in.first[StepBits-1:0]} + {1'b0, words_in.last} < (StepBits + 1)'(1 << StepBits))
endmodule
