// See link_server.hpp.
#include "testbench/sim/board/link_server.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace retrace::cosim {
namespace {

constexpr std::size_t kMostData = 1440;

void put(std::vector<std::uint8_t>& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

}  // namespace

void LinkServer::reset() {
  session_.reset();
  session_before_.reset();
  last_answer_.clear();
}

void LinkServer::look() {
  const bool irq = bus_.interrupt();
  if (irq && !irq_) ++runs_;
  irq_ = irq;
}

bool LinkServer::read(std::uint32_t offset, std::uint32_t& value) {
  if (offset < link::kBoardSpace) return bus_.read_register(offset, value);
  const std::array<std::uint32_t, link::kBoardRegisters> registers = {
      board_.id,
      static_cast<std::uint32_t>(board_.most_frame) << 16 | static_cast<std::uint32_t>(board_.image_version) << 8 |
          board_.version,
      static_cast<std::uint32_t>(board_.memory_base),
      static_cast<std::uint32_t>(board_.memory_base >> 32),
      static_cast<std::uint32_t>(board_.memory_bytes),
      board_.clock_hz,
      bus_.interrupt(),
      runs_,
      bus_.clocks(),
      frames_,
      damaged_,
      0,
      repeated_,
      refused_,
      0,
      board_.memory_state != link::kMemoryReady ? board_.memory_state : bus_.memory_state()};
  const std::uint32_t index = (offset - link::kBoardSpace) / 4;
  if (offset % 4 != 0 || index >= registers.size()) return false;
  value = registers[index];
  return true;
}

std::vector<std::uint8_t> LinkServer::packed(std::span<const std::uint8_t> body, const Outcome& outcome) const {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(board_.version & ~link::kRequestBit)};
  for (std::size_t i = 1; i < link::kRequestHeader; ++i) bytes.push_back(body.empty() ? std::uint8_t{0} : body[i]);
  bytes.push_back(static_cast<std::uint8_t>(outcome.status));
  put(bytes, outcome.position, 2);
  bytes.insert(bytes.end(), outcome.data.begin(), outcome.data.end());
  put(bytes, link::crc(bytes), 4);
  return bytes;
}

std::vector<std::uint8_t> LinkServer::answer(std::span<const std::uint8_t> datagram) {
  look();
  const bool whole = datagram.size() >= link::kRequestHeader + link::kCrcBytes &&
                     datagram.size() <= board_.most_frame + link::kCrcBytes;
  const auto body = whole ? datagram.first(datagram.size() - link::kCrcBytes) : std::span<const std::uint8_t>{};
  if (!whole || link::crc(body) != link::get(datagram, body.size(), 4)) {
    ++damaged_;
    return packed({}, {link::Status::kDamaged, 0, {}});
  }
  ++frames_;
  if (body[0] != board_.version) return packed(body, {link::Status::kVersion, 0, {}});
  const auto sequence = static_cast<std::uint16_t>(link::get(body, 1, 2)),
             session = static_cast<std::uint16_t>(link::get(body, 3, 2));
  const bool opens =
      body.size() > link::kRequestHeader && body[link::kRequestHeader] == static_cast<std::uint8_t>(link::Op::kOpen);
  // A session that has been closed is not opened again: that would be a datagram which comes late.
  if (session_ != session && (!opens || session_before_ == session)) {
    ++refused_;
    return packed(body, {link::Status::kSession, 0, {}});
  }
  const std::uint32_t crc = link::crc(body);
  if (session_ == session) {
    if (sequence == last_sequence_ && crc == last_crc_) {
      ++repeated_;
      return last_answer_;
    }
    if (sequence != static_cast<std::uint16_t>(last_sequence_ + 1)) {
      ++refused_;
      return packed(body, {link::Status::kOrder, last_sequence_, {}});
    }
  } else {
    session_before_ = session_;
    session_ = session;
    last_sequence_ = static_cast<std::uint16_t>(sequence - 1);
  }
  const Outcome outcome = carry_out(body);
  look();
  std::vector<std::uint8_t> answer = packed(body, outcome);
  if (outcome.status != link::Status::kOk) {
    ++refused_;
    return answer;  // does not count: what is behind it in the window is not carried out
  }
  ++carried_out_;
  last_sequence_ = sequence;
  last_crc_ = crc;
  last_answer_ = answer;
  return answer;
}

LinkServer::Outcome LinkServer::carry_out(std::span<const std::uint8_t> body) {
  Outcome outcome;
  std::size_t at = link::kRequestHeader;
  while (at < body.size()) {
    const std::size_t begin = at;
    outcome.status = operate(body, at, outcome.data);
    if (outcome.status == link::Status::kOk) continue;
    outcome.position = static_cast<std::uint16_t>(begin);
    return outcome;
  }
  outcome.position = static_cast<std::uint16_t>(at);
  return outcome;
}

link::Status LinkServer::operate(std::span<const std::uint8_t> body, std::size_t& at, std::vector<std::uint8_t>& data) {
  using link::Op;
  using link::Status;
  const auto has = [&](std::size_t bytes) { return body.size() - at >= bytes; };
  const auto op = static_cast<Op>(body[at]);
  switch (op) {
    case Op::kOpen:
      ++at;
      return Status::kOk;
    case Op::kRegWrite: {
      if (!has(7)) return Status::kMalformed;
      const auto offset = static_cast<std::uint32_t>(link::get(body, at + 1, 2));
      if (offset >= link::kBoardSpace ||
          !bus_.write_register(offset, static_cast<std::uint32_t>(link::get(body, at + 3, 4))))
        return Status::kRegister;
      at += 7;
      return Status::kOk;
    }
    case Op::kRegRead: {
      if (!has(5)) return Status::kMalformed;
      const auto offset = static_cast<std::uint32_t>(link::get(body, at + 1, 2)),
                 count = static_cast<std::uint32_t>(link::get(body, at + 3, 2));
      if (data.size() + 4 * std::size_t{count} > kMostData) return Status::kTooLong;
      for (std::uint32_t i = 0; i < count; ++i) {
        std::uint32_t value = 0;
        if (!read(offset + 4 * i, value)) return Status::kRegister;
        put(data, value, 4);
      }
      at += 5;
      return Status::kOk;
    }
    case Op::kMemWrite:
    case Op::kMemRead:
    case Op::kMemFill:
    case Op::kMemCrc:
      break;
    default:
      return Status::kMalformed;
  }
  if (!has(8)) return Status::kMalformed;
  const std::uint64_t address = link::get(body, at + 1, 5);
  const auto count = static_cast<std::size_t>(link::get(body, at + 6, 2));
  if (op == Op::kMemWrite) {
    if (!has(8 + 8 * count)) return Status::kMalformed;
    std::vector<std::uint64_t> words(count);
    for (std::size_t i = 0; i < count; ++i) words[i] = link::get(body, at + 8 + 8 * i, 8);
    if (!bus_.write_memory(address, words)) return Status::kBus;
    at += 8 + 8 * count;
    return Status::kOk;
  }
  if (op == Op::kMemRead) {
    if (data.size() + 8 * count > kMostData) return Status::kTooLong;
    std::vector<std::uint64_t> words(count);
    if (!bus_.read_memory(address, words)) return Status::kBus;
    for (const std::uint64_t word : words) put(data, word, 8);
    at += 8;
    return Status::kOk;
  }
  if (op == Op::kMemFill) {
    if (!has(16)) return Status::kMalformed;
    const std::vector<std::uint64_t> words(count, link::get(body, at + 8, 8));
    if (!bus_.write_memory(address, words)) return Status::kBus;
    at += 16;
    return Status::kOk;
  }
  std::vector<std::uint64_t> words(count);
  if (data.size() + 4 > kMostData) return Status::kTooLong;
  if (!bus_.read_memory(address, words)) return Status::kBus;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(8 * count);
  for (const std::uint64_t word : words) put(bytes, word, 8);
  put(data, link::crc(bytes), 4);
  at += 8;
  return Status::kOk;
}

void Noise::pass(std::vector<std::uint8_t> datagram, std::vector<std::vector<std::uint8_t>>& to) {
  if (percent(options_.damaged) && !datagram.empty())
    datagram[random_.below(datagram.size())] ^= static_cast<std::uint8_t>(1 + random_.below(255));
  const bool doubled = percent(options_.doubled);
  if (percent(options_.reordered) && !held_back_) {
    held_back_ = std::move(datagram);
    return;
  }
  if (!percent(options_.loss)) {
    to.push_back(datagram);
    if (doubled) to.push_back(std::move(datagram));
  }
  if (held_back_) {
    to.push_back(std::move(*held_back_));
    held_back_.reset();
  }
}

}  // namespace retrace::cosim
