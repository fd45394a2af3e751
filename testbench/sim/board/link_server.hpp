// The board's side of the UDP link in software: what a board has to do with each datagram (docs/udp-link.md), over any registers and memory.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "testbench/driver/link_protocol.hpp"
#include "testbench/kit/random.hpp"

namespace retrace::cosim {

/// What is behind the link: the core's registers and the memory. False: the bus answers with an error.
class BoardBus {
 public:
  virtual ~BoardBus() = default;
  virtual bool read_register(std::uint32_t offset, std::uint32_t& value) = 0;
  virtual bool write_register(std::uint32_t offset, std::uint32_t value) = 0;
  virtual bool read_memory(std::uint64_t address, std::span<std::uint64_t> words) = 0;
  virtual bool write_memory(std::uint64_t address, std::span<const std::uint64_t> words) = 0;
  /// As of the register of the board; a board whose memory is not ready says so itself (Board::memory_state).
  virtual std::uint32_t memory_state() const { return link::kMemoryReady; }
  virtual bool interrupt() const = 0;
  virtual std::uint32_t clocks() const = 0;
};

class LinkServer {
 public:
  struct Board {
    std::uint32_t id = link::kBoardId, clock_hz = 60000000, memory_state = link::kMemoryReady;
    std::uint64_t memory_base = 0x80000000, memory_bytes = 0;
    std::uint8_t version = link::kOrderedRequest, image_version = 0;
    std::uint16_t most_frame = 1444;  ///< without check sequence
  };
  LinkServer(BoardBus& bus, const Board& board) : bus_(bus), board_(board) {}

  std::vector<std::uint8_t> answer(std::span<const std::uint8_t> datagram);
  /// To be called after clocks have passed: runs that have ended are counted.
  void look();
  /// As after a reset of the board.
  void reset();
  std::uint64_t carried_out() const { return carried_out_; }

 private:
  struct Outcome {
    link::Status status = link::Status::kOk;
    std::uint16_t position = 0;
    std::vector<std::uint8_t> data;
  };
  Outcome carry_out(std::span<const std::uint8_t> body);
  link::Status operate(std::span<const std::uint8_t> body, std::size_t& at, std::vector<std::uint8_t>& data);
  bool read(std::uint32_t offset, std::uint32_t& value);
  std::vector<std::uint8_t> packed(std::span<const std::uint8_t> body, const Outcome& outcome) const;

  BoardBus& bus_;
  Board board_;
  std::optional<std::uint16_t> session_, session_before_;
  std::uint16_t last_sequence_ = 0;
  std::uint32_t last_crc_ = 0;
  std::vector<std::uint8_t> last_answer_;
  bool irq_ = false;
  std::uint32_t runs_ = 0, frames_ = 0, damaged_ = 0, repeated_ = 0, refused_ = 0;
  std::uint64_t carried_out_ = 0;
};

/// What a network does to datagrams: some are lost, doubled, held back behind the next one, or changed in a byte. Percent of the datagrams.
struct NoiseOptions {
  double loss = 0, doubled = 0, reordered = 0, damaged = 0;
};
class Noise {
 public:
  Noise(std::uint64_t seed, const NoiseOptions& options) : random_(seed), options_(options) {}
  /// Appends what arrives now.
  void pass(std::vector<std::uint8_t> datagram, std::vector<std::vector<std::uint8_t>>& to);
  std::uint64_t hurt() const { return hurt_; }

 private:
  bool percent(double of) {
    const bool yes = of > 0 && random_.real(0, 100) < of;
    hurt_ += yes;
    return yes;
  }
  Random random_;
  NoiseOptions options_;
  std::optional<std::vector<std::uint8_t>> held_back_;
  std::uint64_t hurt_ = 0;
};

}  // namespace retrace::cosim
