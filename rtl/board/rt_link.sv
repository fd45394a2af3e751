// SPDX-License-Identifier: Apache-2.0
// The board's end of the serial link: carries out the operations of a frame and answers with one. Protocol: docs/serial-link.md.
//
// Frames      One at a time: while a frame is carried out and answered, what arrives is dropped (rt_link_rx); the host waits for its answer.
//             A damaged frame is answered with StatusDamaged and changes nothing, not even what is kept for a repetition.
// Once        The last frame that was carried out is known by session, sequence and check sequence; if it comes again, its answer is sent
//             again and nothing else happens. So a host may repeat a frame until it has the answer, also one that starts a run. What is not
//             carried out at all (damaged, of another version or session) is answered beside what is kept.
// Session     Frames of another session than the one that OpOpen began are refused (StatusSession), whatever is in them: after a reset, or when a
//             second host has taken over, nothing is carried out by mistake.
// Operations  In order; the first that fails ends the frame with its status and position, the ones before it have happened.
// Registers   AXI4-Lite master, one access at a time. Bit 15 of an address means the board's own registers, which are read only.
// Memory      AXI4 master, single beats of 8 bytes, one at a time, id 0. A write is offered address and data together.
// Buffers     A frame (BufferBytes with its check sequence) and an answer's data (as many) in block RAM.
`include "rt_assert.svh"
module rt_link #(
    parameter int unsigned BufferBytes = 2048,
    parameter int unsigned MemoryBytes = 32768,
    parameter logic [rt_board_pkg::AddrBits-1:0] MemoryBase = '0,
    parameter int unsigned ClockHz = 80_000_000,
    localparam int unsigned RegAddrBits = rt_regs_pkg::RT_REGS_MIN_ADDR_WIDTH
) (
    input  logic                   clk_i,
    input  logic                   rst_ni,
    // Bytes of the serial line.
    input  logic                   in_valid_i,
    input  logic [7:0]             in_data_i,
    input  logic                   in_error_i,
    output logic                   out_valid_o,
    input  logic                   out_ready_i,
    output logic [7:0]             out_data_o,
    // State of the core, for the board's registers.
    input  logic                   irq_i,
    // For lamps: one clock each.
    output logic                   good_o,
    output logic                   bad_o,
    // AXI4-Lite master.
    output logic                   axil_aw_valid_o,
    input  logic                   axil_aw_ready_i,
    output logic [RegAddrBits-1:0] axil_aw_addr_o,
    output logic                   axil_w_valid_o,
    input  logic                   axil_w_ready_i,
    output logic [31:0]            axil_w_data_o,
    input  logic                   axil_b_valid_i,
    output logic                   axil_b_ready_o,
    input  logic [1:0]             axil_b_resp_i,
    output logic                   axil_ar_valid_o,
    input  logic                   axil_ar_ready_i,
    output logic [RegAddrBits-1:0] axil_ar_addr_o,
    input  logic                   axil_r_valid_i,
    output logic                   axil_r_ready_o,
    input  logic [31:0]            axil_r_data_i,
    input  logic [1:0]             axil_r_resp_i,
    // AXI4 master.
    output logic                   ar_valid_o,
    input  logic                   ar_ready_i,
    output rt_board_pkg::address_t ar_o,
    input  logic                   r_valid_i,
    output logic                   r_ready_o,
    input  rt_board_pkg::read_t    r_i,
    output logic                   aw_valid_o,
    input  logic                   aw_ready_i,
    output rt_board_pkg::address_t aw_o,
    output logic                   w_valid_o,
    input  logic                   w_ready_i,
    output rt_board_pkg::write_t   w_o,
    input  logic                   b_valid_i,
    output logic                   b_ready_o,
    input  rt_board_pkg::answer_t  b_i
);
  localparam int unsigned PtrBits = $clog2(BufferBytes);
  localparam int unsigned CountBits = $clog2(BufferBytes + 1);
  localparam int unsigned CountOfOperation = 16;
  localparam int unsigned ArgumentBytes = 15;  // of the longest: address 5, count 2, pattern 8
  localparam int unsigned WordBytes = 8;

  `RT_ASSERT_INIT(BufferIsRam, BufferBytes == 32'd1 << PtrBits && BufferBytes >= 64 && BufferBytes <= 32768)

  // ------------------------------------------------------------------------------------------------------------ frames in and out
  logic take, good, bad, too_long;
  logic frame_write, frame_read, answer_write, answer_read;
  logic [PtrBits-1:0] frame_write_addr, frame_read_addr, answer_write_addr, answer_read_addr;
  logic [7:0] frame_write_data, frame_data, answer_write_data, answer_data;
  logic [CountBits-1:0] frame_bytes;
  logic [31:0] frame_crc;
  logic tx_start, tx_busy;

  rt_link_rx #(
      .BufferBytes(BufferBytes)
  ) u_rx (
      .clk_i,
      .rst_ni,
      .take_i      (take),
      .in_valid_i,
      .in_data_i,
      .in_error_i,
      .write_en_o  (frame_write),
      .write_addr_o(frame_write_addr),
      .write_data_o(frame_write_data),
      .good_o      (good),
      .bad_o       (bad),
      .long_o      (too_long),
      .bytes_o     (frame_bytes),
      .crc_o       (frame_crc)
  );
  rt_ram_sdp #(
      .Depth (BufferBytes),
      .data_t(logic [7:0])
  ) u_frame (
      .clk_i,
      .rst_ni,
      .write_en_i  (frame_write),
      .write_addr_i(frame_write_addr),
      .write_data_i(frame_write_data),
      .read_en_i   (frame_read),
      .read_addr_i (frame_read_addr),
      .read_data_o (frame_data)
  );
  rt_ram_sdp #(
      .Depth (BufferBytes),
      .data_t(logic [7:0])
  ) u_answer (
      .clk_i,
      .rst_ni,
      .write_en_i  (answer_write),
      .write_addr_i(answer_write_addr),
      .write_data_i(answer_write_data),
      .read_en_i   (answer_read),
      .read_addr_i (answer_read_addr),
      .read_data_o (answer_data)
  );

  // ------------------------------------------------------------------------------------------------------------ one frame
  typedef enum logic [4:0] {
    Idle,
    Head,       // collect the header
    Judge,      // version, repetition, session
    Operation,  // collect an opcode, or end
    Arguments,
    Begin,
    WriteData,  // collect a word of the frame
    MemWrite,
    MemRead,
    RegWrite,
    RegRead,
    BoardRead,
    Emit,       // bytes of a word into the answer
    CrcBytes,
    Next,       // the next word of an operation
    Send,
    Sending
  } state_e;

  state_e state_q;
  logic [CountBits-1:0] ptr_q;          // next byte of the frame
  logic reading_q;                      // the buffer is about to give the byte at ptr_q
  logic fetched_q;                      // frame_byte_q is the byte at ptr_q; block RAM is too slow to decide on what it gives
  logic [7:0] frame_byte_q;
  logic need, have, at_end;             // the state wants a byte; it is there; there is none
  logic [CountBits-1:0] answer_q;       // bytes of data in the answer
  logic [3:0] index_q;                  // byte within header, arguments or word
  logic [rt_board_pkg::RequestHeader*8-1:0] head_q;
  logic [7:0] opcode_q;
  logic [ArgumentBytes*8-1:0] arguments_q;
  logic [3:0] arguments_left;
  logic [rt_board_pkg::DataBits-1:0] word_q;
  logic [3:0] emit_bytes_q;
  logic [rt_board_pkg::AddrBits-1:0] address_q;
  logic [15:0] reg_address_q;
  logic [CountOfOperation-1:0] left_q;
  logic [31:0] crc_q;
  rt_board_pkg::status_e status_q;
  logic [15:0] position_q;
  logic beside_q;                       // the answer to send has beside_status_q and no data, beside what is kept
  rt_board_pkg::status_e beside_status_q;
  logic damaged;
  assign damaged = beside_q && beside_status_q == rt_board_pkg::StatusDamaged;

  // What is kept for a repetition.
  logic [15:0] session_q;
  logic session_valid_q, last_valid_q;
  logic [31:0] last_head_q;  // sequence, session
  logic [31:0] last_crc_q;

  logic repeated, foreign, first;
  assign foreign  = !(session_valid_q && session_q == head_q[39:24]);  // in Operation only before the first: an OpOpen ends it
  assign first    = ptr_q == CountBits'(rt_board_pkg::RequestHeader);  // operation
  assign repeated = last_valid_q && last_head_q == head_q[39:8] && last_crc_q == frame_crc;

  assign take            = state_q == Idle;
  assign need            = state_q == Head || state_q == Operation || state_q == Arguments || state_q == WriteData;
  assign at_end          = ptr_q == frame_bytes;
  assign have            = need && fetched_q;
  assign frame_read      = need && !reading_q && !fetched_q && !at_end;
  assign frame_read_addr = PtrBits'(ptr_q);

  always_comb begin
    case (opcode_q)
      rt_board_pkg::OpOpen:                                                           arguments_left = 4'd0;
      rt_board_pkg::OpRegWrite:                                                       arguments_left = 4'd6;
      rt_board_pkg::OpRegRead:                                                        arguments_left = 4'd4;
      rt_board_pkg::OpMemFill:                                                        arguments_left = 4'd15;
      default:                                                                        arguments_left = 4'd7;
    endcase
  end

  // --- board registers ---
  logic [31:0] board[rt_board_pkg::BoardRegisters];
  logic [31:0] runs_q, clocks_q, frames_q, damaged_frames_q, long_frames_q, repeated_frames_q, refused_frames_q, spoilt_bytes_q;
  logic irq_q;
  always_comb begin
    for (int i = 0; i < int'(rt_board_pkg::BoardRegisters); i++) board[i] = '0;
    board[0]  = rt_board_pkg::BoardId;
    board[1]  = {16'(BufferBytes - rt_board_pkg::CrcBytes), 8'(rt_contract_pkg::ImageVersion), rt_board_pkg::Request};
    board[2]  = 32'(MemoryBase);
    board[3]  = 32'(MemoryBase >> 32);
    board[4]  = MemoryBytes;
    board[5]  = ClockHz;
    board[6]  = {31'b0, irq_q};
    board[7]  = runs_q;
    board[8]  = clocks_q;
    board[9]  = frames_q;
    board[10] = damaged_frames_q;
    board[11] = long_frames_q;
    board[12] = repeated_frames_q;
    board[13] = refused_frames_q;
    board[14] = spoilt_bytes_q;
  end
  always_ff @(posedge clk_i) begin
    clocks_q <= clocks_q + 1'b1;
    irq_q    <= irq_i;
    if (irq_i && !irq_q) runs_q <= runs_q + 1'b1;
    if (good) frames_q <= frames_q + 1'b1;
    if (bad) damaged_frames_q <= damaged_frames_q + 1'b1;
    if (bad && too_long) long_frames_q <= long_frames_q + 1'b1;
    if (state_q == Judge && repeated) repeated_frames_q <= repeated_frames_q + 1'b1;
    if (state_q == Send && (beside_q ? !damaged : status_q != rt_board_pkg::StatusOk)) refused_frames_q <= refused_frames_q + 1'b1;
    if (in_valid_i && in_error_i) spoilt_bytes_q <= spoilt_bytes_q + 1'b1;
    if (!rst_ni) begin
      clocks_q          <= '0;
      irq_q             <= 1'b0;
      runs_q            <= '0;
      frames_q          <= '0;
      damaged_frames_q  <= '0;
      long_frames_q     <= '0;
      repeated_frames_q <= '0;
      refused_frames_q  <= '0;
      spoilt_bytes_q    <= '0;
    end
  end

  // --- the walk through the frame ---
  logic [7:0] first_byte;
  logic emit_fits;
  assign first_byte = head_q[7:0];
  assign emit_fits  = {1'b0, answer_q} + (CountBits + 1)'(emit_bytes_q) <= (CountBits + 1)'(BufferBytes);

  assign answer_write      = state_q == Emit && emit_fits;
  assign answer_write_addr = PtrBits'(answer_q + CountBits'(index_q));
  assign answer_write_data = word_q[8*index_q[2:0]+:8];

  logic aw_valid_q, w_valid_q, ar_valid_q, lite_aw_valid_q, lite_w_valid_q, lite_ar_valid_q;
  assign tx_start = state_q == Send;
  assign good_o   = good;
  assign bad_o    = bad;

  always_ff @(posedge clk_i) begin
    reading_q <= frame_read;
    if (reading_q) begin
      fetched_q    <= 1'b1;
      frame_byte_q <= frame_data;
    end
    if (have) begin
      fetched_q <= 1'b0;
      ptr_q     <= ptr_q + 1'b1;
    end
    if (aw_ready_i) aw_valid_q <= 1'b0;
    if (w_ready_i) w_valid_q <= 1'b0;
    if (ar_ready_i) ar_valid_q <= 1'b0;
    if (axil_aw_ready_i) lite_aw_valid_q <= 1'b0;
    if (axil_w_ready_i) lite_w_valid_q <= 1'b0;
    if (axil_ar_ready_i) lite_ar_valid_q <= 1'b0;

    case (state_q)
      Idle: begin
        ptr_q     <= '0;
        index_q   <= '0;
        reading_q <= 1'b0;
        fetched_q <= 1'b0;
        beside_q        <= bad;
        beside_status_q <= rt_board_pkg::StatusDamaged;
        if (good) state_q <= Head;
        if (bad) state_q <= Send;
      end

      Head: begin
        if (have) begin
          head_q[8*index_q[2:0]+:8] <= frame_byte_q;
          index_q                   <= index_q + 1'b1;
          if (index_q == 4'(rt_board_pkg::RequestHeader - 1)) state_q <= Judge;
        end
      end

      Judge: begin
        if (repeated) begin
          state_q <= Send;
        end else if (first_byte != rt_board_pkg::Request) begin
          beside_q        <= 1'b1;
          beside_status_q <= rt_board_pkg::StatusVersion;
          state_q         <= Send;
        end else begin
          state_q <= Operation;
        end
      end

      Operation: begin
        index_q <= '0;
        if (have || (at_end && !fetched_q)) begin
          if (foreign && !(have && frame_byte_q == rt_board_pkg::OpOpen)) begin
            beside_q        <= 1'b1;
            beside_status_q <= rt_board_pkg::StatusSession;
            state_q         <= Send;
          end else begin
            opcode_q   <= frame_byte_q;
            position_q <= 16'(ptr_q);
            state_q    <= have ? Arguments : Send;
            if (first) begin
              last_valid_q <= 1'b1;
              last_head_q  <= head_q[39:8];
              last_crc_q   <= frame_crc;
              answer_q     <= '0;
              status_q     <= rt_board_pkg::StatusOk;
            end
            if (have && (frame_byte_q < rt_board_pkg::OpOpen || frame_byte_q > rt_board_pkg::OpMemCrc)) begin
              status_q <= rt_board_pkg::StatusMalformed;
              state_q  <= Send;
            end
          end
        end
      end

      Arguments: begin
        if (index_q == arguments_left) begin
          // A byte that was fetched too early stays where it is.
          state_q <= Begin;
          if (have) begin
            fetched_q <= 1'b1;
            ptr_q     <= ptr_q;
          end
        end else if (have) begin
          arguments_q[8*index_q+:8] <= frame_byte_q;
          index_q                   <= index_q + 1'b1;
        end else if (at_end && !fetched_q) begin
          status_q <= rt_board_pkg::StatusMalformed;
          state_q  <= Send;
        end
      end

      Begin: begin
        index_q       <= '0;
        address_q     <= arguments_q[39:0];
        left_q        <= arguments_q[55:40];
        reg_address_q <= arguments_q[15:0];
        word_q        <= arguments_q[119:56];
        crc_q         <= rt_board_pkg::CrcInit;
        emit_bytes_q  <= 4'd8;
        case (opcode_q)
          rt_board_pkg::OpOpen: begin
            session_q       <= head_q[39:24];
            session_valid_q <= 1'b1;
            state_q         <= Operation;
          end
          rt_board_pkg::OpRegWrite: begin
            if (arguments_q[15:RegAddrBits] != '0 || arguments_q[1:0] != '0) begin
              status_q <= rt_board_pkg::StatusRegister;
              state_q  <= Send;
            end else begin
              lite_aw_valid_q <= 1'b1;
              lite_w_valid_q  <= 1'b1;
              state_q         <= RegWrite;
            end
          end
          rt_board_pkg::OpRegRead: begin
            left_q       <= arguments_q[31:16];
            emit_bytes_q <= 4'd4;
            state_q      <= Next;
          end
          default: state_q <= Next;
        endcase
      end

      // One more word, or the end of the operation.
      Next: begin
        index_q <= '0;
        if (left_q == '0) begin
          state_q <= Operation;
          if (opcode_q == rt_board_pkg::OpMemCrc && emit_bytes_q == 4'd8) begin
            word_q       <= {32'b0, ~crc_q};
            emit_bytes_q <= 4'd4;
            state_q      <= Emit;
          end
        end else begin
          left_q <= left_q - 1'b1;
          case (opcode_q)
            rt_board_pkg::OpRegRead: begin
              if (reg_address_q[1:0] != '0 || (!reg_address_q[15] && reg_address_q[14:RegAddrBits] != '0) ||
                  (reg_address_q[15] && reg_address_q[14:2] >= 13'(rt_board_pkg::BoardRegisters))) begin
                status_q <= rt_board_pkg::StatusRegister;
                state_q  <= Send;
              end else if (reg_address_q[15]) begin
                state_q <= BoardRead;
              end else begin
                lite_ar_valid_q <= 1'b1;
                state_q         <= RegRead;
              end
            end
            rt_board_pkg::OpMemWrite: state_q <= WriteData;
            rt_board_pkg::OpMemFill: begin
              aw_valid_q <= 1'b1;
              w_valid_q  <= 1'b1;
              state_q    <= MemWrite;
            end
            default: begin
              ar_valid_q <= 1'b1;
              state_q    <= MemRead;
            end
          endcase
        end
      end

      WriteData: begin
        if (have) begin
          word_q[8*index_q[2:0]+:8] <= frame_byte_q;
          index_q                   <= index_q + 1'b1;
          if (index_q == 4'(WordBytes - 1)) begin
            aw_valid_q <= 1'b1;
            w_valid_q  <= 1'b1;
            state_q    <= MemWrite;
          end
        end else if (at_end && !fetched_q) begin
          status_q <= rt_board_pkg::StatusMalformed;
          state_q  <= Send;
        end
      end

      MemWrite: begin
        if (b_valid_i) begin
          address_q <= address_q + rt_board_pkg::AddrBits'(WordBytes);
          state_q   <= Next;
          if (b_i.resp[1]) begin
            status_q <= rt_board_pkg::StatusBus;
            state_q  <= Send;
          end
        end
      end

      MemRead: begin
        if (r_valid_i) begin
          address_q <= address_q + rt_board_pkg::AddrBits'(WordBytes);
          word_q    <= r_i.data;
          state_q   <= opcode_q == rt_board_pkg::OpMemCrc ? CrcBytes : Emit;
          if (r_i.resp[1]) begin
            status_q <= rt_board_pkg::StatusBus;
            state_q  <= Send;
          end
        end
      end

      RegWrite: begin
        if (axil_b_valid_i) begin
          state_q <= Operation;
          if (axil_b_resp_i[1]) begin
            status_q <= rt_board_pkg::StatusBus;
            state_q  <= Send;
          end
        end
      end

      RegRead: begin
        if (axil_r_valid_i) begin
          reg_address_q <= reg_address_q + 16'd4;
          word_q        <= {32'b0, axil_r_data_i};
          state_q       <= Emit;
          if (axil_r_resp_i[1]) begin
            status_q <= rt_board_pkg::StatusBus;
            state_q  <= Send;
          end
        end
      end

      BoardRead: begin
        reg_address_q <= reg_address_q + 16'd4;
        word_q        <= {32'b0, board[reg_address_q[5:2]]};
        state_q       <= Emit;
      end

      Emit: begin
        if (!emit_fits) begin
          status_q <= rt_board_pkg::StatusTooLong;
          state_q  <= Send;
        end else begin
          index_q <= index_q + 1'b1;
          if (index_q == emit_bytes_q - 1'b1) begin
            answer_q <= answer_q + CountBits'(emit_bytes_q);
            state_q  <= Next;
          end
        end
      end

      CrcBytes: begin
        crc_q   <= rt_board_pkg::crc_byte(crc_q, word_q[7:0]);
        word_q  <= word_q >> 8;
        index_q <= index_q + 1'b1;
        if (index_q == 4'(WordBytes - 1)) state_q <= Next;
      end

      Send: state_q <= Sending;
      default: if (!tx_busy) state_q <= Idle;
    endcase

    if (!rst_ni) begin
      state_q         <= Idle;
      aw_valid_q      <= 1'b0;
      w_valid_q       <= 1'b0;
      ar_valid_q      <= 1'b0;
      lite_aw_valid_q <= 1'b0;
      lite_w_valid_q  <= 1'b0;
      lite_ar_valid_q <= 1'b0;
      session_valid_q <= 1'b0;
      last_valid_q    <= 1'b0;
      answer_q        <= '0;
    end
  end

  // --- the answer ---
  rt_link_tx #(
      .BufferBytes(BufferBytes)
  ) u_tx (
      .clk_i,
      .rst_ni,
      .start_i     (tx_start),
      .busy_o      (tx_busy),
      .sequence_i  (damaged ? 16'b0 : head_q[23:8]),
      .session_i   (damaged ? 16'b0 : head_q[39:24]),
      .status_i    (beside_q ? beside_status_q : status_q),
      .position_i  (damaged ? 16'b0 : beside_q ? 16'(rt_board_pkg::RequestHeader) : position_q),
      .data_bytes_i(beside_q ? '0 : answer_q),
      .read_en_o   (answer_read),
      .read_addr_o (answer_read_addr),
      .read_data_i (answer_data),
      .out_valid_o,
      .out_ready_i,
      .out_data_o
  );

  // --- buses ---
  rt_board_pkg::address_t address;
  assign address = '{id: '0, addr: address_q, len: '0, size: rt_board_pkg::SizeBeat, burst: rt_board_pkg::BurstIncr};
  assign ar_valid_o      = ar_valid_q;
  assign ar_o            = address;
  assign r_ready_o       = 1'b1;
  assign aw_valid_o      = aw_valid_q;
  assign aw_o            = address;
  assign w_valid_o       = w_valid_q;
  assign w_o             = '{data: word_q, strb: '1, last: 1'b1};
  assign b_ready_o       = 1'b1;
  assign axil_aw_valid_o = lite_aw_valid_q;
  assign axil_aw_addr_o  = reg_address_q[RegAddrBits-1:0];
  assign axil_w_valid_o  = lite_w_valid_q;
  assign axil_w_data_o   = arguments_q[47:16];
  assign axil_b_ready_o  = 1'b1;
  assign axil_ar_valid_o = lite_ar_valid_q;
  assign axil_ar_addr_o  = reg_address_q[RegAddrBits-1:0];
  assign axil_r_ready_o  = 1'b1;

  `RT_ASSERT_STREAM(ReadAddressHeld, ar_valid_o, ar_ready_i, ar_o)
  `RT_ASSERT_STREAM(WriteAddressHeld, aw_valid_o, aw_ready_i, aw_o)
  `RT_ASSERT_STREAM(WriteDataHeld, w_valid_o, w_ready_i, w_o)
  `RT_ASSERT_STREAM(RegisterWriteHeld, axil_w_valid_o, axil_w_ready_i, axil_w_data_o)
  `RT_ASSERT_STREAM(RegisterReadHeld, axil_ar_valid_o, axil_ar_ready_i, axil_ar_addr_o)
  `RT_ASSERT(ReadIsExpected, !r_valid_i || state_q == MemRead)
  `RT_ASSERT(AnswerIsExpected, !b_valid_i || state_q == MemWrite)
  `RT_ASSERT(FrameNotOverread, ptr_q <= frame_bytes || state_q == Idle)
endmodule
