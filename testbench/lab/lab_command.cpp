// retrace lab: arguments, outputs, exit.
#include <tbb/global_control.h>

#include <algorithm>
#include <cctype>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <mutex>

#include "golden/accel/catalogue.hpp"
#include "golden/base/clock.hpp"
#include "golden/base/output_file.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "lab.hpp"

namespace retrace::lab {
namespace {

struct Arguments {
  std::vector<std::string> scenes, animated, only;
  std::string html, markdown, plots, size = "192x144", camera, caches = "16,64,256";
  bool json = false, quiet = false, animation_only = false;
  int contexts = 64, threads = 0, frames = 3;
};

/// Whole numbers separated by one of `separators`; empty if the text is anything else.
std::vector<int> numbers(const std::string& text, char separator) {
  std::vector<int> values;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    const std::string part = text.substr(at, end - at);
    if (part.empty() || part.size() > 6 || part.find_first_not_of("0123456789") != std::string::npos) return {};
    values.push_back(std::stoi(part));
    at = end + 1;
  }
  return values;
}

LabOptions parse(const Arguments& a) {
  LabOptions options;
  const std::vector<int> size = numbers(a.size, 'x');
  if (size.size() != 2 || size[0] < 8 || size[1] < 8 || size[0] > 2048 || size[1] > 2048)
    throw UsageError("--size takes WIDTHxHEIGHT with both from 8 to 2048, not '" + a.size + "'");
  options.width = size[0], options.height = size[1];
  options.caches.clear();
  for (const int kilobytes : numbers(a.caches, ',')) {
    if (kilobytes < 1 || kilobytes > 65536 || (kilobytes & (kilobytes - 1)) != 0) {
      options.caches.clear();
      break;
    }
    options.caches.push_back({static_cast<std::uint32_t>(kilobytes) * 1024, 4});
  }
  if (options.caches.empty() || options.caches.size() > 8)
    throw UsageError("--caches takes up to 8 sizes in KB, powers of two from 1 to 65536, separated by commas, not '" +
                     a.caches + "'");
  check_structures(a.only);
  options.only = a.only;
  options.camera = a.camera;
  options.contexts = a.contexts;
  options.frames = a.frames;
  options.structures = !a.animation_only;
  return options;
}

constexpr char kBegin[] = "<!-- retrace lab: begin -->", kEnd[] = "<!-- retrace lab: end -->";

/// The tables alone, or, if the file exists and has the marks, the file with what stands between them replaced.
std::string merge_markdown(const std::filesystem::path& path, const std::string& tables) {
  std::ifstream file(path, std::ios::binary);
  const std::string marked = std::string(kBegin) + "\n\n" + tables + "\n" + kEnd;
  if (!file) return marked + "\n";
  const std::string old{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = old.find(kBegin), end = old.find(kEnd);
  if (begin == std::string::npos || end == std::string::npos || end < begin)
    throw Error(path.string() + ": exists and has no place for the tables, which is between the lines '" + kBegin +
                "' and '" + kEnd + "'");
  return old.substr(0, begin) + marked + old.substr(end + sizeof kEnd - 1);
}

/// Letters, digits, dots, dashes; everything else becomes a dash.
std::string file_name(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return !std::isalnum(c) && c != '.' && c != '-'; }, '-');
  return text;
}

/// Where a plot of a scene, named as on the command line, goes.
std::filesystem::path plot_name(const std::string& folder, const std::string& scene, const std::string& plot = {}) {
  return std::filesystem::path(folder) / ("lab-" + file_name(scene_name(scene)) + "-" + plot + ".svg");
}

void run(const Arguments& a) {
  LabReport report;
  report.options = parse(a);
  std::mutex mutex;
  const double start = now();
  const auto seconds = [&] { return now() - start; };
  report.options.say = [&](const std::string& text) {
    if (a.quiet) return;
    const std::lock_guard lock(mutex);
    std::fprintf(stderr, "lab %6.1f s  %s\n", seconds(), text.c_str());
  };
  std::unique_ptr<tbb::global_control> limit;
  if (a.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.threads));
  OutputFiles files;
  for (const auto* scenes : {&a.scenes, &a.animated})
    for (const std::string& scene : *scenes) files.reads(gltf_files(scene));
  OutputFile* html = a.html.empty() ? nullptr : &files.add(a.html);
  OutputFile* markdown = a.markdown.empty() ? nullptr : &files.add(a.markdown);
  if (markdown) merge_markdown(a.markdown, "");  // before minutes are spent

  if (!a.plots.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(a.plots, failed);
    if (failed) throw Error(a.plots + ": cannot be made: " + failed.message());
    for (std::size_t i = 0; i < a.scenes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (plot_name(a.plots, a.scenes[i]) == plot_name(a.plots, a.scenes[j]))
          throw UsageError("the plots of " + a.scenes[j] + " and " + a.scenes[i] + " would have the same names");
    { const OutputFile probe(plot_name(a.plots, "probe")); }  // whether the folder can be written
  }

  for (const std::string& scene : a.scenes) report.scenes.push_back(measure(scene, report.options));
  LabOptions follow = report.options;
  follow.structures = false;
  for (const std::string& scene : a.animated) report.scenes.push_back(measure(scene, follow));
  report.seconds = seconds();
  report.cpu_seconds = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  if (html) html->write(to_html(report));
  if (markdown) markdown->write(merge_markdown(a.markdown, to_markdown(report)));
  if (!a.plots.empty()) {
    for (const SceneReport& scene : report.scenes) {
      if (scene.rows.empty()) continue;
      for (const auto& [name, svg] : to_plots(scene, report.options))
        files.add(plot_name(a.plots, scene.name, name)).write(svg);
    }
  }
  files.commit();
  for (const auto& file : files.files()) {
    if (!a.quiet) std::fprintf(stderr, "lab %6.1f s  wrote %s\n", seconds(), file->path().c_str());
  }
  if (a.json) {
    std::printf("%s\n", to_json(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
  } else if (files.files().empty()) {
    std::printf("%s", to_markdown(report).c_str());
  }
  if (report.differences() > 0)
    throw Error("lab: structures differ from each other or from brute force on " +
                std::to_string(report.differences()) + " rays");
}

}  // namespace

void register_lab(CLI::App& app) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("lab", "Every acceleration structure and traversal on the same rays, measured");
  command->add_option("scene", a->scenes, "glTF files, or generated scenes by name, such as room or knot:detail=0.5")
      ->required()
      ->type_name("SCENE...");
  command->add_flag("--json", a->json, "Everything as JSON on standard output");
  command->add_option("--html", a->html, "A page that stands alone: table, plots, heat maps")->type_name("FILE");
  command->add_option("--markdown", a->markdown, "Tables; in an existing file, between its marks")->type_name("FILE");
  command->add_option("--plots", a->plots, "Plots as SVG files")->type_name("FOLDER");
  command->add_option("--size", a->size, "Camera rays; default 192x144")->type_name("WxH");
  command->add_option("--camera", a->camera, "Number or name of a camera")->type_name("CAMERA");
  command->add_option("--caches", a->caches, "Cache sizes in KB; default 16,64,256")->type_name("KB,...");
  command->add_option("--contexts", a->contexts, "Rays in flight in the cache model; default 64")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
  command->add_option("--frames", a->frames, "Frames of animated files to follow, beside full rebuilds; default 3")
      ->check(CLI::Range(0, 10000))
      ->type_name("N");
  command->add_flag("--animation-only", a->animation_only, "Only that");
  command->add_option("--animated", a->animated, "A further file of which only the animation is followed")
      ->type_name("FILE");
  command->add_option("--only", a->only, "Structures whose key begins so, such as kd-sah/ or bvh")->type_name("KEY");
  command->add_option("--threads", a->threads, "Threads; default: all cores")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
  command->add_flag("-q,--quiet", a->quiet, "No progress");
  command->footer(
      "Rays: one camera ray a pixel, one shadow ray and one diffuse bounce from every hit, quantised as for every "
      "engine. All structures use\n"
      "one triangle test, so their hits must be equal bit for bit; the exit code is 1 if any is not.\n"
      "Examples:\n"
      "  retrace lab room                                   tables on standard output\n"
      "  retrace lab room knot engine.glb --html lab.html   a page to look at\n"
      "  retrace lab room --animated carousel.glb           and an animated scene, frame by frame\n"
      "  retrace lab room --only kd-sah --json              some structures, as JSON");
  command->callback([a] { run(*a); });
}

}  // namespace retrace::lab
