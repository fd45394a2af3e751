// Memory behind an AXI4 port: any latency, order, bandwidth and back-pressure, errors where they are wanted. An AxiMonitor watches the port.
//
// Model. A read burst is answered `latency` clocks after its address was accepted at the earliest, a write burst `latency` clocks after its last
// beat; a bucket of `bytes_per_clock`, shared by reads and writes, limits what flows. Without `reorder` bursts are answered in the order in
// which they were asked for. With it, beats of different ids are mixed at random; within an id the order stays. `stall_percent` takes ready
// and valid away at random, `hold_off` does so for each channel by a rule of its own. Only bytes whose strobe is set are written. A burst that
// crosses 4 KB is answered with DECERR and has no effect; the monitor names it.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "testbench/kit/random.hpp"
#include "testbench/sim/core/axi_monitor.hpp"
#include "testbench/sim/core/bus_memory.hpp"
#include "testbench/sim/hold_off.hpp"

namespace retrace::cosim {

/// Which half of a write this memory wants to see before it accepts the other.
enum class WriteOrder { kFree, kAddressFirst, kDataFirst };

struct MemoryOptions {
  int latency_min = 40, latency_max = 40;  ///< clocks, drawn for each burst
  double bytes_per_clock = 0;              ///< 0: what the bus can do in one direction
  bool reorder = false;
  int stall_percent = 0;
  std::uint64_t seed = 1;
  /// When a channel may be active, by AxiChannel.
  std::array<HoldOff, kAxiChannels> hold_off = {HoldOff::none(), HoldOff::none(), HoldOff::none(), HoldOff::none(),
                                                HoldOff::none()};
  WriteOrder write_order = WriteOrder::kFree;
  std::uint64_t base = 0x10000000;  ///< address of the first byte, a multiple of 4096
  std::uint64_t most_wait = 0;      ///< AxiMonitorLimits::most_wait
  /// One of dram_names(): a simulated DRAM takes the place of this model, and nothing else here has a meaning.
  std::string dram = {};
};

/// What goes wrong on purpose. Bursts are counted from the last arm().
struct ErrorInjection {
  std::int64_t read_burst = -1;  ///< number of the read burst that is answered with an error; -1 none
  int read_beat = -1;            ///< only this beat of it; -1 all
  std::int64_t write_burst = -1;
  std::uint64_t bad_begin = 0, bad_end = 0;  ///< reads in [bad_begin, bad_end) are errors
  bool decode_error = false;                 ///< DECERR instead of SLVERR
};

class AxiMemory final : public BusMemory {
 public:
  AxiMemory(int data_bytes, const MemoryOptions& options);

  void resize(std::uint64_t bytes) override;
  std::uint64_t base() const override { return options_.base; }
  std::uint64_t bytes() const { return words_.size() * 8; }
  void write(std::uint64_t address, std::span<const std::uint64_t> words) override;
  void read(std::uint64_t address, std::span<std::uint64_t> words) override;

  void reset(const AxiMasterSignals& master) override;
  void clock(const AxiMasterSignals& master) override;
  const AxiSlaveSignals& signals() const override { return out_; }

  /// Counts from now on how often each byte in [begin, end) is written by the master, and its bytes written elsewhere.
  void watch_writes(std::uint64_t begin, std::uint64_t end);
  std::span<const std::uint8_t> written_times() const { return written_times_; }
  std::uint64_t stray_writes() const { return stray_writes_; }

  void arm(const ErrorInjection& errors);
  void set_options(const MemoryOptions& options);
  /// Nothing asked for and not answered.
  bool idle() const {
    return reads_.empty() && writes_.empty() && answers_.empty() && write_words_.empty() && !out_.r_valid &&
           !out_.b_valid;
  }
  AxiMonitor& monitor() override { return monitor_; }
  const AxiMonitor& monitor() const { return monitor_; }
  std::uint64_t read_bursts() const { return read_bursts_; }
  std::uint64_t hurt_beats() const { return hurt_beats_; }  ///< beats of reads that were errors on purpose
  std::uint64_t write_bursts() const { return write_bursts_; }
  std::uint64_t read_bytes() const { return read_bytes_; }
  std::uint64_t read_bytes_of(std::uint32_t id) const override { return id_bytes_[id % id_bytes_.size()]; }
  std::uint64_t written_bytes() const { return written_bytes_; }
  /// Bursts outside the memory or across 4 KB; answered with DECERR. A correct core has none.
  std::uint64_t outside() const { return outside_; }

 private:
  struct Read {
    std::uint32_t id;
    std::uint64_t address, ready;
    std::uint32_t beats, beat = 0;
    std::int64_t number;
    bool outside;
  };
  struct Write {
    std::uint32_t id;
    std::uint64_t address;
    std::uint32_t beats;
    std::int64_t number;
    bool outside;
  };
  struct Answer {
    std::uint32_t id, response;
    std::uint64_t ready;
  };
  struct Beat {
    std::array<std::uint64_t, 2> data;
    std::uint32_t strobes;
  };
  bool refused(std::uint64_t address, std::uint64_t bytes) const;
  bool inside(std::uint64_t address, std::uint64_t bytes) const;
  std::uint64_t latency();
  bool stalled(AxiChannel channel) {
    const bool active = options_.hold_off[static_cast<std::size_t>(channel)].next();
    return !active ||
           (options_.stall_percent > 0 && random_.below(100) < static_cast<unsigned>(options_.stall_percent));
  }
  template <typename Entry>
  typename std::deque<Entry>::iterator choose(std::deque<Entry>& entries);
  void store(std::uint64_t address, const Beat& beat);
  void accept(const AxiMasterSignals& m);
  void finish_writes();
  void drive();

  int data_bytes_;
  MemoryOptions options_;
  Random random_;
  ErrorInjection errors_;
  std::vector<std::uint64_t> words_;
  std::uint64_t now_ = 0;
  double bucket_ = 0;
  AxiSlaveSignals out_;
  std::deque<Read> reads_;
  std::deque<Write> writes_;
  std::deque<Beat> write_words_;
  std::deque<Answer> answers_;
  AxiMonitor monitor_;
  std::uint64_t watch_begin_ = 0, stray_writes_ = 0;
  std::vector<std::uint8_t> written_times_;
  std::uint64_t read_bursts_ = 0, hurt_beats_ = 0, write_bursts_ = 0, read_bytes_ = 0, written_bytes_ = 0, outside_ = 0;
  std::array<std::uint64_t, 128> id_bytes_{};
  std::int64_t read_number_ = 0, write_number_ = 0;
};

}  // namespace retrace::cosim
