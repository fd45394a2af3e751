// Read-only cache that never makes its users wait: a lookup hits two clocks later, or its waiter is parked and woken later.
//
// Lookup      On each of Ports ports: req_* in clock c, answer in clock c + 2 (rsp_valid_o, rsp_hit_o, rsp_data_o). On a miss the waiter is
//             noted with the miss register (MSHR) that fetches the line, or as waiting for any if there is no register or no way for the line.
// Wake        wake_o has the waiters that shall look up again (one clock, registers and one comparison behind them); wake_error_o those of
//             them whose line could not be read. Those that wait for any are woken in groups, a group for each free MSHR and RetryClocks (what a
//             waiter needs to come back): woken all at once they would fail again, and their look-ups would keep others from theirs.
// Pipeline    c: address of tags and data. c + 1: tags compared, the key compared with the MSHRs. c + 2: answer; waiters join an MSHR, or (one of
//             all ports) go on, or try again, at once if an MSHR is free. c + 3: the one that went on gets an MSHR, joins one or waits for any.
//             A line is seen by its tag or by its MSHR at every moment: a waiter whose MSHR finished between c + 1 and c + 2 tries again.
// Progress    A line that was filled is kept by its MSHR until it has been hit once (fresh), so that those who asked for it get it before the
//             next one takes its way. Where no other is free, a miss takes an MSHR that only keeps a line, but in the last quarter of every 2^LeaseBits
//             clocks: in that time whoever is woken gets its line. As a waiter may have gone (an any-hit ray that is done), freshness ends then.
// Fill        Beats may come in any order between miss registers; they go into the data RAM at once. The way that is filled counts as invalid
//             from the miss to the end of the fill. A line with an error becomes invalid.
// Flush       flush_i starts it, flushing_o is high until all tags are invalid (Sets clocks). No lookups before the first flush and during one.
// Structure   Ports x Ways x (WordBits / DataBits) RAMs with the same contents for each port; a word is what one lookup reads. Tags with their
//             valid bit in RAM. The way to drop next is a RAM of one bit a set, written by a miss or by the hit of one port a clock: with
//             several ports it is the least recently used way of those hits that were noted.
// Misses      Mshrs in flight; a second miss on a line joins the first. One new miss a clock; a second one tries again.
// Latency     Hit 2 clocks, one lookup a clock and port. Miss: the request is offered 3 clocks after the answer.
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
    parameter int unsigned LeaseBits = 10,
    parameter int unsigned RetryClocks = 12,
    localparam int unsigned WaiterBits = Waiters > 1 ? $clog2(Waiters) : 1,
    localparam int unsigned SelectBits = WordsPerLine > 1 ? $clog2(WordsPerLine) : 1
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    input  logic                                flush_i,
    output logic                                flushing_o,
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
  typedef logic [WaiterBits-1:0] waiter_t;
  typedef struct packed {
    logic               valid;
    logic [TagBits-1:0] tag;
  } tag_t;

  // --- miss registers ---
  logic [Mshrs-1:0]               active_q;  // its line is being fetched
  logic [Mshrs-1:0]               fresh_q;   // its line was filled and not hit since
  logic [Mshrs-1:0]               need_q, error_q, way_q;
  logic [Mshrs-1:0][KeyBits-1:0]  mshr_key_q;
  logic [Mshrs-1:0][BeatBits-1:0] beat_q;
  logic [LeaseBits-1:0]           lease_q;
  logic                           has_free;
  logic                           keep_q;  // the last quarter
  logic [Mshrs-1:0]               usable;
  assign usable   = ~active_q & ~(fresh_q & {Mshrs{keep_q}});
  assign has_free = usable != '0;

  // The request for a line.
  logic  fetch_valid_q, fetch_load;
  key_t  fetch_key_q;
  mshr_t fetch_mshr_q, need_mshr;

  // A fill whose last beat was written in the clock before.
  logic  done_q, done_error_q;
  mshr_t done_mshr_q;

  mshr_t               fill_mshr;
  logic [BeatBits-1:0] fill_beat;
  assign fill_mshr = mshr_t'(fill_mshr_i);
  assign fill_beat = beat_q[fill_mshr];

  // --- lookup: c + 1 ---
  logic [Ports-1:0]          look1_q, look2_q;
  key_t [Ports-1:0]          key1_q, key2_q;
  waiter_t [Ports-1:0]       waiter1_q, waiter2_q;
  tag_t                      tag_read [Ports][Ways];
  logic [WordBits-1:0]       data_read[Ports][Ways];
  logic [Ports-1:0][Ways-1:0] way_hit_q;
  logic [WordBits-1:0]       data_q[Ports][Ways];
  logic [Ports-1:0]          busy1, busy1_q;                // an MSHR fetches the line
  logic [Ports-1:0][Mshrs-1:0] same_key1, same_key2;
  logic [Ports-1:0][Ways-1:0] filling1;                     // the way of the set that is being filled
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_lookup
    for (genvar m = 0; m < int'(Mshrs); m++) begin : gen_same
      assign same_key1[p][m] = mshr_key_q[m] == key1_q[p];
      assign same_key2[p][m] = mshr_key_q[m] == key2_q[p];
    end
    assign busy1[p] = (same_key1[p] & active_q) != '0;
    for (genvar w = 0; w < int'(Ways); w++) begin : gen_way
      logic [Mshrs-1:0] same_way;
      for (genvar m = 0; m < int'(Mshrs); m++) begin : gen_mshr
        assign same_way[m] = active_q[m] && mshr_key_q[m][SetBits-1:0] == key1_q[p][SetBits-1:0] && way_q[m] == 1'(w);
      end
      assign filling1[p][w] = same_way != '0;
      always_ff @(posedge clk_i) begin
        way_hit_q[p][w] <= look1_q[p] && tag_read[p][w].valid && tag_read[p][w].tag == key1_q[p][KeyBits-1:SetBits] && !filling1[p][w];
        data_q[p][w]    <= data_read[p][w];
      end
    end
    always_ff @(posedge clk_i) begin
      look1_q[p]   <= req_valid_i[p] && rst_ni;
      look2_q[p]   <= look1_q[p] && rst_ni;
      key1_q[p]    <= req_key_i[p];
      waiter1_q[p] <= req_waiter_i[p];
      key2_q[p]    <= key1_q[p];
      waiter2_q[p] <= waiter1_q[p];
      busy1_q[p]   <= busy1[p];
    end
  end

  // --- c + 2: the answer; who missed joins, tries again, or goes on ---
  logic [Ports-1:0]  miss, join_line, join_done, again, again_later, fetchers;
  mshr_t [Ports-1:0] joined;
  logic              on_valid, on_valid_q;
  key_t              on_key, on_key_q;
  waiter_t           on_waiter, on_waiter_q;
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_answer
    assign rsp_valid_o[p] = look2_q[p];
    assign rsp_hit_o[p]   = way_hit_q[p] != '0;
    assign miss[p]        = look2_q[p] && way_hit_q[p] == '0;
    if (Ways == 2) begin : gen_two_ways
      assign rsp_data_o[p] = way_hit_q[p][Ways-1] ? data_q[p][Ways-1] : data_q[p][0];
    end else begin : gen_one_way
      assign rsp_data_o[p] = data_q[p][0];
    end
    logic [Mshrs-1:0] same;
    assign same = same_key2[p] & active_q;
    always_comb begin
      joined[p] = '0;
      for (int unsigned m = 0; m < Mshrs; m++) if (same[m]) joined[p] |= mshr_t'(m);
    end
    assign join_done[p] = same != '0 && done_q && joined[p] == done_mshr_q;
    assign join_line[p] = miss[p] && same != '0 && !join_done[p];
    assign fetchers[p]  = miss[p] && same == '0 && !busy1_q[p];
  end
  always_comb begin
    on_valid  = 1'b0;
    on_key    = key2_q[0];
    on_waiter = waiter2_q[0];
    again       = '0;
    again_later = '0;
    for (int unsigned p = 0; p < Ports; p++) begin
      if (miss[p] && !join_line[p]) begin
        if (fetchers[p] && !on_valid) begin
          on_valid  = 1'b1;
          on_key    = key2_q[p];
          on_waiter = waiter2_q[p];
        end else if (fetchers[p] && !has_free) begin
          again_later[p] = 1'b1;
        end else begin
          again[p] = 1'b1;
        end
      end
    end
  end

  // --- c + 3: one miss finds its place ---
  logic [Mshrs-1:0] on_same, on_set;
  logic [Ways-1:0]  open;
  mshr_t            on_joined, free_mshr;
  logic             on_found, on_done, allocate, spill, on_again, victim, older;
  assign on_found = on_same != '0;
  assign on_done  = on_found && done_q && on_joined == done_mshr_q;
  for (genvar m = 0; m < int'(Mshrs); m++) begin : gen_on
    assign on_same[m] = active_q[m] && mshr_key_q[m] == on_key_q;
    assign on_set[m]  = mshr_key_q[m][SetBits-1:0] == on_key_q[SetBits-1:0];
  end
  always_comb begin
    on_joined = '0;
    free_mshr = '0;
    open      = '1;
    for (int unsigned m = 0; m < Mshrs; m++) begin
      if (on_same[m]) on_joined |= mshr_t'(m);
      if (usable[m] && (!fresh_q[m] || (usable & ~fresh_q) == '0)) free_mshr = mshr_t'(m);
      for (int unsigned w = 0; w < Ways; w++) begin
        if (on_set[m] && way_q[m] == 1'(w) && (active_q[m] || fresh_q[m])) open[w] = 1'b0;
      end
    end
    victim   = Ways == 2 && (open[0] && open[Ways-1] ? older : open[Ways-1]);
    allocate = on_valid_q && !on_found && has_free && open != '0;
    spill    = on_valid_q && !on_found && !allocate;
    on_again = on_valid_q && on_found && on_done;
  end
  assign miss_o = allocate;

  // --- who waits for what ---
  localparam int unsigned GroupWaiters = 8;
  localparam int unsigned Groups = (Waiters + GroupWaiters - 1) / GroupWaiters;
  localparam int unsigned GroupBits = Groups > 1 ? $clog2(Groups) : 1;
  logic [Waiters-1:0]   wait_q, any_q, again_q, wake_line;
  logic [GroupBits-1:0] group_q;
  // Groups woken in the last RetryClocks clocks; one more may be woken while they are fewer than the free registers.
  localparam int unsigned WokenBits = $clog2(RetryClocks + 1);
  logic [Groups-1:0]      group_waits;
  logic [RetryClocks-1:0] woken_q;
  logic [WokenBits-1:0]   woken_count_q;
  logic [MshrBits:0]      free_count_q;
  logic                   may_visit, visited;
  assign may_visit = 32'(free_count_q) > 32'(woken_count_q);
  assign visited   = may_visit && group_waits[group_q];
  for (genvar g = 0; g < int'(Groups); g++) begin : gen_waits
    localparam int unsigned Last = (g + 1) * GroupWaiters > Waiters ? Waiters - 1 : (g + 1) * GroupWaiters - 1;
    assign group_waits[g] = (wait_q[Last:g*GroupWaiters] & any_q[Last:g*GroupWaiters]) != '0;
  end
  always_ff @(posedge clk_i) begin
    if (may_visit) group_q <= group_q == GroupBits'(Groups - 1) ? '0 : group_q + 1'b1;
    woken_q       <= RetryClocks'({woken_q, visited});
    woken_count_q <= woken_count_q + WokenBits'(visited) - WokenBits'(woken_q[RetryClocks-1]);
    free_count_q  <= (MshrBits + 1)'($countones(usable));
    if (!rst_ni) begin
      group_q       <= '0;
      woken_q       <= '0;
      woken_count_q <= '0;
    end
  end
  mshr_t              where_q[Waiters];
  for (genvar i = 0; i < int'(Waiters); i++) begin : gen_waiter
    logic  park, later, retry, visit;
    mshr_t where;
    assign visit = may_visit && wait_q[i] && any_q[i] && group_q == GroupBits'(i / GroupWaiters);
    always_comb begin
      park  = on_valid_q && on_waiter_q == waiter_t'(i) && !on_again;
      where = on_found ? on_joined : free_mshr;
      later = spill && on_waiter_q == waiter_t'(i);
      retry = on_again && on_waiter_q == waiter_t'(i);
      for (int unsigned p = 0; p < Ports; p++) begin
        if (join_line[p] && waiter2_q[p] == waiter_t'(i)) begin
          park  = 1'b1;
          where = joined[p];
        end
        if (again_later[p] && waiter2_q[p] == waiter_t'(i)) begin
          park  = 1'b1;
          later = 1'b1;
        end
        if (again[p] && waiter2_q[p] == waiter_t'(i)) retry = 1'b1;
      end
    end
    assign wake_line[i] = done_q && wait_q[i] && !any_q[i] && where_q[i] == done_mshr_q;
    always_ff @(posedge clk_i) begin
      again_q[i] <= retry || visit;
      if (wake_line[i] || visit) wait_q[i] <= 1'b0;
      if (park) begin
        wait_q[i]  <= 1'b1;
        where_q[i] <= where;
        any_q[i]   <= later;
      end
      if (!rst_ni) begin
        again_q[i] <= 1'b0;
        wait_q[i]  <= 1'b0;
      end
    end
  end
  assign wake_o       = wake_line | again_q;
  assign wake_error_o = done_error_q ? wake_line : '0;

  always_ff @(posedge clk_i) begin
    on_valid_q  <= on_valid;
    on_key_q    <= on_key;
    on_waiter_q <= on_waiter;
    lease_q     <= lease_q + 1'b1;
    keep_q      <= lease_q[LeaseBits-1-:2] == '1;

    if (lease_q == '0) fresh_q <= '0;
    for (int unsigned p = 0; p < Ports; p++) begin
      for (int unsigned m = 0; m < Mshrs; m++) if (look2_q[p] && same_key2[p][m]) fresh_q[m] <= 1'b0;
    end
    if (allocate) begin
      active_q[free_mshr]   <= 1'b1;
      fresh_q[free_mshr]    <= 1'b0;
      need_q[free_mshr]     <= 1'b1;
      error_q[free_mshr]    <= 1'b0;
      mshr_key_q[free_mshr] <= on_key_q;
      way_q[free_mshr]      <= victim;
      beat_q[free_mshr]     <= '0;
    end

    done_q       <= fill_valid_i && fill_last_i;
    done_mshr_q  <= fill_mshr;
    done_error_q <= fill_valid_i && fill_last_i && (fill_error_i || error_q[fill_mshr]);
    if (fill_valid_i) begin
      beat_q[fill_mshr] <= fill_beat + 1'b1;
      if (fill_error_i) error_q[fill_mshr] <= 1'b1;
    end
    if (done_q) begin
      active_q[done_mshr_q] <= 1'b0;
      fresh_q[done_mshr_q]  <= !done_error_q;
    end

    if (fetch_load) need_q[need_mshr] <= 1'b0;
    if (!rst_ni) begin
      on_valid_q <= 1'b0;
      active_q   <= '0;
      fresh_q    <= '0;
      need_q     <= '0;
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

  // Tags are written by the end of a fill, or one after the other by a flush.
  set_t flush_set_q, tag_set;
  logic flushing_q;
  tag_t tag_new;
  assign flushing_o    = flushing_q || flush_i;
  assign tag_set       = flushing_q ? flush_set_q : mshr_key_q[done_mshr_q][SetBits-1:0];
  assign tag_new.valid = !flushing_q && !done_error_q;
  assign tag_new.tag   = mshr_key_q[done_mshr_q][KeyBits-1:SetBits];
  always_ff @(posedge clk_i) begin
    if (flush_i) flushing_q <= 1'b1;
    else if (flush_set_q == '1) flushing_q <= 1'b0;
    flush_set_q <= flushing_q ? flush_set_q + 1'b1 : '0;
    if (!rst_ni) flushing_q <= 1'b0;
  end

  for (genvar w = 0; w < int'(Ways); w++) begin : gen_way
    logic tag_write;
    logic [Banks-1:0] bank_write;
    assign tag_write = flushing_q || (done_q && way_q[done_mshr_q] == 1'(w));
    for (genvar b = 0; b < int'(Banks); b++) begin : gen_write
      assign bank_write[b] = fill_valid_i && way_q[fill_mshr] == 1'(w) && int'(fill_beat) % Banks == b;
    end
    for (genvar p = 0; p < int'(Ports); p++) begin : gen_port
      rt_ram_sdp #(
          .Depth  (Sets),
          .Forward(1'b1),
          .data_t (tag_t)
      ) u_tag (
          .clk_i,
          .rst_ni,
          .write_en_i  (tag_write),
          .write_addr_i(tag_set),
          .write_data_i(tag_new),
          .read_en_i   (1'b1),
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
            .read_en_i   (1'b1),
            .read_addr_i (word_address(req_key_i[p][SetBits-1:0], req_word_i[p])),
            .read_data_o (data_read[p][w][b*DataBits+:DataBits])
        );
      end
    end
  end

  // --- the way to drop next ---
  if (Ways == 2) begin : gen_older
    logic used_write, used_way;
    set_t used_set;
    always_comb begin
      used_write = allocate;
      used_set   = on_key_q[SetBits-1:0];
      used_way   = victim;
      if (!allocate) begin
        for (int unsigned p = 0; p < Ports; p++) begin
          if (way_hit_q[p] != '0) begin
            used_write = 1'b1;
            used_set   = key2_q[p][SetBits-1:0];
            used_way   = way_hit_q[p][Ways-1];
          end
        end
      end
    end
    rt_ram_sdp #(
        .Depth  (Sets),
        .Forward(1'b1),
        .data_t (logic)
    ) u_older (
        .clk_i,
        .rst_ni,
        .write_en_i  (used_write),
        .write_addr_i(used_set),
        .write_data_i(!used_way),
        .read_en_i   (on_valid),
        .read_addr_i (on_key[SetBits-1:0]),
        .read_data_o (older)
    );
  end else begin : gen_only
    assign older = 1'b0;
  end

  `RT_ASSERT(FillIsExpected, !fill_valid_i || active_q[fill_mshr])
  `RT_ASSERT(FillHasItsLength, !fill_valid_i || fill_last_i || fill_beat != BeatBits'(FillBeats - 1))
  `RT_ASSERT(OneWay, !look2_q[0] || $onehot0(way_hit_q[0]))
  `RT_ASSERT(FlushWhenIdle, !flushing_o || (active_q == '0 && look1_q == '0 && look2_q == '0))
endmodule
