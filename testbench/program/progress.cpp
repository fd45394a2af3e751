// Progress, see progress.hpp.
#include "testbench/program/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "testbench/program/workspace.hpp"

namespace retrace::cli {
namespace {

constexpr double kSilent = 0.5;      ///< seconds before anything is shown
constexpr double kLineInterval = 2;  ///< seconds between two lines where there is no terminal
constexpr double kInterval = 0.1;    ///< seconds between two drawings of the bar

}  // namespace

std::string clock_text(double seconds) {
  const long s = std::lround(std::min(std::max(seconds, 0.0), 1e7));
  char text[32];
  if (s >= 3600) {
    std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
  } else {
    std::snprintf(text, sizeof text, "%ld:%02ld", s / 60, s % 60);
  }
  return text;
}

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0), start_(now()) {}

Progress::~Progress() { finish(); }

void Progress::update(double fraction) {
  if (quiet_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (finished_) return;
  const double elapsed = now() - start_;
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (elapsed < kSilent) return;
  const std::string left = fraction > 0 ? clock_text(elapsed / fraction * (1.0 - fraction)) : "?";
  if (!terminal_) {
    const int tenth = static_cast<int>(fraction * 10);
    if (tenth <= tenth_ || elapsed - drawn_ < kLineInterval) return;
    tenth_ = tenth;
    drawn_ = elapsed;
    std::fprintf(stderr, "retrace: %s %d %%, %s left\n", label_.c_str(), tenth * 10, left.c_str());
    return;
  }
  if (shown_ && fraction < 1.0 && elapsed - drawn_ < kInterval) return;
  drawn_ = elapsed;
  shown_ = true;
  constexpr int kWidth = 30;
  std::string bar(kWidth, '.');
  std::fill_n(bar.begin(), static_cast<int>(fraction * kWidth), '#');
  std::fprintf(stderr, "\r%s [%s] %3d %%  %s left \x1b[K", label_.c_str(), bar.c_str(),
               static_cast<int>(fraction * 100), left.c_str());
  std::fflush(stderr);
}

void Progress::finish() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (finished_) return;
  finished_ = true;
  if (shown_) {
    std::fprintf(stderr, "\r\x1b[K");
    std::fflush(stderr);
  }
}

}  // namespace retrace::cli
