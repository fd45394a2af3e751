// The AXI4 pins of a Verilated slave with a bus of 8 bytes.
#pragma once
#include "testbench/sim/core/core_model.hpp"

namespace retrace::cosim {

template <typename Model>
void drive_axi(Model& m, const AxiMasterSignals& in) {
  m.ar_valid_i = in.ar_valid;
  m.ar_id_i = in.ar_id;
  m.ar_addr_i = in.ar_addr;
  m.ar_len_i = in.ar_len;
  m.ar_size_i = in.ar_size;
  m.ar_burst_i = in.ar_burst;
  m.r_ready_i = in.r_ready;
  m.aw_valid_i = in.aw_valid;
  m.aw_id_i = in.aw_id;
  m.aw_addr_i = in.aw_addr;
  m.aw_len_i = in.aw_len;
  m.aw_size_i = in.aw_size;
  m.aw_burst_i = in.aw_burst;
  m.w_valid_i = in.w_valid;
  m.w_data_i = in.w_data[0];
  m.w_strb_i = in.w_strb;
  m.w_last_i = in.w_last;
  m.b_ready_i = in.b_ready;
}

template <typename Model>
void look_at_axi(const Model& m, AxiSlaveSignals& out) {
  out.ar_ready = m.ar_ready_o;
  out.aw_ready = m.aw_ready_o;
  out.w_ready = m.w_ready_o;
  out.r_valid = m.r_valid_o;
  out.r_id = m.r_id_o;
  out.r_data[0] = m.r_data_o;
  out.r_resp = m.r_resp_o;
  out.r_last = m.r_last_o;
  out.b_valid = m.b_valid_o;
  out.b_id = m.b_id_o;
  out.b_resp = m.b_resp_o;
}

}  // namespace retrace::cosim
