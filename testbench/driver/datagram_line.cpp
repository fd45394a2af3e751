// See datagram_line.hpp.
#include "testbench/driver/datagram_line.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

#include "golden/base/clock.hpp"
#include "golden/base/error.hpp"

namespace retrace::cosim {
namespace {

class UdpLine final : public DatagramLine {
 public:
  explicit UdpLine(const UdpAddress& address) : name_(address.host + ":" + address.port) {
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_DGRAM;
    if (const int error = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found); error != 0)
      throw Error("udp link: " + name_ + ": " + ::gai_strerror(error));
    int reason = 0;
    for (const addrinfo* at = found; at != nullptr && socket_ < 0; at = at->ai_next) {
      socket_ = ::socket(at->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, at->ai_protocol);
      // Connected: only what comes from the board arrives, and that nobody listens there is an error.
      if (socket_ >= 0 && ::connect(socket_, at->ai_addr, at->ai_addrlen) != 0) {
        reason = errno;
        ::close(socket_);
        socket_ = -1;
      }
    }
    ::freeaddrinfo(found);
    if (socket_ < 0) fail(reason);
    // A window of answers has to fit; the kernel may give less, which costs repetitions only.
    const int bytes = 1 << 20;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  }
  ~UdpLine() override { ::close(socket_); }
  UdpLine(const UdpLine&) = delete;
  UdpLine& operator=(const UdpLine&) = delete;

  void send(std::span<const std::uint8_t> datagram) override {
    while (::send(socket_, datagram.data(), datagram.size(), 0) < 0) {
      if (errno == EINTR) continue;
      if (errno == ENOBUFS || errno == EAGAIN) return;  // lost on the way out
      fail(errno);
    }
  }
  std::optional<std::vector<std::uint8_t>> receive(double seconds) override {
    pollfd ask{socket_, POLLIN, 0};
    // Rounded up, so that a short wait is one.
    const int ready = ::poll(&ask, 1, static_cast<int>(std::ceil(std::clamp(seconds, 0.0, 1e6) * 1e3)));
    if (ready <= 0) return std::nullopt;
    std::vector<std::uint8_t> datagram(65536);
    const ssize_t count = ::recv(socket_, datagram.data(), datagram.size(), 0);
    if (count < 0) {
      if (errno == EINTR || errno == EAGAIN) return std::nullopt;
      fail(errno);
    }
    datagram.resize(static_cast<std::size_t>(count));
    return datagram;
  }
  double now() const override { return retrace::now(); }
  const std::string& name() const override { return name_; }

 private:
  [[noreturn]] void fail(int error) const {
    throw Error(
        "udp link: " + name_ + ": " +
        (error == ECONNREFUSED ? "nobody listens there" : std::string("the link is down: ") + std::strerror(error)));
  }
  std::string name_;
  int socket_ = -1;
};

}  // namespace

UdpAddress parse_udp_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  UdpAddress address;
  unsigned port = 0;
  if (colon != std::string::npos) {
    address = {text.substr(0, colon), text.substr(colon + 1)};
    if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']')
      address.host = address.host.substr(1, address.host.size() - 2);
    else if (address.host.find(':') != std::string::npos)
      address.host.clear();
    const char* end = address.port.data() + address.port.size();
    const auto [stop, status] = std::from_chars(address.port.data(), end, port);
    if (status != std::errc() || stop != end) port = 0;
  }
  if (address.host.empty() || port < 1 || port > 65535)
    throw UsageError(
        "a board's address is udp://HOST:PORT with a port from 1 to 65535, as in udp://10.99.0.50:2000, not 'udp://" +
        text + "'");
  return address;
}

std::unique_ptr<DatagramLine> open_udp_line(const UdpAddress& address) { return std::make_unique<UdpLine>(address); }

}  // namespace retrace::cosim
