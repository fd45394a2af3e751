// retrace-board-sim: the board in Verilator, its serial line as a pseudo-terminal. See --help.
#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>

#include "golden/base/options.hpp"
#include "golden/scene/geometry.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/sim/board/simulated_board.hpp"

namespace {

using retrace::Error;
using retrace::cosim::SimulatedBoard;

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

/// Both ends of a pseudo-terminal; the slave stays open, so that a program that leaves does not hang up the line.
class PseudoTerminal {
 public:
  PseudoTerminal() {
    master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) fail();
    std::array<char, 256> name{};
    if (::ptsname_r(master_, name.data(), name.size()) != 0) fail();
    path_ = name.data();
    slave_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY);
    if (slave_ < 0) fail();
    termios settings{};
    ::tcgetattr(slave_, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(slave_, TCSANOW, &settings);
  }
  ~PseudoTerminal() {
    ::close(slave_);
    ::close(master_);
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  const std::string& path() const { return path_; }
  std::size_t read(std::span<std::uint8_t> into) {
    const ssize_t count = ::read(master_, into.data(), into.size());
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  /// What nobody reads is lost when the terminal's buffer is full, as on a real line.
  void write(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::write(master_, bytes.data(), bytes.size());
      if (count <= 0) return;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
  }
  void wait(int milliseconds) {
    pollfd ask{master_, POLLIN, 0};
    ::poll(&ask, 1, milliseconds);
  }

 private:
  [[noreturn]] static void fail() {
    throw Error(std::string("cannot make a pseudo-terminal: ") + std::strerror(errno));
  }
  int master_ = -1, slave_ = -1;
  std::string path_;
};

void simulate(const SimulatedBoard::Options& options) {
  constexpr std::uint64_t kSlice = 64;  // clocks between looks at the terminal
  constexpr int kIdle = 50;             // milliseconds
  SimulatedBoard board(options);
  PseudoTerminal terminal;
  std::printf("%s\n", terminal.path().c_str());
  std::fflush(stdout);
  std::array<std::uint8_t, 256> buffer{};
  std::size_t waiting = 0;  // bytes on the line to the board, at most
  while (stopped == 0) {
    if (waiting < buffer.size()) {
      const std::size_t count = terminal.read(buffer);
      for (std::size_t i = 0; i < count; ++i) board.send(buffer[i]);
      waiting += count;
    }
    board.run(kSlice);
    waiting = board.waiting();
    if (const auto bytes = board.received(); !bytes.empty()) terminal.write(bytes);
    if (board.quiet()) terminal.wait(kIdle);
  }
  std::fprintf(
      stderr, "board-sim: %llu clocks, %llu bytes to the board, %llu from it, %llu damaged, %llu without a stop bit\n",
      static_cast<unsigned long long>(board.model().clocks()), static_cast<unsigned long long>(board.bytes_in()),
      static_cast<unsigned long long>(board.bytes_out()), static_cast<unsigned long long>(board.damaged()),
      static_cast<unsigned long long>(board.framing_errors()));
}

int run(const SimulatedBoard::Options& options) {
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGHUP, stop);
  simulate(options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  SimulatedBoard::Options options;
  CLI::App app(
      "The board of rtl/board in Verilator. Prints the path of a pseudo-terminal that is its serial line; use it as "
      "serial:PATH.\n"
      "Ends on SIGINT or SIGTERM (exit 0), or when an assertion of the RTL fails (exit 1).",
      "retrace-board-sim");
  app.footer("A bit takes " + std::to_string(retrace::cosim::board_clocks_per_bit()) +
             " clocks (RETRACE_BOARD_CLOCKS_PER_BIT when the program is built); the rate set on the terminal has no "
             "meaning.");
  app.add_option("--config", options.configuration, "Configuration of the core")
      ->check(CLI::IsMember(retrace::cosim::board_configurations()))
      ->capture_default_str();
  const retrace::RealRange percent(0.0, 100.0);
  app.add_option_function<double>(
         "--damage", [&](double share) { options.damage_to_board = options.damage_from_board = share; },
         "Percent of the bytes in each direction that are lost, doubled or changed")
      ->check(percent)
      ->trigger_on_parse();
  app.add_option("--damage-to-board", options.damage_to_board, "The same in one direction")->check(percent);
  app.add_option("--damage-from-board", options.damage_from_board, "The same in the other")->check(percent);
  app.add_option("--seed", options.seed, "Of the damage and of the registers' first contents")->capture_default_str();
  app.add_option("--waves", options.waves, "FST of the whole run; needs a build with RETRACE_RTL_WAVES")
      ->type_name("FILE");
  return retrace::run_program(app, argc, argv, [&] { return run(options); });
}
