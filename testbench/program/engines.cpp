// Table of engines, see engines.hpp.
#include "testbench/program/engines.hpp"

#include <CLI/CLI.hpp>
#include <vector>

#include "testbench/csim/csim_engine.hpp"
#include "testbench/program/workspace.hpp"
#ifdef RETRACE_RTL
#include "testbench/driver/serial_engine_kind.hpp"
#include "testbench/sim/core/rtl_engine_kind.hpp"
#endif

namespace retrace::cli {
namespace {

std::vector<EngineKind> make_table() {
  std::vector<EngineKind> table;
  EngineKind golden;
  golden.name = "golden";
  golden.help = "double precision on all cores: what is true";
  golden.fixed_point = false;
  golden.stack = true;
  golden.any_mailbox = true;
  golden.make = [](const GridScene& scene, const MemoryImage& image, const std::string&) -> std::unique_ptr<Engine> {
    return make_golden_engine(scene, image);
  };
  table.push_back(golden);

  EngineKind csim;
  csim.name = "csim";
  csim.help = "the fixed-point HLS kernel in C simulation, on all cores";
  csim.make = [](const GridScene&, const MemoryImage& image, const std::string&) -> std::unique_ptr<Engine> {
    return make_csim_engine(image);
  };
  table.push_back(csim);
#ifdef RETRACE_RTL
  table.push_back(rtl_engine_kind());
  table.push_back(serial_engine_kind());
#endif
  return table;
}

std::string name_of(const std::string& specification) { return specification.substr(0, specification.find(':')); }
std::string argument_of(const std::string& specification) {
  const std::size_t colon = specification.find(':');
  return colon == std::string::npos ? std::string() : specification.substr(colon + 1);
}

}  // namespace

std::span<const EngineKind> engine_kinds() {
  static const std::vector<EngineKind> table = make_table();
  return table;
}

const EngineKind& find_engine(const std::string& specification) {
  const std::string name = name_of(specification);
  std::string known;
  for (const EngineKind& kind : engine_kinds()) {
    if (kind.name == name) {
      if (specification.size() > name.size() && !kind.takes_argument) {
        throw UsageError("engine " + name + " takes no argument: '" + specification + "'");
      }
      return kind;
    }
    known += (known.empty() ? "" : ", ") + kind.name;
  }
#ifndef RETRACE_RTL
  if (name == "rtl" || name == "serial")
    throw UsageError("this program was built without the RTL core: configure with -DRETRACE_RTL=ON for engine " + name);
#endif
  throw UsageError("there is no engine '" + name + "'; there are: " + known);
}

std::unique_ptr<Engine> make_engine(const std::string& specification, const GridScene& scene,
                                    const MemoryImage& image) {
  const EngineKind& kind = find_engine(specification);
  return kind.make(scene, image, argument_of(specification));
}

void check_options(const std::string& specification, const TraceOptions& options) {
  const EngineKind& kind = find_engine(specification);
  if (kind.check) kind.check(argument_of(specification));
  if (options.way_up == WayUp::kStack && !kind.stack) {
    throw UsageError("engine " + kind.name + " has no stack: --way-up parent or face");
  }
  if (!kind.any_mailbox && options.mailbox != 0 && options.mailbox != kCsimMailbox) {
    throw UsageError("engine " + kind.name + " has a mailbox of " + std::to_string(kCsimMailbox) + " entries or none");
  }
}

void add_engine_options(CLI::App& command) {
  for (const EngineKind& kind : engine_kinds()) {
    if (kind.add_options) kind.add_options(command);
  }
}

std::string engine_help() {
  std::string text;
  for (const EngineKind& kind : engine_kinds()) {
    const std::string name = kind.name + (kind.takes_argument ? ":ARGUMENT" : "");
    text += "  " + name + std::string(name.size() < 10 ? 10 - name.size() : 1, ' ') + kind.help + "\n";
  }
  return text;
}

WayUp parse_way_up(const std::string& name) {
  for (int i = 0; i < 3; ++i) {
    if (name == kWayUpNames[i]) return static_cast<WayUp>(i);
  }
  throw UsageError("there is no way up '" + name + "'; there are: stack, parent, face");
}

const char* to_string(WayUp way_up) { return kWayUpNames[static_cast<int>(way_up)]; }

}  // namespace retrace::cli
