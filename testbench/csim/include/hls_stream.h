// hls::stream for C simulation: a bounded queue. Reading from an empty stream or writing to a full one would be a deadlock in
// hardware, so it ends the program with a message instead of growing silently. Synthesis uses the vendor's header of the same name.
#ifndef RETRACE_HLS_STREAM_H
#define RETRACE_HLS_STREAM_H

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <deque>

namespace hls {

template <typename T, int kDepth = 0>
class stream {
 public:
  /// `name` appears in messages; `depth` is the number of words it holds (the template argument wins if it is not 0).
  explicit stream(const char* name = "unnamed", std::size_t depth = 64)
      : name_(name), depth_(kDepth != 0 ? kDepth : depth) {}
  stream(const stream&) = delete;
  stream& operator=(const stream&) = delete;
  ~stream() {
    if (!words_.empty()) std::fprintf(stderr, "hls::stream %s: %zu words left over\n", name_, words_.size());
  }

  T read() {
    if (words_.empty()) stop("read from an empty stream");
    T word = words_.front();
    words_.pop_front();
    return word;
  }
  void write(const T& word) {
    if (words_.size() >= depth_) stop("write to a full stream");
    words_.push_back(word);
  }
  bool empty() const { return words_.empty(); }
  std::size_t size() const { return words_.size(); }

 private:
  [[noreturn]] void stop(const char* what) const {
    std::fprintf(stderr, "hls::stream %s: %s (depth %zu)\n", name_, what, depth_);
    std::abort();
  }

  const char* name_;
  std::size_t depth_;
  std::deque<T> words_;
};

}  // namespace hls

#endif
