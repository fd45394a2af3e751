// The parts of the board by themselves: serial receiver and sender at bent rates and with glitches, memory and multiplexer with two masters that
// stall, collide and ask for what is not there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "testbench/sim/clocked.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vtb_board.h"

namespace retrace::cosim {
namespace {

using Bench = Clocked<Vtb_board>;
constexpr int kLines = 3, kMasters = 2;

struct BoardUnits : testing::Test {
  BoardUnits() : seed(test_seed()), bench(seed), random(seed) {
    bench->tx_valid_i = 0;
    bench->rx_pin_i = (1 << kLines) - 1;
    bench->ar_valid_i = bench->aw_valid_i = bench->w_valid_i = 0;
    bench->r_ready_i = bench->b_ready_i = (1 << kMasters) - 1;
    bench.reset();
  }
  void TearDown() override {
    EXPECT_FALSE(bench.failed()) << "an assertion of the RTL has failed";
    if (HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  }
  double clocks_per_bit(int line) { return bench->divisor_o[line] / 256.0; }

  std::uint64_t seed;
  Bench bench;
  Random random;
};

bool bit(std::uint64_t vector, int i) { return (vector >> i) & 1; }

// ------------------------------------------------------------------------------------------------------------------- serial

TEST_F(BoardUnits, SenderToReceiverAtEveryRate) {
  constexpr std::size_t kBytes = 300;
  std::array<std::vector<std::uint8_t>, kLines> sent, received;
  std::array<bool, kLines> offered{};
  for (std::uint64_t clock = 0; clock < 120000; ++clock) {
    for (int i = 0; i < kLines; ++i) {
      if (!offered[i] && sent[i].size() < kBytes && (sent[i].size() % 3 != 0 || random.chance(40))) {
        offered[i] = true;
        bench->tx_data_i = (bench->tx_data_i & ~(0xffu << (8 * i))) | static_cast<std::uint32_t>(random.below(256))
                                                                          << (8 * i);
      }
      bench->tx_valid_i = (bench->tx_valid_i & ~(1 << i)) | static_cast<int>(offered[i]) << i;
    }
    bench->rx_pin_i = bench->tx_pin_o;
    bench.settle();
    for (int i = 0; i < kLines; ++i) {
      if (bit(bench->rx_valid_o, i)) {
        ASSERT_FALSE(bit(bench->rx_error_o, i)) << "line " << i;
        received[i].push_back(static_cast<std::uint8_t>(bench->rx_data_o >> (8 * i)));
      }
      if (offered[i] && bit(bench->tx_ready_o, i)) {
        offered[i] = false;
        sent[i].push_back(static_cast<std::uint8_t>(bench->tx_data_i >> (8 * i)));
      }
    }
    bench.rise();
  }
  for (int i = 0; i < kLines; ++i) {
    EXPECT_EQ(sent[i].size(), kBytes);
    EXPECT_EQ(received[i], sent[i]) << "line " << i;
  }
}

/// Levels of a line that sends `bytes` with bits of `bit` clocks, edges rounded to clocks; `gap` idle bits between bytes.
std::vector<bool> levels(const std::vector<std::uint8_t>& bytes, double bit, double phase, int gap) {
  std::vector<bool> line(static_cast<std::size_t>(3 * bit), true);
  double at = static_cast<double>(line.size()) + phase;
  for (const std::uint8_t byte : bytes) {
    const unsigned shift = (1u << 9) | byte << 1;
    for (int i = 0; i < 10 + gap; ++i) {
      at += bit;
      while (static_cast<double>(line.size()) < at) line.push_back(i >= 10 || (shift >> i & 1) != 0);
    }
  }
  line.insert(line.end(), static_cast<std::size_t>(12 * bit), true);
  return line;
}

TEST_F(BoardUnits, ReceiverStandsASenderThatIsOff) {
  for (const double off : {-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03}) {
    std::vector<std::uint8_t> bytes(200);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    const auto line =
        levels(bytes, clocks_per_bit(2) * (1 + off), random.real(0, 1), static_cast<int>(random.below(2)));
    std::vector<std::uint8_t> received;
    for (const bool level : line) {
      bench->rx_pin_i = (level ? 4 : 0) | 3;
      bench.step();
      if (bit(bench->rx_valid_o, 2)) {
        EXPECT_FALSE(bit(bench->rx_error_o, 2)) << "off by " << off;
        received.push_back(static_cast<std::uint8_t>(bench->rx_data_o >> 16));
      }
    }
    EXPECT_EQ(received, bytes) << "off by " << off;
  }
}

TEST_F(BoardUnits, GlitchesOfOneClockAreNoBits) {
  std::vector<std::uint8_t> bytes(300);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
  const auto line = levels(bytes, clocks_per_bit(2), 0, 2);
  std::vector<std::uint8_t> received;
  std::size_t next = 20;
  for (std::size_t i = 0; i < line.size(); ++i) {
    bool level = line[i];
    if (i == next) {
      // Not beside an edge, where a glitch moves it by a clock too: that is the test above.
      if (i > 3 && i + 3 < line.size() && line[i - 2] == line[i + 2] && line[i - 1] == level && line[i + 1] == level)
        level = !level;
      next = i + 6 + random.below(40);
    }
    bench->rx_pin_i = (level ? 4 : 0) | 3;
    bench.step();
    if (bit(bench->rx_valid_o, 2)) {
      EXPECT_FALSE(bit(bench->rx_error_o, 2));
      received.push_back(static_cast<std::uint8_t>(bench->rx_data_o >> 16));
    }
  }
  EXPECT_EQ(received, bytes);
}

TEST_F(BoardUnits, BreaksAreErrorsAndTheLineRecovers) {
  const auto run = [&](bool level, int clocks, std::vector<int>& events) {
    for (int i = 0; i < clocks; ++i) {
      bench->rx_pin_i = level ? 7 : 0;
      bench.step();
      for (int line = 0; line < kLines; ++line) {
        if (bit(bench->rx_valid_o, line)) events.push_back(bit(bench->rx_error_o, line) ? -1 : 1);
      }
    }
  };
  std::vector<int> events;
  run(true, 400, events);
  run(false, 3000, events);  // one break, however long
  run(true, 400, events);
  EXPECT_EQ(events, (std::vector<int>{-1, -1, -1}));
}

// ------------------------------------------------------------------------------------------------------------------- memory

struct Burst {
  bool write = false;
  std::uint64_t address = 0;
  int beats = 1;
  int id = 0;
  unsigned size = 3, kind = 1;
  std::vector<std::uint64_t> data{};
  std::vector<std::uint8_t> strobes{};
  bool outside = false, crosses = false;  // 4 KB
  unsigned resp() const { return outside ? 3 : crosses || size != 3 || kind != 1 ? 2 : 0; }
  bool holds_words() const { return !outside && !crosses; }
};

/// One master: random bursts within the words it owns, never a read and a write of the same word at once.
class Master {
 public:
  Master(int index, std::uint64_t seed, std::uint64_t base, std::uint64_t bytes, unsigned percent)
      : index_(index), random_(seed), base_(base), words_(bytes / 8), memory_(words_, 0), active_(percent) {}

  void drive(Bench& bench) {
    if (!ar_ && reads_.size() < 12 && active()) ar_ = make(false);
    if (!aw_ && unsent_.size() + writes_.size() < 12 && active()) {
      aw_ = make(true);
      if (aw_) unsent_.push_back(*aw_);
    }
    set(bench->ar_valid_i, ar_.has_value());
    if (ar_) {
      bench->ar_id_i[index_] = static_cast<std::uint8_t>(ar_->id);
      bench->ar_addr_i[index_] = ar_->address;
      bench->ar_len_i[index_] = static_cast<std::uint8_t>(ar_->beats - 1);
      bench->ar_size_i[index_] = static_cast<std::uint8_t>(ar_->size);
      bench->ar_burst_i[index_] = static_cast<std::uint8_t>(ar_->kind);
    }
    set(bench->aw_valid_i, aw_.has_value());
    if (aw_) {
      bench->aw_id_i[index_] = static_cast<std::uint8_t>(aw_->id);
      bench->aw_addr_i[index_] = aw_->address;
      bench->aw_len_i[index_] = static_cast<std::uint8_t>(aw_->beats - 1);
      bench->aw_size_i[index_] = static_cast<std::uint8_t>(aw_->size);
      bench->aw_burst_i[index_] = static_cast<std::uint8_t>(aw_->kind);
    }
    if (!w_ && !unsent_.empty() && active()) w_ = true;
    set(bench->w_valid_i, w_);
    if (w_) {
      const Burst& burst = unsent_.front();
      bench->w_data_i[index_] = burst.data[beat_];
      bench->w_strb_i[index_] = burst.strobes[beat_];
      set(bench->w_last_i, static_cast<int>(beat_) + 1 == burst.beats);
    }
    set(bench->r_ready_i, active());
    set(bench->b_ready_i, active());
  }

  // Between settle() and rise().
  void sample(Bench& bench) {
    if (ar_ && bit(bench->ar_ready_o, index_)) {
      reads_.push_back(*ar_);
      ar_.reset();
    }
    if (aw_ && bit(bench->aw_ready_o, index_)) aw_.reset();
    if (w_ && bit(bench->w_ready_o, index_)) {
      w_ = false;
      if (static_cast<int>(++beat_) == unsent_.front().beats) {
        writes_.push_back(unsent_.front());
        unsent_.pop_front();
        beat_ = 0;
      }
    }
    if (bit(bench->r_valid_o, index_) && bit(bench->r_ready_i, index_)) read(bench);
    if (bit(bench->b_valid_o, index_) && bit(bench->b_ready_i, index_)) {
      ASSERT_FALSE(writes_.empty()) << "an answer nobody waits for";
      const Burst burst = writes_.front();
      writes_.pop_front();
      ASSERT_EQ(bench->b_id_o, burst.id);
      ASSERT_EQ(bench->b_resp_o, burst.resp());
      for (int i = 0; i < burst.beats; ++i) {
        const std::uint64_t word = (burst.address - base_) / 8 + static_cast<std::uint64_t>(i);
        if (burst.holds_words()) busy_.erase(busy_.find(word));
        if (burst.resp() != 0) continue;
        for (int k = 0; k < 8; ++k) {
          if (!bit(burst.strobes[static_cast<std::size_t>(i)], k)) continue;
          const std::uint64_t mask = 0xffull << (8 * k);
          memory_[word] = (memory_[word] & ~mask) | (burst.data[static_cast<std::size_t>(i)] & mask);
        }
      }
      ++done;
    }
  }
  bool quiet() const { return !ar_ && !aw_ && reads_.empty() && writes_.empty() && unsent_.empty(); }

  std::uint64_t done = 0, errors = 0;
  bool stop = false;

 private:
  bool active() { return random_.below(100) < active_; }
  template <class Vector>
  void set(Vector& vector, bool value) {
    vector = static_cast<Vector>((vector & ~(1u << index_)) | static_cast<unsigned>(value) << index_);
  }

  std::optional<Burst> make(bool write) {
    if (stop) return std::nullopt;
    Burst burst;
    burst.write = write;
    burst.beats = static_cast<int>(1 + random_.below(random_.chance(4) ? 32 : 4));
    burst.id = static_cast<int>(random_.below(128));
    // Masters own alternate 256 bytes, so a burst of 32 beats just fits.
    std::uint64_t word = (random_.below(words_ / 64) * 2 + static_cast<std::uint64_t>(index_)) * 32;
    word += random_.below(33 - static_cast<std::uint64_t>(burst.beats));
    burst.address = base_ + 8 * word;
    if (random_.chance(12)) {
      burst.outside = true;
      constexpr std::uint64_t kAll = (1ull << 40) - 1;
      burst.address = (random_.chance(2) ? base_ + 8 * words_ + 8 * random_.below(512)
                                         : burst.address ^ (1ull << (13 + random_.below(27)))) &
                      kAll;
    } else if (burst.beats > 1 && random_.chance(12)) {
      // The last words of a page, the memory's last too.
      burst.crosses = true;
      const std::uint64_t before = 1 + random_.below(static_cast<std::uint64_t>(burst.beats) - 1);
      burst.address = base_ + 4096 * (1 + random_.below(words_ / 512)) - 8 * before;
    } else {
      if (random_.chance(15)) burst.size = static_cast<unsigned>(random_.below(8));
      if (random_.chance(15)) burst.kind = static_cast<unsigned>(random_.below(3));
      for (int i = 0; i < burst.beats; ++i) {
        if (busy_.count(word + static_cast<std::uint64_t>(i)) != 0) return std::nullopt;
      }
      for (int i = 0; i < burst.beats; ++i) busy_.insert(word + static_cast<std::uint64_t>(i));
      if (burst.kind == 1 && burst.size == 3) burst.address += random_.below(8);  // aligned down
    }
    for (int i = 0; write && i < burst.beats; ++i) {
      burst.data.push_back(random_.bits());
      burst.strobes.push_back(random_.chance(3) ? static_cast<std::uint8_t>(random_.below(256)) : 0xff);
    }
    return burst;
  }

  void read(Bench& bench) {
    ASSERT_FALSE(reads_.empty()) << "data nobody has asked for";
    const Burst& burst = reads_.front();
    ASSERT_EQ(bench->r_id_o, burst.id);
    ASSERT_EQ(bench->r_resp_o, burst.resp());
    ASSERT_EQ(bench->r_last_o, read_beat_ + 1 == burst.beats);
    const std::uint64_t word = (burst.address - base_) / 8 + static_cast<std::uint64_t>(read_beat_);
    if (burst.resp() != 0) {
      ASSERT_EQ(bench->r_data_o, 0u) << "data with an error";
      ++errors;
    } else {
      ASSERT_EQ(bench->r_data_o, memory_[word]) << "word " << word << " master " << index_;
    }
    if (++read_beat_ < burst.beats) return;
    read_beat_ = 0;
    for (int i = 0; i < burst.beats && burst.holds_words(); ++i)
      busy_.erase(busy_.find((burst.address - base_) / 8 + static_cast<std::uint64_t>(i)));
    reads_.pop_front();
    ++done;
  }

  int index_;
  Random random_;
  std::uint64_t base_, words_;
  std::vector<std::uint64_t> memory_;
  unsigned active_;
  std::optional<Burst> ar_, aw_;
  std::deque<Burst> reads_, unsent_, writes_;
  std::multiset<std::uint64_t> busy_;
  bool w_ = false;
  std::size_t beat_ = 0;
  int read_beat_ = 0;
};

void write_words(Bench& bench, std::uint64_t address, const std::vector<std::uint64_t>& words) {
  for (std::size_t at = 0; at < words.size(); ++at) {
    bench->aw_valid_i = bench->w_valid_i = 1;
    bench->aw_id_i[0] = 0;
    bench->aw_addr_i[0] = address + 8 * at;
    bench->aw_len_i[0] = 0;
    bench->aw_size_i[0] = 3;
    bench->aw_burst_i[0] = 1;
    bench->w_data_i[0] = words[at];
    bench->w_strb_i[0] = 0xff;
    bench->w_last_i = 1;
    int patience = 1000;
    for (bool answered = false; !answered;) {
      ASSERT_GT(--patience, 0) << "a write is not answered";
      bench.settle();
      const bool aw = bench->aw_ready_o & 1, w = bench->w_ready_o & 1;
      answered = bench->b_valid_o & 1;
      bench.rise();
      if (aw) bench->aw_valid_i = 0;
      if (w) bench->w_valid_i = 0;
    }
  }
}

TEST_F(BoardUnits, MemoryWithTwoMastersThatStall) {
  bench.settle();
  const std::uint64_t base = bench->base_o, bytes = static_cast<std::uint64_t>(bench->bytes_o);
  write_words(bench, base, std::vector<std::uint64_t>(bytes / 8, 0));
  for (const unsigned percent : {100u, 50u, 10u}) {
    std::vector<Master> masters;
    for (int i = 0; i < kMasters; ++i)
      masters.emplace_back(i, seed + 10 * percent + static_cast<std::uint64_t>(i), base, bytes, percent);
    // A fresh reference begins with what is there: zeros.
    write_words(bench, base, std::vector<std::uint64_t>(bytes / 8, 0));
    for (int clock = 0; clock < 60000; ++clock) {
      for (auto& master : masters) {
        if (clock >= 30000) master.stop = true;
        master.drive(bench);
      }
      bench.settle();
      for (auto& master : masters) master.sample(bench);
      ASSERT_FALSE(HasFatalFailure()) << "clock " << clock << ", active " << percent << " %";
      bench.rise();
      if (clock > 30000 && masters[0].quiet() && masters[1].quiet()) break;
    }
    for (auto& master : masters) {
      EXPECT_TRUE(master.quiet()) << "bursts without an answer";
      EXPECT_GT(master.done, percent == 100 ? 2000u : 100u);
      EXPECT_GT(master.errors, 10u);
    }
    bench->ar_valid_i = bench->aw_valid_i = bench->w_valid_i = 0;
    bench->r_ready_i = bench->b_ready_i = 3;
  }
}

TEST_F(BoardUnits, ReadsStreamWithoutAGap) {
  bench.settle();
  const std::uint64_t base = bench->base_o;
  constexpr int kBursts = 40, kBeats = 2;
  int asked = 0, beats = 0;
  std::uint64_t first = 0, last = 0;
  while (beats < kBursts * kBeats) {
    bench->ar_valid_i = asked < kBursts;
    bench->ar_addr_i[0] = base + static_cast<std::uint64_t>(asked) * 64;
    bench->ar_len_i[0] = kBeats - 1;
    bench->ar_size_i[0] = 3;
    bench->ar_burst_i[0] = 1;
    bench.settle();
    if ((bench->ar_valid_i & 1) && (bench->ar_ready_o & 1)) ++asked;
    if (bench->r_valid_o & 1) {
      if (beats++ == 0) first = bench.clock();
      last = bench.clock();
    }
    bench.rise();
    ASSERT_LT(bench.clock(), 1000u);
  }
  EXPECT_EQ(last - first, static_cast<std::uint64_t>(kBursts * kBeats - 1));
}

// AXI bursts stay within 4 KB. One that does not must not come back as the beginning of its page, and the word behind the memory is none.
TEST_F(BoardUnits, ABurstThatCrossesAPageIsAnError) {
  bench.settle();
  const std::uint64_t base = bench->base_o, bytes = static_cast<std::uint64_t>(bench->bytes_o);
  constexpr int kBefore = 20;
  for (std::uint64_t page = 4096; page <= bytes; page += 4096) {
    for (int before = 1; before <= kBefore; ++before) {
      for (int beats = 1; beats <= kBefore + 2; ++beats) {
        bench->ar_valid_i = 1;
        bench->ar_addr_i[0] = base + page - 8 * static_cast<std::uint64_t>(before);
        bench->ar_len_i[0] = static_cast<std::uint8_t>(beats - 1);
        bench->ar_size_i[0] = 3;
        bench->ar_burst_i[0] = 1;
        int patience = 200;
        for (int beat = 0; beat < beats;) {
          ASSERT_GT(--patience, 0) << "a read is not answered";
          bench.settle();
          const bool taken = bench->ar_ready_o & 1;
          if (bench->r_valid_o & 1) {
            ++beat;
            ASSERT_EQ(bench->r_resp_o, beats > before ? 2 : 0) << before << " words before a page, burst of " << beats;
            ASSERT_EQ(bench->r_last_o, beat == beats);
          }
          bench.rise();
          if (taken) bench->ar_valid_i = 0;
        }
      }
    }
  }
}

TEST_F(BoardUnits, AReadBesideAWriteOfTheSameWordIsOldOrNew) {
  bench.settle();
  const std::uint64_t base = bench->base_o;
  int seen_old = 0, seen_new = 0;
  for (int delay = -8; delay <= 8; ++delay) {
    const std::uint64_t before = random.bits(), after = random.bits();
    write_words(bench, base + 128, {before});
    bool aw = true, w = true, ar = true, answered = false, arrived = false;
    for (int clock = -10; !(answered && arrived); ++clock) {
      bench->aw_valid_i = aw && clock >= 0;
      bench->w_valid_i = w && clock >= 0;
      bench->ar_valid_i = (ar && clock >= delay) ? 2 : 0;
      bench->aw_addr_i[0] = bench->ar_addr_i[1] = base + 128;
      bench->w_data_i[0] = after;
      bench->ar_len_i[1] = 0;
      bench->ar_size_i[1] = 3;
      bench->ar_burst_i[1] = 1;
      bench.settle();
      if (bench->aw_valid_i && (bench->aw_ready_o & 1)) aw = false;
      if (bench->w_valid_i && (bench->w_ready_o & 1)) w = false;
      if (bench->ar_valid_i && (bench->ar_ready_o & 2)) ar = false;
      if (bench->b_valid_o & 1) answered = true;
      if (bench->r_valid_o & 2) {
        arrived = true;
        EXPECT_TRUE(bench->r_data_o == before || bench->r_data_o == after) << "delay " << delay;
        (bench->r_data_o == before ? seen_old : seen_new)++;
      }
      bench.rise();
      ASSERT_LT(clock, 200);
    }
  }
  EXPECT_GT(seen_old, 0);
  EXPECT_GT(seen_new, 0);
}

}  // namespace
}  // namespace retrace::cosim
