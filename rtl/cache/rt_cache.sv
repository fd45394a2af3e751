// Read-only cache that never makes its user wait: a lookup hits in the next clock, or its waiter is parked and woken later.
//
// Lookup      req_* in clock c, answer in clock c + 1 (rsp_valid_o, rsp_hit_o, rsp_data_o). On a miss the waiter is kept in the bitmap of
//             the miss register (MSHR) that fetches the line, or in the overflow bitmap if there is no register or no way for the line.
// Wake        wake_o has the waiters that shall look up again (one clock, combinational, also for a miss of the same clock);
//             wake_error_o those of them whose line could not be read. Whoever waits in the overflow is woken by any fill; there is one
//             in flight as long as somebody waits there.
// Fill        Beats may come in any order between miss registers; they go into the data RAM at once. The way that is filled is invalid
//             from the miss to the end of the fill. A line with an error stays invalid.
// Structure   Ways x (WordBits / DataBits) RAMs; a word is what one lookup reads. Tags in RAM, valid and LRU bits in registers.
// Misses      Mshrs in flight; a second miss on a line joins the first.
// Latency     Hit 1 clock, one lookup a clock. Miss: the request is offered 2 clocks after the answer.
// Source      Kroft 1981 (miss registers).
`include "rt_assert.svh"
module rt_cache #(
    parameter int unsigned Lines = 256,
    parameter int unsigned Ways = 2,
    parameter int unsigned KeyBits = 21,
    parameter int unsigned DataBits = 64,
    parameter int unsigned WordBits = 128,
    parameter int unsigned WordsPerLine = 4,
    parameter int unsigned Mshrs = 4,
    parameter int unsigned Waiters = 32,
    localparam int unsigned WaiterBits = Waiters > 1 ? $clog2(Waiters) : 1,
    localparam int unsigned SelectBits = WordsPerLine > 1 ? $clog2(WordsPerLine) : 1
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    input  logic                                flush_i,
    input  logic                                req_valid_i,
    input  logic [KeyBits-1:0]                  req_key_i,
    input  logic [SelectBits-1:0]               req_word_i,
    input  logic [WaiterBits-1:0]               req_waiter_i,
    output logic                                rsp_valid_o,
    output logic                                rsp_hit_o,
    output logic [WordBits-1:0]                 rsp_data_o,
    output logic [Waiters-1:0]                  wake_o,
    output logic [Waiters-1:0]                  wake_error_o,
    output logic                                fetch_valid_o,
    input  logic                                fetch_ready_i,
    output logic [KeyBits-1:0]                  fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]  fetch_mshr_o,
    input  logic                                fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0]  fill_mshr_i,
    input  logic [DataBits-1:0]                 fill_data_i,
    input  logic                                fill_last_i,
    input  logic                                fill_error_i
);
  localparam int unsigned Banks = WordBits / DataBits;
  localparam int unsigned FillBeats = Banks * WordsPerLine;
  localparam int unsigned BeatBits = FillBeats > 1 ? $clog2(FillBeats) : 1;
  localparam int unsigned Sets = Lines / Ways;
  localparam int unsigned SetBits = $clog2(Sets);
  localparam int unsigned TagBits = KeyBits - SetBits;
  localparam int unsigned MshrBits = $clog2(Mshrs);
  localparam int unsigned Depth = Sets * WordsPerLine;
  localparam int unsigned AddrBits = $clog2(Depth);

  `RT_ASSERT_INIT(WordIsBeats, WordBits == Banks * DataBits)
  `RT_ASSERT_INIT(WaysKnown, Ways == 1 || Ways == 2)
  `RT_ASSERT_INIT(SetsPowerOfTwo, Sets >= 2 && Sets == (1 << SetBits))
  `RT_ASSERT_INIT(WordsPowerOfTwo, WordsPerLine == 1 || WordsPerLine == (1 << SelectBits))
  `RT_ASSERT_INIT(MshrsFit, Mshrs >= 2 && Mshrs <= (1 << rt_core_pkg::MshrIdBits))

  typedef logic [MshrBits-1:0] mshr_t;

  // Lookup, second clock.
  logic                  look_q;
  logic [KeyBits-1:0]    key_q;
  logic [WaiterBits-1:0] waiter_q;
  logic [SetBits-1:0]    set_q;
  logic [TagBits-1:0]    tag_read[Ways];
  logic [WordBits-1:0]   data_read[Ways];
  logic [Ways-1:0]       way_hit;
  logic                  hit, miss;

  logic [Sets-1:0] valid_q[Ways];
  logic [Sets-1:0] lru_q;  // the way to drop next

  // Miss registers.
  logic [Mshrs-1:0]    active_q, need_q;
  logic [Mshrs-1:0]    error_q;
  logic [KeyBits-1:0]  mshr_key_q [Mshrs];
  logic                mshr_way_q [Mshrs];
  logic [BeatBits-1:0] mshr_beat_q[Mshrs];
  logic [Waiters-1:0]  wait_q     [Mshrs];
  logic [Waiters-1:0]  overflow_q;

  // A fill whose last beat was written in the clock before.
  logic  done_q, done_error_q;
  mshr_t done_mshr_q;

  // --- lookup ---
  for (genvar w = 0; w < int'(Ways); w++) begin : gen_hit
    assign way_hit[w] = valid_q[w][set_q] && tag_read[w] == key_q[KeyBits-1:SetBits];
  end
  assign set_q       = key_q[SetBits-1:0];
  assign hit         = look_q && way_hit != '0;
  assign miss        = look_q && way_hit == '0;
  assign rsp_valid_o = look_q;
  assign rsp_hit_o   = hit;
  if (Ways == 2) begin : gen_two_ways
    assign rsp_data_o = way_hit[Ways-1] ? data_read[Ways-1] : data_read[0];
  end else begin : gen_one_way
    assign rsp_data_o = data_read[0];
  end

  // --- a miss finds its place ---
  logic [Mshrs-1:0] match, same_set;
  logic [Ways-1:0]  way_taken;
  logic             found, allocate, spill, victim, has_free;
  mshr_t            found_mshr, free_mshr;

  always_comb begin
    found_mshr = '0;
    free_mshr  = '0;
    way_taken  = '0;
    for (int unsigned m = 0; m < Mshrs; m++) begin
      match[m]    = active_q[m] && mshr_key_q[m] == key_q;
      same_set[m] = active_q[m] && mshr_key_q[m][SetBits-1:0] == set_q;
      if (match[m]) found_mshr = mshr_t'(m);
      if (!active_q[m]) free_mshr = mshr_t'(m);
      for (int unsigned w = 0; w < Ways; w++) begin
        if (same_set[m] && mshr_way_q[m] == 1'(w)) way_taken[w] = 1'b1;
      end
    end
  end
  assign has_free = active_q != '1;
  assign found    = miss && match != '0;
  if (Ways == 2) begin : gen_victim_two
    assign victim = way_taken[lru_q[set_q]] ? !lru_q[set_q] : lru_q[set_q];
  end else begin : gen_victim_one
    assign victim = 1'b0;
  end
  assign allocate = miss && match == '0 && has_free && way_taken != '1;
  assign spill    = miss && match == '0 && !allocate;

  // --- wake ---
  logic [Waiters-1:0] parked, woken;
  always_comb begin
    parked = '0;
    if ((found && done_q && found_mshr == done_mshr_q) || spill) parked[waiter_q] = 1'b1;
    woken = '0;
    woken[waiter_q] = found && done_q && found_mshr == done_mshr_q;
    woken |= wait_q[done_mshr_q];
    wake_o       = done_q ? (woken | overflow_q | parked) : '0;
    wake_error_o = (done_q && done_error_q) ? woken : '0;
  end

  always_ff @(posedge clk_i) begin
    look_q   <= req_valid_i;
    if (req_valid_i) begin
      key_q    <= req_key_i;
      waiter_q <= req_waiter_i;
    end

    if (hit && Ways == 2) lru_q[set_q] <= !way_hit[Ways-1];
    if (allocate) begin
      active_q[free_mshr]    <= 1'b1;
      need_q[free_mshr]      <= 1'b1;
      error_q[free_mshr]     <= 1'b0;
      mshr_key_q[free_mshr]  <= key_q;
      mshr_way_q[free_mshr]  <= victim;
      mshr_beat_q[free_mshr] <= '0;
      lru_q[set_q]           <= !victim;
      for (int unsigned w = 0; w < Ways; w++) begin
        if (victim == 1'(w)) valid_q[w][set_q] <= 1'b0;
      end
    end
    for (int unsigned m = 0; m < Mshrs; m++) begin
      if (allocate && free_mshr == mshr_t'(m)) wait_q[m] <= Waiters'(1) << waiter_q;
      else if (found && found_mshr == mshr_t'(m)) wait_q[m][waiter_q] <= 1'b1;
    end
    if (done_q) overflow_q <= '0;
    else if (spill) overflow_q[waiter_q] <= 1'b1;

    done_q       <= fill_valid_i && fill_last_i;
    done_mshr_q  <= mshr_t'(fill_mshr_i);
    done_error_q <= fill_error_i || error_q[mshr_t'(fill_mshr_i)];
    if (fill_valid_i) begin
      mshr_beat_q[mshr_t'(fill_mshr_i)] <= mshr_beat_q[mshr_t'(fill_mshr_i)] + 1'b1;
      if (fill_error_i) error_q[mshr_t'(fill_mshr_i)] <= 1'b1;
    end
    if (done_q) begin
      active_q[done_mshr_q] <= 1'b0;
      for (int unsigned w = 0; w < Ways; w++) begin
        if (mshr_way_q[done_mshr_q] == 1'(w)) valid_q[w][mshr_key_q[done_mshr_q][SetBits-1:0]] <= !done_error_q;
      end
    end

    if (fetch_load) need_q[need_mshr] <= 1'b0;
    if (flush_i || !rst_ni) begin
      for (int unsigned w = 0; w < Ways; w++) valid_q[w] <= '0;
      lru_q <= '0;
    end
    if (!rst_ni) begin
      look_q     <= 1'b0;
      active_q   <= '0;
      need_q     <= '0;
      overflow_q <= '0;
      done_q     <= 1'b0;
    end
  end

  // --- request for the line; registered, so that it does not change while it waits ---
  logic               fetch_valid_q, fetch_load;
  logic [KeyBits-1:0] fetch_key_q;
  mshr_t              fetch_mshr_q, need_mshr;
  always_comb begin
    need_mshr = '0;
    for (int unsigned m = 0; m < Mshrs; m++) if (need_q[m]) need_mshr = mshr_t'(m);
  end
  assign fetch_load = need_q != '0 && (!fetch_valid_q || fetch_ready_i);
  always_ff @(posedge clk_i) begin
    if (fetch_load) begin
      fetch_key_q  <= mshr_key_q[need_mshr];
      fetch_mshr_q <= need_mshr;
    end
    if (fetch_load) fetch_valid_q <= 1'b1;
    else if (fetch_ready_i) fetch_valid_q <= 1'b0;
    if (!rst_ni) fetch_valid_q <= 1'b0;
  end
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_key_o   = fetch_key_q;
  assign fetch_mshr_o  = rt_core_pkg::MshrIdBits'(fetch_mshr_q);

  // --- memories ---
  function automatic logic [AddrBits-1:0] word_address(logic [SetBits-1:0] set, logic [SelectBits-1:0] word);
    if (WordsPerLine == 1) return AddrBits'(set);
    return AddrBits'({set, word});
  endfunction

  mshr_t               fill_mshr;
  logic [BeatBits-1:0] fill_beat;
  logic [AddrBits-1:0] fill_addr, read_addr;
  assign fill_mshr = mshr_t'(fill_mshr_i);
  assign fill_beat = mshr_beat_q[fill_mshr];
  assign fill_addr = word_address(mshr_key_q[fill_mshr][SetBits-1:0], SelectBits'(int'(fill_beat) / Banks));
  assign read_addr = word_address(req_key_i[SetBits-1:0], req_word_i);

  for (genvar w = 0; w < int'(Ways); w++) begin : gen_way
    rt_ram_sdp #(
        .Depth  (Sets),
        .Forward(1'b1),
        .data_t (logic [TagBits-1:0])
    ) u_tag (
        .clk_i,
        .rst_ni,
        .write_en_i  (done_q && mshr_way_q[done_mshr_q] == 1'(w)),
        .write_addr_i(mshr_key_q[done_mshr_q][SetBits-1:0]),
        .write_data_i(mshr_key_q[done_mshr_q][KeyBits-1:SetBits]),
        .read_en_i   (req_valid_i),
        .read_addr_i (req_key_i[SetBits-1:0]),
        .read_data_o (tag_read[w])
    );
    for (genvar b = 0; b < int'(Banks); b++) begin : gen_bank
      rt_ram_sdp #(
          .Depth (Depth),
          .data_t(logic [DataBits-1:0])
      ) u_data (
          .clk_i,
          .rst_ni,
          .write_en_i  (fill_valid_i && mshr_way_q[fill_mshr] == 1'(w) && int'(fill_beat) % Banks == b),
          .write_addr_i(fill_addr),
          .write_data_i(fill_data_i),
          .read_en_i   (req_valid_i),
          .read_addr_i (read_addr),
          .read_data_o (data_read[w][b*DataBits+:DataBits])
      );
    end
  end

  `RT_ASSERT(FillIsExpected, !fill_valid_i || active_q[mshr_t'(fill_mshr_i)])
  `RT_ASSERT(FillHasItsLength, !fill_valid_i || fill_last_i == (mshr_beat_q[mshr_t'(fill_mshr_i)] == BeatBits'(FillBeats - 1)))
  `RT_ASSERT(OneWay, !look_q || $onehot0(way_hit))
  `RT_ASSERT(OneMatch, $onehot0(match))
  `RT_ASSERT(OverflowIsServed, overflow_q == '0 || active_q != '0)
  `RT_ASSERT(FlushWhenIdle, !flush_i || active_q == '0)
endmodule
