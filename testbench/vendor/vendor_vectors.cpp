// vendor_vectors FOLDER: writes the data of the vendor testbenches (tb_*.cpp) as initialisers of 64-bit words, lowest first.
//   <stage>.inc   a vector a line: input record, then the output that plain integers (reference.hpp) say
//   stream_<kernel>.inc, grid.inc   the same for the kernels of the streaming machine: records of walks through a small grid, which end in what
//                                   plain integers (grid_walk.hpp, light_model.hpp) say
//   ring_<stream>.inc  every word of every stream of the ring of tasks, over a few of these rays
//   image.inc, rays.inc, hits.inc   a small scene, rays of a camera and awkward ones, and the kernel's hits, which have to agree with brute
//                                   force over all triangles and between all modes before anything is written
// The seed is fixed, so the files can be compared with committed ones. Exit code 1 on an error; each file appears whole or not at all.
#include <array>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "golden/accel/grid_image.hpp"
#include "golden/base/output_file.hpp"
#include "golden/render/chip_frame.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "golden/tree/traced_scene.hpp"
#include "hls/streaming/kernels.hpp"
#include "hls/top/trace.hpp"
#include "host/retrace_kernel.h"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/csim/ring_run.hpp"
#include "testbench/csim/stage_tops.hpp"
#include "testbench/kit/brute_force.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_vectors.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/streaming/grid_walk.hpp"
#include "testbench/streaming/stream_frame.hpp"
#include "testbench/streaming/stream_words.hpp"

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
namespace rh = retrace::hls;

constexpr std::uint64_t kSeed = 20070701;
constexpr int kVectors = 128;
constexpr const char* kScene = "knot:along=12,around=5";
constexpr int kRingRays = 5, kRingContexts = 3;
constexpr const char* kStreamScene = "box";
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

/// Rows of words: those that are kept, and of the others at most kVectors from all over the runs that make them.
struct Rows {
  std::vector<std::vector<std::uint64_t>> rows, kept;
  bool keep = false;

  template <typename... Words>
  void add(const Words&... words) {
    std::vector<std::uint64_t> row;
    const auto append = [&](const auto& word) {
      constexpr int kParts = std::decay_t<decltype(word)>::width / 64;
      for (int i = 0; i < kParts; ++i) row.push_back(static_cast<ap_uint<64>>(word >> (64 * i)).to_uint64());
    };
    (append(words), ...);
    (keep ? kept : rows).push_back(row);
  }
  void save_as(const std::string& folder, const std::string& kernel, const std::string& what) const {
    std::vector<std::uint64_t> words;
    for (const std::vector<std::uint64_t>& row : kept) words.insert(words.end(), row.begin(), row.end());
    const std::size_t step = std::max<std::size_t>(1, rows.size() / kVectors);
    for (std::size_t i = 0; i < rows.size() && i / step < kVectors; i += step)
      words.insert(words.end(), rows[i].begin(), rows[i].end());
    save(folder, "stream_" + kernel, "records of " + kernel + ": " + what,
         words_to_text(words, rows.front().size(), true));
  }
};

/// Every word of every stream of the ring, over a few rays of the frame.
void write_ring(const std::string& folder, std::span<const std::uint64_t> image, std::span<const std::uint64_t> rays) {
  std::vector<rh::word_t> words(image.size() / 2), hits(kRingRays), work(kRingRays);
  std::vector<rh::line_t> lines(image.size() / 8);
  std::vector<rh::token_word_t> ray_words(kRingRays);
  const auto join = [](auto& word, std::span<const std::uint64_t> parts) {
    using Word = std::decay_t<decltype(word)>;
    word = 0;
    for (std::size_t i = parts.size(); i-- > 0;) {
      word <<= 64;
      word |= Word(parts[i]);
    }
  };
  for (std::size_t i = 0; i < words.size(); ++i) join(words[i], image.subspan(2 * i, 2));
  for (std::size_t i = 0; i < lines.size(); ++i) join(lines[i], image.subspan(8 * i, 8));
  for (std::size_t i = 0; i < ray_words.size(); ++i) join(ray_words[i], rays.subspan(4 * i, 4));
  std::map<std::string, Rows> seen;
  RingRun& run = RingRun::of_thread();
  run.settings.contexts = kRingContexts;
  run.settings.on_write = [&](const ::hls::stream_base& stream) {
    using namespace rh;
#define RETRACE_RING_SEE(each, word, places, writer, reader) \
  if (std::string(stream.name()) == #each) seen[#each].add(static_cast<const ::hls::stream<word>&>(stream).newest());
    RETRACE_RING_STREAMS(RETRACE_RING_SEE)
#undef RETRACE_RING_SEE
  };
  std::array<ap_uint<64>, kSummaryWords> summary;
  retrace_ring(words.data(), words.data(), lines.data(), words.data(), lines.data(), ray_words.data(), hits.data(),
               work.data(), summary.data(), static_cast<unsigned>(lines.size()), kRingRays,
               RETRACE_OPTION_PARENT_LINKS | RETRACE_OPTION_MAILBOX | RETRACE_OPTION_WORK);
  run.settings = {};
  for (const auto& [name, stream] : seen) {
    std::vector<std::uint64_t> all;
    for (const auto& row : stream.rows) all.insert(all.end(), row.begin(), row.end());
    save(folder, "ring_" + name,
         "words of the stream " + name + ", " + std::to_string(kRingRays) + " rays, " + std::to_string(kRingContexts) +
             " tokens",
         words_to_text(all, stream.rows.front().size(), true));
  }
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
  write_ring(folder, image.words(), packed);
  save(folder, "image", "memory image of " + of, words_to_text(image.words(), 4, false));
  save(folder, "rays", std::to_string(rays.size()) + " rays for " + of,
       words_to_text(packed, contract::RayRecord::kWords, false));
  save(folder, "hits", "hits of rays.inc in image.inc", words_to_text(raw, 2, false));
}

void write_streaming(const std::string& folder) {
  const Scene scene = open_scene(kStreamScene);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world, kChipReach);
  const accel::GridImage image = accel::GridImage::build(grid);
  const StreamMemory memory(image.words());
  const rh::word_t* words = memory.words.data();
  const ViewCamera view = default_view(scene, world);
  const Surfaces surfaces(scene, world, grid);
  const std::vector<contract::MaterialRecord> materials = materials_of(chip_shading(surfaces));
  const contract::CameraRecord camera = chip_camera(view, grid, kWidth, kHeight);
  const contract::FrameRecord frame = chip_frame(view, {.width = kWidth, .height = kHeight, .samples = 4});
  const light_model::Light light{.position = {0, grid.box[3] / 2, 0}, .colour = {255, 200, 100}, .seed = 7};

  Rows generate, setup, traverse, intersect, finish, shade, trace;
  std::vector<contract::RaySetupInRecord> rays;
  std::vector<std::uint64_t> head(contract::CameraRecord::kWords + contract::FrameRecord::kWords);
  camera.pack(head.data());
  frame.pack(head.data() + contract::CameraRecord::kWords);
  const EyeRays eyes = eye_rays_by_kernel(image.words(), camera, frame, 1);
  for (std::size_t i = 0; i < eyes.rays.size(); ++i) {
    generate.add(stream_word<rh::ray_setup_in_word_t>(eyes.rays[i]), rh::note_word_t(eyes.notes[i].pack()));
    if (eyes.notes[i].active) rays.push_back(eyes.rays[i]);
  }
  // Rays along diagonals, which cross two planes of the grid at once.
  const std::size_t eye_rays = rays.size();
  const contract::GridHeaderRecord& header = image.header();
  for (int still = 0; still < 3; ++still)
    for (const int sign : {-1, 1}) {
      contract::RaySetupInRecord ray{.t_max = (1u << contract::kTLimitBits) - 1, .box = grid.box};
      for (int a = 0; a < 3; ++a) {
        const std::int32_t plane =
            header.lower[a] + header.side[a] * static_cast<std::int32_t>(header.resolution[a] / 2);
        ray.origin[a] = a == still ? plane + header.side[a] / 2 : plane - sign * 1000;
        ray.direction[a] = a == still ? 0 : sign * (11 << 22);
      }
      rays.push_back(ray);
    }
  const std::size_t diagonals_end = rays.size();
  Random random(kSeed);
  for (const GridRay& ray : make_test_rays(grid, build_kd(grid), kVectors, random))
    if (!ray.outside)
      rays.push_back({.origin = ray.record.origin,
                      .direction = ray.record.direction,
                      .t_max = ray.record.t_max,
                      .any = ray.record.any,
                      .box = grid.box});

  ::hls::stream<rh::ray_setup_in_word_t> in("in", 1), shadow("shadow", 1), bounce("bounce", 1);
  ::hls::stream<rh::ray_setup_out_word_t> ray_words("rays", 1);
  ::hls::stream<rh::ray_state_word_t> states("states", 1), out("out", 1);
  ::hls::stream<rh::hit_word_t> hits("hits", 1);
  ::hls::stream<rh::note_word_t> notes("notes", 1), direct("direct", 1), shadow_notes("shadow notes", 1),
      bounce_notes("bounce notes", 1);
  const auto material_words = [&] {
    std::vector<std::uint64_t> packed(materials.size() + 2);
    for (std::size_t i = 0; i < materials.size(); ++i) materials[i].pack(&packed[i]);
    packed.resize(packed.size() / 2 * 2);
    return packed;
  }();
  std::vector<rh::word_t> material_memory(material_words.size() / 2);
  for (std::size_t i = 0; i < material_memory.size(); ++i) {
    material_memory[i] = material_words[2 * i + 1];
    material_memory[i] <<= 64;
    material_memory[i] |= rh::word_t(material_words[2 * i]);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (Rows* each : {&setup, &traverse, &trace}) each->keep = i >= eye_rays && i < diagonals_end;
    in.write(stream_word<rh::ray_setup_in_word_t>(rays[i]));
    ray_setup_top(in, ray_words);
    const rh::ray_setup_out_word_t ray = ray_words.read();
    ray_words.write(ray);
    stream_setup(ray_words, states, words, memory.count, 0, 1);
    rh::ray_state_word_t state = states.read();
    setup.add(ray, state);
    ray_words.write(ray);
    std::array<ap_uint<64>, kStreamSummaryWords> summary;
    stream_trace(ray_words, states, words, words, words, memory.lines.data(), summary.data(), memory.count, 0, 1);
    const rh::ray_state_word_t traced = states.read();
    trace.add(ray, traced);
    for (;;) {
      const unsigned kernel = rh::read_ray_state(state).kernel.to_uint();
      if (kernel == static_cast<unsigned>(contract::kKernelDone)) break;
      const rh::ray_state_word_t before = state;
      ray_words.write(ray);
      states.write(state);
      if (kernel == static_cast<unsigned>(contract::kKernelTraverse)) {
        stream_traverse(ray_words, states, out, words, words, memory.count, 1);
      } else {
        stream_intersect(ray_words, states, out, words, words, memory.lines.data(), memory.count, 1);
      }
      state = out.read();
      (kernel == static_cast<unsigned>(contract::kKernelTraverse) ? traverse : intersect).add(ray, before, state);
    }
    if (state != traced) throw Error("ray " + std::to_string(i) + ": the variants of the streaming machine differ");
    states.write(state);
    stream_finish(states, hits, 1);
    const rh::hit_word_t hit_word = hits.read();
    finish.add(state, hit_word);
    const auto hit = stream_record<contract::HitRecord>(hit_word);
    const GridWalk walk = walk_grid(
        image, rays[i].box,
        {.origin = rays[i].origin, .direction = rays[i].direction, .t_max = rays[i].t_max, .any = rays[i].any});
    if (hit != walk.hit) throw Error("ray " + std::to_string(i) + ": the streaming machine differs from its model");

    const light_model::Note note{static_cast<std::uint32_t>(i), {4096, 2048, 1024}, true};
    ray_words.write(ray);
    hits.write(hit_word);
    notes.write(rh::note_word_t(note.pack()));
    stream_shade(ray_words, hits, notes, direct, shadow, shadow_notes, bounce, bounce_notes, words,
                 material_memory.data(), memory.count, static_cast<unsigned>(materials.size()),
                 static_cast<unsigned>(light.position[0]), static_cast<unsigned>(light.position[1]),
                 static_cast<unsigned>(light.position[2]),
                 light.colour[0] | light.colour[1] << 8 | light.colour[2] << 16, light.seed, 1);
    const rh::note_word_t direct_word = direct.read(), shadow_note = shadow_notes.read(),
                          bounce_note = bounce_notes.read();
    const rh::ray_setup_in_word_t shadow_word = shadow.read(), bounce_word = bounce.read();
    shade.add(ray, hit_word, rh::note_word_t(note.pack()), direct_word, shadow_word, shadow_note, bounce_word,
              bounce_note);
  }
  const std::string of = std::string(kStreamScene) + ", " + std::to_string(world.vertices.size()) + " triangles";
  save(folder, "grid", "grid image of " + of, words_to_text(image.words(), 4, false));
  save(folder, "stream_frame", "camera and frame of stream_generate", words_to_text(head, 4, false));
  save(folder, "stream_materials", "materials of " + of, words_to_text(material_words, 4, false));
  const std::vector<std::uint64_t> setting{static_cast<std::uint32_t>(light.position[0]),
                                           static_cast<std::uint32_t>(light.position[1]),
                                           static_cast<std::uint32_t>(light.position[2]),
                                           light.colour[0] | light.colour[1] << 8 | light.colour[2] << 16,
                                           light.seed,
                                           materials.size()};
  save(folder, "stream_light", "position of the light, its colour, seed, number of materials",
       words_to_text(setting, 6, false));
  generate.save_as(folder, "generate", "ray, note");
  setup.save_as(folder, "setup", "ray, state");
  traverse.save_as(folder, "traverse", "ray, state before, state after");
  intersect.save_as(folder, "intersect", "ray, state before, state after");
  finish.save_as(folder, "finish", "state, hit");
  shade.save_as(folder, "shade", "ray, hit, note; direct note, shadow ray, shadow note, bounce, bounce note");
  trace.save_as(folder, "trace", "ray, state at the end");
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
    write_streaming(folder);
    return 0;
  });
}
