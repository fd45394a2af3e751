// Pictures by the kernels alone: retrace_raster, retrace_trace, retrace_shadow, retrace_shade.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "golden/engine/pixels.hpp"

namespace retrace {

/// Hits of rays that a camera made, by the kernel. `words`: the memory image. Throws Error for an image that the kernel refuses.
void trace_entered(std::span<const std::uint64_t> words, std::span<const contract::RayRecord> rays,
                   std::span<contract::PlacedHitRecord> hits, const TraceOptions& options);

/// The samples of a frame by retrace_raster; nothing if it refuses image or frame. `bad`: its count of samples with a bad camera.
std::optional<std::vector<contract::RasterOutRecord>> raster_by_kernel(std::span<const std::uint64_t> words,
                                                                       const contract::CameraRecord& camera,
                                                                       const contract::FrameRecord& frame,
                                                                       std::uint64_t* bad = nullptr);
/// The pixels of a frame by retrace_shade; nothing if it refuses the frame. `unknown`: its count of hits without a material.
std::optional<std::vector<std::uint32_t>> shade_by_kernel(const contract::FrameRecord& frame,
                                                          std::span<const contract::ShadeInRecord> samples,
                                                          const ShadeTable& table, std::uint64_t* unknown = nullptr);
/// Rays towards the light by retrace_shadow, one for each sample, `enters` 0 where there is none; nothing if it refuses image or frame.
std::optional<std::vector<contract::RasterOutRecord>> shadows_by_kernel(
    std::span<const std::uint64_t> words, const contract::FrameRecord& frame,
    std::span<const contract::RasterOutRecord> samples, std::span<const contract::ShadeInRecord> hits);

/// `image_words` outlives it.
std::unique_ptr<PixelEngine> make_csim_pixels(std::span<const std::uint64_t> image_words, const ShadeTable& table);

}  // namespace retrace
