// The engine `rtl` as a program finds it: its name, its options, how it is made.
#include <algorithm>
#include <charconv>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "golden/base/text.hpp"
#include "golden/engine/registry.hpp"
#include "testbench/sim/core/rtl_engine.hpp"
#include "testbench/sim/core/rtl_pixels.hpp"
#include "testbench/sim/dram/dram_model.hpp"

namespace retrace {
namespace {

/// The name of a simulated DRAM, or comma-separated KEY=VALUE: latency=CLOCKS or latency=FROM-TO (drawn for each burst, and answers are mixed), bytes=BYTES a clock. Throws
/// UsageError.
cosim::MemoryOptions parse_memory(const std::string& text) {
  const auto& drams = cosim::dram_names();
  const auto refuse = [&]() -> UsageError {
    std::string known;
    for (const std::string& name : drams) known += name + ", ";
    return UsageError("--memory takes " + known +
                      "or latency=CLOCKS or latency=FROM-TO with 1 to 100000 clocks, and bytes=BYTES a clock from 0.1 "
                      "to 16, as in latency=40,bytes=8, not '" +
                      text + "'");
  };
  const auto number = [&](std::string_view digits, auto& value) {
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status != std::errc() || end != digits.data() + digits.size()) throw refuse();
  };
  cosim::MemoryOptions memory;
  if (std::find(drams.begin(), drams.end(), text) != drams.end()) {
    memory.dram = text;
    return memory;
  }
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    const std::string_view item = rest.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos) throw refuse();
    const std::string_view key = item.substr(0, equals), value = item.substr(equals + 1);
    if (key == "latency") {
      const std::size_t dash = value.find('-', 1);
      number(value.substr(0, dash), memory.latency_min);
      memory.latency_max = memory.latency_min;
      memory.reorder = dash != std::string_view::npos;
      if (memory.reorder) number(value.substr(dash + 1), memory.latency_max);
      if (memory.latency_min < 1 || memory.latency_max < memory.latency_min || memory.latency_max > 100000)
        throw refuse();
    } else if (key == "bytes") {
      number(value, memory.bytes_per_clock);
      if (!(memory.bytes_per_clock >= 0.1 && memory.bytes_per_clock <= 16)) throw refuse();
    } else {
      throw refuse();
    }
  }
  return memory;
}

/// Throws UsageError that lists the configurations that were built.
void check_configuration(const std::string& name) {
  std::string known;
  for (const std::string& each : cosim::core_configurations()) {
    if (each == name) return;
    known += (known.empty() ? "" : ", ") + each;
  }
  throw UsageError("there is no configuration '" + name + "' of the RTL core; built are: " + known);
}

double hit_rate(std::uint64_t hits, std::uint64_t misses) {
  // Whoever misses looks up again and hits, so every access is a hit in the end; a miss is a line that was fetched.
  return hits == 0 ? 1.0 : 1.0 - static_cast<double>(misses) / static_cast<double>(hits);
}

CoreReport report_of(const Engine& engine) {
  const auto& rtl = dynamic_cast<const RtlEngine&>(engine);
  const cosim::CoreCounters& c = rtl.counters();
  const auto unit = [](const char* name, const cosim::UnitClocks& u) -> CoreReport::Unit {
    const auto all = static_cast<double>(std::max<std::uint64_t>(u.busy + u.starved + u.blocked, 1));
    return {name, static_cast<double>(u.busy) / all, static_cast<double>(u.starved) / all,
            static_cast<double>(u.blocked) / all};
  };
  CoreReport report;
  report.configuration = rtl.configuration();
  report.rays = c.rays;
  report.clocks = c.clocks;
  report.steps = c.node_steps();
  report.bytes = (c.read_beats + c.write_beats) * static_cast<std::uint64_t>(rtl.identity().data_bytes);
  report.seconds = rtl.simulation_seconds();
  report.clocks_per_second = static_cast<double>(rtl.simulated_clocks()) / report.seconds;
  report.hit_rates = {{"node", hit_rate(c.node_hits, c.node_misses)},
                      {"leaf", hit_rate(c.leaf_hits, c.leaf_misses)},
                      {"triangle", hit_rate(c.triangle_hits, c.triangle_misses)}};
  report.units = {unit("lanes", c.lanes),       unit("leaf_unit", c.leaf_unit), unit("references", c.references),
                  unit("tri_test", c.tri_test), unit("results", c.results),     unit("bus", c.bus)};
  return report;
}

}  // namespace

EngineKind rtl_engine_kind() {
  struct Options {
    RtlOptions rtl;
    std::string memory = "latency=40";
  };
  auto options = std::make_shared<Options>();
  EngineKind kind;
  kind.name = "rtl";
  kind.help = "the RTL core in Verilator; argument: its configuration";
  kind.takes_argument = true;
  kind.counts_work = false;
  kind.instances = true;  // a configuration of one level says so itself
  kind.summary = [](const Engine& engine) {
    const auto& rtl = dynamic_cast<const RtlEngine&>(engine);
    const auto& c = rtl.counters();
    char per_ray[32];
    std::snprintf(per_ray, sizeof per_ray, "%.2f", c.rays > 0 ? double(c.clocks) / double(c.rays) : 0.0);
    return with_commas(c.clocks) + " clocks for " + with_commas(c.rays) + " rays, " + per_ray + " clocks a ray, " +
           with_unit(rtl.simulation_seconds() > 0 ? double(rtl.simulated_clocks()) / rtl.simulation_seconds() : 0.0) +
           " simulated clocks/s";
  };
  kind.report = report_of;
  kind.add_options = [options](CLI::App& command) {
    command.add_option("--config", options->rtl.configuration, "Configuration of the RTL core")
        ->capture_default_str()
        ->group("Engine rtl");
    command
        .add_option(
            "--memory", options->memory,
            "Its memory: latency in clocks (or FROM-TO), bytes a clock (the bus unless given); or ddr3, sdr: the DRAM "
            "of a board behind its controller")
        ->capture_default_str()
        ->group("Engine rtl");
    command.add_option("--waves", options->rtl.waves, "Waves of the whole run (FST)")->group("Engine rtl");
  };
  kind.check = [options](const std::string& argument) {
    check_configuration(argument.empty() ? options->rtl.configuration : argument);
    parse_memory(options->memory);
#ifndef RETRACE_RTL_WAVES
    if (!options->rtl.waves.empty())
      throw UsageError("--waves: this program was built without waves; configure with -DRETRACE_RTL_WAVES=ON");
#endif
  };
  kind.shows_walks = true;
  kind.shows_entries = true;
  kind.make = [options](const GridScene&, const MemoryImage& image,
                        const std::string& argument) -> std::unique_ptr<Engine> {
    RtlOptions rtl = options->rtl;
    if (!argument.empty()) rtl.configuration = argument;
    rtl.memory = parse_memory(options->memory);
    return make_rtl_engine(image, rtl);
  };
  kind.make_pixels = [options](const GridScene&, const MemoryImage& image, const ShadeTable& table,
                               const std::string& argument) {
    RtlOptions rtl = options->rtl;
    if (!argument.empty()) rtl.configuration = argument;
    rtl.memory = parse_memory(options->memory);
    return make_rtl_pixels(image.words(), table, rtl);
  };
  return kind;
}

}  // namespace retrace
