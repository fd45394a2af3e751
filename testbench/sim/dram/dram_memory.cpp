// See dram_memory.hpp.
#include "testbench/sim/dram/dram_memory.hpp"

#include <algorithm>

#include "golden/base/error.hpp"

namespace retrace::cosim {
namespace {

constexpr std::uint64_t kWordBytes = 8, kBurstWords = 16;
constexpr std::uint32_t kSize = 3, kIncrement = 1;
constexpr std::uint64_t kPatience = 100000;  // clocks without anything accepted or answered
constexpr int kResetClocks = 8;

/// A host's accesses in bursts of kBurstWords that end at multiples of their size, so that none crosses a page.
std::uint64_t burst_words(std::uint64_t address, std::uint64_t left) {
  return std::min(left, kBurstWords - address / kWordBytes % kBurstWords);
}

}  // namespace

DramMemory::DramMemory(const std::string& name, std::uint64_t seed)
    : name_(name), model_(make_dram_model(name, seed)), monitor_(static_cast<int>(kWordBytes)) {
  for (int i = 0; i < kResetClocks; ++i) model_->clock(false, {}, out_);
}

void DramMemory::check(const char* what, std::uint64_t address, std::uint64_t bytes) const {
  if (address % kWordBytes != 0 || address < base() || address - base() > this->bytes() ||
      bytes > this->bytes() - (address - base()))
    throw Error("simulated DRAM " + name_ + ": " + what + " outside the memory");
}

void DramMemory::resize(std::uint64_t bytes) {
  if (bytes > this->bytes())
    throw Error("simulated DRAM " + name_ + ": image, rays and hits need " + std::to_string(bytes) +
                " bytes, the memory has " + std::to_string(this->bytes()));
}

void DramMemory::step(const AxiMasterSignals& master) {
  model_->clock(true, master, out_);
  if (model_->failed()) throw Error("simulated DRAM " + name_ + ": an assertion failed");
}

void DramMemory::reset(const AxiMasterSignals& master) {
  monitor_.clock(false, master, out_);
  // The core's reset goes on longer than the port's.
  model_->clock(false, {}, out_);
}

void DramMemory::clock(const AxiMasterSignals& master) {
  monitor_.clock(true, master, out_);
  if (out_.r_valid && master.r_ready) id_bytes_[out_.r_id % id_bytes_.size()] += kWordBytes;
  model_->clock(true, master, out_);
}

void DramMemory::write(std::uint64_t address, std::span<const std::uint64_t> words) {
  check("write", address, words.size() * kWordBytes);
  AxiMasterSignals m;
  m.b_ready = true;
  m.aw_size = kSize;
  m.aw_burst = kIncrement;
  m.w_strb = 0xff;
  std::uint64_t addressed = 0, sent = 0, open = 0, quiet = 0;
  std::uint64_t sent_end = 0;  // of the burst whose beats are sent
  while (sent < words.size() || open > 0) {
    if (++quiet > kPatience) throw Error("simulated DRAM " + name_ + ": a write is not answered");
    if (!m.aw_valid && addressed < words.size()) {
      m.aw_valid = true;
      m.aw_addr = address + addressed * kWordBytes;
      m.aw_len = static_cast<std::uint32_t>(burst_words(m.aw_addr, words.size() - addressed) - 1);
    }
    if (!m.w_valid && sent < words.size()) {
      if (sent == sent_end) sent_end = sent + burst_words(address + sent * kWordBytes, words.size() - sent);
      m.w_valid = true;
      m.w_data[0] = words[sent];
      m.w_last = sent + 1 == sent_end;
    }
    const AxiSlaveSignals driven = out_;
    step(m);
    if (m.aw_valid && driven.aw_ready) {
      m.aw_valid = false;
      addressed += m.aw_len + 1;
      ++open;
      quiet = 0;
    }
    if (m.w_valid && driven.w_ready) {
      m.w_valid = false;
      ++sent;
      quiet = 0;
    }
    if (driven.b_valid) {
      if (driven.b_resp != 0) throw Error("simulated DRAM " + name_ + ": a write was answered with an error");
      --open;
      quiet = 0;
    }
  }
}

void DramMemory::read(std::uint64_t address, std::span<std::uint64_t> words) {
  check("read", address, words.size() * kWordBytes);
  AxiMasterSignals m;
  m.r_ready = true;
  m.ar_size = kSize;
  m.ar_burst = kIncrement;
  std::uint64_t addressed = 0, taken = 0, quiet = 0;
  while (taken < words.size()) {
    if (++quiet > kPatience) throw Error("simulated DRAM " + name_ + ": a read is not answered");
    if (!m.ar_valid && addressed < words.size()) {
      m.ar_valid = true;
      m.ar_addr = address + addressed * kWordBytes;
      m.ar_len = static_cast<std::uint32_t>(burst_words(m.ar_addr, words.size() - addressed) - 1);
    }
    const AxiSlaveSignals driven = out_;
    step(m);
    if (m.ar_valid && driven.ar_ready) {
      m.ar_valid = false;
      addressed += m.ar_len + 1;
      quiet = 0;
    }
    if (driven.r_valid) {
      if (driven.r_resp != 0) throw Error("simulated DRAM " + name_ + ": a read was answered with an error");
      words[taken++] = driven.r_data[0];
      quiet = 0;
    }
  }
}

}  // namespace retrace::cosim
