// See link_protocol.hpp.
#include "testbench/driver/link_protocol.hpp"

#include <zlib.h>

namespace retrace::cosim::link {

std::uint32_t crc(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size()));
}

std::vector<std::uint8_t> frame(std::span<const std::uint8_t> body) {
  // Two flags at either end: one may be lost.
  std::vector<std::uint8_t> line{kFlag, kFlag};
  const auto put = [&](std::uint8_t byte) {
    if (byte == kFlag || byte == kEscape) {
      line.push_back(kEscape);
      byte ^= kEscapeFlip;
    }
    line.push_back(byte);
  };
  for (const std::uint8_t byte : body) put(byte);
  const std::uint32_t check = crc(body);
  for (int i = 0; i < 4; ++i) put(static_cast<std::uint8_t>(check >> (8 * i)));
  line.push_back(kFlag);
  line.push_back(kFlag);
  return line;
}

std::optional<FrameReader::Frame> FrameReader::take(std::uint8_t byte) {
  if (byte == kFlag) {
    if (bytes_.empty() && !escape_ && !spoilt_) return std::nullopt;
    Frame result;
    result.good = !escape_ && !spoilt_ && bytes_.size() > kCrcBytes;
    if (result.good) {
      const std::span<const std::uint8_t> body(bytes_.data(), bytes_.size() - kCrcBytes);
      result.good = crc(body) == get(bytes_, body.size(), 4);
      if (result.good) result.body.assign(body.begin(), body.end());
    }
    bytes_.clear();
    escape_ = spoilt_ = false;
    return result;
  }
  if (byte == kEscape && !escape_) {
    escape_ = true;
    return std::nullopt;
  }
  if (bytes_.size() >= most_)
    spoilt_ = true;
  else
    bytes_.push_back(escape_ ? byte ^ kEscapeFlip : byte);
  escape_ = false;
  return std::nullopt;
}

void Request::put(std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void Request::memory(Op code, std::uint64_t address, std::uint16_t words) {
  op(code);
  put(address, 5);
  put(words, 2);
}

void Request::reg_write(std::uint32_t offset, std::uint32_t value) {
  op(Op::kRegWrite);
  put(offset, 2);
  put(value, 4);
}

void Request::reg_read(std::uint32_t offset, std::uint16_t count) {
  op(Op::kRegRead);
  put(offset, 2);
  put(count, 2);
}

void Request::mem_write(std::uint64_t address, std::span<const std::uint64_t> words) {
  memory(Op::kMemWrite, address, static_cast<std::uint16_t>(words.size()));
  for (const std::uint64_t word : words) put(word, 8);
}

void Request::mem_fill(std::uint64_t address, std::uint16_t words, std::uint64_t pattern) {
  memory(Op::kMemFill, address, words);
  put(pattern, 8);
  walked_ += words;
}

}  // namespace retrace::cosim::link
