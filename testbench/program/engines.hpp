// The engines that the program knows, by name. A new engine is one entry in engines.cpp: its name, what it can do, options of its own and
// how it is made; every subcommand then takes it.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "golden/engine/engine.hpp"

namespace CLI {
class App;
}

namespace retrace::cli {

struct EngineKind {
  std::string name;
  std::string help;
  bool fixed_point = true;      ///< its hits must be bit-identical to those of every other fixed-point engine
  bool takes_argument = false;  ///< written name:argument, say a device
  bool stack = false;           ///< knows WayUp::kStack
  bool any_mailbox = false;     ///< takes a mailbox of any size; otherwise none or the kernel's
  std::function<void(CLI::App&)> add_options;  ///< may be empty
  bool counts_work = true;                     ///< knows the work of each ray
  /// What it did so far, one line for people. May be empty.
  std::function<std::string(const Engine&)> summary;
  /// Throws UsageError if the options or the argument cannot be meant; before anything is loaded. May be empty.
  std::function<void(const std::string& argument)> check;
  /// `scene` and `image` outlive the engine.
  std::function<std::unique_ptr<Engine>(const GridScene& scene, const MemoryImage& image, const std::string& argument)>
      make;
};

std::span<const EngineKind> engine_kinds();
/// The kind that "name" or "name:argument" means. Throws UsageError that lists the known ones.
const EngineKind& find_engine(const std::string& specification);
std::unique_ptr<Engine> make_engine(const std::string& specification, const GridScene& scene, const MemoryImage& image);
/// Throws UsageError if the engine does not know the way up or the size of the mailbox, or an option of its own is wrong.
void check_options(const std::string& specification, const TraceOptions& options);
/// Options of all engines, in groups of their names.
void add_engine_options(CLI::App& command);
/// One line an engine, for --help.
std::string engine_help();

WayUp parse_way_up(const std::string& name);
const char* to_string(WayUp way_up);
inline constexpr const char* kWayUpNames[] = {"stack", "parent", "face"};

}  // namespace retrace::cli
