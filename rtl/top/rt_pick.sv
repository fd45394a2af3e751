// Round-robin choice of one set bit.
//
// Rule        The first set bit above the one taken last, else the first one. take_i says that the choice is used in this clock.
// Structure   In two levels, groups of GroupBits: no carry chain over the whole pool. The pool above the last choice and the whole pool are searched
//             side by side; which of them counts is known last.
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
  localparam int unsigned GroupBits = 8;
  localparam int unsigned Groups = (Count + GroupBits - 1) / GroupBits;
  localparam int unsigned Padded = Groups * GroupBits;

  localparam int unsigned PaddedBits = Padded > 1 ? $clog2(Padded) : 1;
  logic [Count-1:0]  after_q;
  logic [PaddedBits-1:0] index[2];
  logic [Padded-1:0] searched[2], lowest[2], above[2];  // 0: above the last choice, 1: the whole pool

  assign searched[0] = Padded'(pool_i & after_q);
  assign searched[1] = Padded'(pool_i);
  for (genvar s = 0; s < 2; s++) begin : gen_search
    logic [Groups-1:0] any, first;
    logic [PaddedBits-1:0] index_of[Groups];  // of the group's first bit
    for (genvar g = 0; g < int'(Groups); g++) begin : gen_group
      logic [GroupBits-1:0] group, group_first;
      assign group  = searched[s][g*GroupBits+:GroupBits];
      assign any[g] = group != '0;
      for (genvar i = 0; i < int'(GroupBits); i++) begin : gen_bit
        // A set bit below this one.
        logic below_in_group, below_group;
        if (i == 0) begin : gen_lowest
          assign below_in_group = 1'b0;
        end else begin : gen_higher
          assign below_in_group = group[i-1:0] != '0;
        end
        if (g == 0) begin : gen_lowest_group
          assign below_group = 1'b0;
        end else begin : gen_higher_group
          assign below_group = any[g-1:0] != '0;
        end
        assign group_first[i]          = group[i] && !below_in_group;
        assign above[s][g*GroupBits+i] = below_group || below_in_group;
      end
      if (g == 0) begin : gen_lowest
        assign first[g] = any[g];
      end else begin : gen_higher
        assign first[g] = any[g] && any[g-1:0] == '0;
      end
      assign lowest[s][g*GroupBits+:GroupBits] = first[g] ? group_first : '0;
      always_comb begin
        index_of[g] = '0;
        for (int unsigned i = 0; i < GroupBits; i++) if (group_first[i]) index_of[g] |= PaddedBits'(g * GroupBits + i);
      end
    end
    always_comb begin
      index[s] = '0;
      for (int unsigned g = 0; g < Groups; g++) if (first[g]) index[s] |= index_of[g];
    end
  end
  assign onehot_o = searched[0] != '0 ? lowest[0][Count-1:0] : lowest[1][Count-1:0];
  assign valid_o  = pool_i != '0;
  assign index_o  = IndexBits'(searched[0] != '0 ? index[0] : index[1]);

  always_ff @(posedge clk_i) begin
    if (take_i && valid_o) after_q <= searched[0] != '0 ? above[0][Count-1:0] : above[1][Count-1:0];
    if (!rst_ni) after_q <= '1;
  end

  `RT_ASSERT(OneHot, $onehot0(onehot_o))
endmodule
