// What a model counted, when it ends: one file a model in the folder that RETRACE_COVERAGE names (scripts/coverage.sh adds them up).
// Does nothing in a build without RETRACE_RTL_COVERAGE.
#pragma once
#include <verilated.h>

#ifdef RETRACE_RTL_COVERAGE
#include <unistd.h>
#include <verilated_cov.h>

#include <atomic>
#include <cstdlib>
#include <string>
#endif

namespace retrace::cosim {

#ifdef RETRACE_RTL_COVERAGE
inline void save_coverage(VerilatedContext& context) {
  static std::atomic<int> number{0};
  const char* folder = std::getenv("RETRACE_COVERAGE");
  if (folder == nullptr) return;
  context.coveragep()->write(
      (std::string(folder) + "/" + std::to_string(getpid()) + "-" + std::to_string(number++) + ".dat").c_str());
}
#else
inline void save_coverage(VerilatedContext&) {}
#endif

}  // namespace retrace::cosim
