// Copies of a reset, one for each region of a part: no register of a region waits for a wire across the part.
//
// Purpose     A synchronous reset reaches every register; on a full part the way to the farthest of them was the longest path of the core. Each
//             copy is a register beside those that it resets.
// Rule        All copies follow rst_ni a clock later, so units that reset each other's streams do so in the same clock.
// Synthesis   Equal registers would be merged again: `keep` forbids it (scripts/synthesis.py does the same for Yosys).
// Start       In reset, when a part has been configured.
// Latency     1.
module rt_reset_copies #(
    parameter int unsigned Copies = 2
) (
    input  logic              clk_i,
    input  logic              rst_ni,
    output logic [Copies-1:0] rst_no
);
  for (genvar c = 0; c < int'(Copies); c++) begin : gen_copy
    (* keep = "true" *) logic reset_copy_q = 1'b1;
    always_ff @(posedge clk_i) reset_copy_q <= !rst_ni;
    assign rst_no[c] = !reset_copy_q;
  end
endmodule
