// What every subcommand starts with: a scene file loaded, snapped and built, and what the user is told about it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "golden/engine.hpp"
#include "golden/scene/geometry.hpp"
#include "golden/scene/memory_image.hpp"
#include "golden/scene/scene.hpp"

namespace retrace::cli {

/// Options that all subcommands share.
struct Common {
  int threads = 0;     ///< 0: all cores
  bool quiet = false;  ///< no progress, no notes
};

struct LoadedScene {
  std::string name;  ///< file name without folder and extension
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  MemoryImage image;
  double load_s = 0, build_s = 0;
};

/// Whether the file starts with the magic number of a memory image. Throws Error if it cannot be read.
bool is_memory_image(const std::filesystem::path& path);

/// Loads, flattens and snaps a glTF file and builds its image. Throws Error; a packed image is an Error that says what can be done with it.
LoadedScene load_scene(const std::filesystem::path& path, const Common& common, bool textures = true);
/// Builds the image of the snapped triangles and takes the time.
void build_image(LoadedScene& loaded, const Common& common);

/// {"file", "triangles", "degenerate", "image_bytes", "load_s", "build_s"}.
nlohmann::ordered_json scene_json(const LoadedScene& scene);

struct Size {
  int width = 640, height = 480;
};
/// "WxH" with both in 1..16384. Throws Error.
Size parse_size(const std::string& text);

double now();
std::string with_commas(std::uint64_t value);
/// 1234567 -> "1.23 M".
std::string with_unit(double value);
/// Notes on standard error: "retrace: note".
void note(const Common& common, const std::string& text);

/// While one exists, SIGINT waits for its end. For writers that keep their temporary file to themselves.
class SignalShield {
 public:
  SignalShield();
  ~SignalShield();
  SignalShield(const SignalShield&) = delete;
  SignalShield& operator=(const SignalShield&) = delete;
};
/// SIGINT and SIGTERM remove what is not finished and end the program.
void install_signal_handlers();

}  // namespace retrace::cli
