// The cache by itself: waiters that want a few lines of always the same sets, a memory that answers late, in any order and with
// errors. Every hit has the line's words, every waiter is answered, nobody is woken who does not wait.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "testbench/cosim/clocked.hpp"
#include "testbench/cosim/hold_off.hpp"
#include "Vtb_cache.h"

namespace retrace::cosim {
namespace {

// As testbench/cosim/sv/tb_cache.sv has them.
constexpr int kCaches = 2, kPorts = 4, kWaiters = 8, kWords = 2, kBeats = 4, kLatency = 3;
constexpr std::array kPortsOf{4, 1};
constexpr std::array kMshrsOf{4u, 2u};

using Bench = Clocked<Vtb_cache>;

std::uint32_t beat_of(unsigned key, unsigned beat) { return (key * 4 + beat) * 2654435761u + 12345u; }
std::uint64_t word_of(unsigned key, unsigned word) {
  return beat_of(key, 2 * word) | std::uint64_t{beat_of(key, 2 * word + 1)} << 32;
}

// The first lines and the last ones: their tags are each other's complements, which is what a tag reads as while it is written.
unsigned key_of(unsigned line) { return line % 2 ? 255 - line : line; }

template <typename Vector>
void put(Vector& vector, int at, int width, std::uint64_t value) {
  const std::uint64_t mask = ((std::uint64_t{1} << width) - 1) << at;
  vector = static_cast<Vector>((vector & ~mask) | value << at);
}
template <typename Vector>
std::uint64_t get(const Vector& vector, int at, int width) {
  return (vector >> at) & ((std::uint64_t{1} << width) - 1);
}

struct Waiter {
  enum { kIdle, kReady, kLooking, kWaiting } state = kIdle;
  unsigned key = 0, word = 0;
  std::uint64_t since = 0;  // clock in which it began to want its line
};

/// One cache, those who use it, and the memory behind it.
struct Side {
  int cache;
  Random random;
  HoldOff memory, wake;
  unsigned keys, error_percent;
  std::array<std::array<Waiter, kWaiters>, kPorts> waiters{};
  std::array<std::array<int, kLatency>, kPorts> looking{};  // who looked up one, two, three clocks ago; -1 for nobody
  std::set<unsigned> readable{};                            // lines that were fetched since the last flush
  std::map<unsigned, std::uint64_t> failed{};               // line -> clock in which the last beat of a bad fetch came
  struct Fetch {
    unsigned key, beat, error_beat;
  };
  std::map<unsigned, Fetch> fetches{};  // by miss register
  std::optional<unsigned> filling{};    // the miss register whose beat is on the bus
  std::uint64_t hits = 0, misses = 0, errors = 0, longest = 0;
  bool draining = false;

  int at(int port) const { return cache * kPorts + port; }

  void drive(Bench& bench) {
    for (int p = 0; p < kPortsOf[cache]; ++p) {
      for (auto& waiter : waiters[p])
        if (waiter.state == Waiter::kIdle && !draining && random.chance(4))
          waiter = {Waiter::kReady, key_of(static_cast<unsigned>(random.below(keys))),
                    static_cast<unsigned>(random.below(kWords)), bench.clock()};
      int who = -1;
      const auto first = static_cast<int>(random.below(kWaiters));
      for (int i = 0; i < kWaiters && who < 0; ++i)
        if (waiters[p][(first + i) % kWaiters].state == Waiter::kReady) who = (first + i) % kWaiters;
      if (who >= 0 && random.chance(8)) who = -1;
      put(bench->req_valid_i, at(p), 1, who >= 0);
      if (who >= 0) {
        auto& waiter = waiters[p][who];
        waiter.state = Waiter::kLooking;
        put(bench->req_key_i, 8 * at(p), 8, waiter.key);
        put(bench->req_word_i, at(p), 1, waiter.word);
        put(bench->req_waiter_i, 3 * at(p), 3, static_cast<unsigned>(who));
      }
      looking[p] = {who, looking[p][0], looking[p][1]};
      put(bench->wake_ready_i, at(p), 1, wake.next());
    }
    put(bench->fetch_ready_i, cache, 1, memory.next());
    filling.reset();
    if (!fetches.empty() && memory.next()) {
      auto fetch = fetches.begin();
      std::advance(fetch, static_cast<std::ptrdiff_t>(random.below(fetches.size())));
      filling = fetch->first;
      put(bench->fill_mshr_i, 3 * cache, 3, fetch->first);
      put(bench->fill_data_i, 32 * cache, 32, beat_of(fetch->second.key, fetch->second.beat));
      put(bench->fill_last_i, cache, 1, fetch->second.beat == kBeats - 1);
      put(bench->fill_error_i, cache, 1, fetch->second.beat == fetch->second.error_beat);
    }
    put(bench->fill_valid_i, cache, 1, filling.has_value());
  }

  // Between settle() and rise(). `answers`: who looked up three clocks before this one.
  void sample(Bench& bench, const std::array<int, kPorts>& answers) {
    for (int p = 0; p < kPortsOf[cache]; ++p) {
      ASSERT_EQ(get(bench->rsp_valid_o, at(p), 1) != 0, answers[p] >= 0) << "cache " << cache << " port " << p;
      if (answers[p] >= 0) {
        auto& waiter = waiters[p][answers[p]];
        if (get(bench->rsp_hit_o, at(p), 1)) {
          const std::uint64_t data = bench->rsp_data_o[2 * at(p)] | std::uint64_t{bench->rsp_data_o[2 * at(p) + 1]}
                                                                        << 32;
          ASSERT_EQ(data, word_of(waiter.key, waiter.word))
              << "cache " << cache << " port " << p << " key " << waiter.key << " clock " << bench.clock();
          ASSERT_TRUE(readable.contains(waiter.key)) << "a hit on a line that nobody has read, key " << waiter.key;
          ++hits;
          longest = std::max(longest, bench.clock() - waiter.since);
          waiter.state = Waiter::kIdle;
        } else {
          ++misses;
          waiter.state = Waiter::kWaiting;
        }
      }
      if (get(bench->wake_valid_o, at(p), 1) && get(bench->wake_ready_i, at(p), 1)) {
        auto& waiter = waiters[p][get(bench->wake_waiter_o, 3 * at(p), 3)];
        ASSERT_EQ(waiter.state, Waiter::kWaiting) << "cache " << cache << " port " << p << ": woken, and does not wait";
        waiter.state = Waiter::kReady;
        if (get(bench->wake_error_o, at(p), 1)) {
          ASSERT_TRUE(failed.contains(waiter.key) && failed[waiter.key] >= waiter.since)
              << "an error of another line or time, key " << waiter.key;
          ++errors;
          waiter.state = Waiter::kIdle;
        }
      }
      for (const auto& waiter : waiters[p])
        ASSERT_TRUE(waiter.state == Waiter::kIdle || bench.clock() - waiter.since < 20000)
            << "cache " << cache << " port " << p << ": starves";
    }
    if (filling) {
      auto& fetch = fetches.at(*filling);
      if (fetch.beat == fetch.error_beat) failed[fetch.key] = bench.clock();
      if (++fetch.beat == kBeats) {
        if (fetch.error_beat < kBeats)
          failed[fetch.key] = bench.clock();
        else
          readable.insert(fetch.key);
        fetches.erase(*filling);
      }
    }
    if (get(bench->fetch_valid_o, cache, 1) && get(bench->fetch_ready_i, cache, 1)) {
      const auto key = static_cast<unsigned>(get(bench->fetch_key_o, 8 * cache, 8));
      const auto mshr = static_cast<unsigned>(get(bench->fetch_mshr_o, 3 * cache, 3));
      ASSERT_LT(mshr, kMshrsOf[cache]);
      ASSERT_FALSE(fetches.contains(mshr)) << "miss register " << mshr << " fetches two lines";
      for (const auto& [other, fetch] : fetches) ASSERT_NE(fetch.key, key) << "fetched twice at once";
      fetches[mshr] = {key, 0,
                       random.below(100) < error_percent ? static_cast<unsigned>(random.below(kBeats)) : kBeats};
    }
  }

  bool idle() const {
    if (!fetches.empty()) return false;
    for (const auto& port : waiters)
      for (const auto& waiter : port)
        if (waiter.state != Waiter::kIdle) return false;
    return true;
  }
};

struct Load {
  const char* name;
  unsigned keys, error_percent, memory_percent, wake_percent;
};

class RtlCache : public testing::TestWithParam<Load> {};

TEST_P(RtlCache, AnswersEveryWaiterWithItsLine) {
  const auto load = GetParam();
  const std::uint64_t seed = test_seed();
  RecordProperty("seed", std::to_string(seed));
  Bench bench(seed);
  bench->flush_i = bench->req_valid_i = bench->fill_valid_i = 0;
  bench->fetch_ready_i = 0;
  bench->wake_ready_i = 0;
  bench.reset();
  std::vector<Side> sides;
  for (int c = 0; c < kCaches; ++c) {
    const auto side_seed = seed + 100 * static_cast<std::uint64_t>(c + 1);
    sides.push_back({c, Random(side_seed), HoldOff::random(side_seed + 1, load.memory_percent),
                     HoldOff::random(side_seed + 2, load.wake_percent), load.keys, load.error_percent});
    for (auto& port : sides.back().looking) port.fill(-1);
  }
  for (int round = 0; round < 3; ++round) {
    // A flush forgets every line.
    bench->req_valid_i = bench->fill_valid_i = 0;
    bench->flush_i = (1 << kCaches) - 1;
    bench.step();
    bench->flush_i = 0;
    bench.settle();
    for (int clock = 0; bench->flushing_o != 0; ++clock) {
      ASSERT_LT(clock, 1000);
      bench.step();
      bench.settle();
    }
    for (auto& side : sides) {
      side.readable.clear();
      side.draining = false;
    }
    for (int clock = 0; clock < 60000; ++clock) {
      if (clock == 40000)
        for (auto& side : sides) side.draining = true;
      if (clock > 40000 && sides[0].idle() && sides[1].idle()) break;
      std::vector<std::array<int, kPorts>> answers(kCaches);
      for (auto& side : sides) {
        for (int p = 0; p < kPorts; ++p)
          answers[static_cast<std::size_t>(side.cache)][static_cast<std::size_t>(p)] = side.looking[p][kLatency - 1];
        side.drive(bench);
      }
      bench.settle();
      for (auto& side : sides)
        ASSERT_NO_FATAL_FAILURE(side.sample(bench, answers[static_cast<std::size_t>(side.cache)])) << "seed " << seed;
      bench.rise();
      ASSERT_FALSE(bench.failed()) << "an assertion of the RTL failed in clock " << bench.clock() << ", seed " << seed;
    }
    for (const auto& side : sides)
      EXPECT_TRUE(side.idle()) << "cache " << side.cache << " has left somebody waiting, seed " << seed;
    // What was answered three clocks ago at the most is still on its way.
    bench->req_valid_i = bench->fill_valid_i = 0;
    for (int clock = 0; clock < 40; ++clock) bench.step();
    for (auto& side : sides)
      for (auto& port : side.looking) port.fill(-1);
  }
  for (const auto& side : sides) {
    std::printf("cache %d: %llu hits, %llu misses, %llu errors, longest wait %llu clocks\n", side.cache,
                static_cast<unsigned long long>(side.hits), static_cast<unsigned long long>(side.misses),
                static_cast<unsigned long long>(side.errors), static_cast<unsigned long long>(side.longest));
    EXPECT_GT(side.hits, 1000u);
    EXPECT_GT(side.misses, 100u);
    EXPECT_EQ(side.errors > 0, load.error_percent > 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Loads, RtlCache,
                         testing::Values(Load{"fits", 12, 0, 80, 90}, Load{"thrashes", 60, 0, 90, 90},
                                         Load{"errors", 30, 20, 70, 60}, Load{"slow_memory", 30, 2, 15, 90},
                                         Load{"slow_wake", 30, 2, 90, 10}, Load{"fast", 24, 1, 100, 100}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace retrace::cosim
