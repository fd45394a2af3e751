// retrace-board-sim: the board in Verilator, its serial line as a pseudo-terminal. See usage().
#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "golden/scene/geometry.hpp"
#include "testbench/sim/board/simulated_board.hpp"

namespace {

using retrace::Error;
using retrace::cosim::SimulatedBoard;

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

struct UsageError : Error {
  using Error::Error;
};

void usage() {
  std::printf(
      "Usage: retrace-board-sim [OPTION...]\n"
      "The board of rtl/board in Verilator. Prints the path of a pseudo-terminal that is its serial line; use it as "
      "serial:PATH.\n"
      "Ends on SIGINT or SIGTERM (exit 0), or when an assertion of the RTL fails (exit 1).\n\n"
      "  --config NAME            configuration of the core; built are:");
  for (const std::string& name : retrace::cosim::board_configurations()) std::printf(" %s", name.c_str());
  std::printf(
      "\n  --damage PERCENT         of the bytes in each direction are lost, doubled or changed\n"
      "  --damage-to-board PERCENT, --damage-from-board PERCENT   in one direction\n"
      "  --seed N                 of the damage and of the registers' first contents (1)\n"
      "  --waves FILE             FST of the whole run; needs a build with RETRACE_RTL_WAVES\n"
      "A bit takes %u clocks (RETRACE_BOARD_CLOCKS_PER_BIT when the program is built); the rate set on the terminal "
      "has no meaning.\n",
      retrace::cosim::board_clocks_per_bit());
}

template <class Number>
Number number(const std::string& option, const char* text, Number low, Number high) {
  Number value{};
  const std::string_view digits = text;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (status != std::errc() || end != digits.data() + digits.size() || !(value >= low && value <= high))
    throw UsageError(option + " takes a number from " + std::to_string(low) + " to " + std::to_string(high) +
                     ", not '" + text + "'");
  return value;
}

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

int run(int argc, char** argv) {
  SimulatedBoard::Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--help" || option == "-h") {
      usage();
      return 0;
    }
    if (i + 1 == argc) throw UsageError(option + " is no option, or lacks its value; see --help");
    const char* value = argv[++i];
    if (option == "--config")
      options.configuration = value;
    else if (option == "--damage")
      options.damage_to_board = options.damage_from_board = number(option, value, 0.0, 100.0);
    else if (option == "--damage-to-board")
      options.damage_to_board = number(option, value, 0.0, 100.0);
    else if (option == "--damage-from-board")
      options.damage_from_board = number(option, value, 0.0, 100.0);
    else if (option == "--seed")
      options.seed = number<std::uint64_t>(option, value, 0, ~std::uint64_t{0});
    else if (option == "--waves")
      options.waves = value;
    else
      throw UsageError("there is no option " + option + "; see --help");
  }
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGHUP, stop);
  simulate(options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    std::fprintf(stderr, "retrace-board-sim: error: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "retrace-board-sim: error: %s\n", error.what());
    return 1;
  }
}
