// Round-robin choice of one set bit.
//
// Rule        The first set bit above the one taken last, else the first one. take_i says that the choice is used in this clock.
// Latency     0, combinational; the pointer moves with take_i.
`include "rt_assert.svh"
module rt_pick #(
    parameter int unsigned Count = 32,
    localparam int unsigned IndexBits = Count > 1 ? $clog2(Count) : 1
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic [Count-1:0]     pool_i,
    input  logic                 take_i,
    output logic                 valid_o,
    output logic [Count-1:0]     onehot_o,
    output logic [IndexBits-1:0] index_o
);
  // Bit i is set where bit `bit_number` of i is: an index is the OR of its one-hot code under these masks.
  function automatic logic [Count-1:0] index_mask(int unsigned bit_number);
    for (int unsigned i = 0; i < Count; i++) index_mask[i] = ((i >> bit_number) & 1) == 1;
  endfunction

  logic [Count-1:0] after_q, masked, chosen;

  assign masked   = pool_i & after_q;
  assign chosen   = (masked != '0) ? masked : pool_i;
  assign onehot_o = chosen & (~chosen + Count'(1));
  assign valid_o  = pool_i != '0;
  for (genvar b = 0; b < int'(IndexBits); b++) begin : gen_index
    localparam logic [Count-1:0] Mask = index_mask(b);
    assign index_o[b] = (onehot_o & Mask) != '0;
  end

  always_ff @(posedge clk_i) begin
    if (take_i && valid_o) after_q <= ~(onehot_o | (onehot_o - Count'(1)));
    if (!rst_ni) after_q <= '1;
  end

  `RT_ASSERT(OneHot, $onehot0(onehot_o))
endmodule
