// Pictures in waves: batches of rays go to an engine and come back as hits, are shaded, and leave batches of shadow and occlusion rays
// behind. No ray waits for another, so every engine serves, and an engine never knows what its rays are for.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "golden/engine/engine.hpp"
#include "golden/render/lighting.hpp"
#include "golden/render/raster.hpp"
#include "golden/render/surface.hpp"
#include "golden/render/view.hpp"

namespace retrace {

struct RenderOptions {
  int width = 640, height = 480;
  int spp = 4;  ///< samples a pixel
  bool shadows = true;
  int ao = 0;                ///< ambient occlusion rays a sample; 0: unoccluded ambient light
  double ao_distance = 0.0;  ///< world units; 0: a sixth of the scene
  int light_samples = 1;     ///< samples of the emissive triangles a camera sample
  LightChoice lights = LightChoice::kAuto;
  std::uint32_t seed = 1;
  TraceOptions trace;
  std::function<void(double)> progress;  ///< fraction done; called between batches, from the calling thread
};

/// Sums of RayWork.
struct WorkTotals {
  std::uint64_t rays = 0, down = 0, up = 0, leaf = 0, tests = 0, skipped = 0;
  void add(const RayWork& work);
};

struct RenderResult {
  Raster color;   ///< linear RGB radiance and coverage; background is 0 with coverage 0
  Raster unlit;   ///< the part of `color` that unlit surfaces show, which no exposure changes
  Raster depth;   ///< along the viewing axis, world units; infinite where nothing is hit. Of each pixel's first sample
  Raster normal;  ///< world, unit; 0 where nothing is hit. Of each pixel's first sample
  Raster albedo;  ///< linear base colour
  std::vector<std::uint32_t> id;          ///< triangle of each pixel's first sample, kNone where nothing is hit
  Raster down, up, leaf, tests, skipped;  ///< work of the camera rays, mean of the samples

  WorkTotals camera, shadow, occlusion;  ///< rays and work by kind; rays that miss the scene box count as rays
  double quantise_s = 0, trace_s = 0, shade_s = 0, total_s = 0;
  std::uint64_t cut_rays = 0;  ///< that passed as many transparent surfaces as are followed; the last counted as opaque
  std::string lights;          ///< what lit the picture
  double exposure = 1.0;       ///< factor that makes `color` well exposed
};

/// Throws Error for sizes out of range and what an engine throws.
RenderResult render(const Surfaces& surfaces, const ViewCamera& camera, const std::array<std::int32_t, 6>& box,
                    Engine& engine, const RenderOptions& options);

/// What a screen shows: exposure, tone map, a neutral backdrop behind the scene, sRGB.
Raster develop(const RenderResult& result, double exposure);

/// Whether the camera stands in a closed space, as far as rays in all directions can tell.
bool is_indoors(const Surfaces& surfaces, const ViewCamera& camera, const std::array<std::int32_t, 6>& box,
                Engine& engine, const TraceOptions& options);

/// Quantises rays in parallel. Throws Error for the first bad one.
void quantise_all(std::span<const WorldRay> rays, std::span<GridRay> grid, const GridTransform& transform,
                  const std::array<std::int32_t, 6>& box, bool any);

/// Names of the AOVs that render can write, and what they hold.
struct Aov {
  const char* name;
  const char* help;
};
std::span<const Aov> known_aovs();
/// The AOV as data (for .exr; ids are not floats: see write_ids()) and as a picture to look at (for .png). Throws Error for an unknown name.
Raster aov_data(const RenderResult& result, const std::string& name);
Raster aov_picture(const RenderResult& result, const std::string& name, ColorMap map);

}  // namespace retrace
