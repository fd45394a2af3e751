// One Verilated top in a context of its own: random first contents, waves, coverage, and whether an assertion of the RTL has failed.
#pragma once
#include <verilated.h>
#ifdef RETRACE_RTL_WAVES
#include <verilated_fst_c.h>
#endif

#include <cstdint>
#include <memory>
#include <string>

#include "golden/base/error.hpp"
#include "testbench/sim/coverage.hpp"

namespace retrace::cosim {

template <typename Model>
class VerilatedTop {
 public:
  /// Registers start with random contents drawn from `seed`, so that nothing depends on what a simulator happens to start with. `waves`: file for
  /// an FST of the whole run, empty for none. Nothing is evaluated yet.
  explicit VerilatedTop(std::uint64_t seed, const std::string& waves = {})
      : context_(std::make_unique<VerilatedContext>()) {
    context_->randReset(2);
    context_->randSeed(static_cast<int>(seed % 0x7fffffff) + 1);
    context_->fatalOnError(false);  // a failed assertion is reported through failed()
#ifdef RETRACE_RTL_WAVES
    context_->traceEverOn(!waves.empty());
#else
    if (!waves.empty()) throw Error("this program was built without waves; configure with -DRETRACE_RTL_WAVES=ON");
#endif
    enter();
    model_ = std::make_unique<Model>(context_.get());
#ifdef RETRACE_RTL_WAVES
    if (waves.empty()) return;
    waves_ = std::make_unique<VerilatedFstC>();
    model_->trace(waves_.get(), 99);
    waves_->open(waves.c_str());
    if (!waves_->isOpen()) throw Error("cannot write waves to " + waves);
#endif
  }
  ~VerilatedTop() {
    enter();
#ifdef RETRACE_RTL_WAVES
    if (waves_) waves_->close();
#endif
    model_->final();
    save_coverage(*context_);
  }
  VerilatedTop(const VerilatedTop&) = delete;
  VerilatedTop& operator=(const VerilatedTop&) = delete;

  Model& operator*() { return *model_; }
  Model* operator->() { return model_.get(); }
  const Model* operator->() const { return model_.get(); }

  void eval() {
    enter();
    model_->eval();
  }
  /// The same, and what is seen enters the waves at `time`.
  void eval([[maybe_unused]] std::uint64_t time) {
    eval();
#ifdef RETRACE_RTL_WAVES
    if (waves_) waves_->dump(time);
#endif
  }
  /// An assertion or a $stop was reached.
  bool failed() const { return context_->gotError() || context_->gotFinish(); }

 private:
  // Verilator keeps the context of a thread in a global and does not clear it when the context goes away.
  void enter() { Verilated::threadContextp(context_.get()); }

  std::unique_ptr<VerilatedContext> context_;
  std::unique_ptr<Model> model_;
#ifdef RETRACE_RTL_WAVES
  std::unique_ptr<VerilatedFstC> waves_;
#endif
};

}  // namespace retrace::cosim
