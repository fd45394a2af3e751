// retrace render --on-chip: an engine that makes the picture itself, from a camera.
#include <cstdio>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/chip_frame.hpp"
#include "testbench/program/cmd_render.hpp"

namespace retrace::cli {

void run_on_chip(const RenderArguments& a, const Common& common) {
  const EngineKind& kind = find_engine(a.engine);
  if (!kind.make_pixels)
    throw UsageError("engine " + kind.name +
                     " makes no pictures by itself: --on-chip takes engine golden, csim or rtl");
  if (!a.aovs.empty()) throw UsageError("--on-chip writes the picture alone: no --aov");
  ChipOptions options;
  options.width = a.options.width;
  options.height = a.options.height;
  options.shadows = a.chose_shadows && a.options.shadows;
  options.samples = a.chose_spp ? a.options.spp : 1;
  if (options.samples != 1 && options.samples != 2 && options.samples != 4)
    throw UsageError("--on-chip takes --spp 1, 2 or 4");
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile& picture = files.add(a.output);
  OutputFile* const stats_file = a.stats.empty() ? nullptr : &files.add(a.stats);

  const LoadedScene loaded = load_scene(a.scene, common, true, kChipReach);
  const ViewCamera view = default_view(loaded.scene, loaded.world, a.camera);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  const contract::FrameRecord frame = chip_frame(view, options);
  const contract::CameraRecord camera = chip_camera(view, loaded.grid, options.width, options.height);
  const ShadeTable table = chip_shading(surfaces);
  const std::unique_ptr<PixelEngine> engine = make_pixel_engine(a.engine, loaded.grid, loaded.image, table);
  const double start = now();
  const std::vector<std::uint32_t> pixels = engine->draw(camera, frame, a.options.trace);
  const double seconds = now() - start;
  write_raster(picture, chip_picture(pixels, options.width, options.height));
  const PixelTotals& totals = engine->totals();
  if (stats_file != nullptr)
    stats_file->write(nlohmann::ordered_json{{"command", "render"},
                                             {"scene", scene_json(loaded)},
                                             {"engine", kind.name},
                                             {"on_chip", true},
                                             {"width", options.width},
                                             {"height", options.height},
                                             {"spp", options.samples},
                                             {"samples", totals.samples},
                                             {"rays", totals.rays},
                                             {"table_bytes", 8 * table.words.size()},
                                             {"bytes", totals.bytes},
                                             {"clocks", totals.clocks},
                                             {"seconds", seconds}}
                          .dump(2) +
                      "\n");
  files.commit();
  std::printf("%s, %s triangles, %dx%d, %d samples a pixel, engine %s, camera %s, rays and pixels on the chip\n",
              loaded.name.c_str(), with_commas(loaded.world.vertices.size()).c_str(), options.width, options.height,
              options.samples, kind.name.c_str(), view.name.c_str());
  print_levels(loaded);
  std::printf("  %s samples, %s rays, %s bytes of records for shading\n", with_commas(totals.samples).c_str(),
              with_commas(totals.rays).c_str(), with_commas(8 * table.words.size()).c_str());
  if (totals.clocks > 0 && totals.rays > 0) {
    const auto rays = static_cast<double>(totals.rays);
    std::printf("  %.2f clocks and %.1f bytes a ray\n", static_cast<double>(totals.clocks) / rays,
                static_cast<double>(totals.bytes) / rays);
  }
  std::printf("  built in %.2f s, drawn in %.2f s\n", loaded.build_s, seconds);
  for (const auto& file : files.files()) std::printf("  wrote %s\n", file->path().c_str());
}

}  // namespace retrace::cli
