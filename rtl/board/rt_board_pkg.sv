// SPDX-License-Identifier: Apache-2.0
// What the modules of a board share: channels of the memory bus, numbers of the serial link.
//
// Purpose     One place for the link's codes; docs/serial-link.md explains them, testbench/driver/link_protocol.hpp has them for the host.
// Bus         The core's AXI4 with a bus of 8 bytes; behind rt_axi_mux ids are MuxIdBits wide, the upper bit says which master.
package rt_board_pkg;

  localparam int unsigned DataBits = 64;
  localparam int unsigned StrobeBits = DataBits / 8;
  localparam int unsigned AddrBits = rt_core_pkg::AddrBits;
  localparam int unsigned IdBits = rt_core_pkg::IdBits;
  localparam int unsigned Masters = 2;
  localparam int unsigned MuxIdBits = IdBits + 1;

  // Masters of the board's memory: the upper bit of an id behind the multiplexer.
  localparam int unsigned MasterCore = 0;
  localparam int unsigned MasterLink = 1;

  localparam logic [1:0] BurstIncr = 2'b01;
  localparam logic [2:0] SizeBeat = 3'd3;  // whole beats of 8 bytes
  localparam logic [1:0] RespOkay = 2'b00;
  localparam logic [1:0] RespSlvErr = 2'b10;
  localparam logic [1:0] RespDecErr = 2'b11;

  typedef struct packed {
    logic [MuxIdBits-1:0] id;
    logic [AddrBits-1:0]  addr;
    logic [7:0]           len;  // beats - 1
    logic [2:0]           size;
    logic [1:0]           burst;
  } address_t;

  typedef struct packed {
    logic [DataBits-1:0]   data;
    logic [StrobeBits-1:0] strb;
    logic                  last;
  } write_t;

  typedef struct packed {
    logic [MuxIdBits-1:0] id;
    logic [DataBits-1:0]  data;
    logic [1:0]           resp;
    logic                 last;
  } read_t;

  typedef struct packed {
    logic [MuxIdBits-1:0] id;
    logic [1:0]           resp;
  } answer_t;

  // --- serial link: framing of RFC 1662 (flag, escape, 32-bit check sequence) ---
  localparam logic [7:0] Flag = 8'h7e;
  localparam logic [7:0] Escape = 8'h7d;
  localparam logic [7:0] EscapeFlip = 8'h20;
  localparam logic [31:0] CrcInit = 32'hffff_ffff;
  localparam logic [31:0] CrcGood = 32'hdebb_20e3;  // register after a frame and its own check sequence
  localparam int unsigned CrcBytes = 4;

  // First byte of a frame: direction and version of the protocol.
  localparam logic [7:0] Request = 8'hd1;
  localparam logic [7:0] Response = 8'h51;
  localparam int unsigned RequestHeader = 5;   // kind, sequence, session
  localparam int unsigned ResponseHeader = 8;  // kind, sequence, session, status, position

  typedef enum logic [7:0] {
    OpOpen     = 8'h01,
    OpRegWrite = 8'h02,
    OpRegRead  = 8'h03,
    OpMemWrite = 8'h04,
    OpMemRead  = 8'h05,
    OpMemFill  = 8'h06,
    OpMemCrc   = 8'h07
  } op_e;

  typedef enum logic [7:0] {
    StatusOk        = 8'd0,
    StatusDamaged   = 8'd1,
    StatusVersion   = 8'd2,
    StatusSession   = 8'd3,
    StatusMalformed = 8'd4,
    StatusTooLong   = 8'd5,
    StatusBus       = 8'd6,
    StatusRegister  = 8'd7
  } status_e;

  // Registers of the board itself: bit 15 of a register's address, then four bytes each.
  localparam int unsigned BoardRegisters = 16;
  localparam logic [31:0] BoardId = 32'h4452_4252;  // 'RBRD'

  // CRC-32 of IEEE 802.3, reflected, one byte; starts with CrcInit, and what is sent is the complement.
  function automatic logic [31:0] crc_byte(logic [31:0] crc, logic [7:0] data);
    logic [31:0] c;
    c = crc ^ {24'b0, data};
    for (int i = 0; i < 8; i++) c = c[0] ? (c >> 1) ^ 32'hedb8_8320 : c >> 1;
    return c;
  endfunction

endpackage
