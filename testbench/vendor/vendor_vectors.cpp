// vendor_vectors FOLDER: writes the data of the vendor testbenches (tb_*.cpp) as initialisers of 64-bit words, lowest first.
//   <stage>.inc   a vector a line: input record, then the output that plain integers (reference.hpp) say
//   image.inc, rays.inc, hits.inc   a small scene, rays of a camera and awkward ones, and the kernel's hits, which have to agree with brute
//                                   force over all triangles and between all modes before anything is written
// The seed is fixed, so the files can be compared with committed ones. Exit code 1 on an error; each file appears whole or not at all.
#include <cinttypes>
#include <cstdio>
#include <string>
#include <vector>

#include "golden/base/output_file.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "hls/top/trace.hpp"
#include "host/retrace_kernel.h"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/brute_force.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_vectors.hpp"
#include "testbench/kit/test_rays.hpp"

// The host's header says the same as the kernel's.
static_assert(RETRACE_KERNEL_OPTION_PARENT_LINKS == RETRACE_OPTION_PARENT_LINKS);
static_assert(RETRACE_KERNEL_OPTION_MAILBOX == RETRACE_OPTION_MAILBOX);
static_assert(RETRACE_KERNEL_OPTION_WORK == RETRACE_OPTION_WORK);
static_assert(RETRACE_KERNEL_SUMMARY_STATUS == kSummaryStatus && RETRACE_KERNEL_SUMMARY_RAYS == kSummaryRays);
static_assert(RETRACE_KERNEL_SUMMARY_FAULTS == kSummaryFaults && RETRACE_KERNEL_SUMMARY_DOWN == kSummaryDown);
static_assert(RETRACE_KERNEL_SUMMARY_UP == kSummaryUp && RETRACE_KERNEL_SUMMARY_LEAF == kSummaryLeaf);
static_assert(RETRACE_KERNEL_SUMMARY_TESTS == kSummaryTests && RETRACE_KERNEL_SUMMARY_SKIPPED == kSummarySkipped);
static_assert(RETRACE_KERNEL_SUMMARY_STEPS == kSummarySteps && RETRACE_KERNEL_SUMMARY_WORDS == kSummaryWords);
static_assert(RETRACE_KERNEL_FAULT_HEADER == kFaultHeader && RETRACE_KERNEL_FAULT_LAYOUT == kFaultLayout);
static_assert(RETRACE_KERNEL_RAY_BYTES == retrace::contract::kRayBytes);
static_assert(RETRACE_KERNEL_HIT_BYTES == retrace::contract::kHitBytes);
static_assert(RETRACE_KERNEL_WORK_BYTES == retrace::contract::kWorkBytes);

namespace {

using namespace retrace;

constexpr std::uint64_t kSeed = 20070701;
constexpr int kVectors = 128;
constexpr const char* kScene = "knot:along=12,around=5";
constexpr int kWidth = 8, kHeight = 6;  // rays of the camera; as many again are awkward ones

std::string words_to_text(std::span<const std::uint64_t> words, std::size_t per_line, bool rows) {
  std::string text;
  char word[24];
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::snprintf(word, sizeof word, "0x%016" PRIx64, words[i]);
    text += i % per_line == 0 && rows ? "{" : "";
    text += word;
    const bool last = i % per_line == per_line - 1 || i == words.size() - 1;
    text += last ? rows ? "},\n" : ",\n" : ", ";
  }
  return text;
}

void save(const std::string& folder, const std::string& name, const std::string& what, const std::string& text) {
  write_file(folder + "/" + name + ".inc", "// Written by vendor_vectors: " + what + "\n" + text);
}

template <typename Vector, typename Reference>
void write_stage(const std::string& folder, const char* stage, Vector vector, Reference reference) {
  Random random(kSeed);
  std::vector<std::uint64_t> words;
  std::size_t row = 0;
  for (int i = 0; i < kVectors; ++i) {
    const auto input = vector(random);
    const auto output = reference(input);
    std::uint64_t in[std::decay_t<decltype(input)>::kWords], out[std::decay_t<decltype(output)>::kWords];
    input.pack(in);
    output.pack(out);
    words.insert(words.end(), std::begin(in), std::end(in));
    words.insert(words.end(), std::begin(out), std::end(out));
    row = std::size(in) + std::size(out);
  }
  save(folder, stage, "input and expected output of " + std::string(stage) + ", seed " + std::to_string(kSeed),
       words_to_text(words, row, true));
}

void write_frame(const std::string& folder) {
  const auto [scene, world, grid, image] = prepare_scene(open_scene(kScene));
  const ViewCamera view = default_view(scene, world);
  Random random(kSeed);
  std::vector<GridRay> rays;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const GridRay ray = quantise(view.ray(x + 0.5, y + 0.5, kWidth, kHeight), grid.transform, grid.box, x % 2 != 0);
      if (!ray.outside) rays.push_back(ray);
    }
  }
  while (rays.size() < RETRACE_COSIM_RAYS) {
    for (const GridRay& ray : make_test_rays(grid, image, RETRACE_COSIM_RAYS - rays.size(), random))
      if (!ray.outside) rays.push_back(ray);
  }
  auto csim = make_csim_engine(image);
  const BruteForce brute(image);
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint64_t> raw;
  for (const WayUp way : {WayUp::kFaceLinks, WayUp::kParentLinks}) {
    for (const int mailbox : {0, kCsimMailbox}) {
      TraceOptions options;
      options.way_up = way;
      options.mailbox = mailbox;
      csim->trace(rays, hits, {}, options);
      if (!raw.empty() && !std::equal(raw.begin(), raw.end(), csim->raw_hits().begin()))
        throw Error("the kernel's modes differ");
      raw.assign(csim->raw_hits().begin(), csim->raw_hits().end());
    }
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto truth = brute.trace(rays[i].record);
    const auto hit = contract::HitRecord::unpack(&raw[2 * i]);
    const bool is_hit = hit.status == static_cast<std::uint32_t>(contract::kStatusHit);
    if (is_hit != truth.hit || (is_hit && !rays[i].record.any && (hit.id != truth.id || hit.t != truth.t)))
      throw Error("ray " + std::to_string(i) + " differs from brute force");
  }
  std::vector<std::uint64_t> packed(contract::RayRecord::kWords * rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i].record.pack(&packed[contract::RayRecord::kWords * i]);
  const std::string of = std::string(kScene) + ", " + std::to_string(world.vertices.size()) + " triangles";
  save(folder, "image", "memory image of " + of, words_to_text(image.words(), 4, false));
  save(folder, "rays", std::to_string(rays.size()) + " rays for " + of,
       words_to_text(packed, contract::RayRecord::kWords, false));
  save(folder, "hits", "hits of rays.inc in image.inc", words_to_text(raw, 2, false));
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder;
  CLI::App app("Writes the data of the vendor testbenches.", "vendor_vectors");
  app.add_option("folder", folder)->required();
  return run_program(app, argc, argv, [&] {
#define STAGE(stage) write_stage(folder, #stage, stage##_vector, reference::stage)
    STAGE(ray_setup);
    STAGE(kd_descend);
    STAGE(leaf_exit);
    STAGE(kd_backtrack);
    STAGE(tri_test);
    STAGE(hit_finish);
    STAGE(instance_enter);
#undef STAGE
    write_frame(folder);
    return 0;
  });
}
