// The tasks of the ring as hardware: a DATAFLOW region. C simulation has the testbench's region instead, because here each task would be called
// when the one before it has ended.
#include "ring.hpp"

void ring_region(RETRACE_RING_PORTS, const retrace::hls::image_view& view, ap_uint<32> ray_count, ap_uint<32> contexts,
                 ap_uint<32> parent_links, ap_uint<32> mailbox, ap_uint<32> write_work, ap_uint<32> fault) {
  using namespace retrace::hls;
  RT_VENDOR(HLS dataflow)
#define RETRACE_RING_STREAM(name, word, places, writer, reader) \
  hls::stream<word> name;                                       \
  RT_DEPTH(name, places)
#define RETRACE_RING_TASK(name, function, arguments) ring_##function arguments;
  RETRACE_RING_STREAMS(RETRACE_RING_STREAM)
  RETRACE_RING_TASKS(RETRACE_RING_TASK)
#undef RETRACE_RING_STREAM
#undef RETRACE_RING_TASK
}
