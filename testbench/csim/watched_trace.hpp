// The kernel once more, with a witness of every call of a stage: for one ray at a time, not for speed.
#pragma once
#include <functional>
#include <span>

#include "golden/engine/walk.hpp"
#include "hls/top/trace.hpp"

namespace retrace {

/// Called with the packed records of each call, in the order in which the kernel makes them.
using StageWitness =
    std::function<void(Stage stage, std::span<const std::uint64_t> input, std::span<const std::uint64_t> output)>;

/// Arguments are those of retrace_trace, in the calling thread.
void watched_trace(const StageWitness& witness, const hls::word_t* image, const hls::word_t* rays, hls::word_t* hits,
                   ap_uint<64>* summary, ap_uint<32> image_lines, ap_uint<32> ray_count, ap_uint<8> options);

}  // namespace retrace
