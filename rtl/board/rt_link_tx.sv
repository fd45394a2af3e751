// SPDX-License-Identifier: Apache-2.0
// Sends one frame: header from registers, data from a buffer, check sequence; with flags and escapes.
//
// Frame       Flag, ResponseHeader bytes (Response, sequence, session, status, position), data_bytes_i bytes of the buffer from its
//             start, CRC-32, Flag, Flag. The second flag ends the frame if the first one is lost. Escaped: Flag and Escape.
// Control     start_i for one clock while busy_o is 0; the inputs must stay until busy_o falls.
// Buffer      read_addr_o is followed by its byte in the next clock.
// Throughput  A byte takes 4 clocks, an escaped one 5; the serial line is slower.
// Counterpart rt_link_rx.
`include "rt_assert.svh"
module rt_link_tx #(
    parameter int unsigned BufferBytes = 2048,
    localparam int unsigned PtrBits = $clog2(BufferBytes),
    localparam int unsigned CountBits = $clog2(BufferBytes + 1)
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  start_i,
    output logic                  busy_o,
    input  logic [15:0]           sequence_i,
    input  logic [15:0]           session_i,
    input  rt_board_pkg::status_e status_i,
    input  logic [15:0]           position_i,
    input  logic [CountBits-1:0]  data_bytes_i,
    output logic                  read_en_o,
    output logic [PtrBits-1:0]    read_addr_o,
    input  logic [7:0]            read_data_i,
    output logic                  out_valid_o,
    input  logic                  out_ready_i,
    output logic [7:0]            out_data_o
);
  typedef enum logic [2:0] {
    Idle,
    Open,
    Header,
    Data,
    Crc,
    Close
  } part_e;
  typedef enum logic [1:0] {
    Fetch,
    Choose,
    Send,
    Flipped
  } step_e;

  part_e part_q;
  step_e step_q;
  logic [CountBits-1:0] index_q;  // byte within the part
  logic [31:0] crc_q;
  logic [rt_board_pkg::ResponseHeader*8-1:0] header;
  logic [7:0] value, value_q, out_q;
  logic out_valid_q, raw, escape, accepted, last;
  logic [31:0] check;

  assign header = {position_i, status_i, session_i, sequence_i, rt_board_pkg::Response};
  assign check  = ~crc_q;
  assign raw    = part_q == Open || part_q == Close;
  always_comb begin
    case (part_q)
      Header:  value = header[8*index_q[2:0]+:8];
      Data:    value = read_data_i;
      Crc:     value = check[8*index_q[1:0]+:8];
      default: value = rt_board_pkg::Flag;
    endcase
    case (part_q)
      Header:  last = index_q == CountBits'(rt_board_pkg::ResponseHeader - 1);
      Data:    last = index_q == data_bytes_i - 1'b1;
      Crc:     last = index_q == CountBits'(rt_board_pkg::CrcBytes - 1);
      Close:   last = index_q == CountBits'(1);
      default: last = 1'b1;
    endcase
  end
  assign escape   = !raw && (value_q == rt_board_pkg::Flag || value_q == rt_board_pkg::Escape);
  assign accepted = out_valid_q && out_ready_i;

  assign read_en_o   = step_q == Fetch;
  assign read_addr_o = PtrBits'(index_q);
  assign out_valid_o = out_valid_q;
  assign out_data_o  = out_q;
  assign busy_o      = part_q != Idle;

  always_ff @(posedge clk_i) begin
    if (accepted) out_valid_q <= 1'b0;
    if (part_q == Idle) begin
      index_q <= '0;
      step_q  <= Fetch;
      crc_q   <= rt_board_pkg::CrcInit;
      if (start_i) part_q <= Open;
    end else begin
      case (step_q)
        Fetch: step_q <= Choose;
        Choose: begin
          // Block RAM is too slow for more than this in a clock.
          value_q <= value;
          step_q  <= Send;
        end
        Send: begin
          if (!out_valid_q || accepted) begin
            out_valid_q <= 1'b1;
            out_q       <= escape ? rt_board_pkg::Escape : value_q;
            step_q      <= escape ? Flipped : Fetch;
          end
        end
        default: begin
          if (accepted) begin
            out_valid_q <= 1'b1;
            out_q       <= value_q ^ rt_board_pkg::EscapeFlip;
            step_q      <= Fetch;
          end
        end
      endcase
      // The byte is on its way: the next one.
      if ((step_q == Send && (!out_valid_q || accepted) && !escape) || (step_q == Flipped && accepted)) begin
        index_q <= index_q + 1'b1;
        if (part_q == Header || part_q == Data) crc_q <= rt_board_pkg::crc_byte(crc_q, value_q);
        if (last) begin
          index_q <= '0;
          case (part_q)
            Open:    part_q <= Header;
            Header:  part_q <= data_bytes_i == '0 ? Crc : Data;
            Data:    part_q <= Crc;
            Crc:     part_q <= Close;
            default: part_q <= Idle;
          endcase
        end
      end
    end
    if (!rst_ni) begin
      part_q      <= Idle;
      out_valid_q <= 1'b0;
    end
  end

  `RT_ASSERT_STREAM(OutputHeld, out_valid_o, out_ready_i, out_data_o)
  `RT_ASSERT(StartWhileIdle, !start_i || !busy_o)
endmodule
