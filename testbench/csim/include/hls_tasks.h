// Tasks side by side for C simulation: each is a coroutine that runs until a read or write of a bounded stream has to wait. The order in which they
// run is fixed, or random from a seed; both can be repeated. If nobody can go on, the tasks wait for each other, and the report names the streams.
#ifndef RETRACE_HLS_TASKS_H
#define RETRACE_HLS_TASKS_H

#include <ucontext.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hls_stream.h"

namespace hls {

class task_scheduler final : public stream_waiter {
 public:
  struct report {
    bool deadlock = false;
    std::vector<std::string> cycle;   ///< streams along which the tasks wait for each other
    std::vector<std::string> faults;  ///< words left over, a stream used by a task that does not own its end
    std::uint64_t switches = 0;
    std::string text;  ///< all of it in sentences; empty if there is nothing to say
  };

  /// Seed 0: the tasks in turn, each as long as it can run. Any other: after each word the running task may stop, and the next one is drawn.
  explicit task_scheduler(std::uint64_t seed) : seed_(seed), random_(seed * 0x9e3779b97f4a7c15ull | 1) {}
  task_scheduler(const task_scheduler&) = delete;
  task_scheduler& operator=(const task_scheduler&) = delete;

  void add(const char* name, std::function<void()> body) {
    tasks_.emplace_back(new task{name, std::move(body), {}, nullptr, nullptr, false, false});
  }
  /// A stream and the tasks that own its ends.
  void connect(const stream_base& stream, const char* writer, const char* reader) {
    ends_.push_back({&stream, writer, reader, nullptr, nullptr});
  }

  /// Called after each word that was written, with its stream.
  std::function<void(const stream_base&)> on_write;

  report run() {
    stream_waiter* const before = current();
    current() = this;
    for (end& e : ends_)
      for (auto& t : tasks_) {
        if (std::strcmp(t->name, e.writer) == 0) e.writes = t.get();
        if (std::strcmp(t->name, e.reader) == 0) e.reads = t.get();
      }
    for (auto& t : tasks_) start(*t);
    std::size_t turn = 0;
    while (true) {
      std::size_t ready = 0, left = 0, chosen = tasks_.size();
      for (std::size_t i = 0; i < tasks_.size(); ++i) {
        const std::size_t candidate = (turn + i) % tasks_.size();
        const task& t = *tasks_[candidate];
        left += !t.done;
        if (t.done || (t.stream && (t.reading ? t.stream->empty() : t.stream->full()))) continue;
        // The first one in turn; at random each of those that are ready with the same probability.
        if (ready++ == 0 || (seed_ != 0 && draw() % ready == 0)) chosen = candidate;
        if (seed_ == 0) break;
      }
      if (chosen == tasks_.size()) {
        if (left != 0) explain();
        break;
      }
      running_ = tasks_[chosen].get();
      running_->stream = nullptr;
      turn = chosen + (seed_ == 0 ? 1 : 0);
      ++report_.switches;
      swapcontext(&main_, &running_->context);
    }
    current() = before;
    for (auto& t : tasks_) spare_stacks().push_back(std::move(t->stack));
    if (!report_.deadlock)
      for (const end& e : ends_)
        if (!e.stream->empty())
          fault(std::string(e.stream->name()) + ": " + std::to_string(e.stream->size()) + " words left over");
    for (const std::string& what : report_.faults) report_.text += what + "\n";
    return report_;
  }

  void wait(const stream_base& stream, bool reading) override {
    running_->stream = &stream;
    running_->reading = reading;
    own(stream, reading);
    swapcontext(&running_->context, &main_);
  }
  void moved(const stream_base& stream, bool reading) override {
    own(stream, reading);
    if (!reading && on_write) on_write(stream);
    if (seed_ != 0 && draw() % 4 == 0) swapcontext(&running_->context, &main_);
  }

 private:
  static constexpr std::size_t kStack = 1 << 19;

  struct task {
    const char* name;
    std::function<void()> body;
    ucontext_t context;
    std::unique_ptr<char[]> stack;
    const stream_base* stream;  // that it waits for
    bool reading, done;
  };
  struct end {
    const stream_base* stream;
    const char *writer, *reader;
    const task *writes, *reads;  // the tasks of these names, nullptr if there are none
  };

  std::uint32_t draw() {  // xorshift64*
    random_ ^= random_ >> 12;
    random_ ^= random_ << 25;
    random_ ^= random_ >> 27;
    return static_cast<std::uint32_t>((random_ * 0x2545f4914f6cdd1dull) >> 32);
  }

  void start(task& t) {
    std::vector<std::unique_ptr<char[]>>& spare = spare_stacks();
    if (spare.empty()) spare.emplace_back(new char[kStack]);
    t.stack = std::move(spare.back());
    spare.pop_back();
    getcontext(&t.context);
    t.context.uc_stack.ss_sp = t.stack.get();
    t.context.uc_stack.ss_size = kStack;
    t.context.uc_link = &main_;
    const auto self = reinterpret_cast<std::uintptr_t>(this);
    makecontext(&t.context, reinterpret_cast<void (*)()>(&enter), 2, static_cast<unsigned>(self >> 32),
                static_cast<unsigned>(self));
  }
  static void enter(unsigned high, unsigned low) {
    auto* const self = reinterpret_cast<task_scheduler*>((static_cast<std::uintptr_t>(high) << 32) | low);
    self->running_->body();
    self->running_->done = true;
  }

  // Stacks of earlier runs of this thread: a run is short beside what a fresh one costs.
  static std::vector<std::unique_ptr<char[]>>& spare_stacks() {
    static thread_local std::vector<std::unique_ptr<char[]>> stacks;
    return stacks;
  }

  const end* ends_of(const stream_base& stream) const {
    for (const end& e : ends_)
      if (e.stream == &stream) return &e;
    return nullptr;
  }
  void fault(const std::string& what) {
    for (const std::string& known : report_.faults)
      if (known == what) return;
    report_.faults.push_back(what);
  }
  void own(const stream_base& stream, bool reading) {
    const end* const e = ends_of(stream);
    if (e && (reading ? e->reads : e->writes) == running_) return;
    fault(std::string(stream.name()) + ": " + (reading ? "read" : "written") + " by " + running_->name + ", owned by " +
          (e ? reading ? e->reader : e->writer : "nobody"));
  }

  // From any task that waits to the one that could help it, until a task comes again: that is the cycle.
  void explain() {
    report_.deadlock = true;
    const task* at = nullptr;
    for (auto& t : tasks_)
      if (!t->done) at = t.get();
    std::vector<const task*> path;
    while (at && !at->done) {
      std::size_t first = 0;
      while (first < path.size() && path[first] != at) ++first;
      if (first < path.size()) {
        path.erase(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(first));
        break;
      }
      path.push_back(at);
      const end* const e = ends_of(*at->stream);
      const std::string next = e ? (at->reading ? e->writer : e->reader) : "";
      at = nullptr;
      for (auto& t : tasks_)
        if (next == t->name) at = t.get();
    }
    report_.text = at && !at->done ? "deadlock, a cycle of tasks that wait:\n"
                                   : "deadlock, tasks that wait for one that has ended:\n";
    for (const task* t : path) {
      report_.cycle.push_back(t->stream->name());
      report_.text += std::string("  ") + t->name + " waits to " + (t->reading ? "read " : "write ") +
                      t->stream->name() + ", " + std::to_string(t->stream->size()) + " of " +
                      std::to_string(t->stream->depth()) + " words\n";
    }
  }

  std::uint64_t seed_, random_;
  std::vector<std::unique_ptr<task>> tasks_;
  std::vector<end> ends_;
  ucontext_t main_ = {};
  task* running_ = nullptr;
  report report_;
};

}  // namespace hls

#endif
