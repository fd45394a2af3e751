// The traversal kernel as a ring of tasks: streams, tasks and their wiring, once for synthesis and C simulation.
//
//   ray_reader -> ray_setup -> launch -> node_fetch -> step (both twice) -> leaf_fetch -> leaf_exit -> list_fetch -> mailbox -> triangle_fetch -> tri_test
//                                ^                                                                                                      |
//                                +---------------------------------- ready -------------------------------------------------------- result
//                                                                          hit_writer <- hit_finish <-  work_writer, summary_writer  <-+
//
// RETRACE_RING_CONTEXTS tokens go round. In one lap a token makes two steps down or up, because most of a walk
// is steps: a second node_fetch and step, with a port and a cache of their own. If it arrives at a leaf it also finds where it leaves it and tests
// its first reference; a token that is in a leaf tests one more. A task that a token does not need hands it on.
//
// Why it cannot deadlock. `ready` has room for all tokens, so `result` never waits to write it. What `result` hands out of the ring (finishes, works,
// totals) goes to tasks that wait for nothing but memory. So `result` always reads again, and by induction every task before it. `launch` may
// wait for rays, which wait for memory only, and for room in the streams of constants: the task at their end reads them when the token before the
// full place arrives, and it does, because no task between needs `launch` for that. All reads and writes block, so the tasks are a Kahn process
// network: neither the words of a stream nor whether it deadlocks depend on the order in which the tasks run.
// Least depths (tests/csim/ring_test.cpp): one word everywhere and two places less than tokens in `ready`; one less deadlocks.
// Source of the network argument: Kahn 1974; Parks 1995 (bounded channels).
#pragma once
#include "../top/image_view.hpp"
#include "tasks.hpp"

// STREAM(name, word, depth, who writes it, who reads it). 2 words let both ends work in every clock; rays and hits smooth tasks of II = 8.
#define RETRACE_RING_STREAMS(STREAM)                                 \
  STREAM(ray_words, token_word_t, 16, ray_reader, ray_setup)         \
  STREAM(setups, ray_setup_out_word_t, 32, ray_setup, launch)        \
  STREAM(ready, token_word_t, RETRACE_RING_CONTEXTS, result, launch) \
  STREAM(step_rays, token_word_t, 64, launch, step)                  \
  STREAM(step_rays_2, token_word_t, 128, launch, step_2)             \
  STREAM(exit_rays, token_word_t, 256, launch, leaf_exit)            \
  STREAM(test_rays, token_word_t, 256, launch, tri_test)             \
  STREAM(result_rays, ring_word64_t, 256, launch, result)            \
  STREAM(launched, token_word_t, 2, launch, node_fetch)              \
  STREAM(nodes, token_data_t, 2, node_fetch, step)                   \
  STREAM(stepped, token_word_t, 2, step, node_fetch_2)               \
  STREAM(nodes_2, token_data_t, 2, node_fetch_2, step_2)             \
  STREAM(stepped_2, token_word_t, 2, step_2, leaf_fetch)             \
  STREAM(leaf_lines, token_line_t, 2, leaf_fetch, leaf_exit)         \
  STREAM(in_leaf, token_data_t, 2, leaf_exit, list_fetch)            \
  STREAM(references, token_word_t, 2, list_fetch, mailbox)           \
  STREAM(wanted, token_word_t, 2, mailbox, triangle_fetch)           \
  STREAM(triangle_lines, token_line_t, 2, triangle_fetch, tri_test)  \
  STREAM(candidates, token_data_t, 2, tri_test, result)              \
  STREAM(finishes, token_data_t, 64, result, hit_finish)             \
  STREAM(finished_hits, token_word_t, 2, hit_finish, hit_writer)     \
  STREAM(works, token_word_t, 16, result, work_writer)               \
  STREAM(totals, ring_word64_t, 8, result, summary_writer)

// TASK(name, function, arguments), in terms of the arguments of ring_region and the streams.
#define RETRACE_RING_TASKS(TASK)                                                                                  \
  TASK(ray_reader, ray_reader, (ray_words, rays, ray_count))                                                      \
  TASK(ray_setup, ray_setup,                                                                                      \
       (ray_words, setups, ap_uint<32>(view.box[0]), ap_uint<32>(view.box[1]), ap_uint<32>(view.box[2]),          \
        ap_uint<32>(view.box[3]), ap_uint<32>(view.box[4]), ap_uint<32>(view.box[5]), ray_count))                 \
  TASK(launch, launch,                                                                                            \
       (setups, ready, step_rays, step_rays_2, exit_rays, test_rays, result_rays, launched, ray_count, contexts)) \
  TASK(node_fetch, node_fetch, (launched, nodes, pairs, view.pair_offset, view.pair_count, view.step_limit))      \
  TASK(step, step, (nodes, step_rays, stepped))                                                                   \
  TASK(node_fetch_2, node_fetch, (stepped, nodes_2, pairs_2, view.pair_offset, view.pair_count, view.step_limit)) \
  TASK(step_2, step, (nodes_2, step_rays_2, stepped_2))                                                           \
  TASK(leaf_fetch, leaf_fetch, (stepped_2, leaf_lines, leaves, view.leaf_offset, view.leaf_count))                \
  TASK(leaf_exit, leaf_exit, (leaf_lines, exit_rays, in_leaf, parent_links))                                      \
  TASK(list_fetch, list_fetch,                                                                                    \
       (in_leaf, references, list, view.list_offset, view.list_count, view.triangle_count, view.step_limit))      \
  TASK(mailbox, mailbox, (references, wanted, mailbox))                                                           \
  TASK(triangle_fetch, triangle_fetch, (wanted, triangle_lines, triangles, view.triangle_offset))                 \
  TASK(tri_test, tri_test, (triangle_lines, test_rays, candidates))                                               \
  TASK(result, result, (candidates, result_rays, ready, finishes, works, totals, parent_links, write_work))       \
  TASK(hit_finish, hit_finish, (finishes, finished_hits))                                                         \
  TASK(hit_writer, hit_writer, (finished_hits, hits))                                                             \
  TASK(work_writer, work_writer, (works, work))                                                                   \
  TASK(summary_writer, summary_writer, (totals, summary, fault))

#define RETRACE_RING_PORTS                                                                                             \
  const retrace::hls::word_t *pairs, const retrace::hls::word_t *pairs_2, const retrace::hls::line_t *leaves,          \
      const retrace::hls::word_t *list, const retrace::hls::line_t *triangles, const retrace::hls::token_word_t *rays, \
      retrace::hls::word_t *hits, retrace::hls::word_t *work, ap_uint<64>*summary

/// All tasks at once: in hardware a DATAFLOW region (region.cpp), in C simulation the testbench's scheduler.
void ring_region(RETRACE_RING_PORTS, const retrace::hls::image_view& view, ap_uint<32> ray_count, ap_uint<32> contexts,
                 ap_uint<32> parent_links, ap_uint<32> mailbox, ap_uint<32> write_work, ap_uint<32> fault);

/// Kernel top: what retrace_trace does (hls/top/trace.hpp), with the same hits, work and summary bit for bit. Lines of 64 bytes for leaves and
/// triangles, 32 bytes for rays.
extern "C" void retrace_ring(RETRACE_RING_PORTS, ap_uint<32> image_lines, ap_uint<32> ray_count, ap_uint<8> options);
