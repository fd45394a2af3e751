// The engine that runs the HLS kernel retrace_trace in C simulation, on all cores.
#pragma once
#include <memory>

#include "golden/engine/engine.hpp"

namespace retrace {

/// Totals of all runs of a csim engine, as the kernel reports them.
struct CsimTotals {
  std::uint64_t rays = 0, faults = 0, down = 0, up = 0, leaf = 0, tests = 0, skipped = 0, steps = 0;
};

class CsimEngine : public Engine {
 public:
  /// The kernel's own view of the last trace(): hit records exactly as written, two 64-bit words a ray (0 for rays
  /// marked outside).
  virtual std::span<const std::uint64_t> raw_hits() const = 0;
  virtual CsimTotals totals() const = 0;
};

/// `image` must outlive the engine. way_up kStack is an Error; mailbox must be 0 or kCsimMailbox.
std::unique_ptr<CsimEngine> make_csim_engine(const MemoryImage& image);

/// The same over words that nobody has checked, for tests with corrupt images.
std::unique_ptr<CsimEngine> make_csim_engine(std::span<const std::uint64_t> image_words);

inline constexpr int kCsimMailbox = 8;

}  // namespace retrace
