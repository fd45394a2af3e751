// Reference unit: sends the references of a leaf to the triangle test, one for each pick, in order.
//
// Purpose     One context a clock: I0 pick   I1 which reference; list look-up   I2 list answers   I3 checks, mailbox; triangle look-up
//             I4 cache answers   I5 enter rt_tri_test, note that the reference is done. A context with references left becomes ready again.
// Order       The pipe of rt_tri_test keeps the order, so the last thing a context sends (its last test, or a bubble that carries why there
//             is none) tells the result unit that all results are in. Tests of an any-hit ray that already has its hit are not sent.
// Misses      Parked in the list or triangle cache and picked again; nothing is noted until I5 but the index, once it is known.
// Statuses    As step_test in hls/top/trace.cpp orders them: step limit, list index, triangle index.
// Mailbox     The last triangles tested for this ray; a reference to one of them counts as a step and is skipped.
// Source      Amanatides & Woo 1987 (mailbox).
`include "rt_assert.svh"
module rt_reference_unit #(
    parameter rt_core_pkg::config_t Config = rt_core_pkg::ConfigEcp5,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts),
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                                 clk_i,
    input  logic                                 rst_ni,
    input  logic                                 flush_i,
    input  rt_core_pkg::image_view_t             view_i,
    input  logic                                 mailbox_i,
    // A new ray.
    input  logic                                 ray_valid_i,
    input  logic [ContextBits-1:0]               ray_context_i,
    input  rt_core_pkg::test_ray_t               ray_i,
    // Leaves: references, then (later) the word that the context may start.
    input  logic                                 references_valid_i,
    input  logic [ContextBits-1:0]               references_context_i,
    input  rt_core_pkg::references_t             references_i,
    input  logic                                 in_valid_i,
    input  logic [ContextBits-1:0]               in_context_i,
    // Contexts that have a hit.
    input  logic [Contexts-1:0]                  has_hit_i,
    // To rt_tri_test; valid only with ready (the context is replayed otherwise).
    output logic                                 out_valid_o,
    input  logic                                 out_ready_i,
    output rt_contract_pkg::tri_test_in_record_t out_data_o,
    output logic [ContextBits-1:0]               out_context_o,
    output logic                                 out_test_o,   // a test, otherwise a bubble
    output logic                                 out_last_o,
    output rt_contract_pkg::status_t             out_event_o,
    output logic                                 list_fetch_valid_o,
    input  logic                                 list_fetch_ready_i,
    output logic [23:0]                          list_fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]   list_fetch_mshr_o,
    input  logic                                 list_fill_valid_i,
    output logic                                 triangle_fetch_valid_o,
    input  logic                                 triangle_fetch_ready_i,
    output logic [23:0]                          triangle_fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]   triangle_fetch_mshr_o,
    input  logic                                 triangle_fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0]   fill_mshr_i,
    input  logic [DataBits-1:0]                  fill_data_i,
    input  logic                                 fill_last_i,
    input  logic                                 fill_error_i,
    output rt_core_pkg::unit_events_t            events_o,  // hit and miss of the triangle cache
    output logic                                 list_hit_o,
    output logic                                 list_miss_o,
    output logic                                 skipped_o
);
  localparam int unsigned TriangleBits = rt_contract_pkg::TriangleUsedBits;
  localparam int unsigned EntryBits = 32;
  localparam int unsigned WordEntries = DataBits / EntryBits;
  localparam int unsigned WordEntryBits = $clog2(WordEntries);
  localparam int unsigned LineWords = 512 / DataBits;
  localparam int unsigned LineWordBits = $clog2(LineWords);
  localparam int unsigned LineEntryBits = WordEntryBits + LineWordBits;
  localparam int unsigned ListKeyBits = rt_contract_pkg::ListIndexBits - LineEntryBits;
  `RT_ASSERT_INIT(ListKeyMatchesPort, ListKeyBits == 24)
  typedef logic [ContextBits-1:0] context_t;
  typedef rt_contract_pkg::status_t status_t;

  logic [Contexts-1:0] ready_q, ready_d, first_q, first_d, error_q, error_d, picked;
  logic [Contexts-1:0] list_wake, list_wake_error, triangle_wake, triangle_wake_error;
  logic                pick_valid;
  context_t            pick;
  rt_pick #(
      .Count(Contexts)
  ) u_pick (
      .clk_i,
      .rst_ni,
      .pool_i  (ready_q),
      .take_i  (1'b1),
      .valid_o (pick_valid),
      .onehot_o(picked),
      .index_o (pick)
  );

  // --- I1: which reference ---
  logic                            i1_valid_q, i1_first_q, i1_error_q;
  context_t                        i1_context_q;
  rt_contract_pkg::triangle_index_t i1_stored, i1_next, i1_inline, i1_resolved;
  logic                             i1_resolved_q;
  rt_core_pkg::references_t        i1_refs;
  logic                            i1_from_list, i1_list_look;
  logic [31:0]                     i1_entry;
  status_t                         i1_event;

  assign i1_next      = i1_first_q ? '0 : i1_stored;
  assign i1_from_list = !i1_resolved_q && i1_next >= 24'(rt_contract_pkg::LeafInline);
  assign i1_entry     = 32'(i1_refs.list_base) + 32'(i1_next) - 32'(rt_contract_pkg::LeafInline);
  always_comb begin
    i1_inline = i1_refs.refs[0];
    for (int unsigned i = 1; i < rt_contract_pkg::LeafInline; i++) begin
      if (i1_next == 24'(i)) i1_inline = i1_refs.refs[i];
    end
    if (i1_resolved_q) i1_inline = i1_resolved;
    i1_event = rt_core_pkg::EventGoOn;
    if (i1_error_q) i1_event = status_t'(rt_contract_pkg::StatusBusError);
    else if (i1_refs.steps + 32'(i1_next) >= view_i.step_limit) i1_event = status_t'(rt_contract_pkg::StatusStepLimit);
    else if (i1_from_list && i1_entry >= view_i.list_count) i1_event = status_t'(rt_contract_pkg::StatusBadIndex);
  end
  assign i1_list_look = i1_valid_q && i1_from_list && i1_event == rt_core_pkg::EventGoOn;

  // --- I2: the list answers ---
  logic                             i2_valid_q, i2_list_look, i2_list_hit, i2_from_list_q;
  context_t                         i2_context_q;
  status_t                          i2_event_q;
  rt_contract_pkg::triangle_index_t i2_inline_q, i2_next_q, i2_count_q;
  logic [WordEntryBits-1:0]         i2_entry_q;
  logic [DataBits-1:0]              i2_list_word;
  logic [EntryBits-1:0]             i2_entries[WordEntries];

  rt_cache #(
      .Lines       (Config.list_lines),
      .Ways        (Config.ways),
      .KeyBits     (ListKeyBits),
      .DataBits    (DataBits),
      .WordBits    (DataBits),
      .WordsPerLine(LineWords),
      .Mshrs       (4),
      .Waiters     (Contexts)
  ) u_list (
      .clk_i,
      .rst_ni,
      .flush_i,
      .req_valid_i  (i1_list_look),
      .req_key_i    (i1_entry[LineEntryBits+:ListKeyBits]),
      .req_word_i   (i1_entry[WordEntryBits+:LineWordBits]),
      .req_waiter_i (i1_context_q),
      .rsp_valid_o  (i2_list_look),
      .rsp_hit_o    (i2_list_hit),
      .rsp_data_o   (i2_list_word),
      .wake_o       (list_wake),
      .wake_error_o (list_wake_error),
      .fetch_valid_o(list_fetch_valid_o),
      .fetch_ready_i(list_fetch_ready_i),
      .fetch_key_o  (list_fetch_key_o),
      .fetch_mshr_o (list_fetch_mshr_o),
      .miss_o       (list_miss_o),
      .fill_valid_i (list_fill_valid_i),
      .fill_mshr_i,
      .fill_data_i,
      .fill_last_i,
      .fill_error_i
  );
  for (genvar i = 0; i < int'(WordEntries); i++) begin : gen_entry
    assign i2_entries[i] = i2_list_word[i*EntryBits+:EntryBits];
  end

  // --- I3: checks, mailbox, triangle ---
  logic                             i3_valid_q;
  context_t                         i3_context_q;
  status_t                          i3_event_q, i3_event;
  logic [EntryBits-1:0]             i3_index_q;
  rt_contract_pkg::triangle_index_t i3_next_q, i3_count_q;
  logic                             i3_known, i3_killed, i3_look;
  logic [Contexts-1:0]              any_q;  // rays that any hit will do for

  assign i3_killed = any_q[i3_context_q] && has_hit_i[i3_context_q];
  always_comb begin
    i3_event = i3_event_q;
    if (i3_killed) i3_event = rt_core_pkg::EventFinish;
    else if (i3_event_q == rt_core_pkg::EventGoOn && i3_index_q >= view_i.triangle_count) begin
      i3_event = status_t'(rt_contract_pkg::StatusBadIndex);
    end
  end
  assign i3_look = i3_valid_q && i3_event == rt_core_pkg::EventGoOn && !i3_known;

  // --- I4: the triangle is there ---
  logic                             i4_valid_q, i4_look, i4_hit, i4_known_q;
  context_t                         i4_context_q;
  status_t                          i4_event_q;
  rt_contract_pkg::triangle_index_t i4_index_q, i4_next_q, i4_count_q;
  logic [TriangleBits-1:0]          i4_triangle;
  rt_core_pkg::test_ray_t           i4_ray;

  rt_cache #(
      .Lines       (Config.triangle_lines),
      .Ways        (Config.ways),
      .KeyBits     (rt_contract_pkg::TriangleIndexBits),
      .DataBits    (DataBits),
      .WordBits    (TriangleBits),
      .WordsPerLine(1),
      .Mshrs       (Config.mshrs),
      .Waiters     (Contexts)
  ) u_triangle (
      .clk_i,
      .rst_ni,
      .flush_i,
      .req_valid_i  (i3_look),
      .req_key_i    (i3_index_q[23:0]),
      .req_word_i   (1'b0),
      .req_waiter_i (i3_context_q),
      .rsp_valid_o  (i4_look),
      .rsp_hit_o    (i4_hit),
      .rsp_data_o   (i4_triangle),
      .wake_o       (triangle_wake),
      .wake_error_o (triangle_wake_error),
      .fetch_valid_o(triangle_fetch_valid_o),
      .fetch_ready_i(triangle_fetch_ready_i),
      .fetch_key_o  (triangle_fetch_key_o),
      .fetch_mshr_o (triangle_fetch_mshr_o),
      .miss_o       (events_o.miss),
      .fill_valid_i (triangle_fill_valid_i),
      .fill_mshr_i,
      .fill_data_i,
      .fill_last_i,
      .fill_error_i
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_core_pkg::test_ray_t)
  ) u_ray (
      .clk_i,
      .rst_ni,
      .write_en_i  (ray_valid_i),
      .write_addr_i(ray_context_i),
      .write_data_i(ray_i),
      .read_en_i   (i3_valid_q),
      .read_addr_i (i3_context_q),
      .read_data_o (i4_ray)
  );
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_core_pkg::references_t)
  ) u_references (
      .clk_i,
      .rst_ni,
      .write_en_i  (references_valid_i),
      .write_addr_i(references_context_i),
      .write_data_i(references_i),
      .read_en_i   (pick_valid),
      .read_addr_i (pick),
      .read_data_o (i1_refs)
  );

  // --- I5: send and note ---
  logic                              i5_valid_q, i5_known_q, i5_send, i5_done, i5_last, i5_replay;
  context_t                          i5_context_q;
  status_t                           i5_event_q;
  rt_contract_pkg::triangle_index_t  i5_index_q, i5_next_q, i5_count_q, i5_after;
  rt_contract_pkg::triangle_record_t i5_triangle_q;
  rt_core_pkg::test_ray_t            i5_ray_q;

  assign i5_after = i5_next_q + 1'b1;
  assign i5_last  = i5_event_q != rt_core_pkg::EventGoOn || i5_after == i5_count_q;
  // A skipped reference in the middle of a leaf sends nothing.
  assign i5_send   = i5_valid_q && (!i5_known_q || i5_last);
  assign i5_replay = i5_send && !out_ready_i;
  assign i5_done   = i5_valid_q && !i5_replay;

  always_comb begin
    out_data_o            = '0;
    out_data_o.u          = i5_triangle_q.u;
    out_data_o.v          = i5_triangle_q.v;
    out_data_o.n          = i5_triangle_q.n;
    out_data_o.offset_u   = i5_triangle_q.offset_u;
    out_data_o.offset_v   = i5_triangle_q.offset_v;
    out_data_o.offset_n   = i5_triangle_q.offset_n;
    out_data_o.exponent_u = i5_triangle_q.exponent_u;
    out_data_o.exponent_v = i5_triangle_q.exponent_v;
    out_data_o.id         = i5_triangle_q.id;
    out_data_o.origin     = i5_ray_q.origin;
    out_data_o.direction  = i5_ray_q.direction;
  end
  assign out_valid_o   = i5_send && out_ready_i;
  assign out_context_o = i5_context_q;
  assign out_test_o    = i5_event_q == rt_core_pkg::EventGoOn && !i5_known_q;
  assign out_last_o    = i5_last;
  assign out_event_o   = i5_event_q;

  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_contract_pkg::triangle_index_t)
  ) u_next (
      .clk_i,
      .rst_ni,
      .write_en_i  (i5_done),
      .write_addr_i(i5_context_q),
      .write_data_i(i5_after),
      .read_en_i   (pick_valid),
      .read_addr_i (pick),
      .read_data_o (i1_stored)
  );

  // The index of a reference whose triangle has been missed: the list need not be read again.
  logic [Contexts-1:0] resolved_q;
  logic                i4_missed;
  assign i4_missed = i4_valid_q && i4_look && !i4_hit;
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_contract_pkg::triangle_index_t)
  ) u_resolved (
      .clk_i,
      .rst_ni,
      .write_en_i  (i4_missed),
      .write_addr_i(i4_context_q),
      .write_data_i(i4_index_q),
      .read_en_i   (pick_valid),
      .read_addr_i (pick),
      .read_data_o (i1_resolved)
  );
  always_ff @(posedge clk_i) begin
    if (i4_missed) resolved_q[i4_context_q] <= 1'b1;
    if (i5_done) resolved_q[i5_context_q] <= 1'b0;
    if (in_valid_i) resolved_q[in_context_i] <= 1'b0;
    if (!rst_ni) resolved_q <= '0;
  end

  // --- mailbox ---
  if (Config.mail_entries > 0) begin : gen_mailbox
    localparam int unsigned CountBits = $clog2(Config.mail_entries + 1);
    typedef struct packed {
      logic [CountBits-1:0]                                 used;
      rt_contract_pkg::triangle_index_t [Config.mail_entries-1:0] index;  // the newest first
    } mail_t;
    mail_t               i3_stored, i3_mail, i4_mail_q, i5_mail_q, i5_mail;
    logic [Contexts-1:0] fresh_q;  // nothing tested for this ray

    assign i3_mail = fresh_q[i3_context_q] ? '0 : i3_stored;
    always_comb begin
      i3_known = 1'b0;
      for (int unsigned i = 0; i < Config.mail_entries; i++) begin
        if (mailbox_i && i3_mail.used > CountBits'(i) && 32'(i3_mail.index[i]) == i3_index_q) i3_known = 1'b1;
      end
      i5_mail.index = {i5_mail_q.index[Config.mail_entries-2:0], i5_index_q};
      i5_mail.used  = i5_mail_q.used == CountBits'(Config.mail_entries) ? i5_mail_q.used : i5_mail_q.used + 1'b1;
    end
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(mail_t)
    ) u_mail (
        .clk_i,
        .rst_ni,
        .write_en_i  (mailbox_i && i5_done && out_test_o),
        .write_addr_i(i5_context_q),
        .write_data_i(i5_mail),
        .read_en_i   (mailbox_i && i2_valid_q),
        .read_addr_i (i2_context_q),
        .read_data_o (i3_stored)
    );
    always_ff @(posedge clk_i) begin
      i4_mail_q <= i3_mail;
      i5_mail_q <= i4_mail_q;
      if (ray_valid_i) fresh_q[ray_context_i] <= 1'b1;
      if (i5_done && out_test_o) fresh_q[i5_context_q] <= 1'b0;
    end
  end else begin : gen_no_mailbox
    assign i3_known = 1'b0;
  end

  always_comb begin
    ready_d = (ready_q & ~picked) | list_wake | triangle_wake;
    if (i5_replay || (i5_done && !i5_last)) ready_d[i5_context_q] = 1'b1;
    if (in_valid_i) ready_d[in_context_i] = 1'b1;
    first_d = first_q;
    if (i5_done) first_d[i5_context_q] = 1'b0;
    if (in_valid_i) first_d[in_context_i] = 1'b1;
    error_d = (error_q & ~picked) | list_wake_error | triangle_wake_error;
  end

  always_ff @(posedge clk_i) begin
    ready_q        <= ready_d;
    first_q        <= first_d;
    error_q        <= error_d;
    i1_valid_q     <= pick_valid;
    i1_context_q   <= pick;
    i1_first_q     <= (first_q & picked) != '0;
    i1_error_q     <= (error_q & picked) != '0;
    i1_resolved_q  <= (resolved_q & picked) != '0;
    i2_valid_q     <= i1_valid_q;
    i2_context_q   <= i1_context_q;
    i2_event_q     <= i1_event;
    i2_inline_q    <= i1_inline;
    i2_from_list_q <= i1_from_list;
    i2_entry_q     <= i1_entry[WordEntryBits-1:0];
    i2_next_q      <= i1_next;
    i2_count_q     <= i1_refs.count;
    i3_valid_q     <= i2_valid_q && (!i2_list_look || i2_list_hit);
    i3_context_q   <= i2_context_q;
    i3_event_q     <= i2_event_q;
    i3_index_q     <= i2_from_list_q ? i2_entries[i2_entry_q] : EntryBits'(i2_inline_q);
    i3_next_q      <= i2_next_q;
    i3_count_q     <= i2_count_q;
    i4_valid_q     <= i3_valid_q;
    i4_context_q   <= i3_context_q;
    i4_event_q     <= i3_event;
    i4_known_q     <= i3_known && i3_event == rt_core_pkg::EventGoOn;
    i4_index_q     <= i3_index_q[23:0];
    i4_next_q      <= i3_next_q;
    i4_count_q     <= i3_count_q;
    i5_valid_q     <= i4_valid_q && (!i4_look || i4_hit);
    i5_context_q   <= i4_context_q;
    i5_event_q     <= i4_event_q;
    i5_known_q     <= i4_known_q;
    i5_index_q     <= i4_index_q;
    i5_next_q      <= i4_next_q;
    i5_count_q     <= i4_count_q;
    i5_triangle_q  <= i4_triangle;
    i5_ray_q       <= i4_ray;
    if (ray_valid_i) any_q[ray_context_i] <= ray_i.any;
    if (!rst_ni) begin
      ready_q    <= '0;
      first_q    <= '0;
      error_q    <= '0;
      i1_valid_q <= 1'b0;
      i2_valid_q <= 1'b0;
      i3_valid_q <= 1'b0;
      i4_valid_q <= 1'b0;
      i5_valid_q <= 1'b0;
    end
  end

  assign events_o.hit     = i4_look && i4_hit;
  assign events_o.busy    = i5_done;
  assign events_o.starved = !pick_valid;
  assign list_hit_o       = i2_list_look && i2_list_hit;
  assign skipped_o        = i5_done && i5_known_q;

  `RT_ASSERT(WakesNobodyTwice, ((list_wake | triangle_wake) & ready_q) == '0)
endmodule
