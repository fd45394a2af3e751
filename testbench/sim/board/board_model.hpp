// One Verilated board (rtl/board/rt_board.sv) as a host sees it: bytes on a serial line, bit by bit on its pins, and lamps.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace retrace::cosim {

class BoardModel {
 public:
  virtual ~BoardModel() = default;
  /// One clock with a level on the board's receiving pin; returns the level of its sending pin.
  virtual bool clock(bool to_board) = 0;
  virtual void reset() = 0;
  virtual std::uint8_t lamps() const = 0;
  virtual std::uint64_t clocks() const = 0;
  /// An assertion of the RTL has failed.
  virtual bool failed() const = 0;
};

enum Lamp : std::uint8_t {
  kLampFrame = 2,
  kLampDamaged = 4,
  kLampBusy = 8,
  kLampDone = 16,
  kLampFault = 32,
  kLampServed = 128
};

/// Clocks a bit of the simulated line, as the models were built with.
unsigned board_clocks_per_bit();
/// Configurations that are built: names for make_board_model.
const std::vector<std::string>& board_configurations();
/// `waves`: file for an FST of the whole run, empty for none. Throws Error for an unknown name, listing the known ones.
std::unique_ptr<BoardModel> make_board_model(const std::string& configuration, std::uint64_t seed,
                                             const std::string& waves = {});

}  // namespace retrace::cosim
