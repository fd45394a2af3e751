// A board behind datagrams (board_device.hpp). Protocol: docs/udp-link.md. What needs no order among its answers, words of memory, goes out in a window
// of several frames; everything else is one frame at a time.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "testbench/driver/board_device.hpp"
#include "testbench/driver/datagram_line.hpp"

namespace retrace::cosim {

struct WindowOptions {
  std::size_t frames = 16;     ///< in flight at most
  std::size_t payload = 1408;  ///< bytes of a request's or an answer's words: a datagram that no network cuts
};

class UdpDevice final : public BoardDevice {
 public:
  /// Begins a session. Throws Error if nothing answers, or something else does.
  UdpDevice(std::unique_ptr<DatagramLine> line, const LinkOptions& options, const WindowOptions& window = {});

  DatagramLine& line() { return *line_; }
  bool exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer) override;

 private:
  /// What a frame shall do. It does no harm twice, unless it goes alone.
  struct Job {
    link::Request request;
    std::size_t answer_bytes = 0;
    Answer answer;
  };
  struct Flight {
    std::uint16_t sequence;
    std::size_t job;
    std::vector<std::uint8_t> frame;
    double first_sent;
    bool repeated = false;
  };
  std::size_t budget() const override;
  std::string link_name() const override { return "udp link: " + line_->name(); }
  void pass(double seconds) override;
  void send_words(std::uint64_t address, std::span<const std::uint64_t> words) override;
  void fetch_words(std::uint64_t address, std::span<std::uint64_t> words) override;
  /// Carries all of them out. An answer that says no ends it: it is in its job, and true is returned only without such a one.
  bool carry_out(std::vector<Job>& jobs);
  void carry_out_or_fail(std::vector<Job>& jobs);
  void send(Flight& flight);

  std::unique_ptr<DatagramLine> line_;
  WindowOptions window_;
  double round_trip_, slack_ = 1;  ///< seconds, as they were so far
};

}  // namespace retrace::cosim
