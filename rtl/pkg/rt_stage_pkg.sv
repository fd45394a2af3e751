// SPDX-License-Identifier: Apache-2.0
// Latency, initiation interval and DSP blocks of every stage, for whoever instantiates one.
//
// Purpose     The stages build their pipelines on these functions, the core sizes its queues by them, a test compares them with what it
//             measures, and scripts/rtl_table.py prints them in docs/rtl-stages.md.
// Units       *_depth: clocks through the datapath. *_latency: clocks from acceptance to a valid output. *_interval: clocks from one
//             acceptance to the next. *_blocks: DSP blocks of 18 x 18 bits.
package rt_stage_pkg;

  // Quotient bits a clock of the pipelined dividers.
  localparam int unsigned DivBitsPerStep = 1;

  // A product of two 27-bit codes.
  localparam int unsigned ProductLatency = rt_lib_pkg::mul_latency(rt_contract_pkg::PositionBits, rt_contract_pkg::PositionBits);
  localparam int unsigned ProductBlocks = rt_lib_pkg::mul_blocks(rt_contract_pkg::PositionBits, rt_contract_pkg::PositionBits);

  // rt_t_plane: subtract, multiply, shift, saturate.
  localparam int unsigned TPlaneLatency = 1 + ProductLatency + 2;
  // rt_row_product: three products, two levels of adders.
  localparam int unsigned RowLatency = ProductLatency + 2;

  // rt_reciprocal: magnitude, leading zeros, normalise, divide.
  localparam int unsigned ReciprocalQuotBits = rt_contract_pkg::ReciprocalBits - 1;
  localparam int unsigned ReciprocalDivLatency = rt_lib_pkg::div_latency(ReciprocalQuotBits, DivBitsPerStep);
  localparam int unsigned ReciprocalLatency = 3 + ReciprocalDivLatency;

  // ray_setup: capture, reciprocal, sign; the third axis enters two clocks after the first.
  localparam int unsigned RaySetupDepth = 1 + ReciprocalLatency + 1 + 2;
  localparam int unsigned RaySetupLatency = rt_lib_pkg::pipe_latency(RaySetupDepth);
  localparam int unsigned RaySetupInterval = 3;
  localparam int unsigned RaySetupBlocks = 0;

  // Places for results of steps beyond the round trip: a lane stores one of two results and a launch in a clock. Up to 16 places cost nothing.
  localparam int unsigned StepSpare = 6;

  // kd_descend: t_plane, and a comparison on the way into the result FIFO: this latency is in the loop of every step.
  localparam int unsigned KdDescendDepth = TPlaneLatency;
  localparam int unsigned KdDescendLatency = rt_lib_pkg::pipe_latency(KdDescendDepth);
  localparam int unsigned KdDescendInterval = 1;
  localparam int unsigned KdDescendBlocks = ProductBlocks;

  // leaf_exit: choose the sides, three t_plane, compare, select.
  localparam int unsigned LeafExitDepth = 1 + TPlaneLatency + 2;
  localparam int unsigned LeafExitLatency = rt_lib_pkg::pipe_latency(LeafExitDepth);
  localparam int unsigned LeafExitInterval = 1;
  localparam int unsigned LeafExitBlocks = 3 * ProductBlocks;

  // kd_backtrack: one clock of comparisons.
  localparam int unsigned KdBacktrackDepth = 1;
  localparam int unsigned KdBacktrackLatency = rt_lib_pkg::pipe_latency(KdBacktrackDepth);
  localparam int unsigned KdBacktrackInterval = 1;
  localparam int unsigned KdBacktrackBlocks = 0;

  // tri_test: rows, flip, then U, V, W and the verdict beside the division.
  localparam int unsigned TriFlip = RowLatency + 1;
  localparam int unsigned TriEdge = TriFlip + ProductLatency + 1;
  localparam int unsigned TriVerdict = TriEdge + 3;
  localparam int unsigned TriQuotBits = rt_contract_pkg::TLimitBits;
  localparam int unsigned TriTestDepth = TriFlip + rt_lib_pkg::div_latency(TriQuotBits, DivBitsPerStep);
  localparam int unsigned TriTestLatency = rt_lib_pkg::pipe_latency(TriTestDepth);
  localparam int unsigned TriTestInterval = 1;
  // Places for results beyond the round trip of the core's tests, whose result unit also takes events of leaves. Up to 48 places cost nothing more.
  localparam int unsigned TestSpare = 8;
  localparam int unsigned TriTestBlocks = (6 * 3 + 4) * ProductBlocks;

  // hit_finish: capture, room, shift, divide, saturate; v enters a clock after u.
  localparam int unsigned HitQuotBits = rt_contract_pkg::BarycentricFrac;
  localparam int unsigned HitDivLatency = rt_lib_pkg::div_latency(HitQuotBits, DivBitsPerStep);
  localparam int unsigned HitFinishDepth = 3 + HitDivLatency + 1 + 1;
  localparam int unsigned HitFinishLatency = rt_lib_pkg::pipe_latency(HitFinishDepth);
  localparam int unsigned HitFinishInterval = 2;
  localparam int unsigned HitFinishBlocks = 0;

  // instance_enter: one axis a clock, and four places where an axis waits two clocks for the others. Each constant is the clock, counted from the
  // acceptance and for the first axis, in which that value is there.
  localparam int unsigned EnterSumBits = 60;  // S and D of any record and any ray
  localparam int unsigned EnterMulLatency = rt_lib_pkg::mul_latency(rt_contract_pkg::InstanceCoefficientBits, rt_contract_pkg::PositionBits);
  localparam int unsigned EnterRows = 1 + EnterMulLatency + 2;  // S and D
  localparam int unsigned EnterSize = EnterRows + 2;            // size and exponent
  localparam int unsigned EnterLevel = EnterSize + 3;           // L and s of all axes
  localparam int unsigned EnterFine = EnterLevel + 3;           // X and S with its exponent
  localparam int unsigned EnterSquare = EnterFine + 1 + 2;      // g squared
  localparam int unsigned EnterNorm = EnterSquare + 3;          // whether k is L + 1
  localparam int unsigned EnterDirection = EnterNorm + 2;       // d'
  localparam int unsigned EnterReciprocal = EnterDirection + ReciprocalLatency + 1;
  localparam int unsigned EnterPlane = EnterReciprocal + 1 + TPlaneLatency;  // t of two slabs
  localparam int unsigned EnterNear = EnterPlane + 3;                        // near and far of all axes
  localparam int unsigned EnterStart = EnterNear + 2;                        // q
  localparam int unsigned EnterStepBits = 17 + 18;                           // A in two pieces: the lower one, unsigned, in this many signed bits
  localparam int unsigned EnterStep = EnterStart + rt_lib_pkg::mul_latency(rt_contract_pkg::EntryStartBits + 1, EnterStepBits) + 1;
  localparam int unsigned EnterOrigin = EnterStep + 1;
  localparam int unsigned InstanceEnterDepth = EnterOrigin + 1 + 2;
  localparam int unsigned InstanceEnterLatency = rt_lib_pkg::pipe_latency(InstanceEnterDepth);
  localparam int unsigned InstanceEnterInterval = 3;
  localparam int unsigned ObjectRayBlocks = 2 * ProductBlocks + rt_lib_pkg::mul_blocks(rt_contract_pkg::EntryStartBits + 1, EnterStepBits) +
      rt_lib_pkg::mul_blocks(rt_contract_pkg::EntryStartBits + 1, rt_lib_pkg::DspBits) + 1;
  localparam int unsigned InstanceEnterBlocks = 6 * rt_lib_pkg::mul_blocks(rt_contract_pkg::InstanceCoefficientBits, rt_contract_pkg::PositionBits) + ObjectRayBlocks;

  // rt_transform: a choice between the two, products, two levels of adders.
  localparam int unsigned TransformLatency = 1 + EnterMulLatency + 2;

  // rt_turn: products, sum, and the two rows behind the first.
  localparam int unsigned TurnDepth = rt_lib_pkg::mul_latency(rt_contract_pkg::TurnBits, rt_contract_pkg::NormalBits) + 1 + 2;

  // rt_light: n . l, its size, diffuse part, sum, root, components.
  localparam int unsigned LightRootClocks = 4;
  localparam int unsigned LightLit = rt_lib_pkg::mul_latency(rt_contract_pkg::NormalBits, rt_contract_pkg::NormalBits + 2) + 2 +
      rt_lib_pkg::mul_latency(2 * rt_contract_pkg::ShadeBits + 1, rt_contract_pkg::ShadeBits + 1) + 1;
  localparam int unsigned LightRoot = LightLit + LightRootClocks;
  localparam int unsigned LightDepth = LightRoot + rt_lib_pkg::mul_latency(rt_contract_pkg::ShadeBits + 1, rt_contract_pkg::ShadeBits + 2);
  localparam int unsigned LightLatency = rt_lib_pkg::pipe_latency(LightDepth);
  localparam int unsigned LightBlocks = 3 + 1 + 3;

endpackage
