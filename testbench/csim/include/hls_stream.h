// hls::stream for C simulation: a bounded queue. Where tasks run side by side (hls_tasks.h), a task that reads from an empty stream or writes to a
// full one waits. Where there is one thread of control only, that would be a deadlock in hardware, so it ends the program with a message instead of
// growing silently. Synthesis uses the vendor's header of the same name.
#ifndef RETRACE_HLS_STREAM_H
#define RETRACE_HLS_STREAM_H

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <deque>

namespace hls {

/// What of a stream does not depend on its words.
class stream_base {
 public:
  stream_base(const char* name, std::size_t depth) : name_(name), depth_(depth) {}
  stream_base(const stream_base&) = delete;
  stream_base& operator=(const stream_base&) = delete;
  const char* name() const { return name_; }
  std::size_t depth() const { return depth_; }
  std::size_t size() const { return written_ - taken_; }
  std::size_t written() const { return written_; }  ///< words in all
  bool empty() const { return size() == 0; }
  bool full() const { return size() >= depth_; }

 protected:
  const char* name_;
  std::size_t depth_;
  std::size_t written_ = 0, taken_ = 0;
};

/// Whoever runs several tasks in one thread of control.
class stream_waiter {
 public:
  virtual void wait(const stream_base& stream, bool reading) = 0;   ///< returns when the task may try again
  virtual void moved(const stream_base& stream, bool reading) = 0;  ///< a word was read or written
  static stream_waiter*& current() {
    static thread_local stream_waiter* waiter = nullptr;
    return waiter;
  }

 protected:
  ~stream_waiter() = default;
};

template <typename T, int kDepth = 0>
class stream : public stream_base {
 public:
  /// `name` appears in messages; `depth` is the number of words it holds (the template argument wins if it is not 0).
  explicit stream(const char* name = "unnamed", std::size_t depth = 64)
      : stream_base(name, kDepth != 0 ? kDepth : depth) {}
  ~stream() {
    if (!words_.empty()) std::fprintf(stderr, "hls::stream %s: %zu words left over\n", name_, words_.size());
  }

  T read() {
    while (words_.empty()) wait(true, "read from an empty stream");
    T word = words_.front();
    words_.pop_front();
    ++taken_;
    if (stream_waiter::current()) stream_waiter::current()->moved(*this, true);
    return word;
  }
  void write(const T& word) {
    while (words_.size() >= depth_) wait(false, "write to a full stream");
    words_.push_back(word);
    ++written_;
    if (stream_waiter::current()) stream_waiter::current()->moved(*this, false);
  }
  const T& newest() const { return words_.back(); }
  /// Drops what is left, after a deadlock that a test has made.
  void clear() {
    taken_ = written_;
    words_.clear();
  }

 private:
  void wait(bool reading, const char* what) const {
    if (stream_waiter::current()) return stream_waiter::current()->wait(*this, reading);
    std::fprintf(stderr, "hls::stream %s: %s (depth %zu)\n", name_, what, depth_);
    std::abort();
  }

  std::deque<T> words_;
};

}  // namespace hls

#endif
