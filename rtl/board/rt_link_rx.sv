// SPDX-License-Identifier: Apache-2.0
// Takes frames out of a stream of bytes: flags, escapes, check sequence; the bytes go into a buffer.
//
// Frame       RFC 1662: Flag, bytes with Escape before a flipped one, CRC-32 (little endian, complement) over them, Flag. One flag may end
//             a frame and begin the next. Nothing between two flags is no frame.
// Result      At the flag behind a frame, for one clock: good_o (check sequence right, at least RequestHeader bytes before it), or bad_o:
//             anything else, be it too short, longer than the buffer, aborted (Escape, Flag), or with a byte that
//             the receiver reports as damaged. bytes_o and crc_o (the check sequence itself) belong to good_o and stay
//             until the next frame begins.
// Busy        While take_i is 0, and from then on to the next flag, bytes are dropped: what arrives while a frame is worked on never
//             reaches the buffer.
// Buffer      One write a byte; a frame that turns out bad has written there too.
// Latency     good_o or bad_o 1 clock after the flag.
// Counterpart rt_link_tx.
`include "rt_assert.svh"
module rt_link_rx #(
    parameter int unsigned BufferBytes = 2048,
    localparam int unsigned PtrBits = $clog2(BufferBytes),
    localparam int unsigned CountBits = $clog2(BufferBytes + 1)
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 take_i,
    input  logic                 in_valid_i,
    input  logic [7:0]           in_data_i,
    input  logic                 in_error_i,
    output logic                 write_en_o,
    output logic [PtrBits-1:0]   write_addr_o,
    output logic [7:0]           write_data_o,
    output logic                 good_o,
    output logic                 bad_o,
    output logic                 long_o,   // with bad_o: it did not fit the buffer
    output logic [CountBits-1:0] bytes_o,  // without the check sequence
    output logic [31:0]          crc_o
);
  localparam int unsigned Shortest = rt_board_pkg::RequestHeader + rt_board_pkg::CrcBytes;

  logic hunt_q;    // drop everything up to the next flag
  logic escape_q;  // the next byte is flipped
  logic spoilt_q, long_q;
  logic [CountBits-1:0] count_q;
  logic [31:0] crc_q;
  logic flag, byte_valid, any, room;
  logic [7:0] value;

  assign flag       = in_valid_i && !in_error_i && in_data_i == rt_board_pkg::Flag;
  assign byte_valid = in_valid_i && !flag && take_i && !hunt_q;
  assign value      = escape_q ? in_data_i ^ rt_board_pkg::EscapeFlip : in_data_i;
  assign any        = count_q != '0 || spoilt_q || escape_q;
  assign room       = count_q != CountBits'(BufferBytes);

  always_ff @(posedge clk_i) begin
    good_o     <= 1'b0;
    bad_o      <= 1'b0;
    long_o     <= 1'b0;
    write_en_o <= 1'b0;
    if (!take_i) hunt_q <= 1'b1;
    if (byte_valid) begin
      if (in_error_i) begin
        spoilt_q <= 1'b1;
      end else if (in_data_i == rt_board_pkg::Escape && !escape_q) begin
        escape_q <= 1'b1;
      end else begin
        escape_q     <= 1'b0;
        write_en_o   <= room;
        write_addr_o <= PtrBits'(count_q);
        write_data_o <= value;
        crc_q        <= rt_board_pkg::crc_byte(crc_q, value);
        crc_o        <= {value, crc_o[31:8]};
        if (room) begin
          count_q <= count_q + 1'b1;
        end else begin
          spoilt_q <= 1'b1;
          long_q   <= 1'b1;
        end
      end
    end
    if (flag && take_i) begin
      hunt_q   <= 1'b0;
      escape_q <= 1'b0;
      spoilt_q <= 1'b0;
      long_q   <= 1'b0;
      count_q  <= '0;
      crc_q    <= rt_board_pkg::CrcInit;
      if (!hunt_q && any) begin
        good_o  <= crc_q == rt_board_pkg::CrcGood && count_q >= CountBits'(Shortest) && !spoilt_q && !escape_q;
        bad_o   <= !(crc_q == rt_board_pkg::CrcGood && count_q >= CountBits'(Shortest) && !spoilt_q && !escape_q);
        long_o  <= long_q;
        bytes_o <= count_q - CountBits'(rt_board_pkg::CrcBytes);
        // Whoever takes the frame raises take_i again when it is done; until then nothing may follow.
        hunt_q  <= 1'b1;
      end
    end
    if (!rst_ni) begin
      hunt_q     <= 1'b1;
      good_o     <= 1'b0;
      bad_o      <= 1'b0;
      write_en_o <= 1'b0;
    end
  end

  `RT_ASSERT(OneVerdict, !(good_o && bad_o))
  `RT_ASSERT(GoodIsWhole, !good_o || (bytes_o >= CountBits'(rt_board_pkg::RequestHeader) && bytes_o <= CountBits'(BufferBytes - rt_board_pkg::CrcBytes)))
endmodule
