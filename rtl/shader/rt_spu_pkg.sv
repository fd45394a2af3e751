// SPDX-License-Identifier: Apache-2.0
// Records of the shader unit's machine and what its modules know of an instruction.
//
// Slots       A thread's registers: 64 of the stack, which the window moves over, then those from I0 to HIT, P, ADDR, and one of the machine's own.
// Counterpart hls/shader/spu.hpp.
package rt_spu_pkg;

  localparam int unsigned MaxThreads = 64;
  localparam int unsigned ThreadBits = $clog2(MaxThreads);
  localparam int unsigned SlotBits = 7;
  localparam int unsigned FixedSlot = rt_shader_pkg::StackRegisters;  // of I0
  localparam int unsigned SlotS = FixedSlot + rt_shader_pkg::RegisterS - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotA = FixedSlot + rt_shader_pkg::RegisterA - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotO = FixedSlot + rt_shader_pkg::RegisterO - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotH = FixedSlot + rt_shader_pkg::RegisterH - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotE0 = FixedSlot + rt_shader_pkg::RegisterE0 - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotE1 = FixedSlot + rt_shader_pkg::RegisterE1 - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotE2 = FixedSlot + rt_shader_pkg::RegisterE2 - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotHit = FixedSlot + rt_shader_pkg::RegisterHit - rt_shader_pkg::RegisterI0;
  localparam int unsigned SlotP = SlotHit + 1;
  localparam int unsigned SlotAddr = SlotP + 1;
  localparam int unsigned SlotScratch = SlotAddr + 1;  // direction of a ray, vectors on the way to a material
  localparam int unsigned PlaceBits = 11;  // one more than an address of the program: behind its end
  localparam int unsigned WindowBits = 6;
  localparam int unsigned DepthBits = 5;
  localparam int unsigned AddressBits = rt_shader_pkg::IndexBits;
  // Operand registers, the longest operation, the choice of the result.
  localparam int unsigned VectorLatency = rt_float_pkg::DotLatency + 2;
  localparam int unsigned Phases = 4;  // clocks from one instruction to the next

  typedef rt_float_pkg::float_t [3:0] vector_t;
  typedef logic [ThreadBits-1:0] thread_t;
  typedef logic [SlotBits-1:0] slot_t;
  typedef logic [PlaceBits-1:0] place_t;
  typedef logic [WindowBits-1:0] window_t;
  typedef logic [AddressBits-1:0] address_t;
  typedef logic [AddressBits:0] index_t;  // 2^24: none
  typedef logic [2:0] status_t;

  // What the host sets before threads run.
  typedef struct packed {
    place_t      length;            // of the program
    place_t      start;
    logic [31:0] step_limit;
    index_t      memory_vectors;
    address_t    triangles;
    logic [7:0]  triangle_vectors;
    address_t    object;
  } setting_t;
  // A word of the program or a constant.
  typedef struct packed {
    logic         constant;
    logic [9:0]   address;
    logic [127:0] data;
  } write_t;

  typedef struct packed {
    logic [7:0]  code;
    status_t     status;
    logic [31:0] steps;
    vector_t     colour;
    vector_t     parameters;
  } result_t;
  typedef struct packed {
    thread_t                    thread;
    logic                       any;
    rt_float_pkg::float_t       t_max;
    rt_float_pkg::float_t       t_min;
    rt_float_pkg::float_t [2:0] direction;
    rt_float_pkg::float_t [2:0] origin;
  } ray_t;
  typedef struct packed {
    thread_t              thread;
    logic                 hit;
    address_t             id;
    rt_float_pkg::float_t v;
    rt_float_pkg::float_t u;
    rt_float_pkg::float_t t;
  } answer_t;

  // Memory: requests are done in their order; answers to a thread's reads come in theirs.
  typedef struct packed {
    thread_t thread;
    slot_t   slot;
    logic    last;  // the thread goes on
  } tag_t;
  typedef struct packed {
    logic     write;
    address_t address;
    vector_t  data;
    tag_t     tag;
  } request_t;
  typedef struct packed {
    tag_t    tag;
    vector_t data;
  } reply_t;

  // For simulation: an instruction begins, when all writes of the one before are done; components of a register are written.
  typedef struct packed {
    logic        begins;
    thread_t     thread;
    place_t      place;
    window_t     window;
    logic [4:0]  depth;
    logic [31:0] steps;
    logic        writes;
    thread_t     write_thread;
    slot_t       slot;
    logic [3:0]  mask;
    vector_t     data;
  } event_t;

  // An instruction passes the pipe once, except: a second operation `trace` (its direction is reciprocal), `material` (two loads, then the call), and once
  // more for the result of a thread that has ended.
  typedef enum logic [2:0] {
    PassFirst,
    PassDirection,
    PassRay,
    PassTriangle,
    PassMaterial,
    PassEnter,
    PassEnd
  } pass_e;

  typedef struct packed {
    pass_e             pass;
    place_t            place;
    window_t           window;
    logic [DepthBits-1:0] depth;
    logic [31:0]       steps;
    logic [3:0][3:0]   classes;  // of the last first operation's result
    status_t           status;
    logic [7:0]        code;
  } context_t;
  typedef struct packed {
    place_t  place;
    window_t window;
  } return_t;

  typedef struct packed {
    thread_t  thread;
    address_t address;
    logic     four;
    slot_t    slot;
  } load_t;
  // A store, or a texture operation: `vector` is its picture, `place` where in it.
  typedef struct packed {
    thread_t                    thread;
    logic [4:0]                 op;
    address_t                   address;
    rt_float_pkg::float_t [2:0] picture;
    rt_float_pkg::float_t [1:0] place;
    slot_t                      slot;
    vector_t                    value;
  } access_t;

  function automatic logic is_arithmetic(logic [4:0] op);
    return 32'(op) >= rt_shader_pkg::OpMov && 32'(op) <= rt_shader_pkg::OpDp4;
  endfunction
  function automatic logic second_is_arithmetic(logic [3:0] second);
    return 32'(second) >= rt_shader_pkg::SecondMov && 32'(second) <= rt_shader_pkg::SecondMad;
  endfunction
  function automatic logic is_texture(logic [4:0] op);
    return 32'(op) >= rt_shader_pkg::OpTexload && 32'(op) <= rt_shader_pkg::OpTexstore;
  endfunction
  function automatic logic [1:0] sources(logic [4:0] op);
    case (32'(op))
      rt_shader_pkg::OpNop: return 2'd0;
      rt_shader_pkg::OpMov, rt_shader_pkg::OpFrac, rt_shader_pkg::OpStore: return 2'd1;
      rt_shader_pkg::OpMad, rt_shader_pkg::OpTexstore, rt_shader_pkg::OpTrace: return 2'd3;
      default: return 2'd2;
    endcase
  endfunction
  function automatic logic [1:0] second_sources(logic [3:0] second);
    return second_is_arithmetic(second) ? sources({1'b0, second}) : 2'd0;
  endfunction
  function automatic logic writable(logic [5:0] code);
    return 32'(code) <= rt_shader_pkg::RegisterHit || 32'(code) == rt_shader_pkg::RegisterAddr;
  endfunction
  function automatic logic readable(logic [6:0] code);
    return 32'(code) <= rt_shader_pkg::RegisterC ||
        (32'(code) >= rt_shader_pkg::RegisterConstants && 32'(code) < rt_shader_pkg::RegisterConstants + rt_shader_pkg::Constants);
  endfunction

  function automatic logic [5:0] second_target(logic [15:0] payload);
    return payload[rt_shader_pkg::ArithmeticTargetAt+:rt_shader_pkg::ArithmeticTargetBits];
  endfunction
  function automatic logic [3:0] second_mask(logic [15:0] payload);
    return payload[rt_shader_pkg::ArithmeticMaskAt+:rt_shader_pkg::ArithmeticMaskBits];
  endfunction

  // Whether the machine knows the instruction.
  function automatic logic known(rt_shader_pkg::instruction_t in);
    logic arithmetic, special;
    logic [2:0] count;
    arithmetic = is_arithmetic(in.op);
    special    = 32'(in.modifier) == rt_shader_pkg::ModifierRcp || 32'(in.modifier) == rt_shader_pkg::ModifierRsq;
    count      = 3'(sources(in.op)) + 3'(second_sources(in.second));
    known      = 32'(in.op) <= rt_shader_pkg::OpTrace && 32'(in.second) <= rt_shader_pkg::SecondStore;
    if (32'(in.modifier) != rt_shader_pkg::ModifierNone && !arithmetic) known = 1'b0;
    if ((32'(in.op) == rt_shader_pkg::OpStore) != (32'(in.second) == rt_shader_pkg::SecondStore)) known = 1'b0;
    if ((is_texture(in.op) || 32'(in.op) == rt_shader_pkg::OpTrace) && 32'(in.second) != rt_shader_pkg::SecondNone) known = 1'b0;
    if (arithmetic && !writable(in.target)) known = 1'b0;
    if (32'(in.op) == rt_shader_pkg::OpTexload && in.target[5:2] != 4'(rt_shader_pkg::RegisterI0 / 4)) known = 1'b0;
    if (second_is_arithmetic(in.second)) begin
      if (!writable(second_target(in.payload))) known = 1'b0;
      if ((second_mask(in.payload) & in.mask) != '0) begin
        if (arithmetic && second_target(in.payload) == in.target) known = 1'b0;
        if (special && 32'(second_target(in.payload)) == rt_shader_pkg::RegisterS) known = 1'b0;
      end
    end
    if (count > 3'd3) known = 1'b0;
    if (count >= 3'd1 && in.a.immediate == '0 && !readable(in.a.index)) known = 1'b0;
    if (count >= 3'd2 && in.b.immediate == '0 && !readable(in.b.index)) known = 1'b0;
    if (count >= 3'd3 && in.c.immediate == '0 && !readable(in.c.index)) known = 1'b0;
  endfunction

  // A register below 64: beyond the stack, and its slot.
  function automatic logic [SlotBits:0] slot_of(logic [5:0] code, window_t window);
    logic [SlotBits-1:0] moved;
    moved = SlotBits'(code[3:0]) + SlotBits'(window);
    if (32'(code) < rt_shader_pkg::Registers) return {32'(moved) >= rt_shader_pkg::StackRegisters, moved};
    return {1'b0, SlotBits'(32'(code) + FixedSlot - rt_shader_pkg::RegisterI0)};
  endfunction
  function automatic logic source_overflows(rt_shader_pkg::source_t source, window_t window);
    logic [SlotBits:0] slot;
    slot = slot_of(source.index[5:0], window);
    return source.immediate == '0 && !source.index[6] && slot[SlotBits];
  endfunction

  function automatic vector_t spread(rt_float_pkg::float_t x);
    return {4{x}};
  endfunction

  // x times 1, 2, 4, 0.5; a canonical number.
  function automatic rt_float_pkg::float_t scale(rt_float_pkg::float_t x, logic [1:0] by);
    rt_float_pkg::parts_t      p;
    rt_float_pkg::exponent_t   exponent;
    p        = rt_float_pkg::read(x);
    exponent = p.exponent + (by == 2'd3 ? -rt_float_pkg::exponent_t'(1) : rt_float_pkg::exponent_t'({1'b0, by}));
    return rt_float_pkg::round('{
        negative: p.negative,
        zero: p.significand == '0,
        greatest: 1'b0,
        exponent: exponent,
        significand: p.significand,
        half: 1'b0,
        rest: 1'b0
    });
  endfunction

  function automatic vector_t saturate(vector_t x);
    for (int c = 0; c < 4; c++) begin
      if (x[c].negative || x[c].exponent == '0) saturate[c] = '0;
      else if (32'(x[c].exponent) >= rt_float_pkg::Bias) saturate[c] = rt_float_pkg::One;
      else saturate[c] = x[c];
    end
  endfunction

  // floor(x) as an index; 2^24 where it is none.
  function automatic index_t index_of(rt_float_pkg::float_t x);
    rt_float_pkg::parts_t    p;
    rt_float_pkg::exponent_t whole;  // bits before the point
    logic [4:0]              drop;
    p     = rt_float_pkg::read(x);
    whole = p.exponent - rt_float_pkg::exponent_t'(rt_float_pkg::Bias - 1);
    drop  = whole <= 0 ? 5'(AddressBits) : 5'(rt_float_pkg::exponent_t'(AddressBits) - whole);
    if (p.significand == '0) return '0;
    if (p.negative || whole > rt_float_pkg::exponent_t'(AddressBits)) return index_t'(1) << AddressBits;
    return index_t'(p.significand) >> drop;
  endfunction

  function automatic rt_float_pkg::float_t from_index(address_t x);
    logic [4:0]                            zeros;
    logic [rt_float_pkg::FractionBits-1:0] fraction;
    zeros    = rt_float_pkg::leading_zeros({x, rt_float_pkg::GuardBits'(0)});
    fraction = rt_float_pkg::FractionBits'(x << zeros);
    if (x == '0) return '0;
    return '{negative: 1'b0, exponent: 8'(rt_float_pkg::Bias + AddressBits - 1) - 8'(zeros), fraction: fraction};
  endfunction

  localparam rt_float_pkg::float_t MinusOne = '{negative: 1'b1, exponent: rt_float_pkg::One.exponent, fraction: '0};
  localparam rt_float_pkg::float_t Half = '{negative: 1'b0, exponent: rt_float_pkg::One.exponent - 8'd1, fraction: '0};

endpackage
