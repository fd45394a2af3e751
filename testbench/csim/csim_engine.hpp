// The engine that runs an HLS kernel, retrace_trace or retrace_ring, in C simulation, on all cores.
#pragma once
#include <memory>

#include "golden/engine/engine.hpp"

namespace retrace {

/// Totals of all runs of a csim engine, as the kernel reports them.
struct CsimTotals : WorkTotals {
  std::uint64_t faults = 0, steps = 0;
};

/// The barrel (retrace_trace) is the faster one in C simulation; the ring (retrace_ring) gives the same bits.
enum class CsimKernel { kBarrel, kRing };

class CsimEngine : public Engine {
 public:
  /// The kernel's own view of the last trace(): hit records exactly as written, two 64-bit words a ray (0 for rays
  /// marked outside).
  virtual std::span<const std::uint64_t> raw_hits() const = 0;
  virtual CsimTotals totals() const = 0;
};

/// `image` must outlive the engine. way_up kStack is an Error; mailbox must be 0 or kCsimMailbox.
std::unique_ptr<CsimEngine> make_csim_engine(const MemoryImage& image, CsimKernel kernel = CsimKernel::kBarrel);

/// The same over words that nobody has checked, for tests with corrupt images.
std::unique_ptr<CsimEngine> make_csim_engine(std::span<const std::uint64_t> image_words,
                                             CsimKernel kernel = CsimKernel::kBarrel);

inline constexpr int kCsimMailbox = kKernelMailbox;

}  // namespace retrace
