// SPDX-License-Identifier: Apache-2.0
// A probe at every stage; numbers as in golden/engine/walk.hpp (Stage).
bind rt_ray_setup rt_stage_probe #(
    .Stage(0), .InBits($bits(rt_contract_pkg::ray_setup_in_record_t)), .OutBits($bits(rt_contract_pkg::ray_setup_out_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
bind rt_kd_descend rt_stage_probe #(
    .Stage(1), .InBits($bits(rt_contract_pkg::kd_descend_in_record_t)), .OutBits($bits(rt_contract_pkg::kd_descend_out_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
bind rt_leaf_exit rt_stage_probe #(
    .Stage(2), .InBits($bits(rt_contract_pkg::leaf_exit_in_record_t)), .OutBits($bits(rt_contract_pkg::leaf_exit_out_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
// What has nothing to test travels through rt_tri_test as well, marked by its tag, which only the core knows.
bind rt_core rt_stage_probe #(
    .Stage(3), .InBits($bits(rt_contract_pkg::tri_test_in_record_t)), .OutBits($bits(rt_contract_pkg::tri_test_out_record_t))
) u_tri_test_probe (
    .clk_i, .rst_ni(rst_n[ResetTests]),
    .in_valid_i(test_valid && test_tag.test), .in_ready_o(test_ready), .in_data_i(test_data),
    .out_valid_o(tri_valid && tri_tag.test), .out_ready_i(tri_ready), .out_data_o(tri_data)
);
bind rt_kd_backtrack rt_stage_probe #(
    .Stage(4), .InBits($bits(rt_contract_pkg::kd_backtrack_in_record_t)), .OutBits($bits(rt_contract_pkg::kd_backtrack_out_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
bind rt_object_ray rt_stage_probe #(
    .Stage(6), .InBits($bits(rt_contract_pkg::instance_enter_in_record_t)), .OutBits($bits(rt_contract_pkg::instance_enter_out_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
bind rt_hit_finish rt_stage_probe #(
    .Stage(5), .InBits($bits(rt_contract_pkg::hit_finish_in_record_t)), .OutBits($bits(rt_contract_pkg::hit_record_t))
) u_probe (.clk_i, .rst_ni, .in_valid_i, .in_ready_o, .in_data_i, .out_valid_o, .out_ready_i, .out_data_o);
