// SPDX-License-Identifier: Apache-2.0
// Isolation of the core from the bus for a soft reset: no new transaction is offered, those in flight are completed, then the core is reset.
//
// Sequence    Run -> (soft_reset_i) Drain: requests that have been offered stay, no other is taken; when all reads have been answered and the sink
//             has nothing in flight -> Reset for some clocks -> Run. What the slave has been offered is never taken back.
// Hard reset  rst_ni begins in Reset, so that the core behind a register of its own is reset too.
// Source      the job of axi_isolate in pulp-platform/axi, for the two streams of the shell.
`include "rt_assert.svh"
module rt_isolate #(
    localparam int unsigned OutstandingBits = 10
) (
    input  logic                       clk_i,
    input  logic                       rst_ni,
    input  logic                       soft_reset_i,
    output logic                       core_reset_o,  // a register
    output logic                       drain_o,       // a register: the sink forgets what it has not offered
    output logic                       run_o,         // the core is out of reset and nothing is asked of it
    input  logic                       sink_idle_i,
    // Requests of the core and its source, and what is offered to the bus.
    input  logic                       read_valid_i,
    output logic                       read_ready_o,
    input  rt_core_pkg::read_request_t read_i,
    output logic                       bus_valid_o,
    input  logic                       bus_ready_i,
    output rt_core_pkg::read_request_t bus_o,
    input  logic                       answered_i,    // the last beat of an answer
    output logic                       reading_o      // reads are in flight
);
  typedef enum logic [1:0] {
    Run,
    Drain,
    Reset
  } stop_e;
  stop_e                      stop_q;
  logic                       core_ready_q, draining_q, offered_q, gate, skid_ready;
  logic                       core_reset_q = 1'b1;
  logic [2:0]                 reset_left_q;
  logic [1:0]                 settled_q;  // rt_core hands its reset on to its units a clock later
  logic [OutstandingBits-1:0] outstanding_q;

  always_ff @(posedge clk_i) begin
    case (stop_q)
      Run: if (soft_reset_i) stop_q <= Drain;
      Drain: if (draining_q && outstanding_q == '0 && !offered_q && !bus_valid_o && sink_idle_i) stop_q <= Reset;
      default: begin
        reset_left_q <= reset_left_q - 1'b1;
        if (reset_left_q == '0) stop_q <= Run;
      end
    endcase
    if (stop_q != Reset) reset_left_q <= '1;
    draining_q   <= stop_q != Run;
    core_reset_q <= stop_q == Reset;
    settled_q    <= {settled_q[0], stop_q == Run};
    core_ready_q <= settled_q == '1 && stop_q == Run;
    offered_q    <= read_valid_i && gate && !skid_ready;
    outstanding_q <= outstanding_q + OutstandingBits'(bus_valid_o && bus_ready_i) - OutstandingBits'(answered_i);
    if (!rst_ni) begin
      stop_q        <= Reset;
      draining_q    <= 1'b1;
      core_reset_q  <= 1'b1;
      settled_q     <= '0;
      core_ready_q  <= 1'b0;
      offered_q     <= 1'b0;
      outstanding_q <= '0;
    end
  end
  assign core_reset_o = core_reset_q;
  assign drain_o      = draining_q;
  assign run_o        = core_ready_q && stop_q == Run && !soft_reset_i;
  assign reading_o    = outstanding_q != '0;

  // A request that has been offered is not taken back when the drain begins.
  assign gate         = !draining_q || offered_q;
  assign read_ready_o = skid_ready && gate;
  rt_skid #(
      .data_t(rt_core_pkg::read_request_t)
  ) u_skid (
      .clk_i,
      .rst_ni,
      .in_valid_i (read_valid_i && gate),
      .in_ready_o (skid_ready),
      .in_data_i  (read_i),
      .out_valid_o(bus_valid_o),
      .out_ready_i(bus_ready_i),
      .out_data_o (bus_o)
  );

  `RT_ASSERT(AnswerWasAsked, !answered_i || outstanding_q != '0)
endmodule
