// See csim_pixels.hpp.
#include "csim_pixels.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <array>
#include <atomic>

#include "hls/top/pixels.hpp"
#include "hls/top/trace.hpp"

namespace retrace {
namespace {

using hls::word_t;
constexpr std::size_t kBlock = 4096;  // rays a run of the kernel

std::vector<word_t> wide_words(std::vector<std::uint64_t> words) {
  words.resize((words.size() | 1) + 1);
  std::vector<word_t> wide(words.size() / 2);
  for (std::size_t i = 0; i < wide.size(); ++i) {
    wide[i] = words[2 * i + 1];
    wide[i] <<= 64;
    wide[i] |= word_t(words[2 * i]);
  }
  return wide;
}

template <class Record>
std::vector<word_t> words_of(std::span<const Record> records) {
  std::vector<std::uint64_t> words(Record::kWords * records.size());
  for (std::size_t i = 0; i < records.size(); ++i) records[i].pack(&words[Record::kWords * i]);
  return wide_words(std::move(words));
}

template <class Word>
std::array<std::uint64_t, (sizeof(Word) + 7) / 8> halves(const Word& word) {
  std::array<std::uint64_t, (sizeof(Word) + 7) / 8> result{};
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = static_cast<ap_uint<64>>(word >> static_cast<int>(64 * i)).to_uint64();
  return result;
}

template <class Word, class Record>
Word stream_word(const Record& record) {
  std::array<std::uint64_t, Record::kWords> packed{};
  record.pack(packed.data());
  Word word = 0;
  for (std::size_t i = packed.size(); i-- > 0;) {
    word <<= 64;
    word |= Word(packed[i]);
  }
  return word;
}

class CsimPixels final : public PixelEngine {
 public:
  CsimPixels(std::span<const std::uint64_t> image, const ShadeTable& table) : image_(image), table_(table) {}

  std::vector<std::uint32_t> draw(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                  const TraceOptions& options) override {
    check_frame(frame);
    totals_ = {};
    const auto made = raster_by_kernel(image_, camera, frame, &totals_.bad_samples);
    if (!made) throw Error("csim engine: the kernel refuses the image or the frame");
    std::vector<contract::RayRecord> rays;
    for (const contract::RasterOutRecord& one : *made)
      if (one.enters != 0)
        rays.push_back({.origin = one.origin, .direction = one.direction, .t_max = one.t_max, .any = 0});
    totals_.samples = made->size();
    totals_.rays = rays.size();
    std::vector<contract::PlacedHitRecord> hits(rays.size());
    trace_entered(image_, rays, hits, options);

    std::vector<contract::ShadeInRecord> results;
    std::size_t next = 0;
    for (const contract::RasterOutRecord& one : *made) {
      contract::ShadeInRecord in{.scale = one.scale, .start = one.start, .pixel = one.pixel};
      if (one.enters != 0) {
        const contract::PlacedHitRecord& hit = hits[next++];
        in.hit = hit.status == static_cast<std::uint32_t>(contract::kStatusHit);
        in.t = hit.t;
        in.id = hit.id;
        in.number = hit.number;
      }
      results.push_back(in);
    }
    if (frame.shadows != 0 && frame.kind == static_cast<std::uint32_t>(contract::kPixelColour)) {
      const auto towards = shadows_by_kernel(image_, frame, *made, results);
      if (!towards) throw Error("csim engine: the kernel refuses the image or the frame");
      rays.clear();
      for (const contract::RasterOutRecord& one : *towards)
        if (one.enters != 0)
          rays.push_back({.origin = one.origin, .direction = one.direction, .t_max = one.t_max, .any = 1});
      hits.assign(rays.size(), {});
      trace_entered(image_, rays, hits, options);
      next = 0;
      for (std::size_t i = 0; i < results.size(); ++i)
        if ((*towards)[i].enters != 0)
          results[i].shadow = hits[next++].status == static_cast<std::uint32_t>(contract::kStatusHit);
      totals_.shadow_rays = rays.size();
      totals_.rays += rays.size();
    }
    auto pixels = shade_by_kernel(frame, results, table_, &totals_.unknown);
    if (!pixels) throw Error("csim engine: the kernel refuses the frame");
    return std::move(*pixels);
  }

  const PixelTotals& totals() const override { return totals_; }

 private:
  std::span<const std::uint64_t> image_;
  ShadeTable table_;
  PixelTotals totals_;
};

}  // namespace

void trace_entered(std::span<const std::uint64_t> words, std::span<const contract::RayRecord> rays,
                   std::span<contract::PlacedHitRecord> hits, const TraceOptions& options) {
  if (options.way_up == WayUp::kStack) throw Error("csim engine: the kernel has no stack; use parent or face links");
  const int bits = RETRACE_OPTION_ENTERED | (options.way_up == WayUp::kParentLinks ? RETRACE_OPTION_PARENT_LINKS : 0) |
                   (options.mailbox != 0 ? RETRACE_OPTION_MAILBOX : 0);
  const auto* image = reinterpret_cast<const word_t*>(words.data());
  std::atomic<bool> refused = false;
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, rays.size(), kBlock),
        [&](const auto& range) {
          const std::vector<word_t> ray_words = words_of(rays.subspan(range.begin(), range.size()));
          std::vector<word_t> hit_words(range.size()), work(1);
          std::array<ap_uint<64>, kSummaryWords> summary;
          retrace_trace(image, image, image, image, ray_words.data(), hit_words.data(), work.data(), summary.data(),
                        words.size() / MemoryImage::kLineWords, range.size(), bits);
          if (summary[kSummaryStatus] != 0) refused = true;
          for (std::size_t i = 0; i < range.size(); ++i)
            hits[range.begin() + i] = contract::PlacedHitRecord::unpack(halves(hit_words[i]).data());
          if (options.done) *options.done += range.size();
        },
        tbb::simple_partitioner());
  });
  if (refused) throw Error("csim engine: the kernel refuses the image");
}

std::optional<std::vector<contract::RasterOutRecord>> raster_by_kernel(std::span<const std::uint64_t> words,
                                                                       const contract::CameraRecord& camera,
                                                                       const contract::FrameRecord& frame,
                                                                       std::uint64_t* bad) {
  const std::vector<word_t> camera_words = words_of(std::span(&camera, 1)),
                            frame_words = words_of(std::span(&frame, 1));
  const std::size_t most = (std::size_t{frame.width} * frame.height << frame.samples) + 1;
  ::hls::stream<hls::raster_out_word_t> samples("samples", most);
  std::array<ap_uint<64>, kPixelsWords> summary;
  retrace_raster(reinterpret_cast<const word_t*>(words.data()), camera_words.data(), frame_words.data(), samples,
                 summary.data(), words.size() / MemoryImage::kLineWords);
  if (summary[kPixelsStatus] != 0) return std::nullopt;
  std::vector<contract::RasterOutRecord> made(samples.size());
  for (contract::RasterOutRecord& one : made) one = contract::RasterOutRecord::unpack(halves(samples.read()).data());
  if (summary[kPixelsSamples] != made.size()) return std::nullopt;
  if (bad != nullptr) *bad = summary[kPixelsOdd].to_uint64();
  return made;
}

std::optional<std::vector<contract::RasterOutRecord>> shadows_by_kernel(
    std::span<const std::uint64_t> words, const contract::FrameRecord& frame,
    std::span<const contract::RasterOutRecord> samples, std::span<const contract::ShadeInRecord> hits) {
  const std::vector<word_t> frame_words = words_of(std::span(&frame, 1));
  ::hls::stream<hls::raster_out_word_t> made("made", samples.size() + 1), rays("rays", samples.size() + 1);
  ::hls::stream<hls::shade_in_word_t> results("results", samples.size() + 1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    made.write(stream_word<hls::raster_out_word_t>(samples[i]));
    results.write(stream_word<hls::shade_in_word_t>(hits[i]));
  }
  std::array<ap_uint<64>, kPixelsWords> summary;
  retrace_shadow(reinterpret_cast<const word_t*>(words.data()), frame_words.data(), made, results, rays, summary.data(),
                 words.size() / MemoryImage::kLineWords);
  if (summary[kPixelsStatus] != 0 || rays.size() != samples.size()) return std::nullopt;
  std::vector<contract::RasterOutRecord> towards(samples.size());
  for (contract::RasterOutRecord& one : towards) one = contract::RasterOutRecord::unpack(halves(rays.read()).data());
  return towards;
}

std::optional<std::vector<std::uint32_t>> shade_by_kernel(const contract::FrameRecord& frame,
                                                          std::span<const contract::ShadeInRecord> samples,
                                                          const ShadeTable& table, std::uint64_t* unknown) {
  const std::vector<word_t> frame_words = words_of(std::span(&frame, 1)), material_words = wide_words(table.words);
  ::hls::stream<hls::shade_in_word_t> results("results", samples.size() + 1);
  for (const contract::ShadeInRecord& one : samples) results.write(stream_word<hls::shade_in_word_t>(one));
  const std::size_t pixels = std::size_t{frame.width} * frame.height;
  std::vector<ap_uint<32>> memory(2 * pixels + 1);
  std::array<ap_uint<64>, kPixelsWords> summary;
  retrace_shade(frame_words.data(), material_words.data(), results, memory.data(), summary.data(), table.size(),
                table.instances);
  if (summary[kPixelsStatus] != 0) {
    results.clear();
    return std::nullopt;
  }
  if (unknown != nullptr) *unknown = summary[kPixelsOdd].to_uint64();
  std::vector<std::uint32_t> result(frame.kind == contract::kPixelHit ? 2 * pixels : pixels);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = memory[i].to_uint();
  return result;
}

std::unique_ptr<PixelEngine> make_csim_pixels(std::span<const std::uint64_t> image_words, const ShadeTable& table) {
  return std::make_unique<CsimPixels>(image_words, table);
}

}  // namespace retrace
