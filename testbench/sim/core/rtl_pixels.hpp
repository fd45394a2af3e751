// Pictures by the simulated core: a camera goes into its registers, pixels come from its frame buffer.
#pragma once
#include <memory>
#include <span>

#include "golden/engine/pixels.hpp"
#include "testbench/sim/core/rtl_engine.hpp"

namespace retrace {

/// `image_words` outlives it. Throws Error if the configuration makes no pictures.
std::unique_ptr<PixelEngine> make_rtl_pixels(std::span<const std::uint64_t> image_words, const ShadeTable& table,
                                             const RtlOptions& options);

}  // namespace retrace
