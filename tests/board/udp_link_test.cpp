// The UDP link against the board's side in software, in one process, with datagrams lost, doubled, reordered and damaged: memory, registers that count,
// sessions, and one clear error for each way it can fail. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "hls/include/contract.hpp"
#include "testbench/driver/udp_device.hpp"
#include "testbench/sim/board/link_server.hpp"
#include "tests/board/dram_registers.hpp"

namespace {

using namespace retrace;
using namespace retrace::cosim;

constexpr std::uint64_t kBase = 0x80000000;

/// Memory, and registers of which each write is counted.
class PlainBus final : public BoardBus {
 public:
  explicit PlainBus(std::uint64_t bytes) : memory(bytes / 8) {}
  bool read_register(std::uint32_t offset, std::uint32_t& value) override {
    if (controller && offset >= cosim::link::kMemoryControl) {
      value = controller->read(offset - cosim::link::kMemoryControl);
      return true;
    }
    value = writes[offset];
    return offset < 0x400;
  }
  bool write_register(std::uint32_t offset, std::uint32_t value) override {
    if (controller && offset >= cosim::link::kMemoryControl) {
      controller->write(offset - cosim::link::kMemoryControl, value);
      return true;
    }
    ++writes[offset];
    return offset < 0x400;
  }
  bool read_memory(std::uint64_t address, std::span<std::uint64_t> words) override {
    if (!inside(address, words.size())) return false;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = memory[(address - kBase) / 8 + i];
    return true;
  }
  bool write_memory(std::uint64_t address, std::span<const std::uint64_t> words) override {
    if (!inside(address, words.size())) return false;
    for (std::size_t i = 0; i < words.size(); ++i)
      if (!deaf) memory[(address - kBase) / 8 % wraps + i] = words[i];
    return true;
  }
  std::uint32_t memory_state() const override {
    if (!controller) return cosim::link::kMemoryReady;
    const DramFacts& ddr3 = facts("ddr3");
    const bool failed = controller->read(ddr3.init_error) != 0, done = controller->read(ddr3.init_done) != 0;
    return (failed ? cosim::link::kMemoryFailed
            : done ? cosim::link::kMemoryReady
                   : cosim::link::kMemoryNotInitialised) |
           static_cast<std::uint32_t>(&ddr3 - dram_facts().data() + 1) << 8;
  }
  bool interrupt() const override { return false; }
  std::uint32_t clocks() const override { return 1; }
  bool inside(std::uint64_t address, std::size_t words) const {
    return address % 8 == 0 && address >= kBase && (address - kBase) / 8 + words <= memory.size();
  }
  std::vector<std::uint64_t> memory;
  std::uint64_t wraps = ~std::uint64_t{0};
  bool deaf = false;
  std::map<std::uint32_t, std::uint32_t> writes;
  std::unique_ptr<DramRegisters> controller;
};

/// The way to the board and back. Seconds pass while somebody waits.
class NoisyLine final : public DatagramLine {
 public:
  NoisyLine(LinkServer& server, std::uint64_t seed, const NoiseOptions& noise)
      : server_(&server), to_board_(seed, noise), from_board_(seed + 1, noise) {}
  void send(std::span<const std::uint8_t> datagram) override {
    ++sent;
    if (sent == reset_at) server_->reset();
    if (silent || sent > most_sent) return;
    std::vector<std::vector<std::uint8_t>> arrived;
    to_board_.pass({datagram.begin(), datagram.end()}, arrived);
    for (const auto& each : arrived) {
      if (!record.empty() || recording) record.push_back(each);
      from_board_.pass(server_->answer(each), waiting_);
    }
    now_ += 1e-6;
  }
  std::optional<std::vector<std::uint8_t>> receive(double seconds) override {
    if (waiting_.empty()) {
      now_ += seconds;
      return std::nullopt;
    }
    now_ += 1e-4;
    auto first = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
    return first;
  }
  double now() const override { return now_; }
  const std::string& name() const override { return name_; }
  std::uint64_t sent = 0, most_sent = ~std::uint64_t{0}, reset_at = 0;
  bool silent = false, recording = false;
  std::vector<std::vector<std::uint8_t>> record;

 private:
  LinkServer* server_;
  Noise to_board_, from_board_;
  std::vector<std::vector<std::uint8_t>> waiting_;
  double now_ = 0;
  std::string name_ = "test";
};

LinkServer::Board board_of(const PlainBus& bus) {
  LinkServer::Board board;
  board.memory_base = kBase;
  board.memory_bytes = bus.memory.size() * 8;
  board.image_version = static_cast<std::uint8_t>(contract::kImageVersion);
  return board;
}

struct Link {
  explicit Link(std::uint64_t bytes = 1 << 21, const NoiseOptions& noise = {}, std::uint64_t seed = test_seed())
      : bus(bytes), server(bus, board_of(bus)), noise(noise), seed(seed) {}
  std::unique_ptr<UdpDevice> connect(std::uint64_t session = 7) {
    auto owned = std::make_unique<NoisyLine>(server, seed + session, noise);
    line = owned.get();
    LinkOptions options;
    options.seed = session;
    return std::make_unique<UdpDevice>(std::move(owned), options);
  }
  PlainBus bus;
  LinkServer server;
  NoiseOptions noise;
  std::uint64_t seed;
  NoisyLine* line = nullptr;
};

template <class Act>
void expect_error(const Act& act, const std::string& part) {
  try {
    act();
    FAIL() << "no error; expected: " << part;
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_EQ(text.rfind("udp link: test: ", 0), 0u) << text;
  }
}

class UdpLink : public testing::TestWithParam<NoiseOptions> {};

TEST_P(UdpLink, MemoryArrivesAndReturns) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Link link(1 << 21, GetParam());
  Random random(test_seed());
  const auto device = link.connect();
  std::vector<std::uint64_t> words(70001), read(words.size());
  for (auto& word : words) word = random.chance(3) ? 0 : random.bits();
  device->write_memory(kBase + 800, words);
  EXPECT_TRUE(std::equal(words.begin(), words.end(), link.bus.memory.begin() + 100));
  device->read_memory(kBase + 800, read);
  EXPECT_EQ(read, words);
  const auto& s = device->statistics();
  std::printf("%llu frames, %llu repeated, %llu timeouts\n", static_cast<unsigned long long>(s.frames),
              static_cast<unsigned long long>(s.repeated), static_cast<unsigned long long>(s.timeouts));
}

TEST_P(UdpLink, EachRegisterIsWrittenOnce) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Link link(1 << 21, GetParam());
  const auto device = link.connect();
  std::map<std::uint32_t, std::uint32_t> expected;
  Random random(test_seed());
  for (int i = 0; i < 400; ++i) {
    const auto offset = static_cast<std::uint32_t>(4 * random.below(32));
    device->write_register(offset, 1);
    ++expected[offset];
    if (random.chance(3)) {
      EXPECT_EQ(device->read_register(offset), expected[offset]);
    }
  }
  for (std::uint32_t offset = 0; offset < 128; offset += 4) EXPECT_EQ(device->read_register(offset), expected[offset]);
}

INSTANTIATE_TEST_SUITE_P(Noise, UdpLink,
                         testing::Values(NoiseOptions{}, NoiseOptions{5, 5, 5, 1}, NoiseOptions{0, 0, 40, 0},
                                         NoiseOptions{30, 0, 0, 0}, NoiseOptions{0, 50, 20, 0},
                                         NoiseOptions{10, 10, 10, 20}),
                         [](const auto& info) { return "N" + std::to_string(info.index); });

/// A board that has just been switched on: the host brings its DRAM up through the link, each command exactly once.
TEST(UdpMemory, IsInitialisedThroughTheLink) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  for (const NoiseOptions& noise : {NoiseOptions{}, NoiseOptions{5, 5, 5, 1}}) {
    Link link(1 << 21, noise);
    link.bus.controller =
        std::make_unique<DramRegisters>(facts("ddr3"), std::vector<Lane>{{1, 2, 5}, {3, 0, 3}}, test_seed());
    const auto device = link.connect();
    EXPECT_EQ(link.bus.controller->fault, "");
    EXPECT_EQ(link.bus.controller->slip(0), 1u);
    EXPECT_EQ(link.bus.controller->delay(0), 3u);
    EXPECT_EQ(link.bus.controller->slip(1), 3u);
    EXPECT_EQ(link.bus.controller->delay(1), 1u);
    EXPECT_EQ(link.bus.controller->modes.size(), 4u);
    const std::uint64_t rows = link.bus.controller->rows;
    EXPECT_NO_THROW(link.connect(8));
    EXPECT_EQ(link.bus.controller->rows, rows) << "it is initialised once";
  }
}
TEST(UdpMemory, LevellingWithoutAWindowIsAnError) {
  Link link;
  link.bus.controller =
      std::make_unique<DramRegisters>(facts("ddr3"), std::vector<Lane>{{1, 2, 5}, {9, 0, 3}}, test_seed());
  expect_error([&] { link.connect(); }, "read levelling finds no window for byte lane 1");
  expect_error([&] { link.connect(8); }, "memory does not answer: its initialisation has failed");
}

TEST(UdpSession, TwoHosts) {
  Link link;
  const auto first = link.connect(1);
  const auto second = link.connect(2);
  EXPECT_NO_THROW(second->read_register(0));
  expect_error([&] { first->read_register(0); }, "another session: the board was reset, or another program uses it");
  EXPECT_NO_THROW(second->read_register(0)) << "the one that came last goes on";
}

TEST(UdpSession, DatagramsThatComeLateDoNothing) {
  Link link;
  auto first = link.connect(1);
  link.line->recording = true;
  const std::vector<std::uint64_t> words(500, 3), others(500, 4);
  first->write_register(16, 1);
  first->write_memory(kBase, words);
  const auto late = link.line->record;
  const auto second = link.connect(2);
  second->write_memory(kBase, others);
  const auto before = link.server.carried_out();
  // Everything of the session before, its opening too.
  for (const auto& datagram : late) link.server.answer(datagram);
  std::vector<std::uint8_t> opening{cosim::link::kOrderedRequest, 9, 0, late.front()[3], late.front()[4], 1};
  const std::uint32_t check = cosim::link::crc(opening);
  for (int i = 0; i < 4; ++i) opening.push_back(static_cast<std::uint8_t>(check >> (8 * i)));
  link.server.answer(opening);
  EXPECT_EQ(link.server.carried_out(), before);
  EXPECT_EQ(link.bus.writes[16], 1u);
  EXPECT_EQ(link.bus.memory[0], 4u);
  EXPECT_EQ(link.bus.memory[499], 4u);
  EXPECT_NO_THROW(second->read_register(0));
}

TEST(UdpSession, BoardIsReset) {
  Link link;
  const auto device = link.connect();
  link.server.reset();
  expect_error([&] { device->read_register(0); }, "the board was reset, or another program uses it");
}

/// The trial of a large memory at the beginning of a session leaves what it holds.
TEST(UdpSession, WhatTheMemoryHoldsStays) {
  Link link;
  for (std::size_t i = 0; i < link.bus.memory.size(); ++i) link.bus.memory[i] = 3 * i + 1;
  link.connect();
  for (std::size_t i = 0; i < link.bus.memory.size(); ++i) ASSERT_EQ(link.bus.memory[i], 3 * i + 1);
}

TEST(UdpSession, ALongWriteGoesOnWhereItWasBrokenOff) {
  Link link(1 << 22);
  Random random(test_seed());
  std::vector<std::uint64_t> words(400000);
  for (auto& word : words) word = random.bits();
  auto device = link.connect(1);
  link.line->most_sent = link.line->sent + 2000;
  EXPECT_THROW(device->write_memory(kBase, words), Error);
  device = link.connect(2);
  const std::uint64_t before = device->statistics().bytes_out;
  device->write_memory(kBase, words);
  EXPECT_TRUE(std::equal(words.begin(), words.end(), link.bus.memory.begin()));
  EXPECT_LT(device->statistics().bytes_out - before, words.size() * 8 - 2 * 8 * 65535);
}

TEST(UdpErrors, NobodyAnswers) {
  Link link;
  auto line = std::make_unique<NoisyLine>(link.server, 1, NoiseOptions{});
  line->silent = true;
  expect_error([&] { UdpDevice(std::move(line), {}); }, "nothing answers");
}
TEST(UdpErrors, TheBoardGoesAway) {
  Link link;
  const auto device = link.connect();
  link.line->silent = true;
  expect_error([&] { device->read_register(0); }, "the board does not answer any more");
}
TEST(UdpErrors, WrongBoard) {
  const auto with = [&](const auto& change, const std::string& part) {
    PlainBus bus(1 << 21);
    LinkServer::Board board = board_of(bus);
    change(bus, board);
    LinkServer server(bus, board);
    expect_error([&] { UdpDevice(std::make_unique<NoisyLine>(server, 1, NoiseOptions{}), {}); }, part);
  };
  with([](PlainBus&, LinkServer::Board& b) { b.id = 0x12345678; }, "what answers is no Retrace board");
  with([](PlainBus&, LinkServer::Board& b) { b.version = 0xd3; },
       "the board speaks version 3 of the protocol, this program version 2");
  with([](PlainBus&, LinkServer::Board& b) { b.image_version = 9; }, "the board reads memory images of version 9");
  with([](PlainBus&, LinkServer::Board& b) { b.memory_base += 4; }, "description makes no sense");
  with([](PlainBus&, LinkServer::Board& b) { b.memory_state = cosim::link::kMemoryNotInitialised; },
       "memory has not been initialised");
  with([](PlainBus&, LinkServer::Board& b) { b.memory_state = cosim::link::kMemoryFailed; }, "memory does not answer");
  with([](PlainBus& bus, LinkServer::Board&) { bus.deaf = true; }, "memory does not answer: a word written at byte 0");
  with([](PlainBus& bus, LinkServer::Board&) { bus.wraps = 1 << 16; },
       "memory does not answer: a word written at byte");
  with([](PlainBus&, LinkServer::Board& b) { b.memory_bytes *= 2; }, "the bus answered with an error");
}
TEST(UdpErrors, AnImageLargerThanTheMemory) {
  Link link;
  const auto device = link.connect();
  expect_error([&] { device->allocate(3 << 20); }, "the board's memory of 2097152 bytes is too small");
}

/// A board that answers anything: an error at worst, no crash, no endless loop.
TEST(UdpErrors, HostileAnswers) {
  class Hostile final : public DatagramLine {
   public:
    Hostile(LinkServer& server, std::uint64_t seed) : server_(server), random_(seed) {}
    void send(std::span<const std::uint8_t> datagram) override { last_ = server_.answer(datagram); }
    std::optional<std::vector<std::uint8_t>> receive(double seconds) override {
      now_ += random_.chance(2) ? 1e-4 : seconds;
      auto bytes = last_;
      if (bytes.empty() || random_.chance(4)) return std::nullopt;
      for (std::uint64_t i = random_.below(3); i > 0; --i)
        bytes[5 + random_.below(std::min<std::size_t>(bytes.size() - 9, 12))] =
            static_cast<std::uint8_t>(random_.bits());
      if (random_.chance(8)) bytes.resize(random_.below(bytes.size()));
      if (bytes.size() >= 4) {
        const std::uint32_t check = cosim::link::crc(std::span(bytes).first(bytes.size() - 4));
        for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(check >> (8 * i));
      }
      return bytes;
    }
    double now() const override { return now_; }
    const std::string& name() const override { return name_; }

   private:
    LinkServer& server_;
    Random random_;
    std::vector<std::uint8_t> last_;
    double now_ = 0;
    std::string name_ = "test";
  };
  for (std::uint64_t i = 0; i < 200; ++i) {
    PlainBus bus(1 << 16);
    LinkServer server(bus, board_of(bus));
    try {
      UdpDevice device(std::make_unique<Hostile>(server, test_seed() + i), {});
      const std::vector<std::uint64_t> words(300, i);
      device.write_memory(kBase, words);
    } catch (const Error&) {
    }
  }
}

TEST(UdpAddress, IsHostAndPort) {
  EXPECT_EQ(parse_udp_address("10.0.0.1:2000").port, "2000");
  EXPECT_EQ(parse_udp_address("[::1]:7").host, "::1");
  for (const char* bad : {"", "host", ":1", "host:", "host:0", "host:65536", "host:1x", "::1:7", "host:-1"})
    EXPECT_THROW(parse_udp_address(bad), UsageError) << bad;
}

}  // namespace
