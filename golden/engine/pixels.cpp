// See pixels.hpp.
#include "golden/engine/pixels.hpp"

#include "golden/engine/stages/raster.hpp"
#include "golden/engine/stages/shade.hpp"
#include "golden/engine/stages/shadow.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace {

void check_frame(const contract::FrameRecord& frame) {
  if (!golden::frame_fits(frame))
    throw Error(
        "frame: sizes are 1 to 4096 pixels and at most 2^23 pixels together, samples 1, 2 or 4 (of colours only)");
}

std::vector<std::uint32_t> draw_golden(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                       const std::array<std::int32_t, 6>& box, const ShadeTable& table,
                                       const TracePlaced& trace, PixelTotals* totals) {
  check_frame(frame);
  const std::uint32_t samples = 1u << frame.samples;
  const bool coloured = frame.kind == static_cast<std::uint32_t>(contract::kPixelColour);
  std::vector<contract::RasterOutRecord> all;
  std::vector<contract::RayRecord> rays;
  PixelTotals count;
  golden::for_each_pixel(frame, [&](std::uint32_t x, std::uint32_t y) {
    for (std::uint32_t s = 0; s < samples; ++s) {
      all.push_back(golden::raster(camera, frame, box, x, y, s));
      const contract::RasterOutRecord& one = all.back();
      count.bad_samples += one.bad;
      if (one.enters == 0) continue;
      rays.push_back({.origin = one.origin, .direction = one.direction, .t_max = one.t_max, .any = 0});
    }
  });
  std::vector<contract::PlacedHitRecord> hits(rays.size());
  trace(rays, hits);
  count.rays = rays.size();

  std::vector<contract::ShadeInRecord> results;
  std::size_t next_hit = 0;
  for (const contract::RasterOutRecord& one : all) {
    contract::ShadeInRecord& in = results.emplace_back();
    in.scale = one.scale;
    in.start = one.start;
    in.pixel = one.pixel;
    if (one.enters == 0) continue;
    const contract::PlacedHitRecord& hit = hits[next_hit++];
    in.hit = hit.status == static_cast<std::uint32_t>(contract::kStatusHit);
    in.t = hit.t;
    in.id = hit.id;
    in.number = hit.number;
  }
  if (coloured && frame.shadows != 0) {
    rays.clear();
    std::vector<std::size_t> sample_of;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (results[i].hit == 0) continue;
      const contract::RasterOutRecord one = golden::shadow(all[i], results[i].t, frame, box);
      if (one.enters == 0) continue;
      rays.push_back({.origin = one.origin, .direction = one.direction, .t_max = one.t_max, .any = 1});
      sample_of.push_back(i);
    }
    hits.assign(rays.size(), {});
    trace(rays, hits);
    for (std::size_t i = 0; i < hits.size(); ++i)
      results[sample_of[i]].shadow = hits[i].status == static_cast<std::uint32_t>(contract::kStatusHit);
    count.shadow_rays = rays.size();
    count.rays += rays.size();
  }

  const std::uint32_t words = golden::pixel_words(frame.kind);
  std::vector<std::uint32_t> pixels(std::size_t{words} * frame.width * frame.height);
  for (std::size_t first = 0; first < all.size(); first += samples) {
    golden::Colour sum{};
    contract::ShadeInRecord in;
    for (std::size_t s = 0; s < samples; ++s) {
      in = results[first + s];
      bool unknown = false;
      const golden::Colour colour = golden::shade_sample(in, table, frame, &unknown);
      count.unknown += unknown && coloured;
      for (std::size_t i = 0; i < 3; ++i) sum[i] += colour[i];
    }
    const std::uint32_t depth = golden::camera_depth(in), id = in.hit != 0 ? in.id : contract::kNoTriangle;
    std::uint32_t* pixel = &pixels[std::size_t{words} * in.pixel];
    if (frame.kind == contract::kPixelColour) pixel[0] = golden::pack_colour(sum, frame.samples);
    if (frame.kind == contract::kPixelDepth || frame.kind == contract::kPixelHit) pixel[0] = depth;
    if (frame.kind == contract::kPixelId) pixel[0] = id;
    if (frame.kind == contract::kPixelHit) pixel[1] = id;
  }
  count.samples = all.size();
  if (totals != nullptr) *totals = count;
  return pixels;
}

}  // namespace retrace
