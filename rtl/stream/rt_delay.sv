// SPDX-License-Identifier: Apache-2.0
// Delay line: data_o is data_i of Cycles clocks ago. Aligns values with a pipeline that never stalls.
//
// Latency     Cycles (0 is a wire). No handshake: validity travels elsewhere (rt_pipe_ctrl).
// Structure   Up to RegisterCycles stages of registers; beyond that a ring in distributed RAM and one register, which costs RAM cells
//             instead of one flip-flop a bit and clock on parts without shift-register cells.
// Contents    Undefined for the first Cycles clocks after reset.
`include "rt_assert.svh"
module rt_delay #(
    parameter int unsigned Cycles = 1,
    parameter type data_t = logic
) (
    input  logic  clk_i,
    input  logic  rst_ni,
    input  data_t data_i,
    output data_t data_o
);
  localparam int unsigned RegisterCycles = 3;

  if (Cycles == 0) begin : gen_wire
    assign data_o = data_i;
  end else if (Cycles <= RegisterCycles) begin : gen_registers
    data_t pipe_q[Cycles];
    always_ff @(posedge clk_i) begin
      pipe_q[0] <= data_i;
      for (int unsigned i = 1; i < Cycles; i++) pipe_q[i] <= pipe_q[i-1];
    end
    assign data_o = pipe_q[Cycles-1];
  end else begin : gen_ring
    // The slot is read and then overwritten in the same clock, so it holds a value for Slots clocks; data_q is the last one.
    localparam int unsigned Slots = Cycles - 1;
    localparam int unsigned PtrBits = $clog2(Slots);
    (* ram_style = "distributed" *) data_t mem_q[Slots];
    data_t data_q;
    logic [PtrBits-1:0] ptr_q;
    always_ff @(posedge clk_i) begin
      mem_q[ptr_q] <= data_i;
      data_q       <= mem_q[ptr_q];
      ptr_q        <= ptr_q == PtrBits'(Slots - 1) ? '0 : ptr_q + 1'b1;
      if (!rst_ni) ptr_q <= '0;
    end
    assign data_o = data_q;
  end
endmodule
