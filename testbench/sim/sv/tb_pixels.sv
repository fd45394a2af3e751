// SPDX-License-Identifier: Apache-2.0
// Source of rays from a camera and sink of hits that makes pixels, without the core between them: C++ plays that, and the memory of the materials
// (tests/rtl/rtl_pixels_test.cpp).
module tb_pixels #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned GranuleBytes = 8
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [511:0]                     camera_i,
    input  logic [255:0]                     frame_i,
    input  logic signed [31:0]               box_i        [6],
    input  logic [rt_core_pkg::AddrBits-1:0] base_i,
    input  logic [31:0]                      count_i,
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
    output logic                             ray_odd_o,  // error or any
    input  logic                             hit_valid_i,
    output logic                             hit_ready_o,
    input  logic [31:0]                      hit_tag_i,
    input  logic [3:0]                       hit_status_i,
    input  logic [31:0]                      hit_id_i,
    input  logic [31:0]                      hit_t_i,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output logic [rt_core_pkg::AddrBits-1:0] fetch_addr_o,
    output logic [7:0]                       fetch_len_o,
    input  logic                             fill_valid_i,
    input  logic                             fill_error_i,
    input  logic [DataBits-1:0]              fill_data_i,
    output logic                             pixel_valid_o,
    input  logic                             pixel_ready_i,
    output logic [31:0]                      pixel_tag_o,
    output logic [63:0]                      pixel_data_o
);
  rt_contract_pkg::position_t [5:0] box;
  rt_core_pkg::tagged_ray_t         ray;
  rt_core_pkg::tagged_hit_t         hit;
  rt_core_pkg::read_request_t       fetch;
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
  assign ray_odd_o   = ray.error || ray.any != '0;
  rt_raster u_raster (
      .clk_i,
      .rst_ni,
      .start_i,
      .camera_i,
      .frame_i,
      .box_i           (box),
      .done_o          (source_done_o),
      .fault_o,
      .bad_o,
      .finished_valid_i(finished_valid),
      .finished_slot_i (finished_slot),
      .place_valid_o   (place_valid),
      .place_slot_o    (place_slot),
      .place_o         (place),
      .ray_valid_o,
      .ray_ready_i,
      .ray_o           (ray),
      .miss_valid_o    (miss_valid),
      .miss_ready_i    (miss_ready),
      .miss_o          (miss)
  );
  rt_shade #(
      .DataBits    (DataBits),
      .GranuleBytes(GranuleBytes)
  ) u_shade (
      .clk_i,
      .rst_ni,
      .start_i,
      .frame_i,
      .base_i,
      .count_i,
      .idle_o,
      .unknown_o,
      .hit_valid_i,
      .hit_ready_o,
      .hit_i           (hit),
      .miss_valid_i    (miss_valid),
      .miss_ready_o    (miss_ready),
      .miss_i          (miss),
      .place_valid_i   (place_valid),
      .place_slot_i    (place_slot),
      .place_i         (place),
      .finished_valid_o(finished_valid),
      .finished_slot_o (finished_slot),
      .fetch_valid_o,
      .fetch_ready_i,
      .fetch_o         (fetch),
      .fill_valid_i,
      .fill_error_i,
      .fill_data_i,
      .pixel_valid_o,
      .pixel_ready_i,
      .pixel_o         (pixel)
  );
  assign fetch_addr_o = fetch.addr;
  assign fetch_len_o  = fetch.len;
  assign pixel_tag_o  = pixel.tag;
  assign pixel_data_o = pixel.data;
endmodule
