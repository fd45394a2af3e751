// Random numbers of the tests: one generator, one seed, printed where a check fails. RETRACE_SEED overrides the
// default.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <random>

namespace retrace {

inline std::uint64_t test_seed(std::uint64_t fallback = 20070701) {
  const char* text = std::getenv("RETRACE_SEED");
  return text ? std::strtoull(text, nullptr, 0) : fallback;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t bits() { return engine_(); }
  /// Uniform in 0 .. count - 1.
  std::uint64_t below(std::uint64_t count) {
    return static_cast<std::uint64_t>((static_cast<unsigned __int128>(bits()) * count) >> 64);
  }
  bool chance(unsigned one_in) { return below(one_in) == 0; }
  /// Uniform in [low, high).
  double real(double low, double high) { return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53); }
  /// Uniform in low .. high.
  std::int64_t integer(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(high - low) + 1));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace retrace
