// SPDX-License-Identifier: Apache-2.0
// The core of streams by itself: rays of a test pattern in, a checksum of hits out, a memory that C++ plays behind the one memory port
// (tests/rtl_core/streams_test.cpp). Configuration small with any depth of the hops.
module tb_streams #(
    parameter int unsigned FillHops = 1,
    parameter int unsigned LaunchHops = 1,
    parameter int unsigned LeafHops = 1
) (
    input  logic                                clk_i,
    input  logic                                rst_ni,
    input  logic                                start_i,
    input  logic [rt_core_pkg::AddrBits-1:0]    image_base_i,
    input  logic [31:0]                         image_lines_i,
    input  logic                                parent_links_i,
    input  logic                                use_mailbox_i,
    output logic                                busy_o,
    output logic                                done_o,
    output logic                                drained_o,
    output logic [1:0]                          image_fault_o,
    output logic                                ray_fault_o,
    output rt_contract_pkg::status_t            first_fault_o,
    output rt_core_pkg::ray_tag_t               fault_tag_o,
    // the source
    input  logic                                stop_i,
    input  logic [31:0]                         count_i,
    input  logic [15:0]                         width_i,
    input  logic signed [31:0]                  base_i         [6],
    input  logic signed [31:0]                  step_x_i       [6],
    input  logic signed [31:0]                  step_y_i       [6],
    input  rt_contract_pkg::t_limit_t           t_max_i,
    input  logic                                mark_i,
    input  logic [7:0]                          source_rest_i,
    output logic                                ray_taken_o,
    // the sink
    input  logic                                hold_i,
    input  logic [7:0]                          sink_rest_i,
    output logic [31:0]                         hit_count_o,
    output logic [63:0]                         checksum_o,
    // the memory
    output logic                                read_valid_o,
    input  logic                                read_ready_i,
    output logic [rt_core_pkg::AddrBits-1:0]    read_addr_o,
    output logic [7:0]                          read_len_o,
    output logic [rt_core_pkg::SourceBits-1:0]  read_source_o,
    output logic [rt_core_pkg::MshrIdBits-1:0]  read_mshr_o,
    input  logic [rt_config_pkg::Sources-1:0]   fill_valid_i,
    input  logic [rt_core_pkg::MshrIdBits-1:0]  fill_mshr_i,
    input  logic                                fill_last_i,
    input  logic                                fill_error_i,
    input  logic [63:0]                         fill_data_i
);
  function automatic rt_config_pkg::config_t with_hops();
    with_hops             = rt_config_pkg::ConfigSmall;
    with_hops.fill_hops   = FillHops;
    with_hops.launch_hops = LaunchHops;
    with_hops.leaf_hops   = LeafHops;
  endfunction
  localparam rt_config_pkg::config_t Config = with_hops();

  rt_core_pkg::run_status_t      status;
  rt_core_pkg::read_request_t    read;
  rt_core_pkg::tagged_ray_t      ray;
  rt_core_pkg::tagged_hit_t      hit;
  rt_contract_pkg::triangle_index_t number_unused;
  logic                             camera_unused, made_valid_unused;
  rt_core_pkg::made_ray_t           made_unused;
  rt_config_pkg::counter_steps_t steps_unused;
  rt_contract_pkg::position_t [5:0] box_unused;
  logic                          rays_start, source_done, sink_done, ray_valid, ray_ready, hit_valid, hit_ready;
  rt_core #(
      .Config(Config)
  ) u_core (
      .clk_i,
      .rst_ni,
      .start_i,
      .run_i         ('{image_base: image_base_i, image_lines: image_lines_i, parent_links: parent_links_i, use_mailbox: use_mailbox_i,
                        own_step_limit: 1'b0, step_limit: '0, any_origin: 1'b0}),
      .status_o      (status),
      .rays_start_o  (rays_start),
      .sources_done_i(source_done),
      .box_o         (box_unused),
      .drained_o,
      .sinks_done_i  (sink_done),
      .ray_valid_i   (ray_valid),
      .ray_ready_o   (ray_ready),
      .ray_i         (ray),
      .hit_valid_o   (hit_valid),
      .hit_ready_i   (hit_ready),
      .hit_o         (hit),
      .hit_number_o  (number_unused),
      .camera_valid_i(1'b0),
      .camera_ready_o(camera_unused),
      .camera_i      ('0),
      .made_valid_o  (made_valid_unused),
      .made_ready_i  (1'b0),
      .made_o        (made_unused),
      .read_valid_o,
      .read_ready_i,
      .read_o        (read),
      .fill_i        ('{valid: fill_valid_i, mshr: fill_mshr_i, last: fill_last_i, error: fill_error_i}),
      .fill_data_i,
      .steps_o       (steps_unused)
  );
  tb_pattern_source u_source (
      .clk_i,
      .rst_ni,
      .start_i    (rays_start),
      .stop_i,
      .count_i,
      .width_i,
      .base_i,
      .step_x_i,
      .step_y_i,
      .t_max_i,
      .mark_i,
      .rest_i     (source_rest_i),
      .done_o     (source_done),
      .ray_valid_o(ray_valid),
      .ray_ready_i(ray_ready),
      .ray_o      (ray)
  );
  tb_checksum_sink u_sink (
      .clk_i,
      .rst_ni,
      .clear_i    (status.started),
      .hold_i,
      .rest_i     (sink_rest_i),
      .hit_valid_i(hit_valid),
      .hit_ready_o(hit_ready),
      .hit_i      (hit),
      .done_o     (sink_done),
      .count_o    (hit_count_o),
      .checksum_o
  );
  assign busy_o        = status.busy;
  assign done_o        = status.done;
  assign image_fault_o = status.image_fault;
  assign ray_fault_o   = status.ray_fault;
  assign first_fault_o = status.first_fault;
  assign fault_tag_o   = status.fault_tag;
  assign ray_taken_o   = ray_valid && ray_ready;
  assign read_addr_o   = read.addr;
  assign read_len_o    = read.len;
  assign read_source_o = read.source;
  assign read_mshr_o   = read.mshr;
endmodule
