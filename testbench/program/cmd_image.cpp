// retrace pack, info: memory images.
#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "golden/base/output_file.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/tree/kd_builder.hpp"
#include "testbench/program/commands.hpp"

namespace retrace::cli {
namespace {

struct PackArguments {
  std::string scene, output;
};

struct InfoArguments {
  std::string path;
  bool json = false;
};

void print_histogram(const char* title, const std::vector<std::uint64_t>& counts, bool open_end) {
  std::printf("\n%s\n", title);
  const std::uint64_t largest = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    constexpr double kWidth = 50;
    const auto bar =
        static_cast<std::size_t>(kWidth * static_cast<double>(counts[i]) / static_cast<double>(largest) + 0.5);
    std::printf("  %4zu%s %10s  %s\n", i, open_end && i + 1 == counts.size() ? "+" : " ",
                with_commas(counts[i]).c_str(), std::string(std::max<std::size_t>(bar, 1), '#').c_str());
  }
}

void print_row(const char* name, const std::string& value, const std::string& remark = {}) {
  std::printf("  %-24s %14s  %s\n", name, value.c_str(), remark.c_str());
}

std::string fixed(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

void run_info(const InfoArguments& a, const Common& common) {
  MemoryImage image;
  nlohmann::ordered_json head;
  std::error_code ignored;
  if (std::filesystem::exists(a.path, ignored) && is_memory_image(a.path)) {
    image = MemoryImage::load(a.path);
    head["file"] = std::filesystem::path(a.path).filename().string();
  } else {
    LoadedScene loaded = load_scene(a.path, common, false);
    head = scene_json(loaded);
    image = std::move(loaded.image);
  }
  const ImageStatistics s = describe(image);
  if (a.json) {
    nlohmann::ordered_json all = head;
    all.update(image_json(s, image.header()));
    std::printf("%s\n", all.dump(2).c_str());
    return;
  }
  std::printf("%s\n", head["file"].get<std::string>().c_str());
  if (head.contains("build_s")) {
    print_row("loaded in", fixed(head["load_s"].get<double>()) + " s");
    print_row("built in", fixed(head["build_s"].get<double>()) + " s");
    print_row("triangles in the file", with_commas(head["triangles"].get<std::uint64_t>()),
              with_commas(head["degenerate"].get<std::uint64_t>()) + " of them have no area on the grid");
  }
  if (image.two_levels()) {
    print_row("instances", with_commas(s.instances), "of " + with_commas(s.objects) + " objects");
    print_row("instanced triangles", with_commas(s.instanced_triangles));
  }
  print_row("triangles", with_commas(s.triangles), image.two_levels() ? "held" : "");
  print_row("nodes", with_commas(s.nodes), with_commas(s.interior) + " interior");
  print_row("leaves", with_commas(s.leaves), with_commas(s.empty_leaves) + " empty");
  print_row("references", with_commas(s.references),
            fixed(s.references_per_triangle) + " a triangle, " + fixed(s.references_per_leaf) + " a leaf, at most " +
                with_commas(s.max_leaf));
  print_row("depth", std::to_string(s.max_depth));
  print_row("SAH cost", fixed(s.sah_cost));
  print_row(
      "bytes", with_commas(s.bytes),
      s.triangles > 0 ? fixed(static_cast<double>(s.bytes) / static_cast<double>(s.triangles)) + " a triangle" : "");
  print_row("  node pairs", with_commas(s.pair_bytes));
  print_row("  leaf records", with_commas(s.leaf_bytes));
  print_row("  reference list", with_commas(s.list_bytes));
  print_row("  triangle records", with_commas(s.triangle_bytes));
  if (image.two_levels()) print_row("  instance records", with_commas(s.instance_bytes));
  print_histogram("leaves by depth", s.depth_histogram, false);
  print_histogram("leaves by references", s.leaf_size_histogram, true);
}

void run_pack(const PackArguments& a, const Common& common) {
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile& file = files.add(a.output);
  const LoadedScene loaded = load_scene(a.scene, common, false);
  file.refer(loaded.image.file_bytes());
  files.commit();
  std::printf("%s: %s triangles, %s bytes, built in %.2f s\n", a.output.c_str(),
              with_commas(placed_triangles(loaded.grid)).c_str(), with_commas(loaded.image.bytes()).c_str(),
              loaded.build_s);
  print_levels(loaded);
}

}  // namespace

void add_pack(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("pack", "Build the memory image of a scene and write it to a file");
  auto a = std::make_shared<PackArguments>();
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command->add_option("-o,--output", a->output, "Image, as the engines see it")->required()->type_name("FILE");
  add_two_level(*command, program);
  add_common(*command, program);
  command->footer(
      "The image is what the core reads from memory: node pairs, leaves, references, triangles "
      "(docs/memory-image.md).\n"
      "Examples:\n"
      "  retrace pack room.glb -o room.rtkd\n"
      "  retrace info room.rtkd\n");
  command->callback([a, &program] { run_pack(*a, program.common); });
}

void add_info(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("info", "Describe the tree of a scene or of a packed image");
  auto a = std::make_shared<InfoArguments>();
  command->add_option("file", a->path, "Scene (as for render) or packed image")->required()->type_name("FILE");
  command->add_flag("--json", a->json, "As JSON");
  add_two_level(*command, program);
  add_common(*command, program);
  command->footer(
      "Nodes, leaves, references, depth, SAH cost, bytes, and how the leaves spread over depth and size.\n"
      "A packed image is checked completely before it is described.\n"
      "Examples:\n"
      "  retrace info room.glb\n"
      "  retrace info room.rtkd --json\n");
  command->callback([a, &program] { run_info(*a, program.common); });
}

}  // namespace retrace::cli
