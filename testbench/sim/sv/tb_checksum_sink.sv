// SPDX-License-Identifier: Apache-2.0
// Sink of hits that keeps a checksum: what a sink of the core has to do, and no more.
//
// Checksum    Sum of the FNV-1a hashes of {tag, hit}, lowest byte first, as hits come in any order.
// Stream      A hit is taken in one clock and counted in the next; done_o once nothing is left to count. In rest_i of 256 clocks, and while hold_i is
//             set, no hit is taken and nothing is said to be done.
module tb_checksum_sink (
    input  logic                     clk_i,
    input  logic                     rst_ni,
    input  logic                     clear_i,
    input  logic                     hold_i,
    input  logic [7:0]               rest_i,
    input  logic                     hit_valid_i,
    output logic                     hit_ready_o,
    input  rt_core_pkg::tagged_hit_t hit_i,
    output logic                     done_o,
    output logic [31:0]              count_o,
    output logic [63:0]              checksum_o
);
  logic [31:0]              random_q;
  logic                     taken_q;
  rt_core_pkg::tagged_hit_t hit_q;
  function automatic logic [63:0] hash(rt_core_pkg::tagged_hit_t hit);
    logic [$bits(rt_core_pkg::tagged_hit_t)-1:0] bits;
    bits = hit;
    hash = 64'hcbf29ce484222325;
    for (int unsigned i = 0; i < $bits(bits) / 8; i++) hash = (hash ^ 64'(bits[8*i+:8])) * 64'h100000001b3;
  endfunction
  assign hit_ready_o = !hold_i && random_q[31:24] >= rest_i;
  assign done_o      = !hold_i && !taken_q;
  always_ff @(posedge clk_i) begin
    random_q <= random_q * 32'd1664525 + 32'd1013904223;
    taken_q  <= hit_valid_i && hit_ready_o && rst_ni;
    hit_q    <= hit_i;
    if (taken_q) begin
      count_o    <= count_o + 1'b1;
      checksum_o <= checksum_o + hash(hit_q);
    end
    if (clear_i || !rst_ni) begin
      count_o    <= '0;
      checksum_o <= '0;
    end
  end
endmodule
