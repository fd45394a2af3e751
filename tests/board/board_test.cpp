// The whole board in Verilator, bit by bit over its serial pins: the link's rules (a damaged frame changes nothing, a repeated one is carried out
// once, whatever arrives is survived), and the engine `serial` against the kernel in every byte, also over a line that damages bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "rtl/shell/rt_regs.h"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/driver/board_engine.hpp"
#include "testbench/driver/serial_device.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/sim/board/simulated_board.hpp"

namespace {

using namespace retrace;
using cosim::SimulatedBoard;
using cosim::SimulatedLine;
using cosim::link::BoardRegister;
using cosim::link::FrameReader;
using cosim::link::Op;
using cosim::link::Request;
using cosim::link::Status;
namespace link = cosim::link;

constexpr std::uint16_t board_register(BoardRegister index) {
  return static_cast<std::uint16_t>(link::kBoardSpace + 4 * index);
}

// ------------------------------------------------------------------------------------------------ the link's rules

/// A host that sends what it is told and notes what comes back.
struct BoardLink : testing::Test {
  BoardLink() : seed(test_seed()), random(seed), board({.seed = seed}) {}
  void TearDown() override {
    EXPECT_FALSE(board.model().failed());
    if (HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  }

  struct Answer {
    bool any = false;
    Status status = Status::kOk;
    std::uint16_t sequence = 0, session = 0, position = 0;
    std::vector<std::uint8_t> data;
    std::uint32_t word(std::size_t at = 0) const { return static_cast<std::uint32_t>(link::get(data, 4 * at, 4)); }
    std::uint64_t word64(std::size_t at = 0) const { return link::get(data, 8 * at, 8); }
  };

  std::vector<std::uint8_t> body(const std::vector<std::uint8_t>& operations) {
    std::vector<std::uint8_t> bytes{link::kRequest, static_cast<std::uint8_t>(sequence),
                                    static_cast<std::uint8_t>(sequence >> 8), static_cast<std::uint8_t>(session),
                                    static_cast<std::uint8_t>(session >> 8)};
    bytes.insert(bytes.end(), operations.begin(), operations.end());
    return bytes;
  }

  /// Sends bytes as they are; answers of the board until it has been silent for a while.
  std::vector<Answer> talk(const std::vector<std::uint8_t>& line, std::uint64_t silence = 4000) {
    for (const std::uint8_t byte : line) board.send(byte);
    std::vector<Answer> answers;
    FrameReader reader(70000);
    for (std::uint64_t quiet = 0; quiet < silence;) {
      board.run(64);
      quiet = board.waiting() > 0 ? 0 : quiet + 64;
      for (const std::uint8_t byte : board.received()) {
        quiet = 0;
        const auto frame = reader.take(byte);
        if (!frame) continue;
        EXPECT_TRUE(frame->good) << "the board sends damaged frames";
        if (!frame->good || frame->body.size() < link::kResponseHeader) continue;
        const auto& b = frame->body;
        EXPECT_EQ(b[0], link::kResponse);
        answers.push_back({true,
                           static_cast<Status>(b[5]),
                           static_cast<std::uint16_t>(link::get(b, 1, 2)),
                           static_cast<std::uint16_t>(link::get(b, 3, 2)),
                           static_cast<std::uint16_t>(link::get(b, 6, 2)),
                           {b.begin() + link::kResponseHeader, b.end()}});
      }
    }
    return answers;
  }
  Answer ask_bytes(const std::vector<std::uint8_t>& operations, std::uint64_t silence = 4000) {
    ++sequence;
    const auto answers = talk(link::frame(body(operations)), silence);
    if (answers.size() != 1) {
      ADD_FAILURE() << answers.size() << " answers";
      return {};
    }
    EXPECT_EQ(answers[0].sequence, sequence);
    EXPECT_EQ(answers[0].session, session);
    return answers[0];
  }
  Answer ask(const Request& request) { return ask_bytes(request.bytes()); }
  void open() {
    Request request;
    request.open();
    request.reg_read(board_register(link::kBoardMemoryLow), 3);
    const Answer answer = ask(request);
    ASSERT_EQ(answer.status, Status::kOk);
    base = answer.word(0) | std::uint64_t{answer.word(1)} << 32;
    bytes = answer.word(2);
  }
  std::uint64_t read(std::uint64_t address) {
    Request request;
    request.mem_read(address, 1);
    const Answer answer = ask(request);
    EXPECT_EQ(answer.status, Status::kOk);
    return answer.data.size() == 8 ? answer.word64() : 0;
  }
  std::uint32_t board_word(BoardRegister index) {
    Request request;
    request.reg_read(board_register(index), 1);
    return ask(request).word();
  }

  std::uint64_t seed;
  Random random;
  SimulatedBoard board;
  std::uint16_t sequence = 65533, session = 0x7e7d;  // bytes that are escaped
  std::uint64_t base = 0, bytes = 0;
};

TEST_F(BoardLink, SaysWhatItIs) {
  Request request;
  request.open();
  request.reg_read(board_register(link::kBoardIdentity), link::kBoardRegisters);
  request.reg_read(0, 2);
  const Answer answer = ask(request);
  ASSERT_EQ(answer.status, Status::kOk);
  ASSERT_EQ(answer.data.size(), 4u * (link::kBoardRegisters + 2));
  EXPECT_EQ(answer.word(link::kBoardIdentity), link::kBoardId);
  EXPECT_EQ(answer.word(link::kBoardVersion) & 0xff, link::kRequest);
  EXPECT_EQ(answer.word(link::kBoardVersion) >> 8 & 0xff, static_cast<std::uint32_t>(contract::kImageVersion));
  EXPECT_EQ(answer.word(link::kBoardClockHz), 80000000u);
  EXPECT_EQ(answer.word(link::kBoardRegisters), RT_REGS__ID__VALUE_reset);
}

TEST_F(BoardLink, MemoryReadsWritesFillsAndSums) {
  open();
  std::vector<std::uint64_t> words(20);
  for (auto& word : words) word = random.chance(3) ? 0x7e7d7e7d7d7e7d7eull : random.bits();
  Request request;
  request.mem_write(base + 64, words);
  request.mem_fill(base + 64 + 8 * 20, 5, 0x0123456789abcdefull);
  request.mem_read(base + 64, 25);
  request.mem_crc(base + 64, 25);
  request.mem_crc(base, 0);
  const Answer answer = ask(request);
  ASSERT_EQ(answer.status, Status::kOk);
  ASSERT_EQ(answer.data.size(), 8u * 25 + 4 + 4);
  words.insert(words.end(), 5, 0x0123456789abcdefull);
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_EQ(answer.word64(i), words[i]) << i;
  EXPECT_EQ(answer.word(50), link::crc({answer.data.data(), 200}));
  EXPECT_EQ(answer.word(51), link::crc({}));
  EXPECT_EQ(answer.position, link::kRequestHeader + request.bytes().size());
}

TEST_F(BoardLink, NothingHappensWithoutASession) {
  open();
  Request fill;
  fill.mem_fill(base, 1, 5);
  EXPECT_EQ(ask(fill).status, Status::kOk);
  ++session;
  Request other;
  other.mem_fill(base, 1, 6);
  EXPECT_EQ(ask(other).status, Status::kSession);
  --session;
  EXPECT_EQ(read(base), 5u);
  board.model().reset();
  EXPECT_EQ(ask(other).status, Status::kSession) << "after a reset";
}

TEST_F(BoardLink, ARepeatedFrameIsCarriedOutOnce) {
  open();
  // A run over an image that is not there ends with a fault, and counts.
  Request start;
  start.reg_write(offsetof(rt_regs_t, image_lines), 2);
  start.reg_write(offsetof(rt_regs_t, control), RT_REGS__CONTROL__START_bm | RT_REGS__CONTROL__IRQ_ENABLE_bm);
  ++sequence;
  const auto line = link::frame(body(start.bytes()));
  for (int i = 0; i < 4; ++i) {
    const auto answers = talk(line);
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(answers[0].status, Status::kOk);
    EXPECT_EQ(answers[0].sequence, sequence);
  }
  EXPECT_EQ(board_word(link::kBoardRuns), 1u);
  EXPECT_EQ(board_word(link::kBoardRepeatedFrames), 3u);
  // Damaged frames in between do not make the board forget; they were answered with what is kept apart.
  ++sequence;
  const auto again = link::frame(body(start.bytes()));
  talk(again);
  auto damaged = again;
  damaged[8] ^= 1;
  const auto answers = talk(damaged);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].status, Status::kDamaged);
  EXPECT_EQ(talk(again).size(), 1u);
  EXPECT_EQ(board_word(link::kBoardRuns), 2u);
  // The same numbers with other contents are another frame.
  --sequence;
  Request fill;
  fill.mem_fill(base, 1, 77);
  EXPECT_EQ(ask(fill).status, Status::kOk);
  EXPECT_EQ(read(base), 77u);
}

// The answer to a frame is lost; before the host repeats the frame, something arrives that is not the host's.
TEST_F(BoardLink, AFrameThatIsNotCarriedOutIsNotRemembered) {
  open();
  Request count;
  count.reg_read(board_register(link::kBoardClocks), 1);
  Request fill;
  fill.mem_fill(base, 1, 9);
  const auto other_session = [&](const std::vector<std::uint8_t>& operations) {
    auto bytes_of = body(operations);
    bytes_of[3] ^= 1;
    return bytes_of;
  };
  auto other_version = body(fill.bytes());
  other_version[0] ^= 1;
  const std::vector<std::pair<std::vector<std::uint8_t>, Status>> strangers{
      {other_session(fill.bytes()), Status::kSession},
      {other_session({}), Status::kSession},
      {other_session({0xff}), Status::kSession},
      {other_version, Status::kVersion},
  };
  for (std::size_t i = 0; i < strangers.size(); ++i) {
    ++sequence;
    const auto line = link::frame(body(count.bytes()));
    const auto first = talk(line);
    ASSERT_EQ(first.size(), 1u);
    const auto refused = talk(link::frame(strangers[i].first));
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_EQ(refused[0].status, strangers[i].second) << "stranger " << i;
    EXPECT_EQ(refused[0].position, link::kRequestHeader);
    EXPECT_EQ(refused[0].sequence, link::get(strangers[i].first, 1, 2));
    EXPECT_EQ(refused[0].session, link::get(strangers[i].first, 3, 2));
    EXPECT_TRUE(refused[0].data.empty());
    const auto again = talk(line);
    ASSERT_EQ(again.size(), 1u);
    EXPECT_EQ(again[0].status, Status::kOk);
    EXPECT_EQ(again[0].data, first[0].data) << "carried out twice behind stranger " << i;
  }
  EXPECT_EQ(board_word(link::kBoardRepeatedFrames), strangers.size());
  EXPECT_EQ(board_word(link::kBoardRefusedFrames), strangers.size());
}

TEST_F(BoardLink, ARepetitionSendsTheSameAnswer) {
  open();
  Request request;
  request.reg_read(board_register(link::kBoardClocks), 1);
  ++sequence;
  const auto line = link::frame(body(request.bytes()));
  const auto first = talk(line), second = talk(line);
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(first[0].data, second[0].data) << "the clock was read again";
}

TEST_F(BoardLink, EveryDamageOfAByteIsNoticed) {
  open();
  std::uint64_t value = 1;
  int refused = 0, harmless = 0;
  for (int kind = 0; kind < 4; ++kind) {
    for (std::size_t at = 0;; ++at) {
      Request request;
      request.mem_fill(base, 1, ++value);
      ++sequence;
      auto line = link::frame(body(request.bytes()));
      if (at >= line.size()) break;
      const auto place = line.begin() + static_cast<std::ptrdiff_t>(at);
      if (kind == 0) line.erase(place);
      if (kind == 1) line.insert(place, *place);
      if (kind == 2) *place ^= static_cast<std::uint8_t>(1u << random.below(8));
      if (kind == 3) *place = random.chance(2) ? link::kFlag : link::kEscape;
      const auto answers = talk(line, 2000);
      const bool done = std::any_of(answers.begin(), answers.end(),
                                    [&](const Answer& a) { return a.status == Status::kOk && a.sequence == sequence; });
      EXPECT_LE(answers.size(), 1u);
      const std::uint64_t now = read(base);
      if (done) {
        EXPECT_EQ(now, value) << "kind " << kind << " at byte " << at;
        ++harmless;  // a flag more or less, or a byte that was replaced by itself
      } else {
        EXPECT_EQ(now, value - 1) << "kind " << kind << " at byte " << at;
        ++refused;
      }
      value = now;
    }
  }
  EXPECT_GT(refused, 60);
  EXPECT_LT(harmless, 20);
}

TEST_F(BoardLink, RefusesWhatCannotBeDone) {
  open();
  const auto refused = [&](const std::vector<std::uint8_t>& operations, Status status, std::size_t position) {
    const Answer answer = ask_bytes(operations, 10000);  // reads of an answer that gets too long
    EXPECT_EQ(answer.status, status);
    EXPECT_EQ(answer.position, link::kRequestHeader + position);
    return answer;
  };
  Request good;
  good.mem_fill(base, 1, 1);
  const std::size_t behind = good.bytes().size();
  const auto after = [&](Request bad) {
    std::vector<std::uint8_t> all = good.bytes();
    all.insert(all.end(), bad.bytes().begin(), bad.bytes().end());
    return all;
  };
  refused({0}, Status::kMalformed, 0);
  refused({8}, Status::kMalformed, 0);
  refused({0xff}, Status::kMalformed, 0);
  Request r;
  r.mem_read(base, 300);
  refused(after(r), Status::kTooLong, behind);
  r = {};
  r.mem_read(base + bytes, 1);
  refused(after(r), Status::kBus, behind);
  r = {};
  r.mem_fill(base - 8, 1, 3);
  refused(after(r), Status::kBus, behind);
  r = {};
  r.mem_crc(base + bytes - 8, 2);
  refused(after(r), Status::kBus, behind);
  r = {};
  r.reg_read(512, 1);
  refused(after(r), Status::kRegister, behind);
  r = {};
  r.reg_read(2, 1);
  refused(after(r), Status::kRegister, behind);
  r = {};
  r.reg_write(link::kBoardSpace, 1);
  refused(after(r), Status::kRegister, behind);
  r = {};
  r.reg_read(board_register(link::kBoardMemoryState), 2);
  EXPECT_EQ(refused(after(r), Status::kRegister, behind).data.size(), 4u);
  // Cut off after every byte of its arguments and data.
  r = {};
  const std::vector<std::uint64_t> words{1, 2};
  r.mem_write(base + 800, words);
  for (std::size_t cut = 1; cut < r.bytes().size(); ++cut)
    refused({r.bytes().begin(), r.bytes().begin() + static_cast<std::ptrdiff_t>(cut)}, Status::kMalformed, 0);
  EXPECT_EQ(board_word(link::kBoardRefusedFrames), 11u + 8 + 16 - 1);
  EXPECT_EQ(read(base), 1u);
}

TEST_F(BoardLink, AnotherVersionIsToldSo) {
  auto bytes_of = body({});
  for (const int first : {0xd2, 0xd0, 0x51, 0x00}) {
    bytes_of[0] = static_cast<std::uint8_t>(first);
    const auto answers = talk(link::frame(bytes_of));
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(answers[0].status, Status::kVersion);
  }
}

TEST_F(BoardLink, FramesThatAreTooLongOrTooShort) {
  open();
  for (const std::size_t size : {1u, 4u, 8u, 2044u, 2045u, 5000u}) {
    std::vector<std::uint8_t> operations(size, 0x01);  // opens, as many as fit
    ++sequence;
    auto bytes_of = body(operations);
    bytes_of.resize(std::max<std::size_t>(size, 1));
    const auto answers = talk(link::frame(bytes_of), 20000);
    ASSERT_EQ(answers.size(), 1u) << size;
    const bool fits = size >= link::kRequestHeader && size + link::kCrcBytes <= 2048;
    EXPECT_EQ(answers[0].status, fits ? Status::kOk : Status::kDamaged) << size;
  }
  EXPECT_EQ(board_word(link::kBoardLongFrames), 2u);
}

TEST_F(BoardLink, GarbageIsSurvived) {
  open();
  for (int round = 0; round < 30; ++round) {
    std::vector<std::uint8_t> noise(random.below(200));
    for (auto& byte : noise)
      byte = random.chance(8)   ? link::kFlag
             : random.chance(8) ? link::kEscape
                                : static_cast<std::uint8_t>(random.below(256));
    noise.push_back(link::kFlag);  // otherwise the frame behind it is part of the noise, and the host repeats it
    for (const Answer& answer : talk(noise, 1500)) EXPECT_EQ(answer.status, Status::kDamaged);
    // Whole frames of nonsense: whatever they say, the board answers and goes on.
    std::vector<std::uint8_t> operations(random.below(60));
    for (auto& byte : operations)
      byte = static_cast<std::uint8_t>(random.chance(2) ? random.below(9) : random.below(256));
    ask_bytes(operations);
  }
  open();
  Request fill;
  fill.mem_fill(base + 8, 1, 4711);
  EXPECT_EQ(ask(fill).status, Status::kOk);
  EXPECT_EQ(read(base + 8), 4711u);
}

TEST_F(BoardLink, WhatArrivesDuringAnAnswerIsDropped) {
  open();
  Request long_answer;
  long_answer.mem_read(base, 200);
  Request fill;
  fill.mem_fill(base, 1, 12);
  ++sequence;
  auto line = link::frame(body(long_answer.bytes()));
  ++sequence;
  const auto second = link::frame(body(fill.bytes()));
  line.insert(line.end(), second.begin(), second.end());
  const auto answers = talk(line);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].data.size(), 1600u);
  EXPECT_EQ(ask(fill).status, Status::kOk) << "the next one is heard";
}

// ------------------------------------------------------------------------------------------------ the engine

struct Prepared : TracedScene {
  std::vector<GridRay> rays;
};

const Prepared& prepared(const std::string& name) {
  static std::map<std::string, Prepared> cache;
  auto [it, is_new] = cache.try_emplace(name);
  Prepared& p = it->second;
  if (!is_new) return p;
  static_cast<TracedScene&>(p) = prepare_scene(open_scene(name));
  Random random(test_seed());
  p.rays = make_test_rays(p.grid, p.image, 700, random);
  return p;
}

struct Case {
  const char* scene;
  std::size_t rays, batch;
  double damage;
  WayUp way_up;
  bool mailbox;
  std::uint64_t seed;
};

class SerialFrame : public testing::TestWithParam<Case> {};

TEST_P(SerialFrame, EqualsKernelInEveryByte) {
  const Case& c = GetParam();
  const std::uint64_t seed = test_seed() + c.seed;
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(test_seed()));
  const Prepared& p = prepared(c.scene);
  const std::span<const GridRay> rays(p.rays.data(), std::min(c.rays, p.rays.size()));
  SimulatedBoard board({.seed = seed, .damage_to_board = c.damage, .damage_from_board = c.damage});
  BoardOptions options;
  options.link.seed = seed + 1;
  options.most_rays = c.batch;
  auto engine = make_serial_engine(p.image, std::make_unique<SimulatedLine>(board), options);
  TraceOptions trace;
  trace.way_up = c.way_up;
  trace.mailbox = c.mailbox ? kCsimMailbox : 0;
  std::vector<Hit> hits(rays.size()), expected_hits(rays.size());
  engine->trace(rays, hits, {}, trace);
  auto csim = make_csim_engine(p.image);
  csim->trace(rays, expected_hits, {}, trace);
  const auto raw = engine->raw_hits(), expected = csim->raw_hits();
  ASSERT_EQ(raw.size(), expected.size());
  for (std::size_t i = 0; i < raw.size(); ++i) ASSERT_EQ(raw[i], expected[i]) << "ray " << i / 2;
  EXPECT_EQ(engine->link().repeated > 0, c.damage > 0);
  EXPECT_EQ(board.damaged() > 0, c.damage > 0);
  const std::size_t inside =
      static_cast<std::size_t>(std::count_if(rays.begin(), rays.end(), [](const GridRay& r) { return !r.outside; }));
  EXPECT_EQ(engine->runs(), (inside + engine->most_rays() - 1) / engine->most_rays());
  EXPECT_FALSE(board.model().failed());
}

INSTANTIATE_TEST_SUITE_P(Boards, SerialFrame,
                         testing::Values(Case{"box", 150, 60, 0, WayUp::kFaceLinks, false, 0},
                                         Case{"box", 80, 1000, 0, WayUp::kParentLinks, true, 1},
                                         Case{"box", 60, 1000, 1, WayUp::kFaceLinks, true, 2},
                                         Case{"one", 100, 40, 1, WayUp::kFaceLinks, false, 3},
                                         Case{"one", 20, 1000, 4, WayUp::kFaceLinks, false, 4}));

TEST(SerialEngine, AnImageThatIsTooLargeIsOneClearError) {
  const Prepared& p = prepared("coincident");
  SimulatedBoard board({});
  try {
    make_serial_engine(p.image, std::make_unique<SimulatedLine>(board), {});
    FAIL() << "an image of " << p.image.bytes() << " bytes was taken";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(std::to_string(p.image.bytes())), std::string::npos) << text;
    EXPECT_NE(text.find("32768"), std::string::npos) << text;
  }
}

/// Time passes, and an answer of the test's choice arrives for every frame.
class FakeLine final : public cosim::SerialLine {
 public:
  explicit FakeLine(std::vector<std::uint8_t> answer, bool echo = false) : answer_(std::move(answer)), echo_(echo) {}
  void write(std::span<const std::uint8_t> bytes) override {
    if (echo_) waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
    waiting_.insert(waiting_.end(), answer_.begin(), answer_.end());
  }
  std::vector<std::uint8_t> read(double seconds) override {
    now_ += waiting_.empty() ? seconds : 1e-4;
    return std::exchange(waiting_, {});
  }
  double now() const override { return now_; }
  const std::string& name() const override { return name_; }

 private:
  std::vector<std::uint8_t> answer_, waiting_;
  bool echo_;
  double now_ = 0;
  std::string name_ = "fake";
};

std::string error_of(std::unique_ptr<cosim::SerialLine> line) {
  try {
    cosim::SerialDevice device(std::move(line), {});
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SerialDevice, LinesWithoutABoardAreErrors) {
  EXPECT_EQ(error_of(std::make_unique<FakeLine>(std::vector<std::uint8_t>{})), "serial link: fake: nothing answers");
  const std::vector<std::uint8_t> noise{'l', 'o', 'g', 'i', 'n', ':', ' ', link::kFlag};
  EXPECT_NE(error_of(std::make_unique<FakeLine>(noise)).find("no whole answer in 200 tries"), std::string::npos);
  EXPECT_NE(error_of(std::make_unique<FakeLine>(std::vector<std::uint8_t>{}, true)).find("fake: "), std::string::npos);
  std::vector<std::uint8_t> other(link::kResponseHeader, 0);
  other[0] = 0x52;
  EXPECT_NE(error_of(std::make_unique<FakeLine>(link::frame(other)))
                .find("version 2 of the protocol, this program version 1"),
            std::string::npos);
}

/// A board that answers what it is asked at the speed of a line, and needs time of its own for sums; it can lose a frame.
class BusyLine final : public cosim::SerialLine {
 public:
  static constexpr double kByte = 10.0 / 3e6, kWord = 20.0 / 48e6;
  explicit BusyLine(std::vector<std::uint64_t>& memory) : memory_(memory) {}
  void write(std::span<const std::uint8_t> bytes) override {
    FrameReader reader(70000);
    for (const std::uint8_t byte : bytes) {
      const auto frame = reader.take(byte);
      if (!frame || !frame->good) continue;
      if (std::exchange(lose, false)) return;
      const auto& request = frame->body;
      std::vector<std::uint8_t> answer{link::kResponse, request[1], request[2], request[3], request[4], 0, 0, 0};
      const auto put = [&](std::uint64_t value, int count) {
        for (int i = 0; i < count; ++i) answer.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
      };
      std::size_t at = link::kRequestHeader, words = 0;
      while (at < request.size()) {
        const auto op = static_cast<Op>(request[at++]);
        if (op == Op::kOpen) continue;
        if (op == Op::kRegRead) {
          const std::uint64_t first = link::get(request, at, 2), count = link::get(request, at + 2, 2);
          at += 4;
          for (std::uint64_t i = 0; i < count; ++i) put(register_of((first - link::kBoardSpace) / 4 + i), 4);
          continue;
        }
        const std::uint64_t address = link::get(request, at, 5) / 8, count = link::get(request, at + 5, 2);
        at += 7;
        if (op == Op::kMemFill) {
          std::fill_n(&memory_[address], count, link::get(request, at, 8));
          at += 8;
          words += count;
        } else if (op == Op::kMemWrite) {
          for (std::uint64_t i = 0; i < count; ++i, at += 8) memory_[address + i] = link::get(request, at, 8);
        } else {
          std::vector<std::uint8_t> walked;
          for (std::uint64_t i = 0; i < count; ++i)
            for (int k = 0; k < 8; ++k) walked.push_back(static_cast<std::uint8_t>(memory_[address + i] >> (8 * k)));
          put(link::crc(walked), 4);
          words += count;
        }
      }
      waiting_ = link::frame(answer);
      ready_ = now_ + kByte * static_cast<double>(bytes.size() + waiting_.size()) + kWord * static_cast<double>(words);
    }
  }
  std::vector<std::uint8_t> read(double seconds) override {
    if (waiting_.empty() || ready_ > now_ + seconds) {
      now_ += seconds;
      return {};
    }
    now_ = std::max(now_, ready_);
    return std::exchange(waiting_, {});
  }
  double now() const override { return now_; }
  const std::string& name() const override { return name_; }

  bool lose = false;

 private:
  std::uint32_t register_of(std::uint64_t index) const {
    switch (index) {
      case link::kBoardIdentity:
        return link::kBoardId;
      case link::kBoardVersion:
        return static_cast<std::uint32_t>(contract::kImageVersion) << 8 | 4096u << 16;
      case link::kBoardMemoryBytes:
        return static_cast<std::uint32_t>(8 * memory_.size());
      case link::kBoardClockHz:
        return 48000000;
      default:
        return 0;
    }
  }
  std::vector<std::uint64_t>& memory_;
  std::vector<std::uint8_t> waiting_;
  double now_ = 0, ready_ = 0;
  std::string name_ = "busy";
};

TEST(SerialDevice, WhatTheBoardWorksIsNotTheLinesSpeed) {
  std::vector<std::uint64_t> memory(100000);
  auto line = std::make_unique<BusyLine>(memory);
  BusyLine& busy = *line;
  cosim::SerialDevice device(std::move(line), {});
  // A fill and a sum of 65,000 words each, 27 ms of work behind 60 bytes; then a frame gets lost.
  const std::vector<std::uint64_t> words(65000, 7);
  device.write_memory(device.allocate(8 * words.size()), words);
  EXPECT_EQ(memory[64999], 7u);
  EXPECT_EQ(device.statistics().timeouts, 0u) << "the work was not waited for";
  busy.lose = true;
  const double start = busy.now();
  std::vector<std::uint64_t> some(400);
  for (std::size_t i = 0; i < some.size(); ++i) some[i] = i;
  device.write_memory(0, some);
  EXPECT_EQ(device.statistics().timeouts, 1u);
  EXPECT_LT(busy.now() - start, 0.2) << "the line is believed to be as slow as the board's work";
}

/// A board that frames its answers well and says whatever it likes.
class HostileLine final : public cosim::SerialLine {
 public:
  explicit HostileLine(std::uint64_t seed) : random_(seed) {}
  void write(std::span<const std::uint8_t> bytes) override {
    FrameReader reader(70000);
    for (const std::uint8_t byte : bytes) {
      const auto frame = reader.take(byte);
      if (!frame || !frame->good) continue;
      const auto& request = frame->body;
      const bool first = request.size() > link::kRequestHeader && request[5] == static_cast<std::uint8_t>(Op::kOpen);
      std::vector<std::uint8_t> answer{link::kResponse, request[1], request[2], request[3], request[4], 0, 0, 0};
      if (!first && random_.chance(10)) answer[5] = static_cast<std::uint8_t>(random_.below(12));
      std::size_t want = 4;
      if (!first && request.size() > 9 && request[5] == static_cast<std::uint8_t>(Op::kRegRead))
        want = 4 * link::get(request, 8, 2);
      if (!first && request.size() > 12 && request[5] == static_cast<std::uint8_t>(Op::kMemRead))
        want = 8 * link::get(request, 11, 2);
      if (random_.chance(20)) want = random_.below(5000);
      for (std::size_t i = 0; i < want; ++i)
        answer.push_back(random_.chance(3) ? 0 : static_cast<std::uint8_t>(random_.below(256)));
      if (first) {
        answer.resize(link::kResponseHeader);
        for (int i = 0; i < 4; ++i) answer.push_back(static_cast<std::uint8_t>(link::kBoardId >> (8 * i)));
      } else if (!opened_ && answer.size() >= link::kResponseHeader + 16) {
        answer[link::kResponseHeader + 5] = static_cast<std::uint8_t>(contract::kImageVersion);
        answer[link::kResponseHeader + 8] = 0;
        // Every other one says that its memory is short and ready: of another, much is asked before it counts as open.
        if (random_.chance(50) && answer.size() >= link::kResponseHeader + 4 * link::kBoardRegisters) {
          for (int i = 2; i < 4; ++i) answer[link::kResponseHeader + 4 * link::kBoardMemoryBytes + i] = 0;
          answer[link::kResponseHeader + 4 * link::kBoardMemoryState] = link::kMemoryReady;
        }
      }
      opened_ = opened_ || !first;
      const auto line = link::frame(answer);
      waiting_.insert(waiting_.end(), line.begin(), line.end());
    }
    for (std::uint64_t i = random_.below(20); i > 0; --i)
      waiting_.push_back(static_cast<std::uint8_t>(random_.below(256)));
  }
  std::vector<std::uint8_t> read(double seconds) override {
    now_ += waiting_.empty() ? seconds : 1e-4;
    return std::exchange(waiting_, {});
  }
  double now() const override { return now_; }
  const std::string& name() const override { return name_; }

 private:
  Random random_;
  std::vector<std::uint8_t> waiting_;
  bool opened_ = false;
  double now_ = 0;
  std::string name_ = "hostile";
};

TEST(SerialDevice, ABoardThatLiesIsAnErrorAtWorst) {
  int opened = 0, errors = 0;
  const auto attempt = [&](const auto& what) {
    try {
      what();
    } catch (const Error&) {
      ++errors;
    }
  };
  constexpr int kBoards = 1000;
  for (std::uint64_t i = 0; i < kBoards; ++i) {
    std::vector<std::uint64_t> words(300);
    attempt([&] {
      cosim::SerialDevice device(std::make_unique<HostileLine>(test_seed() + i), {});
      ++opened;
      attempt([&] { device.wait_interrupt(); });
      attempt([&] { device.read_register(0x100); });
      attempt([&] { device.write_memory(device.allocate(2400), words); });
      attempt([&] { device.read_memory(device.identity().memory_base, words); });
    });
  }
  EXPECT_GT(opened, 20);
  EXPECT_GT(errors, kBoards) << "lies were believed";
}

TEST(SerialDevice, MemoryIsCheckedAfterItIsWritten) {
  SimulatedBoard board({});
  cosim::SerialDevice device(std::make_unique<SimulatedLine>(board), {});
  const std::uint64_t address = device.allocate(256);
  std::vector<std::uint64_t> words(32), back(32);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = i * 0x0101010101010101ull;
  device.write_memory(address, words);
  device.read_memory(address, back);
  EXPECT_EQ(words, back);
  EXPECT_THROW(device.write_memory(address + device.identity().memory_bytes - 128, words), Error);
  EXPECT_THROW(device.allocate(device.identity().memory_bytes), Error);
  // A board that was reset in the middle says so.
  board.model().reset();
  EXPECT_THROW(device.read_memory(address, back), Error);
}

}  // namespace
