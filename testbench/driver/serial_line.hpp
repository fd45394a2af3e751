// A line that carries bytes both ways, and time as it passes there: a terminal device, or a simulation in the same process.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace retrace::cosim {

class SerialLine {
 public:
  virtual ~SerialLine() = default;
  /// Throws Error if the line is gone or takes nothing for a while.
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
  /// What has arrived, at most after `seconds`; empty if nothing has. Throws Error if the line is gone.
  virtual std::vector<std::uint8_t> read(double seconds) = 0;
  /// Seconds since some moment, as the line sees them.
  virtual double now() const = 0;
  /// For messages.
  virtual const std::string& name() const = 0;
};

/// Whether `path` is a terminal device that may be opened. Throws Error with the reason if not.
void check_serial_line(const std::string& path);
/// A serial port or pseudo-terminal, raw, 8 data bits, no parity, one stop bit, for this program alone. Throws Error.
std::unique_ptr<SerialLine> open_serial_line(const std::string& path, unsigned baud);

}  // namespace retrace::cosim
