// SPDX-License-Identifier: Apache-2.0
// Serial sender: 8 data bits, no parity, one stop bit.
//
// Rate        Divisor clocks a bit, in 256ths; the fraction is carried on from bit to bit, so no edge is off by a clock or more.
// Input       A stream of bytes; a byte is accepted when the one before has had its stop bit. tx_o is 1 while there is nothing to send.
// Latency     1 clock to the start bit. Throughput one byte in 10 bits (and a clock if the next one is there in time).
// Cuts        valid, data and ready.
// Counterpart rt_uart_rx.
`include "rt_assert.svh"
module rt_uart_tx #(
    parameter int unsigned Divisor = 6827
) (
    input  logic       clk_i,
    input  logic       rst_ni,
    input  logic       in_valid_i,
    output logic       in_ready_o,
    input  logic [7:0] in_data_i,
    output logic       tx_o
);
  `RT_ASSERT_INIT(TwoClocksABit, Divisor >= 2 * 256 && Divisor < 65536 * 256)

  localparam int unsigned CountBits = 16;
  localparam logic [CountBits-1:0] Whole = CountBits'(Divisor / 256);
  localparam logic [7:0] Fraction = 8'(Divisor % 256);
  localparam int unsigned FrameBits = 10;

  logic [FrameBits-1:0] shift_q;  // start bit at the bottom
  logic [3:0] bits_q;             // still to be sent, this one included
  logic [CountBits-1:0] left_q;
  logic [7:0] fraction_q;
  logic [8:0] fraction_d;
  logic busy_q;

  assign in_ready_o = !busy_q;
  assign tx_o       = shift_q[0];
  assign fraction_d = {1'b0, fraction_q} + {1'b0, Fraction};

  always_ff @(posedge clk_i) begin
    if (!busy_q) begin
      if (in_valid_i) begin
        busy_q     <= 1'b1;
        shift_q    <= {1'b1, in_data_i, 1'b0};
        bits_q     <= 4'(FrameBits);
        left_q     <= Whole - 1'b1;
        fraction_q <= '0;
      end
    end else begin
      left_q <= left_q - 1'b1;
      if (left_q == '0) begin
        left_q     <= Whole - 1'b1 + CountBits'(fraction_d[8]);
        fraction_q <= fraction_d[7:0];
        shift_q    <= {1'b1, shift_q[FrameBits-1:1]};
        bits_q     <= bits_q - 1'b1;
        if (bits_q == 4'd1) busy_q <= 1'b0;
      end
    end
    if (!rst_ni) begin
      busy_q  <= 1'b0;
      shift_q <= '1;
    end
  end

  `RT_ASSERT_STREAM(InputHeld, in_valid_i, in_ready_o, in_data_i)
  `RT_ASSERT(IdleIsOne, busy_q || tx_o)
endmodule
