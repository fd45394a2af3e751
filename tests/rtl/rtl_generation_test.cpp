// Generations of contexts (rt_generation, with rt_context_pipe and rt_cache): a context gets on within the bound that docs/core.md states, whatever
// its rivals and the memory do. Rivals want lines of its set, a new one each time, and the memory knows when the one that is watched looks up: it answers
// in the worst moment for it. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <vector>

#include "testbench/sim/clocked.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vtb_generation.h"

namespace retrace::cosim {
namespace {

constexpr int kUnits = 2;
using Bench = Clocked<Vtb_generation>;

std::uint64_t word_of(std::uint64_t key) { return key * 0x9e3779b97f4a7c15u; }

struct Rivalry {
  unsigned rivals;  // contexts beside the one that is watched
  int answer;       // clocks from a look-up of the watched context to the answer of the memory; -1: whenever it likes
  unsigned take_percent;  // of the clocks in which the stage behind takes a context
};

/// Runs for `clocks`; the watched context comes again as soon as it has got on. Returns the longest wait of any context in clocks in which the stage
/// took contexts, and the longest from a request to its answer.
struct Waits {
  std::uint64_t watched = 0, others = 0, line = 0, got_on = 0, watched_got_on = 0;
};
Waits run(Bench& bench, int unit, const Rivalry& rivalry, std::uint64_t clocks, Random& random) {
  constexpr unsigned kWatched = 0;
  constexpr int kPatience = 64;  // the memory answers so late at the latest
  HoldOff take = HoldOff::random(random.bits(), rivalry.take_percent);
  Waits waits;
  struct Fetch {
    std::uint64_t key, since;
    unsigned mshr;
  };
  std::deque<Fetch> fetches;
  std::vector<std::optional<std::uint64_t>> since(static_cast<std::size_t>(rivalry.rivals) + 1);
  std::vector<std::uint64_t> keys(since.size());
  std::uint64_t flowing = 0, next_key = 1, looked = 0;
  const auto sets = static_cast<std::uint64_t>(bench->sets_o);
  const std::uint64_t begin = bench.clock();
  const auto bit = [unit](unsigned vector) { return (vector >> unit & 1) != 0; };
  const auto set_bit = [unit](auto& vector, bool value) {
    vector = static_cast<std::uint8_t>((vector & ~(1u << unit)) | unsigned{value} << unit);
  };
  bool draining = false;
  while (true) {
    if (bench.clock() - begin == clocks) draining = true;
    if (draining && std::none_of(since.begin(), since.end(), [](const auto& s) { return s.has_value(); })) break;
    if (bench.clock() - begin > 2 * clocks) {
      ADD_FAILURE() << "contexts never get on";
      break;
    }
    // The first that is out comes again, the watched one before all others.
    const auto out = std::find(since.begin(), since.end(), std::nullopt);
    const bool push = !draining && out != since.end();
    set_bit(bench->push_valid_i, push);
    if (push) {
      const auto who = static_cast<std::size_t>(out - since.begin());
      keys[who] = sets * (next_key++ % 100000);
      since[who] = flowing;
      bench->push_context_i[unit] = static_cast<std::uint8_t>(who);
      bench->push_key_i[unit] = static_cast<std::uint32_t>(keys[who]);
    }
    const bool taken = take.next();
    set_bit(bench->take_i, taken);
    set_bit(bench->fetch_ready_i, true);
    bool answers = false;
    if (!fetches.empty()) {
      const std::uint64_t waited = bench.clock() - fetches.front().since;
      const bool is_watched = fetches.front().key == keys[kWatched];
      answers =
          waited >= kPatience ||
          (rivalry.answer < 0
               ? random.chance(20)
               : is_watched || (looked != 0 && bench.clock() == looked + static_cast<std::uint64_t>(rivalry.answer)));
    }
    set_bit(bench->fill_valid_i, answers);
    if (answers) {
      bench->fill_mshr_i[unit] = static_cast<std::uint8_t>(fetches.front().mshr);
      bench->fill_data_i[unit] = word_of(fetches.front().key);
      waits.line = std::max(waits.line, bench.clock() - fetches.front().since);
      fetches.pop_front();
    }
    bench.settle();
    if (bit(bench->fetch_valid_o))
      fetches.push_back({bench->fetch_key_o[unit], bench.clock(), bench->fetch_mshr_o[unit]});
    if (bit(bench->look_o) && bench->look_context_o[unit] == kWatched) looked = bench.clock();
    if (bit(bench->gets_on_o)) {
      const std::size_t who = bench->gets_on_context_o[unit];
      if (who >= since.size() || !since[who].has_value()) {
        ADD_FAILURE() << "context " << who << " gets on and has not come";
        break;
      }
      EXPECT_EQ(bench->hit_data_o[unit], word_of(keys[who]));
      auto& longest = who == kWatched ? waits.watched : waits.others;
      longest = std::max(longest, flowing - *since[who]);
      ++waits.got_on;
      waits.watched_got_on += who == kWatched;
      since[who].reset();
    }
    if (since[kWatched].has_value()) waits.watched = std::max(waits.watched, flowing - *since[kWatched]);
    bench.rise();
    flowing += taken;
  }
  return waits;
}

class RtlGeneration : public testing::TestWithParam<int> {};

// The formula of docs/core.md for a unit with one cache.
std::uint64_t bound(Bench& bench, const Waits& waits) {
  constexpr std::uint64_t kTurn = 128;
  const auto contexts = static_cast<std::uint64_t>(bench->contexts_o);
  const std::uint64_t drain = contexts * (waits.line + static_cast<std::uint64_t>(bench->lease_o) + kTurn);
  return static_cast<std::uint64_t>(bench->period_o) + 2 * drain;
}

TEST_P(RtlGeneration, NobodyWaitsLongerThanTheBound) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  const int unit = GetParam();
  Random random(test_seed());
  Waits longest;
  std::uint64_t got_on = 0;
  for (const unsigned rivals : {5u, 15u}) {
    for (int answer = -1; answer < 40; ++answer) {
      const Rivalry rivalry{rivals, answer, answer % 4 == 3 ? 60u : 100u};
      Bench bench(random.bits());
      bench->push_valid_i = bench->fill_valid_i = bench->flush_i = 0;
      bench.reset();
      bench->flush_i = (1u << kUnits) - 1;
      bench.step();
      bench->flush_i = 0;
      while (bench->flushing_o != 0) bench.step();
      const Waits waits = run(bench, unit, rivalry, 40000, random);
      const std::uint64_t most = bound(bench, waits);
      EXPECT_LE(waits.watched, most) << rivals << " rivals, answers " << answer << " clocks after the look-up";
      EXPECT_LE(waits.others, most) << rivals << " rivals, answers " << answer << " clocks after the look-up";
      EXPECT_FALSE(bench.failed());
      longest.watched = std::max(longest.watched, waits.watched);
      longest.others = std::max(longest.others, waits.others);
      longest.line = std::max(longest.line, waits.line);
      got_on += waits.got_on;
      if (HasFatalFailure()) return;
    }
  }
  std::printf("watched %llu, others %llu clocks at the most; answers within %llu; %llu times a context got on\n",
              static_cast<unsigned long long>(longest.watched), static_cast<unsigned long long>(longest.others),
              static_cast<unsigned long long>(longest.line), static_cast<unsigned long long>(got_on));
  EXPECT_GT(got_on, 10000u);
}

INSTANTIATE_TEST_SUITE_P(Ways, RtlGeneration, testing::Range(0, kUnits),
                         [](const auto& info) { return std::to_string(info.param + 1); });

}  // namespace
}  // namespace retrace::cosim
