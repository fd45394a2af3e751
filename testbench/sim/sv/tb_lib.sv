// SPDX-License-Identifier: Apache-2.0
// Every library module in the parameter sets that the tests drive, in one model so that one compilation serves them all.
//
// Streams     data_t is 32 bits. Index of a stream: see the list below; tests/rtl/rtl_lib_test.cpp names them in the same order.
//             Ports are packed arrays: verilator 5.006 cannot sample an unpacked one for an assertion.
// Arithmetic  Operands come in 64 bits, results sign- or zero-extended to 128 and 64 bits. The latencies come from the modules' package.
`include "rt_assert.svh"
module tb_lib #(
    localparam int unsigned Streams = 16,
    localparam int unsigned Muls = 6,
    localparam int unsigned Divs = 6,
    localparam int unsigned DivSeqs = 3,
    localparam int unsigned ArbInputs = 5,
    localparam int unsigned Stages = 7
) (
    input  logic               clk_i,
    input  logic               rst_ni,
    // Streams.
    input  logic [Streams-1:0] in_valid_i,
    output logic [Streams-1:0] in_ready_o,
    input  logic [Streams-1:0][31:0] in_data_i,
    output logic [Streams-1:0] out_valid_o,
    input  logic [Streams-1:0] out_ready_i,
    output logic [Streams-1:0][31:0] out_data_o,
    output int                 latency_o      [Streams],
    output int                 interval_o     [Streams],
    // Multipliers and pipelined dividers.
    input  logic        [63:0] a_i,
    input  logic        [63:0] b_i,
    output logic signed [ 63:0] mul_low_o      [Muls],
    output logic signed [ 63:0] mul_high_o     [Muls],
    output int                 mul_latency_o  [Muls],
    output logic        [63:0] quot_o         [Divs],
    output logic        [63:0] rem_o          [Divs],
    output logic               overflow_o     [Divs],
    output int                 div_latency_o  [Divs],
    // Sequential dividers.
    input  logic [DivSeqs-1:0] seq_in_valid_i,
    output logic [DivSeqs-1:0] seq_in_ready_o,
    input  logic [DivSeqs-1:0][63:0] seq_num_i,
    input  logic [DivSeqs-1:0][63:0] seq_den_i,
    input  logic [DivSeqs-1:0][31:0] seq_tag_i,
    output logic [DivSeqs-1:0] seq_out_valid_o,
    input  logic [DivSeqs-1:0] seq_out_ready_i,
    output logic        [63:0] seq_quot_o     [DivSeqs],
    output logic        [63:0] seq_rem_o      [DivSeqs],
    output logic               seq_overflow_o [DivSeqs],
    output logic        [31:0] seq_tag_o      [DivSeqs],
    output int                 seq_interval_o [DivSeqs],
    // Arbiter of five inputs (and one of a single input that must be a wire, driven by input 0).
    input  logic        [ArbInputs-1:0] arb_valid_i,
    output logic        [ArbInputs-1:0] arb_ready_o,
    input  logic [ArbInputs-1:0][31:0] arb_data_i,
    input  logic        [ArbInputs-1:0] arb_last_i,
    output logic               arb_valid_o,
    input  logic               arb_ready_i,
    output logic        [31:0] arb_data_o,
    output logic        [2:0]  arb_index_o,
    output logic               arb_one_ready_o,
    output logic               arb_one_valid_o,
    output logic        [31:0] arb_one_data_o,
    // The one that chooses a clock ahead, with the arbiter's data.
    input  logic        [ArbInputs-1:0] turns_valid_i,
    output logic        [ArbInputs-1:0] turns_ready_o,
    input  logic               turns_room_i,
    output logic               turns_valid_o,
    output logic        [31:0] turns_data_o,
    // RAM without and with forwarding, a depth that is no power of two.
    input  logic               ram_write_i,
    input  logic        [6:0]  ram_write_addr_i,
    input  logic        [31:0] ram_write_data_i,
    input  logic               ram_read_i,
    input  logic        [6:0]  ram_read_addr_i,
    output logic        [31:0] ram_plain_o,
    output logic        [31:0] ram_forward_o,
    // What rt_stage_pkg says of the stages, in the order of a ray's way through them.
    output int                 stage_latency_o [Stages],
    output int                 stage_interval_o[Stages],
    output int                 stage_blocks_o  [Stages],
    // Counters: clear, enable, steps, and a read.
    input  logic               counters_clear_i,
    input  logic               counters_enable_i,
    input  logic [4:0][2:0]    counters_step_i,
    input  logic               counters_read_i,
    input  logic        [2:0]  counters_index_i,
    output logic               counters_done_o,
    output logic        [31:0] counters_data_o,
    // A stream with the checkers on it and nothing else: the test breaks the rules here.
    input  logic               rule_valid_i,
    input  logic               rule_ready_i,
    input  logic        [31:0] rule_data_i,
    input  logic               rule_true_i
);
  typedef logic [31:0] word_t;
  typedef logic [15:0] half_t;

  // ---------------------------------------------------------------------------------------------------------------- streams
  rt_skid #(
      .data_t(word_t)
  ) u_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i[0]),
      .in_ready_o (in_ready_o[0]),
      .in_data_i  (in_data_i[0]),
      .out_valid_o(out_valid_o[0]),
      .out_ready_i(out_ready_i[0]),
      .out_data_o (out_data_o[0])
  );
  assign latency_o[0]  = 1;
  assign interval_o[0] = 1;

  localparam int unsigned Half = 15;
  rt_skid #(
      .HalfRate(1'b1),
      .data_t  (word_t)
  ) u_half (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i[Half]),
      .in_ready_o (in_ready_o[Half]),
      .in_data_i  (in_data_i[Half]),
      .out_valid_o(out_valid_o[Half]),
      .out_ready_i(out_ready_i[Half]),
      .out_data_o (out_data_o[Half])
  );
  assign latency_o[Half]  = 1;
  assign interval_o[Half] = 2;

  localparam int unsigned Fifos = 6;
  localparam int unsigned FifoDepth[Fifos] = '{1, 2, 3, 16, 4, 60};
  for (genvar i = 0; i < int'(Fifos); i++) begin : gen_fifo
    localparam int unsigned Index = 1 + i;
    localparam bit BlockRam = i >= 4;
    logic [$clog2(FifoDepth[i]+1)-1:0] usage;
    rt_fifo #(
        .Depth   (FifoDepth[i]),
        .BlockRam(BlockRam),
        .data_t  (word_t)
    ) u_fifo (
        .clk_i,
        .rst_ni,
        .in_valid_i (in_valid_i[Index]),
        .in_ready_o (in_ready_o[Index]),
        .in_data_i  (in_data_i[Index]),
        .out_valid_o(out_valid_o[Index]),
        .out_ready_i(out_ready_i[Index]),
        .out_data_o (out_data_o[Index]),
        .usage_o    (usage)
    );
    logic usage_agrees;
    assign usage_agrees = in_ready_o[Index] == (32'(usage) != FifoDepth[i]);
    `RT_ASSERT(UsageAgrees, usage_agrees)
    assign latency_o[Index]  = BlockRam ? 3 : 1;
    assign interval_o[Index] = FifoDepth[i] == 1 ? 2 : 1;
  end

  // Credit control around a delay line: one half of the word goes through the datapath, the other is the tag.
  localparam int unsigned Pipes = 6;
  localparam int unsigned PipeLatency[Pipes] = '{1, 2, 5, 30, 7, 8};
  localparam int unsigned PipeInterval[Pipes] = '{1, 1, 1, 1, 3, 2};
  for (genvar i = 0; i < int'(Pipes); i++) begin : gen_pipe
    localparam int unsigned Index = 1 + Fifos + i;
    half_t delayed, tag, data;
    logic enter;
    rt_delay #(
        .Cycles(PipeLatency[i]),
        .data_t(half_t)
    ) u_delay (
        .clk_i,
        .rst_ni,
        .data_i(in_data_i[Index][15:0]),
        .data_o(delayed)
    );
    rt_pipe_ctrl #(
        .Latency (PipeLatency[i]),
        .Interval(PipeInterval[i]),
        .tag_t   (half_t),
        .data_t  (half_t)
    ) u_ctrl (
        .clk_i,
        .rst_ni,
        .in_valid_i (in_valid_i[Index]),
        .in_ready_o (in_ready_o[Index]),
        .in_tag_i   (in_data_i[Index][31:16]),
        .enter_o    (enter),
        .pipe_data_i(delayed),
        .out_valid_o(out_valid_o[Index]),
        .out_ready_i(out_ready_i[Index]),
        .out_tag_o  (tag),
        .out_data_o (data)
    );
    logic enter_agrees;
    assign enter_agrees = enter == (in_valid_i[Index] && in_ready_o[Index]);
    `RT_ASSERT(EnterAgrees, enter_agrees)
    assign out_data_o[Index] = {tag, data};
    assign latency_o[Index]  = rt_lib_pkg::pipe_latency(PipeLatency[i]);
    assign interval_o[Index] = PipeInterval[i];
  end

  // Queues behind a register: one that is written to as soon as it has room, one behind turns that were chosen a clock before.
  localparam int unsigned QueueIndex = 1 + Fifos + Pipes;
  rt_queue #(
      .Depth (4),
      .data_t(word_t)
  ) u_queue (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i[QueueIndex] && in_ready_o[QueueIndex]),
      .in_ready_o (in_ready_o[QueueIndex]),
      .in_data_i  (in_data_i[QueueIndex]),
      .out_valid_o(out_valid_o[QueueIndex]),
      .out_ready_i(out_ready_i[QueueIndex]),
      .out_data_o (out_data_o[QueueIndex])
  );
  assign latency_o[QueueIndex]  = 2;
  assign interval_o[QueueIndex] = 1;

  word_t turn_data[1], turned;
  logic turn_room, turn_valid;
  assign turn_data[0] = in_data_i[QueueIndex+1];
  rt_turns #(
      .NumInputs(1),
      .data_t   (word_t)
  ) u_turn (
      .clk_i,
      .rst_ni,
      .in_valid_i (in_valid_i[QueueIndex+1]),
      .in_ready_o (in_ready_o[QueueIndex+1]),
      .in_data_i  (turn_data),
      .room_i     (turn_room),
      .out_valid_o(turn_valid),
      .out_data_o (turned)
  );
  rt_queue #(
      .Depth (3),
      .Ahead (1),
      .data_t(word_t)
  ) u_turn_queue (
      .clk_i,
      .rst_ni,
      .in_valid_i (turn_valid),
      .in_ready_o (turn_room),
      .in_data_i  (turned),
      .out_valid_o(out_valid_o[QueueIndex+1]),
      .out_ready_i(out_ready_i[QueueIndex+1]),
      .out_data_o (out_data_o[QueueIndex+1])
  );
  assign latency_o[QueueIndex+1]  = 2;
  assign interval_o[QueueIndex+1] = 2;

  // ------------------------------------------------------------------------------------------------------------- arithmetic
  localparam int unsigned MulA[Muls] = '{27, 32, 18, 27, 10, 35};
  localparam int unsigned MulB[Muls] = '{27, 27, 18, 12, 30, 35};
  for (genvar i = 0; i < int'(Muls); i++) begin : gen_mul
    logic signed [MulA[i]+MulB[i]-1:0] product;
    rt_mul #(
        .ABits(MulA[i]),
        .BBits(MulB[i])
    ) u_mul (
        .clk_i,
        .a_i(a_i[MulA[i]-1:0]),
        .b_i(b_i[MulB[i]-1:0]),
        .p_o(product)
    );
    assign {mul_high_o[i], mul_low_o[i]} = 128'(product);
    assign mul_latency_o[i] = rt_lib_pkg::mul_latency(MulA[i], MulB[i]);
  end

  localparam int unsigned DivNum[Divs] = '{54, 54, 53, 9, 9, 20};
  localparam int unsigned DivDen[Divs] = '{27, 27, 28, 5, 5, 30};
  localparam int unsigned DivQuot[Divs] = '{28, 28, 24, 6, 5, 20};
  localparam int unsigned DivStep[Divs] = '{1, 2, 1, 1, 2, 1};
  for (genvar i = 0; i < int'(Divs); i++) begin : gen_div
    logic [DivQuot[i]-1:0] quot;
    logic [DivDen[i]-1:0] remainder;
    rt_div #(
        .NumBits    (DivNum[i]),
        .DenBits    (DivDen[i]),
        .QuotBits   (DivQuot[i]),
        .BitsPerStep(DivStep[i])
    ) u_div (
        .clk_i,
        .num_i     (a_i[DivNum[i]-1:0]),
        .den_i     (b_i[DivDen[i]-1:0]),
        .quot_o    (quot),
        .rem_o     (remainder),
        .overflow_o(overflow_o[i])
    );
    assign quot_o[i] = 64'(quot);
    assign rem_o[i]  = 64'(remainder);
    assign div_latency_o[i] = rt_lib_pkg::div_latency(DivQuot[i], DivStep[i]);
  end

  // The same sets as the first pipelined dividers, and the small one.
  localparam int unsigned SeqSet[DivSeqs] = '{0, 1, 4};
  for (genvar i = 0; i < int'(DivSeqs); i++) begin : gen_div_seq
    localparam int unsigned Set = SeqSet[i];
    logic [DivQuot[Set]-1:0] quot;
    logic [DivDen[Set]-1:0] remainder;
    rt_div_seq #(
        .NumBits    (DivNum[Set]),
        .DenBits    (DivDen[Set]),
        .QuotBits   (DivQuot[Set]),
        .BitsPerStep(DivStep[Set]),
        .tag_t      (word_t)
    ) u_div_seq (
        .clk_i,
        .rst_ni,
        .in_valid_i    (seq_in_valid_i[i]),
        .in_ready_o    (seq_in_ready_o[i]),
        .in_num_i      (seq_num_i[i][DivNum[Set]-1:0]),
        .in_den_i      (seq_den_i[i][DivDen[Set]-1:0]),
        .in_tag_i      (seq_tag_i[i]),
        .out_valid_o   (seq_out_valid_o[i]),
        .out_ready_i   (seq_out_ready_i[i]),
        .out_quot_o    (quot),
        .out_rem_o     (remainder),
        .out_overflow_o(seq_overflow_o[i]),
        .out_tag_o     (seq_tag_o[i])
    );
    assign seq_quot_o[i] = 64'(quot);
    assign seq_rem_o[i]  = 64'(remainder);
    assign seq_interval_o[i] = rt_lib_pkg::div_seq_interval(DivQuot[Set], DivStep[Set]);
  end

  // ---------------------------------------------------------------------------------------------------- arbiter, RAM, checkers
  word_t arb_data[ArbInputs];
  for (genvar i = 0; i < int'(ArbInputs); i++) begin : gen_arb_data
    assign arb_data[i] = arb_data_i[i];
  end
  rt_arbiter #(
      .NumInputs(ArbInputs),
      .data_t   (word_t)
  ) u_arbiter (
      .clk_i,
      .rst_ni,
      .in_valid_i (arb_valid_i),
      .in_ready_o (arb_ready_o),
      .in_data_i  (arb_data),
      .in_last_i  (arb_last_i),
      .out_valid_o(arb_valid_o),
      .out_ready_i(arb_ready_i),
      .out_data_o (arb_data_o),
      .out_index_o(arb_index_o)
  );

  rt_turns #(
      .NumInputs(ArbInputs),
      .data_t   (word_t)
  ) u_turns (
      .clk_i,
      .rst_ni,
      .in_valid_i (turns_valid_i),
      .in_ready_o (turns_ready_o),
      .in_data_i  (arb_data),
      .room_i     (turns_room_i),
      .out_valid_o(turns_valid_o),
      .out_data_o (turns_data_o)
  );

  word_t one_data[1];
  logic one_index;
  assign one_data[0] = arb_data_i[0];
  rt_arbiter #(
      .NumInputs(1),
      .data_t   (word_t)
  ) u_arbiter_one (
      .clk_i,
      .rst_ni,
      .in_valid_i (arb_valid_i[0]),
      .in_ready_o (arb_one_ready_o),
      .in_data_i  (one_data),
      .in_last_i  (arb_last_i[0]),
      .out_valid_o(arb_one_valid_o),
      .out_ready_i(arb_ready_o[0]),
      .out_data_o (arb_one_data_o),
      .out_index_o(one_index)
  );
  `RT_ASSERT(OneInputIsInputZero, !one_index)

  rt_ram_sdp #(
      .Depth (100),
      .data_t(word_t)
  ) u_ram_plain (
      .clk_i,
      .rst_ni,
      .write_en_i  (ram_write_i),
      .write_addr_i(ram_write_addr_i),
      .write_data_i(ram_write_data_i),
      .read_en_i   (ram_read_i),
      .read_addr_i (ram_read_addr_i),
      .read_data_o (ram_plain_o)
  );

  rt_ram_sdp #(
      .Depth  (100),
      .Forward(1'b1),
      .data_t (word_t)
  ) u_ram_forward (
      .clk_i,
      .rst_ni,
      .write_en_i  (ram_write_i),
      .write_addr_i(ram_write_addr_i),
      .write_data_i(ram_write_data_i),
      .read_en_i   (ram_read_i),
      .read_addr_i (ram_read_addr_i),
      .read_data_o (ram_forward_o)
  );

  rt_counters #(
      .Count   (5),
      .StepBits(3),
      .MaxStep ({3'd1, 3'd7, 3'd4, 3'd1, 3'd3})
  ) u_counters (
      .clk_i,
      .rst_ni,
      .clear_i     (counters_clear_i),
      .enable_i    (counters_enable_i),
      .step_i      (counters_step_i),
      .read_i      (counters_read_i),
      .read_index_i(counters_index_i),
      .read_done_o (counters_done_o),
      .read_data_o (counters_data_o)
  );

  assign stage_latency_o = '{
          rt_stage_pkg::RaySetupLatency,
          rt_stage_pkg::KdDescendLatency,
          rt_stage_pkg::LeafExitLatency,
          rt_stage_pkg::KdBacktrackLatency,
          rt_stage_pkg::TriTestLatency,
          rt_stage_pkg::HitFinishLatency,
          rt_stage_pkg::InstanceEnterLatency
      };
  assign stage_interval_o = '{
          rt_stage_pkg::RaySetupInterval,
          rt_stage_pkg::KdDescendInterval,
          rt_stage_pkg::LeafExitInterval,
          rt_stage_pkg::KdBacktrackInterval,
          rt_stage_pkg::TriTestInterval,
          rt_stage_pkg::HitFinishInterval,
          rt_stage_pkg::InstanceEnterInterval
      };
  assign stage_blocks_o = '{
          rt_stage_pkg::RaySetupBlocks,
          rt_stage_pkg::KdDescendBlocks,
          rt_stage_pkg::LeafExitBlocks,
          rt_stage_pkg::KdBacktrackBlocks,
          rt_stage_pkg::TriTestBlocks,
          rt_stage_pkg::HitFinishBlocks,
          rt_stage_pkg::InstanceEnterBlocks
      };

  `RT_ASSERT_STREAM(RuleStream, rule_valid_i, rule_ready_i, rule_data_i)
  `RT_ASSERT(RuleTrue, rule_true_i)
endmodule
