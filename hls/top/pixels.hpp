// Pictures without a host: rays from a camera, rays from hits towards the light, pixels. Kernels on both sides of the one that traces; what goes
// between them is a stream.
#pragma once
#include "../include/contract_types.hpp"
#include "../include/stream.hpp"

/// Words of the summary of retrace_raster and of retrace_shade.
enum RetracePixels {
  kPixelsStatus = 0,  ///< 0, or why nothing was drawn: RetraceFault of trace.hpp, or kFaultFrame
  kPixelsSamples,     ///< samples made, or shaded
  kPixelsOdd,  ///< retrace_raster: samples whose camera is none that a host writes; retrace_shade: hits of triangles without a material;
               ///< retrace_shadow: rays made
  kPixelsWords
};
enum RetracePixelsFault { kFaultFrame = 8 };

/// Samples of a frame as rays, in its order: tiles in rows, pixels of a tile in rows, samples of a pixel one after the other.
/// `image`: the memory image, of which the header is read. `camera`, `frame`: one record each.
extern "C" void retrace_raster(const retrace::hls::word_t* image, const retrace::hls::word_t* camera,
                               const retrace::hls::word_t* frame, hls::stream<retrace::hls::raster_out_word_t>& samples,
                               ap_uint<64>* summary, ap_uint<32> image_lines);

/// What became of these samples, in the same order, into pixels of 32 or 64 bits (contract: pixel_*), row by row from `pixels`.
/// `materials`: a word for each of instance_count instances, then the materials, two in a word; material_count of 8 bytes in all.
extern "C" void retrace_shade(const retrace::hls::word_t* frame, const retrace::hls::word_t* materials,
                              hls::stream<retrace::hls::shade_in_word_t>& samples, ap_uint<32>* pixels,
                              ap_uint<64>* summary, ap_uint<32> material_count, ap_uint<32> instance_count);

/// Where the frame has shadows: a record for each of these samples and what became of it, a ray towards the light where there is something to light.
/// The ray wants any hit; if there is one, the sample lies in a shadow.
extern "C" void retrace_shadow(const retrace::hls::word_t* image, const retrace::hls::word_t* frame,
                               hls::stream<retrace::hls::raster_out_word_t>& samples,
                               hls::stream<retrace::hls::shade_in_word_t>& hits,
                               hls::stream<retrace::hls::raster_out_word_t>& rays, ap_uint<64>* summary,
                               ap_uint<32> image_lines);
