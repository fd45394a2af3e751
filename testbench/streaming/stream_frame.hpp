// Pictures by the streaming machine alone: eye rays, hits, shadow rays to one light and a bounce, all by its kernels (hls/streaming). What the paper's
// graphics card does between passes stands here: choosing what goes on, and adding light to pixels.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "golden/engine/shade_table.hpp"
#include "testbench/streaming/light_model.hpp"
#include "testbench/streaming/stream_engine.hpp"

namespace retrace {

/// The materials of a scene without instances.
std::vector<contract::MaterialRecord> materials_of(const ShadeTable& table);

struct StreamFrame {
  int samples = 4;  ///< a pixel
  int bounces = 1;  ///< 0: light from the light alone
  light_model::Light light;
};

/// Work of a frame by kind of ray.
struct StreamFrameTotals {
  StreamTotals eye, shadow, bounce, bounce_shadow;
};

/// Light of each pixel row by row, red, green, blue; 1 is the full weight of one ray. `frame` gives the size. Throws Error if the kernels refuse the image
/// or the frame.
std::vector<std::array<double, 3>> draw_stream_frame(std::span<const std::uint64_t> grid_words,
                                                     const contract::CameraRecord& camera,
                                                     const contract::FrameRecord& frame,
                                                     std::span<const contract::MaterialRecord> materials,
                                                     const StreamFrame& options, StreamVariant variant,
                                                     StreamFrameTotals* totals = nullptr);

/// What stream_shade makes of one record, for tests.
light_model::Lit light_by_kernel(std::span<const std::uint64_t> grid_words,
                                 std::span<const contract::MaterialRecord> materials,
                                 const contract::RaySetupInRecord& ray, const contract::HitRecord& hit,
                                 const light_model::Note& note, const light_model::Light& light);

/// What stream_generate makes of a frame: rays and notes of all pixels.
struct EyeRays {
  std::vector<contract::RaySetupInRecord> rays;
  std::vector<light_model::Note> notes;
};
EyeRays eye_rays_by_kernel(std::span<const std::uint64_t> grid_words, const contract::CameraRecord& camera,
                           const contract::FrameRecord& frame, std::uint32_t sample);

}  // namespace retrace
