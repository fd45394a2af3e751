// rt_dram_port against a memory controller that takes commands and answers them when it likes, with words wider and narrower than a beat: contents,
// order within an id, errors, and that nobody starves. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "testbench/sim/clocked.hpp"
#include "testbench/sim/dram/axi_pins.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vtb_dram_port_w128.h"
#include "Vtb_dram_port_w32.h"

namespace retrace::cosim {
namespace {

constexpr std::uint64_t kBase = 0x80000000, kBytes = 65536;  // as tb_dram_port has them
constexpr std::uint64_t kPage = 4096, kBeat = 8;
constexpr unsigned kPorts = 4, kBankShift = 8;
constexpr std::uint32_t kOkay = 0, kSlaveError = 2, kDecodeError = 3;
constexpr int kPatience = 64;

struct Traffic {
  unsigned ready_percent = 100;   ///< of the controller, for a command
  unsigned answer_percent = 100;  ///< of the controller, for a word that could be answered
  unsigned stall_percent = 0;     ///< of each channel of the master
  std::uint64_t ids = 8;          ///< few ids: many reads of one id
  unsigned write_percent = 40;
  unsigned bad_percent = 5;     ///< bursts that have to be refused
  std::uint64_t span = kBytes;  ///< addresses are in the first bytes of the memory
  bool ready_late = false;      ///< the controller is initialised in the middle of the run
};

/// The controller behind the native ports. Commands take effect in the order in which they are accepted.
template <class Model>
class Controller {
 public:
  static constexpr unsigned kWordBytes = sizeof(Model::write_word_o) > 4 ? 16 : 4;

  Controller(std::uint64_t seed, const Traffic& traffic) : random_(seed), traffic_(traffic), memory_(kBytes) {
    for (auto& byte : memory_) byte = static_cast<std::uint8_t>(random_.bits());
  }
  const std::vector<std::uint8_t>& memory() const { return memory_; }
  bool idle() const {
    for (const auto& port : reads_)
      if (!port.empty()) return false;
    return writes_.empty();
  }
  /// A bank belongs to one port as long as that has commands for it, as in LiteDRAM.
  void keep_banks() { keeps_banks_ = true; }

  /// Before the edge: what the controller drives in this clock.
  void drive(Model& m) {
    m.read_word_valid_i = 0;
    for (unsigned i = 0; i < kPorts; ++i) {
      auto& port = reads_[i];
      if (port.empty() || !port.front().known || !percent(traffic_.answer_percent)) continue;
      m.read_word_valid_i |= static_cast<std::uint8_t>(1u << i);
      std::memcpy(bytes(m.read_word_i) + i * kWordBytes, port.front().data.data(), kWordBytes);
      port.pop_front();
    }
    m.write_word_ready_i = !writes_.empty() && percent(traffic_.answer_percent);
    m.read_ready_i = 0;
    m.write_ready_i = 0;
    for (unsigned i = 0; i < kPorts; ++i)
      if (percent(traffic_.ready_percent)) m.read_ready_i |= static_cast<std::uint8_t>(1u << i);
    m.write_ready_i = percent(traffic_.ready_percent);
  }
  /// What the port offers has settled: banks that belong to another take nothing.
  void choose(Model& m) {
    if (!keeps_banks_) return;
    for (unsigned of = 0; of < kPorts; ++of) {
      auto& owner = owners_[of];
      if (!owner) continue;
      // What the bank has accepted keeps it for some clocks.
      idle_[of] = offers(m, *owner, of) ? 0 : idle_[of] + 1;
      if (idle_[of] > kBusy) owner.reset();
    }
    for (unsigned i = 0; i <= kPorts; ++i) {
      if (!valid(m, i)) continue;
      auto& owner = owners_[bank(m, i)];
      if (!owner) {
        owner = i;
        idle_[bank(m, i)] = 0;
      }
      if (*owner == i) continue;
      if (i == kPorts)
        m.write_ready_i = 0;
      else
        m.read_ready_i &= static_cast<std::uint8_t>(~(1u << i));
    }
  }
  /// At the edge: what is accepted. Returns an error of the port, or nothing.
  const char* accept(const Model& m) {
    for (unsigned i = 0; i < kPorts; ++i) {
      if (!(m.read_valid_o >> i & 1) || !(m.read_ready_i >> i & 1)) continue;
      const std::uint64_t address = kWordBytes * std::uint64_t{read_address(m, i)};
      if (address + kWordBytes > kBytes) return "a read command outside the memory";
      reads_[i].push_back({address, next_++, false, {}});
    }
    // A read and a write accepted in the same clock: the read comes first, which is one of the orders that are allowed.
    if (m.write_valid_o && m.write_ready_i) {
      const std::uint64_t address = kWordBytes * std::uint64_t{m.write_addr_o};
      if (address + kWordBytes > kBytes) return "a write command outside the memory";
      writes_.push_back({address, next_++});
      ++commands_;
    }
    if (m.write_word_ready_i) {
      if (!m.write_word_valid_o) return "a command whose data are not there";
      resolve();
      const auto* from = bytes(m.write_word_o);
      for (unsigned k = 0; k < kWordBytes; ++k)
        if (m.write_strobe_o >> k & 1) memory_[writes_.front().address + k] = from[k];
      writes_.pop_front();
    }
    resolve();
    return nullptr;
  }
  std::uint64_t write_commands() const { return commands_; }

 private:
  struct Read {
    std::uint64_t address, number;
    bool known;
    std::array<std::uint8_t, kWordBytes> data;
  };
  struct Write {
    std::uint64_t address, number;
  };
  bool percent(unsigned of) { return random_.below(100) < of; }
  template <class T>
  static auto* bytes(T& pins) {
    return reinterpret_cast<std::conditional_t<std::is_const_v<T>, const std::uint8_t, std::uint8_t>*>(&pins);
  }
  static std::uint32_t read_address(const Model& m, unsigned port) {
    std::uint32_t address;
    std::memcpy(&address, bytes(m.read_addr_o) + 4 * port, sizeof address);
    return address;
  }
  static bool valid(const Model& m, unsigned i) {
    return i == kPorts ? m.write_valid_o : (m.read_valid_o >> i & 1) != 0;
  }
  static unsigned bank(const Model& m, unsigned i) {
    const std::uint64_t word = i == kPorts ? m.write_addr_o : read_address(m, i);
    return static_cast<unsigned>(word * kWordBytes >> kBankShift) % kPorts;
  }
  static bool offers(const Model& m, unsigned i, unsigned of) { return valid(m, i) && bank(m, i) == of; }
  /// Reads before the oldest write that has no data yet see the memory as it is.
  void resolve() {
    const std::uint64_t limit = writes_.empty() ? std::numeric_limits<std::uint64_t>::max() : writes_.front().number;
    for (auto& port : reads_)
      for (Read& read : port) {
        if (read.known || read.number > limit) continue;
        std::memcpy(read.data.data(), &memory_[read.address], kWordBytes);
        read.known = true;
      }
  }

  Random random_;
  Traffic traffic_;
  std::vector<std::uint8_t> memory_;
  std::array<std::deque<Read>, kPorts> reads_;
  std::deque<Write> writes_;
  std::array<std::optional<unsigned>, kPorts> owners_;
  static constexpr unsigned kBusy = 6;
  std::array<unsigned, kPorts> idle_{};
  bool keeps_banks_ = false;
  std::uint64_t next_ = 0, commands_ = 0;
};

/// A master with any number of bursts in flight. For each byte it knows what a read may see: what was answered before the read was sent, or anything
/// that was under way meanwhile.
class Master {
 public:
  Master(std::uint64_t seed, const Traffic& traffic, std::vector<std::uint8_t> contents)
      : random_(seed), traffic_(traffic), history_(contents.size()), contents_(std::move(contents)) {}

  void drive(std::uint64_t clock, bool more, bool initialised, AxiMasterSignals& m) {
    if (!m.ar_valid && more && !stalled() && random_.below(100) >= traffic_.write_percent)
      send_read(m, clock, burst(), static_cast<std::uint32_t>(random_.below(traffic_.ids)));
    if (!m.aw_valid && more && !stalled() && random_.below(100) < traffic_.write_percent) send_write(m, clock, burst());
    if (!m.w_valid && !beats_.empty() && !stalled()) {
      m.w_valid = true;
      m.w_data[0] = beats_.front().data;
      m.w_strb = beats_.front().strobes;
      m.w_last = beats_.front().last;
      beats_.pop_front();
    }
    m.r_ready = !stalled();
    m.b_ready = !stalled();
    initialised_ = initialised;
  }
  struct Burst {
    std::uint64_t address;
    std::uint32_t beats, size = 3, kind = 1;
  };
  void send_read(AxiMasterSignals& m, std::uint64_t clock, const Burst& b, std::uint32_t id) {
    m.ar_valid = true;
    m.ar_id = id;
    m.ar_addr = b.address;
    m.ar_len = b.beats - 1;
    m.ar_size = b.size;
    m.ar_burst = b.kind;
    reads_[id].push_back({b, clock, 0});
  }
  void send_write(AxiMasterSignals& m, std::uint64_t clock, const Burst& b) {
    m.aw_valid = true;
    m.aw_id = static_cast<std::uint32_t>(random_.below(256));
    m.aw_addr = b.address;
    m.aw_len = b.beats - 1;
    m.aw_size = b.size;
    m.aw_burst = b.kind;
    Write write{b, m.aw_id, {}};
    for (std::uint32_t i = 0; i < b.beats; ++i) {
      const auto strobes = static_cast<std::uint32_t>(random_.chance(3) ? random_.below(256) : 255);
      beats_.push_back({random_.bits(), strobes, i + 1 == b.beats});
      if (response(b, true) != kOkay) continue;
      for (unsigned k = 0; k < kBeat; ++k) {
        if (!(strobes >> k & 1)) continue;
        const std::uint64_t byte = b.address / kBeat * kBeat - kBase + i * kBeat + k;
        const auto value = static_cast<std::uint8_t>(beats_.back().data >> (8 * k));
        write.bytes.emplace_back(byte, history_[byte].size());
        history_[byte].push_back({clock, std::numeric_limits<std::uint64_t>::max(), value});
      }
    }
    writes_.push_back(std::move(write));
  }
  /// What the slave answered in this clock. Returns what is wrong, or an empty string.
  std::string take(std::uint64_t clock, const AxiMasterSignals& m, const AxiSlaveSignals& s) {
    if (s.r_valid && m.r_ready) {
      auto& queue = reads_[s.r_id];
      if (queue.empty()) return "a beat nobody asked for";
      Read& read = queue.front();
      const std::uint32_t expected = response(read.burst, true);
      const bool late = expected == kOkay && s.r_resp == kSlaveError && traffic_.ready_late;
      if (s.r_resp != expected && !late) return "read answered with " + std::to_string(s.r_resp);
      if (s.r_last != (read.beat + 1 == read.burst.beats)) return "last in the wrong beat";
      for (unsigned k = 0; k < kBeat && s.r_resp == kOkay; ++k) {
        const std::uint64_t byte = read.burst.address / kBeat * kBeat - kBase + read.beat * kBeat + k;
        if (!may_be(byte, static_cast<std::uint8_t>(s.r_data[0] >> (8 * k)), read.sent))
          return "byte " + std::to_string(byte) + " is wrong";
      }
      if (s.r_resp != kOkay && s.r_data[0] != 0) return "data in an error";
      if (++read.beat == read.burst.beats) {
        queue.pop_front();
        ++done_reads_;
      }
    }
    if (s.b_valid && m.b_ready) {
      if (writes_.empty()) return "an answer nobody asked for";
      Write& write = writes_.front();
      if (s.b_id != write.id) return "answers of writes out of order";
      if (s.b_resp != response(write.burst, true)) return "write answered with " + std::to_string(s.b_resp);
      for (const auto& [byte, entry] : write.bytes) history_[byte][entry].answered = clock;
      writes_.pop_front();
      ++done_writes_;
    }
    return {};
  }
  bool idle() const {
    for (const auto& queue : reads_)
      if (!queue.empty()) return false;
    return writes_.empty() && beats_.empty();
  }
  bool open(std::uint32_t id) const { return !reads_[id].empty(); }
  std::uint8_t last(std::uint64_t byte) const {
    return history_[byte].empty() ? contents_[byte] : history_[byte].back().value;
  }
  std::uint64_t done_reads() const { return done_reads_; }
  std::uint64_t done_writes() const { return done_writes_; }

 private:
  struct Beat {
    std::uint64_t data;
    std::uint32_t strobes;
    bool last;
  };
  struct Read {
    Burst burst;
    std::uint64_t sent;
    std::uint32_t beat;
  };
  struct Write {
    Burst burst;
    std::uint32_t id;
    std::vector<std::pair<std::uint64_t, std::size_t>> bytes;
  };
  struct Value {
    std::uint64_t sent, answered;
    std::uint8_t value;
  };
  bool stalled() { return random_.below(100) < traffic_.stall_percent; }
  static std::uint32_t response(const Burst& b, bool initialised) {
    if (b.address < kBase || b.address >= kBase + kBytes) return kDecodeError;
    const bool crosses = b.address % kPage / kBeat + b.beats > kPage / kBeat;
    return b.kind != 1 || b.size != 3 || crosses || !initialised ? kSlaveError : kOkay;
  }
  Burst burst() {
    Burst b{};
    b.beats = static_cast<std::uint32_t>(random_.chance(20) ? 1 + random_.below(256) : 1 + random_.below(16));
    const std::uint64_t in_page = kPage / kBeat - b.beats + 1;
    b.address = kBase + random_.below(traffic_.span / kPage) * kPage + kBeat * random_.below(in_page);
    if (random_.chance(8)) b.address += random_.below(kBeat);  // aligned down to a beat
    if (random_.below(100) >= traffic_.bad_percent) return b;
    switch (random_.below(4)) {
      case 0:
        b.address =
            random_.chance(2) ? kBase + kBytes + kBeat * random_.below(1u << 20) : kBeat * random_.below(kBase / kBeat);
        break;
      case 1:
        b.size = static_cast<std::uint32_t>(random_.below(3));
        break;
      case 2:
        b.kind = random_.chance(2) ? 0 : 2;
        break;
      default:
        b.beats = std::max<std::uint32_t>(b.beats, 2);
        b.address = kBase + kPage * (1 + random_.below(kBytes / kPage)) - kBeat;
    }
    return b;
  }
  bool may_be(std::uint64_t byte, std::uint8_t value, std::uint64_t sent) const {
    const auto& values = history_[byte];
    for (std::size_t i = values.size(); i-- > 0;) {
      if (values[i].value == value) return true;
      if (values[i].answered < sent) return false;  // older ones cannot be seen any more
    }
    return contents_[byte] == value;
  }

  Random random_;
  Traffic traffic_;
  std::vector<std::vector<Value>> history_;
  std::vector<std::uint8_t> contents_;
  std::array<std::deque<Read>, 256> reads_;
  std::deque<Write> writes_;
  std::deque<Beat> beats_;
  std::uint64_t done_reads_ = 0, done_writes_ = 0;
  bool initialised_ = true;
};

template <class Model>
struct DramPort : testing::Test {
  DramPort() : seed(test_seed()), bench(seed) {
    bench->ready_i = 1;
    drive_axi(*bench, {});
    bench->read_word_valid_i = bench->read_ready_i = 0;
    bench->write_ready_i = bench->write_word_ready_i = 0;
    bench.reset();
  }
  void TearDown() override {
    EXPECT_FALSE(bench.failed()) << "an assertion of the RTL has failed";
    if (this->HasFailure()) std::fprintf(stderr, "RETRACE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  }
  /// One clock of both sides.
  void step(Controller<Model>& controller, Master& master, bool more, bool initialised = true) {
    bench->ready_i = initialised;
    master.drive(bench.clock(), more, initialised, m);
    drive_axi(*bench, m);
    controller.drive(*bench);
    bench.settle();
    controller.choose(*bench);
    bench.settle();
    AxiSlaveSignals s;
    look_at_axi(*bench, s);
    const char* fault = controller.accept(*bench);
    ASSERT_EQ(fault, nullptr) << fault << " in clock " << bench.clock();
    const std::string wrong = master.take(bench.clock(), m, s);
    ASSERT_EQ(wrong, "") << "in clock " << bench.clock();
    bench.rise();
    if (m.ar_valid && s.ar_ready) m.ar_valid = false;
    if (m.aw_valid && s.aw_ready) m.aw_valid = false;
    if (m.w_valid && s.w_ready) m.w_valid = false;
  }
  void run(const Traffic& traffic, std::uint64_t clocks) {
    constexpr std::uint64_t kSettle = 200000;
    Controller<Model> controller(seed, traffic);
    Master master(seed + 1, traffic, controller.memory());
    const std::uint64_t begin = bench.clock();
    while (bench.clock() < begin + clocks) {
      step(controller, master, true, !traffic.ready_late || bench.clock() > begin + clocks / 2);
      if (this->HasFatalFailure()) return;
    }
    while (!(master.idle() && controller.idle() && !m.w_valid)) {
      step(controller, master, false);
      if (this->HasFatalFailure()) return;
      ASSERT_LT(bench.clock(), begin + clocks + kSettle) << "does not drain";
    }
    if (!traffic.ready_late)
      for (std::uint64_t byte = 0; byte < kBytes; ++byte)
        ASSERT_EQ(controller.memory()[byte], master.last(byte)) << "byte " << byte;
    EXPECT_GT(master.done_reads(), clocks / 1000);
    if (traffic.write_percent > 0) {
      EXPECT_GT(master.done_writes(), clocks / 1000);
    }
  }

  std::uint64_t seed;
  Clocked<Model> bench;
  AxiMasterSignals m;
};

using Models = testing::Types<Vtb_dram_port_w128, Vtb_dram_port_w32>;
class Names {
 public:
  template <class Model>
  static std::string GetName(int) {
    return std::is_same_v<Model, Vtb_dram_port_w128> ? "Word128" : "Word32";
  }
};
TYPED_TEST_SUITE(DramPort, Models, Names);

TYPED_TEST(DramPort, NobodyWaits) { this->run({}, 20000); }
TYPED_TEST(DramPort, EverybodyStalls) {
  Traffic traffic;
  traffic.ready_percent = 60;
  traffic.answer_percent = 50;
  traffic.stall_percent = 30;
  this->run(traffic, 20000);
}
TYPED_TEST(DramPort, SlowControllerOneId) {
  Traffic traffic;
  traffic.ready_percent = 30;
  traffic.answer_percent = 8;
  traffic.ids = 1;
  this->run(traffic, 20000);
}
TYPED_TEST(DramPort, SlowMaster) {
  Traffic traffic;
  traffic.stall_percent = 85;
  traffic.ids = 3;
  this->run(traffic, 20000);
}
TYPED_TEST(DramPort, ReadsAndWritesOfTheSamePage) {
  Traffic traffic;
  traffic.span = kPage;
  traffic.bad_percent = 0;
  traffic.write_percent = 50;
  traffic.answer_percent = 70;
  this->run(traffic, 20000);
}
TYPED_TEST(DramPort, MostIsRefused) {
  Traffic traffic;
  traffic.bad_percent = 70;
  traffic.stall_percent = 20;
  traffic.ids = 2;
  this->run(traffic, 20000);
}
TYPED_TEST(DramPort, ReadsOnlyFromManyIds) {
  Traffic traffic;
  traffic.write_percent = 0;
  traffic.ids = 256;
  traffic.answer_percent = 40;
  this->run(traffic, 20000);
}
/// As many reads of one id as there is room for, of one bank, and then one of another bank, which would be answered first.
TYPED_TEST(DramPort, ManyReadsOfOneId) {
  Traffic slow;
  slow.answer_percent = 3;
  slow.write_percent = 0;
  Controller<TypeParam> controller(this->seed, slow);
  Master master(this->seed, slow, controller.memory());
  std::uint64_t asked = 0;
  for (int clock = 0; clock < 20000; ++clock) {
    if (!this->m.ar_valid) {
      const std::uint64_t bank = ++asked % 21 == 0 ? 1 : 0;
      master.send_read(this->m, this->bench.clock(), {kBase + (bank << kBankShift) + kBeat * (asked % 8), 1}, 0);
    }
    this->step(controller, master, false);
    if (this->HasFatalFailure()) return;
  }
  EXPECT_GT(master.done_reads(), 200u);
}

/// What comes before the controller is initialised is refused and not lost.
TYPED_TEST(DramPort, InitialisedInTheMiddle) {
  Traffic traffic;
  traffic.write_percent = 0;
  traffic.ready_late = true;
  traffic.ready_percent = 80;
  this->run(traffic, 10000);
}

/// A line of 64 bytes is as many commands as it has words, and words without a byte are none.
TYPED_TEST(DramPort, BeatsOfAWordAreOneCommand) {
  constexpr std::uint32_t kBeats = 8;
  Controller<TypeParam> controller(this->seed, {});
  Traffic quiet;
  quiet.write_percent = 0;
  Master master(this->seed, quiet, controller.memory());
  AxiMasterSignals& m = this->m;
  m.b_ready = true;
  m.aw_valid = true;
  m.aw_addr = kBase;
  m.aw_len = kBeats - 1;
  m.aw_size = 3;
  m.aw_burst = 1;
  std::uint32_t sent = 0, answers = 0;
  for (int clock = 0; clock < 200; ++clock) {
    m.w_valid = sent < kBeats;
    m.w_data[0] = sent;
    m.w_strb = sent < kBeats / 2 ? 0xff : 0;
    m.w_last = sent + 1 == kBeats;
    drive_axi(*this->bench, m);
    controller.drive(*this->bench);
    this->bench.settle();
    AxiSlaveSignals s;
    look_at_axi(*this->bench, s);
    ASSERT_EQ(controller.accept(*this->bench), nullptr);
    this->bench.rise();
    if (m.aw_valid && s.aw_ready) m.aw_valid = false;
    if (m.w_valid && s.w_ready) ++sent;
    answers += s.b_valid;
  }
  EXPECT_EQ(answers, 1u);
  EXPECT_EQ(controller.write_commands(), kBeats / 2 * kBeat / Controller<TypeParam>::kWordBytes);
}

/// Reads of one bank without an end: a write to it, and a read of another port that crosses into it while the write waits, get through.
TYPED_TEST(DramPort, NobodyStarves) {
  constexpr std::uint64_t kRow = 1u << kBankShift, kLongest = 4 * kPatience + 200;
  Traffic traffic;
  traffic.write_percent = 0;
  Controller<TypeParam> controller(this->seed, traffic);
  controller.keep_banks();
  Traffic none = traffic;
  Master master(this->seed, none, controller.memory());
  AxiMasterSignals& m = this->m;
  std::uint64_t asked = 0, writes = 0, crossing_since = 0, longest = 0;
  constexpr std::uint32_t kCrossing = 200;
  for (std::uint64_t clock = 0; clock < 20000; ++clock) {
    if (!m.ar_valid) {
      if (clock % 1000 == 20 && !master.open(kCrossing)) {
        master.send_read(m, this->bench.clock(), {kBase + kRow - 8 * kBeat + 3 * kRow, 16}, kCrossing);
        crossing_since = clock;
      } else {
        master.send_read(m, this->bench.clock(), {kBase + 128 * (asked++ % 2), 16},
                         static_cast<std::uint32_t>(asked % 64));
      }
    }
    if (clock % 1000 == 0 && !m.aw_valid) master.send_write(m, this->bench.clock(), {kBase + 64, 8});
    const std::uint64_t before = master.done_writes();
    this->step(controller, master, false);
    if (this->HasFatalFailure()) return;
    if (master.done_writes() != before) {
      longest = std::max(longest, clock % 1000);
      ++writes;
    }
    if (crossing_since != 0 && !master.open(kCrossing)) {
      longest = std::max(longest, clock - crossing_since);
      crossing_since = 0;
    }
  }
  EXPECT_EQ(writes, 20u);
  EXPECT_LE(longest, kLongest);
}

}  // namespace
}  // namespace retrace::cosim
