// SPDX-License-Identifier: Apache-2.0
// Read-only cache that never makes its users wait: a lookup hits three clocks later, or its waiter is parked and woken later.
//
// Lookup      On each of Ports ports: req_* in clock c, answer in clock c + 3 (rsp_valid_o, rsp_hit_o, rsp_data_o). On a miss the waiter is
//             noted with the miss register (MSHR) that fetches the line, or as waiting for any if there is no register or no way for the line.
// Wake        wake_* of each port: a stream of waiters that shall look up again, each with the word that its line could not be read
//             (rt_waiters). Those that wait for any are woken while there are free MSHRs, RetryRate for each in RetryClocks (what a waiter needs to
//             come back): woken all at once they would fail again, and their look-ups would keep others from theirs.
// Pipeline    c: address of tags and data. c + 2: tags and data stand in the output registers of their RAMs; tags compared. c + 3: answer. c + 4: who
//             missed stands in the register of its port, or tries again if there is one before it. From these registers one miss a clock is
//             compared with the keys of the MSHRs, c + 5, and joins one, or gets one, or waits for any, c + 6.
//             A line that is being fetched misses: the tag of the way that it takes becomes invalid before the line is asked for, and valid at the end
//             of the fill. A lookup that reads a tag while it is written tries again, and so does one whose line an MSHR has just filled
//             (recent: for the time that a miss may need to come to the compare). Where that MSHR was taken again meanwhile the line is fetched a
//             second time and may stand in both ways, with the same words, as far as they are read.
// Progress    A line that was filled is kept by its MSHR until it has been hit once (fresh), so that those who asked for it get it before the
//             next one takes its way; of the hits of one clock one is seen, so that a line may be kept longer. Where no other is free, a miss
//             takes an MSHR that only keeps a line, but in the last sixteenth of every 2^LeaseBits clocks and with keep_i: in that time whoever is woken
//             gets its line. As a waiter may have gone (an any-hit ray that is done), freshness ends after one to two sixteenths: no set is closed longer. Clocks
//             in which some are woken and none is taken, or in which the waiters of the line are yet to be woken, do not count.
// Fill        Beats may come in any order between miss registers; they go into the data RAMs as they come. A line with an error becomes invalid.
// Flush       flush_i starts it, flushing_o is high until all tags are invalid (Sets clocks). No lookups before the first flush and during one.
// Structure   Ports x Ways x (WordBits / DataBits) RAMs with the same contents for each port; a word is what one lookup reads. Tags with their
//             valid bit in RAM. The way to drop next is a RAM of one bit a set, written by a miss or by the hit of one port a clock: with
//             several ports it is the least recently used way of those hits that were seen. Only the misses of all ports, one a clock, are compared
//             with the MSHRs, so that these do not grow with the ports.
// Misses      Mshrs in flight; a second miss on a line joins the first. One miss a clock, first or second, of all ports.
// Latency     Hit 3 clocks, one lookup a clock and port. Miss: the request is offered 5 clocks after the answer, if no other is before it.
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
    parameter int unsigned ReadBeats = WordBits / DataBits * WordsPerLine,  // beats of a fetch; those beyond the line are dropped
    parameter int unsigned Mshrs = 4,
    parameter int unsigned Waiters = 32,  // of each port
    parameter int unsigned LeaseBits = 12,
    parameter int unsigned RetryClocks = 12,
    parameter int unsigned RetryRate = 8,
    localparam int unsigned WaiterBits = Waiters > 1 ? $clog2(Waiters) : 1,
    localparam int unsigned SelectBits = WordsPerLine > 1 ? $clog2(WordsPerLine) : 1
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    input  logic                                flush_i,
    input  logic                                keep_i,  // fresh lines keep their miss registers
    output logic                                flushing_o,
    input  logic [Ports-1:0]                    req_valid_i,
    input  logic [Ports-1:0][KeyBits-1:0]       req_key_i,
    input  logic [Ports-1:0][SelectBits-1:0]    req_word_i,
    input  logic [Ports-1:0][WaiterBits-1:0]    req_waiter_i,
    output logic [Ports-1:0]                    rsp_valid_o,
    output logic [Ports-1:0]                    rsp_hit_o,
    output logic [Ports-1:0][WordBits-1:0]      rsp_data_o,
    output logic [Ports-1:0]                    wake_valid_o,
    input  logic [Ports-1:0]                    wake_ready_i,
    output logic [Ports-1:0][WaiterBits-1:0]    wake_waiter_o,
    output logic [Ports-1:0]                    wake_error_o,
    output logic                                fetch_valid_o,
    input  logic                                fetch_ready_i,
    output logic [KeyBits-1:0]                  fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]  fetch_mshr_o,
    output logic                                miss_o,  // a line is going to be fetched
    input  logic                                fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0]  fill_mshr_i,
    input  logic [DataBits-1:0]                 fill_data_i,
    input  logic                                fill_last_i,
    input  logic                                fill_error_i,
    output logic                                idle_o  // no lookup on its way, nobody waits, no line is being fetched
);
  localparam int unsigned Banks = WordBits / DataBits;
  localparam int unsigned FillBeats = Banks * WordsPerLine;
  localparam int unsigned BeatBits = ReadBeats > 1 ? $clog2(ReadBeats) : 1;
  localparam int unsigned Sets = Lines / Ways;
  localparam int unsigned SetBits = $clog2(Sets);
  localparam int unsigned TagBits = KeyBits - SetBits;
  localparam int unsigned MshrBits = $clog2(Mshrs);
  localparam int unsigned Depth = Sets * WordsPerLine;
  localparam int unsigned AddrBits = $clog2(Depth);

  `RT_ASSERT_INIT(WordIsBeats, WordBits == Banks * DataBits)
  `RT_ASSERT_INIT(ReadIsLine, ReadBeats >= FillBeats)
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

  localparam int unsigned PortBits = Ports > 1 ? $clog2(Ports) : 1;
  localparam int unsigned RecentBits = 4;
  typedef logic [PortBits-1:0] port_t;
  typedef struct packed {
    key_t    key;
    waiter_t waiter;
  } miss_t;

  // --- miss registers ---
  typedef logic [Mshrs-1:0] mshrs_t;
  mshrs_t                active_q;           // its line is being fetched
  mshrs_t                fresh_q;            // its line was filled and no hit on it was seen since
  mshrs_t                recent_q, aging_q;  // its line was filled in this span of 2^RecentBits clocks, in the one before
  mshrs_t                stale_q;            // fresh since the sixteenth before
  mshrs_t                error_q, way_q;
  key_t                  mshr_key_q[Mshrs];
  logic [BeatBits-1:0]   beat_q[Mshrs];
  logic [LeaseBits-1:0]  lease_q;
  logic [RecentBits-1:0] span_q;
  logic                  keep_q;             // the last sixteenth
  mshrs_t                usable, waiting[Ports], waited_for;
  always_comb begin
    waited_for = '0;
    for (int unsigned p = 0; p < Ports; p++) waited_for |= waiting[p];
  end
  assign usable = ~active_q & ~waited_for & ~(fresh_q & {Mshrs{keep_q}});

  // The MSHR that the next miss takes, chosen a clock before; where there is one, one that keeps no line.
  logic  allocate, free_valid_q;
  mshr_t free_q;
  function automatic logic [MshrBits:0] choose(mshrs_t from, mshrs_t fresh);  // {valid, index}
    mshrs_t pool;
    choose = '0;
    pool   = (from & ~fresh) != '0 ? from & ~fresh : from;
    for (int unsigned m = 0; m < Mshrs; m++) if (pool[m]) choose = {1'b1, mshr_t'(m)};
  endfunction
  always_ff @(posedge clk_i) begin
    {free_valid_q, free_q} <= allocate ? choose(usable & ~(mshrs_t'(1) << free_q), fresh_q) : choose(usable, fresh_q);
    if (!rst_ni) free_valid_q <= 1'b0;
  end

  // A line that is going to be fetched: as soon as no fill ends its way becomes invalid, and it is asked for.
  logic  taken_q, taken_now_q, taken_way_q, taken_leaves;
  key_t  taken_key_q;
  mshr_t taken_mshr_q;
  // A fill whose last beat has come; in the clock in which done_q is 1 its tag is written, and the last beat.
  logic  ending_q, ending_way_q, ending_error_q, done_q, done_error_q;
  key_t  fill_key, ending_key_q;
  mshr_t ending_mshr_q, done_mshr_q;

  // Registers of its own for the answers, which go to every cache; in the next clock they are written.
  logic                fill_valid_q, fill_last_q, fill_error_q;
  mshr_t               fill_mshr_q;
  logic [DataBits-1:0] fill_data_q;
  logic [BeatBits-1:0] fill_beat;
  assign fill_beat = beat_q[fill_mshr_q];
  always_ff @(posedge clk_i) begin
    fill_valid_q <= fill_valid_i && rst_ni;
    if (fill_valid_i) begin
      fill_mshr_q  <= mshr_t'(fill_mshr_i);
      fill_data_q  <= fill_data_i;
      fill_last_q  <= fill_last_i;
      fill_error_q <= fill_error_i;
    end
  end

  // Tags are written by the end of a fill and where a line is going to be fetched, or one after the other by a flush; every port has the write in
  // registers of its own.
  typedef struct packed {
    logic [Ways-1:0] ways;
    set_t            index;
    tag_t            tag;
  } tag_write_t;
  set_t       flush_set_q;
  logic       flushing_q, flushed_q;
  tag_write_t tag_write;
  tag_write_t [Ports-1:0] port_tag_write;
  assign flushing_o = flushing_q || flush_i || flushed_q;
  always_comb begin
    for (int unsigned w = 0; w < Ways; w++)
      tag_write.ways[w] = flushing_q || (ending_q ? ending_way_q == 1'(w) : taken_q && taken_way_q == 1'(w));
    tag_write.index     = flushing_q ? flush_set_q : ending_q ? ending_key_q[SetBits-1:0] : taken_key_q[SetBits-1:0];
    tag_write.tag.valid = !flushing_q && ending_q && !ending_error_q;
    tag_write.tag.tag   = ending_key_q[KeyBits-1:SetBits];
  end
  rt_copies #(
      .Copies(Ports),
      .data_t(logic [$bits(tag_write_t)-1:0])
  ) u_tag_writes (
      .clk_i,
      .data_i(tag_write),
      .data_o(port_tag_write)
  );
  always_ff @(posedge clk_i) begin
    if (flush_i) flushing_q <= 1'b1;
    else if (flush_set_q == '1) flushing_q <= 1'b0;
    flush_set_q <= flushing_q ? flush_set_q + 1'b1 : '0;
    flushed_q   <= flushing_q;
    if (!rst_ni) flushing_q <= 1'b0;
  end

  // --- lookup: c + 1 to c + 3; c + 4: who missed ---
  logic [Ports-1:0]           look1_q, look2_q, look3_q;
  miss_t                      look1_miss_q[Ports], look2_miss_q[Ports], look3_miss_q[Ports];
  logic [Ports-1:0]           unsure1_q, unsure2_q, unsure3_q;  // the tags were written in the clock in which they were read
  tag_t                       tag_read[Ports][Ways], tag_q[Ports][Ways];
  logic [WordBits-1:0]        data_read[Ports][Ways], data2_q[Ports][Ways], data3_q[Ports][Ways];
  logic [Ports-1:0][Ways-1:0] way_hit_q;
  logic [Ports-1:0]           missed_q, leaves, again_q;  // stands in its port's register; leaves it; tries again
  miss_t                      missed_miss_q[Ports];
  waiter_t                    again_waiter_q[Ports];
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_lookup
    logic miss, full;
    assign miss = look3_q[p] && way_hit_q[p] == '0;
    assign full = missed_q[p] && !leaves[p];
    always_ff @(posedge clk_i) begin
      look1_q[p]      <= req_valid_i[p] && rst_ni;
      look2_q[p]      <= look1_q[p] && rst_ni;
      look3_q[p]      <= look2_q[p] && rst_ni;
      look1_miss_q[p] <= '{key: req_key_i[p], waiter: req_waiter_i[p]};
      look2_miss_q[p] <= look1_miss_q[p];
      look3_miss_q[p] <= look2_miss_q[p];
      unsure1_q[p]    <= port_tag_write[p].ways != '0 && req_key_i[p][SetBits-1:0] == port_tag_write[p].index;
      unsure2_q[p]    <= unsure1_q[p];
      unsure3_q[p]    <= unsure2_q[p];
      for (int unsigned w = 0; w < Ways; w++) begin
        way_hit_q[p][w] <= look2_q[p] && !unsure2_q[p] && tag_q[p][w].valid && tag_q[p][w].tag == look2_miss_q[p].key[KeyBits-1:SetBits];
        tag_q[p][w]     <= tag_read[p][w];
        data2_q[p][w]   <= data_read[p][w];
        data3_q[p][w]   <= data2_q[p][w];
      end

      if (!full) missed_miss_q[p] <= look3_miss_q[p];
      missed_q[p]       <= rst_ni && (full || (miss && !unsure3_q[p]));
      again_q[p]        <= rst_ni && miss && (full || unsure3_q[p]);
      again_waiter_q[p] <= look3_miss_q[p].waiter;
    end
  end

  // --- c + 3: the answer ---
  always_comb begin
    for (int unsigned p = 0; p < Ports; p++) begin
      rsp_valid_o[p] = look3_q[p];
      rsp_hit_o[p]   = way_hit_q[p] != '0;
      rsp_data_o[p]  = Ways == 2 && way_hit_q[p][Ways-1] ? data3_q[p][Ways-1] : data3_q[p][0];
    end
  end

  // The port whose hit is seen, whose miss goes on, and whose waiters may retry: the one whose turn it is, or else the first that has one.
  port_t turn_q, hit_port, miss_port;
  function automatic port_t choose_port(logic [Ports-1:0] from, port_t turn);
    choose_port = '0;
    for (int p = int'(Ports) - 1; p >= 0; p--) if (from[p]) choose_port = port_t'(p);
    if (from[turn]) choose_port = turn;
  endfunction
  logic [Ports-1:0] hit;
  always_comb for (int unsigned p = 0; p < Ports; p++) hit[p] = way_hit_q[p] != '0;
  assign hit_port  = choose_port(hit, turn_q);
  assign miss_port = choose_port(missed_q, turn_q);
  logic seen_q, seen_way_q;
  set_t seen_set_q;
  always_ff @(posedge clk_i) begin
    turn_q     <= !rst_ni || turn_q == port_t'(Ports - 1) ? '0 : turn_q + 1'b1;
    seen_q     <= hit != '0 && rst_ni;
    seen_set_q <= look3_miss_q[hit_port].key[SetBits-1:0];
    seen_way_q <= Ways == 2 && way_hit_q[hit_port][Ways-1];
  end

  // --- c + 5: the miss that goes on is compared with the MSHRs ---
  logic   match_q, place_q;
  port_t  match_port_q, place_port_q;
  miss_t  match_miss_q, place_miss_q;
  mshrs_t same_q, set_q;  // MSHRs with its key, with its set
  always_comb for (int unsigned p = 0; p < Ports; p++) leaves[p] = missed_q[p] && miss_port == port_t'(p);
  always_ff @(posedge clk_i) begin
    match_q      <= missed_q != '0 && rst_ni;
    match_port_q <= miss_port;
    match_miss_q <= missed_miss_q[miss_port];
    place_q      <= match_q && rst_ni;
    place_port_q <= match_port_q;
    place_miss_q <= match_miss_q;
    for (int unsigned m = 0; m < Mshrs; m++) begin
      same_q[m] <= mshr_key_q[m] == match_miss_q.key;
      set_q[m]  <= mshr_key_q[m][SetBits-1:0] == match_miss_q.key[SetBits-1:0];
    end
    if (allocate) begin
      same_q[free_q] <= place_miss_q.key == match_miss_q.key;
      set_q[free_q]  <= place_miss_q.key[SetBits-1:0] == match_miss_q.key[SetBits-1:0];
    end
  end

  // --- c + 6: it finds its place ---
  mshrs_t          line;
  mshr_t           joined;
  logic [Ways-1:0] open;
  logic            join_line, victim, older;
  always_comb begin
    line   = same_q & active_q;
    joined = '0;
    for (int unsigned m = 0; m < Mshrs; m++) if (line[m]) joined |= mshr_t'(m);
    for (int unsigned w = 0; w < Ways; w++) open[w] = (set_q & (active_q | fresh_q) & (way_q ^ {Mshrs{w == 0}})) == '0;
    victim    = Ways == 2 && (open[0] && open[Ways-1] ? older : open[Ways-1]);
    join_line = place_q && line != '0 && !(done_q && line[done_mshr_q]);
    allocate  = place_q && (same_q & (active_q | fresh_q | recent_q | aging_q)) == '0 && free_valid_q && open != '0 && (!taken_q || taken_leaves);
  end
  assign miss_o       = allocate;
  assign taken_leaves = taken_q && !ending_q;

  // --- c + 7: who waits ---
  logic    wait_line_q, wait_any_q;
  mshr_t   wait_mshr_q;
  waiter_t wait_waiter_q;
  port_t   wait_port_q;
  always_ff @(posedge clk_i) begin
    wait_line_q   <= (join_line || allocate) && rst_ni;
    wait_any_q    <= place_q && !join_line && !allocate && rst_ni;
    wait_mshr_q   <= allocate ? free_q : joined;
    wait_waiter_q <= place_miss_q.waiter;
    wait_port_q   <= place_port_q;
    taken_now_q   <= allocate && rst_ni;
    taken_q       <= (allocate || (taken_q && !taken_leaves)) && rst_ni;
    if (allocate) begin
      taken_key_q  <= place_miss_q.key;
      taken_mshr_q <= free_q;
      taken_way_q  <= victim;
    end
  end
  localparam int unsigned WokenBits = $clog2(RetryClocks + 1);
  logic [Ports-1:0]       later_left, retry, retried;
  logic [RetryClocks-1:0] woken_q;
  logic [WokenBits-1:0]   woken_count_q;
  logic [MshrBits:0]      free_count_q;
  logic                   may_retry_q;
  always_comb begin
    retry         = '0;
    retry[turn_q] = may_retry_q && later_left[turn_q];
  end
  always_ff @(posedge clk_i) begin
    woken_q       <= RetryClocks'({woken_q, retried != '0});
    woken_count_q <= woken_count_q + WokenBits'(retried != '0) - WokenBits'(woken_q[RetryClocks-1]);
    free_count_q  <= (MshrBits + 1)'($countones(usable));
    may_retry_q   <= RetryRate * 32'(free_count_q) > 32'(woken_count_q) + 32'(retried != '0);
    if (!rst_ni) begin
      woken_q       <= '0;
      woken_count_q <= '0;
      may_retry_q   <= 1'b0;
    end
  end
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_waiters
    rt_waiters #(
        .Mshrs  (Mshrs),
        .Waiters(Waiters)
    ) u_waiters (
        .clk_i,
        .rst_ni,
        .line_valid_i  (wait_line_q && wait_port_q == port_t'(p)),
        .line_mshr_i   (wait_mshr_q),
        .line_waiter_i (wait_waiter_q),
        .again_valid_i (again_q[p]),
        .again_waiter_i(again_waiter_q[p]),
        .later_valid_i (wait_any_q && wait_port_q == port_t'(p)),
        .later_waiter_i(wait_waiter_q),
        .later_o       (later_left[p]),
        .retry_i       (retry[p]),
        .retried_o     (retried[p]),
        .ended_i       (~active_q),
        .error_i       (error_q),
        .waiting_o     (waiting[p]),
        .wake_valid_o  (wake_valid_o[p]),
        .wake_ready_i  (wake_ready_i[p]),
        .wake_waiter_o (wake_waiter_o[p]),
        .wake_error_o  (wake_error_o[p])
    );
  end

  mshrs_t seen;  // the line of the hit
  logic   lease_goes;
  assign lease_goes = wake_valid_o == '0 || (wake_valid_o & wake_ready_i) != '0;
  always_comb begin
    for (int unsigned m = 0; m < Mshrs; m++) seen[m] = seen_q && mshr_key_q[m][SetBits-1:0] == seen_set_q && way_q[m] == seen_way_q;
  end
  always_ff @(posedge clk_i) begin
    if (lease_goes) lease_q <= lease_q + 1'b1;
    keep_q  <= lease_q[LeaseBits-1-:4] == '1 || keep_i;
    span_q  <= span_q + 1'b1;
    if (span_q == '1) begin
      aging_q  <= recent_q;
      recent_q <= '0;
    end

    fresh_q <= fresh_q & ~seen;
    if (lease_goes && lease_q[LeaseBits-5:0] == '0) begin
      fresh_q <= fresh_q & ~seen & ~(stale_q & ~waited_for);
      stale_q <= fresh_q & ~waited_for;
    end
    if (allocate) begin
      active_q[free_q]   <= 1'b1;
      fresh_q[free_q]    <= 1'b0;
      recent_q[free_q]   <= 1'b0;
      aging_q[free_q]    <= 1'b0;
      error_q[free_q]    <= 1'b0;
      mshr_key_q[free_q] <= place_miss_q.key;
      way_q[free_q]      <= victim;
      beat_q[free_q]     <= '0;
    end

    ending_q       <= fill_valid_q && fill_last_q && rst_ni;
    ending_mshr_q  <= fill_mshr_q;
    ending_key_q   <= fill_key;
    ending_way_q   <= way_q[fill_mshr_q];
    ending_error_q <= fill_valid_q && fill_last_q && (fill_error_q || error_q[fill_mshr_q]);
    done_q         <= ending_q;
    done_mshr_q    <= ending_mshr_q;
    done_error_q   <= ending_error_q;
    if (fill_valid_q) begin
      beat_q[fill_mshr_q] <= fill_beat + 1'b1;
      if (fill_error_q) error_q[fill_mshr_q] <= 1'b1;
    end
    if (done_q) begin
      active_q[done_mshr_q] <= 1'b0;
      fresh_q[done_mshr_q]  <= !done_error_q;
      recent_q[done_mshr_q] <= 1'b1;
      stale_q[done_mshr_q]  <= 1'b0;
    end

    if (!rst_ni) begin
      active_q <= '0;
      fresh_q  <= '0;
      recent_q <= '0;
      aging_q  <= '0;
      done_q   <= 1'b0;
      lease_q  <= '0;
      span_q   <= '0;
    end
  end

  // The keys again, for the one whose line is filled.
  rt_ram_lut #(
      .Depth (Mshrs),
      .data_t(key_t)
  ) u_fill_keys (
      .clk_i,
      .rst_ni,
      .write_en_i  (taken_now_q),
      .write_addr_i(taken_mshr_q),
      .write_data_i(taken_key_q),
      .read_addr_i (fill_mshr_q),
      .read_data_o (fill_key)
  );

  // --- requests for lines: a place for each MSHR ---
  typedef struct packed {
    key_t  key;
    mshr_t mshr;
  } fetch_t;
  fetch_t                        fetch;
  logic                          fetch_room;
  logic [$clog2(Mshrs + 1)-1:0] fetch_usage_unused;
  rt_fifo #(
      .Depth (Mshrs),
      .data_t(fetch_t)
  ) u_fetches (
      .clk_i,
      .rst_ni,
      .in_valid_i (taken_leaves),
      .in_ready_o (fetch_room),
      .in_data_i  ('{key: taken_key_q, mshr: taken_mshr_q}),
      .out_valid_o(fetch_valid_o),
      .out_ready_i(fetch_ready_i),
      .out_data_o (fetch),
      .usage_o    (fetch_usage_unused)
  );
  assign fetch_key_o  = fetch.key;
  assign fetch_mshr_o = rt_core_pkg::MshrIdBits'(fetch.mshr);

  // --- memories ---
  function automatic logic [AddrBits-1:0] word_address(set_t set, logic [SelectBits-1:0] word);
    if (WordsPerLine == 1) return AddrBits'(set);
    return AddrBits'({set, word});
  endfunction

  typedef struct packed {
    logic [Ways-1:0][Banks-1:0] banks;
    logic [AddrBits-1:0]        addr;
    logic [DataBits-1:0]        data;
  } data_write_t;
  data_write_t write_q;
  data_write_t [Ports-1:0] port_write;
  always_ff @(posedge clk_i) begin
    write_q.addr <= word_address(fill_key[SetBits-1:0], SelectBits'(int'(fill_beat) / Banks));
    write_q.data <= fill_data_q;
    for (int unsigned w = 0; w < Ways; w++) begin
      for (int unsigned b = 0; b < Banks; b++) write_q.banks[w][b] <= fill_valid_q && way_q[fill_mshr_q] == 1'(w) && int'(fill_beat) % Banks == int'(b) &&
            (ReadBeats == FillBeats || int'(fill_beat) < FillBeats);
    end
  end
  rt_copies #(
      .Copies(Ports),
      .data_t(logic [$bits(data_write_t)-1:0])
  ) u_writes (
      .clk_i,
      .data_i(write_q),
      .data_o(port_write)
  );

  for (genvar w = 0; w < int'(Ways); w++) begin : gen_way
    for (genvar p = 0; p < int'(Ports); p++) begin : gen_port
      rt_ram_sdp #(
          .Depth (Sets),
          .data_t(tag_t)
      ) u_tag (
          .clk_i,
          .rst_ni,
          .write_en_i  (port_tag_write[p].ways[w]),
          .write_addr_i(port_tag_write[p].index),
          .write_data_i(port_tag_write[p].tag),
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
            .write_en_i  (port_write[p].banks[w][b]),
            .write_addr_i(port_write[p].addr),
            .write_data_i(port_write[p].data),
            .read_en_i   (1'b1),
            .read_addr_i (word_address(req_key_i[p][SetBits-1:0], req_word_i[p])),
            .read_data_o (data_read[p][w][b*DataBits+:DataBits])
        );
      end
    end
  end

  // --- the way to drop next ---
  if (Ways == 2) begin : gen_older
    // Noted when it suits: which way is older is no more than a good guess.
    rt_ram_sdp #(
        .Depth  (Sets),
        .Forward(1'b1),
        .data_t (logic)
    ) u_older (
        .clk_i,
        .rst_ni,
        .write_en_i  (taken_now_q || seen_q),
        .write_addr_i(taken_now_q ? taken_key_q[SetBits-1:0] : seen_set_q),
        .write_data_i(taken_now_q ? !taken_way_q : !seen_way_q),
        .read_en_i   (match_q),
        .read_addr_i (match_miss_q.key[SetBits-1:0]),
        .read_data_o (older)
    );
  end else begin : gen_only
    assign older = 1'b0;
  end

  assign idle_o = active_q == '0 && waited_for == '0 && later_left == '0 && wake_valid_o == '0 && again_q == '0 && missed_q == '0 &&
                  (look1_q | look2_q | look3_q) == '0 && !(match_q || place_q || wait_line_q || wait_any_q);

  `RT_ASSERT(FillIsExpected, !fill_valid_q || active_q[fill_mshr_q])
  `RT_ASSERT(FillHasItsLength, !fill_valid_q || fill_last_q || fill_beat != BeatBits'(ReadBeats - 1))
  `RT_ASSERT(InvalidBeforeFill, !fill_valid_q || !taken_q || taken_key_q != fill_key)
  `RT_ASSERT(FetchesHaveRoom, !taken_leaves || fetch_room)
  `RT_ASSERT(FlushWhenIdle, !flushing_o || (active_q == '0 && look1_q == '0 && look2_q == '0 && look3_q == '0 && missed_q == '0 && !match_q && !place_q))
endmodule
