// Testbench of stream_generate for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_generate {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][9] = {
#include "data/stream_generate.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

static const unsigned long long kFrame[] = {
#include "data/stream_frame.inc"
};
static_assert(kCameraWords == RETRACE_COSIM_CAMERA_WORDS && kFrameWords == RETRACE_COSIM_FRAME_WORDS,
              "depths of camera and frame");

static int run() {
  load_grid();
  static word_t camera[kCameraWords], frame[kFrameWords];
  for (int i = 0; i < kCameraWords; ++i) camera[i] = join<word_t>(kFrame + 2 * i, 2);
  for (int i = 0; i < kFrameWords; ++i) frame[i] = join<word_t>(kFrame + 2 * (kCameraWords + i), 2);
  hls::stream<ray_setup_in_word_t> rays("rays");
  hls::stream<note_word_t> notes("notes");
  RETRACE_BENCH_MEMORY(2, grid_memory);
  RETRACE_BENCH_MEMORY(3, camera);
  RETRACE_BENCH_MEMORY(4, frame);
  stream_generate(rays, notes, grid_memory, camera, frame, kGridLines, 1);
  int wrong = 0;
  for (int i = 0; i < kCount; ++i) {
    wrong += compare("stream_generate", "ray", i, rays.read(), kRows[i], 8);
    wrong += compare("stream_generate", "note", i, notes.read(), kRows[i] + 8, 1);
  }
  return report("stream_generate", kCount, wrong);
}

}  // namespace bench_stream_generate
RETRACE_BENCH_MAIN(bench_stream_generate::run)
