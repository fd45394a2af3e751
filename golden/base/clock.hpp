// What all timings are taken with.
#pragma once
#include <chrono>

namespace retrace {

/// Seconds of the steady clock since some moment of the past: only differences mean something.
inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace retrace
