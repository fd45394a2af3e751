// When one side of a stream is active: never held off, held off at random, in bursts, or by a list of clocks. One
// object a port, seeded.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "testbench/kit/random.hpp"

namespace retrace::cosim {

class HoldOff {
 public:
  /// Active in every clock.
  static HoldOff none() { return HoldOff(Kind::kNone, 0); }
  /// Active in `percent` of the clocks, independently.
  static HoldOff random(std::uint64_t seed, unsigned percent) {
    HoldOff h(Kind::kRandom, seed);
    h.percent_ = percent;
    return h;
  }
  /// Alternates between active and held-off stretches of 1 to `longest` clocks.
  static HoldOff bursts(std::uint64_t seed, unsigned longest) {
    HoldOff h(Kind::kBursts, seed);
    h.longest_ = longest;
    return h;
  }
  /// Active in the clocks whose entry is 1; the list repeats.
  static HoldOff list(std::initializer_list<int> active) {
    HoldOff h(Kind::kList, 0);
    for (int a : active) h.list_.push_back(a != 0);
    return h;
  }

  /// Is the port active in the next clock?
  bool next() {
    switch (kind_) {
      case Kind::kNone:
        return true;
      case Kind::kRandom:
        return random_.below(100) < percent_;
      case Kind::kBursts:
        if (left_ == 0) {
          left_ = 1 + random_.below(longest_);
          active_ = !active_;
        }
        --left_;
        return active_;
      case Kind::kList:
        position_ = position_ + 1 < list_.size() ? position_ + 1 : 0;
        return list_[position_];
    }
    return true;
  }

 private:
  enum class Kind { kNone, kRandom, kBursts, kList };
  HoldOff(Kind kind, std::uint64_t seed) : kind_(kind), random_(seed) {}

  Kind kind_;
  Random random_;
  unsigned percent_ = 100;
  unsigned longest_ = 1;
  std::uint64_t left_ = 0;
  bool active_ = false;
  std::vector<bool> list_;
  std::size_t position_ = 0;
};

}  // namespace retrace::cosim
