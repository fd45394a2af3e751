// See dram_init.hpp.
#include "testbench/driver/dram_init.hpp"

#include <optional>

#include "golden/base/error.hpp"

namespace retrace::cosim {
namespace {

// Bits of the DFI registers of LiteDRAM.
constexpr std::uint32_t kHardware = 0x01, kCke = 0x02, kOdt = 0x04, kResetN = 0x08;
constexpr std::uint32_t kCs = 0x01, kWe = 0x02, kCas = 0x04, kRas = 0x08, kWriteData = 0x10, kReadData = 0x20;
constexpr std::uint32_t kSettle = 15;  // clocks between the commands of a test
constexpr int kChecks = 8;             // of the delay that was chosen
constexpr std::array<std::uint64_t, 3> kSeeds = {42, 84, 36};

class Levelling {
 public:
  Levelling(const DramFacts& facts, DramControl& control) : facts_(facts), control_(control) {}

  LaneWindow lane(std::uint32_t lane) {
    std::optional<LaneWindow> best;
    step(lane, facts_.bitslip_reset);
    for (std::uint32_t bitslip = 0; bitslip < facts_.bitslips; ++bitslip) {
      if (bitslip > 0) step(lane, facts_.bitslip_step);
      step(lane, facts_.delay_reset);
      std::uint32_t run = 0;
      for (std::uint32_t delay = 0; delay < facts_.delays; ++delay) {
        if (delay > 0) step(lane, facts_.delay_step);
        run = holds(lane) ? run + 1 : 0;
        if (run >= kLeastWindow && (!best || run > best->last - best->first + 1))
          best = LaneWindow{bitslip, delay + 1 - run, delay};
      }
    }
    if (!best)
      throw Error("DRAM " + std::string(facts_.name) + ": read levelling finds no window for byte lane " +
                  std::to_string(lane) + " among " + std::to_string(facts_.bitslips) + " bitslips and " +
                  std::to_string(facts_.delays) + " delays");
    set(lane, *best);
    for (int i = 0; i < kChecks; ++i)
      if (!holds(lane))
        throw Error("DRAM " + std::string(facts_.name) + ": read levelling of byte lane " + std::to_string(lane) +
                    " does not hold at bitslip " + std::to_string(best->bitslip) + ", delay " +
                    std::to_string(best->delay()));
    return *best;
  }

 private:
  void step(std::uint32_t lane, std::uint32_t what) {
    control_.write(facts_.lane_select, 1u << lane);
    control_.write(what, 1);
    control_.write(facts_.lane_select, 0);
    // All lanes are paused once together, so that they stay in step.
    control_.write(facts_.lane_select, (1u << facts_.lanes) - 1);
    control_.write(facts_.lane_select, 0);
    control_.wait(kSettle);
  }
  void set(std::uint32_t lane, const LaneWindow& window) {
    step(lane, facts_.bitslip_reset);
    for (std::uint32_t i = 0; i < window.bitslip; ++i) step(lane, facts_.bitslip_step);
    step(lane, facts_.delay_reset);
    for (std::uint32_t i = 0; i < window.delay(); ++i) step(lane, facts_.delay_step);
  }
  void command(std::uint32_t phase, std::uint32_t address, std::uint32_t bits) {
    const DramFacts::Phase& p = facts_.phase[phase];
    control_.write(p.address, address);
    control_.write(p.bank, 0);
    control_.write(p.command, bits);
    control_.write(p.issue, 1);
    control_.wait(kSettle);
  }
  bool holds(std::uint32_t lane) {
    for (const std::uint64_t seed : kSeeds)
      if (!holds(lane, seed)) return false;
    return true;
  }
  /// Words written to the first row are read again; the bytes of this lane are compared, and that the PHY has seen the burst.
  bool holds(std::uint32_t lane, std::uint64_t seed) {
    std::uint64_t state = seed;
    const auto draw = [&] {
      state ^= state << 13;
      state ^= state >> 7;
      state ^= state << 17;
      return static_cast<std::uint32_t>(state >> 16);
    };
    for (int i = 0; i < 8; ++i) draw();
    std::vector<std::vector<std::uint32_t>> written;
    command(0, 0, kRas | kCs);
    for (std::uint32_t p = 0; p < facts_.phases; ++p) {
      written.emplace_back();
      for (std::uint32_t i = 0; i < facts_.phase[p].data_words; ++i) {
        written[p].push_back(draw());
        control_.write(facts_.phase[p].write_data + 4 * i, written[p][i]);
      }
    }
    command(facts_.write_phase, 0, kCas | kWe | kCs | kWriteData);
    control_.write(facts_.burst_clear, 1);
    command(facts_.read_phase, 0, kCas | kCs | kReadData);
    command(0, 0, kRas | kWe | kCs);
    std::uint32_t wrong = 0;
    for (std::uint32_t p = 0; p < facts_.phases; ++p)
      for (std::uint32_t i = 0; i < facts_.phase[p].data_words; ++i)
        wrong |= (control_.read(facts_.phase[p].read_data + 4 * i) ^ written[p][i]) & lane_bits(lane);
    return wrong == 0 && (control_.read(facts_.burst_seen) >> lane & 1) != 0;
  }
  /// Bytes of a lane: each beat of the DRAM has one of each lane, the first lane's lowest.
  std::uint32_t lane_bits(std::uint32_t lane) const {
    std::uint32_t bits = 0;
    for (std::uint32_t byte = lane; byte < 4; byte += facts_.lanes) bits |= 0xffu << (8 * byte);
    return bits;
  }

  const DramFacts& facts_;
  DramControl& control_;
};

}  // namespace

std::vector<LaneWindow> initialise_dram(const DramFacts& facts, DramControl& control) {
  control.write(facts.init_done, 0);
  control.write(facts.init_error, 0);
  control.write(facts.control, kCke | kOdt | kResetN);
  for (const DramStep& step : facts.sequence) {
    control.write(facts.phase[0].address, step.address);
    control.write(facts.phase[0].bank, step.bank);
    if (step.control) {
      control.write(facts.control, step.command);
    } else {
      control.write(facts.phase[0].command, step.command);
      control.write(facts.phase[0].issue, 1);
    }
    control.wait(step.wait);
  }
  std::vector<LaneWindow> windows;
  try {
    Levelling levelling(facts, control);
    for (std::uint32_t lane = 0; facts.delays > 0 && lane < facts.lanes; ++lane)
      windows.push_back(levelling.lane(lane));
  } catch (...) {
    control.write(facts.init_error, 1);
    throw;
  }
  control.write(facts.control, kHardware);
  control.write(facts.init_done, 1);
  return windows;
}

}  // namespace retrace::cosim
