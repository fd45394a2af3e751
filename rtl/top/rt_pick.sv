// Round-robin choice of one set bit.
//
// Rule        The first set bit above the one chosen last, else the first one. taken_o names it in the clock of the choice, so that the pool can
//             leave it out in the next one; valid_o, onehot_o and index_o say it one clock later.
// Structure   In two levels, groups of GroupBits: no carry chain over the whole pool. The pool above the last choice and the whole pool are searched
//             side by side; which of them counts is known last. The number of the choice is found behind the register.
// Latency     1. A choice in every clock.
`include "rt_assert.svh"
module rt_pick #(
    parameter int unsigned Count = 32,
    localparam int unsigned IndexBits = Count > 1 ? $clog2(Count) : 1
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic [Count-1:0]     pool_i,
    output logic [Count-1:0]     taken_o,
    output logic                 valid_o,
    output logic [Count-1:0]     onehot_o,
    output logic [IndexBits-1:0] index_o
);
  localparam int unsigned GroupBits = 8;
  localparam int unsigned Groups = (Count + GroupBits - 1) / GroupBits;
  typedef logic [Groups-1:0] groups_t;
  typedef logic [Groups*GroupBits-1:0] pool_t;

  // Bit i: a bit at or below i is set; the same in each group of its own.
  function automatic groups_t from_lowest(groups_t x);
    for (int unsigned step = 1; step < Groups; step *= 2) x |= x << step;
    return x;
  endfunction
  function automatic pool_t from_lowest_of_group(pool_t x);
    x |= (x << 1) & {Groups{8'hfe}};
    x |= (x << 2) & {Groups{8'hfc}};
    x |= (x << 4) & {Groups{8'hf0}};
    return x;
  endfunction

  logic [Count-1:0] after_q, chosen_q;
  logic             valid_q, from_all;
  pool_t            searched[2], first[2], above[2];  // 0: above the last choice, 1: the whole pool
  assign searched[0] = pool_t'(pool_i & after_q);
  assign searched[1] = pool_t'(pool_i);
  assign from_all    = searched[0] == '0;
  always_comb begin
    for (int unsigned s = 0; s < 2; s++) begin
      pool_t   reached, in_first, in_later;
      groups_t any, any_below;
      reached = from_lowest_of_group(searched[s]);
      for (int unsigned g = 0; g < Groups; g++) any[g] = reached[g*GroupBits+GroupBits-1];
      any_below = from_lowest(any) << 1;
      for (int unsigned g = 0; g < Groups; g++) begin
        in_first[g*GroupBits+:GroupBits] = {GroupBits{any[g] && !any_below[g]}};
        in_later[g*GroupBits+:GroupBits] = {GroupBits{any_below[g]}};
      end
      above[s] = ((reached << 1) & {Groups{8'hfe}}) | in_later;
      first[s] = reached & ~(reached << 1 & {Groups{8'hfe}}) & in_first;
    end
  end
  assign taken_o = Count'(first[32'(from_all)]);
  always_ff @(posedge clk_i) begin
    chosen_q <= taken_o;
    valid_q  <= pool_i != '0;
    if (pool_i != '0) after_q <= Count'(above[32'(from_all)]);
    if (!rst_ni) begin
      valid_q <= 1'b0;
      after_q <= '1;
    end
  end

  // The places whose number has bit b.
  function automatic logic [Count-1:0] with_bit(int unsigned b);
    for (int unsigned i = 0; i < Count; i++) with_bit[i] = i[b];
  endfunction
  for (genvar b = 0; b < int'(IndexBits); b++) begin : gen_index
    localparam logic [Count-1:0] WithBit = with_bit(b);
    assign index_o[b] = (chosen_q & WithBit) != '0;
  end
  assign valid_o  = valid_q;
  assign onehot_o = chosen_q;

  `RT_ASSERT(OneHot, $onehot0(taken_o))
endmodule
