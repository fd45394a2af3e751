// SPDX-License-Identifier: Apache-2.0
// Light on a material: what a sample shows where something is hit.
//
// Formula     facing = min(|n . l| >> 8, 2^16 - 1), 0 in a shadow; lit = min(256 ambient + (diffuse facing >> 8), 2^16 - 1); strength = floor(sqrt(lit)), 255 where unlit;
//             component = colour (strength + 1) >> 8. The root two bits a clock.
// Latency     rt_stage_pkg::LightLatency, II 1. DSP blocks rt_stage_pkg::LightBlocks.
// Cuts        valid, data and ready (rt_pipe_ctrl). frame_i does not change while anything is inside.
// Counterpart hls/stages/shade.hpp, golden/engine/stages/shade.hpp.
`include "rt_assert.svh"
module rt_light #(
    parameter type tag_t = logic [15:0]
) (
    input  logic                              clk_i,
    input  logic                              rst_ni,
    input  rt_contract_pkg::frame_record_t    frame_i,
    input  logic                              in_valid_i,
    output logic                              in_ready_o,
    input  rt_contract_pkg::material_record_t in_data_i,
    input  rt_core_pkg::turned_t [2:0]        in_light_i,
    input  logic                              in_shadow_i,
    input  tag_t                              in_tag_i,
    output logic                              out_valid_o,
    input  logic                              out_ready_i,
    output rt_contract_pkg::shade_t [2:0]     out_data_o,
    output tag_t                              out_tag_o
);
  localparam int unsigned NormalBits = rt_contract_pkg::NormalBits;
  localparam int unsigned ShadeBits = rt_contract_pkg::ShadeBits;
  localparam int unsigned LitBits = 2 * ShadeBits;
  localparam int unsigned ProductBits = NormalBits + rt_core_pkg::TurnedBits;
  localparam int unsigned SumBits = ProductBits + 2;
  typedef logic signed [SumBits-1:0] sum_t;
  typedef logic [LitBits-1:0] lit_t;
  typedef rt_contract_pkg::shade_t shade_t;
  typedef struct packed {
    logic         unlit;
    shade_t [2:0] colour;
  } surface_t;

  // n . l
  logic signed [2:0][ProductBits-1:0] product;
  for (genvar a = 0; a < 3; a++) begin : gen_axis
    rt_mul #(
        .ABits(NormalBits),
        .BBits(rt_core_pkg::TurnedBits)
    ) u_product (
        .clk_i,
        .a_i(in_shadow_i ? '0 : in_data_i.normal[a]),
        .b_i(in_light_i[a]),
        .p_o(product[a])
    );
  end
  sum_t sum_q;
  logic [SumBits-2:0] size;
  lit_t facing_q;
  assign size = sum_q < 0 ? (SumBits - 1)'(-sum_q) : (SumBits - 1)'(sum_q);
  always_ff @(posedge clk_i) begin
    sum_q    <= sum_t'(signed'(product[0])) + sum_t'(signed'(product[1])) + sum_t'(signed'(product[2]));
    facing_q <= (size >> (LitBits + ShadeBits)) != '0 ? '1 : size[LitBits+ShadeBits-1:ShadeBits];
  end

  // diffuse * facing, and what comes from everywhere
  logic signed [LitBits+ShadeBits+1:0] part;
  logic [LitBits:0] lit_sum;
  lit_t lit_q;
  rt_mul #(
      .ABits(LitBits + 1),
      .BBits(ShadeBits + 1)
  ) u_part (
      .clk_i,
      .a_i({1'b0, facing_q}),
      .b_i({1'b0, frame_i.diffuse}),
      .p_o(part)
  );
  assign lit_sum = (LitBits + 1)'({frame_i.ambient, ShadeBits'(0)}) + (LitBits + 1)'(part[LitBits+ShadeBits-1:ShadeBits]);
  always_ff @(posedge clk_i) lit_q <= lit_sum[LitBits] ? '1 : lit_sum[LitBits-1:0];

  // The root, a bit at a time from its upper end: `rest` is what the square of the bits so far leaves of the bits of `lit` that were looked at.
  localparam int unsigned RootClocks = rt_stage_pkg::LightRootClocks;
  localparam int unsigned BitsPerClock = ShadeBits / RootClocks;
  localparam int unsigned RestBits = ShadeBits + 3;
  typedef struct packed {
    logic [RestBits-1:0] rest;
    shade_t              root;
    lit_t                left;
  } root_t;
  function automatic root_t root_step(root_t from);
    root_step = from;
    for (int unsigned b = 0; b < BitsPerClock; b++) begin
      root_step.rest = {root_step.rest[RestBits-3:0], root_step.left[LitBits-1-:2]};
      root_step.left = root_step.left << 2;
      if (root_step.rest >= RestBits'({root_step.root, 2'b01})) begin
        root_step.rest = root_step.rest - RestBits'({root_step.root, 2'b01});
        root_step.root = {root_step.root[ShadeBits-2:0], 1'b1};
      end else begin
        root_step.root = {root_step.root[ShadeBits-2:0], 1'b0};
      end
    end
  endfunction
  root_t root_q[RootClocks];
  always_ff @(posedge clk_i) begin
    root_q[0] <= root_step('{rest: '0, root: '0, left: lit_q});
    for (int unsigned c = 1; c < RootClocks; c++) root_q[c] <= root_step(root_q[c-1]);
  end

  surface_t surface;
  rt_delay #(
      .Cycles(rt_stage_pkg::LightRoot),
      .data_t(surface_t)
  ) u_surface (
      .clk_i,
      .rst_ni,
      .data_i('{unlit: in_data_i.unlit, colour: in_data_i.colour}),
      .data_o(surface)
  );
  logic [ShadeBits:0] strength;
  shade_t [2:0] shown;
  shade_t root;
  assign root     = surface.unlit ? '1 : root_q[RootClocks-1].root;
  assign strength = (ShadeBits + 1)'(root) + 1'b1;
  for (genvar c = 0; c < 3; c++) begin : gen_component
    logic signed [2*ShadeBits+2:0] product_shown;
    rt_mul #(
        .ABits(ShadeBits + 1),
        .BBits(ShadeBits + 2)
    ) u_shown (
        .clk_i,
        .a_i({1'b0, surface.colour[c]}),
        .b_i({1'b0, strength}),
        .p_o(product_shown)
    );
    assign shown[c] = product_shown[2*ShadeBits-1:ShadeBits];
  end

  logic enter_unused;
  rt_pipe_ctrl #(
      .Latency(rt_stage_pkg::LightDepth),
      .tag_t  (tag_t),
      .data_t (shade_t [2:0])
  ) u_ctrl (
      .clk_i,
      .rst_ni,
      .in_valid_i,
      .in_ready_o,
      .in_tag_i,
      .enter_o    (enter_unused),
      .pipe_data_i(shown),
      .out_valid_o,
      .out_ready_i,
      .out_tag_o,
      .out_data_o
  );
endmodule
