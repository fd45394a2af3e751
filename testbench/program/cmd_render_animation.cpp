// retrace render --animation: a numbered sequence of an animated glTF file, each frame through the two-level structure
// (only the top level follows motion) or through one tree rebuilt over all triangles, what either cost, and a video.
//
// Engines other than golden take a memory image of two levels, into which each frame writes its instance records and its
// top level, and nothing else unless an object deforms.
//
// With golden's own structure and with one tree every frame is flattened and snapped, because rays are quantised to its
// grid and shading looks triangles up there. That is the cost of the picture; what a structure costs is reported apart:
// transforms, objects that deform and the top level for one, flattening, snapping and the tree for the other.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <sstream>

#include "golden/accel/two_level.hpp"
#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/tree/instanced_scene.hpp"
#include "golden/tree/kd_builder.hpp"
#include "golden/tree/two_level_scene.hpp"
#include "testbench/program/child.hpp"
#include "testbench/program/cmd_render.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

namespace fs = std::filesystem;

/// frame-0007.png: the last run of # in the file's name is the number; without one it goes before the extension.
class FrameNames {
 public:
  FrameNames(const fs::path& output, int frames) : folder_(output.parent_path()) {
    const std::string name = output.filename().string();
    const std::size_t last = name.find_last_of('#');
    digits_ = 4;
    while (std::pow(10.0, digits_) < frames) ++digits_;
    if (last == std::string::npos) {
      head_ = output.stem().string() + "-", tail_ = output.extension().string();
      video_ = folder_ / (output.stem().string() + ".mp4");
      return;
    }
    std::size_t first = last;
    while (first > 0 && name[first - 1] == '#') --first;
    digits_ =
        std::max(static_cast<int>(last - first + 1), frames > 1 ? static_cast<int>(std::log10(frames - 1)) + 1 : 1);
    head_ = name.substr(0, first), tail_ = name.substr(last + 1);
    std::string stem = head_;
    while (!stem.empty() && (stem.back() == '-' || stem.back() == '_' || stem.back() == '.')) stem.pop_back();
    video_ = folder_ / ((stem.empty() ? "animation" : stem) + ".mp4");
  }
  fs::path frame(int number) const {
    std::string text = std::to_string(number);
    text.insert(0, static_cast<std::size_t>(digits_) - std::min(text.size(), static_cast<std::size_t>(digits_)), '0');
    return folder_ / (head_ + text + tail_);
  }
  /// The same for ffmpeg's image2 reader: % is doubled.
  std::string pattern() const {
    const auto safe = [](const std::string& text) {
      std::string out;
      for (const char c : text) out += c == '%' ? std::string("%%") : std::string(1, c);
      return out;
    };
    const std::string folder = folder_.empty() ? "." : folder_.string();
    return safe(folder) + "/" + safe(head_) + "%0" + std::to_string(digits_) + "d" + safe(tail_);
  }
  /// Where the video goes unless --video says.
  const fs::path& video() const { return video_; }

 private:
  fs::path folder_, video_;
  std::string head_, tail_;
  int digits_;
};

/// The program's path; empty if it is not installed.
std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    std::error_code failed;
    if (::access(candidate.c_str(), X_OK) == 0 && fs::is_regular_file(candidate, failed)) return candidate;
  }
  return {};
}

/// What makes a video of the numbered files, for people. Exactly these frames: those of an earlier run may follow.
std::vector<std::string> video_command(const FrameNames& names, int frames, double fps, const fs::path& video) {
  char rate[32];
  std::snprintf(rate, sizeof rate, "%g", fps);
  return {"ffmpeg",
          "-f",
          "image2",
          "-framerate",
          rate,
          "-start_number",
          "0",
          "-i",
          names.pattern(),
          "-frames:v",
          std::to_string(frames),
          "-vf",
          "pad=ceil(iw/2)*2:ceil(ih/2)*2",
          "-pix_fmt",
          "yuv420p",
          "file:" + video.string()};
}

struct FrameCost {
  double time = 0.0, pose_s = 0.0, flatten_s = 0.0, snap_s = 0.0;
  accel::TwoLevelUpdate update;   ///< of the two-level structure
  std::size_t bytes = 0;          ///< written into the memory image of two levels
  std::optional<double> build_s;  ///< one tree over everything, where it was built
  double render_s = 0.0;
  std::optional<std::uint64_t> different;  ///< pixels, where both were rendered
  WorkTotals camera;
  double rebuild_s() const { return flatten_s + snap_s + build_s.value_or(0.0); }
};

std::uint64_t different_pixels(const RenderResult& a, const RenderResult& b) {
  std::uint64_t count = 0;
  const std::size_t channels = static_cast<std::size_t>(a.color.channels);
  for (std::size_t i = 0; i < a.id.size(); ++i)
    count += a.id[i] != b.id[i] || std::memcmp(&a.depth.data[i], &b.depth.data[i], sizeof(float)) != 0 ||
             std::memcmp(&a.color.data[i * channels], &b.color.data[i * channels], channels * sizeof(float)) != 0;
  return count;
}

/// A memory image of two levels that follows an animation.
class FollowingImage {
 public:
  explicit FollowingImage(const AnimatedScene& scene)
      : scene_(scene), instances_(scene.scene()), image_(instances_.grid(), true) {}

  /// The scene as it stands now.
  void update(FrameCost& cost) {
    const double start = now();
    const std::vector<std::uint32_t> changed = instances_.update(scene_.scene(), [&](std::uint32_t node) {
      return scene_.motion(node) == Motion::kUnstructured && scene_.deforms(node);
    });
    cost.update.transforms_s = now() - start;
    const TwoLevelFrame frame = image_.update(instances_.grid(), changed);
    cost.update.objects_s = frame.objects_s;
    cost.update.objects_rebuilt = static_cast<std::uint32_t>(frame.objects);
    cost.update.top_s = frame.top_s + frame.write_s;
    cost.bytes = frame.bytes;
  }
  const GridScene& grid() const { return instances_.grid(); }
  const MemoryImage& image() const { return image_.image(); }
  double build_s() const { return image_.first().objects_s; }

 private:
  const AnimatedScene& scene_;
  InstancedScene instances_;
  TwoLevelImage image_;
};

nlohmann::ordered_json to_json(const FrameCost& f, bool two_level) {
  nlohmann::ordered_json json = {
      {"time", f.time}, {"pose_s", f.pose_s}, {"update", nullptr}, {"full_rebuild", nullptr}};
  if (two_level)
    json["update"] = {{"transforms_s", f.update.transforms_s},
                      {"objects_s", f.update.objects_s},
                      {"top_level_s", f.update.top_s},
                      {"objects_rebuilt", f.update.objects_rebuilt},
                      {"total_s", f.update.total_s()}};
  if (f.bytes > 0) json["update"]["bytes"] = f.bytes;
  if (f.build_s)
    json["full_rebuild"] = {
        {"flatten_s", f.flatten_s}, {"snap_s", f.snap_s}, {"build_s", *f.build_s}, {"total_s", f.rebuild_s()}};
  json["render_s"] = f.render_s;
  json["different_pixels"] = f.different ? nlohmann::ordered_json(*f.different) : nlohmann::ordered_json(nullptr);
  json["camera"] = work_json(f.camera);
  return json;
}

std::string ratio(double x) {
  if (x >= 100.0) return with_commas(static_cast<std::uint64_t>(x));
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", x);
  return text;
}

bool has_camera(const Scene& scene) {
  for (const std::uint32_t node : scene.reachable())
    if (scene.nodes[node].camera != kNone) return true;
  return false;
}

}  // namespace

void run_animation(RenderArguments& a, const Common& common) {
  const bool two_level = a.structure == "two-level", golden = find_engine(a.engine).two_level;
  // Golden has two levels of its own, in doubles (golden/accel); told how to walk, it takes the memory image that the others take.
  const bool follow = two_level && (!golden || a.chose_walk);
  if (follow && !find_engine(a.engine).instances)
    throw UsageError("engine " + a.engine + " walks one tree: --structure one-tree, or another engine");
  std::error_code ignored;
  if (!fs::is_regular_file(a.scene, ignored))
    throw Error(a.scene + (fs::exists(a.scene, ignored) ? ": is not a file" : ": there is no such file") +
                "; --animation takes an animated glTF file");
  if (is_memory_image(a.scene)) throw Error(a.scene + " is a packed image: it holds no animation");
  const fs::path output = a.output;
  const bool linear = is_linear_format(output);
  RenderOptions& options = a.options;

  std::vector<std::string> notes;
  Scene loaded = load_gltf(a.scene, {}, &notes);
  for (const std::string& text : notes) note(common, text);
  Animation animation = load_animation(a.scene, loaded, a.clip);
  if (animation.tracks.empty()) throw Error(a.scene + ": holds no animation");
  const std::string name = fs::path(a.scene).stem().string();
  const double load_start = now();
  AnimatedScene scene(std::move(loaded), std::move(animation));
  const auto place = [&](double time) -> const Scene& {
    try {
      return scene.at(time);
    } catch (const Error& e) {
      throw Error(a.scene + ": " + e.what());
    }
  };

  // In doubles: a key may lie at any time.
  const double needed = a.frames > 0 ? a.frames : std::max(1.0, std::ceil((scene.duration() - a.start) * a.fps - 1e-6));
  if (!(needed <= 100000)) {
    char text[32];
    std::snprintf(text, sizeof text, "%.0f", needed);
    throw Error("the animation has " + std::string(needed < 1e15 ? text : "more than 10^15") +
                " frames; --frames or --fps take fewer");
  }
  const int frames = static_cast<int>(needed);
  const FrameNames names(output, frames);
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile* const stats = a.stats.empty() ? nullptr : &files.add(a.stats);
  // A video of what a screen shows: encoded colours only.
  const fs::path video = a.video.empty() ? names.video() : fs::path(a.video);
  const std::string ffmpeg = find_program("ffmpeg");
  if (!a.video.empty() && linear)
    throw UsageError("a video needs encoded colours: write the sequence as .png, not as " +
                     output.extension().string());
  if (!a.video.empty()) video_container(video);
  if (!a.video.empty() && ffmpeg.empty()) throw Error("--video needs ffmpeg, which is not installed");
  const bool make_video = !a.no_video && !linear && !ffmpeg.empty();
  OutputFile* const video_file = make_video ? &files.add(video) : nullptr;
  for (int i = 0; i < frames; ++i) {
    files.check(names.frame(i));
    for (const fs::path& path : aov_paths(a, names.frame(i))) files.check(path);
  }
  { const OutputFile probe(names.frame(0)); }  // whether the folder can be written, before minutes are spent
  std::optional<VideoEncoder> encoder;
  if (make_video) encoder.emplace(ffmpeg, video, options.width, options.height, a.fps);

  std::optional<accel::TwoLevel> two;
  std::optional<FollowingImage> following;
  const auto guarded = [&](auto&& work) {
    try {
      return work();
    } catch (const Error& e) {
      throw Error(a.scene + ": " + e.what());
    }
  };
  place(a.start);
  guarded([&] {
    if (follow) {
      following.emplace(scene);
    } else {
      two.emplace(scene);
    }
  });
  const double objects_s = follow ? following->build_s() : two->build_s();
  const std::size_t instances = follow ? following->grid().instances.size() : two->instances();
  const std::size_t objects = follow ? following->grid().objects.size() : two->objects();
  const std::size_t held = follow ? following->image().header().triangle_count : two->size();
  const std::uint64_t instanced = follow ? placed_triangles(following->grid()) : two->instanced_triangles();
  std::optional<ViewCamera> fixed;
  if (!has_camera(scene.scene())) fixed = default_view(scene.scene(), flatten(scene.scene()), a.camera);

  std::printf("%s: %d frames at %g a second, %dx%d, engine %s, structure %s\n", name.c_str(), frames, a.fps,
              options.width, options.height, a.engine.c_str(), a.structure.c_str());
  std::printf("  %s instances of %s objects, %s triangles held, %s instanced; objects built once in %.2f s\n",
              with_commas(instances).c_str(), with_commas(objects).c_str(), with_commas(held).c_str(),
              with_commas(instanced).c_str(), objects_s);
  if (follow) std::printf("  image of two levels: %s bytes\n", with_commas(following->image().bytes()).c_str());
  std::printf("  frame     at s   pose ms  transforms  objects (rebuilt)  top level   full rebuild ms  picture ms%s\n",
              follow ? "  bytes written" : "");

  Progress progress("render " + name + " (" + a.structure + ")", common.quiet);
  std::vector<FrameCost> costs;
  std::optional<double> exposure;
  std::uint64_t different = 0, flat_bytes = 0;
  std::optional<WorldTriangles> sources;  // of a followed image: they do not move
  std::uint32_t degenerate = 0;
  std::uint64_t cut_rays = 0;
  for (int i = 0; i < frames; ++i) {
    FrameCost cost;
    cost.time = a.start + i / a.fps;
    double lap = now();
    const auto step = [&] {
      const double last = lap;
      lap = now();
      return lap - last;
    };
    const Scene& pose = place(cost.time);
    cost.pose_s = step();
    guarded([&] {
      if (follow) {
        following->update(cost);
      } else {
        cost.update = two->update();
      }
    });
    // Golden walks one tree as it walks the two-level structure, so that pictures can be equal; or as it was told to.
    const bool by_image = !golden || a.chose_walk;
    const bool beside = two_level && (a.full_rebuild == "every" || (a.full_rebuild == "first" && i == 0));
    step();
    std::optional<WorldTriangles> world;
    std::optional<GridScene> flat_grid;
    if (!follow || beside || !sources) {
      world = flatten(pose);
      cost.flatten_s = step();
    }
    if (!follow || beside) {
      flat_grid = snap(*world);
      cost.snap_s = step();
      degenerate = std::max(degenerate, flat_grid->degenerate);
    }
    std::optional<accel::FlatFrame> flat;
    std::optional<MemoryImage> image;
    if (!by_image && (beside || !two_level)) {
      flat.emplace(*flat_grid, *two);
      cost.build_s = flat->build_s;
    } else if (by_image && (beside || !two_level)) {
      step();
      image = build_kd(*flat_grid);
      cost.build_s = step();
      flat_bytes = std::max<std::uint64_t>(flat_bytes, image->bytes());
    }
    if (follow && !sources) sources = std::move(world);
    const GridScene& grid = follow ? following->grid() : *flat_grid;
    const WorldTriangles& shown_world = follow ? *sources : *world;
    const Surfaces surfaces(pose, shown_world, grid);
    const ViewCamera camera = fixed ? *fixed : default_view(pose, shown_world, a.camera);
    const std::unique_ptr<Engine> engine = follow      ? make_engine(a.engine, grid, following->image())
                                           : two_level ? accel::make_two_level_engine(*two, grid)
                                           : by_image  ? make_engine(a.engine, grid, *image)
                                                       : accel::make_flat_engine(*flat, grid);
    options.progress = [&](double fraction) { progress.update((i + fraction) / frames); };
    const RenderResult result = render(surfaces, camera, grid.box, *engine, options);
    cost.render_s = result.total_s;
    cut_rays = std::max(cut_rays, result.cut_rays);
    cost.camera = result.camera;
    if (beside && a.full_rebuild == "every") {
      // What was followed against what is made from nothing: of two levels too, or one tree over the same triangles.
      const GridScene fresh_grid = follow ? InstancedScene(pose).release() : GridScene{};
      const MemoryImage fresh = follow ? build_image(fresh_grid) : MemoryImage{};
      const auto again = follow ? make_engine(a.engine, fresh_grid, fresh) : accel::make_flat_engine(*flat, grid);
      options.progress = {};
      cost.different = different_pixels(result, render(surfaces, camera, grid.box, *again, options));
      different += *cost.different;
    }

    // One exposure for all frames: the first one's.
    if (!exposure) exposure = parse_exposure(a.exposure, result.exposure);
    OutputFiles pictures;
    OutputFile& picture = pictures.add(names.frame(i));
    std::vector<OutputFile*> aovs;
    for (const fs::path& path : aov_paths(a, names.frame(i))) aovs.push_back(&pictures.add(path));
    const Raster shown = linear ? result.color : develop(result, *exposure);
    write_raster(picture, shown);
    write_aovs(a, result, aovs);
    pictures.commit();
    if (encoder) encoder->add(shown);
    char rebuild[32] = "-";
    if (cost.build_s) std::snprintf(rebuild, sizeof rebuild, "%.1f", cost.rebuild_s() * 1e3);
    char written[32] = "";
    if (follow) std::snprintf(written, sizeof written, "  %13s", with_commas(cost.bytes).c_str());
    std::printf("  %5d %8.3f %9.2f %11.3f %8.2f %10u %10.3f %17s %11.0f%s%s\n", i, cost.time, cost.pose_s * 1e3,
                cost.update.transforms_s * 1e3, cost.update.objects_s * 1e3, cost.update.objects_rebuilt,
                cost.update.top_s * 1e3, rebuild, cost.render_s * 1e3, written,
                !cost.different       ? ""
                : *cost.different > 0 ? (", " + with_commas(*cost.different) + " pixels differ").c_str()
                                      : ", equal to the full rebuild's");
    costs.push_back(std::move(cost));
  }
  progress.finish();
  note_cut_rays(cut_rays, common);

  double update_s = 0.0, rebuild_s = 0.0, bytes = 0.0;
  int rebuilt = 0;
  for (const FrameCost& cost : costs) {
    update_s += cost.update.total_s() / frames;
    bytes += static_cast<double>(cost.bytes) / frames;
    if (cost.build_s) rebuild_s += cost.rebuild_s(), ++rebuilt;
  }
  if (rebuilt > 0) rebuild_s /= rebuilt;
  if (two_level) {
    std::printf("  following a frame took %.3f ms on average", update_s * 1e3);
    if (rebuilt > 0)
      std::printf(", a full rebuild (flatten, snap, one kd-tree) %.1f ms: %s times as much", rebuild_s * 1e3,
                  ratio(rebuild_s / std::max(update_s, 1e-9)).c_str());
    std::printf("\n");
    if (follow) {
      std::printf("  bytes written a frame: %s on average of an image of %s",
                  with_commas(static_cast<std::uint64_t>(bytes)).c_str(),
                  with_commas(following->image().bytes()).c_str());
      if (flat_bytes > 0)
        std::printf("; one tree over all triangles: %s, all of them every frame", with_commas(flat_bytes).c_str());
      std::printf("\n");
    }
  } else {
    std::printf("  a full rebuild (flatten, snap, one kd-tree) took %.1f ms a frame on average\n", rebuild_s * 1e3);
  }
  if (degenerate > 0)
    note(common, name + ": up to " + with_commas(degenerate) + " triangles have no area on the grid of a frame");
  std::printf("  wrote %s ... %s\n", names.frame(0).c_str(), names.frame(frames - 1).c_str());
  std::error_code ignored_older;
  if (fs::exists(names.frame(frames), ignored_older))
    note(common, names.frame(frames).string() + " and what follows are older: " + name + " now has " +
                     std::to_string(frames) + " frames");
  if (encoder) {
    video_file->write(encoder->finish());
  } else if (!a.no_video && !linear) {
    std::string line;
    for (const std::string& word : video_command(names, frames, a.fps, video))
      line +=
          (line.empty() ? "" : " ") + (word.find_first_of(" ()*%#'") == std::string::npos ? word : "'" + word + "'");
    note(common, "ffmpeg is not installed, so there is no video; where it is: " + line);
  }
  if (stats != nullptr) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array(), numbered = nlohmann::ordered_json::array();
    for (const FrameCost& cost : costs) list.push_back(to_json(cost, two_level));
    for (int i = 0; i < frames; ++i) numbered.push_back(names.frame(i).string());
    const nlohmann::ordered_json json = {
        {"command", "render"},
        {"animation", true},
        {"file", a.scene},
        {"engine", a.engine},
        {"structure", a.structure},
        {"way_up", a.chose_walk || !golden ? nlohmann::ordered_json(a.way_up) : nlohmann::ordered_json(nullptr)},
        {"mailbox", options.trace.mailbox},
        {"width", options.width},
        {"height", options.height},
        {"spp", options.spp},
        {"fps", a.fps},
        {"duration", scene.duration()},
        {"exposure", *exposure},
        {"instances", instances},
        {"objects", objects},
        {"triangles", held},
        {"instanced_triangles", instanced},
        {"build_s", objects_s},
        {"image_bytes", follow ? nlohmann::ordered_json(following->image().bytes()) : nlohmann::ordered_json(nullptr)},
        {"flat_image_bytes", flat_bytes > 0 ? nlohmann::ordered_json(flat_bytes) : nlohmann::ordered_json(nullptr)},
        {"bytes_a_frame", follow ? nlohmann::ordered_json(bytes) : nlohmann::ordered_json(nullptr)},
        {"update_s", two_level ? nlohmann::ordered_json(update_s) : nlohmann::ordered_json(nullptr)},
        {"full_rebuild_s", rebuilt > 0 ? nlohmann::ordered_json(rebuild_s) : nlohmann::ordered_json(nullptr)},
        {"total_s", now() - load_start},
        {"frames", list},
        {"files", numbered},
        {"video", make_video ? nlohmann::ordered_json(video.string()) : nlohmann::ordered_json(nullptr)}};
    stats->write(json.dump(2) + "\n");
  }
  files.commit();
  for (const auto& file : files.files()) std::printf("  wrote %s\n", file->path().c_str());
  if (different > 0)
    throw Error(name + ": " + with_commas(different) +
                " pixels differ between the two-level structure and the full rebuild");
}

}  // namespace retrace::cli
