// Top of the ring: checks the header, then all tasks at once. See ring.hpp.
#include "ring.hpp"

extern "C" void retrace_ring(RETRACE_RING_PORTS, ap_uint<32> image_lines, ap_uint<32> ray_count, ap_uint<8> options) {
  using namespace retrace::hls;
  // clang-format off
#if !defined(__BAMBU__)  // which checks the tasks one by one
  RT_MEMORY(pairs, gmem_pairs, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(pairs_2, gmem_pairs_2, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(leaves, gmem_leaves, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(list, gmem_list, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(triangles, gmem_triangles, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(rays, gmem_rays, RETRACE_COSIM_RAYS)
  RT_MEMORY(hits, gmem_hits, RETRACE_COSIM_RAYS)
  RT_MEMORY(work, gmem_work, RETRACE_COSIM_RAYS)
  RT_MEMORY(summary, gmem_summary, RETRACE_COSIM_SUMMARY_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(ray_count)
  RT_CONTROL(options)
  RT_CONTROL(return)
#endif
  // clang-format on
  image_view view = {};
  int fault = read_header(pairs, image_lines, view);
  if (fault == kFaultNone && view.two_levels) fault = kFaultHeader;  // instances are for the barrel
  ap_uint<32> rays_to_trace = ray_count;
  if (fault != kFaultNone) rays_to_trace = 0;
  const ap_uint<32> parent_links = options[0] == 1;
  const ap_uint<32> mailbox = options[1] == 1;
  const ap_uint<32> write_work = options[2] == 1;
  ring_region(pairs, pairs_2, leaves, list, triangles, rays, hits, work, summary, view, rays_to_trace,
              RETRACE_RING_CONTEXTS, parent_links, mailbox, write_work, fault);
}
