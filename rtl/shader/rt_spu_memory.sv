// SPDX-License-Identifier: Apache-2.0
// Memory operations of the shader unit: loads, stores and texture operations of its threads become requests at one port.
//
// Loads       Their addresses are checked by whoever sends them; four vectors are four requests.
// Texture     A picture (address, width, height) and a place: floor of both coordinates modulo the size by a division bit by bit, the row's address by a
//             multiplication bit by bit; all texels are checked before the first request.
// Wake        Stores wake their thread when the request is taken, a bad address wakes it with a fault; replies to reads go to the registers, not through here.
// Order       Loads and the others take turns. Requests of one thread keep their order, because a thread waits for each.
// Latency     A load 1 clock, a store 4, a texture operation about 60, loads overtake it.
// Counterpart spu_texture in hls/shader/spu.hpp.
`include "rt_assert.svh"
module rt_spu_memory (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  rt_spu_pkg::index_t    memory_vectors_i,
    input  logic                  load_valid_i,
    output logic                  load_ready_o,
    input  rt_spu_pkg::load_t     load_data_i,
    input  logic                  access_valid_i,
    output logic                  access_ready_o,
    input  rt_spu_pkg::access_t   access_data_i,
    output logic                  request_valid_o,
    input  logic                  request_ready_i,
    output rt_spu_pkg::request_t  request_data_o,
    output logic                  wake_o,
    output logic                  wake_fault_o,
    output rt_spu_pkg::thread_t   wake_thread_o
);
  import rt_spu_pkg::*;
  localparam int unsigned WideBits = 2 * AddressBits + 2;
  typedef logic [WideBits-1:0] wide_t;

  // ---- An access: its texels.
  typedef enum logic [2:0] {
    Idle,
    Read,
    Divide,
    Finish,
    Check,
    Send
  } state_e;
  state_e state_q;
  access_t access_q;
  index_t begin_q, width_q, height_q, x_q, y_q, rest_x_q, rest_y_q;
  wide_t row_q;
  logic [4:0] step_q;
  logic [1:0] part_q, port_part_q;
  logic is_store, four, none;
  assign is_store = 32'(access_q.op) == rt_shader_pkg::OpStore;
  assign four     = 32'(access_q.op) == rt_shader_pkg::OpTexload4x;
  assign none     = begin_q[AddressBits] || width_q[AddressBits] || height_q[AddressBits] || width_q == '0 || height_q == '0;

  // |floor(x)| of a coordinate; what no index can say counts as 0.
  function automatic index_t whole(rt_float_pkg::float_t x);
    index_t size;
    logic [rt_float_pkg::FractionBits:0] behind;
    rt_float_pkg::parts_t p;
    rt_float_pkg::exponent_t bits;
    p    = rt_float_pkg::read(x);
    bits = p.exponent - rt_float_pkg::exponent_t'(rt_float_pkg::Bias - 1);
    size = index_of('{negative: 1'b0, exponent: x.exponent, fraction: x.fraction});
    behind = bits <= 0 ? p.significand : bits >= rt_float_pkg::exponent_t'(AddressBits) ? '0 : p.significand << bits[4:0];
    if (x.negative && behind != '0) size = size + index_t'(1);
    return size[AddressBits] ? '0 : size;
  endfunction
  // A step of the division: the rest so far, the next bit of the dividend.
  function automatic index_t divide(index_t rest, logic next, index_t by);
    logic [AddressBits+1:0] wide;
    wide = {rest, next};
    return wide >= {1'b0, by} ? index_t'(wide - {1'b0, by}) : index_t'(wide);
  endfunction
  function automatic index_t wrapped(index_t rest, logic negative, index_t size);
    return negative && rest != '0 ? size - rest : rest;
  endfunction

  index_t right;
  wide_t below, texel[4], largest_row;
  logic fits;
  assign right       = x_q + index_t'(1) == width_q ? '0 : x_q + index_t'(1);
  assign below       = y_q + index_t'(1) == height_q ? wide_t'(begin_q) : row_q + wide_t'(width_q);
  assign texel       = '{row_q + wide_t'(x_q), row_q + wide_t'(right), below + wide_t'(x_q), below + wide_t'(right)};
  assign largest_row = four && below > row_q ? below : row_q;
  assign fits      = largest_row + (four && right > x_q ? wide_t'(right) : wide_t'(x_q)) < wide_t'(memory_vectors_i);

  // ---- The port: a load, or what an access sends.
  logic turn_q;  // an access was served last
  logic held_q, held_load_q;  // a request that was not taken stays
  logic load_chosen, access_sends, access_chosen, access_last, taken;
  assign access_sends    = state_q == Send;
  assign load_chosen     = held_q ? held_load_q : load_valid_i && (port_part_q != '0 || !access_sends || turn_q) && part_q == '0;
  assign access_chosen   = access_sends && !load_chosen;
  assign request_valid_o = load_chosen || access_chosen;
  assign taken           = request_valid_o && request_ready_i;
  assign load_ready_o    = taken && load_chosen && (!load_data_i.four || port_part_q == 2'd3);
  assign access_last     = !four || part_q == 2'd3;
  always_comb begin
    request_data_o = '{
        write: 1'b0,
        address: load_data_i.address + address_t'(port_part_q),
        data: access_chosen ? access_q.value : '0,
        tag: '{thread: load_data_i.thread, slot: load_data_i.slot + slot_t'(port_part_q), last: !load_data_i.four || port_part_q == 2'd3}
    };
    if (access_chosen) begin
      request_data_o.write   = is_store || 32'(access_q.op) == rt_shader_pkg::OpTexstore;
      request_data_o.address = is_store ? access_q.address : address_t'(texel[part_q]);
      request_data_o.tag     = '{thread: access_q.thread, slot: access_q.slot + slot_t'(part_q), last: access_last};
    end
  end

  assign access_ready_o = state_q == Idle;
  assign wake_thread_o  = access_q.thread;
  assign wake_fault_o   = (state_q == Divide && none) || (state_q == Check && !fits);
  assign wake_o         = wake_fault_o || (taken && access_chosen && request_data_o.write);

  always_ff @(posedge clk_i) begin
    held_q      <= request_valid_o && !request_ready_i;
    held_load_q <= load_chosen;
    if (taken) begin
      turn_q <= access_chosen;
      if (load_chosen) port_part_q <= load_ready_o ? '0 : port_part_q + 1'b1;
    end
    case (state_q)
      Idle: begin
        access_q <= access_data_i;
        part_q   <= '0;
        if (access_valid_i) state_q <= Read;
      end
      Read: begin
        begin_q  <= index_of(access_q.picture[0]);
        width_q  <= index_of(access_q.picture[1]);
        height_q <= index_of(access_q.picture[2]);
        x_q      <= whole(access_q.place[0]);
        y_q      <= whole(access_q.place[1]);
        rest_x_q <= '0;
        rest_y_q <= '0;
        step_q   <= 5'(AddressBits);
        state_q  <= is_store ? Send : Divide;
      end
      Divide: begin
        rest_x_q <= divide(rest_x_q, x_q[AddressBits-1], width_q);
        rest_y_q <= divide(rest_y_q, y_q[AddressBits-1], height_q);
        x_q      <= x_q << 1;
        y_q      <= y_q << 1;
        step_q   <= step_q - 1'b1;
        if (step_q == '0) begin  // the clock behind the last bit
          x_q     <= wrapped(rest_x_q, access_q.place[0].negative, width_q);
          y_q     <= wrapped(rest_y_q, access_q.place[1].negative, height_q);
          row_q   <= '0;
          step_q  <= 5'(AddressBits);
          state_q <= Finish;
        end
        if (none) state_q <= Idle;
      end
      Finish: begin  // the row's address: y times the width, the highest bit first, and the begin
        row_q  <= (row_q << 1) + (y_q[step_q-5'd1] ? wide_t'(width_q) : '0);
        step_q <= step_q - 1'b1;
        if (step_q == '0) begin
          row_q   <= row_q + wide_t'(begin_q);
          state_q <= Check;
        end
      end
      Check: state_q <= fits ? Send : Idle;
      default: begin
        if (taken && access_chosen) begin
          part_q <= access_last ? '0 : part_q + 1'b1;
          if (access_last) state_q <= Idle;
        end
      end
    endcase
    if (!rst_ni) begin
      state_q     <= Idle;
      held_q      <= 1'b0;
      part_q      <= '0;
      port_part_q <= '0;
      turn_q      <= 1'b0;
    end
  end

  `RT_ASSERT_STREAM(RequestHeld, request_valid_o, request_ready_i, request_data_o)
endmodule
