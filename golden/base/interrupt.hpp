// Signals that end the program: temporary files are removed and a running child is ended first.
#pragma once
#include <sys/types.h>

#include <string>

namespace retrace {

/// SIGINT, SIGTERM, SIGHUP and SIGPIPE end the program with 128 + signal, after cleaning up; those that the parent has set to be ignored
/// (nohup) stay ignored. SIGXFSZ is ignored, so that a file beyond its size limit is an error of write().
void install_signal_handlers();

/// While one exists, signals that end the program wait.
class SignalShield {
 public:
  SignalShield();
  ~SignalShield();
  SignalShield(const SignalShield&) = delete;
  SignalShield& operator=(const SignalShield&) = delete;
};

/// A temporary file that a signal removes while the object lives. The destructor removes it as well, unless release() was called.
class TemporaryFile {
 public:
  /// Creates an empty file with a random name in `folder`. Check descriptor(); if it is negative, errno says why.
  explicit TemporaryFile(const std::string& folder);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  int descriptor() const { return descriptor_; }
  /// 0, or the error number.
  int close();
  /// 0, or the error number. After success the file is no longer temporary.
  int rename_to(const std::string& path);

  struct Slot;

 private:
  Slot* slot_ = nullptr;
  int descriptor_ = -1;
};

/// The leader of a process group that a signal kills before it removes files; 0: none.
void set_child(pid_t child);

}  // namespace retrace
