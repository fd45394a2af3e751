// Brings up a board's DRAM through its controller's registers (wb_ctrl of LiteDRAM): the initialisation sequence, then read levelling where the PHY has
// delays, then the controller takes over.
//
// Levelling   For each byte lane all bitslips and delays are tried with known words. The longest run of delays without an error, over all bitslips, is
//             the window; its middle is set and tried again. The rule is that of LiteX's sdram.c, but all beats of a lane are compared and the
//             whole table is known before anything is chosen.
// Error       One that names the lane, where no window of kLeastWindow delays is found or its middle does not hold.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace retrace::cosim {

/// Registers behind wb_ctrl, by their byte address.
class DramControl {
 public:
  virtual ~DramControl() = default;
  virtual void write(std::uint32_t address, std::uint32_t value) = 0;
  virtual std::uint32_t read(std::uint32_t address) = 0;
  /// At least so many clocks of the controller pass.
  virtual void wait(std::uint32_t clocks) = 0;
};

struct DramStep {
  const char* what;
  bool control;  ///< `command` goes to the DFI's control register, otherwise it is a command of phase 0
  std::uint32_t address, bank, command, wait;
};
/// What a controller is, as scripts/boards/generate_memory.py has made it.
struct DramFacts {
  const char* name;
  std::uint64_t bytes;
  std::uint32_t phases, read_phase, write_phase, lanes, bitslips, delays;
  struct Phase {
    std::uint32_t command, issue, address, bank, write_data, read_data, data_words;
  };
  std::array<Phase, 2> phase;
  std::uint32_t control, init_done, init_error;
  /// 0 in a controller without levelling.
  std::uint32_t lane_select, delay_reset, delay_step, bitslip_reset, bitslip_step, burst_clear, burst_seen;
  std::span<const DramStep> sequence;
};
/// All of scripts/boards/memories.yml (generated: dram_facts.cpp).
std::span<const DramFacts> dram_facts();

struct LaneWindow {
  std::uint32_t bitslip = 0, first = 0, last = 0;  ///< delays without an error
  std::uint32_t delay() const { return (first + last) / 2; }
};
constexpr std::uint32_t kLeastWindow = 2;

/// Throws Error; then the controller says init_error. Returns the window of each lane; none where there is nothing to level.
std::vector<LaneWindow> initialise_dram(const DramFacts& facts, DramControl& control);

}  // namespace retrace::cosim
