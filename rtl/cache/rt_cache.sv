// Read-only cache that never makes its users wait: a lookup hits three clocks later, or its waiter is parked and woken later.
//
// Lookup      On each of Ports ports: req_* in clock c, answer in clock c + 3 (rsp_valid_o, rsp_hit_o, rsp_data_o). On a miss the waiter is
//             noted with the miss register (MSHR) that fetches the line, or as waiting for any if there is no register or no way for the line.
// Wake        wake_* of each port: a stream of waiters that shall look up again, each with the word that its line could not be read
//             (rt_waiters). Those that wait for any are woken while there are free MSHRs, RetryRate for each in RetryClocks (what a waiter needs to
//             come back): woken all at once they would fail again, and their look-ups would keep others from theirs.
// Pipeline    c: address of tags and data. c + 1: the key compared with the MSHRs. c + 2: tags and data stand in the output registers of their RAMs;
//             tags compared. c + 3: answer. c + 4: who missed joins an MSHR, or (one of all ports, every other clock) goes on, or tries again,
//             at once if an MSHR is free. c + 5: the one that went on gets an MSHR or waits for any; the others are noted, those whose MSHR
//             finishes just now try again.
//             A line is seen by its tag, as it was in c, or by its MSHR, as it was in c + 1: a lookup that reads tags while they are written
//             tries again. Keys are compared once, in c + 1; from there the results travel along, and an MSHR that is taken meanwhile is put
//             right by comparing with the one key that can take it.
// Progress    A line that was filled is kept by its MSHR until it has been hit once (fresh), so that those who asked for it get it before the
//             next one takes its way. Where no other is free, a miss takes an MSHR that only keeps a line, but in the last quarter of every 2^LeaseBits
//             clocks: in that time whoever is woken gets its line. As a waiter may have gone (an any-hit ray that is done), freshness ends then.
// Fill        Beats may come in any order between miss registers; they go into the data RAMs as they come. The way that is filled counts as invalid
//             from the miss to the end of the fill. A line with an error becomes invalid.
// Flush       flush_i starts it, flushing_o is high until all tags are invalid (Sets clocks). No lookups before the first flush and during one.
// Structure   Ports x Ways x (WordBits / DataBits) RAMs with the same contents for each port; a word is what one lookup reads. Tags with their
//             valid bit in RAM. The way to drop next is a RAM of one bit a set, written by a miss or by the hit of one port a clock: with
//             several ports it is the least recently used way of those hits that were noted.
// Misses      Mshrs in flight; a second miss on a line joins the first. One new miss a clock; a second one tries again.
// Latency     Hit 3 clocks, one lookup a clock and port. Miss: the request is offered 4 clocks after the answer.
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
    parameter int unsigned Waiters = 32,  // of each port
    parameter int unsigned LeaseBits = 10,
    parameter int unsigned RetryClocks = 12,
    parameter int unsigned RetryRate = 8,
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
  typedef logic [Mshrs-1:0] mshrs_t;
  mshrs_t               active_q;  // its line is being fetched
  mshrs_t               fresh_q;   // its line was filled and not hit since
  mshrs_t               need_q, error_q, way_q;
  key_t                 mshr_key_q[Mshrs];
  logic [BeatBits-1:0]  beat_q[Mshrs];
  logic [LeaseBits-1:0] lease_q;
  logic                 keep_q;  // the last quarter
  mshrs_t               usable, waiting[Ports], waited_for;
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

  // The request for a line.
  logic  fetch_valid_q, fetch_load;
  key_t  fetch_key_q;
  mshr_t fetch_mshr_q, need_mshr;

  // A fill whose last beat has come; in the clock in which done_q is 1 its tag is written, and the last beat.
  logic  ending_q, ending_error_q, done_q, done_error_q;
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

  // Tags are written by the end of a fill, or one after the other by a flush; every port has the write in registers of its own.
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
    tag_write.ways = '0;
    for (int unsigned w = 0; w < Ways; w++) tag_write.ways[w] = flushing_q || (ending_q && way_q[ending_mshr_q] == 1'(w));
    tag_write.index       = flushing_q ? flush_set_q : mshr_key_q[ending_mshr_q][SetBits-1:0];
    tag_write.tag.valid = !flushing_q && !ending_error_q;
    tag_write.tag.tag   = mshr_key_q[ending_mshr_q][KeyBits-1:SetBits];
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

  // --- lookup: c + 1, c + 2 ---
  localparam int unsigned PortBits = Ports > 1 ? $clog2(Ports) : 1;
  typedef logic [PortBits-1:0] port_t;
  logic [Ports-1:0]           look1_q, look2_q, look3_q, miss4_q, open4_q;
  key_t                       key1_q[Ports], key2_q[Ports], key3_q[Ports], key4_q[Ports];
  waiter_t                    waiter1_q[Ports], waiter2_q[Ports], waiter3_q[Ports], waiter4_q[Ports];
  tag_t                       tag_read[Ports][Ways], tag_q[Ports][Ways];
  logic [WordBits-1:0]        data_read[Ports][Ways], data2_q[Ports][Ways], data3_q[Ports][Ways];
  logic [Ports-1:0][Ways-1:0] way_open2_q, way_hit_q;
  logic [Ports-1:0]           unsure1_q;               // the tags were written in the clock in which they were read
  logic [Ports-1:0]           busy2_q, busy3_q, busy4_q;        // an MSHR fetched the line in c + 1, or its tags are not known
  logic [Ports-1:0]           unsure2_q;
  mshrs_t                     set1[Ports], key1[Ports];      // MSHRs with the set, with the whole key
  mshrs_t                     set2_q[Ports], same2_q[Ports], set3_q[Ports], same3_q[Ports], set4_q[Ports], same4_q[Ports];
  logic                       on_valid, on_valid_q;
  key_t                       on_key, on_key_q;
  waiter_t                    on_waiter, on_waiter_q;
  port_t                      on_port, on_port_q;
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_lookup
    always_comb begin
      for (int unsigned m = 0; m < Mshrs; m++) begin
        set1[p][m] = mshr_key_q[m][SetBits-1:0] == key1_q[p][SetBits-1:0];
        key1[p][m] = set1[p][m] && mshr_key_q[m][KeyBits-1:SetBits] == key1_q[p][KeyBits-1:SetBits];
      end
    end
    always_ff @(posedge clk_i) begin
      look1_q[p]   <= req_valid_i[p] && rst_ni;
      look2_q[p]   <= look1_q[p] && rst_ni;
      look3_q[p]   <= look2_q[p] && rst_ni;
      key1_q[p]    <= req_key_i[p];
      waiter1_q[p] <= req_waiter_i[p];
      key2_q[p]    <= key1_q[p];
      waiter2_q[p] <= waiter1_q[p];
      key3_q[p]    <= key2_q[p];
      waiter3_q[p] <= waiter2_q[p];
      key4_q[p]    <= key3_q[p];
      waiter4_q[p] <= waiter3_q[p];
      miss4_q[p]   <= look3_q[p] && way_hit_q[p] == '0 && rst_ni;
      unsure1_q[p] <= port_tag_write[p].ways != '0 && req_key_i[p][SetBits-1:0] == port_tag_write[p].index;
      unsure2_q[p] <= unsure1_q[p];
      busy2_q[p]   <= (key1[p] & active_q) != '0 || unsure1_q[p];
      busy3_q[p]   <= busy2_q[p];
      busy4_q[p]   <= busy3_q[p];
      open4_q[p]   <= (same3_q[p] & active_q) == '0 && !busy3_q[p];
      set2_q[p]    <= set1[p];
      same2_q[p]   <= key1[p];
      set3_q[p]    <= set2_q[p];
      same3_q[p]   <= same2_q[p];
      set4_q[p]    <= set3_q[p];
      same4_q[p]   <= same3_q[p];
      if (allocate) begin
        set2_q[p][free_q]  <= on_key_q[SetBits-1:0] == key1_q[p][SetBits-1:0];
        same2_q[p][free_q] <= on_key_q == key1_q[p];
        set3_q[p][free_q]  <= on_key_q[SetBits-1:0] == key2_q[p][SetBits-1:0];
        same3_q[p][free_q] <= on_key_q == key2_q[p];
        set4_q[p][free_q]  <= on_key_q[SetBits-1:0] == key3_q[p][SetBits-1:0];
        same4_q[p][free_q] <= on_key_q == key3_q[p];
      end
      // The way that is being filled counts as invalid.
      for (int unsigned w = 0; w < Ways; w++) begin
        way_open2_q[p][w] <= (set1[p] & active_q & (way_q ^ {Mshrs{w == 0}})) == '0;
        way_hit_q[p][w]   <= look2_q[p] && !unsure2_q[p] && way_open2_q[p][w] && tag_q[p][w].valid && tag_q[p][w].tag == key2_q[p][KeyBits-1:SetBits];
        tag_q[p][w]       <= tag_read[p][w];
        data2_q[p][w]     <= data_read[p][w];
        data3_q[p][w]     <= data2_q[p][w];
      end
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

  // --- c + 4: who missed joins, tries again, waits for any, or goes on ---
  logic [Ports-1:0] park, later, again, park5_q, later5_q, again5_q;
  mshr_t            joined[Ports], where5_q[Ports];
  waiter_t          waiter5_q[Ports];
  mshrs_t           on_set, on_set_q;
  logic             refused_q;  // the one that went on got no MSHR and is not yet noted
  // Which port goes on is chosen by what was known a clock before; whether it does, by what is known now.
  always_comb begin
    on_port = '0;
    for (int p = int'(Ports) - 1; p >= 0; p--) if (miss4_q[p] && open4_q[p]) on_port = port_t'(p);
  end
  assign on_key    = key4_q[on_port];
  assign on_waiter = waiter4_q[on_port];
  assign on_set    = set4_q[on_port];
  always_comb begin
    on_valid = 1'b0;
    park     = '0;
    later    = '0;
    again    = '0;
    for (int unsigned p = 0; p < Ports; p++) begin
      mshrs_t line;
      line      = same4_q[p] & active_q;
      joined[p] = '0;
      for (int unsigned m = 0; m < Mshrs; m++) if (line[m]) joined[p] |= mshr_t'(m);
      if (miss4_q[p]) begin
        if (line != '0) begin
          if (done_q && line[done_mshr_q]) again[p] = 1'b1;
          else park[p] = 1'b1;
        end else if (busy4_q[p]) begin
          again[p] = 1'b1;
        end else if (!free_valid_q) begin
          later[p] = 1'b1;
        end else if (on_port == port_t'(p) && open4_q[p] && !on_valid_q && !refused_q) begin
          on_valid = 1'b1;
        end else begin
          again[p] = 1'b1;
        end
      end
    end
  end
  always_ff @(posedge clk_i) begin
    park5_q     <= park;
    later5_q    <= later;
    again5_q    <= again;
    where5_q    <= joined;
    waiter5_q   <= waiter4_q;
    on_valid_q  <= on_valid;
    on_key_q    <= on_key;
    on_waiter_q <= on_waiter;
    on_port_q   <= on_port;
    on_set_q    <= on_set;
    if (!rst_ni) begin
      park5_q    <= '0;
      later5_q   <= '0;
      again5_q   <= '0;
      on_valid_q <= 1'b0;
    end
  end

  // --- c + 5: one miss finds its place ---
  logic [Ways-1:0] open;
  logic            victim, older;
  always_comb begin
    for (int unsigned w = 0; w < Ways; w++) open[w] = (on_set_q & (active_q | fresh_q) & (way_q ^ {Mshrs{w == 0}})) == '0;
    victim   = Ways == 2 && (open[0] && open[Ways-1] ? older : open[Ways-1]);
    allocate = on_valid_q && free_valid_q && open != '0;
  end
  assign miss_o = allocate;

  // --- who waits; the list of a miss register begins a clock after it was taken, before anybody can join it ---
  logic    opened_q;
  mshr_t   opened_mshr_q;
  waiter_t opened_waiter_q;
  port_t   opened_port_q;
  always_ff @(posedge clk_i) begin
    opened_q        <= allocate && rst_ni;
    opened_mshr_q   <= free_q;
    opened_waiter_q <= on_waiter_q;
    opened_port_q   <= on_port_q;
  end
  localparam int unsigned WokenBits = $clog2(RetryClocks + 1);
  logic [Ports-1:0]       later_left, retry, retried;
  logic [RetryClocks-1:0] woken_q;
  logic [WokenBits-1:0]   woken_count_q;
  logic [MshrBits:0]      free_count_q;
  logic                   may_retry_q, refused_noted;
  waiter_t                refused_waiter_q;
  port_t                  refused_port_q, turn_q;
  assign refused_noted = refused_q && !later5_q[refused_port_q];
  always_comb begin
    retry         = '0;
    retry[turn_q] = may_retry_q && later_left[turn_q];
  end
  always_ff @(posedge clk_i) begin
    if (on_valid_q && !allocate) begin
      refused_q        <= 1'b1;
      refused_waiter_q <= on_waiter_q;
      refused_port_q   <= on_port_q;
    end else if (refused_noted) begin
      refused_q <= 1'b0;
    end
    turn_q        <= turn_q == port_t'(Ports - 1) ? '0 : turn_q + 1'b1;
    woken_q       <= RetryClocks'({woken_q, retried != '0});
    woken_count_q <= woken_count_q + WokenBits'(retried != '0) - WokenBits'(woken_q[RetryClocks-1]);
    free_count_q  <= (MshrBits + 1)'($countones(usable));
    may_retry_q   <= RetryRate * 32'(free_count_q) > 32'(woken_count_q) + 32'(retried != '0);
    if (!rst_ni) begin
      refused_q     <= 1'b0;
      turn_q        <= '0;
      woken_q       <= '0;
      woken_count_q <= '0;
      may_retry_q   <= 1'b0;
    end
  end
  for (genvar p = 0; p < int'(Ports); p++) begin : gen_waiters
    logic finishes;  // the line that port p's waiter was to wait for
    assign finishes = done_q && where5_q[p] == done_mshr_q;
    rt_waiters #(
        .Mshrs  (Mshrs),
        .Waiters(Waiters)
    ) u_waiters (
        .clk_i,
        .rst_ni,
        .open_valid_i  (opened_q && opened_port_q == port_t'(p)),
        .open_mshr_i   (opened_mshr_q),
        .open_waiter_i (opened_waiter_q),
        .park_valid_i  (park5_q[p] && !finishes),
        .park_mshr_i   (where5_q[p]),
        .park_waiter_i (waiter5_q[p]),
        .again_valid_i (again5_q[p] || (park5_q[p] && finishes)),
        .again_waiter_i(waiter5_q[p]),
        .later_valid_i (later5_q[p] || (refused_noted && refused_port_q == port_t'(p))),
        .later_waiter_i(later5_q[p] ? waiter5_q[p] : refused_waiter_q),
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

  mshrs_t hit_lines;  // those that were looked up
  always_comb begin
    hit_lines = '0;
    for (int unsigned p = 0; p < Ports; p++) if (look3_q[p]) hit_lines |= same3_q[p];
  end
  always_ff @(posedge clk_i) begin
    lease_q <= lease_q + 1'b1;
    keep_q  <= lease_q[LeaseBits-1-:2] == '1;

    if (lease_q == '0) fresh_q <= '0;
    else fresh_q <= fresh_q & ~hit_lines;
    if (allocate) begin
      active_q[free_q]   <= 1'b1;
      fresh_q[free_q]    <= 1'b0;
      need_q[free_q]     <= 1'b1;
      error_q[free_q]    <= 1'b0;
      mshr_key_q[free_q] <= on_key_q;
      way_q[free_q]      <= victim;
      beat_q[free_q]     <= '0;
    end

    ending_q       <= fill_valid_q && fill_last_q && rst_ni;
    ending_mshr_q  <= fill_mshr_q;
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
    end

    if (fetch_load) need_q[need_mshr] <= 1'b0;
    if (!rst_ni) begin
      active_q <= '0;
      fresh_q  <= '0;
      need_q   <= '0;
      done_q   <= 1'b0;
      lease_q  <= '0;
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

  typedef struct packed {
    logic [Ways-1:0][Banks-1:0] banks;
    logic [AddrBits-1:0]        addr;
    logic [DataBits-1:0]        data;
  } data_write_t;
  data_write_t write_q;
  data_write_t [Ports-1:0] port_write;
  always_ff @(posedge clk_i) begin
    write_q.addr <= word_address(mshr_key_q[fill_mshr_q][SetBits-1:0], SelectBits'(int'(fill_beat) / Banks));
    write_q.data <= fill_data_q;
    for (int unsigned w = 0; w < Ways; w++) begin
      for (int unsigned b = 0; b < Banks; b++) write_q.banks[w][b] <= fill_valid_q && way_q[fill_mshr_q] == 1'(w) && int'(fill_beat) % Banks == int'(b);
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
    logic [Ports-1:0] hit4_q, way4_q;
    logic             used_write_q, used_way_q;
    set_t             used_set_q;
    // Noted when it suits: which way is older is no more than a good guess.
    always_ff @(posedge clk_i) begin
      for (int unsigned p = 0; p < Ports; p++) begin
        hit4_q[p] <= way_hit_q[p] != '0;
        way4_q[p] <= way_hit_q[p][Ways-1];
      end
      used_write_q <= allocate || hit4_q != '0;
      used_set_q   <= on_key_q[SetBits-1:0];
      used_way_q   <= victim;
      if (!allocate) begin
        for (int unsigned p = 0; p < Ports; p++) begin
          if (hit4_q[p]) begin
            used_set_q <= key4_q[p][SetBits-1:0];
            used_way_q <= way4_q[p];
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
        .write_en_i  (used_write_q),
        .write_addr_i(used_set_q),
        .write_data_i(!used_way_q),
        .read_en_i   (on_valid),
        .read_addr_i (on_key[SetBits-1:0]),
        .read_data_o (older)
    );
  end else begin : gen_only
    assign older = 1'b0;
  end

  `RT_ASSERT(FillIsExpected, !fill_valid_q || active_q[fill_mshr_q])
  `RT_ASSERT(FillHasItsLength, !fill_valid_q || fill_last_q || fill_beat != BeatBits'(FillBeats - 1))
  `RT_ASSERT(OneWay, !look3_q[0] || $onehot0(way_hit_q[0]))
  `RT_ASSERT(FlushWhenIdle, !flushing_o || (active_q == '0 && look1_q == '0 && look2_q == '0 && look3_q == '0 && miss4_q == '0))
endmodule
