// SPDX-License-Identifier: Apache-2.0
// Reference unit: sends the references of a leaf to the triangle test, one for each turn of a context, in order.
//
// Purpose     One context a clock: I0 read   I1 what is stored   I2 which reference; list look-up   I3, I4 -   I5 list answers
//             I6 checks, mailbox; triangle look-up   I7, I8 -   I9 cache answers; enter rt_tri_test, note that the reference is done.
//             A context with references left becomes ready again.
// Order       The pipe of rt_tri_test keeps the order, so the last thing a context sends (its last test, or a bubble that carries why there
//             is none) tells the result unit that all results are in. Tests of an any-hit ray that already has its hit are not sent.
// Misses      Parked in the list or triangle cache and woken; nothing is noted until I9 but the index, once it is known.
// Statuses    As step_test in hls/top/trace.cpp orders them: step limit, list index, triangle index.
// Instances   A reference of a leaf of instances that is not in their mailbox, and not that of the best hit, whose object has been searched to its end,
//             goes to rt_entry with its record, and the context with it: it comes back when the object's box is passed by (next_*), or with the leaf,
//             which says which reference is the first. Instance records share the cache of the triangles; a bit of the key tells them apart.
// Mailbox     The last triangles tested for this ray, or for its ray in this object; a reference to one of them counts as a step and is skipped.
// Source      Amanatides & Woo 1987 (mailbox).
`include "rt_assert.svh"
module rt_reference_unit #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigEcp5,
    localparam int unsigned Levels = Config.levels,
    localparam int unsigned RecordKeyBits = rt_contract_pkg::TriangleIndexBits + Levels - 1,
    localparam int unsigned Contexts = Config.lanes * Config.contexts_per_lane,
    localparam int unsigned ContextBits = $clog2(Contexts),
    localparam int unsigned DataBits = Config.data_bits
) (
    input  logic                                 clk_i,
    input  logic                                 rst_ni,
    input  logic                                 flush_i,
    output logic                                 flushing_o,
    input  logic                                 hold_i,   // age (rt_context_pipe)
    output logic                                 empty_o,
    input  rt_core_pkg::image_view_t             view_i,
    input  logic                                 mailbox_i,
    // An axis of a new ray, and the new ray.
    input  logic                                 axis_valid_i,
    input  logic [1:0]                           axis_number_i,
    input  logic                                 axis_level_i,
    input  rt_core_pkg::test_axis_t              axis_i,
    input  logic                                 ray_valid_i,
    input  logic                                 ray_any_i,
    input  rt_contract_pkg::t_limit_t            ray_t_max_i,
    input  logic [ContextBits-1:0]               ray_context_i,
    // Leaves: references, then (later) the word that the context may start.
    input  logic                                 references_valid_i,
    input  logic [ContextBits-1:0]               references_context_i,
    input  rt_core_pkg::references_t             references_i,
    input  logic                                 in_valid_i,
    input  logic [ContextBits-1:0]               in_context_i,
    // Contexts that go on with the leaf after a reference that rt_entry had.
    input  logic                                 next_valid_i,
    output logic                                 next_ready_o,
    input  logic [ContextBits-1:0]               next_context_i,
    // A context enters an object.
    input  logic                                 entered_valid_i,
    input  logic [ContextBits-1:0]               entered_context_i,
    // Contexts that have a hit, and the best hit when there is a better one.
    input  logic [Contexts-1:0]                  has_hit_i,
    input  logic                                 found_valid_i,
    input  logic [ContextBits-1:0]               found_context_i,
    input  rt_core_pkg::found_t                  found_i,
    // To rt_tri_test; valid only with ready (the context is replayed otherwise).
    output logic                                 out_valid_o,
    input  logic                                 out_ready_i,
    output rt_contract_pkg::tri_test_in_record_t out_data_o,
    output logic [ContextBits-1:0]               out_context_o,
    output logic                                 out_test_o,   // a test, otherwise a bubble
    output logic                                 out_last_o,
    output rt_contract_pkg::status_t             out_event_o,
    // To rt_entry; valid only with ready.
    output logic                                        enter_valid_o,
    input  logic                                        enter_ready_i,
    output rt_contract_pkg::instance_enter_in_record_t  enter_data_o,
    output logic [ContextBits-1:0]                      enter_context_o,
    output rt_core_pkg::entry_t                         enter_o,
    output logic                                        enter_refused_o,  // one that found it full and comes again
    output logic                                 list_fetch_valid_o,
    input  logic                                 list_fetch_ready_i,
    output logic [23:0]                          list_fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]   list_fetch_mshr_o,
    input  logic                                 list_fill_valid_i,
    output logic                                 triangle_fetch_valid_o,
    input  logic                                 triangle_fetch_ready_i,
    output logic [RecordKeyBits-1:0]             triangle_fetch_key_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]   triangle_fetch_mshr_o,
    input  logic                                 triangle_fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0]   fill_mshr_i,
    input  logic [DataBits-1:0]                  fill_data_i,
    input  logic                                 fill_last_i,
    input  logic                                 fill_error_i,
    output rt_core_pkg::unit_events_t            events_o,  // hit and miss of the triangle cache
    output logic                                 list_hit_o,
    output logic                                 list_miss_o,
    output logic                                 skipped_o,
    output logic                                 idle_o  // no context is here, no read is in flight
);
  localparam int unsigned RecordBits = Levels > 1 ? rt_contract_pkg::InstanceUsedBits : rt_contract_pkg::TriangleUsedBits;
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
  // What is kept of a leaf. The limit of steps and the end of the list are kept as the first reference that is beyond; 2^24 where none is.
  localparam int unsigned LimitBits = rt_contract_pkg::TriangleIndexBits + 1;
  typedef logic [LimitBits-1:0] limit_t;
  typedef struct packed {
    logic signed [rt_contract_pkg::ListIndexBits:0]                     before_list;  // list_base - LeafInline
    limit_t                                                             steps_end;
    limit_t                                                             list_end;
    rt_contract_pkg::triangle_index_t                                   count;
    rt_contract_pkg::triangle_index_t [rt_contract_pkg::LeafInline-1:0] refs;
  } kept_t;
  // How far a context is: the next reference of its leaf, and the next entry of its mailbox.
  localparam int unsigned MailBits = Config.mail_entries > 1 ? $clog2(Config.mail_entries) : 1;
  `RT_ASSERT_INIT(MailPowerOfTwo, Config.mail_entries == 0 || Config.mail_entries == (1 << MailBits))
  typedef struct packed {
    logic                full;  // all entries are used; otherwise those below `at`
    logic [MailBits-1:0] at;
  } mail_t;
  typedef struct packed {
    rt_contract_pkg::triangle_index_t next;
    mail_t                            mail;
  } progress_t;
  function automatic mail_t after_one(mail_t mail);
    return '{full: mail.full || mail.at == '1, at: mail.at + 1'b1};
  endfunction
  function automatic limit_t limit_of(logic signed [34:0] left);
    if (left <= 35'sd0) return '0;
    if (left >= 35'sd1 <<< (LimitBits - 1)) return limit_t'(1) << (LimitBits - 1);
    return limit_t'(left);
  endfunction

  // --- who is ready, and where (the pipe is at the end) ---
  localparam int unsigned Stages = 10;
  localparam int unsigned FromList = 0;
  localparam int unsigned FromTriangle = 1;
  localparam int unsigned Wakes = 2;
  logic [Stages-1:0]     stage_valid, stage_error, park;
  context_t [Stages-1:0] stage_context;
  logic                  pipe_idle, list_idle, triangle_idle;
  logic [Wakes-1:0]      wake_valid, wake_ready, wake_error;
  context_t [Wakes-1:0]  wake_context;
  logic [Contexts-1:0]   first_q;  // nothing of the leaf is done
  logic [Contexts-1:0]   fresh_q;  // nothing is done for the ray
  // --- I1: what is stored ---
  logic                             i1_first_q, i1_fresh_q, i1_resolved_q;
  progress_t                        i1_stored;
  rt_contract_pkg::triangle_index_t i1_resolved;
  kept_t                            i1_refs;

  // --- two levels: of what a leaf refers to, and what is known of the instance ---
  typedef struct packed {
    logic level;      // the ray that is tested
    logic instances;
  } kind_t;
  kind_t                            i6_kind, i7_kind, i9_kind;
  rt_contract_pkg::triangle_index_t i1_first;
  logic                             i6_instance_known, i9_enters;

  // --- I2: which reference ---
  logic                             i2_resolved_q;
  mail_t                            i2_mail_q, i3_mail_q, i4_mail_q, i5_mail_q, i6_mail_q, i7_mail_q, i8_mail_q, i9_mail_q, done_mail_q;
  rt_contract_pkg::triangle_index_t i2_next_q, i2_known_index_q, i2_inline;
  kept_t                            i2_refs_q;
  logic                             i2_from_list, i2_list_look;
  logic [31:0]                      i2_entry;
  status_t                          i2_event;

  assign i2_from_list = !i2_resolved_q && i2_next_q >= 24'(rt_contract_pkg::LeafInline);
  assign i2_entry     = 32'(i2_refs_q.before_list) + 32'(i2_next_q);
  always_comb begin
    i2_inline = i2_refs_q.refs[0];
    for (int unsigned i = 1; i < rt_contract_pkg::LeafInline; i++) begin
      if (i2_next_q == 24'(i)) i2_inline = i2_refs_q.refs[i];
    end
    if (i2_resolved_q) i2_inline = i2_known_index_q;
    i2_event = rt_core_pkg::EventGoOn;
    if (stage_error[2]) i2_event = status_t'(rt_contract_pkg::StatusBusError);
    else if (LimitBits'(i2_next_q) >= i2_refs_q.steps_end) i2_event = status_t'(rt_contract_pkg::StatusStepLimit);
    else if (i2_from_list && LimitBits'(i2_next_q) >= i2_refs_q.list_end) i2_event = status_t'(rt_contract_pkg::StatusBadIndex);
  end
  assign i2_list_look = stage_valid[2] && i2_from_list && i2_event == rt_core_pkg::EventGoOn;

  // --- I3 to I5: the list answers ---
  logic                             i3_from_list_q, i4_from_list_q, i5_from_list_q, i5_list_look, i5_list_hit;
  status_t                          i3_event_q, i4_event_q, i5_event_q;
  rt_contract_pkg::triangle_index_t i3_inline_q, i3_after_q, i3_count_q, i4_inline_q, i4_after_q, i5_inline_q, i5_after_q;
  logic                             i4_final_q, i5_final_q;  // the last of its leaf
  logic [WordEntryBits-1:0]         i3_entry_q, i4_entry_q, i5_entry_q;
  logic [DataBits-1:0]              i5_list_word;
  logic [EntryBits-1:0]             i5_entries[WordEntries];
  logic                             list_flushing, triangle_flushing;
  assign flushing_o = list_flushing || triangle_flushing;

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
      .flushing_o   (list_flushing),
      .keep_i       (hold_i),
      .req_valid_i  (i2_list_look),
      .req_key_i    (i2_entry[LineEntryBits+:ListKeyBits]),
      .req_word_i   (i2_entry[WordEntryBits+:LineWordBits]),
      .req_waiter_i (stage_context[2]),
      .rsp_valid_o  (i5_list_look),
      .rsp_hit_o    (i5_list_hit),
      .rsp_data_o   (i5_list_word),
      .wake_valid_o (wake_valid[FromList]),
      .wake_ready_i (wake_ready[FromList]),
      .wake_waiter_o(wake_context[FromList]),
      .wake_error_o (wake_error[FromList]),
      .fetch_valid_o(list_fetch_valid_o),
      .fetch_ready_i(list_fetch_ready_i),
      .fetch_key_o  (list_fetch_key_o),
      .fetch_mshr_o (list_fetch_mshr_o),
      .miss_o       (list_miss_o),
      .fill_valid_i (list_fill_valid_i),
      .fill_mshr_i,
      .fill_data_i,
      .fill_last_i,
      .fill_error_i,
      .idle_o       (list_idle)
  );
  for (genvar i = 0; i < int'(WordEntries); i++) begin : gen_entry
    assign i5_entries[i] = i5_list_word[i*EntryBits+:EntryBits];
  end

  // --- I6: checks, mailbox, triangle ---
  logic                             i6_killed_q, i6_final_q;
  status_t                          i6_event_q, i6_event;
  logic [EntryBits-1:0]             i6_index_q;
  rt_contract_pkg::triangle_index_t i6_after_q;
  logic                             i6_known, i6_in_mail, i6_look;
  logic                             i4_any, i5_any_q, i5_has_hit_q;

  always_comb begin
    i6_event = i6_event_q;
    if (i6_killed_q) i6_event = rt_core_pkg::EventFinish;
    else if (i6_event_q == rt_core_pkg::EventGoOn && i6_index_q >= (i6_kind.instances ? view_i.instance_count : view_i.triangle_count)) begin
      i6_event = status_t'(rt_contract_pkg::StatusBadIndex);
    end
  end
  assign i6_known = i6_kind.instances ? i6_instance_known : i6_in_mail;
  assign i6_look = stage_valid[6] && i6_event == rt_core_pkg::EventGoOn && !i6_known;

  // --- I7, I8: on the way; the ray is there in I8 ---
  logic                             i7_known_q, i7_final_q, i8_known_q, i8_final_q;
  status_t                          i7_event_q, i8_event_q;
  rt_contract_pkg::triangle_index_t i7_index_q, i7_after_q, i8_index_q, i8_after_q;

  // --- I9: the triangle is there: send and note ---
  logic                              i9_valid, i9_look, i9_hit, i9_missed;
  logic                              i9_known_q, i9_final_q, i9_send, i9_done, i9_last, i9_replay;
  status_t                           i9_event_q;
  rt_contract_pkg::triangle_index_t  i9_index_q, i9_after_q;
  logic [RecordBits-1:0]             i9_record;
  rt_contract_pkg::triangle_record_t i9_triangle;
  assign i9_triangle = i9_record[rt_contract_pkg::TriangleUsedBits-1:0];
  rt_core_pkg::test_ray_t            i9_ray_q;

  rt_cache #(
      .Lines       (Config.triangle_lines),
      .Ways        (Config.ways),
      .KeyBits     (RecordKeyBits),
      .DataBits    (DataBits),
      .WordBits    (RecordBits),
      .WordsPerLine(1),
      .ReadBeats   (rt_core_pkg::read_bytes(RecordBits / 8, Config.granule_bytes) * 8 / DataBits),
      .Mshrs       (Config.mshrs),
      .Waiters     (Contexts)
  ) u_triangle (
      .clk_i,
      .rst_ni,
      .flush_i,
      .flushing_o   (triangle_flushing),
      .keep_i       (hold_i),
      .req_valid_i  (i6_look),
      .req_key_i    (RecordKeyBits'({i6_kind.instances, i6_index_q[23:0]})),
      .req_word_i   (1'b0),
      .req_waiter_i (stage_context[6]),
      .rsp_valid_o  (i9_look),
      .rsp_hit_o    (i9_hit),
      .rsp_data_o   (i9_record),
      .wake_valid_o (wake_valid[FromTriangle]),
      .wake_ready_i (wake_ready[FromTriangle]),
      .wake_waiter_o(wake_context[FromTriangle]),
      .wake_error_o (wake_error[FromTriangle]),
      .fetch_valid_o(triangle_fetch_valid_o),
      .fetch_ready_i(triangle_fetch_ready_i),
      .fetch_key_o  (triangle_fetch_key_o),
      .fetch_mshr_o (triangle_fetch_mshr_o),
      .miss_o       (events_o.miss),
      .fill_valid_i (triangle_fill_valid_i),
      .fill_mshr_i,
      .fill_data_i,
      .fill_last_i,
      .fill_error_i,
      .idle_o       (triangle_idle)
  );
  rt_core_pkg::test_axis_t [rt_core_pkg::Axes-1:0] i8_axes;
  localparam int unsigned RayBits = $clog2(Levels * Contexts);
  rt_ray_ram #(
      .Contexts(Levels * Contexts),
      .axis_t  (rt_core_pkg::test_axis_t)
  ) u_ray (
      .clk_i,
      .rst_ni,
      .write_en_i     (axis_valid_i),
      .write_context_i(RayBits'({axis_level_i, ray_context_i})),
      .write_axis_i   (axis_number_i),
      .write_data_i   (axis_i),
      .read_en_i      (stage_valid[7]),
      .read_context_i (RayBits'({i7_kind.level, stage_context[7]})),
      .read_data_o    (i8_axes)
  );
  // What is noted of a reference is noted a clock later.
  logic                             done_q, done_missed_q, done_test_q;
  context_t                         done_context_q;
  rt_contract_pkg::triangle_index_t done_after_q, done_index_q;
  // The list begins behind the references in the record; before the first entry its base is negative. Kept a clock later.
  logic                     kept_valid_q;
  context_t                 kept_context_q;
  rt_core_pkg::references_t kept_q;
  logic signed [34:0]       steps_left_q, list_left_q;
  logic signed [rt_contract_pkg::ListIndexBits:0] before_list, before_list_q;
  kept_t                    kept;
  assign before_list = (rt_contract_pkg::ListIndexBits + 1)'(references_i.list_base) - (rt_contract_pkg::ListIndexBits + 1)'(rt_contract_pkg::LeafInline);
  always_ff @(posedge clk_i) begin
    kept_valid_q   <= references_valid_i && rst_ni;
    kept_context_q <= references_context_i;
    kept_q         <= references_i;
    before_list_q  <= before_list;
    steps_left_q   <= 35'(view_i.step_limit) - 35'(references_i.steps);
    list_left_q    <= 35'(view_i.list_count) - 35'(before_list);
  end
  assign kept = '{
          before_list: before_list_q,
          steps_end: limit_of(steps_left_q),
          list_end: limit_of(list_left_q),
          count: kept_q.count,
          refs: kept_q.refs
      };
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(kept_t)
  ) u_references (
      .clk_i,
      .rst_ni,
      .write_en_i  (kept_valid_q),
      .write_addr_i(kept_context_q),
      .write_data_i(kept),
      .read_en_i   (stage_valid[0]),
      .read_addr_i (stage_context[0]),
      .read_data_o (i1_refs)
  );

  // Without a look-up there is nothing to test; after a miss the cache has the context.
  assign i9_valid  = stage_valid[9] && !i9_missed;
  assign i9_missed = stage_valid[9] && i9_look && !i9_hit;
  assign i9_last   = i9_event_q != rt_core_pkg::EventGoOn || i9_final_q;
  // A skipped reference in the middle of a leaf sends nothing, and one that enters an object nothing to the test.
  assign i9_enters = i9_kind.instances && i9_event_q == rt_core_pkg::EventGoOn && !i9_known_q;
  assign i9_send   = i9_valid && !i9_enters && (!i9_known_q || i9_last);
  assign i9_replay = (i9_send && !out_ready_i) || (i9_valid && i9_enters && !enter_ready_i);
  assign i9_done   = i9_valid && !i9_replay;

  always_comb begin
    out_data_o            = '0;
    out_data_o.u          = i9_triangle.u;
    out_data_o.v          = i9_triangle.v;
    out_data_o.n          = i9_triangle.n;
    out_data_o.offset_u   = i9_triangle.offset_u;
    out_data_o.offset_v   = i9_triangle.offset_v;
    out_data_o.offset_n   = i9_triangle.offset_n;
    out_data_o.exponent_u = i9_triangle.exponent_u;
    out_data_o.exponent_v = i9_triangle.exponent_v;
    out_data_o.id         = i9_triangle.id;
    out_data_o.origin     = i9_ray_q.origin;
    out_data_o.direction  = i9_ray_q.direction;
  end
  assign out_valid_o   = i9_send && out_ready_i;
  assign out_context_o = stage_context[9];
  assign out_test_o    = i9_event_q == rt_core_pkg::EventGoOn && !i9_known_q && !i9_enters;
  assign out_last_o    = i9_last;
  assign out_event_o   = i9_event_q;

  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(progress_t)
  ) u_next (
      .clk_i,
      .rst_ni,
      .write_en_i  (done_q),
      .write_addr_i(done_context_q),
      .write_data_i('{next: done_after_q, mail: done_test_q ? after_one(done_mail_q) : done_mail_q}),
      .read_en_i   (stage_valid[0]),
      .read_addr_i (stage_context[0]),
      .read_data_o (i1_stored)
  );

  // The index of a reference whose triangle has been missed: the list need not be read again.
  logic [Contexts-1:0] resolved_q;
  rt_ram_sdp #(
      .Depth (Contexts),
      .data_t(rt_contract_pkg::triangle_index_t)
  ) u_resolved (
      .clk_i,
      .rst_ni,
      .write_en_i  (done_missed_q),
      .write_addr_i(done_context_q),
      .write_data_i(done_index_q),
      .read_en_i   (stage_valid[0]),
      .read_addr_i (stage_context[0]),
      .read_data_o (i1_resolved)
  );
  always_ff @(posedge clk_i) begin
    if (done_missed_q) resolved_q[done_context_q] <= 1'b1;
    if (done_q) resolved_q[done_context_q] <= 1'b0;
    if (in_valid_i) resolved_q[in_context_i] <= 1'b0;
    if (!rst_ni) resolved_q <= '0;
  end

  // --- mailbox ---
  if (Config.mail_entries > 0) begin : gen_mailbox
    // Entries are written one after the other, the oldest again when all are used.
    logic [Config.mail_entries-1:0] same;
    always_comb begin
      i6_in_mail = 1'b0;
      for (int unsigned i = 0; i < Config.mail_entries; i++) begin
        if (mailbox_i && same[i] && (i6_mail_q.full || i6_mail_q.at > MailBits'(i))) i6_in_mail = 1'b1;
      end
    end
    for (genvar i = 0; i < int'(Config.mail_entries); i++) begin : gen_entry
      rt_contract_pkg::triangle_index_t i5_stored, i6_stored_q;
      rt_ram_sdp #(
          .Depth (Contexts),
          .data_t(rt_contract_pkg::triangle_index_t)
      ) u_mail (
          .clk_i,
          .rst_ni,
          .write_en_i  (mailbox_i && done_q && done_test_q && done_mail_q.at == MailBits'(i)),
          .write_addr_i(done_context_q),
          .write_data_i(done_index_q),
          .read_en_i   (mailbox_i && stage_valid[4]),
          .read_addr_i (stage_context[4]),
          .read_data_o (i5_stored)
      );
      always_ff @(posedge clk_i) i6_stored_q <= i5_stored;
      assign same[i] = 32'(i6_stored_q) == i6_index_q;
    end
  end else begin : gen_no_mailbox
    assign i6_in_mail = 1'b0;
  end

  // --- instances ---
  if (Levels > 1) begin : gen_instances
    localparam int unsigned InstanceMails = 4;
    localparam int unsigned AtBits = $clog2(InstanceMails);
    typedef struct packed {
      logic              full;
      logic [AtBits-1:0] at;
    } instance_mail_t;
    kind_t                                              i1_kind, i2_kind_q, i3_kind_q, i4_kind_q, i5_kind_q, i6_kind_q, i7_kind_q, i8_kind_q, i9_kind_q;
    logic [Contexts-1:0]                                unmet_q;  // the ray has met no instance
    logic                                               i5_unmet_q, i6_has_hit_q, i7_plus_q, done_enters_q;
    instance_mail_t                                     i5_mail, i6_at_q, i7_at_q, i8_at_q, i9_at_q, done_at_q;
    logic [InstanceMails-1:0]                           same;
    rt_core_pkg::found_t                                i5_found, i6_found_q;
    rt_contract_pkg::t_limit_t                          i5_t_max, i6_t_max_q, i7_t_q;
    rt_contract_pkg::t_reach_t                          i8_reach_q, i9_reach_q;
    logic [31:0]                                        i8_steps, i9_steps_q;
    rt_contract_pkg::instance_record_t                  i9_instance;
    // Of the leaf.
    rt_ram_lut #(
        .Depth (Contexts),
        .data_t(kind_t)
    ) u_kind (
        .clk_i,
        .rst_ni,
        .write_en_i  (kept_valid_q),
        .write_addr_i(kept_context_q),
        .write_data_i('{level: kept_q.level, instances: kept_q.instances}),
        .read_addr_i (stage_context[1]),
        .read_data_o (i1_kind)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_contract_pkg::triangle_index_t)
    ) u_first (
        .clk_i,
        .rst_ni,
        .write_en_i  (kept_valid_q),
        .write_addr_i(kept_context_q),
        .write_data_i(kept_q.first),
        .read_en_i   (stage_valid[0]),
        .read_addr_i (stage_context[0]),
        .read_data_o (i1_first)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(logic [31:0])
    ) u_steps (
        .clk_i,
        .rst_ni,
        .write_en_i  (kept_valid_q),
        .write_addr_i(kept_context_q),
        .write_data_i(kept_q.steps),
        .read_en_i   (stage_valid[7]),
        .read_addr_i (stage_context[7]),
        .read_data_o (i8_steps)
    );
    // Of the ray: how far it goes, its best hit, the instances that it has met.
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_contract_pkg::t_limit_t)
    ) u_t_max (
        .clk_i,
        .rst_ni,
        .write_en_i  (ray_valid_i),
        .write_addr_i(ray_context_i),
        .write_data_i(ray_t_max_i),
        .read_en_i   (stage_valid[4]),
        .read_addr_i (stage_context[4]),
        .read_data_o (i5_t_max)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(rt_core_pkg::found_t)
    ) u_found (
        .clk_i,
        .rst_ni,
        .write_en_i  (found_valid_i),
        .write_addr_i(found_context_i),
        .write_data_i(found_i),
        .read_en_i   (stage_valid[4]),
        .read_addr_i (stage_context[4]),
        .read_data_o (i5_found)
    );
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(instance_mail_t)
    ) u_at (
        .clk_i,
        .rst_ni,
        .write_en_i  (done_q && done_enters_q),
        .write_addr_i(done_context_q),
        .write_data_i('{full: done_at_q.full || done_at_q.at == '1, at: done_at_q.at + 1'b1}),
        .read_en_i   (stage_valid[4]),
        .read_addr_i (stage_context[4]),
        .read_data_o (i5_mail)
    );
    for (genvar i = 0; i < int'(InstanceMails); i++) begin : gen_mail
      rt_contract_pkg::triangle_index_t i5_stored, i6_stored_q;
      rt_ram_sdp #(
          .Depth (Contexts),
          .data_t(rt_contract_pkg::triangle_index_t)
      ) u_mail (
          .clk_i,
          .rst_ni,
          .write_en_i  (done_q && done_enters_q && done_at_q.at == AtBits'(i)),
          .write_addr_i(done_context_q),
          .write_data_i(done_index_q),
          .read_en_i   (stage_valid[4]),
          .read_addr_i (stage_context[4]),
          .read_data_o (i5_stored)
      );
      always_ff @(posedge clk_i) i6_stored_q <= i5_stored;
      assign same[i] = i6_stored_q == i6_index_q[23:0];
    end
    always_comb begin
      i6_instance_known = i6_has_hit_q && i6_found_q.number == i6_index_q[23:0];
      for (int unsigned i = 0; i < InstanceMails; i++) begin
        if (Config.mail_entries > 0 && mailbox_i && same[i] && (i6_at_q.full || i6_at_q.at > AtBits'(i))) i6_instance_known = 1'b1;
      end
    end
    always_ff @(posedge clk_i) begin
      if (done_q && done_enters_q) unmet_q[done_context_q] <= 1'b0;
      if (ray_valid_i) unmet_q[ray_context_i] <= 1'b1;
      i5_unmet_q   <= unmet_q[stage_context[4]];
      i2_kind_q    <= i1_kind;
      i3_kind_q    <= i2_kind_q;
      i4_kind_q    <= i3_kind_q;
      i5_kind_q    <= i4_kind_q;
      i6_kind_q    <= i5_kind_q;
      i7_kind_q    <= i6_kind_q;
      i8_kind_q    <= i7_kind_q;
      i9_kind_q    <= i8_kind_q;
      i6_at_q      <= i5_unmet_q ? '0 : i5_mail;
      i7_at_q      <= i6_at_q;
      i8_at_q      <= i7_at_q;
      i9_at_q      <= i8_at_q;
      done_at_q    <= i9_at_q;
      done_enters_q <= i9_enters;
      i6_has_hit_q <= i5_has_hit_q;
      i6_found_q   <= i5_found;
      i6_t_max_q   <= i5_t_max;
      // At the same t an instance with a lower number wins.
      i7_plus_q    <= !i6_has_hit_q || i6_index_q[23:0] < i6_found_q.number;
      i7_t_q       <= i6_has_hit_q ? i6_found_q.t : i6_t_max_q;
      i8_reach_q   <= rt_contract_pkg::t_reach_t'(i7_t_q) + rt_contract_pkg::t_reach_t'(i7_plus_q);
      i9_reach_q   <= i8_reach_q;
      i9_steps_q   <= i8_steps + 32'(i8_after_q);
    end
    assign i6_kind     = i6_kind_q;
    assign i7_kind     = i7_kind_q;
    assign i9_kind     = i9_kind_q;
    assign i9_instance = i9_record;
    always_comb begin
      enter_data_o           = '0;
      enter_data_o.m         = i9_instance.m;
      enter_data_o.b         = i9_instance.b;
      enter_data_o.e         = i9_instance.e;
      enter_data_o.box       = i9_instance.box;
      enter_data_o.origin    = i9_ray_q.origin;
      enter_data_o.direction = i9_ray_q.direction;
      enter_data_o.reach     = i9_reach_q;
      enter_o = '{
          last: i9_final_q,
          next: i9_after_q,
          steps: i9_steps_q,
          number: i9_index_q,
          first_id: i9_instance.first_id,
          root: i9_instance.root
      };
    end
    assign enter_valid_o   = i9_valid && i9_enters && enter_ready_i;
    assign enter_refused_o = i9_valid && i9_enters && !enter_ready_i;
    assign enter_context_o = stage_context[9];
  end else begin : gen_no_instances
    assign i6_kind           = '0;
    assign i7_kind           = '0;
    assign i9_kind           = '0;
    assign i1_first          = '0;
    assign i6_instance_known = 1'b0;
    assign enter_valid_o     = 1'b0;
    assign enter_refused_o   = 1'b0;
    assign enter_data_o      = '0;
    assign enter_context_o   = '0;
    assign enter_o           = '0;
  end

  always_ff @(posedge clk_i) begin
    if (done_q) first_q[done_context_q] <= 1'b0;
    if (in_valid_i) first_q[in_context_i] <= 1'b1;
    if (done_q) fresh_q[done_context_q] <= 1'b0;
    if (ray_valid_i) fresh_q[ray_context_i] <= 1'b1;
    if (Levels > 1 && entered_valid_i) fresh_q[entered_context_i] <= 1'b1;
    i1_first_q       <= first_q[stage_context[0]];
    i1_fresh_q       <= fresh_q[stage_context[0]];
    i1_resolved_q    <= resolved_q[stage_context[0]];
    i2_resolved_q    <= i1_resolved_q;
    i2_next_q        <= i1_first_q ? i1_first : i1_stored.next;
    i2_mail_q        <= i1_fresh_q ? '0 : i1_stored.mail;
    i2_known_index_q <= i1_resolved;
    i2_refs_q        <= i1_refs;
    i3_mail_q        <= i2_mail_q;
    i3_event_q       <= i2_event;
    i3_inline_q      <= i2_inline;
    i3_from_list_q   <= i2_from_list;
    i3_entry_q       <= i2_entry[WordEntryBits-1:0];
    i3_after_q       <= i2_next_q + 1'b1;
    i3_count_q       <= i2_refs_q.count;
    i4_mail_q        <= i3_mail_q;
    i4_event_q       <= i3_event_q;
    i4_inline_q      <= i3_inline_q;
    i4_from_list_q   <= i3_from_list_q;
    i4_entry_q       <= i3_entry_q;
    i4_after_q       <= i3_after_q;
    i4_final_q       <= i3_after_q == i3_count_q;
    i5_mail_q        <= i4_mail_q;
    i5_event_q       <= i4_event_q;
    i5_inline_q      <= i4_inline_q;
    i5_from_list_q   <= i4_from_list_q;
    i5_entry_q       <= i4_entry_q;
    i5_after_q       <= i4_after_q;
    i5_final_q       <= i4_final_q;
    i6_mail_q        <= i5_mail_q;
    i5_any_q         <= i4_any;
    i5_has_hit_q     <= has_hit_i[stage_context[4]];
    i6_killed_q      <= i5_any_q && i5_has_hit_q;
    i6_event_q       <= i5_event_q;
    i6_index_q       <= i5_from_list_q ? i5_entries[i5_entry_q] : EntryBits'(i5_inline_q);
    i6_after_q       <= i5_after_q;
    i6_final_q       <= i5_final_q;
    i7_mail_q        <= i6_mail_q;
    i7_event_q       <= i6_event;
    i7_known_q       <= i6_known && i6_event == rt_core_pkg::EventGoOn;
    i7_index_q       <= i6_index_q[23:0];
    i7_after_q       <= i6_after_q;
    i7_final_q       <= i6_final_q;
    i8_mail_q        <= i7_mail_q;
    i8_event_q       <= i7_event_q;
    i8_known_q       <= i7_known_q;
    i8_index_q       <= i7_index_q;
    i8_after_q       <= i7_after_q;
    i8_final_q       <= i7_final_q;
    i9_mail_q        <= i8_mail_q;
    i9_event_q       <= i8_event_q;
    i9_known_q       <= i8_known_q;
    i9_index_q       <= i8_index_q;
    i9_after_q       <= i8_after_q;
    i9_final_q       <= i8_final_q;
    i9_ray_q         <= rt_core_pkg::test_ray_of(i8_axes);
    done_q           <= i9_done && rst_ni;
    done_missed_q    <= i9_missed && rst_ni;
    done_test_q      <= out_test_o;
    done_context_q   <= stage_context[9];
    done_mail_q      <= i9_mail_q;
    done_after_q     <= i9_after_q;
    done_index_q     <= i9_index_q;
  end

  // Rays that any hit will do for.
  rt_ram_lut #(
      .Depth (Contexts),
      .data_t(logic)
  ) u_any (
      .clk_i,
      .rst_ni,
      .write_en_i  (ray_valid_i),
      .write_addr_i(ray_context_i),
      .write_data_i(ray_any_i),
      .read_addr_i (stage_context[4]),
      .read_data_o (i4_any)
  );

  // --- the stages ---
  rt_context_pipe #(
      .Contexts(Contexts),
      .Stages  (Stages),
      .Wakes   (Wakes)
  ) u_pipe (
      .clk_i,
      .rst_ni,
      .hold_i,
      .go_i           (out_ready_i && (Levels == 1 || enter_ready_i)),
      .empty_o,
      .push_valid_i   (in_valid_i || (Levels > 1 && next_valid_i)),
      .push_context_i (in_valid_i || Levels == 1 ? in_context_i : next_context_i),
      .wake_valid_i   (wake_valid),
      .wake_ready_o   (wake_ready),
      .wake_context_i (wake_context),
      .wake_error_i   (wake_error),
      .stage_valid_o  (stage_valid),
      .stage_context_o(stage_context),
      .stage_error_o  (stage_error),
      .park_i         (park),
      .retry_i        (i9_replay),
      .again_i        (i9_done && !i9_last && !i9_enters),
      .idle_o         (pipe_idle)
  );
  assign next_ready_o = Levels > 1 && !in_valid_i;
  always_comb begin
    park    = '0;
    park[5] = i5_list_look && !i5_list_hit;
    park[9] = i9_missed;
  end

  assign events_o.hit     = i9_look && i9_hit;
  assign events_o.busy    = i9_done;
  assign events_o.starved = !stage_valid[0];
  assign list_hit_o       = i5_list_look && i5_list_hit;
  assign skipped_o        = i9_done && i9_known_q;
  assign idle_o           = pipe_idle && list_idle && triangle_idle && !in_valid_i && !references_valid_i && !done_q;
endmodule
