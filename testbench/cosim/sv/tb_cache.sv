// Two small caches whose lines are always in each other's way, for tests/rtl/rtl_cache_test.cpp.
//
// Cache 0     Four ports, two ways, eight sets, four miss registers.
// Cache 1     One port, one way, four sets, two miss registers.
// Both        Lines of two words of two beats of 32 bits; keys of 8 bits; eight waiters a port. Ports that a cache lacks are not connected.
`include "rt_assert.svh"
module tb_cache #(
    localparam int unsigned Caches = 2,
    localparam int unsigned Ports = 4,
    localparam int unsigned KeyBits = 8,
    localparam int unsigned WaiterBits = 3
) (
    input  logic                                               clk_i,
    input  logic                                               rst_ni,
    input  logic [Caches-1:0]                                  flush_i,
    output logic [Caches-1:0]                                  flushing_o,
    input  logic [Caches-1:0][Ports-1:0]                       req_valid_i,
    input  logic [Caches-1:0][Ports-1:0][KeyBits-1:0]          req_key_i,
    input  logic [Caches-1:0][Ports-1:0]                       req_word_i,
    input  logic [Caches-1:0][Ports-1:0][WaiterBits-1:0]       req_waiter_i,
    output logic [Caches-1:0][Ports-1:0]                       rsp_valid_o,
    output logic [Caches-1:0][Ports-1:0]                       rsp_hit_o,
    output logic [Caches-1:0][Ports-1:0][63:0]                 rsp_data_o,
    output logic [Caches-1:0][Ports-1:0]                       wake_valid_o,
    input  logic [Caches-1:0][Ports-1:0]                       wake_ready_i,
    output logic [Caches-1:0][Ports-1:0][WaiterBits-1:0]       wake_waiter_o,
    output logic [Caches-1:0][Ports-1:0]                       wake_error_o,
    output logic [Caches-1:0]                                  fetch_valid_o,
    input  logic [Caches-1:0]                                  fetch_ready_i,
    output logic [Caches-1:0][KeyBits-1:0]                     fetch_key_o,
    output logic [Caches-1:0][rt_core_pkg::MshrIdBits-1:0]     fetch_mshr_o,
    output logic [Caches-1:0]                                  miss_o,
    input  logic [Caches-1:0]                                  fill_valid_i,
    input  logic [Caches-1:0][rt_core_pkg::MshrIdBits-1:0]     fill_mshr_i,
    input  logic [Caches-1:0][31:0]                            fill_data_i,
    input  logic [Caches-1:0]                                  fill_last_i,
    input  logic [Caches-1:0]                                  fill_error_i
);
  localparam int unsigned CachePorts[Caches] = '{4, 1};
  for (genvar c = 0; c < int'(Caches); c++) begin : gen_cache
    localparam int unsigned Used = CachePorts[c];
    rt_cache #(
        .Ports       (Used),
        .Lines       (c == 0 ? 16 : 4),
        .Ways        (c == 0 ? 2 : 1),
        .KeyBits     (KeyBits),
        .DataBits    (32),
        .WordBits    (64),
        .WordsPerLine(2),
        .Mshrs       (c == 0 ? 4 : 2),
        .Waiters     (1 << WaiterBits),
        .LeaseBits   (8)
    ) u_cache (
        .clk_i,
        .rst_ni,
        .flush_i      (flush_i[c]),
        .flushing_o   (flushing_o[c]),
        .req_valid_i  (req_valid_i[c][Used-1:0]),
        .req_key_i    (req_key_i[c][Used-1:0]),
        .req_word_i   (req_word_i[c][Used-1:0]),
        .req_waiter_i (req_waiter_i[c][Used-1:0]),
        .rsp_valid_o  (rsp_valid_o[c][Used-1:0]),
        .rsp_hit_o    (rsp_hit_o[c][Used-1:0]),
        .rsp_data_o   (rsp_data_o[c][Used-1:0]),
        .wake_valid_o (wake_valid_o[c][Used-1:0]),
        .wake_ready_i (wake_ready_i[c][Used-1:0]),
        .wake_waiter_o(wake_waiter_o[c][Used-1:0]),
        .wake_error_o (wake_error_o[c][Used-1:0]),
        .fetch_valid_o(fetch_valid_o[c]),
        .fetch_ready_i(fetch_ready_i[c]),
        .fetch_key_o  (fetch_key_o[c]),
        .fetch_mshr_o (fetch_mshr_o[c]),
        .miss_o       (miss_o[c]),
        .fill_valid_i (fill_valid_i[c]),
        .fill_mshr_i  (fill_mshr_i[c]),
        .fill_data_i  (fill_data_i[c]),
        .fill_last_i  (fill_last_i[c]),
        .fill_error_i (fill_error_i[c])
    );
    if (Used < Ports) begin : gen_unused
      assign rsp_valid_o[c][Ports-1:Used]   = '0;
      assign rsp_hit_o[c][Ports-1:Used]     = '0;
      assign rsp_data_o[c][Ports-1:Used]    = '0;
      assign wake_valid_o[c][Ports-1:Used]  = '0;
      assign wake_waiter_o[c][Ports-1:Used] = '0;
      assign wake_error_o[c][Ports-1:Used]  = '0;
    end
  end
endmodule
