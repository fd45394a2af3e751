// One Verilated core with plain signals: whoever drives it does not see Verilator, the configuration or the width of the bus.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace retrace::cosim {

/// What the AXI4 master of the core drives. Data of up to 128 bits, low word first.
struct AxiMasterSignals {
  bool ar_valid = false, aw_valid = false, w_valid = false, w_last = false, r_ready = false, b_ready = false;
  std::uint32_t ar_id = 0, aw_id = 0;
  std::uint64_t ar_addr = 0, aw_addr = 0;
  std::uint32_t ar_len = 0, ar_size = 0, ar_burst = 0, aw_len = 0, aw_size = 0, aw_burst = 0;
  std::array<std::uint64_t, 2> w_data{};
  std::uint32_t w_strb = 0;
};

/// What the memory drives.
struct AxiSlaveSignals {
  bool ar_ready = false, aw_ready = false, w_ready = false, r_valid = false, r_last = false, b_valid = false;
  std::uint32_t r_id = 0, b_id = 0, r_resp = 0, b_resp = 0;
  std::array<std::uint64_t, 2> r_data{};
};

struct AxiLiteMasterSignals {
  bool aw_valid = false, w_valid = false, b_ready = false, ar_valid = false, r_ready = false;
  std::uint32_t aw_addr = 0, w_data = 0, w_strb = 0xf, ar_addr = 0;
};
struct AxiLiteSlaveSignals {
  bool aw_ready = false, w_ready = false, b_valid = false, ar_ready = false, r_valid = false;
  std::uint32_t b_resp = 0, r_data = 0, r_resp = 0;
};

struct CoreInputs {
  bool rst_n = false;
  AxiLiteMasterSignals lite;
  AxiSlaveSignals axi;
};
struct CoreOutputs {
  bool irq = false;
  AxiLiteSlaveSignals lite;
  AxiMasterSignals axi;
};

class CoreModel {
 public:
  virtual ~CoreModel() = default;
  /// One rising clock edge that sees `inputs`; `outputs` are what the core drives after it.
  virtual void clock(const CoreInputs& inputs, CoreOutputs& outputs) = 0;
  virtual int data_bytes() const = 0;
  virtual std::uint64_t clocks() const = 0;
  /// An assertion of the RTL has failed.
  virtual bool failed() const = 0;
};

/// Configurations that are built: names for make_core_model.
const std::vector<std::string>& core_configurations();
/// Further names for it: configurations that are compiled without optimisation, for short tests.
const std::vector<std::string>& quick_core_configurations();
/// `waves`: file for an FST of the whole run, empty for none. Registers start with random contents drawn from `seed`. Throws Error for an
/// unknown name, listing the known ones.
std::unique_ptr<CoreModel> make_core_model(const std::string& configuration, std::uint64_t seed,
                                           const std::string& waves = {});

}  // namespace retrace::cosim
