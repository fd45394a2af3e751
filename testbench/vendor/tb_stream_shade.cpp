// Testbench of stream_shade for any C++ compiler and co-simulation: recorded words through the kernel, bit for bit. Returns 0 on success.
#include "stream_bench.hpp"

namespace bench_stream_shade {

using namespace retrace::hls;
using namespace retrace_bench;

static const unsigned long long kRows[][30] = {
#include "data/stream_shade.inc"
};
static const int kCount = sizeof(kRows) / sizeof(kRows[0]);

static const unsigned long long kMaterials[] = {
#include "data/stream_materials.inc"
};
// Position of the light, its colour, seed, number of materials.
static const unsigned long long kLight[] = {
#include "data/stream_light.inc"
};
static const int kMaterialPairs = sizeof(kMaterials) / 16;
static_assert(kMaterialPairs <= RETRACE_COSIM_MATERIAL_WORDS, "more materials than the port's depth");

static int run() {
  load_grid();
  static word_t materials[RETRACE_COSIM_MATERIAL_WORDS];
  for (int i = 0; i < kMaterialPairs; ++i) materials[i] = join<word_t>(kMaterials + 2 * i, 2);
  int wrong = 0;
  // A call for each row, because a bounce depends on the number of the record in its call.
  for (int i = 0; i < kCount; ++i) {
    hls::stream<ray_setup_out_word_t> rays("rays");
    hls::stream<hit_word_t> hits("hits");
    hls::stream<note_word_t> notes("notes"), direct("direct"), shadow_notes("shadow_notes"),
        bounce_notes("bounce_notes");
    hls::stream<ray_setup_in_word_t> shadow_rays("shadow_rays"), bounce_rays("bounce_rays");
    rays.write(join<ray_setup_out_word_t>(kRows[i], 8));
    hits.write(join<hit_word_t>(kRows[i] + 8, 2));
    notes.write(join<note_word_t>(kRows[i] + 10, 1));
    RETRACE_BENCH_MEMORY(8, grid_memory);
    RETRACE_BENCH_MEMORY(9, materials);
    stream_shade(rays, hits, notes, direct, shadow_rays, shadow_notes, bounce_rays, bounce_notes, grid_memory,
                 materials, kGridLines, ap_uint<32>(kLight[5]), ap_uint<32>(kLight[0]), ap_uint<32>(kLight[1]),
                 ap_uint<32>(kLight[2]), ap_uint<32>(kLight[3]), ap_uint<32>(kLight[4]), 1);
    wrong += compare("stream_shade", "direct note", i, direct.read(), kRows[i] + 11, 1);
    wrong += compare("stream_shade", "shadow ray", i, shadow_rays.read(), kRows[i] + 12, 8);
    wrong += compare("stream_shade", "shadow note", i, shadow_notes.read(), kRows[i] + 20, 1);
    wrong += compare("stream_shade", "bounce", i, bounce_rays.read(), kRows[i] + 21, 8);
    wrong += compare("stream_shade", "bounce note", i, bounce_notes.read(), kRows[i] + 29, 1);
  }
  return report("stream_shade", kCount, wrong);
}

}  // namespace bench_stream_shade
RETRACE_BENCH_MAIN(bench_stream_shade::run)
