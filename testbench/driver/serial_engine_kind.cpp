// The engine `serial` as a program finds it: its name, its options, how it is made.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "golden/base/options.hpp"
#include "golden/base/text.hpp"
#include "golden/engine/registry.hpp"
#include "testbench/driver/serial_engine.hpp"

namespace retrace {

EngineKind serial_engine_kind() {
  auto options = std::make_shared<SerialOptions>();
  EngineKind kind;
  kind.name = "serial";
  kind.help = "a board behind a serial line; argument: its device, as in serial:/dev/ttyUSB0";
  kind.takes_argument = true;
  kind.counts_work = false;
  kind.summary = [](const Engine& engine) {
    const auto& serial = dynamic_cast<const SerialEngine&>(engine);
    const auto& c = serial.counters();
    const auto& link = serial.link();
    char per_ray[32];
    std::snprintf(per_ray, sizeof per_ray, "%.2f", c.rays > 0 ? double(c.clocks) / double(c.rays) : 0.0);
    return with_commas(c.clocks) + " clocks for " + with_commas(c.rays) + " rays in " + with_commas(serial.runs()) +
           " runs, " + per_ray + " clocks a ray at " + with_unit(serial.board().clock_hz) +
           "Hz; link: " + with_commas(link.bytes_out) + " bytes out, " + with_commas(link.bytes_in) + " in, " +
           with_commas(link.frames) + " frames, " + with_commas(link.repeated) + " repeated";
  };
  kind.add_options = [options](CLI::App& command) {
    command.add_option("--baud", options->link.baud, "Rate of the line")->capture_default_str()->group("Engine serial");
    command
        .add_option("--link-patience", options->link.patience, "Seconds of silence after which a board counts as dead")
        ->capture_default_str()
        ->check(RealRange(0.1, 3600.0))
        ->group("Engine serial");
  };
  kind.check = [](const std::string& argument) {
    if (argument.empty()) throw UsageError("engine serial takes a device, as in serial:/dev/ttyUSB0");
    cosim::check_serial_line(argument);
  };
  kind.make = [options](const GridScene&, const MemoryImage& image,
                        const std::string& argument) -> std::unique_ptr<Engine> {
    return make_serial_engine(image, cosim::open_serial_line(argument, options->link.baud), *options);
  };
  return kind;
}

}  // namespace retrace
