// Datagrams to a board and back, and time as it passes there: a UDP socket, or a simulation in the same process.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace retrace::cosim {

class DatagramLine {
 public:
  virtual ~DatagramLine() = default;
  /// May be lost. Throws Error if there is no way to the board.
  virtual void send(std::span<const std::uint8_t> datagram) = 0;
  /// The next one, at most after `seconds`. Throws Error if there is no way to the board.
  virtual std::optional<std::vector<std::uint8_t>> receive(double seconds) = 0;
  virtual double now() const = 0;
  /// For messages.
  virtual const std::string& name() const = 0;
};

/// HOST:PORT; an IPv6 address in brackets. Throws UsageError.
struct UdpAddress {
  std::string host, port;
};
UdpAddress parse_udp_address(const std::string& text);
/// Throws Error if the name is unknown.
std::unique_ptr<DatagramLine> open_udp_line(const UdpAddress& address);

}  // namespace retrace::cosim
