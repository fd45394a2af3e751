// Hit writer: one AXI write burst of 16 bytes a hit, several in flight.
//
// Purpose     Hits come in any order and go to base + 16 * ray. in_* is accepted when address and data have left for the last hit and an
//             answer place is free. What has been accepted is completed whatever happens to the rest of the core (soft reset).
// Rates       One hit a DataBits-dependent 2 or 3 clocks.
// Faults      fault_o with the ray whose answer was an error.
`include "rt_assert.svh"
module rt_hit_writer #(
    parameter int unsigned DataBits = 64
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,
    input  logic                             in_valid_i,
    output logic                             in_ready_o,
    input  logic [127:0]                     in_hit_i,
    input  logic [31:0]                      in_ray_i,
    output logic                             aw_valid_o,
    input  logic                             aw_ready_i,
    output logic [rt_core_pkg::AddrBits-1:0] aw_addr_o,
    output logic [7:0]                       aw_len_o,
    output logic                             w_valid_o,
    input  logic                             w_ready_i,
    output logic [DataBits-1:0]              w_data_o,
    output logic                             w_last_o,
    input  logic                             b_valid_i,
    output logic                             b_ready_o,
    input  logic                             b_error_i,
    output logic                             idle_o,     // nothing in flight
    output logic                             written_o,  // an answer came
    output logic                             fault_o,
    output logic [31:0]                      fault_ray_o
);
  localparam int unsigned Beats = 128 / DataBits;
  localparam int unsigned InFlight = 16;
  localparam int unsigned UsageBits = $clog2(InFlight + 1);

  logic                             aw_valid_q, w_valid_q, take, order_ready, order_valid;
  logic [rt_core_pkg::AddrBits-1:0] addr_q;
  logic [127:0]                     data_q;
  logic [1:0]                       beat_q;
  logic [UsageBits-1:0]             usage;

  assign in_ready_o = !aw_valid_q && !w_valid_q && order_ready;
  assign take       = in_valid_i && in_ready_o;
  always_ff @(posedge clk_i) begin
    if (take) begin
      aw_valid_q <= 1'b1;
      w_valid_q  <= 1'b1;
      addr_q     <= base_i + rt_core_pkg::AddrBits'({in_ray_i, 4'b0});
      data_q     <= in_hit_i;
      beat_q     <= '0;
    end else begin
      if (aw_ready_i) aw_valid_q <= 1'b0;
      if (w_valid_q && w_ready_i) begin
        data_q <= data_q >> DataBits;
        beat_q <= beat_q + 1'b1;
        if (w_last_o) w_valid_q <= 1'b0;
      end
    end
    if (!rst_ni) begin
      aw_valid_q <= 1'b0;
      w_valid_q  <= 1'b0;
    end
  end
  assign aw_valid_o = aw_valid_q;
  assign aw_addr_o  = addr_q;
  assign aw_len_o   = 8'(Beats - 1);
  assign w_valid_o  = w_valid_q;
  assign w_data_o   = data_q[DataBits-1:0];
  assign w_last_o   = beat_q == 2'(Beats - 1);

  // All bursts have one id, so answers come in order.
  rt_fifo #(
      .Depth (InFlight),
      .data_t(logic [31:0])
  ) u_order (
      .clk_i,
      .rst_ni,
      .in_valid_i (take),
      .in_ready_o (order_ready),
      .in_data_i  (in_ray_i),
      .out_valid_o(order_valid),
      .out_ready_i(b_valid_i),
      .out_data_o (fault_ray_o),
      .usage_o    (usage)
  );
  assign b_ready_o = 1'b1;
  assign written_o = b_valid_i;
  assign fault_o   = b_valid_i && b_error_i;
  assign idle_o    = usage == '0;

  `RT_ASSERT(AnswerIsExpected, !b_valid_i || order_valid)
endmodule
