// A board behind a serial line as a Device, so that CoreDriver works with it as with any other. Protocol: docs/serial-link.md.
//
// Writes of registers are gathered and travel together with what comes next; the core's registers are read in blocks while it is idle; words
// that are all the same travel as one. Frames shrink while the line damages them and grow again.
// Everything written to memory is checked by a sum over the board's memory, everything read from it likewise.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "testbench/driver/device.hpp"
#include "testbench/driver/link_protocol.hpp"
#include "testbench/driver/serial_line.hpp"

namespace retrace::cosim {

struct LinkOptions {
  unsigned baud = 3000000;
  double patience = 5;     ///< seconds without a byte after which a board counts as dead
  int most_tries = 200;    ///< of one frame
  std::uint64_t seed = 0;  ///< of the session's number; 0: drawn
};

struct LinkStatistics {
  std::uint64_t frames = 0, repeated = 0, timeouts = 0, bytes_out = 0, bytes_in = 0;
};

struct BoardIdentity {
  std::uint64_t memory_base = 0, memory_bytes = 0;
  std::uint32_t clock_hz = 0;
  std::size_t most_frame = 0;  ///< bytes of a request, header included; an answer's data are as many at most
};

class SerialDevice final : public Device {
 public:
  /// Begins a session. Throws Error if nothing answers, or something else does.
  SerialDevice(std::unique_ptr<SerialLine> line, const LinkOptions& options);

  std::uint32_t read_register(std::uint32_t offset) override;
  void write_register(std::uint32_t offset, std::uint32_t value) override;
  /// Aligned to kAlignment only: memory is short. Throws Error if there is not enough of it.
  std::uint64_t allocate(std::uint64_t bytes) override;
  void release_all() override { used_ = 0; }
  void write_memory(std::uint64_t address, std::span<const std::uint64_t> words) override;
  void read_memory(std::uint64_t address, std::span<std::uint64_t> words) override;
  bool wait_interrupt() override;
  std::uint64_t clocks() const override { return clocks_; }

  const BoardIdentity& identity() const { return identity_; }
  const LinkStatistics& statistics() const { return statistics_; }
  /// Runs of the core that had ended when it was last asked for its interrupt.
  std::uint32_t runs() const { return runs_; }
  /// A register of the board itself.
  std::uint32_t read_board(link::BoardRegister index) { return read_words(board_offset(index), 1).front(); }
  SerialLine& line() { return *line_; }
  static constexpr std::uint64_t kAlignment = 128;

  struct Answer {
    link::Status status = link::Status::kOk;
    std::uint16_t position = 0;
    std::vector<std::uint8_t> data;
  };
  /// One frame, repeated until it is answered; the board carries it out once. With `divisible`, false after a few failures of a long frame: then it
  /// may have been carried out or not. For tests; throws Error if the board does not answer.
  bool exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer);

 private:
  static std::uint32_t board_offset(link::BoardRegister index) {
    return std::uint32_t{link::kBoardSpace} + 4u * static_cast<std::uint32_t>(index);
  }
  /// As exchange(), and any status but kOk is an Error.
  bool carry_out(const link::Request& request, std::size_t answer_bytes, bool divisible,
                 std::vector<std::uint8_t>& data);
  std::vector<std::uint32_t> read_words(std::uint32_t offset, std::uint16_t count);
  std::uint32_t memory_sum(std::uint64_t address, std::size_t words);
  void flush();
  void check_range(std::uint64_t address, std::size_t words) const;
  [[noreturn]] void fail(const std::string& what) const;
  /// Bytes that a frame or its answer may carry now.
  std::size_t budget() const { return budget_; }
  void failed(std::size_t bytes);
  void succeeded(std::size_t bytes);
  /// For an answer to a frame of so many bytes both ways, for which the board walks so many words.
  double timeout(std::size_t bytes, std::size_t words) const;

  std::unique_ptr<SerialLine> line_;
  LinkOptions options_;
  BoardIdentity identity_;
  LinkStatistics statistics_;
  link::FrameReader reader_;
  std::uint16_t session_ = 0, sequence_ = 0;
  std::size_t budget_, most_budget_;
  double byte_seconds_, word_seconds_ = 0, slack_ = 1;  ///< what the line and the board's memory have needed so far
  std::uint64_t used_ = 0, clocks_ = 0;
  std::uint32_t clocks_low_ = 0, runs_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> writes_;  ///< registers, not yet sent
  bool idle_ = false;                                            ///< the core's registers do not change by themselves
  std::map<std::uint32_t, std::vector<std::uint32_t>> blocks_;   ///< registers read while idle
};

}  // namespace retrace::cosim
