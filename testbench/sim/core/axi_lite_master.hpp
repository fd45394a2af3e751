// Drives an AXI4-Lite port: accesses are queued, and each of the five channels goes at its own pace, so that AW and W come together, apart or
// overlapping with those of other writes, either of them first. Writes end in their order, reads end in theirs.
#pragma once
#include <array>
#include <cstdint>
#include <deque>

#include "testbench/sim/core/axi_monitor.hpp"
#include "testbench/sim/core/core_model.hpp"
#include "testbench/sim/hold_off.hpp"

namespace retrace::cosim {

/// When a channel may be active, by AxiChannel; by default always, so that an access takes as long as the core wants.
struct LiteOptions {
  std::array<HoldOff, kAxiChannels> hold_off = {HoldOff::none(), HoldOff::none(), HoldOff::none(), HoldOff::none(),
                                                HoldOff::none()};
  std::uint64_t seed = 1;  ///< of what the payload signals show while nothing is valid
};

class AxiLiteMaster {
 public:
  struct Answer {
    std::uint32_t response, data;
  };
  explicit AxiLiteMaster(const LiteOptions& options) : options_(options), random_(options.seed) {}

  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t strobes = 0xf);
  void read(std::uint32_t offset);
  /// Forgets what is queued, in flight or answered.
  void reset();
  /// Everything queued has been answered.
  bool idle() const { return writes_open_ == 0 && reads_open_ == 0; }
  std::uint64_t open() const { return writes_open_ + reads_open_; }
  /// Answers nobody has taken yet, oldest first.
  std::deque<Answer>& write_answers() { return write_answers_; }
  std::deque<Answer>& read_answers() { return read_answers_; }

  /// What is driven in this clock. Call it once a clock, before clock().
  const AxiLiteMasterSignals& drive();
  /// End of the clock, in which the core drove `slave`.
  void clock(const AxiLiteSlaveSignals& slave);

 private:
  struct Beat {
    std::uint32_t value, strobes;
  };
  bool active(AxiChannel channel) { return options_.hold_off[static_cast<std::size_t>(channel)].next(); }

  LiteOptions options_;
  Random random_;
  AxiLiteMasterSignals out_;
  std::deque<std::uint32_t> aw_, ar_;
  std::deque<Beat> w_;
  std::uint64_t writes_open_ = 0, reads_open_ = 0;
  std::deque<Answer> write_answers_, read_answers_;
};

}  // namespace retrace::cosim
