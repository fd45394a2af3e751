// The cache by itself, in every parameter set of testbench/sim/sv/tb_cache.sv: waiters that want a few lines of always the same sets, a memory that
// answers late, in any order and with errors. Every hit has the line's words, every waiter is answered, nobody is woken who does not wait. Where
// nothing stalls, clocks are bounded too: of a line, by the memory's answer and the cache's own latencies.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "testbench/sim/clocked.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vtb_cache.h"

namespace retrace::cosim {
namespace {

// As testbench/sim/sv/tb_cache.sv has them.
constexpr int kCaches = 14, kMaxPorts = 8, kKeys = 256, kLatency = 3;

using Bench = Clocked<Vtb_cache>;

struct Parameters {
  int ports, ways, mshrs, data_bits, word_bits, words, waiters, sets, lease_bits;
  int beats() const { return word_bits * words / data_bits; }
};
Parameters parameters_of(Bench& bench, int cache) {
  const auto& p = bench->parameter_o[cache];
  const auto at = [&](int i) { return static_cast<int>(p[i]); };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8)};
}

// A line is a row of 32-bit units.
std::uint32_t unit_of(unsigned key, unsigned unit) { return (key * 32 + unit) * 2654435761u + 12345u; }

template <typename Vector>
void set_bit(Vector& vector, int at, bool value) {
  vector = static_cast<Vector>((vector & ~(1u << at)) | static_cast<unsigned>(value) << at);
}
bool bit(unsigned vector, int at) { return (vector >> at & 1) != 0; }

struct Load {
  const char* name;
  unsigned keys;  // how many lines are wanted
  bool
      one_set;  // all of the same set; otherwise the first and the last, whose tags are each other's complements, which is what a
                // tag reads as while it is written
  unsigned error_percent, memory_percent, wake_percent;
  unsigned gone_percent;  // waiters that are woken and do not look again, as an any-hit ray that is done
  unsigned
      answer_clocks;  // 0: the memory answers in any order, when it likes. Otherwise in order, the first beat so long after its request, and
  // waiters never rest
  bool exact() const { return answer_clocks != 0; }
};

struct Waiter {
  enum { kIdle, kReady, kLooking, kWaiting } state = kIdle;
  unsigned key = 0, word = 0;
  std::uint64_t since = 0;  // clock in which it began to want its line
  std::uint64_t held = 0;   // Side::held in that clock
};

/// One cache, those who use it, and the memory behind it.
struct Side {
  int cache;
  Parameters is;
  Load load;
  Random random;
  HoldOff memory, wake;
  std::array<std::vector<Waiter>, kMaxPorts> waiters{};
  std::array<std::deque<int>, kMaxPorts> ready{};  // who looks up next
  std::array<std::array<int, kLatency>, kMaxPorts>
      looking{};                               // who looked up one, two, three clocks ago; -1 for nobody
  std::array<int, kMaxPorts> answers{};        // who is answered in this clock
  std::uint64_t held = 0;                      // clocks in which some were woken and none was taken
  std::set<unsigned> readable{};               // lines that were fetched since the last flush
  std::map<unsigned, std::uint64_t> failed{};  // line -> clock in which the last beat of a bad fetch came
  struct Fetch {
    unsigned key, beat, error_beat;
    std::uint64_t since;
  };
  std::map<unsigned, Fetch> fetches{};  // by miss register
  std::deque<unsigned> order{};         // miss registers in the order of their requests
  std::optional<unsigned> filling{};    // the miss register whose beat is on the bus
  std::uint64_t hits = 0, misses = 0, errors = 0, gone = 0, fills = 0, longest = 0, waited = 0;
  std::uint64_t busy_hits = 0, busy_fills = 0;  // before draining
  bool draining = false;

  unsigned key_of(unsigned line) const {
    if (load.one_set) return line * static_cast<unsigned>(is.sets) % kKeys;
    return line % 2 ? kKeys - 1 - line : line;
  }

  void begin() {
    for (auto& port : waiters) port.assign(static_cast<std::size_t>(is.waiters), {});
    for (auto& port : ready) port.clear();
    for (auto& port : looking) port.fill(-1);
    readable.clear();
    draining = false;
  }

  void drive(Bench& bench) {
    for (int p = 0; p < is.ports; ++p) {
      for (int w = 0; w < is.waiters; ++w) {
        auto& waiter = waiters[p][static_cast<std::size_t>(w)];
        if (waiter.state != Waiter::kIdle || draining || !(load.exact() || random.chance(4))) continue;
        waiter = {Waiter::kReady, key_of(static_cast<unsigned>(random.below(load.keys))),
                  static_cast<unsigned>(random.below(static_cast<std::uint64_t>(is.words))), bench.clock(), held};
        ready[p].push_back(w);
      }
      int who = -1;
      if (!ready[p].empty() && (load.exact() || !random.chance(8))) {
        const auto at =
            ready[p].begin() + (load.exact() ? 0 : static_cast<std::ptrdiff_t>(random.below(ready[p].size())));
        who = *at;
        ready[p].erase(at);
        auto& waiter = waiters[p][static_cast<std::size_t>(who)];
        waiter.state = Waiter::kLooking;
        bench->req_key_i[cache][p] = static_cast<std::uint8_t>(waiter.key);
        bench->req_word_i[cache][p] = static_cast<std::uint8_t>(waiter.word);
        bench->req_waiter_i[cache][p] = static_cast<std::uint8_t>(who);
      }
      set_bit(bench->req_valid_i[cache], p, who >= 0);
      answers[p] = looking[p][kLatency - 1];
      looking[p] = {who, looking[p][0], looking[p][1]};
      set_bit(bench->wake_ready_i[cache / 4], cache % 4 * kMaxPorts + p, wake.next());
    }
    set_bit(bench->fetch_ready_i, cache, memory.next());
    filling.reset();
    if (load.exact()) {
      if (!order.empty() && bench.clock() >= fetches.at(order.front()).since + load.answer_clocks)
        filling = order.front();
    } else if (!fetches.empty() && memory.next()) {
      filling = std::next(fetches.begin(), static_cast<std::ptrdiff_t>(random.below(fetches.size())))->first;
    }
    if (filling) {
      const Fetch& fetch = fetches.at(*filling);
      const unsigned units = static_cast<unsigned>(is.data_bits) / 32;
      bench->fill_mshr_i[cache] = static_cast<std::uint8_t>(*filling);
      for (unsigned i = 0; i < units; ++i) bench->fill_data_i[cache][i] = unit_of(fetch.key, fetch.beat * units + i);
      set_bit(bench->fill_last_i, cache, static_cast<int>(fetch.beat) == is.beats() - 1);
      set_bit(bench->fill_error_i, cache, fetch.beat == fetch.error_beat);
    }
    set_bit(bench->fill_valid_i, cache, filling.has_value());
  }

  // Between settle() and rise().
  void sample(Bench& bench) {
    bool woken_here = false, taken = false;
    for (int p = 0; p < is.ports; ++p) {
      const bool wakes = bit(bench->wake_valid_o[cache], p);
      woken_here = woken_here || wakes;
      taken = taken || (wakes && bit(bench->wake_ready_i[cache / 4], cache % 4 * kMaxPorts + p));
      ASSERT_EQ(bit(bench->rsp_valid_o[cache], p), answers[p] >= 0) << "port " << p;
      if (answers[p] >= 0) ASSERT_NO_FATAL_FAILURE(answered(bench, p));
      if (wakes && bit(bench->wake_ready_i[cache / 4], cache % 4 * kMaxPorts + p))
        ASSERT_NO_FATAL_FAILURE(woken(bench, p));
    }
    if (woken_here && !taken) ++held;
    if (filling) {
      auto& fetch = fetches.at(*filling);
      if (fetch.beat == fetch.error_beat) failed[fetch.key] = bench.clock();
      if (static_cast<int>(++fetch.beat) == is.beats()) {
        if (static_cast<int>(fetch.error_beat) < is.beats())
          failed[fetch.key] = bench.clock();
        else
          readable.insert(fetch.key);
        ++fills;
        if (!draining) ++busy_fills;
        fetches.erase(*filling);
        order.erase(std::find(order.begin(), order.end(), *filling));
      }
    }
    if (bit(bench->fetch_valid_o, cache) && bit(bench->fetch_ready_i, cache)) {
      const unsigned key = bench->fetch_key_o[cache], mshr = bench->fetch_mshr_o[cache];
      const auto beats = static_cast<unsigned>(is.beats());
      ASSERT_LT(static_cast<int>(mshr), is.mshrs);
      ASSERT_FALSE(fetches.contains(mshr)) << "miss register " << mshr << " fetches two lines";
      for (const auto& [other, fetch] : fetches) ASSERT_NE(fetch.key, key) << "fetched twice at once";
      const bool error = random.below(100) < load.error_percent;
      fetches[mshr] = {key, 0, error ? static_cast<unsigned>(random.below(beats)) : beats, bench.clock()};
      order.push_back(mshr);
    }
  }

  void answered(Bench& bench, int p) {
    auto& waiter = waiters[p][static_cast<std::size_t>(answers[p])];
    if (!bit(bench->rsp_hit_o[cache], p)) {
      ++misses;
      waiter.state = Waiter::kWaiting;
      return;
    }
    const unsigned units = static_cast<unsigned>(is.word_bits) / 32;
    for (unsigned i = 0; i < units; ++i)
      ASSERT_EQ(bench->rsp_data_o[cache][p][i], unit_of(waiter.key, waiter.word * units + i))
          << "port " << p << " key " << waiter.key << " word " << waiter.word << " unit " << i;
    ASSERT_TRUE(readable.contains(waiter.key)) << "a hit on a line that nobody has read, key " << waiter.key;
    ++hits;
    if (!draining) ++busy_hits;
    ended(bench, waiter);
  }

  void woken(Bench& bench, int p) {
    const int who = bench->wake_waiter_o[cache][p];
    ASSERT_LT(who, is.waiters);
    auto& waiter = waiters[p][static_cast<std::size_t>(who)];
    ASSERT_EQ(waiter.state, Waiter::kWaiting) << "port " << p << ": woken, and does not wait";
    if (bit(bench->wake_error_o[cache], p)) {
      ASSERT_TRUE(failed.contains(waiter.key) && failed[waiter.key] >= waiter.since)
          << "an error of another line or time, key " << waiter.key;
      ++errors;
      ended(bench, waiter);
    } else if (random.below(100) < load.gone_percent) {
      ++gone;
      ended(bench, waiter);
    } else {
      waiter.state = Waiter::kReady;
      ready[p].push_back(who);
    }
  }

  void ended(Bench& bench, Waiter& waiter) {
    longest = std::max(longest, bench.clock() - waiter.since);
    waited += bench.clock() - waiter.since;
    waiter.state = Waiter::kIdle;
  }

  // Clocks that the one who waits longest has waited, but for those in which some are woken and none is taken: the lease stands still in them.
  std::uint64_t oldest(const Bench& bench) const {
    std::uint64_t oldest = 0;
    for (const auto& port : waiters)
      for (const auto& waiter : port)
        if (waiter.state != Waiter::kIdle)
          oldest = std::max(oldest, bench.clock() - waiter.since - (held - waiter.held));
    return oldest;
  }
  bool idle() const {
    if (!fetches.empty()) return false;
    for (const auto& port : waiters)
      for (const auto& waiter : port)
        if (waiter.state != Waiter::kIdle) return false;
    return true;
  }
};

class RtlCache : public testing::TestWithParam<Load> {
 protected:
  RtlCache() : seed(test_seed()), bench(seed) {
    bench->flush_i = bench->fill_valid_i = bench->fetch_ready_i = 0;
    for (int c = 0; c < kCaches; ++c) bench->req_valid_i[c] = bench->wake_ready_i[c / 4] = 0;
    bench.reset();
    const Load& load = GetParam();
    for (int c = 0; c < kCaches; ++c) {
      const auto side_seed = seed + 100 * static_cast<std::uint64_t>(c + 1);
      sides.push_back({c, parameters_of(bench, c), load, Random(side_seed),
                       HoldOff::random(side_seed + 1, load.memory_percent),
                       HoldOff::random(side_seed + 2, load.wake_percent)});
    }
  }
  void TearDown() override {
    if (HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  }

  static std::string name(const Side& side) {
    const auto& is = side.is;
    return "cache " + std::to_string(side.cache) + " (" + std::to_string(is.ports) + " ports, " +
           std::to_string(is.ways) + " ways, " + std::to_string(is.mshrs) + " miss registers, " +
           std::to_string(is.words) + " words of " + std::to_string(is.word_bits) + ", bus " +
           std::to_string(is.data_bits) + ", " + std::to_string(is.waiters) + " waiters)";
  }

  static void report(const Side& side) {
    std::printf(
        "cache %d: %llu hits, %llu misses, %llu fills, %llu errors, %llu gone, mean wait %.0f, longest %llu clocks\n",
        side.cache, static_cast<unsigned long long>(side.hits), static_cast<unsigned long long>(side.misses),
        static_cast<unsigned long long>(side.fills), static_cast<unsigned long long>(side.errors),
        static_cast<unsigned long long>(side.gone),
        static_cast<double>(side.waited) /
            static_cast<double>(std::max<std::uint64_t>(1, side.hits + side.errors + side.gone)),
        static_cast<unsigned long long>(side.longest));
  }

  // Nobody asks, nothing comes; what was answered at the last is still on its way.
  void rest(int clocks) {
    for (int c = 0; c < kCaches; ++c) bench->req_valid_i[c] = 0;
    bench->fill_valid_i = 0;
    for (int clock = 0; clock < clocks; ++clock) bench.step();
  }

  // A flush forgets every line.
  void flush() {
    rest(40);
    bench->flush_i = (1 << kCaches) - 1;
    bench.step();
    bench->flush_i = 0;
    bench.settle();
    for (int clock = 0; bench->flushing_o != 0; ++clock) {
      ASSERT_LT(clock, 1000);
      bench.step();
      bench.settle();
    }
    for (auto& side : sides) side.begin();
  }

  void step() {
    for (auto& side : sides) side.drive(bench);
    bench.settle();
    for (auto& side : sides) ASSERT_NO_FATAL_FAILURE(side.sample(bench)) << name(side) << ", clock " << bench.clock();
    bench.rise();
    ASSERT_FALSE(bench.failed()) << "an assertion of the RTL failed in clock " << bench.clock();
  }

  bool idle() const {
    return std::all_of(sides.begin(), sides.end(), [](const Side& side) { return side.idle(); });
  }

  std::uint64_t seed;
  Bench bench;
  std::vector<Side> sides;
};

TEST_P(RtlCache, AnswersEveryWaiterWithItsLine) {
  constexpr int kRounds = 3, kBusy = 6000, kDrained = 30000;
  // What bounds a wait where things stall at random is chance, so this is no more than a watch dog.
  constexpr std::uint64_t kPatience = 30000;
  const Load& load = GetParam();
  for (int round = 0; round < kRounds; ++round) {
    ASSERT_NO_FATAL_FAILURE(flush());
    for (int clock = 0; clock < kBusy + kDrained; ++clock) {
      if (clock == kBusy)
        for (auto& side : sides) side.draining = true;
      if (clock > kBusy && idle()) break;
      ASSERT_NO_FATAL_FAILURE(step());
      if (clock % 512 != 0) continue;
      for (const auto& side : sides) ASSERT_LT(side.oldest(bench), kPatience) << name(side) << ": starves";
    }
    for (const auto& side : sides) EXPECT_TRUE(side.idle()) << name(side) << " has left somebody waiting";
  }
  for (const auto& side : sides) {
    report(side);
    EXPECT_GT(side.hits, 200u) << name(side);
    EXPECT_GT(side.misses, 100u) << name(side);
    EXPECT_EQ(side.errors > 0, load.error_percent > 0) << name(side);
    EXPECT_EQ(side.gone > 0, load.gone_percent > 0) << name(side);
  }
}

// What a line takes beside the memory, in clocks: from the look-up to the request 9, from the last beat to the waiter's wake 6, from there to its
// hit 5, until another is woken that needs the way 16, to its look-up 4.
constexpr std::uint64_t kTurn = 9 + 6 + 5 + 16 + 4;

using RtlCacheClocks = RtlCache;

// Waiters never rest and nothing stalls, so always at least one line is on its way, and each that comes is hit: whatever the sets and ports, a hit
// takes no longer than the memory takes for a line, and a turn.
TEST_P(RtlCacheClocks, AHitForEveryLine) {
  constexpr std::uint64_t kRounds = 2, kBusy = 8000;
  for (std::uint64_t round = 0; round < kRounds; ++round) {
    ASSERT_NO_FATAL_FAILURE(flush());
    for (std::uint64_t clock = 0; clock < kBusy; ++clock) ASSERT_NO_FATAL_FAILURE(step());
    for (auto& side : sides) side.draining = true;
    for (std::uint64_t clock = 0; clock < 8 * kBusy && !idle(); ++clock) ASSERT_NO_FATAL_FAILURE(step());
    for (const auto& side : sides) EXPECT_TRUE(side.idle()) << name(side) << " has left somebody waiting";
  }
  for (const auto& side : sides) {
    const auto line = GetParam().answer_clocks + static_cast<std::uint64_t>(side.is.beats()) + kTurn;
    const std::uint64_t at_least = kRounds * kBusy / line;
    report(side);
    EXPECT_GE(side.busy_fills, at_least) << name(side);
    EXPECT_GE(side.busy_hits, side.busy_fills - static_cast<std::uint64_t>(side.is.mshrs) * kRounds) << name(side);
  }
}

using RtlCacheLease = RtlCache;

// Whoever asked for the lines of a set is gone when they come; who wants another line of the set waits for no longer than the lease of those.
TEST_P(RtlCacheLease, LinesNobodyComesForCloseASetForTwoSixteenthsOfTheLease) {
  ASSERT_NO_FATAL_FAILURE(flush());
  const auto ask = [&](Side& side, int who, unsigned line) {
    side.waiters[0][static_cast<std::size_t>(who)] = {Waiter::kReady, side.key_of(line), 0, bench.clock()};
    side.ready[0].push_back(who);
  };
  const auto until_idle = [&] {
    constexpr int kPatience = 10000;
    int clock = 0;
    for (; clock < kPatience && !idle(); ++clock) ASSERT_NO_FATAL_FAILURE(step());
    ASSERT_LT(clock, kPatience);
  };
  for (auto& side : sides) {
    side.draining = true;
    side.load.gone_percent = 100;
    for (int way = 0; way < side.is.ways; ++way) ask(side, way, static_cast<unsigned>(way));
  }
  ASSERT_NO_FATAL_FAILURE(until_idle());
  for (auto& side : sides) {
    EXPECT_EQ(side.gone, static_cast<std::uint64_t>(side.is.ways)) << name(side);
    side.load.gone_percent = 0;
    side.longest = 0;
    ask(side, side.is.ways, static_cast<unsigned>(side.is.ways));
  }
  ASSERT_NO_FATAL_FAILURE(until_idle());
  for (const auto& side : sides) {
    const auto line = GetParam().answer_clocks + static_cast<std::uint64_t>(side.is.beats()) + kTurn;
    EXPECT_EQ(side.hits, 1u) << name(side);
    EXPECT_LE(side.longest, 2 * (std::uint64_t{1} << (side.is.lease_bits - 4)) + line) << name(side);
  }
}

void PrintTo(const Load& load, std::ostream* out) { *out << load.name; }
std::string name_of(const testing::TestParamInfo<Load>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(
    Loads, RtlCache,
    testing::Values(Load{"fits", 12, false, 0, 80, 90, 0, 0}, Load{"thrashes", 60, false, 0, 90, 90, 0, 0},
                    Load{"errors", 30, false, 20, 70, 60, 0, 0}, Load{"gone", 30, false, 2, 90, 90, 10, 0},
                    Load{"slow_memory", 30, false, 2, 15, 90, 0, 0}, Load{"slow_wake", 30, false, 2, 90, 10, 0, 0},
                    Load{"fast", 24, false, 1, 100, 100, 0, 0}),
    name_of);
INSTANTIATE_TEST_SUITE_P(Loads, RtlCacheClocks,
                         testing::Values(Load{"one_set_20", 8, true, 0, 100, 100, 0, 20},
                                         Load{"one_set_200", 8, true, 0, 100, 100, 0, 200},
                                         Load{"all_sets_20", 64, false, 0, 100, 100, 0, 20},
                                         Load{"all_sets_100", 64, false, 0, 100, 100, 0, 100}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Loads, RtlCacheLease, testing::Values(Load{"one_set_20", 8, true, 0, 100, 100, 0, 20}),
                         name_of);

}  // namespace
}  // namespace retrace::cosim
