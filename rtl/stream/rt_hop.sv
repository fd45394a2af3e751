// SPDX-License-Identifier: Apache-2.0
// Registers on a long wire: they exist for the part, not for the function, so their number is a parameter of the configuration.
//
// Latency     Depth; 0 is a wire. Throughput 1 a clock, nothing is held up. Valid bits are cleared by reset, data are not.
`include "rt_assert.svh"
module rt_hop #(
    parameter int unsigned Depth = 1,
    parameter int unsigned Valids = 1,
    parameter type data_t = logic
) (
    input  logic              clk_i,
    input  logic              rst_ni,
    input  logic [Valids-1:0] valid_i,
    input  data_t             data_i,
    output logic [Valids-1:0] valid_o,
    output data_t             data_o
);
  `RT_ASSERT_INIT(DepthSmall, Depth <= 8)
  if (Depth == 0) begin : gen_wire
    assign valid_o = valid_i;
    assign data_o  = data_i;
  end else begin : gen_registers
    logic [Depth-1:0][Valids-1:0] valid_q;
    data_t                        data_q[Depth];
    always_ff @(posedge clk_i) begin
      for (int unsigned k = 0; k < Depth; k++) begin
        valid_q[k] <= !rst_ni ? '0 : k == 0 ? valid_i : valid_q[k-1];
        data_q[k]  <= k == 0 ? data_i : data_q[k-1];
      end
    end
    assign valid_o = valid_q[Depth-1];
    assign data_o  = data_q[Depth-1];
  end
endmodule
