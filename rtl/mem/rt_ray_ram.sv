// SPDX-License-Identifier: Apache-2.0
// Rays of the contexts of a unit: written axis by axis, read whole.
//
// Banks       A configuration of two levels keeps two rays a context: Contexts are then {level, context}.
// Latency     1, as rt_ram_sdp, of which it is one for each axis; so are collisions and contents.
`include "rt_assert.svh"
module rt_ray_ram #(
    parameter int unsigned Contexts = 32,
    parameter type axis_t = rt_core_pkg::walk_axis_t,
    localparam int unsigned ContextBits = $clog2(Contexts)
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,
    input  logic                          write_en_i,
    input  logic [ContextBits-1:0]        write_context_i,
    input  logic [1:0]                    write_axis_i,
    input  axis_t                         write_data_i,
    input  logic                          read_en_i,
    input  logic [ContextBits-1:0]        read_context_i,
    output axis_t [rt_core_pkg::Axes-1:0] read_data_o
);
  for (genvar a = 0; a < int'(rt_core_pkg::Axes); a++) begin : gen_axis
    rt_ram_sdp #(
        .Depth (Contexts),
        .data_t(axis_t)
    ) u_ram (
        .clk_i,
        .rst_ni,
        .write_en_i  (write_en_i && write_axis_i == 2'(a)),
        .write_addr_i(write_context_i),
        .write_data_i,
        .read_en_i,
        .read_addr_i (read_context_i),
        .read_data_o (read_data_o[a])
    );
  end
  `RT_ASSERT(AxisExists, !write_en_i || 32'(write_axis_i) < rt_core_pkg::Axes)
endmodule
