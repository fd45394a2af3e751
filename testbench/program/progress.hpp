// Progress on standard error: a bar with the time left on a terminal, a line every tenth otherwise. Nothing for short work.
#pragma once
#include <mutex>
#include <string>

namespace retrace::cli {

class Progress {
 public:
  /// `quiet` shows nothing.
  explicit Progress(std::string label, bool quiet = false);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Fraction done, from any thread.
  void update(double fraction);
  /// Ends the line on a terminal.
  void finish();

 private:
  const std::string label_;
  const bool quiet_, terminal_;
  std::mutex mutex_;
  double start_ = 0, drawn_ = 0;
  int tenth_ = 0;
  bool shown_ = false, finished_ = false;
};

/// 83 -> "1:23".
std::string clock_text(double seconds);

}  // namespace retrace::cli
