// The region of the ring in C simulation: the same streams and tasks as hls/ring/region.cpp, run by the testbench's scheduler.
#include <stdexcept>

#include "ring_run.hpp"

retrace::RingRun& retrace::RingRun::of_thread() {
  static thread_local RingRun run;
  return run;
}

void ring_region(RETRACE_RING_PORTS, const retrace::hls::image_view& view, ap_uint<32> ray_count, ap_uint<32> contexts,
                 ap_uint<32> parent_links, ap_uint<32> mailbox, ap_uint<32> write_work, ap_uint<32> fault) {
  using namespace retrace::hls;
  retrace::RingRun& run = retrace::RingRun::of_thread();
  const retrace::RingSettings& settings = run.settings;
  if (settings.contexts != 0) contexts = settings.contexts;
  const auto depth_of = [&](const char* name, std::size_t declared) {
    const auto own = settings.depths.find(name);
    return own != settings.depths.end() ? own->second : settings.depth != 0 ? settings.depth : declared;
  };
  ::hls::task_scheduler scheduler(settings.seed);
  scheduler.on_write = settings.on_write;
#define RETRACE_RING_STREAM(name, word, places, writer, reader) \
  ::hls::stream<word> name(#name, depth_of(#name, places));     \
  scheduler.connect(name, #writer, #reader);
  RETRACE_RING_STREAMS(RETRACE_RING_STREAM)
#define RETRACE_RING_TASK(name, function, arguments) scheduler.add(#name, [&] { ring_##function arguments; });
  RETRACE_RING_TASKS(RETRACE_RING_TASK)
  run.report.tasks = scheduler.run();
  run.report.words.clear();
#define RETRACE_RING_COUNT(name, word, places, writer, reader) \
  run.report.words[#name] = name.written();                    \
  name.clear();
  RETRACE_RING_STREAMS(RETRACE_RING_COUNT)
  if (run.throws && !run.report.tasks.text.empty()) throw std::runtime_error("retrace_ring: " + run.report.tasks.text);
}
