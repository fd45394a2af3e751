// The engine `rtl` for the program's table of engines (testbench/cli/engines.cpp): its name, its options, how it is made.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "testbench/cli/engines.hpp"
#include "testbench/cli/workspace.hpp"
#include "testbench/cosim/core/rtl_engine.hpp"

namespace retrace::cli {

/// "LATENCY[,BYTES]" with a latency in clocks or a range "1-200" (which also mixes the order of answers), and bytes a clock.
inline cosim::MemoryOptions parse_memory(const std::string& text) {
  cosim::MemoryOptions memory;
  int low = 0, high = 0, used = 0;
  double bytes = 0;
  if (std::sscanf(text.c_str(), "%d-%d%n", &low, &high, &used) == 2)
    memory.reorder = true;
  else if (std::sscanf(text.c_str(), "%d%n", &low, &used) == 1)
    high = low;
  else
    used = -1;
  if (used > 0 && text[used] == ',') {
    int more = 0;
    if (std::sscanf(text.c_str() + used, ",%lf%n", &bytes, &more) != 1)
      used = -1;
    else
      used += more;
  }
  if (used < 0 || text[used] != '\0' || low < 1 || high < low || high > 100000 || bytes < 0)
    throw UsageError(
        "--memory is LATENCY or FROM-TO in clocks, then ,BYTES a clock if it is to be less than the bus: '" + text +
        "'");
  memory.latency_min = low;
  memory.latency_max = high;
  memory.bytes_per_clock = bytes;
  return memory;
}

inline EngineKind rtl_engine_kind() {
  struct Options {
    RtlOptions rtl;
    std::string memory = "40";
  };
  auto options = std::make_shared<Options>();
  EngineKind kind;
  kind.name = "rtl";
  kind.help = "the RTL core in Verilator; argument: its configuration";
  kind.takes_argument = true;
  kind.add_options = [options](CLI::App& command) {
    command.add_option("--config", options->rtl.configuration, "Configuration of the RTL core")
        ->capture_default_str()
        ->group("Engine rtl");
    command.add_option("--memory", options->memory, "Its memory: LATENCY or FROM-TO in clocks, then ,BYTES a clock")
        ->capture_default_str()
        ->group("Engine rtl");
    command.add_option("--waves", options->rtl.waves, "Waves of the whole run (FST)")->group("Engine rtl");
  };
  kind.make = [options](const GridScene&, const MemoryImage& image,
                        const std::string& argument) -> std::unique_ptr<Engine> {
    RtlOptions rtl = options->rtl;
    if (!argument.empty()) rtl.configuration = argument;
    rtl.memory = parse_memory(options->memory);
    return make_rtl_engine(image, rtl);
  };
  return kind;
}

}  // namespace retrace::cli
