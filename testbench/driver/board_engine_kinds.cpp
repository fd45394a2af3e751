// The engines `serial` and `board` as a program finds them: their names, their options, how they are made.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "golden/base/options.hpp"
#include "golden/base/text.hpp"
#include "golden/engine/registry.hpp"
#include "testbench/driver/board_engine.hpp"
#include "testbench/driver/serial_device.hpp"
#include "testbench/driver/udp_device.hpp"

namespace retrace {
namespace {

constexpr std::string_view kSerial = "serial:", kUdp = "udp://";

struct Options {
  BoardOptions board;
  cosim::WindowOptions window;
};
/// Both engines have the same: a program has one line of options.
std::shared_ptr<Options> options() {
  static const auto shared = std::make_shared<Options>();
  return shared;
}

std::string summary(const Engine& engine) {
  const auto& board = dynamic_cast<const BoardEngine&>(engine);
  const auto& c = board.counters();
  const auto& link = board.link();
  char per_ray[32];
  std::snprintf(per_ray, sizeof per_ray, "%.2f", c.rays > 0 ? double(c.clocks) / double(c.rays) : 0.0);
  return with_commas(c.clocks) + " clocks for " + with_commas(c.rays) + " rays in " + with_commas(board.runs()) +
         " runs, " + per_ray + " clocks a ray at " + with_unit(board.board().clock_hz) +
         "Hz; link: " + with_commas(link.bytes_out) + " bytes out, " + with_commas(link.bytes_in) + " in, " +
         with_commas(link.frames) + " frames, " + with_commas(link.repeated) + " repeated";
}

EngineKind kind_of(const char* name, const char* help) {
  EngineKind kind;
  kind.name = name;
  kind.help = help;
  kind.takes_argument = true;
  kind.counts_work = false;
  kind.summary = summary;
  return kind;
}

}  // namespace

EngineKind serial_engine_kind() {
  EngineKind kind = kind_of("serial", "a board behind a serial line; argument: its device, as in serial:/dev/ttyUSB0");
  kind.add_options = [](CLI::App& command) {
    command.add_option("--baud", options()->board.link.baud, "Rate of the line")
        ->capture_default_str()
        ->group("Engines serial, board");
    command
        .add_option("--link-patience", options()->board.link.patience,
                    "Seconds of silence after which a board counts as dead")
        ->capture_default_str()
        ->check(RealRange(0.1, 3600.0))
        ->group("Engines serial, board");
  };
  kind.check = [](const std::string& argument) {
    if (argument.empty()) throw UsageError("engine serial takes a device, as in serial:/dev/ttyUSB0");
    cosim::check_serial_line(argument);
  };
  kind.make = [](const GridScene&, const MemoryImage& image, const std::string& argument) -> std::unique_ptr<Engine> {
    return make_serial_engine(image, cosim::open_serial_line(argument, options()->board.link.baud), options()->board);
  };
  return kind;
}

EngineKind board_engine_kind() {
  EngineKind kind = kind_of(
      "board", "a board; argument: the way to it, as in board:udp://10.99.0.50:2000, board:serial:/dev/ttyUSB0");
  kind.add_options = [](CLI::App& command) {
    command.add_option("--link-window", options()->window.frames, "Frames in flight over UDP")
        ->capture_default_str()
        ->check(CLI::Range(1, 256))
        ->group("Engines serial, board");
  };
  kind.check = [](const std::string& argument) {
    if (argument.starts_with(kSerial))
      cosim::check_serial_line(argument.substr(kSerial.size()));
    else if (argument.starts_with(kUdp))
      cosim::parse_udp_address(argument.substr(kUdp.size()));
    else
      throw UsageError("engine board takes the way to it, udp://HOST:PORT or serial:DEVICE, not '" + argument + "'");
  };
  kind.make = [](const GridScene&, const MemoryImage& image, const std::string& argument) -> std::unique_ptr<Engine> {
    const BoardOptions& board = options()->board;
    std::unique_ptr<cosim::BoardDevice> device;
    if (argument.starts_with(kSerial))
      device = std::make_unique<cosim::SerialDevice>(
          cosim::open_serial_line(argument.substr(kSerial.size()), board.link.baud), board.link);
    else
      device = std::make_unique<cosim::UdpDevice>(
          cosim::open_udp_line(cosim::parse_udp_address(argument.substr(kUdp.size()))), board.link, options()->window);
    return make_board_engine(image, std::move(device), board, "board");
  };
  return kind;
}

}  // namespace retrace
