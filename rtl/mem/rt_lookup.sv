// SPDX-License-Identifier: Apache-2.0
// Look-up of small records in a table: each item of a stream goes on with the record that it wants, in order.
//
// Records     of RecordBytes, by a key; not read again for the same key as the item before that wanted one. Up to Waiting reads are in flight; one id, so
//             the answers come in order. They are taken in every clock: each has its place in u_records.
// Reads       Whole granules: an answer has as many beats as those take, and the record is cut out of it.
// Output      out_record_o counts where out_wanted_o is 1; out_error_o: it could not be read. failed_o: once for each read that failed.
// start_i     The table may be another one: nothing is kept. No item is inside.
// Rate        One item in two clocks.
`include "rt_assert.svh"
module rt_lookup #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned GranuleBytes = 8,
    parameter int unsigned RecordBytes = 8,
    parameter int unsigned KeyBits = 32,
    parameter int unsigned Waiting = 16,
    parameter int unsigned Source = 0,
    parameter type tag_t = logic [15:0],
    localparam int unsigned RecordBits = 8 * RecordBytes
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,  // a multiple of 64
    output logic                             failed_o,
    input  logic                             in_valid_i,
    output logic                             in_ready_o,
    input  logic                             in_wanted_i,
    input  logic [KeyBits-1:0]               in_key_i,
    input  tag_t                             in_tag_i,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             out_valid_o,
    input  logic                             out_ready_i,
    output logic                             out_wanted_o,
    output logic                             out_error_o,
    output logic [RecordBits-1:0]            out_record_o,
    output tag_t                             out_tag_o
);
  localparam int unsigned RecordShift = $clog2(RecordBytes);
  localparam int unsigned ReadBytes = rt_core_pkg::read_bytes(RecordBytes, GranuleBytes);
  localparam int unsigned Beats = ReadBytes * 8 / DataBits;
  localparam int unsigned BeatBits = Beats > 1 ? $clog2(Beats) : 1;
  localparam int unsigned Spans = RecordBits > DataBits ? RecordBits / DataBits : 1;   // beats of a record
  localparam int unsigned PerBeat = DataBits > RecordBits ? DataBits / RecordBits : 1;  // records of a beat
  localparam int unsigned PartBits = PerBeat > 1 ? $clog2(PerBeat) : 1;
  localparam int unsigned GranuleShift = $clog2(ReadBytes);
  typedef struct packed {
    logic [BeatBits-1:0] beat;
    logic [PartBits-1:0] part;
  } where_t;
  typedef struct packed {
    logic                  error;
    logic [RecordBits-1:0] record;
  } record_t;
  typedef struct packed {
    tag_t tag;
    logic wanted;
    logic fresh;  // and read for it
  } waiting_t;

  // --- an item, and whether its record is that of the one before ---
  logic                known_valid_q, wanted_q, same_q, known_go, last_valid_q, last_valid_d, fetch_go, fetch_free;
  logic                waiting_room, where_room, fill_last, fill_keep, fill_error;
  logic [KeyBits-1:0]  key_q, last_key_q, last_key_d;
  tag_t                tag_q;
  assign in_ready_o = !known_valid_q || known_go;
  assign known_go   = known_valid_q && waiting_room && (!wanted_q || same_q || (fetch_free && where_room));
  assign fetch_go   = known_go && wanted_q && !same_q;
  always_ff @(posedge clk_i) begin
    if (in_ready_o) begin
      known_valid_q <= in_valid_i;
      tag_q         <= in_tag_i;
      key_q         <= in_key_i;
      wanted_q      <= in_wanted_i;
      // Of the item before this one, which has passed or passes in this clock.
      same_q        <= last_valid_d && last_key_d == in_key_i;
    end
    last_valid_q <= last_valid_d;
    last_key_q   <= last_key_d;
    if (!rst_ni) known_valid_q <= 1'b0;
  end
  assign last_valid_d = !start_i && rst_ni && (last_valid_q || fetch_go);
  assign last_key_d   = fetch_go ? key_q : last_key_q;

  // --- reads ---
  logic                             fetch_valid_q, where_valid;
  logic [rt_core_pkg::AddrBits-1:0] fetch_addr_q, addr;
  where_t                           where_in, where;
  logic [BeatBits-1:0]              beat_q;
  assign addr       = base_i + rt_core_pkg::AddrBits'({key_q, RecordShift'(0)});
  assign fetch_free = !fetch_valid_q || fetch_ready_i;
  always_ff @(posedge clk_i) begin
    if (fetch_ready_i) fetch_valid_q <= 1'b0;
    if (fetch_go) begin
      fetch_valid_q <= 1'b1;
      fetch_addr_q  <= {addr[rt_core_pkg::AddrBits-1:GranuleShift], GranuleShift'(0)};
    end
    if (!rst_ni) fetch_valid_q <= 1'b0;
  end
  assign fetch_valid_o = fetch_valid_q;
  assign fetch_o = '{
          addr: fetch_addr_q,
          len: 8'(Beats - 1),
          source: rt_core_pkg::SourceBits'(Source),
          mshr: '0
      };
  always_comb begin
    where_in = '0;
    if (PerBeat > 1) where_in.part = PartBits'(key_q);
    if (Beats > 1) where_in.beat = BeatBits'(32'(key_q) * Spans / PerBeat);
  end
  localparam int unsigned UsageBits = $clog2(Waiting + 1);
  logic [UsageBits-1:0] where_usage_unused, waiting_usage_unused, record_usage_unused;
  rt_fifo #(
      .Depth (Waiting),
      .data_t(where_t)
  ) u_where (
      .clk_i,
      .rst_ni,
      .in_valid_i (fetch_go),
      .in_ready_o (where_room),
      .in_data_i  (where_in),
      .out_valid_o(where_valid),
      .out_ready_i(fill_keep),
      .out_data_o (where),
      .usage_o    (where_usage_unused)
  );
  // An error in any beat is one of all.
  logic                           error_q, record_room, record_valid, record_take;
  logic [Spans-1:0][DataBits-1:0] kept_q, kept;
  record_t                        record_in, record_next, record_q;
  assign fill_last  = beat_q == BeatBits'(Beats - 1);
  assign fill_error = fill_error_i || error_q;
  assign fill_keep  = fill_valid_i && fill_last;
  always_comb begin
    for (int unsigned s = 0; s < Spans; s++) kept[s] = Beats == 1 || beat_q == where.beat + BeatBits'(s) ? fill_data_i : kept_q[s];
  end
  always_ff @(posedge clk_i) begin
    if (fill_valid_i) begin
      kept_q  <= kept;
      beat_q  <= fill_last ? '0 : beat_q + 1'b1;
      error_q <= fill_error && !fill_last;
    end
    if (!rst_ni) begin
      beat_q  <= '0;
      error_q <= 1'b0;
    end
  end
  logic [Spans*DataBits-1:0] kept_bits;
  assign kept_bits = kept;
  assign record_in = '{
          error: fill_error,
          record: kept_bits[(PerBeat > 1 ? RecordBits * where.part : 0)+:RecordBits]
      };
  rt_fifo #(
      .Depth (Waiting),
      .data_t(record_t)
  ) u_records (
      .clk_i,
      .rst_ni,
      .in_valid_i (fill_keep),
      .in_ready_o (record_room),
      .in_data_i  (record_in),
      .out_valid_o(record_valid),
      .out_ready_i(record_take),
      .out_data_o (record_next),
      .usage_o    (record_usage_unused)
  );
  assign failed_o = fill_keep && fill_error;

  // --- items wait for their records ---
  waiting_t waiting;
  logic     waiting_valid, waiting_take;
  rt_fifo #(
      .Depth (Waiting),
      .data_t(waiting_t)
  ) u_waiting (
      .clk_i,
      .rst_ni,
      .in_valid_i (known_go),
      .in_ready_o (waiting_room),
      .in_data_i  ('{tag: tag_q, wanted: wanted_q, fresh: wanted_q && !same_q}),
      .out_valid_o(waiting_valid),
      .out_ready_i(waiting_take),
      .out_data_o (waiting),
      .usage_o    (waiting_usage_unused)
  );
  assign out_valid_o  = waiting_valid && (!waiting.fresh || record_valid);
  assign waiting_take = out_valid_o && out_ready_i;
  assign record_take  = waiting_take && waiting.fresh;
  always_ff @(posedge clk_i) if (record_take) record_q <= record_next;
  assign out_wanted_o = waiting.wanted;
  assign out_error_o  = waiting.fresh ? record_next.error : record_q.error;
  assign out_record_o = waiting.fresh ? record_next.record : record_q.record;
  assign out_tag_o    = waiting.tag;

  `RT_ASSERT_INIT(DataBitsKnown, DataBits == 64 || DataBits == 128)
  `RT_ASSERT(AnswerIsExpected, !fill_valid_i || where_valid)
  `RT_ASSERT(RecordHasRoom, !fill_keep || record_room)
  `RT_ASSERT(RecordIsThere, !waiting_take || !waiting.fresh || record_valid)
  `RT_ASSERT_STREAM(Reads, fetch_valid_o, fetch_ready_i, fetch_o)
endmodule
