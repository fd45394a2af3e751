// SPDX-License-Identifier: Apache-2.0
// The shader unit with its records as separate ports (testbench/sim/spu_bench.hpp).
module tb_spu #(
    parameter int unsigned Threads = 32
) (
    input  logic         clk_i,
    input  logic         rst_ni,
    input  logic         write_valid_i,
    input  logic         write_constant_i,
    input  logic [  9:0] write_address_i,
    input  logic [127:0] write_data_i,
    input  logic [ 10:0] length_i,
    input  logic [ 10:0] start_i,
    input  logic [ 31:0] step_limit_i,
    input  logic [ 24:0] memory_vectors_i,
    input  logic [ 23:0] triangles_i,
    input  logic [  7:0] triangle_vectors_i,
    input  logic [ 23:0] object_i,
    output logic         idle_o,
    input  logic         launch_valid_i,
    output logic         launch_ready_o,
    input  logic [127:0] launch_parameters_i,
    output logic         result_valid_o,
    input  logic         result_ready_i,
    output logic [127:0] result_parameters_o,
    output logic [127:0] result_colour_o,
    output logic [ 31:0] result_steps_o,
    output logic [  2:0] result_status_o,
    output logic [  7:0] result_code_o,
    output logic         ray_valid_o,
    input  logic         ray_ready_i,
    output logic [  5:0] ray_thread_o,
    output logic [ 95:0] ray_origin_o,
    output logic [ 95:0] ray_direction_o,
    output logic [ 31:0] ray_t_min_o,
    output logic [ 31:0] ray_t_max_o,
    output logic         ray_any_o,
    input  logic         answer_valid_i,
    output logic         answer_ready_o,
    input  logic [  5:0] answer_thread_i,
    input  logic         answer_hit_i,
    input  logic [ 31:0] answer_t_i,
    input  logic [ 31:0] answer_u_i,
    input  logic [ 31:0] answer_v_i,
    input  logic [ 23:0] answer_id_i,
    output logic         request_valid_o,
    input  logic         request_ready_i,
    output logic         request_write_o,
    output logic [ 23:0] request_address_o,
    output logic [127:0] request_data_o,
    output logic [  5:0] request_thread_o,
    output logic [  7:0] request_tag_o,
    input  logic         reply_valid_i,
    output logic         reply_ready_o,
    input  logic [  5:0] reply_thread_i,
    input  logic [  7:0] reply_tag_i,
    input  logic [127:0] reply_data_i,
    output logic         begins_o,
    output logic [  5:0] thread_o,
    output logic [ 10:0] place_o,
    output logic [  5:0] window_o,
    output logic [  4:0] depth_o,
    output logic [ 31:0] steps_o,
    output logic         writes_o,
    output logic [  5:0] write_thread_o,
    output logic [  6:0] slot_o,
    output logic [  3:0] mask_o,
    output logic [127:0] data_o
);
  import rt_spu_pkg::*;
  result_t  result;
  ray_t     ray;
  request_t request;
  event_t   events;
  assign {result_parameters_o, result_colour_o} = {result.parameters, result.colour};
  assign {result_steps_o, result_status_o, result_code_o} = {result.steps, result.status, result.code};
  assign {ray_thread_o, ray_origin_o, ray_direction_o} = {ray.thread, ray.origin, ray.direction};
  assign {ray_t_min_o, ray_t_max_o, ray_any_o} = {ray.t_min, ray.t_max, ray.any};
  assign {request_write_o, request_address_o, request_data_o} = {request.write, request.address, request.data};
  assign {request_thread_o, request_tag_o} = request.tag;
  assign {begins_o, thread_o, place_o, window_o, depth_o, steps_o} = {
    events.begins, events.thread, events.place, events.window, events.depth, events.steps
  };
  assign {writes_o, write_thread_o, slot_o, mask_o, data_o} = {
    events.writes, events.write_thread, events.slot, events.mask, events.data
  };
  rt_spu #(
      .Threads(Threads)
  ) u_spu (
      .clk_i,
      .rst_ni,
      .write_valid_i,
      .write_data_i  ('{constant: write_constant_i, address: write_address_i, data: write_data_i}),
      .setting_i     ('{
          length: length_i,
          start: start_i,
          step_limit: step_limit_i,
          memory_vectors: memory_vectors_i,
          triangles: triangles_i,
          triangle_vectors: triangle_vectors_i,
          object: object_i
      }),
      .idle_o,
      .launch_valid_i,
      .launch_ready_o,
      .launch_data_i (launch_parameters_i),
      .result_valid_o,
      .result_ready_i,
      .result_data_o (result),
      .ray_valid_o,
      .ray_ready_i,
      .ray_data_o    (ray),
      .answer_valid_i,
      .answer_ready_o,
      .answer_data_i ('{thread: answer_thread_i, hit: answer_hit_i, id: answer_id_i, v: answer_v_i, u: answer_u_i, t: answer_t_i}),
      .request_valid_o,
      .request_ready_i,
      .request_data_o(request),
      .reply_valid_i,
      .reply_ready_o,
      .reply_data_i  ('{tag: {reply_thread_i, reply_tag_i}, data: reply_data_i}),
      .event_o       (events)
  );
endmodule
