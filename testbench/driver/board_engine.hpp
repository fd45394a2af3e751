// The engine that renders through a board, whatever the link to it.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "golden/engine/engine.hpp"
#include "testbench/driver/board_device.hpp"
#include "testbench/driver/core_driver.hpp"
#include "testbench/driver/serial_line.hpp"

namespace retrace {

struct BoardOptions {
  cosim::LinkOptions link;
  std::uint64_t clocks_per_ray = 100000;  ///< give up after this many clocks a ray (and a constant)
  std::size_t most_rays = 0;              ///< of a run; 0: as many as fit beside the image
};

class BoardEngine : public Engine {
 public:
  bool counts_work() const override { return false; }
  /// Hit records of the last trace() exactly as the core wrote them, two 64-bit words a ray (0 for rays marked outside).
  virtual std::span<const std::uint64_t> raw_hits() const = 0;
  /// Of all runs so far.
  virtual const cosim::CoreCounters& counters() const = 0;
  virtual cosim::CoreIdentity identity() const = 0;
  virtual const cosim::BoardIdentity& board() const = 0;
  virtual const cosim::LinkStatistics& link() const = 0;
  virtual std::uint64_t runs() const = 0;
  /// Rays that fit beside the image: those of a run.
  virtual std::size_t most_rays() const = 0;
};

/// Resets the core, loads the image. `name` is the engine's; `image` must outlive the engine. Throws Error if the image does not fit the board's memory.
std::unique_ptr<BoardEngine> make_board_engine(const MemoryImage& image, std::unique_ptr<cosim::BoardDevice> device,
                                               const BoardOptions& options, const std::string& name);
/// The engine `serial`: a session over the line, then the same.
std::unique_ptr<BoardEngine> make_serial_engine(const MemoryImage& image, std::unique_ptr<cosim::SerialLine> line,
                                                const BoardOptions& options);

}  // namespace retrace
