// A verilated model with one clock: reset, one step a clock.
#pragma once
#include <cstdint>

#include "testbench/sim/verilated_top.hpp"

namespace retrace::cosim {

template <typename Model>
class Clocked {
 public:
  explicit Clocked(std::uint64_t seed) : model_(seed) {
    model_->clk_i = 0;
    model_->rst_ni = 0;
    model_.eval();
  }

  Model& operator*() { return *model_; }
  Model* operator->() { return &*model_; }

  void reset(int clocks = 4) {
    model_->rst_ni = 0;
    for (int i = 0; i < clocks; ++i) step();
    model_->rst_ni = 1;
    settle();
  }

  // A clock is: set inputs, settle(), look at the outputs, rise().

  /// Clock low: combinational outputs follow the inputs.
  void settle() {
    model_->clk_i = 0;
    model_.eval();
  }
  /// The rising edge: registers take over what settle() showed.
  void rise() {
    model_->clk_i = 1;
    model_.eval();
    ++clock_;
  }
  void step() {
    settle();
    rise();
  }

  std::uint64_t clock() const { return clock_; }
  /// An assertion or a $stop was reached.
  bool failed() const { return model_.failed(); }

 private:
  VerilatedTop<Model> model_;
  std::uint64_t clock_ = 0;
};

}  // namespace retrace::cosim
