// A board behind a serial line (board_device.hpp). Protocol: docs/serial-link.md. Frames shrink while the line damages them and grow again.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "testbench/driver/board_device.hpp"
#include "testbench/driver/serial_line.hpp"

namespace retrace::cosim {

class SerialDevice final : public BoardDevice {
 public:
  /// Begins a session. Throws Error if nothing answers, or something else does.
  SerialDevice(std::unique_ptr<SerialLine> line, const LinkOptions& options);

  SerialLine& line() { return *line_; }
  bool exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer) override;

 private:
  std::size_t budget() const override { return budget_; }
  std::string link_name() const override { return "serial link: " + line_->name(); }
  void pass(double seconds) override;
  void failed(std::size_t bytes);
  void succeeded(std::size_t bytes);
  /// For an answer to a frame of so many bytes both ways, for which the board walks so many words.
  double timeout(std::size_t bytes, std::size_t words) const;

  std::unique_ptr<SerialLine> line_;
  link::FrameReader reader_;
  std::size_t budget_, most_budget_;
  double byte_seconds_, word_seconds_ = 0, slack_ = 1;  ///< what the line and the board's memory have needed so far
};

}  // namespace retrace::cosim
