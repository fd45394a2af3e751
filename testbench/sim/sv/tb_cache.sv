// SPDX-License-Identifier: Apache-2.0
// Small caches whose lines are always in each other's way, for tests/rtl/rtl_cache_test.cpp: every value that the core's configurations may have of
// ports, ways, words a line, miss registers and of the widths of the bus, and the four caches of the core with both widths of the bus.
//
// Sets        Of: ports, ways, miss registers, bits of the bus, bits of a word, words a line, waiters a port. The bench reads them from parameter_o.
//             Four or eight sets (one way or two), keys of 8 bits. Ports that a cache lacks are not connected.
// Lease       As the core has it, but short in every fourth cache.
`include "rt_assert.svh"
module tb_cache #(
    localparam int unsigned Caches = 14,
    localparam int unsigned MaxPorts = 8,
    localparam int unsigned KeyBits = 8,
    localparam int unsigned Parameters = 9
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    output int                                 parameter_o   [Caches][Parameters],
    input  logic [Caches-1:0]                  flush_i,
    output logic [Caches-1:0]                  flushing_o,
    input  logic [MaxPorts-1:0]                req_valid_i   [Caches],
    input  logic [KeyBits-1:0]                 req_key_i     [Caches][MaxPorts],
    input  logic [2:0]                         req_word_i    [Caches][MaxPorts],
    input  logic [5:0]                         req_waiter_i  [Caches][MaxPorts],
    output logic [MaxPorts-1:0]                rsp_valid_o   [Caches],
    output logic [MaxPorts-1:0]                rsp_hit_o     [Caches],
    output logic [511:0]                       rsp_data_o    [Caches][MaxPorts],
    output logic [MaxPorts-1:0]                wake_valid_o  [Caches],
    input  logic [Caches-1:0][MaxPorts-1:0]    wake_ready_i,
    output logic [5:0]                         wake_waiter_o [Caches][MaxPorts],
    output logic [MaxPorts-1:0]                wake_error_o  [Caches],
    output logic [Caches-1:0]                  fetch_valid_o,
    input  logic [Caches-1:0]                  fetch_ready_i,
    output logic [KeyBits-1:0]                 fetch_key_o   [Caches],
    output logic [rt_core_pkg::MshrIdBits-1:0] fetch_mshr_o  [Caches],
    output logic [Caches-1:0]                  miss_o,
    input  logic [Caches-1:0]                  fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0] fill_mshr_i   [Caches],
    input  logic [127:0]                       fill_data_i   [Caches],
    input  logic [Caches-1:0]                  fill_last_i,
    input  logic [Caches-1:0]                  fill_error_i
);
  typedef struct packed {
    logic [31:0] ports, ways, mshrs, data_bits, word_bits, words, waiters;
  } set_t;
  localparam set_t Set[Caches] = '{
      '{4, 2, 16, 64, 128, 1, 16},  // nodes
      '{1, 2, 8, 64, 128, 4, 64},
      '{8, 2, 8, 128, 128, 2, 8},
      '{2, 1, 2, 64, 128, 4, 16},
      '{3, 1, 3, 128, 128, 1, 8},
      '{5, 2, 5, 64, 128, 2, 8},
      '{6, 1, 6, 128, 128, 4, 8},
      '{7, 1, 7, 64, 128, 1, 8},
      '{1, 2, 16, 64, 512, 1, 64},  // leaves
      '{1, 1, 8, 128, 512, 1, 64},
      '{1, 2, 4, 64, 64, 8, 64},    // lists
      '{1, 1, 4, 128, 128, 4, 32},
      '{1, 1, 8, 64, 384, 1, 64},   // triangles
      '{1, 2, 3, 128, 384, 1, 32}
  };
  for (genvar c = 0; c < int'(Caches); c++) begin : gen_cache
    localparam int unsigned Ports = Set[c].ports;
    localparam int unsigned Sets = Set[c].ways == 2 ? 8 : 4;
    localparam int unsigned WaiterBits = $clog2(Set[c].waiters);
    localparam int unsigned SelectBits = Set[c].words > 1 ? $clog2(Set[c].words) : 1;
    localparam int unsigned LeaseBits = c % 4 == 3 ? 8 : 12;
    logic [Ports-1:0]                      rsp_valid, rsp_hit, wake_valid, wake_error;
    logic [Ports-1:0][KeyBits-1:0]         req_key;
    logic [Ports-1:0][SelectBits-1:0]      req_word;
    logic [Ports-1:0][WaiterBits-1:0]      req_waiter, wake_waiter;
    logic [Ports-1:0][Set[c].word_bits-1:0] rsp_data;
    assign parameter_o[c] = '{int'(Ports), int'(Set[c].ways), int'(Set[c].mshrs), int'(Set[c].data_bits), int'(Set[c].word_bits), int'(Set[c].words),
                              int'(Set[c].waiters), int'(Sets), int'(LeaseBits)};
    rt_cache #(
        .Ports       (Ports),
        .Lines       (Sets * Set[c].ways),
        .Ways        (Set[c].ways),
        .KeyBits     (KeyBits),
        .DataBits    (Set[c].data_bits),
        .WordBits    (Set[c].word_bits),
        .WordsPerLine(Set[c].words),
        .Mshrs       (Set[c].mshrs),
        .Waiters     (Set[c].waiters),
        .LeaseBits   (LeaseBits)
    ) u_cache (
        .clk_i,
        .rst_ni,
        .flush_i      (flush_i[c]),
        .keep_i       (1'b0),
        .flushing_o   (flushing_o[c]),
        .req_valid_i  (req_valid_i[c][Ports-1:0]),
        .req_key_i    (req_key),
        .req_word_i   (req_word),
        .req_waiter_i (req_waiter),
        .rsp_valid_o  (rsp_valid),
        .rsp_hit_o    (rsp_hit),
        .rsp_data_o   (rsp_data),
        .wake_valid_o (wake_valid),
        .wake_ready_i (wake_ready_i[c][Ports-1:0]),
        .wake_waiter_o(wake_waiter),
        .wake_error_o (wake_error),
        .fetch_valid_o(fetch_valid_o[c]),
        .fetch_ready_i(fetch_ready_i[c]),
        .fetch_key_o  (fetch_key_o[c]),
        .fetch_mshr_o (fetch_mshr_o[c]),
        .miss_o       (miss_o[c]),
        .fill_valid_i (fill_valid_i[c]),
        .fill_mshr_i  (fill_mshr_i[c]),
        .fill_data_i  (fill_data_i[c][Set[c].data_bits-1:0]),
        .fill_last_i  (fill_last_i[c]),
        .fill_error_i (fill_error_i[c])
    );
    assign rsp_valid_o[c]  = MaxPorts'(rsp_valid);
    assign rsp_hit_o[c]    = MaxPorts'(rsp_hit);
    assign wake_valid_o[c] = MaxPorts'(wake_valid);
    assign wake_error_o[c] = MaxPorts'(wake_error);
    for (genvar p = 0; p < int'(MaxPorts); p++) begin : gen_port
      if (p < int'(Ports)) begin : gen_used
        assign req_key[p]          = req_key_i[c][p];
        assign req_word[p]         = SelectBits'(req_word_i[c][p]);
        assign req_waiter[p]       = WaiterBits'(req_waiter_i[c][p]);
        assign rsp_data_o[c][p]    = 512'(rsp_data[p]);
        assign wake_waiter_o[c][p] = 6'(wake_waiter[p]);
      end else begin : gen_unused
        assign rsp_data_o[c][p]    = '0;
        assign wake_waiter_o[c][p] = '0;
      end
    end
  end
endmodule
