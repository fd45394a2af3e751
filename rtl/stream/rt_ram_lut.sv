// SPDX-License-Identifier: Apache-2.0
// Small RAM with one write port and an asynchronous read port; infers distributed RAM.
//
// Latency     Read 0: data follow the address. A word is there in the clock after it was written.
// Use         Where a register that holds more than the word itself stands behind the read, such as one behind a choice between two memories.
// Contents    Undefined until written.
`include "rt_assert.svh"
module rt_ram_lut #(
    parameter int unsigned Depth = 32,
    parameter type data_t = logic [31:0],
    localparam int unsigned AddrBits = Depth > 1 ? $clog2(Depth) : 1
) (
    input  logic                clk_i,
    input  logic                rst_ni,
    input  logic                write_en_i,
    input  logic [AddrBits-1:0] write_addr_i,
    input  data_t               write_data_i,
    input  logic [AddrBits-1:0] read_addr_i,
    output data_t               read_data_o
);
  `RT_ASSERT_INIT(DepthPositive, Depth >= 1)

  (* ram_style = "distributed" *) data_t mem_q[Depth];
  always_ff @(posedge clk_i) begin
    if (write_en_i) mem_q[write_addr_i] <= write_data_i;
  end
  assign read_data_o = mem_q[read_addr_i];

  `RT_ASSERT(WriteInRange, !write_en_i || 32'(write_addr_i) < Depth)
endmodule
