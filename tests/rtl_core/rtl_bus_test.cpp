// The core on its buses: image, rays and hits at any place the registers can name, memory latencies of 1 to 1,000 clocks, every channel held off
// by itself, register accesses in every order and with partial strobes, registers written in mid-run, resets. The hits are the kernel's in every
// byte, each is written once, nothing else is written, and the monitors see no broken rule.
// RETRACE_BUS_TRANSACTIONS: length of RandomTraffic in AXI4 bursts. Seeds: RETRACE_SEED.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <optional>
#include <sstream>
#include <utility>

#include "rtl/shell/rt_regs.h"
#include "testbench/driver/core_driver.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "tests/rtl_core/frames.hpp"

namespace {

using namespace retrace;
using namespace retrace::rtl_core_test;
using cosim::AxiChannel;
using cosim::CoreDriver;
using cosim::CoreMode;
using cosim::HoldOff;
using cosim::LiteOptions;
using cosim::MemoryOptions;
using cosim::Placement;
using cosim::SimulatedDevice;
using cosim::WriteOrder;

constexpr std::uint64_t kPage = 4096;
constexpr std::uint32_t kRegisterBytes = 0x200;
#define RT_OFFSET(name) static_cast<std::uint32_t>(offsetof(rt_regs_t, name))

/// The rays of the tests and what the kernel says of them, by the mode. Made once.
struct Workload {
  const Prepared* scene;
  std::vector<GridRay> rays;
  std::map<std::pair<bool, bool>, std::vector<std::uint64_t>> hits;
};
Workload& workload(const std::string& name) {
  static std::map<std::string, Workload> cache;
  auto [it, is_new] = cache.try_emplace(name);
  Workload& w = it->second;
  if (!is_new) return w;
  w.scene = &prepared(name);
  for (const auto* rays : {&w.scene->primary, &w.scene->awkward})
    for (const GridRay& ray : only_inside(*rays)) w.rays.push_back(ray);
  return w;
}
std::span<const std::uint64_t> expected_hits(Workload& w, const CoreMode& mode) {
  auto [it, is_new] = w.hits.try_emplace({mode.parent_links, mode.mailbox});
  if (is_new) {
    TraceOptions options;
    options.way_up = mode.parent_links ? WayUp::kParentLinks : WayUp::kFaceLinks;
    options.mailbox = mode.mailbox ? kCsimMailbox : 0;
    it->second = csim_hits(w.scene->image.words(), w.rays, options);
  }
  return it->second;
}

/// A device whose registers are written in parts: each write becomes several with partial strobes and noise in the other bytes, all offered at
/// once. What `behind_start` queues follows the write of control.start without a gap.
class PartialWrites final : public cosim::Device {
 public:
  PartialWrites(SimulatedDevice& device, std::uint64_t seed) : device_(device), random_(seed) {}
  std::function<void(cosim::AxiLiteMaster&)> behind_start;

  std::uint32_t read_register(std::uint32_t offset) override { return device_.read_register(offset); }
  void write_register(std::uint32_t offset, std::uint32_t value) override {
    auto& registers = device_.registers();
    while (!registers.idle()) device_.run(1);
    registers.write_answers().clear();
    std::size_t parts = 0;
    for (std::uint32_t left = 0xf; left != 0; ++parts) {
      const std::uint32_t strobes = left & static_cast<std::uint32_t>(random_.integer(0, 15));
      std::uint32_t data = static_cast<std::uint32_t>(random_.bits());
      for (int byte = 0; byte < 4; ++byte)
        if ((strobes >> byte & 1) != 0) data = (data & ~(0xffu << (8 * byte))) | (value & 0xffu << (8 * byte));
      registers.write(offset, data, strobes);
      left &= ~strobes;
    }
    if (offset == RT_OFFSET(control) && behind_start) std::exchange(behind_start, nullptr)(registers);
    while (!registers.idle()) device_.run(1);
    ASSERT_GE(registers.write_answers().size(), parts);
    for (const auto& answer : registers.write_answers()) EXPECT_EQ(answer.response, 0u);
    registers.write_answers().clear();
  }
  std::uint64_t allocate(std::uint64_t bytes) override { return device_.allocate(bytes); }
  void release_all() override { device_.release_all(); }
  void write_memory(std::uint64_t address, std::span<const std::uint64_t> words) override {
    device_.write_memory(address, words);
  }
  void read_memory(std::uint64_t address, std::span<std::uint64_t> words) override {
    device_.read_memory(address, words);
  }
  bool wait_interrupt() override { return device_.wait_interrupt(); }
  std::uint64_t clocks() const override { return device_.clocks(); }

 private:
  SimulatedDevice& device_;
  Random random_;
};

HoldOff any_hold_off(Random& random, int longest) {
  switch (random.below(4)) {
    case 0:
      return HoldOff::none();
    case 1:
    case 2:
      return HoldOff::random(random.bits(), static_cast<unsigned>(random.integer(30, 95)));
    default:
      return HoldOff::bursts(random.bits(), static_cast<unsigned>(random.integer(2, longest)));
  }
}

MemoryOptions any_memory(Random& random, int latency_min, int latency_max) {
  MemoryOptions memory;
  memory.latency_min = latency_min;
  memory.latency_max = latency_max;
  memory.reorder = random.chance(2);
  memory.write_order = static_cast<WriteOrder>(random.below(3));
  memory.seed = random.bits();
  memory.most_wait = 100000;
  for (HoldOff& hold_off : memory.hold_off) hold_off = any_hold_off(random, 60);
  // Addresses have 40 bits: anywhere, across 4 GB, at the end.
  constexpr std::uint64_t kRoom = 1ull << 24, kFourGb = 1ull << 32, kAll = 1ull << 40;
  switch (random.below(4)) {
    case 0:
      memory.base = kFourGb - kPage * random.below(64);
      break;
    case 1:
      memory.base = kAll - kRoom;
      break;
    default:
      memory.base = random.below((kAll - kRoom) / kPage) * kPage;
  }
  return memory;
}

LiteOptions any_lite(Random& random) {
  LiteOptions lite;
  lite.seed = random.bits();
  for (HoldOff& hold_off : lite.hold_off) hold_off = any_hold_off(random, 40);
  return lite;
}

SimulatedDevice::Options options_of(const std::string& configuration, const MemoryOptions& memory, Random& random) {
  SimulatedDevice::Options options;
  options.configuration = configuration;
  options.memory = memory;
  options.seed = random.bits();
  options.lite = any_lite(random);
  options.lite_wait = 10000;
  return options;
}

/// Multiples of 64, 32 and 16 within a page. Every fourth image has its header across the end of one.
Placement any_placement(Random& random) {
  Placement place{.image = 64 * random.below(kPage / 64),
                  .rays = 32 * random.below(kPage / 32),
                  .hits = 16 * random.below(kPage / 16)};
  if (random.chance(4)) place.image = kPage - 64;
  return place;
}

/// One run on a device, with everything around it checked.
class CheckedRun {
 public:
  CheckedRun(SimulatedDevice& device, CoreDriver& driver, Workload& work)
      : device_(device), driver_(driver), work_(work) {}
  Placement place;
  CoreMode mode;
  std::size_t first = 0, count = 0;

  /// Memory around the run is noise; then the run starts.
  void start(Random& random) {
    const auto image = work_.scene->image.words();
    driver_.load_at(image, count, place);
    std::vector<std::uint64_t> noise(device_.memory().bytes() / 8);
    for (std::uint64_t& word : noise) word = random.bits();
    device_.write_memory(device_.memory().base(), noise);
    driver_.load_at(image, count, place);
    const auto rays = packed(std::span(work_.rays).subspan(first, count));
    device_.write_memory(driver_.ray_address(), rays);
    before_ = contents();
    device_.memory().watch_writes(driver_.hit_address(), driver_.hit_address() + count * contract::kHitBytes);
    driver_.start(rays, mode);
  }
  /// Clocks until the core says it is done; none if it does not within `limit`. Asks the status register, as the interrupt may be off.
  std::optional<std::uint64_t> wait(std::uint64_t limit) {
    const std::uint64_t begin = device_.clocks();
    while (device_.clocks() - begin < limit) {
      if (driver_.status().done) return device_.clocks() - begin;
      device_.run(64);
    }
    return {};
  }
  /// After the end. Once done is seen, hits are in memory; reads that nobody waits for and
  /// register accesses may still be in flight for a while.
  void check() {
    std::vector<std::uint64_t> hits(2 * count);
    driver_.hits(hits);
    const auto expected = expected_hits(work_, mode).subspan(2 * first, 2 * count);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < hits.size(); i += 2) differ += !std::equal(&hits[i], &hits[i] + 2, &expected[i]);
    EXPECT_EQ(differ, 0u) << "of " << count << " hits differ from the kernel's";
    const auto times = device_.memory().written_times();
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), static_cast<std::ptrdiff_t>(times.size()))
        << "bytes of hits that are not written exactly once";
    EXPECT_EQ(device_.memory().stray_writes(), 0u);
    const auto after = contents();
    const std::uint64_t begin = (driver_.hit_address() - device_.memory().base()) / 8, end = begin + 2 * count;
    std::size_t touched = 0;
    for (std::size_t i = 0; i < after.size(); ++i) touched += (i < begin || i >= end) && after[i] != before_[i];
    EXPECT_EQ(touched, 0u) << "words beside the hits have changed";
    EXPECT_EQ(device_.memory().outside(), 0u);
    constexpr int kSettle = 20000;
    for (int i = 0; i < kSettle && !(device_.memory().idle() && device_.registers().idle()); ++i) device_.run(1);
    device_.check_idle();
  }
  std::string where() const {
    std::ostringstream text;
    text << std::hex << "image at " << driver_.image_address() << ", rays at " << driver_.ray_address() << ", hits at "
         << driver_.hit_address() << std::dec << ", " << count << " rays from " << first << ", rows of "
         << mode.ray_row;
    return text.str();
  }

 private:
  std::vector<std::uint64_t> contents() {
    std::vector<std::uint64_t> words(device_.memory().bytes() / 8);
    device_.read_memory(device_.memory().base(), words);
    return words;
  }

  SimulatedDevice& device_;
  CoreDriver& driver_;
  Workload& work_;
  std::vector<std::uint64_t> before_;
};

// ------------------------------------------------------------------------------------------------ bases

// Every image base within a page, among them the one whose header goes on in the next page.
TEST(RtlBus, ImageAtEveryBase) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  Workload& work = workload("room:detail=0.02");
  SimulatedDevice device(options_of(cosim::core_configurations().front(), any_memory(random, 1, 20), random));
  CoreDriver driver(device);
  for (std::uint64_t base = 0; base < kPage; base += 64) {
    CheckedRun run(device, driver, work);
    run.place = {.image = base, .rays = 32 * random.below(kPage / 32), .hits = 16 * random.below(kPage / 16)};
    run.count = 1 + random.below(12);
    run.first = random.below(work.rays.size() - run.count);
    ASSERT_NO_THROW(run.start(random)) << "image at " << base << " of a page";
    std::optional<std::uint64_t> clocks;
    ASSERT_NO_THROW(clocks = run.wait(kPatience)) << "image at " << base << " of a page";
    ASSERT_TRUE(clocks.has_value());
    run.check();
    ASSERT_FALSE(HasFailure()) << run.where();
  }
}

// ------------------------------------------------------------------------------------------------ random traffic

TEST(RtlBus, RandomTraffic) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  const char* text = std::getenv("RETRACE_BUS_TRANSACTIONS");
  const std::uint64_t wanted = text ? std::strtoull(text, nullptr, 0) : 20000;
  Random random(test_seed());
  const auto& configurations = cosim::core_configurations();
  struct Latency {
    int min, max;
  };
  constexpr Latency kLatencies[] = {{1, 1}, {2, 2}, {1, 1000}, {40, 40}, {1, 60}, {1000, 1000}};
  std::uint64_t bursts = 0, reads = 0, writes = 0, early = 0, partial = 0, lite = 0, lite_partial = 0, together = 0,
                data_first = 0, address_first = 0, clocks = 0, rays = 0;
  // Every configuration twice, at different latencies, and then on.
  for (std::size_t round = 0; bursts < wanted || round < 2 * configurations.size(); ++round) {
    const std::string& configuration = configurations[round % configurations.size()];
    const Latency latency = kLatencies[(round + round / configurations.size()) % std::size(kLatencies)];
    SCOPED_TRACE("round " + std::to_string(round) + ", " + configuration + ", latency " + std::to_string(latency.min) +
                 " to " + std::to_string(latency.max));
    SimulatedDevice device(options_of(configuration, any_memory(random, latency.min, latency.max), random));
    PartialWrites port(device, random.bits());
    CoreDriver driver(port);
    for (int frame = 0; frame < 2; ++frame) {
      // Rays of the first need few reads, so that hits come close together; those of the second come far apart;
      // walks through slivers are too long for a slow memory.
      Workload& work = workload(frame == 0                            ? "one"
                                : round % 2 == 0 && latency.max < 100 ? "slivers"
                                                                      : "room:detail=0.02");
      CheckedRun run(device, driver, work);
      run.place = any_placement(random);
      run.count = random.below(frame == 0 ? 300 : 130);
      run.first = random.below(work.rays.size() - run.count);
      run.mode.parent_links = random.chance(2);
      run.mode.mailbox = random.chance(2);
      const std::uint32_t rows[] = {
          0, 1, 3, 8, static_cast<std::uint32_t>(random.integer(1, 100)), static_cast<std::uint32_t>(random.bits())};
      run.mode.ray_row = rows[random.below(std::size(rows))];
      ASSERT_NO_THROW(run.start(random)) << run.where();
      // Reads of all registers, and writes that may not do anything: no strobe, or no register that can be written.
      auto& registers = device.registers();
      std::uint64_t limit = kPatience;
      while (!device.interrupt() && limit > 0) {
        if (registers.open() < 6 && random.chance(4)) {
          const auto offset = static_cast<std::uint32_t>(random.below(kRegisterBytes / 4) * 4);
          const bool read_only = offset < RT_OFFSET(control) || offset >= RT_OFFSET(counters) ||
                                 (offset > RT_OFFSET(control) && offset < RT_OFFSET(image_base_lo));
          if (random.chance(2))
            registers.read(offset);
          else
            registers.write(offset, static_cast<std::uint32_t>(random.bits()),
                            read_only ? static_cast<std::uint32_t>(random.below(16)) : 0);
        }
        ASSERT_NO_THROW(device.run(8)) << run.where();
        limit -= 8;
      }
      ASSERT_GT(limit, 0u) << "not done; " << run.where();
      ASSERT_NO_THROW(run.check()) << run.where();
      EXPECT_EQ(port.read_register(RT_OFFSET(ray_base_lo)), static_cast<std::uint32_t>(driver.ray_address()));
      EXPECT_EQ(port.read_register(RT_OFFSET(ray_count)), run.count);
      ASSERT_FALSE(HasFailure()) << run.where();
      rays += run.count;
    }
    const auto& axi = device.memory().monitor();
    const auto& port_of_registers = device.lite_monitor();
    bursts += axi.transactions(), reads += axi.reads(), writes += axi.writes();
    early += axi.early_beats(), partial += axi.partial_beats();
    lite += port_of_registers.transactions(), lite_partial += port_of_registers.partial();
    together += port_of_registers.together(), data_first += port_of_registers.data_first();
    address_first += port_of_registers.address_first();
    clocks += device.clocks();
  }
  std::printf(
      "%llu AXI4 bursts (%llu reads, %llu writes; %llu beats before their address, %llu with partial strobes), %llu "
      "AXI4-Lite accesses (%llu with partial strobes; %llu W first, %llu AW first, %llu together), %llu rays, %llu "
      "clocks\n",
      static_cast<unsigned long long>(bursts), static_cast<unsigned long long>(reads),
      static_cast<unsigned long long>(writes), static_cast<unsigned long long>(early),
      static_cast<unsigned long long>(partial), static_cast<unsigned long long>(lite),
      static_cast<unsigned long long>(lite_partial), static_cast<unsigned long long>(data_first),
      static_cast<unsigned long long>(address_first), static_cast<unsigned long long>(together),
      static_cast<unsigned long long>(rays), static_cast<unsigned long long>(clocks));
  EXPECT_GT(early, 0u);
  EXPECT_GT(lite_partial, 0u);
  EXPECT_GT(data_first, 0u);
  EXPECT_GT(address_first, 0u);
  EXPECT_GT(together, 0u);
}

// ------------------------------------------------------------------------------------------------ registers

constexpr std::uint32_t kConfigurationRegisters[] = {
    RT_OFFSET(image_base_lo), RT_OFFSET(image_base_hi), RT_OFFSET(image_lines), RT_OFFSET(ray_base_lo),
    RT_OFFSET(ray_base_hi),   RT_OFFSET(ray_count),     RT_OFFSET(ray_row),     RT_OFFSET(hit_base_lo),
    RT_OFFSET(hit_base_hi),   RT_OFFSET(step_limit)};

// Bytes without a strobe keep their value, whatever the order of AW and W; reads come back in their order.
TEST(RtlBus, RegistersTakeEachByteByItself) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  std::uint64_t accesses = 0;
  for (int round = 0; round < 12; ++round) {
    SimulatedDevice device(options_of(cosim::core_configurations().front(), any_memory(random, 1, 20), random));
    auto& registers = device.registers();
    std::map<std::uint32_t, std::uint32_t> value;
    for (const std::uint32_t offset : kConfigurationRegisters) value[offset] = 0;
    for (int phase = 0; phase < 10; ++phase) {
      for (int i = 0; i < 40; ++i) {
        const std::uint32_t offset = kConfigurationRegisters[random.below(std::size(kConfigurationRegisters))];
        const auto data = static_cast<std::uint32_t>(random.bits());
        const auto strobes = static_cast<std::uint32_t>(random.below(16));
        registers.write(offset, data, strobes);
        for (int byte = 0; byte < 4; ++byte)
          if ((strobes >> byte & 1) != 0)
            value[offset] = (value[offset] & ~(0xffu << (8 * byte))) | (data & 0xffu << (8 * byte));
        if (random.chance(2)) registers.read(RT_OFFSET(id));
      }
      for (int clocks = 0; clocks < 100000 && !registers.idle(); ++clocks) device.run(1);
      ASSERT_TRUE(registers.idle());
      for (const auto& answer : registers.write_answers()) ASSERT_EQ(answer.response, 0u);
      for (const auto& answer : registers.read_answers())
        ASSERT_TRUE(answer.response == 0 && answer.data == RT_REGS__ID__VALUE_reset);
      registers.read_answers().clear();
      registers.write_answers().clear();
      for (const auto& [offset, expected] : value) registers.read(offset);
      for (int clocks = 0; clocks < 100000 && !registers.idle(); ++clocks) device.run(1);
      ASSERT_EQ(registers.read_answers().size(), value.size());
      for (const auto& [offset, expected] : value) {
        EXPECT_EQ(registers.read_answers().front().data, expected) << "register " << offset;
        registers.read_answers().pop_front();
      }
      ASSERT_FALSE(HasFailure()) << "round " << round;
    }
    device.check_idle();
    accesses += device.lite_monitor().transactions();
  }
  EXPECT_GT(accesses, 5000u);
}

// Everything but a soft reset may be written at any moment of a run, and has no effect on it: the run ends, with the hits of the registers as they
// were at its start. In every third round the first write follows the start without a gap.
TEST(RtlBus, WritesDuringARunHaveNoEffectOnIt) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  Workload& work = workload("room:detail=0.02");
  const auto& configurations = cosim::core_configurations();
  for (std::size_t round = 0; round < 12; ++round) {
    const std::string& configuration = configurations[round % configurations.size()];
    SCOPED_TRACE("round " + std::to_string(round) + ", " + configuration);
    SimulatedDevice device(options_of(configuration, any_memory(random, 20, 60), random));
    PartialWrites port(device, random.bits());
    CoreDriver driver(port);
    CheckedRun run(device, driver, work);
    run.place = any_placement(random);
    run.place.image %= kPage / 2;  // headers across a page are ImageAtEveryBase's
    run.count = 300 + random.below(100);
    run.first = random.below(work.rays.size() - run.count);
    run.mode.parent_links = random.chance(2);
    run.mode.mailbox = random.chance(2);
    run.mode.ray_row = random.chance(2) ? 16 : 0;
    ASSERT_NO_THROW(run.start(random));
    const auto undisturbed = run.wait(kPatience);
    ASSERT_TRUE(undisturbed.has_value());
    run.check();
    ASSERT_FALSE(HasFailure()) << "without any write; " << run.where();

    const auto storm = [&](cosim::AxiLiteMaster& registers) {
      std::vector<std::uint32_t> offsets(kRegisterBytes / 4);
      for (std::size_t i = 0; i < offsets.size(); ++i) offsets[i] = static_cast<std::uint32_t>(4 * i);
      for (std::size_t i = offsets.size(); i > 1; --i) std::swap(offsets[i - 1], offsets[random.below(i)]);
      // The one that used to hang a run comes first.
      registers.write(RT_OFFSET(ray_count), static_cast<std::uint32_t>(random.below(run.count)));
      for (const std::uint32_t offset : offsets) {
        auto value = static_cast<std::uint32_t>(random.bits());
        if (offset == RT_OFFSET(control)) value &= ~static_cast<std::uint32_t>(RT_REGS__CONTROL__SOFT_RESET_bm);
        registers.write(offset, value, random.chance(2) ? 0xf : static_cast<std::uint32_t>(random.below(16)));
        if (random.chance(4)) registers.read(offset);
      }
    };
    if (round % 3 == 0) port.behind_start = storm;
    ASSERT_NO_THROW(run.start(random));
    if (round % 3 != 0) {
      ASSERT_NO_THROW(device.run(random.below(*undisturbed / 3)));
      storm(device.registers());
    }
    while (!device.registers().idle()) ASSERT_NO_THROW(device.run(1)) << run.where();
    ASSERT_TRUE(driver.status().busy) << "the run was too short to be disturbed";
    std::optional<std::uint64_t> disturbed;
    ASSERT_NO_THROW(disturbed = run.wait(4 * *undisturbed)) << run.where();
    ASSERT_TRUE(disturbed.has_value()) << "the run does not end; without writes it takes " << *undisturbed
                                       << " clocks; " << run.where();
    ASSERT_NO_THROW(run.check()) << run.where();
    EXPECT_FALSE(driver.status().write_fault);
    ASSERT_FALSE(HasFailure()) << run.where();
    // Nothing of it is left for the next run.
    ASSERT_NO_THROW(run.start(random));
    ASSERT_TRUE(run.wait(4 * *undisturbed).has_value()) << "the run after";
    run.check();
    ASSERT_FALSE(HasFailure()) << "the run after; " << run.where();
  }
}

// A soft reset in the middle of register traffic and of a run: what is in flight ends, nothing is answered twice or not at all.
TEST(RtlBus, ResetsAmongTraffic) {
  SCOPED_TRACE("seed " + std::to_string(test_seed()));
  Random random(test_seed());
  Workload& work = workload("room:detail=0.02");
  const auto& configurations = cosim::core_configurations();
  for (std::size_t round = 0; round < 16; ++round) {
    const std::string& configuration = configurations[round % configurations.size()];
    const bool hard = round % 4 >= 2;
    SCOPED_TRACE("round " + std::to_string(round) + ", " + configuration + (hard ? ", hard" : ", soft"));
    SimulatedDevice device(options_of(configuration, any_memory(random, 1, 200), random));
    PartialWrites port(device, random.bits());
    CoreDriver driver(port);
    CheckedRun run(device, driver, work);
    run.place = {.image = 64 * random.below(kPage / 128), .rays = 0, .hits = 16 * random.below(kPage / 16)};
    run.count = 100;
    run.first = random.below(work.rays.size() - run.count);
    for (int reset = 0; reset < 4; ++reset) {
      ASSERT_NO_THROW(run.start(random)) << run.where();
      for (int i = 0; i < 10; ++i) device.registers().read(static_cast<std::uint32_t>(random.below(128) * 4));
      ASSERT_NO_THROW(device.run(random.below(reset == 0 ? 100 : 8000)));
      if (hard)
        ASSERT_NO_THROW(device.hard_reset());
      else
        ASSERT_NO_THROW(driver.soft_reset());
      ASSERT_TRUE(device.memory().idle());
      const auto status = driver.status();
      EXPECT_FALSE(status.busy || status.done || status.ray_fault);
      ASSERT_EQ(device.memory().stray_writes(), 0u);
      const auto times = device.memory().written_times();
      ASSERT_TRUE(std::all_of(times.begin(), times.end(), [](std::uint8_t n) { return n <= 1; }));
    }
    ASSERT_NO_THROW(run.start(random));
    ASSERT_TRUE(run.wait(kPatience).has_value());
    run.check();
    ASSERT_FALSE(HasFailure()) << run.where();
  }
}

}  // namespace
