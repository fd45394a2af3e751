// Loading scenes, small text, see workspace.hpp.
#include "testbench/program/workspace.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
bool is_memory_image(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw Error("cannot read " + path.string() + ": it is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("cannot read " + path.string() + ": " + std::strerror(errno));
  std::array<unsigned char, 4> bytes{};
  file.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  const std::uint32_t word = bytes[0] | bytes[1] << 8 | bytes[2] << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
  return file.gcount() == 4 && word == static_cast<std::uint32_t>(contract::kImageMagic);
}

NamedScene read_scene(const std::string& scene, bool textures, std::vector<std::string>& notes) {
  std::error_code ignored;
  if (!std::filesystem::exists(scene, ignored) && is_generated_scene(scene)) {
    Scene read = open_scene(scene);
    read.name = scene;
    return {scene, std::move(read)};
  }
  const std::filesystem::path path = scene;
  if (is_memory_image(path)) {
    throw Error(scene +
                " is a packed image: it holds no vertices, materials or cameras; name the glTF file it was made from");
  }
  GltfOptions options;
  options.textures = textures;
  options.posed = true;
  return {path.stem().string(), load_gltf(path, options, &notes)};
}

LoadedScene load_scene(const std::string& scene, const Common& common, bool textures, double side) {
  LoadedScene loaded;
  const double load_start = now();
  std::vector<std::string> notes;
  NamedScene read = read_scene(scene, textures, notes);
  for (const std::string& text : notes) note(common, text);
  loaded.name = read.name;
  static_cast<TracedScene&>(loaded) = snap_scene(std::move(read.scene), common.two_levels, side);
  loaded.load_s = now() - load_start;
  if (loaded.grid.degenerate > 0) {
    note(common, loaded.name + ": " + with_commas(loaded.grid.degenerate) + " of " +
                     with_commas(loaded.world.vertices.size()) +
                     " triangles have no area on the grid and are left out");
  }
  Progress progress("build " + loaded.name, common.quiet);
  BuildOptions options;
  options.progress = [&](double fraction) { progress.update(fraction); };
  const double build_start = now();
  loaded.image = build_image(loaded.grid, options);
  loaded.build_s = now() - build_start;
  return loaded;
}

nlohmann::ordered_json scene_json(const LoadedScene& scene) {
  nlohmann::ordered_json json = {{"file", scene.scene.name},
                                 {"triangles", scene.world.vertices.size()},
                                 {"degenerate", scene.grid.degenerate},
                                 {"image_bytes", scene.image.bytes()},
                                 {"load_s", scene.load_s},
                                 {"build_s", scene.build_s}};
  if (scene.grid.two_levels) {
    json["instances"] = scene.grid.instances.size();
    json["objects"] = scene.grid.objects.size();
  }
  return json;
}

nlohmann::ordered_json image_json(const ImageStatistics& s, const contract::HeaderRecord& header) {
  nlohmann::ordered_json json = {{"version", header.version},
                                 {"triangles", s.triangles},
                                 {"nodes", s.nodes},
                                 {"interior", s.interior},
                                 {"leaves", s.leaves},
                                 {"empty_leaves", s.empty_leaves},
                                 {"references", s.references},
                                 {"references_per_triangle", s.references_per_triangle},
                                 {"references_per_leaf", s.references_per_leaf},
                                 {"largest_leaf", s.max_leaf},
                                 {"max_depth", s.max_depth},
                                 {"step_limit", header.step_limit},
                                 {"sah_cost", s.sah_cost},
                                 {"bytes", s.bytes},
                                 {"pair_bytes", s.pair_bytes},
                                 {"leaf_bytes", s.leaf_bytes},
                                 {"list_bytes", s.list_bytes},
                                 {"triangle_bytes", s.triangle_bytes},
                                 {"depth_histogram", s.depth_histogram},
                                 {"leaf_size_histogram", s.leaf_size_histogram}};
  if (header.version == static_cast<std::uint32_t>(contract::kImageVersionTwoLevels))
    json.update({{"instances", s.instances},
                 {"objects", s.objects},
                 {"instanced_triangles", s.instanced_triangles},
                 {"instance_references", s.instance_references},
                 {"instance_bytes", s.instance_bytes}});
  return json;
}

void print_levels(const LoadedScene& scene) {
  if (!scene.grid.two_levels) return;
  std::printf("  two levels: %s instances of %s objects, %s triangles held, image %s bytes\n",
              with_commas(scene.grid.instances.size()).c_str(), with_commas(scene.grid.objects.size()).c_str(),
              with_commas(scene.image.header().triangle_count).c_str(), with_commas(scene.image.bytes()).c_str());
}

Size parse_size(const std::string& text) {
  Size size;
  const char *begin = text.data(), *end = begin + text.size();
  const auto [middle, first] = std::from_chars(begin, end, size.width);
  bool ok = first == std::errc() && middle != end && (*middle == 'x' || *middle == 'X');
  if (ok) {
    const auto [last, second] = std::from_chars(middle + 1, end, size.height);
    ok = second == std::errc() && last == end;
  }
  constexpr int kLargest = 16384;
  if (!ok || size.width < 1 || size.height < 1 || size.width > kLargest || size.height > kLargest) {
    throw UsageError("--size takes WIDTHxHEIGHT with both from 1 to 16384, not '" + text + "'");
  }
  return size;
}

void check_aovs(const std::vector<std::string>& names, const std::string& engine) {
  for (const std::string& name : names) {
    bool known = false;
    std::string all;
    for (const Aov& aov : known_aovs()) {
      known = known || name == aov.name;
      all += (all.empty() ? "" : ", ") + std::string(aov.name);
    }
    if (!known) throw UsageError("there is no AOV '" + name + "'; there are: " + all);
    const bool of_work = name != "depth" && name != "normal" && name != "albedo" && name != "id";
    if (of_work && !find_engine(engine).counts_work)
      throw UsageError("engine " + engine + " does not count the work of each ray: there is no AOV " + name);
  }
}

void note(const Common& common, const std::string& text) {
  if (!common.quiet) std::fprintf(stderr, "retrace: %s\n", text.c_str());
}

}  // namespace retrace::cli
