// See stream_frame.hpp.
#include "stream_frame.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "testbench/csim/stage_tops.hpp"
#include "testbench/streaming/stream_words.hpp"

namespace retrace {
namespace {

using contract::HitRecord;
using contract::RaySetupInRecord;
using hls::hit_word_t;
using hls::note_word_t;
using hls::ray_setup_in_word_t;
using hls::ray_setup_out_word_t;
using hls::word_t;
using light_model::Note;
constexpr std::size_t kBlock = 1024;  // records of one call of a kernel

template <class Record>
std::vector<word_t> memory_of(std::span<const Record> records) {
  std::vector<std::uint64_t> words(Record::kWords * records.size() + 2);
  for (std::size_t i = 0; i < records.size(); ++i) records[i].pack(&words[Record::kWords * i]);
  std::vector<word_t> wide(words.size() / 2);
  for (std::size_t i = 0; i < wide.size(); ++i) {
    wide[i] = words[2 * i + 1];
    wide[i] <<= 64;
    wide[i] |= word_t(words[2 * i]);
  }
  return wide;
}

struct Batch {
  std::vector<RaySetupInRecord> rays;
  std::vector<Note> notes;

  void add(const RaySetupInRecord& ray, const Note& note) {
    if (!note.active) return;
    rays.push_back(ray);
    notes.push_back(note);
  }
};

unsigned colour_word(const light_model::Light& light) {
  return light.colour[0] | light.colour[1] << 8 | light.colour[2] << 16;
}

/// Sends rays and their hits through stream_shade.
std::vector<light_model::Lit> shade(const StreamMemory& memory, const std::vector<word_t>& materials,
                                    std::size_t material_count, const Batch& batch, std::span<const HitRecord> hits,
                                    const light_model::Light& light) {
  std::vector<light_model::Lit> made(batch.rays.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, made.size(), kBlock),
      [&](const auto& range) {
        const std::size_t count = range.size();
        ::hls::stream<ray_setup_in_word_t> in("rays", 1), shadow("shadow rays", count), bounce("bounce rays", count);
        ::hls::stream<ray_setup_out_word_t> one("set up", 1), set_up("set up", count);
        ::hls::stream<hit_word_t> hit_words("hits", count);
        ::hls::stream<note_word_t> notes("notes", count), direct("direct", count), shadow_notes("shadow notes", count),
            bounce_notes("bounce notes", count);
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          in.write(stream_word<ray_setup_in_word_t>(batch.rays[i]));
          ray_setup_top(in, one);
          set_up.write(one.read());
          hit_words.write(stream_word<hit_word_t>(hits[i]));
          notes.write(note_word_t(batch.notes[i].pack()));
        }
        // The kernel numbers records from 0 in each call; the seed tells the calls apart.
        const std::uint32_t seed = light.seed + light_model::mix(static_cast<std::uint32_t>(range.begin()));
        stream_shade(set_up, hit_words, notes, direct, shadow, shadow_notes, bounce, bounce_notes, memory.words.data(),
                     materials.data(), memory.count, static_cast<unsigned>(material_count),
                     static_cast<unsigned>(light.position[0]), static_cast<unsigned>(light.position[1]),
                     static_cast<unsigned>(light.position[2]), colour_word(light), seed, static_cast<unsigned>(count));
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          light_model::Lit& lit = made[i];
          lit.direct = Note::unpack(direct.read().to_uint64());
          lit.shadow = stream_record<RaySetupInRecord>(shadow.read());
          lit.shadow_note = Note::unpack(shadow_notes.read().to_uint64());
          lit.bounce = stream_record<RaySetupInRecord>(bounce.read());
          lit.bounce_note = Note::unpack(bounce_notes.read().to_uint64());
        }
      },
      tbb::simple_partitioner());
  return made;
}

StreamTotals operator-(StreamTotals a, const StreamTotals& b) {
  a.rays -= b.rays, a.voxels -= b.voxels, a.tests -= b.tests, a.screens -= b.screens;
  a.traverse_passes -= b.traverse_passes, a.intersect_passes -= b.intersect_passes, a.steps -= b.steps;
  a.clocks -= b.clocks, a.bus_bytes -= b.bus_bytes;
  a.slots -= b.slots, a.state_bytes -= b.state_bytes, a.image_bytes -= b.image_bytes;
  return a;
}

void add(StreamTotals& a, const StreamTotals& b) {
  a.rays += b.rays, a.voxels += b.voxels, a.tests += b.tests, a.screens += b.screens;
  a.traverse_passes += b.traverse_passes, a.intersect_passes += b.intersect_passes, a.steps += b.steps;
  a.clocks += b.clocks, a.bus_bytes += b.bus_bytes;
  a.slots += b.slots, a.state_bytes += b.state_bytes, a.image_bytes += b.image_bytes;
}

}  // namespace

EyeRays eye_rays_by_kernel(std::span<const std::uint64_t> grid_words, const contract::CameraRecord& camera,
                           const contract::FrameRecord& frame, std::uint32_t sample) {
  const StreamMemory memory(grid_words);
  const std::size_t pixels = std::size_t{frame.width} * frame.height;
  ::hls::stream<ray_setup_in_word_t> rays("rays", pixels + 1);
  ::hls::stream<note_word_t> notes("notes", pixels + 1);
  stream_generate(rays, notes, memory.words.data(), memory_of(std::span(&camera, 1)).data(),
                  memory_of(std::span(&frame, 1)).data(), memory.count, sample);
  if (rays.size() != pixels || notes.size() != pixels) {
    rays.clear();
    notes.clear();
    throw Error("streaming machine: the kernel refuses the image or the frame");
  }
  EyeRays made;
  for (std::size_t i = 0; i < pixels; ++i) {
    made.rays.push_back(stream_record<RaySetupInRecord>(rays.read()));
    made.notes.push_back(Note::unpack(notes.read().to_uint64()));
  }
  return made;
}

light_model::Lit light_by_kernel(std::span<const std::uint64_t> grid_words,
                                 std::span<const contract::MaterialRecord> materials, const RaySetupInRecord& ray,
                                 const HitRecord& hit, const Note& note, const light_model::Light& light) {
  light_model::Light one = light;
  one.seed -= light_model::mix(0);  // what shade() adds to the first call
  return shade(StreamMemory(grid_words), memory_of(materials), materials.size(), {{ray}, {note}}, std::span(&hit, 1),
               one)[0];
}

std::vector<contract::MaterialRecord> materials_of(const ShadeTable& table) {
  if (table.instances != 0) throw Error("the streaming machine shades no instances");
  std::vector<contract::MaterialRecord> materials;
  for (std::size_t i = 0; i < table.words.size(); i += contract::MaterialRecord::kWords)
    materials.push_back(contract::MaterialRecord::unpack(&table.words[i]));
  return materials;
}

std::vector<std::array<double, 3>> draw_stream_frame(std::span<const std::uint64_t> grid_words,
                                                     const contract::CameraRecord& camera,
                                                     const contract::FrameRecord& frame,
                                                     std::span<const contract::MaterialRecord> materials,
                                                     const StreamFrame& options, StreamVariant variant,
                                                     StreamFrameTotals* totals) {
  const std::size_t pixels = std::size_t{frame.width} * frame.height;
  const StreamMemory memory(grid_words);
  const std::vector<word_t> material_words = memory_of(materials);
  const auto engine = make_stream_engine(grid_words, {}, variant);
  std::vector<std::array<std::uint64_t, 3>> sums(pixels);
  const auto add_light = [&](const Note& note) {
    if (!note.active) return;
    for (std::size_t c = 0; c < 3; ++c) sums[note.pixel][c] += note.weight[c];
  };
  const auto trace = [&](const Batch& batch, StreamTotals StreamFrameTotals::*kind) {
    const StreamTotals before = engine->totals();
    std::vector<HitRecord> hits = engine->run(batch.rays);
    if (totals != nullptr) add(totals->*kind, engine->totals() - before);
    return hits;
  };
  /// Light that a batch brings to its pixels, and what bounces off.
  const auto gather = [&](const Batch& batch, const light_model::Light& light, StreamTotals StreamFrameTotals::*kind,
                          StreamTotals StreamFrameTotals::*shadow_kind) {
    const std::vector<HitRecord> hits = trace(batch, kind);
    const std::vector<light_model::Lit> lit = shade(memory, material_words, materials.size(), batch, hits, light);
    Batch shadows, bounces;
    for (const light_model::Lit& one : lit) {
      add_light(one.direct);
      shadows.add(one.shadow, one.shadow_note);
      bounces.add(one.bounce, one.bounce_note);
    }
    const std::vector<HitRecord> blocked = trace(shadows, shadow_kind);
    for (std::size_t i = 0; i < blocked.size(); ++i)
      if (blocked[i].status == static_cast<std::uint32_t>(contract::kStatusMiss)) add_light(shadows.notes[i]);
    return bounces;
  };

  for (int sample = 0; sample < options.samples; ++sample) {
    light_model::Light light = options.light;
    light.seed = light_model::mix(options.light.seed + 2 * static_cast<std::uint32_t>(sample));
    const EyeRays made = eye_rays_by_kernel(grid_words, camera, frame, static_cast<std::uint32_t>(sample % 4));
    Batch eyes;
    for (std::size_t i = 0; i < pixels; ++i) eyes.add(made.rays[i], made.notes[i]);
    Batch next = gather(eyes, light, &StreamFrameTotals::eye, &StreamFrameTotals::shadow);
    for (int bounce = 0; bounce < options.bounces; ++bounce) {
      light.seed = light_model::mix(light.seed + 1);
      next = gather(next, light, &StreamFrameTotals::bounce, &StreamFrameTotals::bounce_shadow);
    }
  }
  std::vector<std::array<double, 3>> picture(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c) picture[i][c] = static_cast<double>(sums[i][c]) / (4096.0 * options.samples);
  return picture;
}

}  // namespace retrace
