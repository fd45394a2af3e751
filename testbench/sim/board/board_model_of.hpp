// BoardModel over a Verilated board of any configuration. Included by the generated files only.
#pragma once
#include <cstdint>
#include <string>

#include "testbench/sim/board/board_model.hpp"
#include "testbench/sim/verilated_top.hpp"

namespace retrace::cosim {

template <class Model>
class BoardModelOf final : public BoardModel {
 public:
  BoardModelOf(std::uint64_t seed, const std::string& waves) : model_(seed, waves) {
    model_->clk_i = 0;
    model_->uart_rx_i = 1;
    reset();
  }

  bool clock(bool to_board) override {
    model_->uart_rx_i = to_board;
    model_->clk_i = 0;
    model_.eval(10 * clocks_);
    model_->clk_i = 1;
    model_.eval(10 * clocks_ + 5);
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
  bool failed() const override { return model_.failed(); }

 private:
  VerilatedTop<Model> model_;
  std::uint64_t clocks_ = 0;
};

}  // namespace retrace::cosim
