// Host example for a card with XRT: the package's small scene, its rays, and the hits that retrace_trace has to give.
//   g++ -std=c++17 -I$XILINX_XRT/include host/retrace_xrt.cpp -L$XILINX_XRT/lib -lxrt_coreutil -o retrace_xrt
//   ./retrace_xrt FILE.xclbin [DEVICE]
// Returns 0 if every hit is right.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <xrt/xrt_bo.h>
#include <xrt/xrt_device.h>
#include <xrt/xrt_kernel.h>

#include "retrace_kernel.h"

// Words of 64 bits, lowest first: the memory image, 4 words a ray, 2 words a hit.
static const std::uint64_t kImage[] = {
#include "../data/image.inc"
};
static const std::uint64_t kRays[] = {
#include "../data/rays.inc"
};
static const std::uint64_t kHits[] = {
#include "../data/hits.inc"
};

/// Places of the arguments of retrace_trace.
enum Argument { kPairs, kLeaves, kList, kTriangles, kRayMemory, kHitMemory, kWorkMemory, kSummary };

/// A buffer in the memory bank of one argument. The four image ports may lie in one bank; then they can share a buffer.
static xrt::bo buffer(const xrt::device& device, const xrt::kernel& kernel, Argument argument, const void* content,
                      std::size_t bytes) {
  xrt::bo memory(device, bytes, kernel.group_id(argument));
  if (content != nullptr) {
    memory.write(content);
    memory.sync(XCL_BO_SYNC_BO_TO_DEVICE);
  }
  return memory;
}

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: retrace_xrt FILE.xclbin [DEVICE]\n");
    return 2;
  }
  try {
    xrt::device device(argc == 3 ? static_cast<unsigned>(std::stoul(argv[2])) : 0U);
    const auto id = device.load_xclbin(std::string(argv[1]));
    xrt::kernel kernel(device, id, "retrace_trace");

    const std::uint32_t rays = sizeof kRays / RETRACE_KERNEL_RAY_BYTES;
    const xrt::bo pairs = buffer(device, kernel, kPairs, kImage, sizeof kImage);
    const xrt::bo leaves = buffer(device, kernel, kLeaves, kImage, sizeof kImage);
    const xrt::bo list = buffer(device, kernel, kList, kImage, sizeof kImage);
    const xrt::bo triangles = buffer(device, kernel, kTriangles, kImage, sizeof kImage);
    const xrt::bo ray_memory = buffer(device, kernel, kRayMemory, kRays, sizeof kRays);
    xrt::bo hit_memory = buffer(device, kernel, kHitMemory, nullptr, rays * RETRACE_KERNEL_HIT_BYTES);
    const xrt::bo work_memory = buffer(device, kernel, kWorkMemory, nullptr, rays * RETRACE_KERNEL_WORK_BYTES);
    xrt::bo summary_memory = buffer(device, kernel, kSummary, nullptr, 8 * RETRACE_KERNEL_SUMMARY_WORDS);

    const std::uint32_t image_lines = sizeof kImage / 64;
    auto run = kernel(pairs, leaves, list, triangles, ray_memory, hit_memory, work_memory, summary_memory, image_lines,
                      rays, std::uint32_t{RETRACE_KERNEL_OPTION_MAILBOX});
    run.wait();

    std::vector<std::uint64_t> hits(2 * rays), summary(RETRACE_KERNEL_SUMMARY_WORDS);
    hit_memory.sync(XCL_BO_SYNC_BO_FROM_DEVICE);
    hit_memory.read(hits.data());
    summary_memory.sync(XCL_BO_SYNC_BO_FROM_DEVICE);
    summary_memory.read(summary.data());
    if (summary[RETRACE_KERNEL_SUMMARY_STATUS] != 0) {
      std::fprintf(stderr, "retrace_xrt: the kernel refuses the image: fault %llu\n",
                   static_cast<unsigned long long>(summary[RETRACE_KERNEL_SUMMARY_STATUS]));
      return 1;
    }
    int wrong = 0;
    for (std::uint32_t i = 0; i < rays; ++i)
      wrong += hits[2 * i] != kHits[2 * i] || hits[2 * i + 1] != kHits[2 * i + 1];
    std::printf("retrace_xrt: %u rays, %d hits differ\n", static_cast<unsigned>(rays), wrong);
    return wrong == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "retrace_xrt: %s\n", error.what());
    return 1;
  }
}
