// See dram_model.hpp.
#include "testbench/sim/dram/dram_model.hpp"

#include "golden/base/error.hpp"
#include "testbench/sim/dram/axi_pins.hpp"
#include "testbench/sim/verilated_top.hpp"
#include "Vtb_dram_ddr3.h"
#include "Vtb_dram_sdr.h"

namespace retrace::cosim {
namespace {

template <typename Model>
class DramModelOf final : public DramModel {
 public:
  explicit DramModelOf(std::uint64_t seed) : model_(seed) {
    model_->clk_i = 0;
    model_->rst_ni = 0;
    model_.eval();
  }
  // Inputs settle before the edge, as assertions look at what they lead to. The outputs depend on registers alone.
  void clock(bool rst_n, const AxiMasterSignals& in, AxiSlaveSignals& out) override {
    model_->rst_ni = rst_n;
    drive_axi(*model_, in);
    model_->clk_i = 0;
    model_.eval();
    model_->clk_i = 1;
    model_.eval();
    look_at_axi(*model_, out);
  }
  std::uint64_t base() const override { return model_->base_o; }
  std::uint64_t bytes() const override { return model_->bytes_o; }
  bool failed() const override { return model_.failed(); }

 private:
  VerilatedTop<Model> model_;
};

template <typename Model>
std::unique_ptr<DramModel> make(std::uint64_t seed) {
  return std::make_unique<DramModelOf<Model>>(seed);
}
struct Entry {
  const char* name;
  std::unique_ptr<DramModel> (*make)(std::uint64_t);
};
constexpr Entry kEntries[] = {{"ddr3", make<Vtb_dram_ddr3>}, {"sdr", make<Vtb_dram_sdr>}};

}  // namespace

const std::vector<std::string>& dram_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const Entry& entry : kEntries) list.emplace_back(entry.name);
    return list;
  }();
  return names;
}

std::unique_ptr<DramModel> make_dram_model(const std::string& name, std::uint64_t seed) {
  std::string known;
  for (const Entry& entry : kEntries) {
    if (name == entry.name) return entry.make(seed);
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw Error("there is no simulated DRAM '" + name + "'; there are: " + known);
}

}  // namespace retrace::cosim
