// SPDX-License-Identifier: Apache-2.0
// Entry: takes a context with an instance record, makes the object's ray of the world's, and sends the context on.
//
// Purpose     rt_object_ray, as rt_instance_enter has it, and what follows from what it says:
//             the object is entered            the axes of its ray go out, one a clock, and with the last one the context is launched at the object's root
//             the ray passes the box by        on with the next reference of the leaf (next_*), or out of the leaf if there is none (out_*, EventGoOn)
//             the record cannot be             out_*, StatusBadRecord
// Input       in_valid_i only with in_ready_o; a context that finds the stage full tries again (rt_reference_unit). One waits in a register in front of it, so
//             that two that follow each other need not.
// Rows        enter_o: record_o enters, and rt_transform takes it in the same clock. All rows are there rt_stage_pkg::EnterRows clocks later.
// Waiting     What stands at the output waits for a launch or for a place in the queue of the references; both are taken by whoever returns from a leaf first.
//             After PauseClocks of that, pause_o keeps the result unit from sending further ones, so that the wait ends.
// Camera      With Camera, rays of a camera take the same way, and leave by made_*. One is let in when no context comes and the stage takes it at once; it has
//             a place behind the stage before it sets out, so no context ever waits for one.
// Rate        An entry in three clocks; one that is entered holds the output for as many. Of a camera MadeRays are inside at most.
// Counterpart enter_object in hls/top/trace.cpp. Source: Wald et al. 2003; Schmittler et al. 2004.
`include "rt_assert.svh"
module rt_entry #(
    parameter rt_config_pkg::config_t Config = rt_config_pkg::ConfigSaarcor,
    localparam bit Camera = Config.pixels != 0,
    localparam int unsigned ContextBits = $clog2(Config.lanes * Config.contexts_per_lane)
) (
    input  logic                                       clk_i,
    input  logic                                       rst_ni,
    input  logic                                       in_valid_i,
    output logic                                       in_ready_o,
    input  rt_contract_pkg::instance_enter_in_record_t in_data_i,
    input  logic [ContextBits-1:0]                     in_context_i,
    input  rt_core_pkg::entry_t                        in_entry_i,
    input  logic                                       camera_valid_i,
    output logic                                       camera_ready_o,
    input  rt_core_pkg::camera_ray_t                   camera_i,
    output logic                                       made_valid_o,
    input  logic                                       made_ready_i,
    output rt_core_pkg::made_ray_t                     made_o,
    output logic                                       enter_o,
    output rt_contract_pkg::instance_enter_in_record_t record_o,
    input  logic [2:0][rt_stage_pkg::EnterSumBits-1:0] place_i,
    input  logic [2:0][rt_stage_pkg::EnterSumBits-1:0] course_i,
    // What stands at the output; it belongs to all that follow.
    output logic [ContextBits-1:0]                     context_o,
    // The object is entered; with the last axis the launch, and what others keep of the entry.
    output logic                                       axis_valid_o,
    input  logic                                       axis_ready_i,
    output rt_core_pkg::ray_axis_t                     axis_o,
    output logic                                       launch_valid_o,
    output rt_core_pkg::launch_t                       launch_o,
    output rt_core_pkg::entered_t                      entered_o,
    output rt_contract_pkg::triangle_index_t           entered_next_o,
    output logic                                       next_valid_o,
    input  logic                                       next_ready_i,
    output logic                                       out_valid_o,
    input  logic                                       out_ready_i,
    output rt_contract_pkg::status_t                   out_event_o,
    output logic                                       pause_o,
    output logic                                       idle_o
);
  localparam int unsigned PauseClocks = 16;
  localparam int unsigned WaitBits = $clog2(PauseClocks + 1);
  // Of a camera's ray the tag is in place of the steps.
  typedef struct packed {
    logic                   camera;
    logic [ContextBits-1:0] ctx;
    rt_core_pkg::entry_t    entry;
  } tag_t;

  logic                                        valid, take, axis_is_last, of_context, lets_in;
  logic [1:0]                                  axis_q;
  logic [WaitBits-1:0]                         wait_q;
  rt_contract_pkg::instance_enter_out_record_t ray;
  tag_t                                        tag;
  // --- the next one ---
  logic                                       held_q, ray_ready;
  rt_contract_pkg::instance_enter_in_record_t record_q;
  tag_t                                       record_tag_q;
  assign in_ready_o = !held_q || ray_ready;
  assign record_o   = record_q;
  always_ff @(posedge clk_i) begin
    if (in_ready_o) begin
      held_q       <= in_valid_i || (camera_valid_i && lets_in);
      record_q     <= in_data_i;
      record_tag_q <= '{camera: 1'b0, ctx: in_context_i, entry: in_entry_i};
      if (Camera && !in_valid_i) begin
        record_q                 <= camera_i.data;
        record_tag_q.camera      <= 1'b1;
        record_tag_q.entry.steps <= camera_i.tag;
      end
    end
    if (!rst_ni) held_q <= 1'b0;
  end

  // --- one axis a clock: the first as it comes, the others wait ---
  `RT_ASSERT_INIT(RowsInTime, rt_stage_pkg::TransformLatency == rt_stage_pkg::EnterRows)
  logic [rt_stage_pkg::EnterRows:1]                  entered_q;
  logic                                              rows_come;
  logic [2:1][rt_stage_pkg::EnterSumBits-1:0]        place_q, course_q;
  assign rows_come = entered_q[rt_stage_pkg::EnterRows];
  always_ff @(posedge clk_i) begin
    entered_q <= rst_ni ? {entered_q[rt_stage_pkg::EnterRows-1:1], enter_o} : '0;
    place_q   <= rows_come ? place_i[2:1] : {place_q[2], place_q[2]};
    course_q  <= rows_come ? course_i[2:1] : {course_q[2], course_q[2]};
  end
  rt_object_ray #(
      .tag_t(tag_t)
  ) u_ray (
      .clk_i,
      .rst_ni,
      .in_valid_i (held_q),
      .in_ready_o (ray_ready),
      .in_data_i  (record_q),
      .in_tag_i   (record_tag_q),
      .enter_o,
      .place_i    (rows_come ? place_i[0] : place_q[1]),
      .course_i   (rows_come ? course_i[0] : course_q[1]),
      .out_valid_o(valid),
      .out_ready_i(take),
      .out_data_o (ray),
      .out_tag_o  (tag)
  );

  assign context_o      = tag.ctx;
  assign axis_is_last   = axis_q == 2'(rt_core_pkg::Axes - 1);
  assign of_context     = valid && !tag.camera;
  assign axis_valid_o   = of_context && ray.enters[0];
  assign launch_valid_o = axis_valid_o && axis_is_last;
  assign out_valid_o    = of_context && !ray.enters[0] && (ray.bad[0] || tag.entry.last);
  assign next_valid_o   = of_context && !ray.enters[0] && !out_valid_o;
  assign out_event_o    = ray.bad[0] ? rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRecord) : rt_core_pkg::EventGoOn;
  assign take           = (launch_valid_o && axis_ready_i) || (next_valid_o && next_ready_i) || (out_valid_o && out_ready_i) || (valid && tag.camera);
  always_ff @(posedge clk_i) begin
    if (axis_valid_o && axis_ready_i) axis_q <= axis_is_last ? '0 : axis_q + 1'b1;
    if (wait_q != WaitBits'(PauseClocks)) wait_q <= wait_q + 1'b1;
    if (!(axis_valid_o || next_valid_o) || take || !rst_ni) wait_q <= '0;
    if (!rst_ni) axis_q <= '0;
  end
  assign pause_o = wait_q == WaitBits'(PauseClocks);

  always_comb begin
    axis_o = '{
        axis: axis_q,
        direction: ray.direction[axis_q],
        walk: '{
            negative: ray.negative[axis_q],
            zero: ray.zero[axis_q],
            shift: ray.shift[axis_q],
            reciprocal: ray.reciprocal[axis_q],
            origin: ray.origin[axis_q]
        }
    };
    launch_o            = '0;
    launch_o.tree.level = 1'b1;
    launch_o.tree.fresh = 1'b1;
    launch_o.tree.root  = tag.entry.root;
    launch_o.node       = {tag.entry.root, 1'b0};
    launch_o.steps      = tag.entry.steps;
    entered_o = '{
        t_max: ray.t_max,
        number: tag.entry.number,
        first_id: tag.entry.first_id,
        scale: ray.scale,
        start: ray.start,
        root: tag.entry.root
    };
  end
  assign entered_next_o = tag.entry.next;

  // --- rays of a camera ---
  if (Camera) begin : gen_camera
    localparam int unsigned MadeRays = 16;
    localparam int unsigned CountBits = $clog2(MadeRays + 1);
    logic [CountBits-1:0] free_q, usage_unused;
    logic                 leaves, room;
    rt_core_pkg::made_ray_t made;
    // The register in front is free, and will be in the next clock.
    assign lets_in        = !in_valid_i && !held_q && ray_ready && free_q != '0;
    assign camera_ready_o = lets_in;
    assign leaves         = made_valid_o && made_ready_i;
    assign made           = rt_core_pkg::made_ray_of(tag.entry.steps, ray);
    always_ff @(posedge clk_i) begin
      free_q <= free_q + CountBits'(leaves) - CountBits'(camera_valid_i && lets_in);
      if (!rst_ni) free_q <= CountBits'(MadeRays);
    end
    rt_fifo #(
        .Depth (MadeRays),
        .data_t(rt_core_pkg::made_ray_t)
    ) u_made (
        .clk_i,
        .rst_ni,
        .in_valid_i (valid && tag.camera),
        .in_ready_o (room),
        .in_data_i  (made),
        .out_valid_o(made_valid_o),
        .out_ready_i(made_ready_i),
        .out_data_o (made_o),
        .usage_o    (usage_unused)
    );
    `RT_ASSERT(MadeHasRoom, !(valid && tag.camera) || room)
  end else begin : gen_no_camera
    logic camera_unused;
    assign camera_unused  = ^{camera_valid_i, camera_i, made_ready_i};
    assign lets_in        = 1'b0;
    assign camera_ready_o = 1'b0;
    assign made_valid_o   = 1'b0;
    assign made_o         = '0;
  end

  // For the end of a run: nothing is in the stage.
`ifndef SYNTHESIS
  logic [7:0] inside_q;
  always_ff @(posedge clk_i) inside_q <= !rst_ni ? '0 : inside_q + 8'((in_valid_i && in_ready_o) || (camera_valid_i && camera_ready_o)) - 8'(take);
  assign idle_o = inside_q == '0;
`else
  assign idle_o = 1'b1;
`endif

  `RT_ASSERT(EntersWithReady, !in_valid_i || in_ready_o)
endmodule
