// BoardModel over a Verilated board of any configuration. Included by the generated files only.
#pragma once
#include <verilated.h>
#ifdef RETRACE_RTL_WAVES
#include <verilated_fst_c.h>
#endif

#include <memory>
#include <string>

#include "golden/scene/geometry.hpp"
#include "testbench/sim/board/board_model.hpp"
#include "testbench/sim/coverage.hpp"

namespace retrace::cosim {

template <class Model>
class BoardModelOf final : public BoardModel {
 public:
  BoardModelOf(std::uint64_t seed, const std::string& waves) : context_(std::make_unique<VerilatedContext>()) {
    context_->randReset(2);
    context_->randSeed(static_cast<int>(seed % 0x7fffffff) + 1);
    context_->fatalOnError(false);
#ifdef RETRACE_RTL_WAVES
    context_->traceEverOn(!waves.empty());
#else
    if (!waves.empty()) throw Error("this program was built without waves; configure with -DRETRACE_RTL_WAVES=ON");
#endif
    enter();
    model_ = std::make_unique<Model>(context_.get());
#ifdef RETRACE_RTL_WAVES
    if (!waves.empty()) {
      waves_ = std::make_unique<VerilatedFstC>();
      model_->trace(waves_.get(), 99);
      waves_->open(waves.c_str());
      if (!waves_->isOpen()) throw Error("cannot write waves to " + waves);
    }
#endif
    model_->clk_i = 0;
    model_->uart_rx_i = 1;
    reset();
  }
  ~BoardModelOf() override {
    enter();
#ifdef RETRACE_RTL_WAVES
    if (waves_) waves_->close();
#endif
    model_->final();
    save_coverage(*context_);
  }
  BoardModelOf(const BoardModelOf&) = delete;
  BoardModelOf& operator=(const BoardModelOf&) = delete;

  bool clock(bool to_board) override {
    enter();
    model_->uart_rx_i = to_board;
    model_->clk_i = 0;
    model_->eval();
    dump(10 * clocks_);
    model_->clk_i = 1;
    model_->eval();
    dump(10 * clocks_ + 5);
    ++clocks_;
    return model_->uart_tx_o != 0;
  }
  void reset() override {
    model_->rst_ni = 0;
    for (int i = 0; i < 8; ++i) clock(true);
    model_->rst_ni = 1;
  }
  std::uint8_t lamps() const override { return static_cast<std::uint8_t>(model_->led_o); }
  std::uint64_t clocks() const override { return clocks_; }
  bool failed() const override { return context_->gotError() || context_->gotFinish(); }

 private:
  // Verilator keeps the context of a thread in a global and does not clear it when the context goes away.
  void enter() { Verilated::threadContextp(context_.get()); }

  std::unique_ptr<VerilatedContext> context_;
  std::unique_ptr<Model> model_;
#ifdef RETRACE_RTL_WAVES
  void dump(std::uint64_t time) {
    if (waves_) waves_->dump(time);
  }
  std::unique_ptr<VerilatedFstC> waves_;
#else
  void dump(std::uint64_t) {}
#endif
  std::uint64_t clocks_ = 0;
};

}  // namespace retrace::cosim
