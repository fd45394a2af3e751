// The simulated board with a host's serial adapter at its pins: bytes in and out, sent and sampled bit by bit, damaged on request.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "testbench/driver/serial_line.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/sim/board/board_model.hpp"

namespace retrace::cosim {

/// Loses, doubles or changes bytes.
class Damage {
 public:
  Damage(std::uint64_t seed, double percent) : random_(seed), percent_(percent) {}
  /// Appends what becomes of a byte.
  template <class Queue>
  void pass(std::uint8_t byte, Queue& to) {
    if (percent_ <= 0 || random_.real(0, 100) >= percent_) {
      to.push_back(byte);
      return;
    }
    ++damaged_;
    switch (random_.below(3)) {
      case 0:
        return;
      case 1:
        to.push_back(byte);
        to.push_back(byte);
        return;
      default:
        to.push_back(byte ^ static_cast<std::uint8_t>(1 + random_.below(255)));
    }
  }
  std::uint64_t damaged() const { return damaged_; }

 private:
  Random random_;
  double percent_;
  std::uint64_t damaged_ = 0;
};

class SimulatedBoard {
 public:
  struct Options {
    std::string configuration = "small";
    std::string waves;
    std::uint64_t seed = 1;
    double damage_to_board = 0, damage_from_board = 0;  ///< percent of the bytes
  };
  explicit SimulatedBoard(const Options& options);

  void send(std::uint8_t byte) { to_board_.pass(byte, waiting_); }
  /// Bytes that have left the board since the last call.
  std::vector<std::uint8_t> received();
  /// Clocks pass. Throws Error if an assertion of the RTL fails.
  void run(std::uint64_t clocks);
  /// Nothing moves: no byte on the line, the core is not busy.
  bool quiet() const {
    return waiting_.empty() && !sending_ && quiet_clocks_ > kQuiet && (model_->lamps() & kLampBusy) == 0;
  }
  /// Bytes that have not begun to travel to the board.
  std::size_t waiting() const { return waiting_.size(); }
  BoardModel& model() { return *model_; }
  std::uint64_t damaged() const { return to_board_.damaged() + from_board_.damaged(); }
  std::uint64_t framing_errors() const { return framing_errors_; }
  std::uint64_t bytes_in() const { return bytes_in_; }
  std::uint64_t bytes_out() const { return bytes_out_; }

 private:
  static constexpr std::uint64_t kQuiet =
      5000;  // clocks; more than the longest time between a frame and its answer's first byte, but for sums
  bool drive();
  void sample(bool level);

  std::unique_ptr<BoardModel> model_;
  unsigned bit_;
  Damage to_board_, from_board_;
  std::deque<std::uint8_t> waiting_;
  std::vector<std::uint8_t> received_;
  bool sending_ = false, level_ = true;
  unsigned shift_ = 0, bits_left_ = 0, bit_clock_ = 0;
  bool receiving_ = false;
  unsigned sample_clock_ = 0, sampled_ = 0, in_shift_ = 0;
  std::uint64_t quiet_clocks_ = 0, framing_errors_ = 0, bytes_in_ = 0, bytes_out_ = 0;
};

/// The board in this process as a line: seconds pass as the board's clock does, and only while somebody waits. A slow clock makes timeouts cheap.
class SimulatedLine final : public SerialLine {
 public:
  explicit SimulatedLine(SimulatedBoard& board, double clock_hz = 1e6) : board_(board), clock_hz_(clock_hz) {}
  void write(std::span<const std::uint8_t> bytes) override;
  std::vector<std::uint8_t> read(double seconds) override;
  double now() const override { return static_cast<double>(board_.model().clocks()) / clock_hz_; }
  const std::string& name() const override { return name_; }

 private:
  SimulatedBoard& board_;
  double clock_hz_;
  std::string name_ = "simulated board";
};

}  // namespace retrace::cosim
