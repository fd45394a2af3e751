// The RTL library: streams under every kind of stall, multipliers and dividers against wide integers, arbiter, RAM, and
// that the assertions of the RTL fire when a rule is broken.
#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "testbench/sim/clocked.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vtb_lib.h"

namespace retrace::cosim {
namespace {

using Bench = Clocked<Vtb_lib>;

// In the order of testbench/sim/sv/tb_lib.sv.
constexpr std::array kStreamNames{
    "skid",   "fifo 1", "fifo 2",  "fifo 3",     "fifo 16",    "fifo ram 4", "fifo ram 60",    "pipe 1",
    "pipe 2", "pipe 5", "pipe 30", "pipe 7 / 3", "pipe 8 / 2", "queue",      "turn and queue", "skid of half the rate"};
constexpr int kStreams = kStreamNames.size();
constexpr int kMuls = 6, kDivs = 6, kDivSeqs = 3, kArbInputs = 5;

// Packed ports: one bit, or 64 bits, an index.
template <typename Vector>
bool bit(const Vector& vector, int i) {
  return (vector >> i) & 1;
}
template <typename Vector>
void put(Vector& vector, int i, bool value) {
  vector = static_cast<Vector>((vector & ~(Vector{1} << i)) | (static_cast<Vector>(value) << i));
}
template <std::size_t Words>
std::uint64_t get64(const VlWide<Words>& wide, int i) {
  return wide[2 * i] | std::uint64_t{wide[2 * i + 1]} << 32;
}
template <std::size_t Words>
void put64(VlWide<Words>& wide, int i, std::uint64_t value) {
  wide[2 * i] = static_cast<std::uint32_t>(value);
  wide[2 * i + 1] = static_cast<std::uint32_t>(value >> 32);
}

void idle(Bench& bench) {
  bench->in_valid_i = bench->out_ready_i = 0;
  bench->seq_in_valid_i = bench->seq_out_ready_i = 0;
  bench->arb_valid_i = 0;
  bench->arb_ready_i = 0;
  bench->turns_valid_i = bench->turns_room_i = 0;
  bench->arb_last_i = (1 << kArbInputs) - 1;
  bench->ram_write_i = bench->ram_read_i = 0;
  bench->ram_write_addr_i = bench->ram_read_addr_i = 0;
  bench->counters_clear_i = bench->counters_enable_i = bench->counters_read_i = 0;
  bench->counters_step_i = bench->counters_index_i = 0;
  bench->rule_valid_i = bench->rule_ready_i = 0;
  bench->rule_true_i = 1;
}

struct LibTest : testing::Test {
  LibTest() : seed(test_seed()), bench(seed), random(seed) {
    idle(bench);
    bench.reset();
  }
  void SetUp() override { RecordProperty("seed", std::to_string(seed)); }
  void TearDown() override {
    if (HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  }

  std::uint64_t seed;
  Bench bench;
  Random random;
};

// -------------------------------------------------------------------------------------------------------------------
// streams

/// One stream of the bench: feeds random words, expects them back in order.
struct StreamPort {
  int index;
  HoldOff source, sink;
  Random words;
  std::deque<std::uint32_t> inside{};
  std::uint64_t sent = 0, received = 0;
  std::uint64_t first_sent = 0, first_received = 0;
  std::uint64_t bubbles = 0;  // clocks after the first output in which the sink was ready and got nothing
  bool offering = false;

  void drive(Bench& bench) {
    if (!offering && source.next()) {
      offering = true;
      bench->in_data_i[index] = static_cast<std::uint32_t>(words.bits());
    }
    put(bench->in_valid_i, index, offering);
    put(bench->out_ready_i, index, sink.next());
  }

  // Between settle() and rise().
  void sample(Bench& bench) {
    if (bit(bench->out_ready_i, index) && bit(bench->out_valid_o, index)) {
      ASSERT_FALSE(inside.empty()) << kStreamNames[index] << ": a word that was never sent";
      ASSERT_EQ(bench->out_data_o[index], inside.front()) << kStreamNames[index] << " word " << received;
      inside.pop_front();
      if (received++ == 0) first_received = bench.clock();
    } else if (bit(bench->out_ready_i, index) && received > 0) {
      ++bubbles;
    }
    if (offering && bit(bench->in_ready_o, index)) {
      if (sent++ == 0) first_sent = bench.clock();
      inside.push_back(bench->in_data_i[index]);
      offering = false;
    }
  }
};

template <typename Make>
std::vector<StreamPort> stream_ports(std::uint64_t seed, Make make) {
  std::vector<StreamPort> ports;
  for (int i = 0; i < kStreams; ++i) {
    auto [source, sink] = make(seed + 100 * static_cast<std::uint64_t>(i));
    ports.push_back({i, source, sink, Random(seed + static_cast<std::uint64_t>(i))});
  }
  return ports;
}

void run(Bench& bench, std::vector<StreamPort>& ports, int clocks) {
  for (int clock = 0; clock < clocks; ++clock) {
    for (auto& port : ports) port.drive(bench);
    bench.settle();
    for (auto& port : ports) {
      port.sample(bench);
      if (testing::Test::HasFatalFailure()) return;
    }
    bench.rise();
    ASSERT_FALSE(bench.failed()) << "an assertion of the RTL failed in clock " << bench.clock();
  }
}

void drain(Bench& bench, std::vector<StreamPort>& ports) {
  for (auto& port : ports) {
    port.source = HoldOff::list({0});
    port.sink = HoldOff::none();
  }
  run(bench, ports, 100);
  for (const auto& port : ports) {
    EXPECT_TRUE(port.inside.empty()) << kStreamNames[port.index] << " lost " << port.inside.size() << " words";
    EXPECT_EQ(port.sent, port.received) << kStreamNames[port.index];
    EXPECT_GT(port.sent, 0u) << kStreamNames[port.index];
  }
}

TEST_F(LibTest, StreamsRunAtFullRateWithTheStatedLatency) {
  constexpr int kClocks = 2000;
  auto ports = stream_ports(seed, [](std::uint64_t) { return std::pair(HoldOff::none(), HoldOff::none()); });
  const auto start = bench.clock();
  ASSERT_NO_FATAL_FAILURE(run(bench, ports, kClocks));
  for (const auto& port : ports) {
    const auto latency = static_cast<std::uint64_t>(bench->latency_o[port.index]);
    const auto interval = static_cast<std::uint64_t>(bench->interval_o[port.index]);
    EXPECT_EQ(port.first_received - port.first_sent, latency) << kStreamNames[port.index];
    EXPECT_EQ(port.received, (start + kClocks - port.first_received + interval - 1) / interval)
        << kStreamNames[port.index];
  }
  drain(bench, ports);
}

TEST_F(LibTest, StreamsKeepOrderUnderRandomStalls) {
  for (unsigned percent : {10u, 50u, 90u}) {
    auto ports = stream_ports(seed + percent, [&](std::uint64_t s) {
      return std::pair(HoldOff::random(s, percent), HoldOff::random(s + 1, 100 - percent));
    });
    ASSERT_NO_FATAL_FAILURE(run(bench, ports, 20000));
    drain(bench, ports);
  }
}

TEST_F(LibTest, StreamsKeepOrderUnderHoldOffLists) {
  for (const auto& list : {HoldOff::list({1, 0}), HoldOff::list({0, 0, 1}), HoldOff::list({1, 1, 1, 0}),
                           HoldOff::list({1, 0, 0, 1, 1, 0, 1})}) {
    for (const auto& other : {HoldOff::none(), HoldOff::list({0, 1}), HoldOff::list({0, 0, 0, 0, 0, 0, 0, 0, 1, 1})}) {
      auto ports = stream_ports(seed, [&](std::uint64_t) { return std::pair(list, other); });
      ASSERT_NO_FATAL_FAILURE(run(bench, ports, 500));
      drain(bench, ports);
      ports = stream_ports(seed, [&](std::uint64_t) { return std::pair(other, list); });
      ASSERT_NO_FATAL_FAILURE(run(bench, ports, 500));
      drain(bench, ports);
    }
  }
}

TEST_F(LibTest, FullBackPressureFillsAndReleasesWithoutABubble) {
  // Long stalls fill everything; when the sink comes back a word leaves in every clock, as long as the source keeps up.
  auto ports = stream_ports(seed, [](std::uint64_t s) { return std::pair(HoldOff::none(), HoldOff::bursts(s, 200)); });
  ASSERT_NO_FATAL_FAILURE(run(bench, ports, 20000));
  for (const auto& port : ports)
    if (bench->interval_o[port.index] == 1) {
      EXPECT_EQ(port.bubbles, 0u) << kStreamNames[port.index];
    }
  drain(bench, ports);
}

TEST_F(LibTest, StreamsAreEmptyAfterAReset) {
  for (int round = 0; round < 20; ++round) {
    auto ports = stream_ports(seed + static_cast<std::uint64_t>(round), [](std::uint64_t s) {
      return std::pair(HoldOff::random(s, 70), HoldOff::random(s + 1, 30));
    });
    ASSERT_NO_FATAL_FAILURE(run(bench, ports, 50 + static_cast<int>(random.below(50))));
    idle(bench);
    bench.reset(1);
    bench->out_ready_i = (1 << kStreams) - 1;
    for (int clock = 0; clock < 80; ++clock) {
      bench.settle();
      for (int i = 0; i < kStreams; ++i) ASSERT_FALSE(bit(bench->out_valid_o, i)) << kStreamNames[i];
      bench.rise();
    }
  }
}

// ----------------------------------------------------------------------------------------------------------------
// arithmetic

std::int64_t sign_extend(std::uint64_t value, int bits) {
  return static_cast<std::int64_t>(value << (64 - bits)) >> (64 - bits);
}

/// Uniform, or next to a power of two, or next to zero: where carries between partial products and borrows happen.
std::uint64_t operand(Random& random) {
  std::uint64_t value = random.bits();
  if (random.chance(3)) value = (std::uint64_t{1} << random.below(64)) + random.below(5) - 2;
  if (random.chance(6)) value = random.below(5) - 2;
  return value;
}

TEST_F(LibTest, MultipliersAreExactInEveryClock) {
  constexpr std::array<std::array<int, 2>, kMuls> kWidths{{{27, 27}, {32, 27}, {18, 18}, {27, 12}, {10, 30}, {35, 35}}};
  std::deque<std::array<std::uint64_t, 2>> history;
  for (int clock = 0; clock < 200000; ++clock) {
    bench->a_i = operand(random);
    bench->b_i = operand(random);
    history.push_front({bench->a_i, bench->b_i});
    if (history.size() > 16) history.pop_back();
    bench.step();
    if (history.size() < 16) continue;
    for (int i = 0; i < kMuls; ++i) {
      // After the edge the result belongs to the operands of latency - 1 edges before.
      const auto [a, b] = history[static_cast<std::size_t>(bench->mul_latency_o[i] - 1)];
      const __int128 expected =
          static_cast<__int128>(sign_extend(a, kWidths[i][0])) * static_cast<__int128>(sign_extend(b, kWidths[i][1]));
      ASSERT_EQ(static_cast<std::uint64_t>(expected), bench->mul_low_o[i]) << "multiplier " << i << " clock " << clock;
      ASSERT_EQ(static_cast<std::uint64_t>(expected >> 64), bench->mul_high_o[i])
          << "multiplier " << i << " clock " << clock;
    }
  }
}

struct DivWidths {
  int num, den, quot;
  std::uint64_t num_of(std::uint64_t bits) const { return bits & ((std::uint64_t{1} << num) - 1); }
  std::uint64_t den_of(std::uint64_t bits) const { return bits & ((std::uint64_t{1} << den) - 1); }
};
constexpr std::array<DivWidths, kDivs> kDividers{
    {{54, 27, 28}, {54, 27, 28}, {53, 28, 24}, {9, 5, 6}, {9, 5, 5}, {20, 30, 20}}};

void expect_quotient(const DivWidths& w, std::uint64_t num, std::uint64_t den, std::uint64_t quot, std::uint64_t rem,
                     bool overflow) {
  const std::uint64_t all_ones = (std::uint64_t{1} << w.quot) - 1;
  const bool too_large = den == 0 || num / den > all_ones;
  ASSERT_EQ(overflow, too_large) << num << " / " << den;
  ASSERT_EQ(quot, too_large ? all_ones : num / den) << num << " / " << den;
  if (!too_large) {
    ASSERT_EQ(rem, num % den) << num << " / " << den;
  }
}

// Numerators at multiples of the denominator and next to them, and quotients at the end of their range.
std::array<std::uint64_t, 2> division_operands(Random& random) {
  std::uint64_t a = operand(random), b = operand(random);
  if (random.chance(3)) {
    b &= (std::uint64_t{1} << 27) - 1;
    a = b * (random.bits() >> (36 + random.below(28))) + random.below(3) - 1;
  }
  return {a, b};
}

TEST_F(LibTest, DividersAreExactInEveryClock) {
  std::deque<std::array<std::uint64_t, 2>> history;
  constexpr std::size_t kKept = 40;
  for (int clock = 0; clock < 200000; ++clock) {
    // The low 14 bits run through every case of the small dividers.
    auto operands = division_operands(random);
    if (clock < (1 << 14)) operands = {static_cast<std::uint64_t>(clock) & 511, static_cast<std::uint64_t>(clock) >> 9};
    bench->a_i = operands[0];
    bench->b_i = operands[1];
    history.push_front(operands);
    if (history.size() > kKept) history.pop_back();
    bench.step();
    if (history.size() < kKept) continue;
    for (int i = 0; i < kDivs; ++i) {
      const auto [a, b] = history[static_cast<std::size_t>(bench->div_latency_o[i] - 1)];
      const auto& w = kDividers[i];
      ASSERT_NO_FATAL_FAILURE(
          expect_quotient(w, w.num_of(a), w.den_of(b), bench->quot_o[i], bench->rem_o[i], bench->overflow_o[i]))
          << "divider " << i << " clock " << clock;
    }
  }
}

TEST_F(LibTest, SequentialDividersAreExactUnderStalls) {
  constexpr std::array<int, kDivSeqs> kSets{0, 1, 4};
  struct Job {
    std::uint64_t num, den;
    std::uint32_t tag;
  };
  for (bool stalls : {false, true}) {
    std::array<std::deque<Job>, kDivSeqs> inside;
    std::array<std::uint64_t, kDivSeqs> last_sent{};
    std::array<int, kDivSeqs> received{};
    std::vector<HoldOff> sources, sinks;
    for (int i = 0; i < kDivSeqs; ++i) {
      sources.push_back(stalls ? HoldOff::random(random.bits(), 30) : HoldOff::none());
      sinks.push_back(stalls ? HoldOff::bursts(random.bits(), 40) : HoldOff::none());
    }
    std::array<bool, kDivSeqs> offering{};
    for (int clock = 0; clock < 30000; ++clock) {
      for (int i = 0; i < kDivSeqs; ++i) {
        if (!offering[i] && sources[i].next()) {
          const auto [a, b] = division_operands(random);
          offering[i] = true;
          put64(bench->seq_num_i, i, kDividers[kSets[i]].num_of(a));
          put64(bench->seq_den_i, i, kDividers[kSets[i]].den_of(b));
          bench->seq_tag_i[i] = static_cast<std::uint32_t>(random.bits());
        }
        put(bench->seq_in_valid_i, i, offering[i]);
        put(bench->seq_out_ready_i, i, sinks[i].next());
      }
      bench.settle();
      for (int i = 0; i < kDivSeqs; ++i) {
        if (bit(bench->seq_out_valid_o, i) && bit(bench->seq_out_ready_i, i)) {
          ASSERT_FALSE(inside[i].empty());
          const Job job = inside[i].front();
          inside[i].pop_front();
          ASSERT_EQ(bench->seq_tag_o[i], job.tag);
          ASSERT_NO_FATAL_FAILURE(expect_quotient(kDividers[kSets[i]], job.num, job.den, bench->seq_quot_o[i],
                                                  bench->seq_rem_o[i], bench->seq_overflow_o[i]));
          ++received[i];
        }
        if (offering[i] && bit(bench->seq_in_ready_o, i)) {
          if (!stalls && !inside[i].empty()) FAIL() << "a second division entered";
          if (!stalls && received[i] > 0) {
            ASSERT_EQ(bench.clock() - last_sent[i], static_cast<std::uint64_t>(bench->seq_interval_o[i]));
          }
          last_sent[i] = bench.clock();
          inside[i].push_back({get64(bench->seq_num_i, i), get64(bench->seq_den_i, i), bench->seq_tag_i[i]});
          offering[i] = false;
        }
      }
      bench.rise();
      ASSERT_FALSE(bench.failed());
    }
    for (int i = 0; i < kDivSeqs; ++i) EXPECT_GT(received[i], 300);
    idle(bench);
    bench.reset();
  }
}

// ----------------------------------------------------------------------------------------------------------- arbiter
// and RAM

TEST_F(LibTest, ArbiterIsFairAndKeepsBurstsTogether) {
  struct Input {
    std::deque<std::array<std::uint32_t, 2>> sent;  // data, last
    bool offering = false;
    int waiting_for = 0;  // grants to others since this input became valid
  };
  std::array<Input, kArbInputs> inputs;
  std::uint64_t beats = 0;
  int burst_of = -1;
  auto sink = HoldOff::random(seed, 60);
  const unsigned busy[] = {100, 50, 2, 100, 20};
  for (int clock = 0; clock < 100000; ++clock) {
    for (int i = 0; i < kArbInputs; ++i) {
      auto& in = inputs[i];
      // In the middle of a burst an input may pause; nobody else may slip in.
      if (!in.offering && random.below(100) < busy[i]) {
        in.offering = true;
        in.waiting_for = 0;
        bench->arb_data_i[i] = static_cast<std::uint32_t>(random.bits()) << 3 | static_cast<std::uint32_t>(i);
        bench->arb_last_i = (bench->arb_last_i & ~(1u << i)) | (random.chance(3) ? 1u << i : 0u);
      }
    }
    unsigned valid = 0;
    for (int i = 0; i < kArbInputs; ++i) valid |= inputs[i].offering ? 1u << i : 0u;
    bench->arb_valid_i = static_cast<std::uint8_t>(valid);
    bench->arb_ready_i = sink.next();
    bench.settle();
    const bool expect_valid = burst_of < 0 ? valid != 0 : inputs[burst_of].offering;
    ASSERT_EQ(bench->arb_valid_o != 0, expect_valid);
    ASSERT_EQ(bench->arb_one_valid_o != 0, inputs[0].offering);
    if (inputs[0].offering) {
      ASSERT_EQ(bench->arb_one_data_o, bench->arb_data_i[0]);
    }
    if (bench->arb_valid_o && bench->arb_ready_i) {
      const int winner = bench->arb_index_o;
      ASSERT_EQ(bench->arb_ready_o, 1u << winner);
      ASSERT_TRUE(inputs[winner].offering);
      ASSERT_EQ(bench->arb_data_o, bench->arb_data_i[winner]);
      if (burst_of >= 0) {
        ASSERT_EQ(winner, burst_of) << "a burst was interrupted";
      } else {
        for (int i = 0; i < kArbInputs; ++i)
          if (i != winner && inputs[i].offering) {
            ASSERT_LT(++inputs[i].waiting_for, kArbInputs) << "input " << i << " starves";
          }
      }
      burst_of = (bench->arb_last_i >> winner) & 1 ? -1 : winner;
      inputs[winner].offering = false;
      ++beats;
    } else {
      ASSERT_EQ(bench->arb_ready_o, 0);
    }
    bench.rise();
    ASSERT_FALSE(bench.failed());
  }
  EXPECT_GT(beats, 10000u);
}

TEST_F(LibTest, TurnsAreFairAndServeEveryClock) {
  struct Input {
    bool offering = false;
    int waiting_for = 0;  // others served since this input became valid
  };
  std::array<Input, kArbInputs> inputs;
  std::array<int, kArbInputs> served{};
  auto room = HoldOff::random(seed, 30);
  const unsigned busy[] = {100, 50, 2, 100, 20};
  bool had_room = false;
  unsigned others = 0;  // inputs that were valid in the clock before and not served in it
  for (int clock = 0; clock < 100000; ++clock) {
    unsigned valid = 0;
    for (int i = 0; i < kArbInputs; ++i) {
      auto& in = inputs[i];
      if (!in.offering && random.below(100) < busy[i]) {
        in = {true, 0};
        bench->arb_data_i[i] = static_cast<std::uint32_t>(random.bits()) << 3 | static_cast<std::uint32_t>(i);
      }
      valid |= in.offering ? 1u << i : 0u;
    }
    bench->turns_valid_i = static_cast<std::uint8_t>(valid);
    bench->turns_room_i = room.next();
    bench.settle();
    ASSERT_EQ(bench->turns_valid_o != 0, had_room && others != 0) << "clock " << clock;
    const unsigned ready = bench->turns_ready_o;
    ASSERT_EQ(ready & ~others, 0u) << "served is who was valid a clock before";
    ASSERT_EQ(ready & (ready - 1), 0u);
    ASSERT_EQ(ready != 0, bench->turns_valid_o != 0);
    for (int i = 0; i < kArbInputs; ++i) {
      if (ready == 0 || !inputs[i].offering) continue;
      if (ready >> i & 1) {
        ASSERT_EQ(bench->turns_data_o, bench->arb_data_i[i]);
        inputs[i].offering = false;
        ++served[i];
      } else {
        ASSERT_LT(++inputs[i].waiting_for, kArbInputs) << "input " << i << " starves";
      }
    }
    had_room = bench->turns_room_i;
    others = valid & ~ready;
    bench.rise();
    ASSERT_FALSE(bench.failed());
  }
  for (int i = 0; i < kArbInputs; ++i) EXPECT_GT(served[i], 1000) << "input " << i;
}

TEST_F(LibTest, RamReadsWhatWasWritten) {
  constexpr int kDepth = 100;
  std::array<std::uint32_t, kDepth> memory{};
  for (int i = 0; i < kDepth; ++i) {
    bench->ram_write_i = 1;
    bench->ram_write_addr_i = static_cast<std::uint8_t>(i);
    bench->ram_write_data_i = memory[i] = static_cast<std::uint32_t>(random.bits());
    bench.step();
  }
  std::uint32_t plain = 0, forward = 0;
  bool known = false;
  int collisions = 0;
  for (int clock = 0; clock < 50000; ++clock) {
    bench->ram_write_i = random.chance(2);
    bench->ram_read_i = random.chance(2);
    bench->ram_write_addr_i = static_cast<std::uint8_t>(random.below(kDepth));
    bench->ram_read_addr_i =
        random.chance(4) ? bench->ram_write_addr_i : static_cast<std::uint8_t>(random.below(kDepth));
    bench->ram_write_data_i = static_cast<std::uint32_t>(random.bits());
    if (bench->ram_read_i) {
      const bool collision = bench->ram_write_i && bench->ram_write_addr_i == bench->ram_read_addr_i;
      collisions += collision;
      plain = collision ? ~bench->ram_write_data_i : memory[bench->ram_read_addr_i];
      forward = collision ? bench->ram_write_data_i : memory[bench->ram_read_addr_i];
      known = true;
    }
    if (bench->ram_write_i) memory[bench->ram_write_addr_i] = bench->ram_write_data_i;
    bench.step();
    if (!known) continue;
    ASSERT_EQ(bench->ram_plain_o, plain);
    ASSERT_EQ(bench->ram_forward_o, forward);
  }
  EXPECT_GT(collisions, 1000);
  EXPECT_FALSE(bench.failed());
}

// -------------------------------------------------------------------------------------------------------------------
// counters

/// The counters of the bench and what they have to say.
struct CounterBench {
  static constexpr std::array<unsigned, 5> kMost{3, 1, 4, 7, 1};  // MaxStep of the bench, index 0 first
  static constexpr int kAnswerBefore = 5 + 4;                     // clocks, Count + 4

  explicit CounterBench(LibTest& test) : bench(test.bench), random(test.random) {}

  void clock(bool clear, bool enable) {
    std::uint16_t steps = 0;
    for (std::size_t i = 0; i < kMost.size(); ++i) {
      const auto step = static_cast<std::uint32_t>(random.chance(3) ? kMost[i] : random.below(kMost[i] + 1));
      steps = static_cast<std::uint16_t>(steps | step << (3 * i));
      if (clear)
        sums[i] = 0;
      else if (enable)
        sums[i] += step;
    }
    bench->counters_clear_i = clear;
    bench->counters_enable_i = enable;
    bench->counters_step_i = steps;
    bench.step();
    bench->counters_read_i = 0;
  }
  /// Asks for a counter, goes on counting as `enable` says until the answer is there.
  std::uint32_t read(unsigned index, bool enable, int clear_after = -1) {
    bench->counters_read_i = 1;
    bench->counters_index_i = static_cast<std::uint8_t>(index);
    for (int i = 0; i < kAnswerBefore; ++i) {
      clock(i == clear_after, enable);
      if (bench->counters_done_o) return bench->counters_data_o;
    }
    ADD_FAILURE() << "no answer for counter " << index << " within " << kAnswerBefore << " clocks";
    return 0;
  }

  Bench& bench;
  Random& random;
  std::array<std::uint32_t, 5> sums{};
};

TEST_F(LibTest, CountersHoldEveryStepAtRest) {
  CounterBench counters(*this);
  for (int run = 0; run < 300; ++run) {
    if (run % 3 != 0) counters.clock(true, random.chance(2));
    const bool full = random.chance(4);
    for (auto left = random.below(200); left > 0; --left) counters.clock(false, full || random.chance(2));
    counters.clock(false, false);
    for (unsigned i = 0; i < 5; ++i) {
      ASSERT_EQ(counters.read(i, false), counters.sums[i]) << "counter " << i << ", run " << run;
      for (auto left = random.below(4); left > 0; --left) counters.clock(false, false);
    }
  }
  EXPECT_FALSE(bench.failed());
}

TEST_F(LibTest, CountersAnswerWhileTheyCountAndWhileTheyAreCleared) {
  CounterBench counters(*this);
  int cleared = 0;
  for (int run = 0; run < 5000; ++run) {
    for (auto left = random.below(20); left > 0; --left) counters.clock(false, true);
    const auto index = static_cast<unsigned>(random.below(5));
    const std::uint32_t before = counters.sums[index];
    const bool clears = random.chance(3);
    const std::uint32_t lag = 2 * CounterBench::kMost[index];  // of the two registers before the sums
    const std::uint32_t most = before + CounterBench::kAnswerBefore * CounterBench::kMost[index];
    const std::uint32_t value = counters.read(index, true, clears ? static_cast<int>(random.below(4)) : -1);
    const bool old = value + lag >= before && value <= most;
    const bool fresh = clears && value <= counters.sums[index];
    ASSERT_TRUE(old || fresh) << value << " is neither of the old count " << before << " nor of the new one";
    cleared += fresh && !old;
  }
  EXPECT_GT(cleared, 100);
  EXPECT_FALSE(bench.failed());
}

// ----------------------------------------------------------------------------------------------------------------
// assertions

TEST_F(LibTest, AssertionsAcceptALegalStream) {
  bench->rule_data_i = 7;
  bench->rule_valid_i = 1;
  bench.step();
  bench.step();
  bench->rule_ready_i = 1;
  bench.step();
  bench->rule_valid_i = 0;
  bench->rule_data_i = 8;
  bench.step();
  EXPECT_FALSE(bench.failed());
}

TEST_F(LibTest, AssertionFiresWhenValidIsDropped) {
  bench->rule_valid_i = 1;
  bench.step();
  bench->rule_valid_i = 0;
  bench.step();
  EXPECT_TRUE(bench.failed());
}

TEST_F(LibTest, AssertionFiresWhenDataChange) {
  bench->rule_valid_i = 1;
  bench->rule_data_i = 1;
  bench.step();
  bench->rule_data_i = 2;
  bench.step();
  EXPECT_TRUE(bench.failed());
}

TEST_F(LibTest, AssertionFiresWhenAPropertyIsFalse) {
  bench->rule_true_i = 0;
  bench.step();
  EXPECT_TRUE(bench.failed());
}

TEST_F(LibTest, AssertionsSleepDuringReset) {
  bench->rst_ni = 0;
  bench->rule_true_i = 0;
  bench->rule_valid_i = 1;
  bench.step();
  bench->rst_ni = 1;
  bench->rule_true_i = 1;
  bench->rule_valid_i = 0;
  bench.step();
  EXPECT_FALSE(bench.failed());
}

TEST_F(LibTest, AssertionsOfTheModulesCheckTheirInputs) {
  bench->ram_read_i = 1;
  bench->ram_read_addr_i = 100;
  bench.step();
  EXPECT_TRUE(bench.failed()) << "a read beyond the RAM";

  for (int i = 0; i < kStreams; ++i) {
    if (std::string(kStreamNames[i]) == "queue") continue;  // takes what it has room for; nothing waits at its input
    Bench fresh(seed);
    idle(fresh);
    fresh.reset();
    // Fill the stream up, so that it stalls, then change the word that waits.
    put(fresh->in_valid_i, i, true);
    for (int clock = 0; clock < 100; ++clock) fresh.step();
    ASSERT_FALSE(fresh.failed());
    ASSERT_FALSE(bit(fresh->in_ready_o, i)) << kStreamNames[i];
    fresh->in_data_i[i] = ~fresh->in_data_i[i];
    fresh.step();
    EXPECT_TRUE(fresh.failed()) << kStreamNames[i];
  }
}

}  // namespace
}  // namespace retrace::cosim
