// The streaming tops of the stages, as hls/stages/*.cpp define them.
#pragma once
#include <hls_stream.h>

#include "hls/include/contract_types.hpp"

extern "C" {
void ray_setup_top(hls::stream<retrace::hls::ray_setup_in_word_t>& in,
                   hls::stream<retrace::hls::ray_setup_out_word_t>& out);
void kd_descend_top(hls::stream<retrace::hls::kd_descend_in_word_t>& in,
                    hls::stream<retrace::hls::kd_descend_out_word_t>& out);
void leaf_exit_top(hls::stream<retrace::hls::leaf_exit_in_word_t>& in,
                   hls::stream<retrace::hls::leaf_exit_out_word_t>& out);
void kd_backtrack_top(hls::stream<retrace::hls::kd_backtrack_in_word_t>& in,
                      hls::stream<retrace::hls::kd_backtrack_out_word_t>& out);
void tri_test_top(hls::stream<retrace::hls::tri_test_in_word_t>& in,
                  hls::stream<retrace::hls::tri_test_out_word_t>& out);
void instance_enter_top(hls::stream<retrace::hls::instance_enter_in_word_t>& in,
                        hls::stream<retrace::hls::instance_enter_out_word_t>& out);
void hit_finish_top(hls::stream<retrace::hls::hit_finish_in_word_t>& in, hls::stream<retrace::hls::hit_word_t>& out);
}
