// What every subcommand starts with: a scene file loaded, snapped and built, and what the user is told about it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "golden/base/clock.hpp"
#include "golden/base/text.hpp"
#include "golden/engine/engine.hpp"
#include "golden/tree/traced_scene.hpp"

namespace retrace::cli {

using retrace::UsageError;

/// Options that all subcommands share.
struct Common {
  int threads = 0;     ///< 0: all cores
  bool quiet = false;  ///< no progress, no notes
  TwoLevels two_levels = TwoLevels::kOff;
};

struct LoadedScene : TracedScene {
  std::string name;  ///< file name without folder and extension, or the generator's
  double load_s = 0, build_s = 0;
};

/// What --help says about SCENE.
inline constexpr const char* kSceneHelp =
    "glTF file (.gltf, .glb), or a scene of the project's own: knot, room:detail=0.2";

/// Whether the file starts with the magic number of a memory image. Throws Error if it cannot be read.
bool is_memory_image(const std::filesystem::path& path);

/// A scene and what it is called: file name without folder and extension, or the generator's.
struct NamedScene {
  std::string name;
  Scene scene;
};

/// A glTF file or, where there is no such file, the name of a generator with parameters (scenes/open_scene.hpp). `notes` receives a line about each thing
/// that is left out. Throws Error; a packed image is an Error that says what can be done with it.
NamedScene read_scene(const std::string& scene, bool textures, std::vector<std::string>& notes);

/// Reads, flattens (or keeps the instances of) and snaps a scene and builds its image. Throws Error.
/// `side`: of the cube of the grid that is used, see snap().
LoadedScene load_scene(const std::string& scene, const Common& common, bool textures = true, double side = 1.0);

/// {"file", "triangles", "degenerate", "image_bytes", "load_s", "build_s"}, and "instances", "objects" of two levels.
nlohmann::ordered_json scene_json(const LoadedScene& scene);

/// What `retrace info --json` prints of an image.
nlohmann::ordered_json image_json(const ImageStatistics& statistics, const contract::HeaderRecord& header);

/// One line about instances and objects, of a scene of two levels.
void print_levels(const LoadedScene& scene);

struct Size {
  int width = 640, height = 480;
};
/// "WxH" with both in 1..16384. Throws UsageError.
Size parse_size(const std::string& text);

/// Throws UsageError for an AOV that there is not, and for one that the engine does not count.
void check_aovs(const std::vector<std::string>& names, const std::string& engine);

/// Notes on standard error: "retrace: note".
void note(const Common& common, const std::string& text);

}  // namespace retrace::cli
