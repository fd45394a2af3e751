// What the stages of a verilated core take and give, as testbench/sim/sv/rt_stage_probe.sv sees it.
#pragma once
#include <deque>
#include <vector>

#include "golden/engine/walk.hpp"

namespace retrace::cosim {

/// While one lives, models that are reset in its thread report to it. One at a time in a thread.
class StageWatch {
 public:
  StageWatch();
  ~StageWatch();
  StageWatch(const StageWatch&) = delete;
  StageWatch& operator=(const StageWatch&) = delete;

  /// The calls in the order in which their inputs were taken. Only if one ray is in the core at a time is that the order of its walk. Throws
  /// Error if a stage has not answered.
  std::vector<StageCall> calls() const;

  void takes(int stage, const std::uint32_t* data);
  void gives(int stage, const std::uint32_t* data);

 private:
  struct Seen {
    Stage stage;
    std::vector<std::uint64_t> input, output;
  };
  std::vector<Seen> seen_;
  std::array<std::deque<std::size_t>, kStages>
      waiting_;  ///< of each stage, which it has not answered; stages keep the order
};

}  // namespace retrace::cosim
