// SPDX-License-Identifier: Apache-2.0
// Simple dual-port RAM, one write and one read port on one clock; infers block RAM.
//
// Latency     1: data follow the clock edge that sees read_en_i; they stay until the next read.
// Collision   A read of the address that is being written in the same clock gives undefined data with Forward = 0 (so that no part needs extra
//             logic; simulation returns the complement of the new data, which no test overlooks) and the new data with Forward = 1.
// Contents    Undefined until written.
`include "rt_assert.svh"
module rt_ram_sdp #(
    parameter int unsigned Depth = 512,
    parameter bit Forward = 1'b0,
    parameter type data_t = logic [31:0],
    localparam int unsigned AddrBits = Depth > 1 ? $clog2(Depth) : 1
) (
    input  logic                clk_i,
    input  logic                rst_ni,
    input  logic                write_en_i,
    input  logic [AddrBits-1:0] write_addr_i,
    input  data_t               write_data_i,
    input  logic                read_en_i,
    input  logic [AddrBits-1:0] read_addr_i,
    output data_t               read_data_o
);
  `RT_ASSERT_INIT(DepthPositive, Depth >= 1)

  (* no_rw_check *) data_t mem_q[Depth];
  data_t read_q;
  logic collision;

  assign collision = write_en_i && read_en_i && write_addr_i == read_addr_i;

  always_ff @(posedge clk_i) begin
    if (write_en_i) mem_q[write_addr_i] <= write_data_i;
    if (read_en_i) read_q <= mem_q[read_addr_i];
  end

  if (Forward) begin : gen_forward
    data_t forward_q;
    logic use_forward_q;
    always_ff @(posedge clk_i) begin
      if (read_en_i) begin
        forward_q     <= write_data_i;
        use_forward_q <= collision;
      end
    end
    assign read_data_o = use_forward_q ? forward_q : read_q;
  end else begin : gen_plain
`ifdef SYNTHESIS
    assign read_data_o = read_q;
`else
    data_t poison_q;
    logic use_poison_q;
    always_ff @(posedge clk_i) begin
      if (read_en_i) begin
        poison_q     <= ~write_data_i;
        use_poison_q <= collision;
      end
    end
    assign read_data_o = use_poison_q ? poison_q : read_q;
`endif
  end

  `RT_ASSERT(WriteInRange, !write_en_i || 32'(write_addr_i) < Depth)
  `RT_ASSERT(ReadInRange, !read_en_i || 32'(read_addr_i) < Depth)
endmodule
