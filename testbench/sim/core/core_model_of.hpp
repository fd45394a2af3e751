// CoreModel over one Verilated top; instantiated once for each configuration (core_model_config.cpp.in).
#pragma once
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

#include "testbench/sim/core/core_model.hpp"
#include "testbench/sim/verilated_top.hpp"

namespace retrace::cosim {

template <typename Model>
class CoreModelOf final : public CoreModel {
 public:
  CoreModelOf(std::uint64_t seed, const std::string& waves) : model_(seed, waves) {
    model_->clk_i = 0;
    model_->rst_ni = 0;
    model_.eval();
  }

  // Verilator settles the logic behind the inputs before it looks at the clock, so inputs and edge go into one evaluation.
  void clock(const CoreInputs& in, CoreOutputs& out) override {
    Model& m = *model_;
    m.rst_ni = in.rst_n;
    m.axil_aw_valid_i = in.lite.aw_valid;
    m.axil_aw_addr_i = in.lite.aw_addr;
    m.axil_w_valid_i = in.lite.w_valid;
    m.axil_w_data_i = in.lite.w_data;
    m.axil_w_strb_i = in.lite.w_strb;
    m.axil_b_ready_i = in.lite.b_ready;
    m.axil_ar_valid_i = in.lite.ar_valid;
    m.axil_ar_addr_i = in.lite.ar_addr;
    m.axil_r_ready_i = in.lite.r_ready;
    m.axi_ar_ready_i = in.axi.ar_ready;
    m.axi_r_valid_i = in.axi.r_valid;
    m.axi_r_id_i = in.axi.r_id;
    m.axi_r_resp_i = in.axi.r_resp;
    m.axi_r_last_i = in.axi.r_last;
    m.axi_aw_ready_i = in.axi.aw_ready;
    m.axi_w_ready_i = in.axi.w_ready;
    m.axi_b_valid_i = in.axi.b_valid;
    m.axi_b_id_i = in.axi.b_id;
    m.axi_b_resp_i = in.axi.b_resp;
    if constexpr (kWide) {
      for (int i = 0; i < 4; ++i)
        m.axi_r_data_i[i] = static_cast<std::uint32_t>(in.axi.r_data[i / 2] >> (32 * (i % 2)));
    } else {
      m.axi_r_data_i = in.axi.r_data[0];
    }
    m.clk_i = 1;
    model_.eval(10 * clocks_ + 5);
    out.irq = m.irq_o;
    out.lite.aw_ready = m.axil_aw_ready_o;
    out.lite.w_ready = m.axil_w_ready_o;
    out.lite.b_valid = m.axil_b_valid_o;
    out.lite.b_resp = m.axil_b_resp_o;
    out.lite.ar_ready = m.axil_ar_ready_o;
    out.lite.r_valid = m.axil_r_valid_o;
    out.lite.r_data = m.axil_r_data_o;
    out.lite.r_resp = m.axil_r_resp_o;
    out.axi.ar_valid = m.axi_ar_valid_o;
    if (out.axi.ar_valid) {
      out.axi.ar_id = m.axi_ar_id_o;
      out.axi.ar_addr = m.axi_ar_addr_o;
      out.axi.ar_len = m.axi_ar_len_o;
      out.axi.ar_size = m.axi_ar_size_o;
      out.axi.ar_burst = m.axi_ar_burst_o;
    }
    out.axi.r_ready = m.axi_r_ready_o;
    out.axi.b_ready = m.axi_b_ready_o;
    out.axi.aw_valid = m.axi_aw_valid_o;
    if (out.axi.aw_valid) {
      out.axi.aw_id = m.axi_aw_id_o;
      out.axi.aw_addr = m.axi_aw_addr_o;
      out.axi.aw_len = m.axi_aw_len_o;
      out.axi.aw_size = m.axi_aw_size_o;
      out.axi.aw_burst = m.axi_aw_burst_o;
    }
    out.axi.w_valid = m.axi_w_valid_o;
    if (out.axi.w_valid) {
      out.axi.w_last = m.axi_w_last_o;
      out.axi.w_strb = m.axi_w_strb_o;
      if constexpr (kWide) {
        for (int i = 0; i < 2; ++i)
          out.axi.w_data[i] = m.axi_w_data_o[2 * i] | (static_cast<std::uint64_t>(m.axi_w_data_o[2 * i + 1]) << 32);
      } else {
        out.axi.w_data[0] = m.axi_w_data_o;
      }
    }
    m.clk_i = 0;
    model_.eval(10 * clocks_ + 10);
    ++clocks_;
  }
  int data_bytes() const override { return kWide ? 16 : 8; }
  std::uint64_t clocks() const override { return clocks_; }
  bool failed() const override { return model_.failed(); }

 private:
  static constexpr bool kWide =
      !std::is_integral_v<std::remove_reference_t<decltype(std::declval<Model>().axi_r_data_i)>>;

  VerilatedTop<Model> model_;
  std::uint64_t clocks_ = 0;
};

}  // namespace retrace::cosim
