// SPDX-License-Identifier: Apache-2.0
// Serial receiver: 8 data bits, no parity, one stop bit.
//
// Rate        Divisor clocks a bit, in 256ths; at least 4 clocks. The fraction is carried from bit to bit, so it does not add up over a byte.
// Sampling    Two registers against metastability, then the majority of three neighbouring clocks, sampled in the middle of each bit: a
//             pulse of one clock is never a bit. The middle is found again at each start bit. A sender may be off by
//             half a bit in 9.5 less two clocks: 4 % at 16 clocks a bit.
// Output      out_valid_o for one clock for each byte, out_error_o with it if its stop bit was 0 (then out_data_o means nothing). The
//             taker cannot make it wait. After such an error (a break, too) nothing starts before the line was 1 again.
// Latency     6 clocks after the middle of the stop bit.
// Counterpart rt_uart_tx.
`include "rt_assert.svh"
module rt_uart_rx #(
    parameter int unsigned Divisor = 6827
) (
    input  logic       clk_i,
    input  logic       rst_ni,
    input  logic       rx_i,
    output logic       out_valid_o,
    output logic [7:0] out_data_o,
    output logic       out_error_o
);
  `RT_ASSERT_INIT(FourClocksABit, Divisor >= 4 * 256 && Divisor < 65536 * 256)

  localparam int unsigned CountBits = 16;
  localparam logic [CountBits-1:0] Whole = CountBits'(Divisor / 256);
  localparam logic [7:0] Fraction = 8'(Divisor % 256);
  localparam logic [CountBits-1:0] ToMiddle = CountBits'(Divisor / 512 - 1);

  typedef enum logic [1:0] {
    Idle,
    Start,
    Data,
    Break
  } state_e;

  (* ASYNC_REG = "TRUE" *) logic [3:0] line_q;  // the last two of them and the one before are voted on
  logic vote_q, level_q;  // a register more, as the pin may be far from the rest
  state_e state_q;
  logic [CountBits-1:0] left_q;
  logic [7:0] fraction_q;
  logic [8:0] fraction_d;
  logic [3:0] bits_q;
  logic [7:0] data_q;
  logic sample;

  assign sample     = left_q == '0;
  assign fraction_d = {1'b0, fraction_q} + {1'b0, Fraction};

  always_ff @(posedge clk_i) begin
    line_q      <= {line_q[2:0], rx_i};
    vote_q      <= (line_q[1] && line_q[2]) || (line_q[2] && line_q[3]) || (line_q[1] && line_q[3]);
    level_q     <= vote_q;
    out_valid_o <= 1'b0;
    out_error_o <= 1'b0;
    left_q      <= left_q - 1'b1;
    if (sample) begin
      left_q     <= Whole - 1'b1 + CountBits'(fraction_d[8]);
      fraction_q <= fraction_d[7:0];
    end
    case (state_q)
      Idle: begin
        left_q     <= ToMiddle;
        fraction_q <= '0;
        bits_q     <= '0;
        if (!level_q) state_q <= Start;
      end
      Start: if (sample) state_q <= level_q ? Idle : Data;  // a start bit that is gone in its middle was none
      Data: begin
        if (sample) begin
          bits_q <= bits_q + 1'b1;
          data_q <= {level_q, data_q[7:1]};
          if (bits_q == 4'd8) begin
            data_q      <= data_q;
            out_valid_o <= 1'b1;
            out_error_o <= !level_q;
            state_q     <= level_q ? Idle : Break;
          end
        end
      end
      default: if (level_q) state_q <= Idle;
    endcase
    if (!rst_ni) begin
      line_q      <= '1;
      vote_q      <= 1'b1;
      level_q     <= 1'b1;
      state_q     <= Break;
      out_valid_o <= 1'b0;
    end
  end
  assign out_data_o = data_q;

  `RT_ASSERT(OneClock, !(out_valid_o && state_q == Data))
endmodule
