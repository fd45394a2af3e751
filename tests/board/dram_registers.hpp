// The registers of a DRAM controller as a model: DFI injector, delays, and byte lanes that answer late, early, or never.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "golden/base/error.hpp"
#include "testbench/driver/dram_init.hpp"
#include "testbench/kit/random.hpp"

namespace retrace::cosim {

/// Where a byte lane can be read: delays first to last at this bitslip. `ragged`: percent of the reads that fail at the first and last of them.
struct Lane {
  std::uint32_t bitslip = 0, first = 0, last = 0;
  unsigned ragged = 0;
  bool burst = true;    ///< the PHY sees the strobes
  int dies_after = -1;  ///< good reads, then never again
};

/// DFI injector, delays and one row of the DRAM. Says what is done out of order.
class DramRegisters final : public DramControl {
 public:
  DramRegisters(const DramFacts& facts, std::vector<Lane> lanes, std::uint64_t seed)
      : facts_(facts), lanes_(std::move(lanes)), random_(seed), slip_(lanes_.size()), delay_(lanes_.size()) {}

  void write(std::uint32_t address, std::uint32_t value) override {
    for (std::uint32_t p = 0; p < facts_.phases; ++p) {
      if (address == facts_.phase[p].issue) issue(p);
    }
    registers_[address] = value;
    if (facts_.delays == 0) return;
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      if ((registers_[facts_.lane_select] >> lane & 1) == 0) continue;
      if (address == facts_.bitslip_reset) slip_[lane] = 0;
      if (address == facts_.bitslip_step) slip_[lane] = (slip_[lane] + 1) % facts_.bitslips;
      if (address == facts_.delay_reset) delay_[lane] = 0;
      if (address == facts_.delay_step) delay_[lane] = (delay_[lane] + 1) % facts_.delays;
    }
    if (address == facts_.burst_clear) registers_[facts_.burst_seen] = 0;
  }
  std::uint32_t read(std::uint32_t address) override { return registers_[address]; }
  void wait(std::uint32_t clocks) override { waited += clocks; }

  std::uint32_t of(std::uint32_t address) { return registers_[address]; }
  std::uint32_t slip(std::size_t lane) const { return slip_[lane]; }
  std::uint32_t delay(std::size_t lane) const { return delay_[lane]; }
  std::vector<std::uint32_t> modes;  ///< mode registers in the order in which they were set, bank << 16 | value
  std::uint64_t waited = 0, rows = 0;
  std::string fault;

 private:
  void issue(std::uint32_t p) {
    const DramFacts::Phase& phase = facts_.phase[p];
    const std::uint32_t command = registers_[phase.command] & 0xf, control = registers_[facts_.control];
    if ((control & 1) != 0) fault = "a command while the controller has the DRAM";
    if ((control & 2) == 0) fault = "a command without CKE";
    if (command == 0xf) modes.push_back(registers_[phase.bank] << 16 | registers_[phase.address]);
    if (command == 0x9) {
      if (open_) fault = "a row opened twice";
      open_ = true;
      ++rows;
    }
    if (command == 0xb) open_ = false;
    if (command == 0x7) {
      if (!open_ || p != facts_.write_phase) fault = "a write without a row or in another phase";
      for (std::uint32_t q = 0; q < facts_.phases; ++q)
        for (std::uint32_t i = 0; i < facts_.phase[q].data_words; ++i)
          stored_[q * 4 + i] = registers_[facts_.phase[q].write_data + 4 * i];
    }
    if (command == 0x5) answer(p);
  }
  void answer(std::uint32_t p) {
    if (!open_ || p != facts_.read_phase) fault = "a read without a row or in another phase";
    std::vector<std::uint32_t> bad(lanes_.size());
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& l = lanes_[lane];
      const bool inside = slip_[lane] == l.bitslip && delay_[lane] >= l.first && delay_[lane] <= l.last;
      const bool edge = delay_[lane] == l.first || delay_[lane] == l.last;
      bad[lane] = !inside || (edge && random_.below(100) < l.ragged) || l.dies_after == 0;
      if (!bad[lane] && l.dies_after > 0) --l.dies_after;
      if (l.burst && inside) registers_[facts_.burst_seen] |= 1u << lane;
    }
    for (std::uint32_t q = 0; q < facts_.phases; ++q)
      for (std::uint32_t i = 0; i < facts_.phase[q].data_words; ++i) {
        std::uint32_t word = stored_[q * 4 + i];
        for (std::uint32_t byte = 0; byte < 4; ++byte)
          if (bad[byte % lanes_.size()] != 0) word ^= static_cast<std::uint32_t>(1 + random_.below(255)) << (8 * byte);
        registers_[facts_.phase[q].read_data + 4 * i] = word;
      }
  }
  const DramFacts& facts_;
  std::vector<Lane> lanes_;
  Random random_;
  std::vector<std::uint32_t> slip_, delay_;
  std::map<std::uint32_t, std::uint32_t> registers_, stored_;
  bool open_ = false;
};

inline const DramFacts& facts(const std::string& name) {
  for (const DramFacts& each : dram_facts())
    if (name == each.name) return each;
  throw Error("there is no " + name);
}

}  // namespace retrace::cosim
