// SPDX-License-Identifier: Apache-2.0
// The machine of the shader unit: threads execute a program in rotation, rays and memory are streams.
//
// Host        write_i: words of the program and constants; setting_i. Both stay while threads run.
// Streams     launch_i: parameters P of a thread. ray_o, answer_i: a thread waits for the answer to its ray. request_o, reply_i: memory (rt_spu_pkg).
//             result_o: how a thread ended. Order is kept among the requests of memory, and among the replies to one thread, nowhere else.
// Rotation    A thread that may run is chosen every Phases clocks, the first behind the last one chosen; it has one instruction in flight. The pipe never
//             stalls: a thread that waits for memory or a ray leaves it, and there is room for every thread behind it.
// Pipe        F fetch (context, word, return address), R the sources one after the other, E operands into the vector unit and accesses, rays and results out,
//             VectorLatency clocks later W writes and decides where the thread goes on; S is written later still. The clocks of a beat are `phase_q`.
// Registers   One read and one write a clock. Writes: first result in phase 2, second in 3, S in 1; replies, answers and the zeros of a launch where one is free.
// Steps       A thread ends after setting_i.step_limit instructions, so that none is for ever.
// Counterpart hls/shader/spu.hpp, golden/shader/machine.cpp.
`include "rt_assert.svh"
module rt_spu #(
    parameter int unsigned Threads = 32
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 write_valid_i,
    input  rt_spu_pkg::write_t   write_data_i,
    input  rt_spu_pkg::setting_t setting_i,
    output logic                 idle_o,
    input  logic                 launch_valid_i,
    output logic                 launch_ready_o,
    input  rt_spu_pkg::vector_t  launch_data_i,
    output logic                 result_valid_o,
    input  logic                 result_ready_i,
    output rt_spu_pkg::result_t  result_data_o,
    output logic                 ray_valid_o,
    input  logic                 ray_ready_i,
    output rt_spu_pkg::ray_t     ray_data_o,
    input  logic                 answer_valid_i,
    output logic                 answer_ready_o,
    input  rt_spu_pkg::answer_t  answer_data_i,
    output logic                 request_valid_o,
    input  logic                 request_ready_i,
    output rt_spu_pkg::request_t request_data_o,
    input  logic                 reply_valid_i,
    output logic                 reply_ready_o,
    input  rt_spu_pkg::reply_t   reply_data_i,
    output rt_spu_pkg::event_t   event_o
);
  import rt_spu_pkg::*;
  import rt_float_pkg::float_t;
  `RT_ASSERT_INIT(ThreadsKnown, Threads == 32 || Threads == 64)

  localparam int unsigned NumBits = $clog2(Threads);
  typedef logic [NumBits-1:0] number_t;
  typedef logic [Threads-1:0] set_t;
  // Clocks of a beat.
  localparam logic [1:0] Last = 2'(Phases - 1);
  localparam logic [1:0] FirstPhase = 2'(VectorLatency);
  localparam logic [1:0] SecondPhase = 2'(VectorLatency + 1);
  localparam logic [1:0] DecidePhase = 2'(VectorLatency + 2);
  localparam logic [1:0] SpecialPhase = 2'(VectorLatency + 1 + rt_float_pkg::RcpLatency + 2);  // x, y and z of a direction are there

  // How far an instruction is: what R, E and W know of it.
  typedef struct packed {
    logic                        valid;
    number_t                     thread;
    context_t                    state;
    rt_shader_pkg::instruction_t in;
    return_t                     back;
    logic [4:0]                  op;      // of this pass
    logic [3:0]                  second;  // of this pass
    slot_t [3:0]                 slot;    // read: sources, then address or result
  } stage_t;
  // What W knows.
  typedef struct packed {
    logic       valid;
    number_t    thread;
    context_t   state;
    logic [1:0] modifier;
    logic [1:0] component;
    logic [5:0] target;
    logic [3:0] mask;
    logic [3:0] second;
    logic [15:0] payload;
    logic [3:0] classes;
    logic [3:0] lanes;
    logic       all;
    return_t    back;
    logic [4:0] op;
    index_t     address;
    logic       leaves;   // waits for a ray, a texture or a store
  } late_t;

  logic [1:0] phase_q;
  always_ff @(posedge clk_i) phase_q <= rst_ni ? phase_q + 1'b1 : '0;

  // ---- Threads that may run; the next one.
  set_t run_q, flight_q, special_q, busy_q, fault_q;  // flight: in the pipe; special: S is not written yet
  set_t behind_q;  // threads behind the last one chosen
  set_t may_run, pool, chosen;
  number_t chosen_number;
  function automatic number_t number_of(set_t one_hot);
    number_of = '0;
    for (int unsigned i = 0; i < Threads; i++) if (one_hot[i]) number_of = number_of | number_t'(i);
  endfunction
  function automatic set_t set_of(logic is_set, number_t number);
    return set_t'(is_set) << number;
  endfunction
  assign may_run       = run_q & ~flight_q & ~special_q;  // what an access leads to may be there before it has left the pipe
  assign pool          = (may_run & behind_q) != '0 ? may_run & behind_q : may_run;
  assign chosen        = phase_q == Last ? pool & (~pool + 1'b1) : '0;
  assign chosen_number = number_of(chosen);

  // ---- F: context in phase 0, word and return address from phase 1 on.
  logic f_valid_q, f_fault_q;
  number_t f_thread_q;
  context_t context_data, f_state_q;
  rt_shader_pkg::instruction_t word, f_in_q;
  return_t back;
  always_ff @(posedge clk_i) begin
    if (phase_q == Last) begin
      f_valid_q  <= chosen != '0;
      f_thread_q <= chosen_number;
      if (chosen != '0) behind_q <= ~(chosen | (chosen - 1'b1));
    end
    if (phase_q == 2'd0) begin
      f_state_q <= context_data;
      f_fault_q <= fault_q[f_thread_q];
    end
    if (phase_q == 2'd2) f_in_q <= word;
    if (!rst_ni) begin
      f_valid_q <= 1'b0;
      behind_q  <= '1;
    end
  end

  logic context_write;
  number_t context_thread;
  context_t context_written;
  rt_ram_lut #(
      .Depth (Threads),
      .data_t(context_t)
  ) u_context (
      .clk_i,
      .rst_ni,
      .write_en_i  (context_write),
      .write_addr_i(context_thread),
      .write_data_i(context_written),
      .read_addr_i (f_thread_q),
      .read_data_o (context_data)
  );
  rt_ram_sdp #(
      .Depth (rt_shader_pkg::ProgramWords),
      .data_t(rt_shader_pkg::instruction_t)
  ) u_program (
      .clk_i,
      .rst_ni,
      .write_en_i  (write_valid_i && !write_data_i.constant),
      .write_addr_i(write_data_i.address),
      .write_data_i(write_data_i.data[rt_shader_pkg::WordBits-1:0]),
      .read_en_i   (phase_q == 2'd1 && f_valid_q),
      .read_addr_i (f_state_q.place[9:0]),
      .read_data_o (word)
  );
  logic return_write;
  logic [NumBits+3:0] return_address;
  return_t return_written;
  rt_ram_sdp #(
      .Depth (Threads * rt_shader_pkg::CallDepth),
      .data_t(return_t)
  ) u_returns (
      .clk_i,
      .rst_ni,
      .write_en_i  (return_write),
      .write_addr_i(return_address),
      .write_data_i(return_written),
      .read_en_i   (phase_q == 2'd1 && f_valid_q),
      .read_addr_i ({f_thread_q, f_state_q.depth[3:0] - 4'd1}),
      .read_data_o (back)
  );

  // What the pass reads, and why the thread ends before it begins.
  stage_t r_d, r_q, e_q;
  logic [2:0] count;
  logic load_like;
  assign count = 3'(sources(f_in_q.op)) + 3'(second_sources(f_in_q.second));
  assign load_like = 32'(f_in_q.second) == rt_shader_pkg::SecondLoad || 32'(f_in_q.second) == rt_shader_pkg::SecondLoad4x ||
      32'(f_in_q.second) == rt_shader_pkg::SecondStore;
  always_comb begin
    logic [SlotBits:0] slot_a, slot_b, slot_c;
    slot_a = slot_of(f_in_q.a.index[5:0], f_state_q.window);
    slot_b = slot_of(f_in_q.b.index[5:0], f_state_q.window);
    slot_c = slot_of(f_in_q.c.index[5:0], f_state_q.window);
    r_d = '{
        valid: f_valid_q,
        thread: f_thread_q,
        state: f_state_q,
        in: f_in_q,
        back: back,
        op: 5'(rt_shader_pkg::OpNop),
        second: 4'(rt_shader_pkg::SecondNone),
        slot: {load_like && f_in_q.payload[rt_shader_pkg::LoadAddressAt+2] ? slot_t'(SlotAddr) : slot_t'(SlotA),
               slot_c[SlotBits-1:0], slot_b[SlotBits-1:0], slot_a[SlotBits-1:0]}
    };
    case (f_state_q.pass)
      PassFirst: begin
        r_d.op     = f_in_q.op;
        r_d.second = f_in_q.second;
        if (f_fault_q) begin
          r_d.state.status = status_t'(rt_shader_pkg::StatusBadAddress);
        end else if (f_state_q.steps == setting_i.step_limit) begin
          r_d.state.status = status_t'(rt_shader_pkg::StatusStepLimit);
        end else begin
          r_d.state.steps = f_state_q.steps + 1'b1;
          if (f_state_q.place >= setting_i.length) begin
            r_d.state.status = status_t'(rt_shader_pkg::StatusBadPlace);
          end else if (!known(f_in_q)) begin
            r_d.state.status = status_t'(rt_shader_pkg::StatusBadOpcode);
          end else if ((count >= 3'd1 && source_overflows(f_in_q.a, f_state_q.window)) ||
                       (count >= 3'd2 && source_overflows(f_in_q.b, f_state_q.window)) ||
                       (count >= 3'd3 && source_overflows(f_in_q.c, f_state_q.window))) begin
            r_d.state.status = status_t'(rt_shader_pkg::StatusStackOverflow);
          end
        end
      end
      PassDirection: begin
        r_d.op      = 5'(rt_shader_pkg::OpMov);
        r_d.slot[0] = slot_t'(SlotE1);
      end
      PassRay: begin
        r_d.op   = 5'(rt_shader_pkg::OpTrace);
        r_d.slot = {slot_t'(SlotAddr), slot_t'(SlotE2), slot_t'(SlotScratch), slot_t'(SlotE0)};
      end
      PassTriangle: r_d.slot[3] = slot_t'(SlotAddr);
      PassEnd: begin
        r_d.slot[0] = slot_t'(SlotO);
        r_d.slot[3] = slot_t'(SlotP);
      end
      default: r_d.slot[3] = slot_t'(SlotScratch);
    endcase
  end
  always_ff @(posedge clk_i) begin
    if (phase_q == Last) begin
      r_q <= r_d;
      e_q <= r_q;
    end
    if (!rst_ni) begin
      r_q.valid <= 1'b0;
      e_q.valid <= 1'b0;
    end
  end

  // ---- R: a slot a clock; a clock later its value as an operand.
  vector_t register_data, register_write_data;
  logic [3:0] register_write;
  logic [NumBits+SlotBits-1:0] register_write_address;
  for (genvar c = 0; c < 4; c++) begin : gen_registers
    rt_ram_sdp #(
        .Depth (Threads << SlotBits),
        .data_t(float_t)
    ) u_registers (
        .clk_i,
        .rst_ni,
        .write_en_i  (register_write[c]),
        .write_addr_i(register_write_address),
        .write_data_i(register_write_data[c]),
        .read_en_i   (r_q.valid),
        .read_addr_i ({r_q.thread, r_q.slot[phase_q]}),
        .read_data_o (register_data[c])
    );
  end

  rt_shader_pkg::source_t source;
  vector_t constant, whole, operand, a_q, b_q, c_q, d_q;
  always_comb begin
    case (phase_q)
      2'd1: source = r_q.in.a;
      2'd2: source = r_q.in.b;
      default: source = r_q.in.c;
    endcase
  end
  rt_ram_lut #(
      .Depth (rt_shader_pkg::Constants),
      .data_t(vector_t)
  ) u_constants (
      .clk_i,
      .rst_ni,
      .write_en_i  (write_valid_i && write_data_i.constant),
      .write_addr_i(write_data_i.address[4:0]),
      .write_data_i(write_data_i.data),
      .read_addr_i (source.index[4:0]),
      .read_data_o (constant)
  );
  always_comb begin
    logic plain;  // a pass of the machine's own
    plain = r_q.state.pass != PassFirst;
    whole = register_data;
    if (!plain && source.index[6]) whole = constant;
    if (!plain && 32'(source.index) == rt_shader_pkg::RegisterC)
      whole = {rt_float_pkg::greatest(1'b0), Half, rt_float_pkg::One, float_t'('0)};
    for (int c = 0; c < 4; c++) begin
      operand[c] = scale(plain ? whole[c] : whole[source.swizzle[2*c+:2]], plain ? 2'd0 : source.scale);
      if (!plain && source.negate != '0) operand[c].negative = !operand[c].negative;
      if (!plain && source.immediate != '0) begin
        operand[c] = scale(float_t'({source[rt_shader_pkg::ABits-2:0], 13'd0}), 2'd0);
      end
    end
  end
  always_ff @(posedge clk_i) begin
    if (phase_q == 2'd1) a_q <= operand;
    if (phase_q == 2'd2) b_q <= operand;
    if (phase_q == 2'd3) c_q <= operand;
    if (phase_q == 2'd0) d_q <= register_data;
  end

  // ---- E: first operation in phase 0, second in phase 1; everything that leaves the pipe in phase 1.
  logic [4:0] vector_op;
  vector_t vector_a, vector_b, vector_c, vector_r;
  always_comb begin
    vector_op = e_q.op;
    vector_a  = a_q;
    vector_b  = b_q;
    vector_c  = c_q;
    if (phase_q == 2'd1) begin
      vector_op = {1'b0, e_q.second};
      case (sources(e_q.op))
        2'd0: ;
        2'd1: begin
          vector_a = b_q;
          vector_b = c_q;
        end
        default: vector_a = c_q;
      endcase
    end
  end
  rt_spu_vector u_vector (
      .clk_i,
      .rst_ni,
      .op_i(vector_op),
      .a_i (vector_a),
      .b_i (vector_b),
      .c_i (vector_c),
      .r_o (vector_r)
  );

  late_t m_d, m_q, w;
  logic [1:0] lane;
  index_t index;
  logic sends_access, sends_ray, sends_result;
  status_t e_status;
  logic no_direction;
  assign no_direction = {b_q[2].exponent, b_q[1].exponent, b_q[0].exponent} == '0;
  always_comb begin
    case (e_q.state.pass)
      PassTriangle: lane = 2'd0;
      PassMaterial: lane = 2'd3;
      PassEnter: lane = e_q.in.payload[rt_shader_pkg::MaterialEntryAt+:2];
      default: lane = e_q.in.payload[rt_shader_pkg::LoadAddressAt+:2];
    endcase
    index = index_of(d_q[lane]);
    if (e_q.state.pass == PassFirst && !index[AddressBits]) begin
      index = index + index_t'(e_q.in.payload[rt_shader_pkg::LoadOffsetAt+:rt_shader_pkg::LoadOffsetBits]);
    end
    e_status     = e_q.state.status;
    sends_access = 1'b0;
    sends_ray    = 1'b0;
    sends_result = e_q.state.pass == PassEnd;
    if (e_q.state.pass != PassEnd && e_q.state.status == status_t'(rt_shader_pkg::StatusRunning)) begin
      if (32'(e_q.op) == rt_shader_pkg::OpStore) begin
        sends_access = index < setting_i.memory_vectors;
        if (!sends_access) e_status = status_t'(rt_shader_pkg::StatusBadAddress);
      end
      if (is_texture(e_q.op)) sends_access = 1'b1;
      if (32'(e_q.op) == rt_shader_pkg::OpTrace) begin
        sends_ray = !no_direction;
        if (no_direction) e_status = status_t'(rt_shader_pkg::StatusBadRay);
      end
    end
    m_d = '{
        valid: e_q.valid,
        thread: e_q.thread,
        state: e_q.state,
        modifier: e_q.in.modifier,
        component: e_q.in.component,
        target: e_q.in.target,
        mask: e_q.in.mask,
        second: e_q.second,
        payload: e_q.in.payload,
        classes: e_q.in.classes,
        lanes: e_q.in.lanes,
        all: e_q.in.all != '0,
        back: e_q.back,
        op: e_q.op,
        address: index,
        leaves: sends_access || sends_ray
    };
    m_d.state.status = e_status;
  end
  always_ff @(posedge clk_i) begin
    if (phase_q == 2'd1) m_q <= m_d;
    if (!rst_ni) m_q.valid <= 1'b0;
  end
  logic leave;
  assign leave = phase_q == 2'd1 && e_q.valid;

  // Behind each there is room for every thread.
  access_t access_in, access;
  logic access_valid, access_ready, access_room_unused;
  logic [$clog2(Threads+1)-1:0] access_usage_unused, ray_usage_unused, result_usage_unused, load_usage_unused;
  assign access_in = '{
          thread: thread_t'(e_q.thread),
          op: e_q.op,
          address: index[AddressBits-1:0],
          picture: {a_q[2], a_q[1], a_q[0]},
          place: {b_q[1], b_q[0]},
          slot: 32'(e_q.op) == rt_shader_pkg::OpTexload ? slot_t'(FixedSlot) + slot_t'(e_q.in.target[1:0]) : slot_t'(FixedSlot),
          value: 32'(e_q.op) == rt_shader_pkg::OpStore ? a_q : c_q
      };
  rt_fifo #(
      .Depth (Threads),
      .data_t(access_t)
  ) u_accesses (
      .clk_i,
      .rst_ni,
      .in_valid_i (leave && sends_access),
      .in_ready_o (access_room_unused),
      .in_data_i  (access_in),
      .out_valid_o(access_valid),
      .out_ready_i(access_ready),
      .out_data_o (access),
      .usage_o    (access_usage_unused)
  );
  logic ray_room_unused, second_trace;
  ray_t ray_in;
  assign second_trace = e_q.state.pass == PassRay;
  assign ray_in = '{
          thread: thread_t'(e_q.thread),
          any: second_trace ? e_q.in.payload[rt_shader_pkg::TraceEntryAt+:2] == 2'd1
                            : !c_q[2].negative && 32'(c_q[2].exponent) >= rt_float_pkg::Bias,
          t_max: second_trace ? c_q[2] : c_q[1],
          t_min: second_trace ? c_q[1] : c_q[0],
          direction: {b_q[2], b_q[1], b_q[0]},
          origin: {a_q[2], a_q[1], a_q[0]}
      };
  rt_fifo #(
      .Depth (Threads),
      .data_t(ray_t)
  ) u_rays (
      .clk_i,
      .rst_ni,
      .in_valid_i (leave && sends_ray),
      .in_ready_o (ray_room_unused),
      .in_data_i  (ray_in),
      .out_valid_o(ray_valid_o),
      .out_ready_i(ray_ready_i),
      .out_data_o (ray_data_o),
      .usage_o    (ray_usage_unused)
  );
  // Where (u, v, t, id) go beside HIT.
  typedef struct packed {
    logic  moves;
    slot_t slot;
  } ray_target_t;
  ray_target_t ray_target, ray_target_in;
  assign ray_target_in = '{
          moves: second_trace,
          slot: slot_t'(e_q.state.window) + slot_t'(e_q.in.payload[rt_shader_pkg::TracePushAt+:4]) + slot_t'(4)
      };
  rt_ram_lut #(
      .Depth (Threads),
      .data_t(ray_target_t)
  ) u_ray_targets (
      .clk_i,
      .rst_ni,
      .write_en_i  (leave && sends_ray),
      .write_addr_i(e_q.thread),
      .write_data_i(ray_target_in),
      .read_addr_i (number_t'(answer_data_i.thread)),
      .read_data_o (ray_target)
  );
  logic result_room_unused;
  result_t result_in;
  assign result_in = '{code: e_q.state.code, status: e_q.state.status, steps: e_q.state.steps, colour: a_q, parameters: d_q};
  rt_fifo #(
      .Depth (Threads),
      .data_t(result_t)
  ) u_results (
      .clk_i,
      .rst_ni,
      .in_valid_i (leave && sends_result),
      .in_ready_o (result_room_unused),
      .in_data_i  (result_in),
      .out_valid_o(result_valid_o),
      .out_ready_i(result_ready_i),
      .out_data_o (result_data_o),
      .usage_o    (result_usage_unused)
  );

  // ---- W
  rt_delay #(
      .Cycles(VectorLatency - 2),
      .data_t(late_t)
  ) u_late (
      .clk_i,
      .rst_ni,
      .data_i(m_q),
      .data_o(w)
  );
  // The contents of the delay line are of no thread until it has been filled.
  localparam int unsigned FillBits = $clog2(VectorLatency + Phases);
  logic [FillBits-1:0] fill_q;
  logic filled, w_valid, w_runs, w_arithmetic, w_second, w_special, w_direction;
  assign filled = fill_q == FillBits'(VectorLatency + Phases - 1);
  always_ff @(posedge clk_i) fill_q <= !rst_ni ? '0 : filled ? fill_q : fill_q + 1'b1;
  assign w_valid      = w.valid && filled;
  assign w_runs       = w_valid && w.state.status == status_t'(rt_shader_pkg::StatusRunning) && w.state.pass != PassEnd;
  assign w_direction  = w.state.pass == PassDirection;
  assign w_arithmetic = w_runs && !w_direction && is_arithmetic(w.op);
  assign w_second     = w_runs && second_is_arithmetic(w.second);
  assign w_special    = w_arithmetic && (32'(w.modifier) == rt_shader_pkg::ModifierRcp || 32'(w.modifier) == rt_shader_pkg::ModifierRsq);

  logic [SlotBits:0] first_slot, second_slot;
  logic first_lost, second_lost;
  assign first_slot  = slot_of(w.target, w.state.window);
  assign second_slot = slot_of(second_target(w.payload), w.state.window);
  assign first_lost  = w_arithmetic && first_slot[SlotBits];
  assign second_lost = w_second && second_slot[SlotBits];

  // Of the first result: classes, and what S comes from.
  vector_t first_q;
  logic [3:0][3:0] classes_q;
  logic every, some, taken_q;
  always_comb begin
    every = 1'b1;
    some  = 1'b0;
    for (int c = 0; c < 4; c++) begin
      if (w.lanes[c]) begin
        if ((classes_q[c] & w.classes) != '0) some = 1'b1;
        else every = 1'b0;
      end
    end
  end
  always_ff @(posedge clk_i) begin
    if (phase_q == FirstPhase) begin
      first_q <= vector_r;
      for (int c = 0; c < 4; c++) begin
        classes_q[c] <= w_arithmetic ? rt_float_pkg::class_of(vector_r[c].negative, vector_r[c].exponent) : w.state.classes[c];
      end
    end
    if (phase_q == SecondPhase) taken_q <= w.all ? every : some;
  end

  float_t special_x, reciprocal, root;
  logic [1:0] special_component;
  assign special_component = w_direction ? phase_q - SecondPhase : w.component;
  assign special_x         = first_q[special_component];
  rt_float_rcp u_rcp (
      .clk_i,
      .rst_ni,
      .x_i(special_x),
      .y_o(reciprocal)
  );
  rt_float_rsq u_rsq (
      .clk_i,
      .rst_ni,
      .x_i(special_x),
      .y_o(root)
  );
  typedef struct packed {
    logic       valid;
    logic       direction;
    logic       root;
    number_t    thread;
    logic [3:0] mask;
  } special_t;
  special_t special_in_q, special;
  always_ff @(posedge clk_i) begin
    if (phase_q == SecondPhase) begin
      special_in_q <= '{
          valid: (w_special && !first_lost) || (w_runs && w_direction),
          direction: w_direction,
          root: 32'(w.modifier) == rt_shader_pkg::ModifierRsq,
          thread: w.thread,
          mask: w.mask
      };
    end
    if (!rst_ni) special_in_q.valid <= 1'b0;
  end
  rt_delay #(
      .Cycles(rt_float_pkg::RcpLatency - 1),
      .data_t(special_t)
  ) u_special (
      .clk_i,
      .rst_ni,
      .data_i(special_in_q),
      .data_o(special)
  );
  localparam int unsigned SpecialFillBits = $clog2(rt_float_pkg::RcpLatency + VectorLatency);
  logic [SpecialFillBits-1:0] special_fill_q;
  logic special_filled, special_writes;
  assign special_filled = special_fill_q == SpecialFillBits'(rt_float_pkg::RcpLatency + VectorLatency - 1);
  always_ff @(posedge clk_i) special_fill_q <= !rst_ni ? '0 : special_filled ? special_fill_q : special_fill_q + 1'b1;
  float_t special_r, special_x_q, special_y_q;
  assign special_r = special.root && !special.direction ? root : reciprocal;
  always_ff @(posedge clk_i) begin
    if (phase_q == SpecialPhase - 2'd2) special_x_q <= special_r;
    if (phase_q == SpecialPhase - 2'd1) special_y_q <= special_r;
  end
  assign special_writes = phase_q == SpecialPhase && special.valid && special_filled;

  // ---- Where the thread goes on, in DecidePhase.
  logic decides, ends, waits, load_sends, fits_window;
  context_t next;
  load_t load_in;
  logic [WindowBits:0] window_pushed, ray_slot;
  logic [3:0] push;
  logic [AddressBits+1:0] load_end;
  logic load_four;
  assign decides       = phase_q == DecidePhase && w_valid;
  set_t decided;
  assign decided = set_of(decides, w.thread);
  assign load_four     = w.state.pass == PassFirst && 32'(w.second) == rt_shader_pkg::SecondLoad4x;
  assign load_end      = (AddressBits + 2)'(w.address) + (load_four ? (AddressBits + 2)'(4) : (AddressBits + 2)'(1));
  assign push          = w.state.pass == PassEnter ? w.payload[rt_shader_pkg::MaterialPushAt+:4] : w.payload[rt_shader_pkg::CallPushAt+:4];
  assign window_pushed = (WindowBits + 1)'(w.state.window) + (WindowBits + 1)'(push);
  assign fits_window   = 32'(w.state.depth) != rt_shader_pkg::CallDepth && !window_pushed[WindowBits];
  assign ray_slot      = (WindowBits + 1)'(w.state.window) + (WindowBits + 1)'(w.payload[rt_shader_pkg::TracePushAt+:4]) + (WindowBits + 1)'(4);
  assign load_in       = '{
          thread: thread_t'(w.thread),
          address: w.address[AddressBits-1:0],
          four: load_four,
          slot: w.state.pass != PassFirst ? slot_t'(SlotScratch) : load_four ? slot_t'(FixedSlot)
              : slot_t'(FixedSlot) + slot_t'(w.payload[rt_shader_pkg::LoadResultAt+:2])
      };
  always_comb begin
    next         = w.state;
    next.pass    = PassFirst;
    waits        = w.leaves;
    ends         = 1'b0;
    load_sends   = 1'b0;
    return_write = 1'b0;
    next.place   = w.state.place + 1'b1;
    if (w.state.status != status_t'(rt_shader_pkg::StatusRunning)) begin
      next = w.state;
    end else begin
      case (w.state.pass)
        PassFirst: begin
          next.classes = classes_q;
          if (first_lost || second_lost) begin
            next.status = status_t'(rt_shader_pkg::StatusStackOverflow);
          end else if (taken_q) begin
            case (32'(w.second))
              rt_shader_pkg::SecondLoad, rt_shader_pkg::SecondLoad4x: begin
                if (load_end > (AddressBits + 2)'(setting_i.memory_vectors)) next.status = status_t'(rt_shader_pkg::StatusBadAddress);
                else load_sends = 1'b1;
              end
              rt_shader_pkg::SecondJmp: next.place = place_t'(w.payload[rt_shader_pkg::JumpPlaceAt+:rt_shader_pkg::JumpPlaceBits]);
              rt_shader_pkg::SecondCall: begin
                if (fits_window) begin
                  return_write = decides;
                  next.place   = place_t'(w.payload[rt_shader_pkg::CallPlaceAt+:rt_shader_pkg::CallPlaceBits]);
                  next.depth   = w.state.depth + 1'b1;
                  next.window  = window_pushed[WindowBits-1:0];
                end else begin
                  next.status = status_t'(rt_shader_pkg::StatusStackOverflow);
                end
              end
              rt_shader_pkg::SecondMaterial: begin
                next.pass  = PassTriangle;
                next.place = w.state.place;
              end
              rt_shader_pkg::SecondTrace: begin
                next.pass  = PassDirection;
                next.place = w.state.place;
                if (ray_slot[WindowBits]) next.status = status_t'(rt_shader_pkg::StatusStackOverflow);
              end
              rt_shader_pkg::SecondReturn: begin
                if (w.state.depth == '0) begin
                  next.status = status_t'(rt_shader_pkg::StatusDone);
                end else begin
                  next.depth  = w.state.depth - 1'b1;
                  next.place  = w.back.place;
                  next.window = w.back.window;
                end
              end
              rt_shader_pkg::SecondExit: begin
                next.status = status_t'(rt_shader_pkg::StatusDone);
                next.code   = w.payload[rt_shader_pkg::ExitCodeAt+:rt_shader_pkg::ExitCodeBits];
              end
              default: ;
            endcase
          end
        end
        PassDirection: begin
          next.pass  = PassRay;
          next.place = w.state.place;
        end
        PassRay: ;
        PassTriangle, PassMaterial: begin
          next.pass  = w.state.pass == PassTriangle ? PassMaterial : PassEnter;
          next.place = w.state.place;
          if (load_end > (AddressBits + 2)'(setting_i.memory_vectors)) next.status = status_t'(rt_shader_pkg::StatusBadAddress);
          else load_sends = 1'b1;
        end
        PassEnter: begin
          if (32'(w.address) >= rt_shader_pkg::ProgramWords) begin
            next.status = status_t'(rt_shader_pkg::StatusBadPlace);
          end else if (!fits_window) begin
            next.status = status_t'(rt_shader_pkg::StatusStackOverflow);
          end else begin
            return_write = decides;
            next.place   = w.address[PlaceBits-1:0];
            next.depth   = w.state.depth + 1'b1;
            next.window  = window_pushed[WindowBits-1:0];
          end
        end
        default: ;
      endcase
      if (load_sends) waits = 1'b1;
    end
    if (next.status != status_t'(rt_shader_pkg::StatusRunning)) begin
      next.pass = PassEnd;
      waits     = 1'b0;
    end
    if (w.state.pass == PassEnd) ends = 1'b1;
  end
  assign return_address = {w.thread, w.state.depth[3:0]};
  assign return_written = '{place: w.state.place + 1'b1, window: w.state.window};

  logic load_room_unused, load_valid, load_ready;
  load_t load_data;
  rt_fifo #(
      .Depth (Threads),
      .data_t(load_t)
  ) u_loads (
      .clk_i,
      .rst_ni,
      .in_valid_i (decides && load_sends),
      .in_ready_o (load_room_unused),
      .in_data_i  (load_in),
      .out_valid_o(load_valid),
      .out_ready_i(load_ready),
      .out_data_o (load_data),
      .usage_o    (load_usage_unused)
  );
  logic access_wakes, access_fault;
  thread_t access_thread;
  rt_spu_memory u_memory (
      .clk_i,
      .rst_ni,
      .memory_vectors_i(setting_i.memory_vectors),
      .load_valid_i    (load_valid),
      .load_ready_o    (load_ready),
      .load_data_i     (load_data),
      .access_valid_i  (access_valid),
      .access_ready_o  (access_ready),
      .access_data_i   (access),
      .request_valid_o,
      .request_ready_i,
      .request_data_o,
      .wake_o          (access_wakes),
      .wake_fault_o    (access_fault),
      .wake_thread_o   (access_thread)
  );

  // ---- The answer to a ray: four writes.
  typedef enum logic [1:0] {
    WriteHit,
    WriteAddr,
    WriteH,
    WriteMoved
  } answer_e;
  answer_e answer_q;
  logic answer_writes, answer_done;
  vector_t hit, answer_value;
  slot_t answer_slot;
  logic [3:0] answer_mask;
  logic signed [AddressBits+9:0] triangle;
  float_t triangle_number, object_number;
  assign hit = answer_data_i.hit ? {from_index(answer_data_i.id), scale(answer_data_i.v, 2'd0), scale(answer_data_i.u, 2'd0), scale(answer_data_i.t, 2'd0)}
             : {MinusOne, float_t'('0), float_t'('0), rt_float_pkg::greatest(1'b0)};
  assign triangle = answer_data_i.hit
      ? signed'((AddressBits + 10)'(setting_i.triangles)) + signed'((AddressBits + 10)'(answer_data_i.id) * (AddressBits + 10)'(setting_i.triangle_vectors))
      : signed'((AddressBits + 10)'(setting_i.triangles)) - signed'((AddressBits + 10)'(setting_i.triangle_vectors));
  assign triangle_number = triangle[AddressBits+9:AddressBits] == '0 ? from_index(triangle[AddressBits-1:0]) : MinusOne;
  assign object_number = from_index(setting_i.object);
  always_comb begin
    case (answer_q)
      WriteHit: begin
        answer_slot  = slot_t'(SlotHit);
        answer_mask  = 4'b1111;
        answer_value = hit;
      end
      WriteAddr: begin
        answer_slot  = slot_t'(SlotAddr);
        answer_mask  = 4'b0011;
        answer_value = {float_t'('0), float_t'('0), object_number, triangle_number};
      end
      WriteH: begin
        answer_slot  = slot_t'(SlotH);
        answer_mask  = 4'b1011;
        answer_value = {hit[3], float_t'('0), triangle_number, object_number};
      end
      default: begin
        answer_slot  = ray_target.slot;
        answer_mask  = ray_target.moves ? 4'b1111 : 4'b0000;
        answer_value = {hit[3], hit[0], hit[2], hit[1]};
      end
    endcase
  end
  assign answer_done    = answer_writes && answer_q == WriteMoved;
  assign answer_ready_o = answer_done;

  // ---- Launch: zeros in all slots, then P and the context.
  typedef enum logic [1:0] {
    Free,
    Clear,
    Set
  } launch_e;
  launch_e launch_q;
  number_t launch_thread_q;
  slot_t launch_slot_q;
  set_t free;
  logic launch_writes, launch_sets;
  assign free           = ~busy_q & (~(~busy_q) + 1'b1);
  assign launch_sets    = launch_q == Set && phase_q != DecidePhase;
  assign launch_ready_o = launch_sets;
  always_ff @(posedge clk_i) begin
    case (launch_q)
      Free: begin
        launch_thread_q <= number_of(free);
        launch_slot_q   <= '0;
        if (launch_valid_i && free != '0) launch_q <= Clear;
      end
      Clear: begin
        if (launch_writes) begin
          launch_slot_q <= launch_slot_q + 1'b1;
          if (launch_slot_q == slot_t'(SlotAddr)) launch_q <= Set;
        end
      end
      default: if (launch_sets) launch_q <= Free;
    endcase
    if (!rst_ni) launch_q <= Free;
  end
  assign context_write   = decides || launch_sets;
  assign context_thread  = launch_sets ? launch_thread_q : w.thread;
  assign context_written = !launch_sets ? next : '{
          pass: PassFirst,
          place: setting_i.start,
          window: '0,
          depth: '0,
          steps: '0,
          classes: {4{4'(1 << rt_shader_pkg::ClassZero)}},
          status: status_t'(rt_shader_pkg::StatusRunning),
          code: '0
      };

  // ---- One write of a register a clock.
  logic pipe_writes, reply_writes;
  logic write_q_valid;
  number_t write_thread_d, write_thread_q;
  slot_t write_slot_d, write_slot_q;
  logic [3:0] write_mask_d, write_mask_q;
  vector_t write_value_d, write_value_q;
  always_comb begin
    pipe_writes    = 1'b0;
    write_thread_d = w.thread;
    write_slot_d   = first_slot[SlotBits-1:0];
    write_mask_d   = w.mask;
    write_value_d  = 32'(w.modifier) == rt_shader_pkg::ModifierSat ? saturate(vector_r) : vector_r;
    if (phase_q == FirstPhase) begin
      pipe_writes = w_arithmetic && !first_lost;
    end else if (phase_q == SecondPhase) begin
      pipe_writes   = w_second && !first_lost && !second_lost;
      write_slot_d  = second_slot[SlotBits-1:0];
      write_mask_d  = second_mask(w.payload);
      write_value_d = w.payload[rt_shader_pkg::ArithmeticSaturateAt] ? saturate(vector_r) : vector_r;
    end else if (phase_q == SpecialPhase) begin
      pipe_writes    = special_writes;
      write_thread_d = special.thread;
      write_slot_d   = special.direction ? slot_t'(SlotScratch) : slot_t'(SlotS);
      write_mask_d   = special.direction ? 4'b0111 : special.mask;
      write_value_d  = special.direction ? {float_t'('0), special_r, special_y_q, special_x_q} : spread(special_x_q);
    end
    reply_writes  = !pipe_writes && reply_valid_i;
    answer_writes = !pipe_writes && !reply_writes && answer_valid_i;
    launch_writes = !pipe_writes && !reply_writes && !answer_writes && launch_q == Clear;
    if (reply_writes) begin
      write_thread_d = number_t'(reply_data_i.tag.thread);
      write_slot_d   = reply_data_i.tag.slot;
      write_mask_d   = 4'b1111;
      write_value_d  = reply_data_i.data;
    end else if (answer_writes) begin
      write_thread_d = number_t'(answer_data_i.thread);
      write_slot_d   = answer_slot;
      write_mask_d   = answer_mask;
      write_value_d  = answer_value;
    end else if (launch_writes) begin
      write_thread_d = launch_thread_q;
      write_slot_d   = launch_slot_q;
      write_mask_d   = 4'b1111;
      write_value_d  = launch_slot_q == slot_t'(SlotP) ? launch_data_i : '0;
    end
  end
  assign reply_ready_o = !pipe_writes;
  always_ff @(posedge clk_i) begin
    write_q_valid  <= pipe_writes || reply_writes || answer_writes || launch_writes;
    write_thread_q <= write_thread_d;
    write_slot_q   <= write_slot_d;
    write_mask_q   <= write_mask_d;
    write_value_q  <= write_value_d;
    if (answer_writes) answer_q <= answer_done ? WriteHit : answer_e'(answer_q + 2'd1);
    if (!rst_ni) begin
      write_q_valid <= 1'b0;
      answer_q      <= WriteHit;
    end
  end
  assign register_write         = write_q_valid ? write_mask_q : '0;
  assign register_write_address = {write_thread_q, write_slot_q};
  assign register_write_data    = write_value_q;

  // ---- What threads may do.
  set_t waked;
  assign waked   = set_of(launch_sets, launch_thread_q) | set_of(access_wakes, number_t'(access_thread)) |
      set_of(reply_writes && reply_data_i.tag.last, number_t'(reply_data_i.tag.thread)) |
      set_of(answer_done, number_t'(answer_data_i.thread));
  always_ff @(posedge clk_i) begin
    run_q     <= (run_q & ~chosen) | waked | (waits || ends ? '0 : decided);
    flight_q  <= (flight_q & ~decided) | chosen;
    special_q <= (special_q & ~set_of(special_writes, special.thread)) |
        set_of(phase_q == SecondPhase && ((w_special && !first_lost) || (w_runs && w_direction)), w.thread);
    busy_q    <= (busy_q | set_of(launch_q == Clear, launch_thread_q)) & ~(ends ? decided : '0);
    fault_q   <= (fault_q | set_of(access_wakes && access_fault, number_t'(access_thread))) & ~set_of(launch_sets, launch_thread_q);
    if (!rst_ni) begin
      run_q     <= '0;
      flight_q  <= '0;
      special_q <= '0;
      busy_q    <= '0;
      fault_q   <= '0;
    end
  end
  assign idle_o = busy_q == '0 && launch_q == Free && !result_valid_o;

  assign event_o = '{
          begins: phase_q == Last && f_valid_q && (f_state_q.pass == PassEnd || (f_state_q.pass == PassFirst && !f_fault_q)),
          thread: thread_t'(f_thread_q),
          place: f_state_q.place,
          window: f_state_q.window,
          depth: f_state_q.depth,
          steps: f_state_q.steps,
          writes: write_q_valid,
          write_thread: thread_t'(write_thread_q),
          slot: write_slot_q,
          mask: write_mask_q,
          data: write_value_q
      };

  `RT_ASSERT(WhatIsDecidedIsInFlight, (decided & ~flight_q) == '0)
  `RT_ASSERT(AccessesFit, !(leave && sends_access) || access_room_unused)
  `RT_ASSERT(RaysFit, !(leave && sends_ray) || ray_room_unused)
  `RT_ASSERT(ResultsFit, !(leave && sends_result) || result_room_unused)
  `RT_ASSERT(LoadsFit, !(decides && load_sends) || load_room_unused)
  `RT_ASSERT(OnlyBusyRun, (run_q & ~busy_q) == '0)
  `RT_ASSERT_STREAM(LaunchHeld, launch_valid_i, launch_ready_o, launch_data_i)
  `RT_ASSERT_STREAM(AnswerHeld, answer_valid_i, answer_ready_o, answer_data_i)
  `RT_ASSERT_STREAM(ReplyHeld, reply_valid_i, reply_ready_o, reply_data_i)
endmodule
