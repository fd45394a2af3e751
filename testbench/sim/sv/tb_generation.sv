// SPDX-License-Identifier: Apache-2.0
// A pipe of contexts with a cache behind it and generations, for tests/rtl/rtl_generation_test.cpp: contexts look up one line each and get on when they
// have it and take_i is 1.
//
// Units       Of one way and of two; four sets' worth of lines at most, so that lines of one set are in each other's way.
// Stages      0 read the key   1 look up   4 the cache answers   5 gets on, is parked, or tries again.
`include "rt_assert.svh"
module tb_generation #(
    localparam int unsigned Units = 2,
    localparam int unsigned Contexts = 16,
    localparam int unsigned ContextBits = $clog2(Contexts),
    localparam int unsigned KeyBits = 20,
    localparam int unsigned PeriodBits = 10,
    localparam int unsigned LeaseBits = 12
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    output int                                 contexts_o,
    output int                                 period_o,
    output int                                 lease_o,  // the longest that a line is kept for nobody
    output int                                 sets_o,
    input  logic [Units-1:0]                   flush_i,
    output logic [Units-1:0]                   flushing_o,
    input  logic [Units-1:0]                   push_valid_i,
    input  logic [ContextBits-1:0]             push_context_i [Units],
    input  logic [KeyBits-1:0]                 push_key_i     [Units],
    input  logic [Units-1:0]                   take_i,
    output logic [Units-1:0]                   look_o,
    output logic [ContextBits-1:0]             look_context_o [Units],
    output logic [Units-1:0]                   gets_on_o,
    output logic [ContextBits-1:0]             gets_on_context_o[Units],
    output logic [Units-1:0]                   fetch_valid_o,
    input  logic [Units-1:0]                   fetch_ready_i,
    output logic [KeyBits-1:0]                 fetch_key_o    [Units],
    output logic [rt_core_pkg::MshrIdBits-1:0] fetch_mshr_o   [Units],
    input  logic [Units-1:0]                   fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0] fill_mshr_i    [Units],
    input  logic [63:0]                        fill_data_i    [Units],
    output logic [63:0]                        hit_data_o     [Units],
    output logic [Units-1:0]                   idle_o
);
  localparam int unsigned Sets = 2;
  localparam int unsigned Stages = 6;
  assign contexts_o = Contexts;
  assign period_o   = 1 << PeriodBits;
  assign lease_o    = 2 << (LeaseBits - 4);
  assign sets_o     = Sets;
  typedef logic [ContextBits-1:0] context_t;
  for (genvar u = 0; u < int'(Units); u++) begin : gen_unit
    logic [Stages-1:0]     stage_valid, stage_error_unused, park;
    context_t [Stages-1:0] stage_context;
    logic [KeyBits-1:0]    key, key_q;
    logic                  hold, empty, retry, look_answer, look_hit, look_q, hit_q, cache_idle, pipe_idle;
    logic                  wake_valid, wake_ready, wake_error, miss_unused;
    context_t              wake_context;
    logic [63:0]           data, data_q;
    rt_generation #(
        .Pipes     (1),
        .PeriodBits(PeriodBits)
    ) u_generation (
        .clk_i,
        .rst_ni,
        .empty_i(empty),
        .hold_o (hold)
    );
    rt_context_pipe #(
        .Contexts(Contexts),
        .Stages  (Stages)
    ) u_pipe (
        .clk_i,
        .rst_ni,
        .hold_i         (hold),
        .go_i           (take_i[u]),
        .empty_o        (empty),
        .push_valid_i   (push_valid_i[u]),
        .push_context_i (push_context_i[u]),
        .wake_valid_i   (wake_valid),
        .wake_ready_o   (wake_ready),
        .wake_context_i (wake_context),
        .wake_error_i   (wake_error),
        .stage_valid_o  (stage_valid),
        .stage_context_o(stage_context),
        .stage_error_o  (stage_error_unused),
        .park_i         (park),
        .retry_i        (retry),
        .again_i        (1'b0),
        .idle_o         (pipe_idle)
    );
    rt_ram_lut #(
        .Depth (Contexts),
        .data_t(logic [KeyBits-1:0])
    ) u_keys (
        .clk_i,
        .rst_ni,
        .write_en_i  (push_valid_i[u]),
        .write_addr_i(push_context_i[u]),
        .write_data_i(push_key_i[u]),
        .read_addr_i (stage_context[0]),
        .read_data_o (key)
    );
    rt_cache #(
        .Lines       (Sets * (u + 1)),
        .Ways        (u + 1),
        .KeyBits     (KeyBits),
        .DataBits    (64),
        .WordBits    (64),
        .WordsPerLine(1),
        .Mshrs       (2),
        .Waiters     (Contexts),
        .LeaseBits   (LeaseBits)
    ) u_cache (
        .clk_i,
        .rst_ni,
        .flush_i      (flush_i[u]),
        .keep_i       (hold),
        .flushing_o   (flushing_o[u]),
        .req_valid_i  (stage_valid[1]),
        .req_key_i    (key_q),
        .req_word_i   (1'b0),
        .req_waiter_i (stage_context[1]),
        .rsp_valid_o  (look_answer),
        .rsp_hit_o    (look_hit),
        .rsp_data_o   (data),
        .wake_valid_o (wake_valid),
        .wake_ready_i (wake_ready),
        .wake_waiter_o(wake_context),
        .wake_error_o (wake_error),
        .fetch_valid_o(fetch_valid_o[u]),
        .fetch_ready_i(fetch_ready_i[u]),
        .fetch_key_o  (fetch_key_o[u]),
        .fetch_mshr_o (fetch_mshr_o[u]),
        .miss_o       (miss_unused),
        .fill_valid_i (fill_valid_i[u]),
        .fill_mshr_i  (fill_mshr_i[u]),
        .fill_data_i  (fill_data_i[u]),
        .fill_last_i  (1'b1),
        .fill_error_i (1'b0),
        .idle_o       (cache_idle)
    );
    always_ff @(posedge clk_i) begin
      key_q  <= key;
      look_q <= look_answer;
      hit_q  <= look_hit;
      data_q <= data;
    end
    always_comb begin
      park    = '0;
      park[5] = look_q && !hit_q;
    end
    assign retry                = stage_valid[5] && hit_q && !take_i[u];
    assign look_o[u]            = stage_valid[1];
    assign look_context_o[u]    = stage_context[1];
    assign gets_on_o[u]         = stage_valid[5] && hit_q && take_i[u];
    assign gets_on_context_o[u] = stage_context[5];
    assign hit_data_o[u]        = data_q;
    assign idle_o[u]            = pipe_idle && cache_idle;
  end
endmodule
