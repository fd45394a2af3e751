// Read-only cache that never makes its users wait: a lookup hits in the next clock, or its waiter is parked and woken later.
//
// Lookup      On each of Ports ports: req_* in clock c, answer in clock c + 1 (rsp_valid_o, rsp_hit_o, rsp_data_o). On a miss the waiter is
//             kept in the bitmap of the miss register (MSHR) that fetches the line, or in the overflow bitmap if there is no register or
//             no way for the line.
// Wake        wake_o has the waiters that shall look up again (one clock, combinational, also for a miss of the same clock);
//             wake_error_o those of them whose line could not be read. Whoever waits in the overflow is woken by any fill; there is one
//             in flight as long as somebody waits there.
// Progress    A line that was filled is kept until it has been hit once (fresh), so that those who asked for it get it before the next
//             one takes its way; a miss that finds only such ways tries again. As its waiter may have gone (an any-hit ray that is done),
//             freshness ends after at most 2^LeaseBits clocks.
// Fill        Beats may come in any order between miss registers; they go into the data RAM at once. The way that is filled is invalid
//             from the miss to the end of the fill. A line with an error stays invalid.
// Structure   Ports x Ways x (WordBits / DataBits) RAMs with the same contents for each port; a word is what one lookup reads. Tags in
//             RAM, valid, fresh and LRU bits in registers.
// Misses      Mshrs in flight; a second miss on a line joins the first. One new miss a clock; a second one tries again.
// Latency     Hit 1 clock, one lookup a clock and port. Miss: the request is offered 2 clocks after the answer.
// Source      Kroft 1981 (miss registers).
`include "rt_assert.svh"
module rt_cache #(
    parameter int unsigned Ports = 1,
    parameter int unsigned Lines = 256,
    parameter int unsigned Ways = 2,
    parameter int unsigned KeyBits = 21,
    parameter int unsigned DataBits = 64,
    parameter int unsigned WordBits = 128,
    parameter int unsigned WordsPerLine = 4,
    parameter int unsigned Mshrs = 4,
    parameter int unsigned Waiters = 32,
    parameter int unsigned LeaseBits = 9,
    localparam int unsigned WaiterBits = Waiters > 1 ? $clog2(Waiters) : 1,
    localparam int unsigned SelectBits = WordsPerLine > 1 ? $clog2(WordsPerLine) : 1
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    input  logic                                flush_i,
    input  logic [Ports-1:0]                    req_valid_i,
    input  logic [Ports-1:0][KeyBits-1:0]       req_key_i,
    input  logic [Ports-1:0][SelectBits-1:0]    req_word_i,
    input  logic [Ports-1:0][WaiterBits-1:0]    req_waiter_i,
    output logic [Ports-1:0]                    rsp_valid_o,
    output logic [Ports-1:0]                    rsp_hit_o,
    output logic [Ports-1:0][WordBits-1:0]      rsp_data_o,
    output logic [Waiters-1:0]                  wake_o,
    output logic [Waiters-1:0]                  wake_error_o,
    output logic                                fetch_valid_o,
    input  logic                                fetch_ready_i,
    output logic [KeyBits-1:0]                  fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]  fetch_mshr_o,
    output logic                                miss_o,  // a line is going to be fetched
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
  typedef logic [SetBits-1:0] set_t;
  typedef logic [KeyBits-1:0] key_t;

  // Lookup, second clock.
  logic [Ports-1:0]                 look_q, hit, miss;
  key_t [Ports-1:0]                 key_q;
  logic [Ports-1:0][WaiterBits-1:0] waiter_q;
  set_t [Ports-1:0]                 set_q;
  logic [TagBits-1:0]               tag_read [Ports][Ways];
  logic [WordBits-1:0]              data_read[Ports][Ways];
  logic [Ports-1:0][Ways-1:0]       way_hit;

  logic [Sets-1:0]      valid_q[Ways];
  logic [Sets-1:0]      fresh_q[Ways];  // filled and not hit since
  logic [Sets-1:0]      lru_q;          // the way to drop next
  logic [LeaseBits-1:0] lease_q;

  // Miss registers.
  logic [Mshrs-1:0]    active_q, need_q, error_q;
  key_t                mshr_key_q [Mshrs];
  logic                mshr_way_q [Mshrs];
  logic [BeatBits-1:0] mshr_beat_q[Mshrs];
  logic [Waiters-1:0]  wait_q     [Mshrs];
  logic [Waiters-1:0]  overflow_q, again_q;

  // A fill whose last beat was written in the clock before.
  logic  done_q, done_error_q;
  mshr_t done_mshr_q;

  mshr_t               fill_mshr;
  logic [BeatBits-1:0] fill_beat;
  assign fill_mshr = mshr_t'(fill_mshr_i);
  assign fill_beat = mshr_beat_q[fill_mshr];

  logic  fetch_valid_q, fetch_load;
  key_t  fetch_key_q;
  mshr_t fetch_mshr_q, need_mshr;

  // --- lookup ---
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_lookup
    assign set_q[p] = key_q[p][SetBits-1:0];
    for (genvar w = 0; w < int'(Ways); w++) begin : gen_hit
      assign way_hit[p][w] = valid_q[w][set_q[p]] && tag_read[p][w] == key_q[p][KeyBits-1:SetBits];
    end
    assign hit[p]  = look_q[p] && way_hit[p] != '0;
    assign miss[p] = look_q[p] && way_hit[p] == '0;
    if (Ways == 2) begin : gen_two_ways
      assign rsp_data_o[p] = way_hit[p][Ways-1] ? data_read[p][Ways-1] : data_read[p][0];
    end else begin : gen_one_way
      assign rsp_data_o[p] = data_read[p][0];
    end
  end
  assign rsp_valid_o = look_q;
  assign rsp_hit_o   = hit;

  // --- a miss finds its place: an MSHR that fetches the line, a new one, the overflow, or another try ---
  logic [Ports-1:0] found, joins_done, spill, again;
  mshr_t            found_mshr[Ports];
  mshr_t            free_mshr;
  logic             has_free, allocate, victim;
  key_t             new_key;
  set_t             new_set;
  logic [WaiterBits-1:0] new_waiter;

  assign has_free = active_q != '1;
  always_comb begin
    free_mshr = '0;
    for (int unsigned m = 0; m < Mshrs; m++) if (!active_q[m]) free_mshr = mshr_t'(m);
    allocate   = 1'b0;
    victim     = 1'b0;
    new_key    = key_q[0];
    new_set    = set_q[0];
    new_waiter = waiter_q[0];
    for (int unsigned p = 0; p < Ports; p++) begin
      logic [Ways-1:0] taken, open;
      logic            drop;
      found_mshr[p] = '0;
      found[p]      = 1'b0;
      taken         = '0;
      for (int unsigned m = 0; m < Mshrs; m++) begin
        if (active_q[m] && mshr_key_q[m] == key_q[p]) begin
          found[p]      = miss[p];
          found_mshr[p] = mshr_t'(m);
        end
        for (int unsigned w = 0; w < Ways; w++) begin
          if (active_q[m] && mshr_key_q[m][SetBits-1:0] == set_q[p] && mshr_way_q[m] == 1'(w)) taken[w] = 1'b1;
        end
      end
      for (int unsigned w = 0; w < Ways; w++) open[w] = !taken[w] && !fresh_q[w][set_q[p]];
      drop = Ways == 2 && (open[0] && open[Ways-1] ? lru_q[set_q[p]] : open[Ways-1]);
      joins_done[p] = found[p] && done_q && found_mshr[p] == done_mshr_q;
      spill[p]      = miss[p] && !found[p] && (!has_free || taken == '1);
      again[p]      = miss[p] && !found[p] && !spill[p] && (open == '0 || allocate);
      if (miss[p] && !found[p] && !spill[p] && !again[p]) begin
        allocate   = 1'b1;
        victim     = drop;
        new_key    = key_q[p];
        new_set    = set_q[p];
        new_waiter = waiter_q[p];
      end
    end
  end
  assign miss_o = allocate;

  // --- wake ---
  logic [Waiters-1:0] joined, spilled, repeated, wake_line;
  always_comb begin
    joined   = '0;
    spilled  = '0;
    repeated = '0;
    for (int unsigned p = 0; p < Ports; p++) begin
      if (joins_done[p]) joined[waiter_q[p]] = 1'b1;
      if (spill[p]) spilled[waiter_q[p]] = 1'b1;
      if (again[p]) repeated[waiter_q[p]] = 1'b1;
    end
    wake_line    = done_q ? wait_q[done_mshr_q] | joined : '0;
    wake_o       = wake_line | (done_q ? overflow_q | spilled : '0) | again_q;
    wake_error_o = done_error_q ? wake_line : '0;
  end

  always_ff @(posedge clk_i) begin
    look_q  <= req_valid_i;
    again_q <= repeated;
    lease_q <= lease_q + 1'b1;
    for (int unsigned p = 0; p < Ports; p++) begin
      if (req_valid_i[p]) begin
        key_q[p]    <= req_key_i[p];
        waiter_q[p] <= req_waiter_i[p];
      end
    end

    if (lease_q == '0) for (int unsigned w = 0; w < Ways; w++) fresh_q[w] <= '0;
    for (int unsigned p = 0; p < Ports; p++) begin
      if (hit[p] && Ways == 2) lru_q[set_q[p]] <= !way_hit[p][Ways-1];
      for (int unsigned w = 0; w < Ways; w++) if (look_q[p] && way_hit[p][w]) fresh_q[w][set_q[p]] <= 1'b0;
    end
    if (allocate) begin
      active_q[free_mshr]    <= 1'b1;
      need_q[free_mshr]      <= 1'b1;
      error_q[free_mshr]     <= 1'b0;
      mshr_key_q[free_mshr]  <= new_key;
      mshr_way_q[free_mshr]  <= victim;
      mshr_beat_q[free_mshr] <= '0;
      lru_q[new_set]         <= !victim;
      for (int unsigned w = 0; w < Ways; w++) if (victim == 1'(w)) valid_q[w][new_set] <= 1'b0;
    end
    for (int unsigned p = 0; p < Ports; p++) if (found[p]) wait_q[found_mshr[p]][waiter_q[p]] <= 1'b1;
    if (allocate) wait_q[free_mshr] <= Waiters'(1) << new_waiter;
    if (done_q) overflow_q <= '0;
    else if (spill != '0) overflow_q <= overflow_q | spilled;

    done_q       <= fill_valid_i && fill_last_i;
    done_mshr_q  <= fill_mshr;
    done_error_q <= fill_error_i || error_q[fill_mshr];
    if (fill_valid_i) begin
      mshr_beat_q[fill_mshr] <= fill_beat + 1'b1;
      if (fill_error_i) error_q[fill_mshr] <= 1'b1;
    end
    if (done_q) begin
      active_q[done_mshr_q] <= 1'b0;
      for (int unsigned w = 0; w < Ways; w++) begin
        if (mshr_way_q[done_mshr_q] == 1'(w)) begin
          valid_q[w][mshr_key_q[done_mshr_q][SetBits-1:0]] <= !done_error_q;
          fresh_q[w][mshr_key_q[done_mshr_q][SetBits-1:0]] <= !done_error_q;
        end
      end
    end

    if (fetch_load) need_q[need_mshr] <= 1'b0;
    if (flush_i || !rst_ni) begin
      for (int unsigned w = 0; w < Ways; w++) begin
        valid_q[w] <= '0;
        fresh_q[w] <= '0;
      end
      lru_q <= '0;
    end
    if (!rst_ni) begin
      look_q     <= '0;
      again_q    <= '0;
      active_q   <= '0;
      need_q     <= '0;
      overflow_q <= '0;
      done_q     <= 1'b0;
      lease_q    <= '0;
    end
  end

  // --- request for the line; registered, so that it does not change while it waits ---
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
  function automatic logic [AddrBits-1:0] word_address(set_t set, logic [SelectBits-1:0] word);
    if (WordsPerLine == 1) return AddrBits'(set);
    return AddrBits'({set, word});
  endfunction

  logic [AddrBits-1:0] fill_addr;
  assign fill_addr = word_address(mshr_key_q[fill_mshr][SetBits-1:0], SelectBits'(int'(fill_beat) / Banks));

  for (genvar w = 0; w < int'(Ways); w++) begin : gen_way
    logic tag_write;
    logic [Banks-1:0] bank_write;
    assign tag_write = done_q && mshr_way_q[done_mshr_q] == 1'(w);
    for (genvar b = 0; b < int'(Banks); b++) begin : gen_write
      assign bank_write[b] = fill_valid_i && mshr_way_q[fill_mshr] == 1'(w) && int'(fill_beat) % Banks == b;
    end
    for (genvar p = 0; p < int'(Ports); p++) begin : gen_port
      rt_ram_sdp #(
          .Depth  (Sets),
          .Forward(1'b1),
          .data_t (logic [TagBits-1:0])
      ) u_tag (
          .clk_i,
          .rst_ni,
          .write_en_i  (tag_write),
          .write_addr_i(mshr_key_q[done_mshr_q][SetBits-1:0]),
          .write_data_i(mshr_key_q[done_mshr_q][KeyBits-1:SetBits]),
          .read_en_i   (req_valid_i[p]),
          .read_addr_i (req_key_i[p][SetBits-1:0]),
          .read_data_o (tag_read[p][w])
      );
      for (genvar b = 0; b < int'(Banks); b++) begin : gen_bank
        rt_ram_sdp #(
            .Depth (Depth),
            .data_t(logic [DataBits-1:0])
        ) u_data (
            .clk_i,
            .rst_ni,
            .write_en_i  (bank_write[b]),
            .write_addr_i(fill_addr),
            .write_data_i(fill_data_i),
            .read_en_i   (req_valid_i[p]),
            .read_addr_i (word_address(req_key_i[p][SetBits-1:0], req_word_i[p])),
            .read_data_o (data_read[p][w][b*DataBits+:DataBits])
        );
      end
    end
  end

  `RT_ASSERT(FillIsExpected, !fill_valid_i || active_q[fill_mshr])
  `RT_ASSERT(FillHasItsLength, !fill_valid_i || fill_last_i || fill_beat != BeatBits'(FillBeats - 1))
  `RT_ASSERT(OneWay, !look_q[0] || $onehot0(way_hit[0]))
  `RT_ASSERT(OverflowIsServed, overflow_q == '0 || active_q != '0)
  `RT_ASSERT(FlushWhenIdle, !flush_i || active_q == '0)
endmodule
