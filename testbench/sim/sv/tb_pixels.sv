// SPDX-License-Identifier: Apache-2.0
// Source of rays from a camera and sink of hits that makes pixels, without the core between them: C++ plays that, and the memory of the table
// (tests/rtl/rtl_pixels_test.cpp).
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
  rt_raster u_raster (
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
      .miss_o          (miss)
  );
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
