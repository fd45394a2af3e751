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

  // ray_setup: capture, magnitude, leading zeros, normalise, divide, sign; the third axis enters two clocks after the first.
  localparam int unsigned ReciprocalQuotBits = rt_contract_pkg::ReciprocalBits - 1;
  localparam int unsigned RaySetupDivLatency = rt_lib_pkg::div_latency(ReciprocalQuotBits, DivBitsPerStep);
  localparam int unsigned RaySetupDepth = 4 + RaySetupDivLatency + 1 + 2;
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
  localparam int unsigned TriTestBlocks = (6 * 3 + 4) * ProductBlocks;

  // hit_finish: capture, room, shift, divide, saturate; v enters a clock after u.
  localparam int unsigned HitQuotBits = rt_contract_pkg::BarycentricFrac;
  localparam int unsigned HitDivLatency = rt_lib_pkg::div_latency(HitQuotBits, DivBitsPerStep);
  localparam int unsigned HitFinishDepth = 3 + HitDivLatency + 1 + 1;
  localparam int unsigned HitFinishLatency = rt_lib_pkg::pipe_latency(HitFinishDepth);
  localparam int unsigned HitFinishInterval = 2;
  localparam int unsigned HitFinishBlocks = 0;

endpackage
