// How C simulation runs the ring: order of the tasks, tokens, depths of the streams; and what came of it.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "../../hls/ring/ring.hpp"
#include "include/hls_tasks.h"

namespace retrace {

struct RingSettings {
  std::uint64_t seed = 0;      ///< of the schedule; 0: the tasks in turn
  std::uint32_t contexts = 0;  ///< tokens; 0: RETRACE_RING_CONTEXTS
  std::size_t depth = 0;       ///< of all streams but those below; 0: as declared
  std::map<std::string, std::size_t> depths;
  std::function<void(const ::hls::stream_base&)> on_write;  ///< called after each word that was written
};

struct RingReport {
  ::hls::task_scheduler::report tasks;
  std::map<std::string, std::size_t> words;  ///< that went through each stream
};

/// Of the thread: settings of the next calls of retrace_ring and the report of the last one. A deadlock, words left over and a stream at the wrong
/// task end in an exception unless `throws` is false.
struct RingRun {
  RingSettings settings;
  RingReport report;
  bool throws = true;
  static RingRun& of_thread();
};

}  // namespace retrace
