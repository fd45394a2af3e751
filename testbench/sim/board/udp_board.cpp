// retrace-udp-board: a core in Verilator with a board's memory, behind a UDP port. See --help.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "golden/base/options.hpp"
#include "testbench/driver/core_driver.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/sim/board/link_server.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "testbench/sim/dram/dram_model.hpp"

namespace {

using namespace retrace;
using namespace retrace::cosim;

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

struct Options {
  SimulatedDevice::Options device;
  NoiseOptions noise;
  std::string memory = "ddr3";
  std::uint64_t seed = 1, megabytes = 32;
  std::uint32_t memory_state = link::kMemoryReady;
  unsigned port = 0;
};

/// The simulated core and its memory. Memory belongs to the core while it runs: the link waits.
class Soc final : public BoardBus {
 public:
  Soc(const Options& options, std::uint64_t bytes) : device_(options.device), driver_(device_), bytes_(bytes) {
    device_.bus_memory().resize(bytes);
  }
  bool read_register(std::uint32_t offset, std::uint32_t& value) override {
    if (!known(offset)) return false;
    value = device_.read_register(offset);
    return true;
  }
  bool write_register(std::uint32_t offset, std::uint32_t value) override {
    if (!known(offset)) return false;
    device_.write_register(offset, value);
    return true;
  }
  bool read_memory(std::uint64_t address, std::span<std::uint64_t> words) override {
    if (!inside(address, words.size()) || !settle()) return false;
    device_.read_memory(address, words);
    return true;
  }
  bool write_memory(std::uint64_t address, std::span<const std::uint64_t> words) override {
    if (!inside(address, words.size()) || !settle()) return false;
    device_.write_memory(address, words);
    return true;
  }
  bool interrupt() const override { return device_.interrupt(); }
  std::uint32_t clocks() const override { return static_cast<std::uint32_t>(device_.clocks()); }
  bool busy() { return driver_.status().busy; }
  void run(std::uint64_t clocks) { device_.run(clocks); }
  std::uint64_t base() const { return device_.bus_memory().base(); }

 private:
  static bool known(std::uint32_t offset) { return offset % 4 == 0 && offset < register_bytes(); }
  bool inside(std::uint64_t address, std::size_t words) const {
    return address % 8 == 0 && address >= base() && address - base() <= bytes_ &&
           words <= (bytes_ - (address - base())) / 8;
  }
  bool settle() {
    constexpr std::uint64_t kSlice = 1000, kLongest = 100000000;
    for (std::uint64_t clocks = 0; busy(); clocks += kSlice) {
      if (clocks > kLongest) return false;
      run(kSlice);
    }
    return true;
  }
  SimulatedDevice device_;
  CoreDriver driver_;
  std::uint64_t bytes_;
};

class Socket {
 public:
  explicit Socket(unsigned port) {
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    socklen_t length = sizeof address;
    if (socket_ < 0 || ::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length) != 0)
      throw Error("cannot listen at UDP port " + std::to_string(port) + ": " + std::strerror(errno));
    port_ = ntohs(address.sin_port);
  }
  ~Socket() { ::close(socket_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  unsigned port() const { return port_; }
  bool wait(int milliseconds) {
    pollfd ask{socket_, POLLIN, 0};
    return ::poll(&ask, 1, milliseconds) > 0;
  }
  std::vector<std::uint8_t> receive() {
    std::vector<std::uint8_t> bytes(65536);
    socklen_t length = sizeof from_;
    const ssize_t count =
        ::recvfrom(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from_), &length);
    bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return bytes;
  }
  /// To whom spoke last; what nobody takes is lost.
  void send(const std::vector<std::uint8_t>& bytes) {
    ::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&from_), sizeof from_);
  }

 private:
  int socket_ = -1;
  unsigned port_ = 0;
  sockaddr_in from_{};
};

int run(Options& options) {
  constexpr std::uint64_t kSlice = 2000;  // clocks between looks at the socket
  constexpr int kIdle = 50;               // milliseconds
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, stop);
  options.device.seed = options.seed;
  const bool dram = options.memory != "model";
  if (dram) options.device.memory.dram = options.memory;
  const std::uint64_t bytes = dram ? make_dram_model(options.memory, options.seed)->bytes() : options.megabytes << 20;
  Soc soc(options, bytes);
  LinkServer::Board board;
  board.memory_base = soc.base();
  board.memory_bytes = bytes;
  board.memory_state = options.memory_state;
  board.image_version = static_cast<std::uint8_t>(contract::kImageVersion);
  LinkServer server(soc, board);
  Noise to_board(2 * options.seed + 1, options.noise), from_board(2 * options.seed + 2, options.noise);
  Socket socket(options.port);
  std::printf("udp://127.0.0.1:%u\n", socket.port());
  std::fflush(stdout);
  std::uint64_t datagrams = 0;
  while (stopped == 0) {
    const bool busy = soc.busy();
    if (busy) soc.run(kSlice);
    server.look();
    if (!socket.wait(busy ? 0 : kIdle)) continue;
    std::vector<std::vector<std::uint8_t>> arrived, answers;
    to_board.pass(socket.receive(), arrived);
    for (const auto& datagram : arrived) {
      ++datagrams;
      from_board.pass(server.answer(datagram), answers);
    }
    for (const auto& answer : answers) socket.send(answer);
  }
  std::fprintf(
      stderr,
      "udp-board: %u clocks, %llu datagrams, %llu lost, doubled, reordered or damaged, %llu frames carried out\n",
      soc.clocks(), static_cast<unsigned long long>(datagrams),
      static_cast<unsigned long long>(to_board.hurt() + from_board.hurt()),
      static_cast<unsigned long long>(server.carried_out()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.device.configuration = "small";
  CLI::App app(
      "A core in Verilator with a board's DRAM behind its controller, and the board's side of the UDP link in "
      "software. Prints its "
      "address; use it as board:ADDRESS.\nEnds on SIGINT or SIGTERM (exit 0), or when an assertion of the RTL fails "
      "(exit 1).",
      "retrace-udp-board");
  const RealRange percent(0.0, 100.0);
  app.add_option("--port", options.port, "UDP port; 0: a free one")->check(CLI::Range(0, 65535));
  app.add_option("--config", options.device.configuration, "Configuration of the core")
      ->check(CLI::IsMember(core_configurations()))
      ->capture_default_str();
  std::vector<std::string> memories = dram_names();
  memories.emplace_back("model");
  app.add_option("--memory", options.memory, "DRAM of the board, or a model without one")
      ->check(CLI::IsMember(memories))
      ->capture_default_str();
  app.add_option("--megabytes", options.megabytes, "Of the memory `model`")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option_function<double>(
         "--noise", [&](double share) { options.noise.loss = options.noise.doubled = options.noise.reordered = share; },
         "Percent of the datagrams, each way, that are lost; doubled; held back behind the next")
      ->check(percent);
  app.add_option("--damage", options.noise.damaged, "Percent of the datagrams in which a byte is changed")
      ->check(percent);
  app.add_option("--memory-state", options.memory_state,
                 "What the board says of its memory: 0 ready, 1 not initialised, 2 failed")
      ->check(CLI::Range(0, 2));
  app.add_option("--seed", options.seed, "Of noise and first contents")->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(options); });
}
