// Watches an AXI4 or AXI4-Lite port and names the first rule that is broken, whichever side breaks it. It drives nothing.
//
// Rules are those of the AMBA AXI protocol specification (IHI 0022), chapters A3, A5 and B1, narrowed to what this core promises: bursts are
// INCR, as wide as the bus, aligned, and of at most `most_read_bytes` or `most_write_bytes`. See AxiRule.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "testbench/sim/core/core_model.hpp"

namespace retrace::cosim {

enum class AxiChannel { kAr, kR, kAw, kW, kB };
constexpr std::size_t kAxiChannels = 5;
const char* name_of(AxiChannel channel);

enum class AxiRule {
  kValidHeld,     ///< VALID stays until READY
  kPayloadHeld,   ///< what is offered does not change until it is accepted
  kValidInReset,  ///< VALID is low while the reset is active
  kBurstType,     ///< INCR
  kBurstSize,     ///< a beat is as wide as the bus
  kBurstLength,   ///< not longer than the core promises
  kAlignment,     ///< the address is a multiple of the width of the bus
  kBoundary,      ///< a burst stays within 4 KB
  kLast,          ///< LAST is on the last beat of a burst and on no other
  kStrobes,       ///< no strobe beyond the bus
  kUnasked,  ///< an answer belongs to a request: R to an accepted AR of its id, B to a write of its id whose AW and last W were accepted
  kResponse,    ///< OKAY, SLVERR or DECERR: nobody asks for exclusive access
  kWait,        ///< a VALID is accepted within `most_wait` clocks
  kUnanswered,  ///< at the end, every request has its answer
};
constexpr std::size_t kAxiRules = static_cast<std::size_t>(AxiRule::kUnanswered) + 1;
const char* name_of(AxiRule rule);

struct AxiViolation {
  AxiChannel channel;
  std::uint64_t clock;
  AxiRule rule;
  std::string text() const;
};

/// What both kinds of port have in common: handshakes that are held, the reset, violations.
class AxiHandshakes {
 public:
  /// First ones first, at most kMostViolations; empty is good.
  const std::vector<AxiViolation>& violations() const { return violations_; }
  std::uint64_t clocks() const { return now_; }

 protected:
  /// 0: no limit.
  explicit AxiHandshakes(std::uint64_t most_wait) : most_wait_(most_wait) {}
  using Payload = std::array<std::uint64_t, 4>;
  /// Returns true where a transfer happens.
  bool handshake(AxiChannel channel, bool valid, bool ready, const Payload& payload);
  void violation(AxiChannel channel, AxiRule rule);
  /// In this clock: false while the reset is active.
  bool begin_clock(bool rst_n);
  std::uint64_t now_ = 0;

 private:
  static constexpr std::size_t kMostViolations = 20;
  struct Offer {
    bool pending = false;
    std::uint64_t waited = 0;
    Payload payload{};
  };
  std::uint64_t most_wait_;
  std::array<Offer, kAxiChannels> offers_;
  std::vector<AxiViolation> violations_;
  bool in_reset_ = true;
  std::uint64_t reset_clocks_ = 0;
};

struct AxiMonitorLimits {
  std::uint32_t most_read_bytes = 128, most_write_bytes = 64;
  std::uint64_t most_wait = 0;
};

class AxiMonitor : public AxiHandshakes {
 public:
  explicit AxiMonitor(int data_bytes, const AxiMonitorLimits& limits = {});
  /// What both sides drive in one clock.
  void clock(bool rst_n, const AxiMasterSignals& m, const AxiSlaveSignals& s);
  /// No more clocks follow, or the core says that it has ended.
  void check_idle();
  bool idle() const;
  /// Complete ones.
  std::uint64_t reads() const { return reads_; }
  std::uint64_t writes() const { return writes_; }
  std::uint64_t transactions() const { return reads_ + writes_; }
  /// W beats accepted before the AW of their burst.
  std::uint64_t early_beats() const { return early_beats_; }
  /// Write beats whose strobes are not all ones.
  std::uint64_t partial_beats() const { return partial_beats_; }

 private:
  void address(AxiChannel channel, std::uint64_t address, std::uint32_t len, std::uint32_t size, std::uint32_t burst,
               std::uint32_t most_bytes);
  void match_writes();

  static constexpr std::size_t kIds = 128;
  struct Write {
    std::uint32_t id, beats;
  };
  std::uint32_t data_bytes_;
  AxiMonitorLimits limits_;
  std::array<std::deque<std::uint32_t>, kIds> read_beats_;  // beats left of the bursts of an id, oldest first
  std::deque<Write> writes_open_;                           // AW accepted, W not complete
  std::deque<bool> beats_;                                  // W accepted, AW not yet; its LAST
  std::array<std::uint32_t, kIds> unacknowledged_{};
  std::uint64_t reads_ = 0, writes_ = 0, reads_open_ = 0, acknowledgements_open_ = 0, early_beats_ = 0,
                partial_beats_ = 0;
};

class AxiLiteMonitor : public AxiHandshakes {
 public:
  explicit AxiLiteMonitor(std::uint64_t most_wait = 0) : AxiHandshakes(most_wait) {}
  void clock(bool rst_n, const AxiLiteMasterSignals& m, const AxiLiteSlaveSignals& s);
  void check_idle();
  std::uint64_t reads() const { return reads_; }
  std::uint64_t writes() const { return writes_; }
  std::uint64_t transactions() const { return reads_ + writes_; }
  /// Writes whose W was accepted in an earlier clock than their AW, in a later one, in the same.
  std::uint64_t data_first() const { return data_first_; }
  std::uint64_t address_first() const { return address_first_; }
  std::uint64_t together() const { return together_; }
  /// Writes with some strobes low.
  std::uint64_t partial() const { return partial_; }

 private:
  std::uint64_t addresses_ = 0, beats_ = 0, asked_ = 0;  // accepted so far
  std::uint64_t reads_ = 0, writes_ = 0, data_first_ = 0, address_first_ = 0, together_ = 0, partial_ = 0;
};

}  // namespace retrace::cosim
