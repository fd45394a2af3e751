// See simulated_board.hpp.
#include "testbench/sim/board/simulated_board.hpp"

#include <utility>

#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr unsigned kFrameBits = 10;

}  // namespace

SimulatedBoard::SimulatedBoard(const Options& options)
    : model_(make_board_model(options.configuration, options.seed, options.waves)),
      bit_(board_clocks_per_bit()),
      to_board_(2 * options.seed + 1, options.damage_to_board),
      from_board_(2 * options.seed + 2, options.damage_from_board) {}

bool SimulatedBoard::drive() {
  if (!sending_) {
    if (waiting_.empty()) return true;
    shift_ = (1u << 9) | (static_cast<unsigned>(waiting_.front()) << 1);
    waiting_.pop_front();
    ++bytes_in_;
    bits_left_ = kFrameBits;
    bit_clock_ = 0;
    sending_ = true;
  }
  const bool level = (shift_ & 1) != 0;
  if (++bit_clock_ == bit_) {
    bit_clock_ = 0;
    shift_ >>= 1;
    if (--bits_left_ == 0) sending_ = false;
  }
  return level;
}

void SimulatedBoard::sample(bool level) {
  if (!receiving_) {
    if (level_ && !level) {
      receiving_ = true;
      sample_clock_ = sampled_ = in_shift_ = 0;
    }
    level_ = level;
    return;
  }
  level_ = level;
  ++sample_clock_;
  if (sample_clock_ != bit_ / 2 + sampled_ * bit_) return;
  in_shift_ |= static_cast<unsigned>(level) << sampled_;
  if (++sampled_ < kFrameBits) return;
  receiving_ = false;
  if ((in_shift_ & 1) != 0 || (in_shift_ >> 9 & 1) == 0) {
    ++framing_errors_;
    return;
  }
  ++bytes_out_;
  from_board_.pass(static_cast<std::uint8_t>(in_shift_ >> 1), received_);
}

void SimulatedBoard::run(std::uint64_t clocks) {
  for (std::uint64_t i = 0; i < clocks; ++i) {
    const bool to_board = drive();
    const bool from_board = model_->clock(to_board);
    sample(from_board);
    quiet_clocks_ = sending_ || receiving_ ? 0 : quiet_clocks_ + 1;
  }
  if (model_->failed())
    throw Error("simulated board: an assertion failed before clock " + std::to_string(model_->clocks()));
}

std::vector<std::uint8_t> SimulatedBoard::received() { return std::exchange(received_, {}); }

void SimulatedLine::write(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) board_.send(byte);
}

std::vector<std::uint8_t> SimulatedLine::read(double seconds) {
  constexpr std::uint64_t kSlice = 16;
  const double until = now() + seconds;
  do {
    board_.run(kSlice);
    if (auto bytes = board_.received(); !bytes.empty()) return bytes;
  } while (now() < until);
  return {};
}

}  // namespace retrace::cosim
