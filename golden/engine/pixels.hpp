// Pictures made without a host: an engine that takes a camera and gives pixels, and the golden model of the unit that does it.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "golden/contract/contract_records.hpp"
#include "golden/engine/engine.hpp"
#include "golden/engine/shade_table.hpp"

namespace retrace {

/// What a frame was made of.
struct PixelTotals {
  std::uint64_t samples = 0, rays = 0;  ///< samples of the frame; rays that were traced
  std::uint64_t shadow_rays = 0;        ///< those of them that went towards the light
  std::uint64_t bad_samples = 0;        ///< whose camera was none that a host writes
  std::uint64_t unknown = 0;            ///< hits of triangles without a material
  std::uint64_t bytes = 0, clocks = 0;  ///< read and written by the core, where the engine is one
};

/// An engine that makes pictures itself.
class PixelEngine {
 public:
  virtual ~PixelEngine() = default;
  /// Pixels row by row from the top left, one or two words each (contract: pixel_*). Throws Error if the frame is none that can be drawn.
  virtual std::vector<std::uint32_t> draw(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                          const TraceOptions& options) = 0;
  virtual const PixelTotals& totals() const = 0;  ///< of the last frame
};

using TracePlaced = std::function<void(std::span<const contract::RayRecord>, std::span<contract::PlacedHitRecord>)>;

/// The golden model: rays and pixels by the stages of golden/engine/stages, in between whoever traces. `trace` turns rays (all of them enter) into
/// hits in the same order; with shadows it is called again, for the rays towards the light.
std::vector<std::uint32_t> draw_golden(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                       const std::array<std::int32_t, 6>& box, const ShadeTable& table,
                                       const TracePlaced& trace, PixelTotals* totals = nullptr);

/// draw_golden() with the hits of the golden engine, t rounded down. What comes near an edge may be another triangle than in a fixed-point engine's picture.
std::unique_ptr<PixelEngine> make_golden_pixels(const GridScene& scene, const MemoryImage& image,
                                                const ShadeTable& table);

/// Throws Error that says why a frame cannot be drawn.
void check_frame(const contract::FrameRecord& frame);

}  // namespace retrace
