// SPDX-License-Identifier: Apache-2.0
// Keeps the reads of an id in order where several ports answer in their own time.
//
// Rule        A read may go to a port if no read of its id is in flight, or if the last one went to the same port, which answers in order. So reads of
//             one id wait only where they change the port; those of other ids pass nothing here, as they wait at the head of one stream.
// Structure   For each of Ids the number of reads that have set out and of those that are done, modulo 2^CountBits, and the port of the last one, in
//             distributed RAM. Ids that are equal in their lower bits share an entry: they wait for each other without need.
// Reset       The entries are cleared one a clock; until then go_o is 0.
// Latency     0 from id and port to go_o; a read counts as done two clocks after done_i.
`include "rt_assert.svh"
module rt_dram_order #(
    parameter int unsigned IdBits = 8,
    parameter int unsigned Ids = 64,
    parameter int unsigned Ports = 4,
    parameter int unsigned CountBits = 4,
    localparam int unsigned PortBits = Ports > 1 ? $clog2(Ports) : 1
) (
    input  logic                clk_i,
    input  logic                rst_ni,
    // A read that wants to set out; set_i when it does.
    input  logic [  IdBits-1:0] id_i,
    input  logic [PortBits-1:0] port_i,
    output logic                go_o,
    input  logic                set_i,
    // The last beat of a read has left.
    input  logic                done_i,
    input  logic [  IdBits-1:0] done_id_i
);
  localparam int unsigned EntryBits = $clog2(Ids);
  `RT_ASSERT_INIT(PowerOfTwo, Ids == 32'd1 << EntryBits && EntryBits <= IdBits && Ids >= 2)

  typedef logic [CountBits-1:0] count_t;
  typedef struct packed {
    count_t              count;
    logic [PortBits-1:0] last_port;
  } set_out_t;

  logic clear_q, done_q;
  logic [EntryBits-1:0] clear_entry_q, done_entry_q, entry;
  set_out_t set_out, set_out_in;
  count_t done, done_before, done_in, in_flight;
  assign entry     = id_i[EntryBits-1:0];
  assign in_flight = set_out.count - done;
  assign go_o      = !clear_q && (in_flight == '0 || (set_out.last_port == port_i && in_flight != '1));

  always_ff @(posedge clk_i) begin
    done_q        <= done_i;
    done_entry_q  <= done_id_i[EntryBits-1:0];
    clear_entry_q <= clear_entry_q + EntryBits'(clear_q);
    clear_q       <= clear_q && clear_entry_q != '1;
    if (!rst_ni) begin
      done_q        <= 1'b0;
      clear_q       <= 1'b1;
      clear_entry_q <= '0;
    end
  end

  assign set_out_in = clear_q ? '0 : '{count: set_out.count + 1'b1, last_port: port_i};
  assign done_in    = clear_q ? '0 : done_before + 1'b1;
  rt_ram_lut #(
      .Depth (Ids),
      .data_t(set_out_t)
  ) u_set_out (
      .clk_i,
      .rst_ni,
      .write_en_i  (set_i || clear_q),
      .write_addr_i(clear_q ? clear_entry_q : entry),
      .write_data_i(set_out_in),
      .read_addr_i (entry),
      .read_data_o (set_out)
  );
  // Twice, as it is read for two reads at once.
  rt_ram_lut #(
      .Depth (Ids),
      .data_t(count_t)
  ) u_done (
      .clk_i,
      .rst_ni,
      .write_en_i  (done_q || clear_q),
      .write_addr_i(clear_q ? clear_entry_q : done_entry_q),
      .write_data_i(done_in),
      .read_addr_i (entry),
      .read_data_o (done)
  );
  rt_ram_lut #(
      .Depth (Ids),
      .data_t(count_t)
  ) u_done_before (
      .clk_i,
      .rst_ni,
      .write_en_i  (done_q || clear_q),
      .write_addr_i(clear_q ? clear_entry_q : done_entry_q),
      .write_data_i(done_in),
      .read_addr_i (done_entry_q),
      .read_data_o (done_before)
  );

  `RT_ASSERT(SetsOutInTurn, !set_i || go_o)
endmodule
