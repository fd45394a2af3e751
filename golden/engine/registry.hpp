// The engines of a program, by name. Each registers from its own folder: retrace_register_engine(<library> <function>) in its CMakeLists.txt
// names a function that returns its EngineKind, and retrace_engine_list(<target>) gives a program all of them. Every subcommand then takes it.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine.hpp"
#include "pixels.hpp"

namespace CLI {
class App;
}

namespace retrace {

/// Where the clocks of a core have gone so far.
struct CoreReport {
  struct Unit {
    std::string name;
    double busy = 0, starved = 0, blocked = 0;  ///< shares of its clocks
  };
  std::string configuration;
  std::uint64_t rays = 0, clocks = 0, steps = 0, bytes = 0;  ///< node steps; bytes read and written
  double seconds = 0;                                        ///< of the runs
  double clocks_per_second = 0;                              ///< simulated, those between the runs included
  std::vector<std::pair<std::string, double>> hit_rates;
  std::vector<Unit> units;
};

struct EngineKind {
  std::string name;
  std::string help;
  bool fixed_point = true;
  std::string same_hits =
      "kd-backtrack";  ///< fixed-point engines that agree in every bit, edges and any hit included, have the same word here
  bool takes_argument = false;  ///< written name:argument, say a device
  bool stack = false;           ///< knows WayUp::kStack
  bool any_mailbox = false;     ///< takes a mailbox of any size; otherwise none or the kernel's
  bool two_level = false;       ///< its arithmetic is that of golden/accel, which has the two-level structure
  bool instances = false;       ///< traces images of two levels
  bool counts_work = true;      ///< knows the work of each ray
  bool shows_walks = false;     ///< has Engine::walk
  bool shows_entries = false;   ///< of images of two levels, too
  std::function<void(CLI::App&)> add_options;  ///< may be empty
  /// What it did so far, one line for people. May be empty.
  std::function<std::string(const Engine&)> summary;
  /// Where its clocks went. Empty for what has none.
  std::function<CoreReport(const Engine&)> report;
  /// Throws UsageError if the options or the argument cannot be meant; before anything is loaded. May be empty.
  std::function<void(const std::string& argument)> check;
  /// `scene` and `image` outlive the engine.
  std::function<std::unique_ptr<Engine>(const GridScene& scene, const MemoryImage& image, const std::string& argument)>
      make;
  /// An engine that makes pictures by itself. `scene` and `image` outlive it. Empty for what has none.
  std::function<std::unique_ptr<PixelEngine>(const GridScene& scene, const MemoryImage& image, const ShadeTable& table,
                                             const std::string& argument)>
      make_pixels;
};

/// Throws std::logic_error if there is one of that name.
void register_engine(EngineKind kind);
/// An engine that the build left out, and what brings it in.
void register_absent_engine(const std::string& name, const std::string& remedy);
/// Registers what the build has. Generated for each program (retrace_engine_list).
void register_engines();

std::span<const EngineKind> engine_kinds();
/// The kind that "name" or "name:argument" means. Throws UsageError that lists the known ones.
const EngineKind& find_engine(const std::string& specification);
/// The engines of a list such as "golden,csim". Throws UsageError if one is named twice.
std::vector<std::string> parse_engines(const std::string& list);
/// Of each engine of a list, the place of the one that it is held against: of a fixed-point engine the first with the same hits, because then nothing
/// less than the same bits will do, else the golden model; of the golden model the first. The first stands for itself. Throws UsageError
/// where a fixed-point engine has neither before it.
std::vector<std::size_t> places_held_against(std::span<const std::string> engines);
/// Throws UsageError if the engine makes no pictures by itself.
/// Throws as check_instances() does for an image of two levels.
std::unique_ptr<PixelEngine> make_pixel_engine(const std::string& specification, const GridScene& scene,
                                               const MemoryImage& image, const ShadeTable& table);
/// Throws UsageError if the engine does not trace images of two levels.
void check_instances(const std::string& specification);
/// Throws as check_instances() does for an image of two levels.
std::unique_ptr<Engine> make_engine(const std::string& specification, const GridScene& scene, const MemoryImage& image);
/// Throws UsageError if the engine does not know the way up or the size of the mailbox, or an option of its own is wrong.
void check_options(const std::string& specification, const TraceOptions& options);
/// Options of all engines, in groups of their names.
void add_engine_options(CLI::App& command);
/// One line an engine, for --help.
std::string engine_help();

WayUp parse_way_up(const std::string& name);
const char* to_string(WayUp way_up);
/// Entries of the largest mailbox that an engine has (golden; the kernels have kKernelMailbox or none).
inline constexpr int kMaxMailbox = 64;

inline constexpr const char* kWayUpNames[] = {"stack", "parent", "face"};

}  // namespace retrace
