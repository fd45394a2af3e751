// SPDX-License-Identifier: Apache-2.0
// reciprocal: 1 / direction of one axis.
//
// Formula     D = |direction code|: R = min(floor(2^52 / (D << e)), 2^26 - 1) with the sign of the direction, D << e in [2^26, 2^27); shift = 26 - e.
//             A zero direction gives R = 0 and shift = 0.
// Structure   Clock by clock: magnitude, leading zeros, normalise, divide; the sign is put on behind the last register. The quotient has 26 bits, so 2^26 (D a power of two) saturates in the
//             divider to just the wanted 2^26 - 1.
// Latency     rt_stage_pkg::ReciprocalLatency. II 1, never stalls, no DSP block.
// Counterpart reciprocal_of in hls/stages/ray_setup.hpp.
module rt_reciprocal (
    input  logic                          clk_i,
    input  logic                          rst_ni,
    input  rt_contract_pkg::direction_t   direction_i,
    output rt_contract_pkg::reciprocal_t  reciprocal_o,
    output rt_contract_pkg::recip_shift_t shift_o,
    output logic                          zero_o,
    output logic                          negative_o
);
  localparam int unsigned MagnitudeBits = rt_contract_pkg::DirectionBits;  // |direction| reaches 2^26
  localparam int unsigned QuotBits = rt_stage_pkg::ReciprocalQuotBits;
  localparam int unsigned NumBits = 2 * (MagnitudeBits - 1) + 1;
  typedef logic [MagnitudeBits-1:0] magnitude_t;
  typedef struct packed {
    rt_contract_pkg::recip_shift_t shift;
    logic zero;
    logic negative;
  } flags_t;

  magnitude_t magnitude_q, magnitude_2q, normalised_q;
  flags_t flags_q, flags_2q, flags_3q, flags;
  rt_contract_pkg::recip_shift_t zeros, zeros_q;

  always_comb begin
    zeros = rt_contract_pkg::recip_shift_t'(MagnitudeBits - 1);
    for (int unsigned i = 0; i < MagnitudeBits; i++) begin
      if (magnitude_q[i]) zeros = rt_contract_pkg::recip_shift_t'(MagnitudeBits - 1 - i);
    end
  end

  always_ff @(posedge clk_i) begin
    magnitude_q <= direction_i < 0 ? magnitude_t'(-direction_i) : magnitude_t'(direction_i);
    flags_q     <= '{shift: '0, zero: direction_i == '0, negative: direction_i < 0};

    magnitude_2q <= magnitude_q;
    zeros_q      <= zeros;
    flags_2q     <= flags_q;

    // A direction of zero divides by 2^26 in vain; the sign stage replaces its result.
    normalised_q   <= flags_2q.zero ? {1'b1, {(MagnitudeBits - 1) {1'b0}}} : magnitude_2q << zeros_q;
    flags_3q       <= flags_2q;
    flags_3q.shift <= rt_contract_pkg::recip_shift_t'(MagnitudeBits - 1) - zeros_q;
  end

  logic [QuotBits-1:0] quotient;
  magnitude_t remainder_unused;
  logic overflow_unused;  // the saturated quotient is the result
  rt_div #(
      .NumBits    (NumBits),
      .DenBits    (MagnitudeBits),
      .QuotBits   (QuotBits),
      .BitsPerStep(rt_stage_pkg::DivBitsPerStep)
  ) u_div (
      .clk_i,
      .num_i     ({1'b1, {(NumBits - 1) {1'b0}}}),
      .den_i     (normalised_q),
      .quot_o    (quotient),
      .rem_o     (remainder_unused),
      .overflow_o(overflow_unused)
  );

  rt_delay #(
      .Cycles(rt_stage_pkg::ReciprocalDivLatency),
      .data_t(flags_t)
  ) u_flags (
      .clk_i,
      .rst_ni,
      .data_i(flags_3q),
      .data_o(flags)
  );

  rt_contract_pkg::reciprocal_t unsigned_reciprocal;
  assign unsigned_reciprocal = {1'b0, quotient};
  always_comb begin
    reciprocal_o = flags.negative ? -unsigned_reciprocal : unsigned_reciprocal;
    if (flags.zero) reciprocal_o = '0;
  end

  assign shift_o    = flags.shift;
  assign zero_o     = flags.zero;
  assign negative_o = flags.negative;
endmodule
