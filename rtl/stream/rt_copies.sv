// SPDX-License-Identifier: Apache-2.0
// Copies of a register, one for each region of a part that reads it: no region waits for a wire across the part.
//
// Purpose     What reaches everything, such as a reset or the write port of memories that stand far from each other, takes its time on the way;
//             each copy stands beside those that read it.
// Synthesis   Equal registers would be merged again: `keep` forbids it (scripts/synthesis.py says the same to Yosys).
// Start       Start, when a part has been configured.
// Latency     1, of all copies.
module rt_copies #(
    parameter int unsigned Copies = 2,
    parameter type data_t = logic,
    parameter data_t Start = '0
) (
    input  logic               clk_i,
    input  data_t              data_i,
    output data_t [Copies-1:0] data_o
);
  for (genvar c = 0; c < int'(Copies); c++) begin : gen_copy
    (* keep = "true" *) data_t copy_q = Start;
    always_ff @(posedge clk_i) copy_q <= data_i;
    assign data_o[c] = copy_q;
  end
endmodule
