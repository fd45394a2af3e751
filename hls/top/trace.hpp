// The full kernel: traces rays over a memory image, kd-backtrack without a stack, a barrel of contexts.
#pragma once
#include "../include/contract_types.hpp"

/// Number of ray contexts in the barrel: one step each in turn, so that a step may take that many clocks.
#define RETRACE_CONTEXTS 32
/// Entries of the mailbox of a ray.
#define RETRACE_MAILBOX 8
/// And of the one for instances.
#define RETRACE_INSTANCE_MAILBOX 4

/// Words of each array that the vendor's C/RTL co-simulation copies to its memories (depth of the ports): its testbench allocates as many. The
/// kernel itself knows no such limit.
#define RETRACE_COSIM_IMAGE_WORDS 2048
#define RETRACE_COSIM_RAYS 96
#define RETRACE_COSIM_RAY_WORDS 192
#define RETRACE_COSIM_SUMMARY_WORDS 9

/// Words of the summary: status of the run and totals.
enum RetraceSummary {
  kSummaryStatus = 0,  ///< 0, or why nothing was traced (RetraceFault)
  kSummaryRays,        ///< hits written
  kSummaryFaults,      ///< rays that ended in an error status
  kSummaryDown,
  kSummaryUp,
  kSummaryLeaf,
  kSummaryTests,
  kSummarySkipped,
  kSummarySteps,  ///< iterations of the barrel that did a step
  kSummaryWords
};

enum RetraceFault {
  kFaultNone = 0,
  kFaultHeader = 1,  ///< magic or version is wrong
  kFaultLayout = 2,  ///< a section does not lie inside the image, or has more records than its index type can name
};

/// Options of a run, bits of `options`.
#define RETRACE_OPTION_PARENT_LINKS 1  ///< climb parent links; otherwise use the face links of the leaf
#define RETRACE_OPTION_MAILBOX 2
#define RETRACE_OPTION_WORK 4  ///< write a work record for each ray
/// Rays are a camera's (pixels.hpp): their origins may lie outside of the root box, and hits are placed_hit records.
#define RETRACE_OPTION_ENTERED 8

/// Kernel top.
/// `pairs`, `leaves`, `list`, `triangles`: the memory image, 128-bit words, each pointing at its first word (four ports, so that the
/// four kinds of read do not wait for each other). `image_lines`: its size in 64-byte lines; nothing beyond is read.
/// `rays`: ray_count ray records, two words each. `hits`: one word each. `work`: one word each, touched only with
/// RETRACE_OPTION_WORK. `summary`: kSummaryWords words.
/// A corrupt image or ray ends in the status of the rays it concerns (contract: status), never in a hang or an access outside.
extern "C" void retrace_trace(const retrace::hls::word_t* pairs, const retrace::hls::word_t* leaves,
                              const retrace::hls::word_t* list, const retrace::hls::word_t* triangles,
                              const retrace::hls::word_t* rays, retrace::hls::word_t* hits, retrace::hls::word_t* work,
                              ap_uint<64>* summary, ap_uint<32> image_lines, ap_uint<32> ray_count, ap_uint<8> options);
