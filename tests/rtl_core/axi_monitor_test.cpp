// The bench itself: the monitors name every rule that is broken and nothing else, the memory obeys them in all its moods, honours strobes and
// answers out of order. No core is simulated here. Seeds: RETRACE_SEED.
#include "testbench/sim/core/axi_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "testbench/sim/core/axi_lite_master.hpp"
#include "testbench/sim/core/axi_memory.hpp"

namespace {

using namespace retrace;
using namespace retrace::cosim;

/// A port that a test drives by hand, both sides of it.
struct Port {
  AxiMonitor monitor{8, {.most_wait = 50}};
  AxiMasterSignals m;
  AxiSlaveSignals s;
  bool rst_n = true;

  void clock(int times = 1) {
    for (int i = 0; i < times; ++i) monitor.clock(rst_n, m, s);
  }
  void offer_read(std::uint64_t address = 0x1000, std::uint32_t len = 1, std::uint32_t id = 5) {
    m.ar_valid = true;
    m.ar_addr = address, m.ar_len = len, m.ar_id = id, m.ar_size = 3, m.ar_burst = 1;
  }
  void read(std::uint64_t address = 0x1000, std::uint32_t len = 1, std::uint32_t id = 5) {
    offer_read(address, len, id);
    s.ar_ready = true;
    clock();
    m.ar_valid = s.ar_ready = false;
  }
  void offer_answer(bool last, std::uint32_t id = 5, std::uint32_t response = 0) {
    s.r_valid = true;
    s.r_last = last, s.r_id = id, s.r_resp = response;
  }
  void answer(bool last, std::uint32_t id = 5, std::uint32_t response = 0) {
    offer_answer(last, id, response);
    m.r_ready = true;
    clock();
    s.r_valid = m.r_ready = false;
  }
  void offer_write(std::uint64_t address = 0x1000, std::uint32_t len = 1, std::uint32_t id = 0) {
    m.aw_valid = true;
    m.aw_addr = address, m.aw_len = len, m.aw_id = id, m.aw_size = 3, m.aw_burst = 1;
  }
  void write(std::uint64_t address = 0x1000, std::uint32_t len = 1, std::uint32_t id = 0) {
    offer_write(address, len, id);
    s.aw_ready = true;
    clock();
    m.aw_valid = s.aw_ready = false;
  }
  void offer_beat(bool last, std::uint32_t strobes = 0xff) {
    m.w_valid = true;
    m.w_last = last, m.w_strb = strobes, m.w_data = {1, 0};
  }
  void beat(bool last, std::uint32_t strobes = 0xff) {
    offer_beat(last, strobes);
    s.w_ready = true;
    clock();
    m.w_valid = s.w_ready = false;
  }
  void offer_acknowledge(std::uint32_t id = 0, std::uint32_t response = 0) {
    s.b_valid = true;
    s.b_id = id, s.b_resp = response;
  }
  void acknowledge(std::uint32_t id = 0, std::uint32_t response = 0) {
    offer_acknowledge(id, response);
    m.b_ready = true;
    clock();
    s.b_valid = m.b_ready = false;
  }
  /// Drops the valid of every channel without a handshake.
  void withdraw() { m.ar_valid = m.aw_valid = m.w_valid = s.r_valid = s.b_valid = false; }
};

struct Case {
  const char* what;
  AxiChannel channel;
  AxiRule rule;
  std::function<void(Port&)> drive;
};

// A write with both beats, so that B may be offered.
void whole_write(Port& p) {
  p.write();
  p.beat(false);
  p.beat(true);
}

const std::vector<Case>& cases() {
  using C = AxiChannel;
  using R = AxiRule;
  static const std::vector<Case> all = {
      {"AR dropped", C::kAr, R::kValidHeld, [](Port& p) { p.offer_read(), p.clock(), p.withdraw(), p.clock(); }},
      {"AW dropped", C::kAw, R::kValidHeld, [](Port& p) { p.offer_write(), p.clock(), p.withdraw(), p.clock(); }},
      {"W dropped", C::kW, R::kValidHeld, [](Port& p) { p.offer_beat(true), p.clock(), p.withdraw(), p.clock(); }},
      {"R dropped", C::kR, R::kValidHeld,
       [](Port& p) { p.read(), p.offer_answer(false), p.clock(), p.withdraw(), p.clock(); }},
      {"B dropped", C::kB, R::kValidHeld,
       [](Port& p) { whole_write(p), p.offer_acknowledge(), p.clock(), p.withdraw(), p.clock(); }},
      {"AR address", C::kAr, R::kPayloadHeld, [](Port& p) { p.offer_read(), p.clock(), p.m.ar_addr += 8, p.clock(); }},
      {"AR length", C::kAr, R::kPayloadHeld, [](Port& p) { p.offer_read(), p.clock(), p.m.ar_len = 0, p.clock(); }},
      {"AR id", C::kAr, R::kPayloadHeld, [](Port& p) { p.offer_read(), p.clock(), p.m.ar_id ^= 1, p.clock(); }},
      {"AW address", C::kAw, R::kPayloadHeld, [](Port& p) { p.offer_write(), p.clock(), p.m.aw_addr += 8, p.clock(); }},
      {"AW length", C::kAw, R::kPayloadHeld, [](Port& p) { p.offer_write(), p.clock(), p.m.aw_len = 0, p.clock(); }},
      {"W data", C::kW, R::kPayloadHeld, [](Port& p) { p.offer_beat(true), p.clock(), p.m.w_data[0] ^= 1, p.clock(); }},
      {"W upper data", C::kW, R::kPayloadHeld,
       [](Port& p) { p.offer_beat(true), p.clock(), p.m.w_data[1] ^= 1, p.clock(); }},
      {"W strobes", C::kW, R::kPayloadHeld, [](Port& p) { p.offer_beat(true), p.clock(), p.m.w_strb = 1, p.clock(); }},
      {"W last", C::kW, R::kPayloadHeld, [](Port& p) { p.offer_beat(true), p.clock(), p.m.w_last = false, p.clock(); }},
      {"R data", C::kR, R::kPayloadHeld,
       [](Port& p) { p.read(), p.offer_answer(false), p.clock(), p.s.r_data[0] ^= 1, p.clock(); }},
      {"R last", C::kR, R::kPayloadHeld,
       [](Port& p) { p.read(), p.offer_answer(false), p.clock(), p.s.r_last = true, p.clock(); }},
      {"B response", C::kB, R::kPayloadHeld,
       [](Port& p) { whole_write(p), p.offer_acknowledge(), p.clock(), p.s.b_resp = 2, p.clock(); }},
      {"AR in reset", C::kAr, R::kValidInReset, [](Port& p) { p.rst_n = false, p.offer_read(), p.clock(3); }},
      {"AW in reset", C::kAw, R::kValidInReset, [](Port& p) { p.rst_n = false, p.offer_write(), p.clock(3); }},
      {"W in reset", C::kW, R::kValidInReset, [](Port& p) { p.rst_n = false, p.offer_beat(true), p.clock(3); }},
      {"R in reset", C::kR, R::kValidInReset, [](Port& p) { p.rst_n = false, p.offer_answer(true), p.clock(3); }},
      {"B in reset", C::kB, R::kValidInReset, [](Port& p) { p.rst_n = false, p.offer_acknowledge(), p.clock(3); }},
      {"AR fixed", C::kAr, R::kBurstType,
       [](Port& p) { p.offer_read(), p.m.ar_burst = 0, p.s.ar_ready = true, p.clock(); }},
      {"AW wrapping", C::kAw, R::kBurstType,
       [](Port& p) { p.offer_write(), p.m.aw_burst = 2, p.s.aw_ready = true, p.clock(); }},
      {"AR narrow", C::kAr, R::kBurstSize,
       [](Port& p) { p.offer_read(), p.m.ar_size = 2, p.s.ar_ready = true, p.clock(); }},
      {"AW too wide", C::kAw, R::kBurstSize,
       [](Port& p) { p.offer_write(), p.m.aw_size = 4, p.s.aw_ready = true, p.clock(); }},
      {"AR of 136 bytes", C::kAr, R::kBurstLength, [](Port& p) { p.read(0x1000, 16); }},
      {"AW of 72 bytes", C::kAw, R::kBurstLength, [](Port& p) { p.write(0x1000, 8); }},
      {"AR between beats", C::kAr, R::kAlignment, [](Port& p) { p.read(0x1004, 0); }},
      {"AW between beats", C::kAw, R::kAlignment, [](Port& p) { p.write(0x1001, 0); }},
      {"AR across a page", C::kAr, R::kBoundary, [](Port& p) { p.read(0x1ff8, 1); }},
      {"header at ..fc0", C::kAr, R::kBoundary, [](Port& p) { p.read(0x1fc0, 15); }},
      {"AW across a page", C::kAw, R::kBoundary, [](Port& p) { p.write(0x1fc8, 7); }},
      {"W last too early", C::kW, R::kLast, [](Port& p) { p.write(), p.beat(true); }},
      {"W last missing", C::kW, R::kLast, [](Port& p) { p.write(), p.beat(false), p.beat(false); }},
      {"W last too early, before AW", C::kW, R::kLast, [](Port& p) { p.beat(true), p.write(); }},
      {"W last missing, before AW", C::kW, R::kLast, [](Port& p) { p.beat(false), p.write(0x1000, 0); }},
      {"R last too early", C::kR, R::kLast, [](Port& p) { p.read(), p.answer(true); }},
      {"R last missing", C::kR, R::kLast, [](Port& p) { p.read(), p.answer(false), p.answer(false); }},
      {"R of the second burst first", C::kR, R::kLast, [](Port& p) { p.read(), p.read(0x1100, 0), p.answer(true); }},
      {"W strobe beyond the bus", C::kW, R::kStrobes, [](Port& p) { p.write(0x1000, 0), p.beat(true, 0x1ff); }},
      {"R without AR", C::kR, R::kUnasked, [](Port& p) { p.offer_answer(true), p.clock(); }},
      {"R of another id", C::kR, R::kUnasked, [](Port& p) { p.read(), p.offer_answer(false, 6), p.clock(); }},
      {"R in the clock of its AR", C::kR, R::kUnasked,
       [](Port& p) { p.offer_read(), p.s.ar_ready = true, p.offer_answer(false), p.clock(); }},
      {"R too many", C::kR, R::kUnasked,
       [](Port& p) { p.read(0x1000, 0), p.answer(true), p.offer_answer(true), p.clock(); }},
      {"B without AW", C::kB, R::kUnasked, [](Port& p) { p.beat(true), p.offer_acknowledge(), p.clock(); }},
      {"B before the last W", C::kB, R::kUnasked,
       [](Port& p) { p.write(), p.beat(false), p.offer_acknowledge(), p.clock(); }},
      {"B in the clock of the last W", C::kB, R::kUnasked,
       [](Port& p) { p.write(0x1000, 0), p.offer_beat(true), p.s.w_ready = true, p.offer_acknowledge(), p.clock(); }},
      {"B of another id", C::kB, R::kUnasked, [](Port& p) { whole_write(p), p.offer_acknowledge(3), p.clock(); }},
      {"B twice", C::kB, R::kUnasked,
       [](Port& p) { whole_write(p), p.acknowledge(), p.offer_acknowledge(), p.clock(); }},
      {"R after a reset", C::kR, R::kUnasked,
       [](Port& p) { p.read(), p.rst_n = false, p.clock(), p.rst_n = true, p.offer_answer(false), p.clock(); }},
      {"R EXOKAY", C::kR, R::kResponse, [](Port& p) { p.read(), p.answer(false, 5, 1); }},
      {"B EXOKAY", C::kB, R::kResponse, [](Port& p) { whole_write(p), p.acknowledge(0, 1); }},
      {"AR waits", C::kAr, R::kWait, [](Port& p) { p.offer_read(), p.clock(50); }},
      {"R waits", C::kR, R::kWait, [](Port& p) { p.read(), p.offer_answer(false), p.clock(50); }},
      {"AW waits", C::kAw, R::kWait, [](Port& p) { p.offer_write(), p.clock(50); }},
      {"W waits", C::kW, R::kWait, [](Port& p) { p.offer_beat(true), p.clock(50); }},
      {"B waits", C::kB, R::kWait, [](Port& p) { whole_write(p), p.offer_acknowledge(), p.clock(50); }},
      {"no R", C::kR, R::kUnanswered, [](Port& p) { p.read(), p.answer(false), p.monitor.check_idle(); }},
      {"no W", C::kW, R::kUnanswered, [](Port& p) { p.write(), p.beat(false), p.monitor.check_idle(); }},
      {"no AW", C::kAw, R::kUnanswered, [](Port& p) { p.beat(true), p.monitor.check_idle(); }},
      {"no B", C::kB, R::kUnanswered, [](Port& p) { whole_write(p), p.monitor.check_idle(); }},
  };
  return all;
}

TEST(AxiMonitor, NamesEveryBrokenRule) {
  std::set<AxiRule> rules;
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.what);
    Port port;
    c.drive(port);
    ASSERT_EQ(port.monitor.violations().size(), 1u);
    const AxiViolation& violation = port.monitor.violations().front();
    EXPECT_EQ(violation.channel, c.channel) << violation.text();
    EXPECT_EQ(violation.rule, c.rule) << violation.text();
    EXPECT_EQ(violation.clock, port.monitor.clocks());
    rules.insert(c.rule);
  }
  EXPECT_EQ(rules.size(), kAxiRules) << "a rule without a case";
}

TEST(AxiMonitor, AcceptsWhatIsLegal) {
  Port p;
  p.rst_n = false;
  p.offer_read();  // a synchronous reset may take a clock to get to the outputs
  p.clock();
  p.withdraw();
  p.clock(4);
  p.rst_n = true;
  p.read(0x1fc0, 7), p.read(0x2000, 15, 6), p.read(0x1ff8, 0);
  for (int beat = 0; beat < 16; ++beat) {  // ids mixed
    p.answer(beat == 15, 6);
    if (beat < 8) p.answer(beat == 7, 5, beat == 3 ? 2 : 0);
  }
  p.answer(true, 5, 3);
  p.beat(false), p.beat(true, 0), p.beat(true, 0xf0);  // before their addresses
  p.write(), p.write(0x1ff8, 0, 4);
  p.acknowledge(4), p.acknowledge(0);
  p.write(0x1fc0, 7, 2);
  for (int beat = 0; beat < 8; ++beat) p.beat(beat == 7);
  p.offer_acknowledge(2), p.clock(10), p.acknowledge(2);
  p.offer_read(), p.clock(40), p.read();
  p.answer(false), p.answer(true);
  p.monitor.check_idle();
  EXPECT_TRUE(p.monitor.violations().empty()) << p.monitor.violations().front().text();
  EXPECT_TRUE(p.monitor.idle());
  EXPECT_EQ(p.monitor.reads(), 4u);
  EXPECT_EQ(p.monitor.writes(), 3u);
  EXPECT_EQ(p.monitor.early_beats(), 3u);
  EXPECT_EQ(p.monitor.partial_beats(), 2u);
}

TEST(AxiLiteMonitor, NamesEveryBrokenRule) {
  struct LitePort {
    AxiLiteMonitor monitor{50};
    AxiLiteMasterSignals m;
    AxiLiteSlaveSignals s;
    bool rst_n = true;
    void clock(int times = 1) {
      for (int i = 0; i < times; ++i) monitor.clock(rst_n, m, s);
    }
    void once(bool& valid, bool& ready) {
      valid = ready = true;
      clock();
      valid = ready = false;
    }
    void ar() { once(m.ar_valid, s.ar_ready); }
    void aw() { once(m.aw_valid, s.aw_ready); }
    void w() { once(m.w_valid, s.w_ready); }
    void b() { once(s.b_valid, m.b_ready); }
    void r() { once(s.r_valid, m.r_ready); }
  };
  struct LiteCase {
    AxiChannel channel;
    AxiRule rule;
    std::function<void(LitePort&)> drive;
  };
  using C = AxiChannel;
  using R = AxiRule;
  const std::vector<LiteCase> all = {
      {C::kAr, R::kValidHeld, [](auto& p) { p.m.ar_valid = true, p.clock(), p.m.ar_valid = false, p.clock(); }},
      {C::kAw, R::kValidHeld, [](auto& p) { p.m.aw_valid = true, p.clock(), p.m.aw_valid = false, p.clock(); }},
      {C::kW, R::kValidHeld, [](auto& p) { p.m.w_valid = true, p.clock(), p.m.w_valid = false, p.clock(); }},
      {C::kR, R::kValidHeld, [](auto& p) { p.ar(), p.s.r_valid = true, p.clock(), p.s.r_valid = false, p.clock(); }},
      {C::kB, R::kValidHeld,
       [](auto& p) { p.aw(), p.w(), p.s.b_valid = true, p.clock(), p.s.b_valid = false, p.clock(); }},
      {C::kAr, R::kPayloadHeld, [](auto& p) { p.m.ar_valid = true, p.clock(), p.m.ar_addr += 4, p.clock(); }},
      {C::kAw, R::kPayloadHeld, [](auto& p) { p.m.aw_valid = true, p.clock(), p.m.aw_addr += 4, p.clock(); }},
      {C::kW, R::kPayloadHeld, [](auto& p) { p.m.w_valid = true, p.clock(), p.m.w_strb = 3, p.clock(); }},
      {C::kR, R::kPayloadHeld, [](auto& p) { p.ar(), p.s.r_valid = true, p.clock(), p.s.r_data = 1, p.clock(); }},
      {C::kB, R::kPayloadHeld,
       [](auto& p) { p.w(), p.aw(), p.s.b_valid = true, p.clock(), p.s.b_resp = 2, p.clock(); }},
      {C::kR, R::kValidInReset, [](auto& p) { p.rst_n = false, p.s.r_valid = true, p.clock(3); }},
      {C::kB, R::kValidInReset, [](auto& p) { p.rst_n = false, p.s.b_valid = true, p.clock(3); }},
      {C::kW, R::kStrobes, [](auto& p) { p.m.w_strb = 0x1f, p.w(); }},
      {C::kR, R::kUnasked, [](auto& p) { p.s.r_valid = true, p.clock(); }},
      {C::kR, R::kUnasked, [](auto& p) { p.ar(), p.r(), p.s.r_valid = true, p.clock(); }},
      {C::kB, R::kUnasked, [](auto& p) { p.aw(), p.s.b_valid = true, p.clock(); }},
      {C::kB, R::kUnasked, [](auto& p) { p.w(), p.s.b_valid = true, p.clock(); }},
      {C::kB, R::kUnasked, [](auto& p) { p.aw(), p.w(), p.b(), p.s.b_valid = true, p.clock(); }},
      {C::kR, R::kResponse, [](auto& p) { p.ar(), p.s.r_resp = 1, p.r(); }},
      {C::kB, R::kResponse, [](auto& p) { p.aw(), p.w(), p.s.b_resp = 1, p.b(); }},
      {C::kAr, R::kWait, [](auto& p) { p.m.ar_valid = true, p.clock(50); }},
      {C::kB, R::kWait, [](auto& p) { p.aw(), p.w(), p.s.b_valid = true, p.clock(50); }},
      {C::kR, R::kUnanswered, [](auto& p) { p.ar(), p.monitor.check_idle(); }},
      {C::kW, R::kUnanswered, [](auto& p) { p.aw(), p.monitor.check_idle(); }},
      {C::kAw, R::kUnanswered, [](auto& p) { p.w(), p.monitor.check_idle(); }},
      {C::kB, R::kUnanswered, [](auto& p) { p.aw(), p.w(), p.monitor.check_idle(); }},
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    SCOPED_TRACE("case " + std::to_string(i));
    LitePort port;
    all[i].drive(port);
    ASSERT_EQ(port.monitor.violations().size(), 1u);
    const AxiViolation& violation = port.monitor.violations().front();
    EXPECT_EQ(violation.channel, all[i].channel) << violation.text();
    EXPECT_EQ(violation.rule, all[i].rule) << violation.text();
  }
  LitePort good;
  good.aw(), good.w(), good.b(), good.w(), good.aw(), good.ar(), good.b(), good.r();
  good.m.aw_valid = good.m.w_valid = good.s.aw_ready = good.s.w_ready = true;
  good.m.w_strb = 0;
  good.clock();
  good.m.aw_valid = good.m.w_valid = false;
  good.b();
  good.monitor.check_idle();
  EXPECT_TRUE(good.monitor.violations().empty());
  EXPECT_EQ(good.monitor.transactions(), 4u);
  EXPECT_EQ(good.monitor.address_first(), 1u);
  EXPECT_EQ(good.monitor.data_first(), 1u);
  EXPECT_EQ(good.monitor.together(), 1u);
  EXPECT_EQ(good.monitor.partial(), 1u);
}

// ------------------------------------------------------------------------------------------------ the memory

HoldOff any_hold_off(Random& random) {
  switch (random.below(3)) {
    case 0:
      return HoldOff::none();
    case 1:
      return HoldOff::random(random.bits(), static_cast<unsigned>(random.integer(2, 90)));
    default:
      return HoldOff::bursts(random.bits(), static_cast<unsigned>(random.integer(1, 100)));
  }
}

MemoryOptions any_memory(Random& random) {
  MemoryOptions options;
  options.latency_max = static_cast<int>(random.integer(1, 300));
  options.latency_min = static_cast<int>(random.integer(1, options.latency_max));
  options.reorder = random.chance(2);
  options.write_order = static_cast<WriteOrder>(random.below(3));
  options.base = random.below(1ull << 27) << 12;
  options.seed = random.bits();
  for (HoldOff& hold_off : options.hold_off) hold_off = any_hold_off(random);
  return options;
}

// A master with random bursts of all ids against a copy of the memory; each id writes its own part, so that the order between ids has no meaning.
TEST(AxiMemory, ObeysTheBusAndHonoursStrobes) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  std::uint64_t reordered = 0, early = 0, partial = 0;
  for (int round = 0; round < 24; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const int data_bytes = round % 2 == 0 ? 8 : 16;
    const MemoryOptions options = any_memory(random);
    AxiMemory memory(data_bytes, options);
    constexpr std::uint64_t kBytes = 1 << 15;
    constexpr std::uint32_t kIds = 4;
    memory.resize(kBytes);
    std::vector<std::uint8_t> copy(kBytes);
    std::vector<std::uint64_t> words(kBytes / 8);
    for (std::size_t i = 0; i < kBytes; ++i) {
      copy[i] = static_cast<std::uint8_t>(random.bits());
      words[i / 8] |= static_cast<std::uint64_t>(copy[i]) << (8 * (i % 8));
    }
    memory.write(memory.base(), words);
    memory.watch_writes(memory.base(), memory.base() + kBytes);
    std::vector<std::uint8_t> times(kBytes);

    struct Burst {
      std::uint64_t offset;
      std::uint32_t id, beats, beat = 0;
    };
    // A burst of one id in its half of the memory: reads in the upper one, which nobody writes.
    const auto any_burst = [&](bool write) {
      Burst burst;
      burst.id = static_cast<std::uint32_t>(random.below(kIds));
      burst.beats = static_cast<std::uint32_t>(random.integer(1, (write ? 64 : 128) / data_bytes));
      const std::uint64_t bytes = burst.beats * static_cast<std::uint64_t>(data_bytes);
      burst.offset =
          4096 * (burst.id + (write ? 0 : kIds)) + random.below((4096 - bytes) / data_bytes + 1) * data_bytes;
      return burst;
    };
    std::vector<std::deque<Burst>> asked(kIds);
    std::deque<std::uint32_t> order;
    std::deque<Burst> addresses, data;
    AxiMasterSignals m;
    for (int clock = 0; clock < 20000 && memory.monitor().violations().empty(); ++clock) {
      const AxiSlaveSignals s = memory.signals();
      const bool more = clock < 12000;
      if (!m.ar_valid && more && random.chance(3)) {
        const Burst burst = any_burst(false);
        m.ar_valid = true;
        m.ar_addr = memory.base() + burst.offset, m.ar_len = burst.beats - 1, m.ar_id = burst.id;
        m.ar_size = data_bytes == 8 ? 3 : 4, m.ar_burst = 1;
        asked[burst.id].push_back(burst);
        order.push_back(burst.id);
      }
      if (more && addresses.size() + data.size() < 8 && random.chance(5)) {
        addresses.push_back(any_burst(true));
        data.push_back(addresses.back());
      }
      if (!m.aw_valid && !addresses.empty() && random.chance(2)) {
        m.aw_valid = true;
        m.aw_addr = memory.base() + addresses.front().offset, m.aw_len = addresses.front().beats - 1;
        m.aw_id = addresses.front().id;
        m.aw_size = data_bytes == 8 ? 3 : 4, m.aw_burst = 1;
        addresses.pop_front();
      }
      if (!m.w_valid && !data.empty()) {
        Burst& burst = data.front();
        m.w_valid = true;
        m.w_data = {random.bits(), data_bytes == 16 ? random.bits() : 0};
        m.w_strb = static_cast<std::uint32_t>(random.chance(3) ? random.bits() : ~0ull) & ((1u << data_bytes) - 1);
        for (int i = 0; i < data_bytes; ++i) {
          if ((m.w_strb >> i & 1) == 0) continue;
          const std::size_t at = burst.offset + burst.beat * data_bytes + i;
          copy[at] = static_cast<std::uint8_t>(m.w_data[i / 8] >> (8 * (i % 8)));
          ++times[at];
        }
        m.w_last = ++burst.beat == burst.beats;
        if (m.w_last) data.pop_front();
      }
      m.r_ready = !random.chance(4);
      m.b_ready = !random.chance(4);
      if (s.r_valid && m.r_ready) {
        Burst& burst = asked[s.r_id].front();
        reordered += order.front() != s.r_id;
        ASSERT_EQ(s.r_resp, 0u);
        for (int i = 0; i < data_bytes; ++i)
          ASSERT_EQ(static_cast<std::uint8_t>(s.r_data[i / 8] >> (8 * (i % 8))),
                    copy[burst.offset + burst.beat * data_bytes + i]);
        if (++burst.beat == burst.beats) {
          asked[s.r_id].pop_front();
          order.erase(std::find(order.begin(), order.end(), s.r_id));
        }
      }
      const AxiMasterSignals driven = m;
      memory.clock(driven);
      if (driven.ar_valid && s.ar_ready) m.ar_valid = false;
      if (driven.aw_valid && s.aw_ready) m.aw_valid = false;
      if (driven.w_valid && s.w_ready) m.w_valid = false;
    }
    for (int clock = 0; clock < 200000 && !memory.idle(); ++clock) {
      m.r_ready = m.b_ready = true;
      const AxiSlaveSignals s = memory.signals();
      memory.clock(m);
      if (s.ar_ready) m.ar_valid = false;
      if (s.aw_ready) m.aw_valid = false;
      if (s.w_ready) m.w_valid = false;
    }
    memory.monitor().check_idle();
    ASSERT_TRUE(memory.monitor().violations().empty()) << memory.monitor().violations().front().text();
    memory.read(memory.base(), words);
    for (std::size_t i = 0; i < kBytes; ++i)
      ASSERT_EQ(copy[i], static_cast<std::uint8_t>(words[i / 8] >> (8 * (i % 8)))) << "byte " << i;
    EXPECT_TRUE(std::equal(times.begin(), times.end(), memory.written_times().begin()));
    EXPECT_EQ(memory.stray_writes(), 0u);
    early += memory.monitor().early_beats();
    partial += memory.monitor().partial_beats();
  }
  EXPECT_GT(reordered, 1000u);
  EXPECT_GT(early, 100u);
  EXPECT_GT(partial, 1000u);
}

TEST(AxiMemory, RefusesBurstsAcrossPages) {
  AxiMemory memory(8, {});
  memory.resize(1 << 16);
  AxiMasterSignals m;
  m.ar_valid = true;
  m.ar_addr = memory.base() + 4096 - 64, m.ar_len = 15, m.ar_size = 3, m.ar_burst = 1;
  m.r_ready = true;
  std::uint32_t errors = 0;
  for (int clock = 0; clock < 200; ++clock) {
    const AxiSlaveSignals s = memory.signals();
    errors += s.r_valid && s.r_resp == 3;
    memory.clock(m);
    if (s.ar_ready) m.ar_valid = false;
  }
  EXPECT_EQ(errors, 16u);
  ASSERT_EQ(memory.monitor().violations().size(), 1u);
  EXPECT_EQ(memory.monitor().violations().front().rule, AxiRule::kBoundary);
}

TEST(AxiMemory, CountsWritesAndStrays) {
  AxiMemory memory(8, {});
  memory.resize(1 << 16);
  memory.watch_writes(memory.base() + 8, memory.base() + 16);
  AxiMasterSignals m;
  m.b_ready = true;
  for (int burst = 0; burst < 2; ++burst) {
    m.aw_valid = m.w_valid = true;
    m.aw_addr = memory.base() + 8 + 8 * burst, m.aw_size = 3, m.aw_burst = 1;
    m.w_strb = 0x81, m.w_last = true;
    for (int clock = 0; clock < 100; ++clock) {
      const AxiSlaveSignals s = memory.signals();
      memory.clock(m);
      if (s.aw_ready) m.aw_valid = false;
      if (s.w_ready) m.w_valid = false;
    }
  }
  const std::vector<std::uint8_t> expected = {1, 0, 0, 0, 0, 0, 0, 1};
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), memory.written_times().begin()));
  EXPECT_EQ(memory.stray_writes(), 2u);
  EXPECT_TRUE(memory.monitor().violations().empty());
}

}  // namespace
