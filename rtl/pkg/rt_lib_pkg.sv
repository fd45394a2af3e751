// SPDX-License-Identifier: Apache-2.0
// Latencies and costs of the library, for whoever instantiates it.
//
// Purpose     A module that aligns data with a multiplier or a divider reads the latency here and never repeats a number.
//             The library modules build on the same functions, so they cannot disagree.
// Units       Clocks from an input to the output that belongs to it; DSP blocks of 18 x 18 bits.
package rt_lib_pkg;

  // Operand bits of one DSP block: 18 signed. A piece that is not the top one of its operand uses 17 of them, its sign bit is 0.
  localparam int unsigned DspBits = 18;
  localparam int unsigned PieceBits = DspBits - 1;
  // rt_mul splits an operand into at most two pieces.
  localparam int unsigned MulMaxBits = PieceBits + DspBits;

  function automatic int unsigned mul_pieces(int unsigned bits);
    return bits <= DspBits ? 1 : 2;
  endfunction

  // DSP blocks of rt_mul.
  function automatic int unsigned mul_blocks(int unsigned a_bits, int unsigned b_bits);
    return mul_pieces(a_bits) * mul_pieces(b_bits);
  endfunction

  // rt_mul: operand registers, product registers, a register for each level of the adder tree.
  function automatic int unsigned mul_latency(int unsigned a_bits, int unsigned b_bits);
    return 2 + $clog2(mul_blocks(a_bits, b_bits));
  endfunction

  // rt_div and rt_div_seq: clocks that produce quotient bits.
  function automatic int unsigned div_steps(int unsigned quot_bits, int unsigned bits_per_step);
    return (quot_bits + bits_per_step - 1) / bits_per_step;
  endfunction

  // rt_div: operand registers, then one register for each step.
  function automatic int unsigned div_latency(int unsigned quot_bits, int unsigned bits_per_step);
    return 1 + div_steps(quot_bits, bits_per_step);
  endfunction

  // rt_div_seq: clocks from one accepted division to the next when the result is taken at once.
  function automatic int unsigned div_seq_interval(int unsigned quot_bits, int unsigned bits_per_step);
    return 2 + div_steps(quot_bits, bits_per_step);
  endfunction

  // rt_pipe_ctrl: results it can hold. A credit is away for the trip through the datapath, one clock in the output FIFO and one to return.
  function automatic int unsigned pipe_credits(int unsigned latency, int unsigned interval);
    return (latency + 2 + interval - 1) / interval;
  endfunction

  // rt_pipe_ctrl: clocks from accepting an input to offering its result.
  function automatic int unsigned pipe_latency(int unsigned latency);
    return latency + 1;
  endfunction

endpackage
