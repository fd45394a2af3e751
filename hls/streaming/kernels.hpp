// The kernels of the streaming machine: records in, records out, the image read-only beside them.
//
// Multi-pass variant: ray and state of every ray lie in memory. A pass streams those that wait for one kernel through it; the host chooses the next
// kernel by how many rays wait for which (testbench/streaming/stream_engine.cpp). Branching variant: stream_trace keeps a ray until it is done.
//
//   stream_generate -> ray_setup_top -> stream_setup -> { stream_traverse, stream_intersect } -> stream_finish -> stream_shade -> pixels, and rays again
//
// `count` records are taken from every input stream. `grid`: the image, whose header is read; `voxels`, `list`, `triangles`: the image again, a port
// for each kind of read. `image_lines`: its size in lines of 64 bytes; nothing beyond is read. A damaged image or record ends in the status of the
// rays that it concerns, never in a hang or an access outside.
#pragma once
#include "../include/stream.hpp"
#include "grid_view.hpp"
#include "light.hpp"

/// Depths of the ports for co-simulation, in words; the image has RETRACE_COSIM_IMAGE_WORDS.
#define RETRACE_COSIM_MATERIAL_WORDS 1024
#define RETRACE_COSIM_CAMERA_WORDS 4
#define RETRACE_COSIM_FRAME_WORDS 2
#define RETRACE_COSIM_STREAM_SUMMARY_WORDS 5

namespace retrace::hls {
static const int kMostRays = 1 << 30;             // a static bound
static const long long kStreamTurns = 1LL << 40;  // a static bound of the steps of all rays
}  // namespace retrace::hls

/// Words of the summary of stream_trace.
enum RetraceStreamSummary {
  kStreamStatus = 0,  ///< 0, or why nothing was traced (RetraceFault)
  kStreamRays,
  kStreamVoxels,
  kStreamTests,
  kStreamSteps,  ///< turns of the loop: every one is of traverse or of intersect
  kStreamSummaryWords
};

extern "C" {
/// Eye rays of a frame (contract: camera, frame) row by row, for sample `sample` of each pixel, as what ray_setup_top takes, and a note with each.
/// Rays whose note is not active do not meet the grid.
void stream_generate(hls::stream<retrace::hls::ray_setup_in_word_t>& rays,
                     hls::stream<retrace::hls::note_word_t>& notes, const retrace::hls::word_t* grid,
                     const retrace::hls::word_t* camera, const retrace::hls::word_t* frame, ap_uint<32> image_lines,
                     ap_uint<32> sample);
/// A ray enters the grid. Numbers rays from `first`.
void stream_setup(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                  hls::stream<retrace::hls::ray_state_word_t>& states, const retrace::hls::word_t* grid,
                  ap_uint<32> image_lines, ap_uint<32> first, ap_uint<32> count);
/// One voxel.
void stream_traverse(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                     hls::stream<retrace::hls::ray_state_word_t>& in, hls::stream<retrace::hls::ray_state_word_t>& out,
                     const retrace::hls::word_t* grid, const retrace::hls::word_t* voxels, ap_uint<32> image_lines,
                     ap_uint<32> count);
/// One triangle.
void stream_intersect(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                      hls::stream<retrace::hls::ray_state_word_t>& in, hls::stream<retrace::hls::ray_state_word_t>& out,
                      const retrace::hls::word_t* grid, const retrace::hls::word_t* list,
                      const retrace::hls::line_t* triangles, ap_uint<32> image_lines, ap_uint<32> count);
/// The hit record of a ray.
void stream_finish(hls::stream<retrace::hls::ray_state_word_t>& states, hls::stream<retrace::hls::hit_word_t>& hits,
                   ap_uint<32> count);
/// Of each hit a record on every output: light for its pixel at once, a ray to the light, which brings light unless it hits, and a bounce; each
/// counts if its note is active. `materials`: material_count records of 8 bytes. `light_*`: position codes, sign extended; `light_colour`: 8 bits each of red,
/// green, blue.
void stream_shade(hls::stream<retrace::hls::ray_setup_out_word_t>& rays, hls::stream<retrace::hls::hit_word_t>& hits,
                  hls::stream<retrace::hls::note_word_t>& notes, hls::stream<retrace::hls::note_word_t>& direct,
                  hls::stream<retrace::hls::ray_setup_in_word_t>& shadow_rays,
                  hls::stream<retrace::hls::note_word_t>& shadow_notes,
                  hls::stream<retrace::hls::ray_setup_in_word_t>& bounce_rays,
                  hls::stream<retrace::hls::note_word_t>& bounce_notes, const retrace::hls::word_t* grid,
                  const retrace::hls::word_t* materials, ap_uint<32> image_lines, ap_uint<32> material_count,
                  ap_uint<32> light_x, ap_uint<32> light_y, ap_uint<32> light_z, ap_uint<32> light_colour,
                  ap_uint<32> seed, ap_uint<32> count);
/// The branching variant, a ray after the other: states of rays that are done.
void stream_trace(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                  hls::stream<retrace::hls::ray_state_word_t>& states, const retrace::hls::word_t* grid,
                  const retrace::hls::word_t* voxels, const retrace::hls::word_t* list,
                  const retrace::hls::line_t* triangles, ap_uint<64>* summary, ap_uint<32> image_lines,
                  ap_uint<32> first, ap_uint<32> count);
}
