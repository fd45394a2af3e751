// SPDX-License-Identifier: Apache-2.0
// Source of rays from a camera and sink of hits that makes pixels, without the core between them: C++ plays that, and the memory of the table
// (tests/rtl/rtl_pixels_test.cpp). With two levels the camera's rays come from rt_entry, among contexts at random, some of which stand at its end for long.
`include "rt_assert.svh"
module tb_pixels #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned GranuleBytes = 8,
    parameter int unsigned Levels = 1
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [511:0]                     camera_i,
    input  logic [255:0]                     frame_i,
    input  logic signed [31:0]               box_i        [6],
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,
    input  logic [31:0]                      count_i,
    input  logic [31:0]                      placed_i,
    output logic                             source_done_o,
    output logic                             idle_o,
    output logic                             fault_o,
    output logic                             bad_o,
    output logic                             unknown_o,
    output logic                             ray_valid_o,
    input  logic                             ray_ready_i,
    output logic [31:0]                      ray_tag_o,
    output logic [31:0]                      ray_t_max_o,
    output logic signed [31:0]               ray_origin_o [3],
    output logic signed [31:0]               ray_direction_o[3],
    output logic                             ray_any_o,
    output logic                             ray_error_o,
    input  logic                             hit_valid_i,
    output logic                             hit_ready_o,
    input  logic [31:0]                      hit_tag_i,
    input  logic [3:0]                       hit_status_i,
    input  logic [31:0]                      hit_id_i,
    input  logic [31:0]                      hit_t_i,
    input  logic [23:0]                      hit_number_i,
    output logic [1:0]                       fetch_valid_o,
    input  logic                             fetch_ready_i,
    output logic [rt_core_pkg::AddrBits-1:0] fetch_addr_o [2],
    output logic [7:0]                       fetch_len_o  [2],
    input  logic [1:0]                       fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             pixel_valid_o,
    input  logic                             pixel_ready_i,
    output logic [31:0]                      pixel_tag_o,
    output logic [63:0]                      pixel_data_o
);
  rt_contract_pkg::position_t [5:0] box;
  rt_core_pkg::tagged_ray_t         ray, camera_ray, rays[2];
  rt_core_pkg::sample_t             sample;
  logic                             camera_done, shadow_busy, shade_idle, sample_valid, sample_ready, index_unused;
  logic [1:0]                       rays_valid, rays_ready;
  rt_core_pkg::tagged_hit_t         hit;
  rt_core_pkg::read_request_t       fetch[2];
  rt_core_pkg::pixel_t              pixel;
  rt_core_pkg::ray_tag_t            miss;
  rt_core_pkg::pixel_slot_t         place_slot, finished_slot;
  rt_core_pkg::pixel_place_t        place;
  logic                             miss_valid, miss_ready, place_valid, finished_valid;
  always_comb begin
    for (int unsigned f = 0; f < 6; f++) box[f] = rt_contract_pkg::position_t'(box_i[f]);
    hit            = '0;
    hit.tag        = hit_tag_i;
    hit.hit.status = hit_status_i;
    hit.hit.id     = hit_id_i;
    hit.hit.t      = rt_contract_pkg::t_limit_t'(hit_t_i);
    for (int unsigned a = 0; a < 3; a++) begin
      ray_origin_o[a]    = 32'(signed'(ray.origin[a]));
      ray_direction_o[a] = 32'(signed'(ray.direction[a]));
    end
  end
  assign ray_tag_o   = ray.tag;
  assign ray_t_max_o = 32'(ray.t_max);
  assign ray_any_o   = ray.any[0];
  assign ray_error_o = ray.error;
  assign rays[1]     = camera_ray;
  assign source_done_o = camera_done && !shadow_busy;
  assign idle_o        = shade_idle && !shadow_busy;
  logic                     camera_valid, camera_ready, made_valid, made_ready;
  rt_core_pkg::camera_ray_t camera;
  rt_core_pkg::made_ray_t   made;
  rt_raster #(
      .Own(Levels == 1)
  ) u_raster (
      .clk_i,
      .rst_ni,
      .start_i,
      .camera_i,
      .frame_i,
      .box_i           (box),
      .done_o          (camera_done),
      .fault_o,
      .bad_o,
      .finished_valid_i(finished_valid),
      .finished_slot_i (finished_slot),
      .place_valid_o   (place_valid),
      .place_slot_o    (place_slot),
      .place_o         (place),
      .ray_valid_o     (rays_valid[1]),
      .ray_ready_i     (rays_ready[1]),
      .ray_o           (camera_ray),
      .miss_valid_o    (miss_valid),
      .miss_ready_i    (miss_ready),
      .miss_o          (miss),
      .camera_valid_o  (camera_valid),
      .camera_ready_i  (camera_ready),
      .camera_o        (camera),
      .made_valid_i    (made_valid),
      .made_ready_o    (made_ready),
      .made_i          (made)
  );
  if (Levels > 1) begin : gen_entry
    localparam rt_config_pkg::config_t Config = rt_config_pkg::ConfigSaarcor;
    localparam int unsigned ContextBits = $clog2(Config.lanes * Config.contexts_per_lane);
    logic                                       context_valid, context_ready, leaves, enters, ends_ready;
    rt_contract_pkg::instance_enter_in_record_t record;
    logic [2:0][rt_stage_pkg::EnterSumBits-1:0] place_rows, course_rows;
    rt_contract_pkg::row_position_t [2:0]       position_unused;
    rt_contract_pkg::row_direction_t [2:0]      direction_unused;
    logic [ContextBits-1:0]                     left_context;
    logic                                       axis_unused, launch_unused, next_unused, pause_unused, idle_unused;
    rt_core_pkg::ray_axis_t                     axis_data_unused;
    rt_core_pkg::launch_t                       launch_data_unused;
    rt_core_pkg::entered_t                      entered_unused;
    rt_contract_pkg::triangle_index_t           next_data_unused;
    rt_contract_pkg::status_t                   event_code;
    // A record of 0 has no direction, so it cannot be. A quarter of the clocks have one, and in a half of the spans of 256 none leaves.
    logic [15:0]            random_q;
    logic [ContextBits-1:0] sent_q, left_q;
    logic [9:0]             clock_q;
    always_ff @(posedge clk_i) begin
      random_q <= {random_q[14:0], random_q[15] ^ random_q[13] ^ random_q[12] ^ random_q[10]};
      clock_q  <= clock_q + 1'b1;
      if (context_valid) sent_q <= sent_q + 1'b1;
      if (leaves && ends_ready) left_q <= left_q + 1'b1;
      if (!rst_ni) begin
        random_q <= 16'hace1;
        clock_q  <= '0;
        sent_q   <= '0;
        left_q   <= '0;
      end
    end
    assign context_valid = context_ready && random_q[1:0] == '0;
    assign ends_ready    = !clock_q[8];
    rt_transform u_transform (
        .clk_i,
        .rst_ni,
        .entry_i    (enters),
        .instance_i (record),
        .triangle_i ('0),
        .place_o    (place_rows),
        .course_o   (course_rows),
        .position_o (position_unused),
        .direction_o(direction_unused)
    );
    rt_entry #(
        .Config(Config)
    ) u_entry (
        .clk_i,
        .rst_ni,
        .in_valid_i    (context_valid),
        .in_ready_o    (context_ready),
        .in_data_i     ('0),
        .in_context_i  (sent_q),
        .in_entry_i    ('0),
        .camera_valid_i(camera_valid),
        .camera_ready_o(camera_ready),
        .camera_i      (camera),
        .made_valid_o  (made_valid),
        .made_ready_i  (made_ready),
        .made_o        (made),
        .enter_o       (enters),
        .record_o      (record),
        .place_i       (place_rows),
        .course_i      (course_rows),
        .context_o     (left_context),
        .axis_valid_o  (axis_unused),
        .axis_ready_i  (1'b0),
        .axis_o        (axis_data_unused),
        .launch_valid_o(launch_unused),
        .launch_o      (launch_data_unused),
        .entered_o     (entered_unused),
        .entered_next_o(next_data_unused),
        .next_valid_o  (next_unused),
        .next_ready_i  (1'b0),
        .out_valid_o   (leaves),
        .out_ready_i   (ends_ready),
        .out_event_o   (event_code),
        .pause_o       (pause_unused),
        .idle_o        (idle_unused)
    );
    `RT_ASSERT(ContextsInOrder, !leaves || left_context == left_q)
    `RT_ASSERT(ContextsAsTheyAre, !leaves || event_code == rt_contract_pkg::status_t'(rt_contract_pkg::StatusBadRecord))
    `RT_ASSERT(NothingElseLeaves, !axis_unused && !next_unused)
  end else begin : gen_own
    assign camera_ready = 1'b0;
    assign made_valid   = 1'b0;
    assign made         = '0;
  end
  rt_arbiter #(
      .NumInputs(2),
      .data_t   (rt_core_pkg::tagged_ray_t)
  ) u_rays (
      .clk_i,
      .rst_ni,
      .in_valid_i (rays_valid),
      .in_ready_o (rays_ready),
      .in_data_i  (rays),
      .in_last_i  ('1),
      .out_valid_o(ray_valid_o),
      .out_ready_i(ray_ready_i),
      .out_data_o (ray),
      .out_index_o(index_unused)
  );
  rt_shadow u_shadow (
      .clk_i,
      .rst_ni,
      .start_i,
      .frame_i,
      .box_i        (box),
      .busy_o       (shadow_busy),
      .place_valid_i(place_valid),
      .place_ray_i  (camera_ray),
      .hit_valid_i,
      .hit_ready_o,
      .hit_i        (hit),
      .hit_number_i,
      .ray_valid_o  (rays_valid[0]),
      .ray_ready_i  (rays_ready[0]),
      .ray_o        (rays[0]),
      .out_valid_o  (sample_valid),
      .out_ready_i  (sample_ready),
      .out_o        (sample)
  );
  rt_shade #(
      .DataBits    (DataBits),
      .GranuleBytes(GranuleBytes),
      .TwoLevels   (Levels > 1)
  ) u_shade (
      .clk_i,
      .rst_ni,
      .start_i,
      .frame_i,
      .base_i,
      .count_i,
      .placed_i,
      .idle_o          (shade_idle),
      .unknown_o,
      .hit_valid_i     (sample_valid),
      .hit_ready_o     (sample_ready),
      .hit_i           (sample),
      .miss_valid_i    (miss_valid),
      .miss_ready_o    (miss_ready),
      .miss_i          (miss),
      .place_valid_i   (place_valid),
      .place_slot_i    (place_slot),
      .place_i         (place),
      .finished_valid_o(finished_valid),
      .finished_slot_o (finished_slot),
      .fetch_valid_o,
      .fetch_ready_i   ({2{fetch_ready_i}}),
      .fetch_o         (fetch),
      .fill_valid_i,
      .fill_error_i,
      .fill_data_i,
      .pixel_valid_o,
      .pixel_ready_i,
      .pixel_o         (pixel)
  );
  for (genvar r = 0; r < 2; r++) begin : gen_fetch
    assign fetch_addr_o[r] = fetch[r].addr;
    assign fetch_len_o[r]  = fetch[r].len;
  end
  assign pixel_tag_o  = pixel.tag;
  assign pixel_data_o = pixel.data;
endmodule
