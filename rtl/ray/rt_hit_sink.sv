// SPDX-License-Identifier: Apache-2.0
// Sink of the AXI shell: combines hits, or pixels, into lines of 64 bytes and writes these, with strobes where some are missing.
//
// Purpose     Items of 4 * 2^words_log2_i bytes, 16 for hits, come in any order and go to base_i + size * tag. Up to Lines lines are kept, in one block RAM, found by a hash of their number. A line leaves when it is
//             full, when another needs its place, or with flush_i. One burst a line, from its first hit to its last, several in flight.
// Flush       flush_i (level): in the clocks without a hit every line leaves; empty_o when all of them have been acknowledged.
// Drop        drop_i (level, soft reset): what has been offered to the bus is completed, everything else is forgotten; in_* is not accepted.
// Grain       Words of the smallest item: what is there of a line is known in grains.
// Places      Each has room for two lines, in turn, so that a hit need not wait until the line that it drives out has been read. One more line waits behind the
//             one that is read. Rays of far more lines than places are in flight, so lines are driven out all the time.
// Rates       One hit in four clocks, one pixel in two; a line leaves in a clock a word beside that. Kept and found by words of 32 bits, so that a block RAM is
//             enough for 16 places.
// Faults      fault_o with the first ray of a line whose answer was an error.
// Words       A word is 32 bits. A beat of the bus is put together from words; it waits in w_* until it is taken, and the reading with it.
`include "rt_assert.svh"
module rt_hit_sink #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned Lines = 32,
    parameter int unsigned Grain = 4
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,        // a multiple of 4 * Grain and of the size of an item
    input  logic [1:0]                       words_log2_i,  // 0 to 2, at least $clog2(Grain); as base_i constant while anything is inside
    input  logic                             flush_i,
    input  logic                             drop_i,
    input  logic                             in_valid_i,
    output logic                             in_ready_o,
    input  rt_core_pkg::tagged_hit_t         in_data_i,
    output logic                             aw_valid_o,
    input  logic                             aw_ready_i,
    output logic [rt_core_pkg::AddrBits-1:0] aw_addr_o,
    output logic [7:0]                       aw_len_o,
    output logic                             w_valid_o,
    input  logic                             w_ready_i,
    output logic [DataBits-1:0]              w_data_o,
    output logic [DataBits/8-1:0]            w_strb_o,
    output logic                             w_last_o,
    input  logic                             b_valid_i,
    output logic                             b_ready_o,
    input  logic                             b_error_i,
    output logic                             idle_o,   // nothing offered or in flight
    output logic                             empty_o,  // and, with flush_i, nothing kept
    output logic                             fault_o,
    output rt_core_pkg::ray_tag_t            fault_tag_o
);
  localparam int unsigned LineWords = 16;
  localparam int unsigned GrainBits = $clog2(Grain);
  localparam int unsigned Slots = LineWords / Grain;  // grains of a line
  localparam int unsigned SlotBits = $clog2(Slots);
  localparam int unsigned WordBits = $clog2(LineWords);
  localparam int unsigned InFlight = 16;
  localparam int unsigned LineBits = $clog2(Lines);
  localparam int unsigned PositionBits = rt_core_pkg::TagBits + 3 - GrainBits;  // a word's, or grain's, from base_i rounded down to 64
  localparam int unsigned NumberBits = PositionBits - SlotBits;
  localparam int unsigned BeatWords = DataBits / 32;
  localparam int unsigned BeatWordBits = $clog2(BeatWords);
  `RT_ASSERT_INIT(LinesKnown, Lines >= 2 && Lines <= 32 && Lines == (1 << LineBits))
  `RT_ASSERT_INIT(DataBitsKnown, DataBits == 64 || DataBits == 128)
  `RT_ASSERT_INIT(GrainKnown, Grain == 1 || Grain == 4)
  typedef logic [LineBits-1:0] line_t;
  typedef logic [SlotBits-1:0] slot_t;
  typedef logic [Slots-1:0] slots_t;
  typedef logic [NumberBits-1:0] number_t;  // of a line, from base_i rounded down to 64
  typedef struct packed {
    logic    half;   // of its place
    number_t number;
    slots_t  slots;  // grains that are there
  } entry_t;
  // Rows of an image lie a multiple of a power of two apart: all bits take part.
  function automatic line_t place_of(number_t number);
    place_of = '0;
    for (int unsigned b = 0; b < NumberBits; b += LineBits) place_of ^= line_t'(number >> b);
  endfunction

  // --- who is kept where ---
  typedef enum logic [1:0] {
    Clear,  // every place, one a clock
    Wait,   // for a hit, or places to flush
    Look,   // first word, if its place is its line's
    Store   // the other words
  } state_e;
  state_e        state_q;
  line_t         place_q;  // of the hit; while clearing or flushing, the place that is looked at
  logic          flushed_q;
  logic [1:0]    word_q;
  number_t       number_q;
  slot_t         slot_q;
  slots_t        slots_q;  // of its line, with it
  logic [127:0]  data_q;
  entry_t        entry, entry_write;
  logic          entry_write_en, take, write_word, last_word;
  logic [PositionBits-1:0] position;
  logic [1:0]    last_index;
  logic [1:0]    scale;  // grains of an item, as a logarithm
  slots_t        grains;
  number_t       number;
  logic          leave, leave_open, free_place, same_line, half, half_q;
  entry_t        leaving;
  if (Grain == 4) begin : gen_hits
    assign scale  = '0;
    assign grains = slots_t'(1);
  end else begin : gen_items
    assign scale  = words_log2_i;
    assign grains = words_log2_i == 2'd0 ? slots_t'(1) : words_log2_i == 2'd1 ? slots_t'(3) : slots_t'(15);
  end
  assign position   = (PositionBits'(in_data_i.tag) << scale) + PositionBits'(base_i[5:2+GrainBits]);
  assign number     = position[PositionBits-1:SlotBits];
  // The second word is written in Store, if there is one.
  assign last_index = words_log2_i[1] ? 2'd3 : 2'd1;
  assign last_word  = state_q == Store && word_q == last_index;
  assign in_ready_o = (state_q == Wait || last_word) && !drop_i;
  assign take       = in_valid_i && in_ready_o;

  rt_ram_lut #(
      .Depth (Lines),
      .data_t(entry_t)
  ) u_entries (
      .clk_i,
      .rst_ni,
      .write_en_i  (entry_write_en),
      .write_addr_i(place_q),
      .write_data_i(entry_write),
      .read_addr_i (place_q),
      .read_data_o (entry)
  );

  // A line that leaves: the one that is full, the one that stands where the hit has to go, or the one that a flush has come to. It waits in leaving_q until the
  // one before has been read. The other half of its place has to be free for the next line.
  logic   out_reading_q, leaving_valid_q;
  line_t  out_place_q, leaving_place_q;
  entry_t leaving_q;
  assign leave_open = !leaving_valid_q && !drop_i && !(out_reading_q && out_place_q == place_q);
  assign free_place = entry.slots == '0;
  assign same_line  = entry.number == number_q;
  assign half       = state_q == Look ? entry.half : half_q;
  always_comb begin
    leave          = 1'b0;
    leaving        = entry;
    write_word     = 1'b0;
    entry_write_en = 1'b0;
    entry_write    = '{half: half, number: number_q, slots: '0};
    case (state_q)
      Clear: entry_write_en = 1'b1;
      Wait: begin
        entry_write.half = !entry.half;
        leave            = flush_i && !flushed_q && !in_valid_i && !free_place && leave_open;
        entry_write_en   = leave;
      end
      Look: begin
        write_word       = free_place || same_line;
        leave            = !write_word && leave_open;
        entry_write_en   = leave;
        entry_write.half = !entry.half;
      end
      default: begin
        write_word     = words_log2_i != '0;
        leaving        = '{half: half_q, number: number_q, slots: slots_q};
        leave          = last_word && slots_q == '1 && leave_open;
        entry_write_en = last_word;
        if (leave) entry_write.half = !half_q;
        else entry_write.slots = slots_q;
      end
    endcase
  end
  always_ff @(posedge clk_i) begin
    if (write_word || state_q == Store) begin
      word_q <= word_q + 1'b1;
      data_q <= data_q >> 32;
    end
    case (state_q)
      Clear: begin
        place_q <= place_q + 1'b1;
        if (place_q == '1 && !drop_i) state_q <= Wait;
      end
      Wait: begin
        flushed_q <= flush_i && (flushed_q || (!in_valid_i && place_q == '1 && (free_place || leave)));
        if (flush_i && !flushed_q && !in_valid_i && (free_place || leave)) place_q <= place_q + 1'b1;
        if (!flush_i) place_q <= '0;
      end
      Look: begin
        half_q  <= entry.half;
        slots_q <= (free_place ? '0 : entry.slots) | (grains << slot_q);
        if (write_word) state_q <= Store;
      end
      default: if (last_word) state_q <= Wait;
    endcase
    if (state_q == Store && last_word) place_q <= '0;
    if (take) begin
      state_q   <= Look;
      word_q    <= '0;
      place_q   <= place_of(number);
      number_q  <= number;
      slot_q    <= position[SlotBits-1:0];
      data_q    <= in_data_i.hit;
      flushed_q <= 1'b0;
    end
    if (drop_i && state_q != Clear) begin
      state_q <= Clear;
      place_q <= '0;
    end
    if (!rst_ni) begin
      state_q   <= Clear;
      place_q   <= '0;
      flushed_q <= 1'b0;
    end
  end

  // --- words ---
  localparam int unsigned AddressBits = LineBits + 1 + WordBits;
  logic                   out_step, read_word, order_ready, order_valid, start, out_half_q;
  logic [WordBits-1:0]    out_word_q, write_at;  // of the line
  logic [31:0]            word_read;
  assign write_at = (WordBits'(slot_q) << GrainBits) | WordBits'(word_q);
  rt_ram_sdp #(
      .Depth (2 * Lines * LineWords),
      .data_t(logic [31:0])
  ) u_words (
      .clk_i,
      .rst_ni,
      .write_en_i  (write_word),
      .write_addr_i(AddressBits'({place_q, half, write_at})),
      .write_data_i(data_q[31:0]),
      .read_en_i   (read_word),
      .read_addr_i (AddressBits'({out_place_q, out_half_q, out_word_q})),
      .read_data_o (word_read)
  );

  // --- a line on its way out ---
  logic                             aw_valid_q, read_q, w_valid_q, w_last_q;
  logic [rt_core_pkg::AddrBits-1:0] aw_addr_q;
  logic [7:0]                       aw_len_q;
  slots_t                           out_slots_q, read_slots_q;
  logic [WordBits-1:0]              out_last_q, read_word_q, first_word, last_word_out;  // whole beats
  logic                             read_last_q, beat_ends;
  logic [DataBits-1:0]              w_data_q;
  logic [DataBits/8-1:0]            w_strb_q;
  logic [BeatWords-1:0][31:0]       collect_q;
  slot_t                            first, last;
  always_comb begin
    first = '0;
    last  = '0;
    for (int unsigned s = 0; s < Slots; s++) begin
      if (leaving_q.slots[s]) last = slot_t'(s);
      if (leaving_q.slots[Slots-1-s]) first = slot_t'(Slots - 1 - s);
    end
  end
  // A slot of a whole beat at least begins and ends one.
  assign first_word    = (WordBits'(first) << GrainBits) & ~WordBits'(BeatWords - 1);
  assign last_word_out = (WordBits'(last) << GrainBits) | WordBits'((Grain > BeatWords ? Grain : BeatWords) - 1);
  assign start = leaving_valid_q && !out_reading_q && !aw_valid_q && order_ready && !drop_i;
  // A read word goes on unless it completes a beat and the one before has not been taken.
  assign beat_ends = read_q && read_word_q[BeatWordBits-1:0] == '1;
  assign out_step  = !(beat_ends && w_valid_q && !w_ready_i);
  assign read_word = out_reading_q && out_step;
  always_ff @(posedge clk_i) begin
    leaving_valid_q <= (leave || (leaving_valid_q && !start)) && !drop_i && rst_ni;
    if (leave) begin
      leaving_q       <= leaving;
      leaving_place_q <= place_q;
    end
    if (start) begin
      out_reading_q <= 1'b1;
      out_place_q   <= leaving_place_q;
      out_half_q    <= leaving_q.half;
      out_word_q    <= first_word;
      out_last_q    <= last_word_out;
      out_slots_q   <= leaving_q.slots;
      aw_valid_q    <= 1'b1;
      aw_addr_q     <= {base_i[rt_core_pkg::AddrBits-1:6], 6'b0} + rt_core_pkg::AddrBits'({leaving_q.number, first_word, 2'b0});
      aw_len_q      <= (8'(last_word_out) - 8'(first_word)) >> BeatWordBits;
    end else begin
      if (read_word) begin
        out_word_q <= out_word_q + 1'b1;
        if (out_word_q == out_last_q) out_reading_q <= 1'b0;
      end
      if (aw_ready_i) aw_valid_q <= 1'b0;
    end
    if (out_step) begin
      read_q       <= read_word;
      read_word_q  <= out_word_q;
      read_last_q  <= out_word_q == out_last_q;
      read_slots_q <= out_slots_q;
      if (read_q) collect_q <= {word_read, collect_q[BeatWords-1:1]};
    end
    if (w_ready_i) w_valid_q <= 1'b0;
    if (beat_ends && out_step) begin
      w_valid_q <= 1'b1;
      w_data_q  <= {word_read, collect_q[BeatWords-1:1]};
      for (int unsigned w = 0; w < BeatWords; w++) begin
        w_strb_q[4*w+:4] <= {4{read_slots_q[SlotBits'((read_word_q - WordBits'(BeatWords - 1 - w)) >> GrainBits)]}};
      end
      w_last_q  <= read_last_q;
    end
    if (!rst_ni) begin
      out_reading_q <= 1'b0;
      read_q        <= 1'b0;
      aw_valid_q    <= 1'b0;
      w_valid_q     <= 1'b0;
    end
  end
  assign aw_valid_o = aw_valid_q;
  assign aw_addr_o  = aw_addr_q;
  assign aw_len_o   = aw_len_q;
  assign w_valid_o  = w_valid_q;
  assign w_data_o   = w_data_q;
  assign w_strb_o   = w_strb_q;
  assign w_last_o   = w_last_q;

  // All bursts have one id, so answers come in order; for each, the first ray of its line.
  logic [$clog2(InFlight+1)-1:0] usage_unused;
  rt_fifo #(
      .Depth (InFlight),
      .data_t(rt_core_pkg::ray_tag_t)
  ) u_order (
      .clk_i,
      .rst_ni,
      .in_valid_i (start),
      .in_ready_o (order_ready),
      .in_data_i  (rt_core_pkg::ray_tag_t'(({leaving_q.number, first} - PositionBits'(base_i[5:2+GrainBits])) >> scale)),
      .out_valid_o(order_valid),
      .out_ready_i(b_valid_i),
      .out_data_o (fault_tag_o),
      .usage_o    (usage_unused)
  );
  assign b_ready_o = 1'b1;
  assign fault_o   = b_valid_i && b_error_i;
  assign idle_o    = !order_valid;
  assign empty_o   = flushed_q && !order_valid && !leaving_valid_q;

  `RT_ASSERT(AnswerIsExpected, !b_valid_i || order_valid)
  `RT_ASSERT(HalvesAreTwoLines, !write_word || !(out_reading_q && out_place_q == place_q && out_half_q == half))
  `RT_ASSERT(NoHitIsThereTwice, state_q != Look || !write_word || free_place || !entry.slots[slot_q])
  `RT_ASSERT_STREAM(Address, aw_valid_o, aw_ready_i, aw_addr_o)
  `RT_ASSERT_STREAM(Data, w_valid_o, w_ready_i, w_data_o)
endmodule
