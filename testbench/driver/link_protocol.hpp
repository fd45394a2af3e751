// Numbers and frames of the serial link, host's side. The board's side: rtl/board/rt_board_pkg.sv. Explained in docs/serial-link.md.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace retrace::cosim::link {

inline constexpr std::uint8_t kFlag = 0x7e, kEscape = 0x7d, kEscapeFlip = 0x20;
/// First byte of a frame: direction (0x80) and version of the protocol.
inline constexpr std::uint8_t kRequest = 0xd1, kResponse = 0x51, kRequestBit = 0x80;
/// The same where frames are datagrams: several are in flight, and they are carried out in the order of their sequence.
inline constexpr std::uint8_t kOrderedRequest = 0xd2, kOrderedResponse = 0x52;
inline constexpr std::size_t kRequestHeader = 5, kResponseHeader = 8, kCrcBytes = 4;

enum class Op : std::uint8_t { kOpen = 1, kRegWrite, kRegRead, kMemWrite, kMemRead, kMemFill, kMemCrc };
/// kOrder: of frames that are carried out in the order of their sequence only (docs/udp-link.md).
enum class Status : std::uint8_t { kOk, kDamaged, kVersion, kSession, kMalformed, kTooLong, kBus, kRegister, kOrder };
inline constexpr int kStatuses = 9;

/// Registers of the board itself.
inline constexpr std::uint16_t kBoardSpace = 0x8000;
enum BoardRegister : std::uint16_t {
  kBoardIdentity,  // kBoardId
  kBoardVersion,   // request byte (7:0), image version (15:8), most bytes of a frame without check sequence (31:16)
  kBoardMemoryLow,
  kBoardMemoryHigh,
  kBoardMemoryBytes,
  kBoardClockHz,
  kBoardIrq,
  kBoardRuns,    // runs that have ended since reset
  kBoardClocks,  // since reset
  kBoardFrames,
  kBoardDamagedFrames,
  kBoardLongFrames,
  kBoardRepeatedFrames,
  kBoardRefusedFrames,
  kBoardSpoiltBytes,
  kBoardMemoryState,  // one of kMemory...
  kBoardRegisters
};
/// Registers of the memory's controller (wb_ctrl of LiteDRAM), by their byte address behind this.
inline constexpr std::uint16_t kMemoryControl = 0x4000;
/// The board's memory: its state in bits 7:0, in bits 15:8 which of dram_facts() the host initialises, from 1; 0: none.
inline constexpr std::uint32_t kMemoryReady = 0, kMemoryNotInitialised = 1, kMemoryFailed = 2;
inline constexpr std::uint32_t kBoardId = 0x44524252;  // 'RBRD'

std::uint32_t crc(std::span<const std::uint8_t> bytes);
/// Flags, escapes and check sequence around the bytes of a frame.
std::vector<std::uint8_t> frame(std::span<const std::uint8_t> body);

/// Bytes in, frames out: the counterpart of rtl/board/rt_link_rx.sv. What is longer than `most` is bad.
class FrameReader {
 public:
  explicit FrameReader(std::size_t most) : most_(most) {}
  struct Frame {
    bool good = false;
    std::vector<std::uint8_t> body;  ///< without the check sequence; of a good frame
  };
  /// The frame that this byte ends, if it ends one.
  std::optional<Frame> take(std::uint8_t byte);

 private:
  std::size_t most_;
  std::vector<std::uint8_t> bytes_;
  bool escape_ = false, spoilt_ = false;
};

/// Bytes of a request's operations.
class Request {
 public:
  void open() { op(Op::kOpen); }
  void reg_write(std::uint32_t offset, std::uint32_t value);
  void reg_read(std::uint32_t offset, std::uint16_t count);
  void mem_write(std::uint64_t address, std::span<const std::uint64_t> words);
  void mem_read(std::uint64_t address, std::uint16_t words) { memory(Op::kMemRead, address, words); }
  void mem_fill(std::uint64_t address, std::uint16_t words, std::uint64_t pattern);
  void mem_crc(std::uint64_t address, std::uint16_t words) {
    memory(Op::kMemCrc, address, words);
    walked_ += words;
  }
  /// Words of memory that the board walks without carrying them over the line: fills and sums.
  std::size_t walked() const { return walked_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  static constexpr std::size_t kMemoryHeader = 8, kRegWriteBytes = 7;

 private:
  void op(Op code) { bytes_.push_back(static_cast<std::uint8_t>(code)); }
  void put(std::uint64_t value, int bytes);
  void memory(Op code, std::uint64_t address, std::uint16_t words);
  std::vector<std::uint8_t> bytes_;
  std::size_t walked_ = 0;
};

inline std::uint64_t get(std::span<const std::uint8_t> bytes, std::size_t at, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value |= std::uint64_t{bytes[at + static_cast<std::size_t>(i)]} << (8 * i);
  return value;
}

}  // namespace retrace::cosim::link
