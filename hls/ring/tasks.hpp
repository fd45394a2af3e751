// The tasks of the ring. Each is a top of its own: blocking reads and writes of streams, at most one access to memory an iteration, and an end when
// the token of the end has come (the tasks of the ring), or all rays or totals have (the others).
#pragma once
#include "../top/trace.hpp"
#include "token.hpp"

namespace retrace::hls {

typedef ap_uint<512> line_t;        // a line of memory
static const int kRingEndBit = 32;  // above the number of a ray: no ray, the end

}  // namespace retrace::hls

// Between two accesses to one token's place in a memory lies a lap of the ring: the order of the tokens never changes, and all of them stay in it
// until every ray is done.
#define RT_LAP(name) RT_INDEPENDENT(name, RETRACE_RING_CONTEXTS)
#define RT_DEPTH(name, words) RT_VENDOR(HLS stream variable = name depth = words)
// Any older content of the memory is as right as the newest.
#define RT_STALE(name) RT_VENDOR(HLS dependence variable = name type = inter dependent = false)

extern "C" {
void ring_ray_reader(hls::stream<retrace::hls::token_word_t>& rays_out, const retrace::hls::token_word_t* rays,
                     ap_uint<32> ray_count);
void ring_ray_setup(hls::stream<retrace::hls::token_word_t>& rays_in,
                    hls::stream<retrace::hls::ray_setup_out_word_t>& setups, ap_uint<32> box_0, ap_uint<32> box_1,
                    ap_uint<32> box_2, ap_uint<32> box_3, ap_uint<32> box_4, ap_uint<32> box_5, ap_uint<32> ray_count);
void ring_launch(hls::stream<retrace::hls::ray_setup_out_word_t>& setups,
                 hls::stream<retrace::hls::token_word_t>& ready, hls::stream<retrace::hls::token_word_t>& step_rays,
                 hls::stream<retrace::hls::token_word_t>& step_rays_2,
                 hls::stream<retrace::hls::token_word_t>& exit_rays, hls::stream<retrace::hls::token_word_t>& test_rays,
                 hls::stream<retrace::hls::ring_word64_t>& result_rays, hls::stream<retrace::hls::token_word_t>& tokens,
                 ap_uint<32> ray_count, ap_uint<32> contexts);
void ring_node_fetch(hls::stream<retrace::hls::token_word_t>& in, hls::stream<retrace::hls::token_data_t>& out,
                     const retrace::hls::word_t* pairs, ap_uint<32> pair_offset, ap_uint<32> pair_count,
                     ap_uint<32> step_limit);
void ring_step(hls::stream<retrace::hls::token_data_t>& in, hls::stream<retrace::hls::token_word_t>& step_rays,
               hls::stream<retrace::hls::token_word_t>& out);
void ring_leaf_fetch(hls::stream<retrace::hls::token_word_t>& in, hls::stream<retrace::hls::token_line_t>& out,
                     const retrace::hls::line_t* leaves, ap_uint<32> leaf_offset, ap_uint<32> leaf_count);
void ring_leaf_exit(hls::stream<retrace::hls::token_line_t>& in, hls::stream<retrace::hls::token_word_t>& exit_rays,
                    hls::stream<retrace::hls::token_data_t>& out, ap_uint<32> parent_links);
void ring_list_fetch(hls::stream<retrace::hls::token_data_t>& in, hls::stream<retrace::hls::token_word_t>& out,
                     const retrace::hls::word_t* list, ap_uint<32> list_offset, ap_uint<32> list_count,
                     ap_uint<32> triangle_count, ap_uint<32> step_limit);
void ring_mailbox(hls::stream<retrace::hls::token_word_t>& in, hls::stream<retrace::hls::token_word_t>& out,
                  ap_uint<32> mailbox);
void ring_triangle_fetch(hls::stream<retrace::hls::token_word_t>& in, hls::stream<retrace::hls::token_line_t>& out,
                         const retrace::hls::line_t* triangles, ap_uint<32> triangle_offset);
void ring_tri_test(hls::stream<retrace::hls::token_line_t>& in, hls::stream<retrace::hls::token_word_t>& test_rays,
                   hls::stream<retrace::hls::token_data_t>& out);
void ring_result(hls::stream<retrace::hls::token_data_t>& in, hls::stream<retrace::hls::ring_word64_t>& result_rays,
                 hls::stream<retrace::hls::token_word_t>& ready, hls::stream<retrace::hls::token_data_t>& finishes,
                 hls::stream<retrace::hls::token_word_t>& works, hls::stream<retrace::hls::ring_word64_t>& totals,
                 ap_uint<32> parent_links, ap_uint<32> write_work);
void ring_hit_finish(hls::stream<retrace::hls::token_data_t>& finishes,
                     hls::stream<retrace::hls::token_word_t>& hits_out);
void ring_hit_writer(hls::stream<retrace::hls::token_word_t>& hits_in, retrace::hls::word_t* hits);
void ring_work_writer(hls::stream<retrace::hls::token_word_t>& works, retrace::hls::word_t* work);
void ring_summary_writer(hls::stream<retrace::hls::ring_word64_t>& totals, retrace::hls::ring_word64_t* summary,
                         ap_uint<32> fault);
}
