// The structure lab behind `retrace lab`: every structure of golden/accel on the same rays of the same scenes, and what
// it cost. measure() does the work; the reports (JSON, Markdown, SVG, HTML) only write down what is in LabReport.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "golden/accel/accel.hpp"
#include "golden/accel/cache_model.hpp"
#include "golden/engine/engine.hpp"
#include "golden/tree/traced_scene.hpp"

namespace CLI {
class App;
}

namespace retrace::lab {

/// Rays of one purpose; pixel[i] is where ray i belongs in the picture.
struct RayBatch {
  std::vector<GridRay> grid;     ///< as quantised
  std::vector<accel::Ray> rays;  ///< the same in double
  std::vector<std::uint32_t> pixel;
};

enum Kind { kPrimary, kShadow, kBounce };
inline constexpr int kKinds = 3;
inline constexpr std::array<const char*, kKinds> kKindNames{"primary", "shadow", "bounce"};

struct LabOptions {
  int width = 192, height = 144;
  std::string camera;  ///< as `retrace render --camera`
  std::vector<accel::CacheShape> caches{{16384, 4}, {65536, 4}, {262144, 4}};
  int contexts = 64;                            ///< rays in flight in the cache model
  double check_tests = 3e8;                     ///< triangle tests that brute force may spend on a scene
  int frames = 3;                               ///< of an animated scene
  bool structures = true;                       ///< false: only the animation
  std::vector<std::string> only;                ///< keys of techniques, or the beginnings of keys; empty: all
  std::function<void(const std::string&)> say;  ///< progress, one line a call; may be empty
};

struct CacheResult {
  std::uint64_t accesses = 0, misses = 0;
};

struct KindResult {
  std::uint64_t rays = 0, hits = 0;
  accel::Work work;
  double seconds = 0.0;             ///< to trace them in one thread, without the cache model
  std::uint64_t different = 0;      ///< rays with another hit than the reference structure
  std::vector<CacheResult> caches;  ///< empty for most mailboxes
};

/// One structure with one traversal and one mailbox.
struct Row {
  std::string key, structure, traversal, source;
  int mailbox = 0;       ///< entries; accel::Mailbox::kExact; 0: none
  double build_s = 0.0;  ///< processor time
  accel::Footprint footprint;
  double references = 0.0;  ///< per triangle
  std::array<KindResult, kKinds> kinds;
  std::vector<float> heat_visits, heat_tests;  ///< by pixel, empty unless this row has maps
};

/// A frame of an animated scene: what following it costs, beside building it anew.
struct FrameResult {
  double time = 0.0;
  double pose_s = 0.0;                                      ///< evaluating the animation, needed either way
  double transforms_s = 0.0, objects_s = 0.0, top_s = 0.0;  ///< two-level structure
  std::uint32_t objects_rebuilt = 0;
  double flatten_s = 0.0, snap_s = 0.0, build_s = 0.0;  ///< one tree over all world triangles
  std::uint64_t rays = 0, hits = 0, different = 0;      ///< camera rays; different: not the same hit bit for bit
  double two_level_s = 0.0, flat_s = 0.0;               ///< to trace them in one thread
  double update_s() const { return transforms_s + objects_s + top_s; }
  double rebuild_s() const { return flatten_s + snap_s + build_s; }
};

struct AnimationReport {
  std::uint64_t instances = 0, objects = 0, triangles = 0, instanced_triangles = 0;
  std::uint64_t bytes = 0, degenerate = 0;
  double duration = 0.0, build_s = 0.0;  ///< build_s: all objects, once
  std::vector<FrameResult> frames;       ///< empty: the scene does not move
  double update_s() const;
  double rebuild_s() const;
};

struct SceneReport {
  std::string name;
  std::uint64_t triangles = 0, degenerate = 0;
  std::string camera, light;
  std::array<std::uint64_t, kKinds> rays{}, checked{},
      wrong{};  ///< checked by brute force; wrong: not what brute force says
  std::vector<Row> rows;
  AnimationReport animation;
  double seconds = 0.0;

  const Row* find(const std::string& key, int mailbox = 0) const;
};

struct LabReport {
  LabOptions options;
  std::vector<SceneReport> scenes;
  double seconds = 0.0;
  double cpu_seconds = 0.0;  ///< of all threads
  /// Rays on which any structure differs from another or from brute force.
  std::uint64_t differences() const;
};

/// The rays of a scene, in 8x8 tiles: camera rays, one shadow ray towards a light from every hit, one cosine-weighted
/// bounce. `light` receives what lit the scene.
std::array<RayBatch, kKinds> make_rays(const TracedScene& scene, const LabOptions& options, std::string& camera,
                                       std::string& light);

/// What reports call a scene: a file's name without folder and extension, or the generator as it was written.
std::string scene_name(const std::string& spec);

/// Throws UsageError if one of LabOptions::only is no beginning of a key.
void check_structures(const std::vector<std::string>& only);

/// Opens a scene (scenes/open_scene.hpp) and measures everything. Throws Error.
SceneReport measure(const std::string& spec, const LabOptions& options);

/// Follows an animated glTF file through `options.frames` frames. Throws Error.
AnimationReport measure_animation(const std::string& path, const LabOptions& options);

nlohmann::ordered_json to_json(const LabReport& report);
/// Tables for docs/lab.md, headings of level 3.
std::string to_markdown(const LabReport& report);
/// Plots by name ("work", "caches", ...) as SVG documents, for one scene.
std::map<std::string, std::string> to_plots(const SceneReport& scene, const LabOptions& options);
/// A page that needs no other file.
std::string to_html(const LabReport& report);

/// "kd-tree, SAH, face links, mailbox 8".
std::string label(const Row& row);

/// Adds `retrace lab` to the program. Its callback throws Error; also when structures differ, after everything is
/// written.
void register_lab(CLI::App& app);

}  // namespace retrace::lab
