// A board behind a link as a Device, whatever carries its frames: registers, memory, checks. Protocol: docs/serial-link.md, docs/udp-link.md.
//
// Writes of registers are gathered and travel together with what comes next; the core's registers are read in blocks while it is idle; words
// that are all the same travel as one. Everything written to memory is checked by a sum over the board's memory, everything read from it likewise.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "testbench/driver/device.hpp"
#include "testbench/driver/link_protocol.hpp"

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

class BoardDevice : public Device {
 public:
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
  static constexpr std::uint64_t kAlignment = 128;

  struct Answer {
    link::Status status = link::Status::kOk;
    std::uint16_t position = 0;
    std::vector<std::uint8_t> data;
  };
  /// One frame, repeated until it is answered; the board carries it out once. With `divisible`, false after a few failures of a long frame: then it
  /// may have been carried out or not. For tests; throws Error if the board does not answer.
  virtual bool exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer) = 0;

 protected:
  explicit BoardDevice(const LinkOptions& options);
  /// Begins a session and reads what the board is. Throws Error if nothing answers, or something else does.
  void begin();
  /// Bytes that a frame or its answer may carry now.
  virtual std::size_t budget() const = 0;
  /// For messages: what carries the frames, and where to.
  virtual std::string link_name() const = 0;
  /// Lets time pass, as the link sees it.
  virtual void pass(double seconds) = 0;
  /// Words to and from the board's memory, which they are known to be inside of; sums are compared by the caller.
  virtual void send_words(std::uint64_t address, std::span<const std::uint64_t> words);
  virtual void fetch_words(std::uint64_t address, std::span<std::uint64_t> words);
  /// The board has not been heard of in this session.
  bool unknown() const { return clocks_low_ == 0 && identity_.memory_bytes == 0; }
  std::size_t most_load() const;
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void refused(const Answer& answer) const;
  /// The request that begins at words[at] of what is to be written, no longer than `most` bytes, and the words it covers.
  static std::size_t next_write(std::uint64_t address, std::span<const std::uint64_t> words, std::size_t at,
                                std::size_t most, link::Request& request);
  static constexpr std::size_t kMostWords = 65535;  // of an operation's count

  LinkOptions options_;
  BoardIdentity identity_;
  LinkStatistics statistics_;
  std::uint16_t session_ = 0, sequence_ = 0;

 private:
  static std::uint32_t board_offset(link::BoardRegister index) {
    return std::uint32_t{link::kBoardSpace} + 4u * static_cast<std::uint32_t>(index);
  }
  /// As exchange(), and any status but kOk is an Error.
  bool carry_out(const link::Request& request, std::size_t answer_bytes, bool divisible,
                 std::vector<std::uint8_t>& data);
  std::vector<std::uint32_t> read_words(std::uint32_t offset, std::uint16_t count);
  std::uint32_t memory_sum(std::uint64_t address, std::size_t words);
  bool holds(std::uint64_t address, std::span<const std::uint64_t> words);
  void flush();
  void check_range(std::uint64_t address, std::size_t words) const;
  /// Initialises it if it wants that of its host. Throws Error if it is not ready then.
  void prepare_memory(std::uint32_t state);
  /// What is known of memory that answers by chance, is too small, or has lines of its address missing.
  void check_memory();

  std::uint64_t used_ = 0, clocks_ = 0;
  std::uint32_t clocks_low_ = 0, runs_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> writes_;  ///< registers, not yet sent
  bool idle_ = false;                                            ///< the core's registers do not change by themselves
  std::map<std::uint32_t, std::vector<std::uint32_t>> blocks_;   ///< registers read while idle
};

}  // namespace retrace::cosim
