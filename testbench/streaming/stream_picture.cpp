// stream_picture SCENE -o FILE: a picture by the streaming machine alone, both variants, and their work in the terms of Purcell et al. 2002. The light is
// in front of the middle of the scene's emissive surfaces, or below the top of its box.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "golden/accel/grid_image.hpp"
#include "golden/base/clock.hpp"
#include "golden/base/error.hpp"
#include "golden/render/chip_frame.hpp"
#include "golden/render/tonemap.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/streaming/stream_frame.hpp"

namespace {

using namespace retrace;

/// Where light comes from: `given`, in parts of the scene's box, or a little in front of the emissive triangles' mean, on the side of their normals.
light_model::Light light_of(const GridScene& grid, const std::vector<contract::MaterialRecord>& materials,
                            const std::vector<double>& given) {
  light_model::Light light{.colour = {255, 255, 255}, .seed = 1};
  std::array<double, 3> mean{}, normal{};
  double area = 0;
  for (const GridTriangle& triangle : grid.triangles) {
    if (triangle.id >= materials.size() || materials[triangle.id].unlit == 0) continue;
    glm::dvec3 corner[3];
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) corner[k][a] = triangle.vertices[k][a];
    const double size = glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    const glm::dvec3 middle = (corner[0] + corner[1] + corner[2]) / 3.0;
    area += size;
    for (int a = 0; a < 3; ++a) {
      mean[a] += size * middle[a];
      normal[a] += size * materials[triangle.id].normal[a] / 4096.0;
    }
  }
  for (int a = 0; a < 3; ++a) {
    const double lower = grid.box[2 * a], upper = grid.box[2 * a + 1];
    double place = a == 1 ? lower + 0.9 * (upper - lower) : 0.5 * (lower + upper);
    if (!given.empty()) {
      place = lower + given[a] * (upper - lower);
    } else if (area > 0) {
      place = mean[a] / area + normal[a] / area * 0x1p-6 * (1 << contract::kPositionFrac);
    }
    light.position[a] = static_cast<std::int32_t>(std::clamp(place, lower + 1, upper - 1));
  }
  return light;
}

nlohmann::ordered_json json_of(const StreamTotals& t) {
  const auto a_ray = [&](std::uint64_t n) {
    return t.rays ? static_cast<double>(n) / static_cast<double>(t.rays) : 0.0;
  };
  return {{"rays", t.rays},
          {"voxels_per_ray", a_ray(t.voxels)},
          {"tests_per_ray", a_ray(t.tests)},
          {"screens", t.screens},
          {"traverse_passes", t.traverse_passes},
          {"intersect_passes", t.intersect_passes},
          {"utilisation", t.utilisation()},
          {"state_bytes_per_ray", a_ray(t.state_bytes)},
          {"grid_bytes_per_ray", a_ray(t.image_bytes)}};
}

void print(const char* variant, const char* kind, const StreamTotals& t) {
  if (t.rays == 0) return;
  const auto a_ray = [&](std::uint64_t n) { return static_cast<double>(n) / static_cast<double>(t.rays); };
  const auto a_screen = [&](std::uint64_t n) { return static_cast<double>(n) / static_cast<double>(t.screens); };
  std::printf("| %s | %s | %llu | %.1f | %.1f | ", variant, kind, static_cast<unsigned long long>(t.rays),
              a_ray(t.voxels), a_ray(t.tests));
  if (t.passes() > 0) {
    std::printf("%.0f + %.0f | %.1f %% | ", a_screen(t.traverse_passes), a_screen(t.intersect_passes),
                100 * t.utilisation());
  } else {
    std::printf("1 | 100 %% | ");
  }
  std::printf("%.0f | %.0f |\n", a_ray(t.state_bytes), a_ray(t.image_bytes));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "A picture by the streaming machine (Purcell 2002) alone: eye rays, shadows, a bounce; and the work of its two "
      "variants.",
      "stream_picture");
  std::string scene_name, output, json;
  ImageSize size{160, 120};
  StreamFrame options;
  app.add_option("scene", scene_name, "glTF file, or a scene of the project's own")->required();
  app.add_option("-o,--output", output, "Picture")->required();
  app.add_option("--json", json, "Work of both variants");
  add_size(app, "-s,--size", size, 1 << contract::kFrameSizeLog2, "Size in pixels");
  app.add_option("--spp", options.samples, "Samples a pixel")->check(CLI::Range(1, 4096))->capture_default_str();
  app.add_option("--bounces", options.bounces, "Diffuse bounces")->check(CLI::Range(0, 4))->capture_default_str();
  double exposure = 1.0;
  std::vector<double> place;
  app.add_option("--light", place, "Place of the light, in parts of the scene's box; default: its emissive surfaces")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0.0, 1.0))
      ->type_name("X,Y,Z");
  app.add_option("--exposure", exposure, "Factor of the light")->check(CLI::PositiveNumber)->capture_default_str();
  return run_program(app, argc, argv, [&] {
    OutputFiles files;
    OutputFile& picture_file = files.add(output);
    OutputFile* const json_file = json.empty() ? nullptr : &files.add(json);
    check_raster(output, size.width, size.height, 3);
    const Scene scene = open_scene(scene_name);
    const WorldTriangles world = flatten(scene);
    const GridScene grid = snap(world, kChipReach);
    const accel::GridImage image = accel::GridImage::build(grid);
    const ViewCamera view = default_view(scene, world, "");
    const Surfaces surfaces(scene, world, grid);
    const std::vector<contract::MaterialRecord> materials = materials_of(chip_shading(surfaces));
    const contract::CameraRecord camera = chip_camera(view, grid, size.width, size.height);
    const contract::FrameRecord frame = chip_frame(view, {.width = size.width,
                                                          .height = size.height,
                                                          .samples = std::min(options.samples, 4) >= 4   ? 4
                                                                     : std::min(options.samples, 4) >= 2 ? 2
                                                                                                         : 1});
    options.light = light_of(grid, materials, place);

    std::array<StreamFrameTotals, 2> totals;
    const double start = now();
    const auto picture =
        draw_stream_frame(image.words(), camera, frame, materials, options, StreamVariant::kMultiPass, &totals[0]);
    if (draw_stream_frame(image.words(), camera, frame, materials, options, StreamVariant::kBranching, &totals[1]) !=
        picture)
      throw Error("the two variants draw different pictures");
    const double seconds = now() - start;

    Raster raster(size.width, size.height, 3);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        const auto& light = picture[static_cast<std::size_t>(y) * size.width + x];
        const glm::vec3 linear(light[0] * exposure, light[1] * exposure, light[2] * exposure);
        raster.set_rgb(x, y, is_linear_format(output) ? linear : srgb_encode(glm::min(linear, glm::vec3(1.0f))));
      }
    write_raster(picture_file, raster);
    const auto& h = image.header();
    if (json_file != nullptr) {
      nlohmann::ordered_json out{{"scene", scene_name},
                                 {"width", size.width},
                                 {"height", size.height},
                                 {"triangles", h.triangle_count},
                                 {"resolution", {h.resolution[0], h.resolution[1], h.resolution[2]}},
                                 {"grid_bytes", image.bytes()}};
      for (const int v : {0, 1})
        out[v ? "branching" : "multipass"] = {{"eye", json_of(totals[v].eye)},
                                              {"shadow", json_of(totals[v].shadow)},
                                              {"bounce", json_of(totals[v].bounce)},
                                              {"bounce_shadow", json_of(totals[v].bounce_shadow)}};
      json_file->write(out.dump(2) + "\n");
    }
    files.commit();
    std::printf("%s: %u triangles, grid %u x %u x %u, %zu bytes, %u references; both pictures the same, %.1f s\n\n",
                scene_name.c_str(), h.triangle_count, h.resolution[0], h.resolution[1], h.resolution[2], image.bytes(),
                h.list_count, seconds);
    std::printf(
        "| variant | rays | number | voxels a ray | tests a ray | passes a screen (traverse + intersect) | utilisation "
        "| bytes of rays and states a ray | bytes of the grid a ray |\n");
    std::printf("| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    for (const int v : {0, 1}) {
      const char* variant = v ? "branching" : "multi-pass";
      print(variant, "eye", totals[v].eye);
      print(variant, "shadow", totals[v].shadow);
      print(variant, "bounce", totals[v].bounce);
      print(variant, "shadow of the bounce", totals[v].bounce_shadow);
    }
    return 0;
  });
}
