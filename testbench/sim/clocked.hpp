// A verilated model with one clock, in a context of its own: reset, one step a clock, and whether an assertion of the
// RTL has failed.
#pragma once
#include <verilated.h>

#include <cstdint>
#include <memory>

#include "testbench/sim/coverage.hpp"

namespace retrace::cosim {

template <typename Model>
class Clocked {
 public:
  /// Registers start with random contents drawn from `seed`, so that nothing depends on what a simulator happens to
  /// start with.
  explicit Clocked(std::uint64_t seed) : context_(std::make_unique<VerilatedContext>()) {
    context_->randReset(2);
    context_->randSeed(static_cast<int>(seed % 0x7fffffff) + 1);
    context_->fatalOnError(false);  // a failed assertion is reported through failed()
    enter();
    model_ = std::make_unique<Model>(context_.get());
    model_->clk_i = 0;
    model_->rst_ni = 0;
    model_->eval();
  }
  ~Clocked() {
    enter();
    model_->final();
    save_coverage(*context_);
  }
  Clocked(const Clocked&) = delete;
  Clocked& operator=(const Clocked&) = delete;

  Model& operator*() { return *model_; }
  Model* operator->() { return model_.get(); }

  void reset(int clocks = 4) {
    model_->rst_ni = 0;
    for (int i = 0; i < clocks; ++i) step();
    model_->rst_ni = 1;
    settle();
  }

  // A clock is: set inputs, settle(), look at the outputs, rise().

  /// Clock low: combinational outputs follow the inputs.
  void settle() {
    enter();
    model_->clk_i = 0;
    model_->eval();
  }
  /// The rising edge: registers take over what settle() showed.
  void rise() {
    enter();
    model_->clk_i = 1;
    model_->eval();
    ++clock_;
  }
  void step() {
    settle();
    rise();
  }

  std::uint64_t clock() const { return clock_; }
  /// An assertion or a $stop was reached.
  bool failed() const { return context_->gotError() || context_->gotFinish(); }

 private:
  // Verilator keeps the context of a thread in a global and does not clear it when the context goes away.
  void enter() { Verilated::threadContextp(context_.get()); }

  std::unique_ptr<VerilatedContext> context_;
  std::unique_ptr<Model> model_;
  std::uint64_t clock_ = 0;
};

}  // namespace retrace::cosim
