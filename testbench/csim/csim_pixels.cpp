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

template <class Record>
std::vector<word_t> words_of(std::span<const Record> records) {
  std::vector<std::uint64_t> words(Record::kWords * records.size() + 2);
  for (std::size_t i = 0; i < records.size(); ++i) records[i].pack(&words[Record::kWords * i]);
  std::vector<word_t> wide((words.size() + 1) / 2);
  for (std::size_t i = 0; i < wide.size(); ++i) {
    wide[i] = words[2 * i + 1];
    wide[i] <<= 64;
    wide[i] |= word_t(words[2 * i]);
  }
  return wide;
}

template <class Word>
std::array<std::uint64_t, (sizeof(Word) + 7) / 8> halves(const Word& word) {
  std::array<std::uint64_t, (sizeof(Word) + 7) / 8> result{};
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = static_cast<ap_uint<64>>(word >> static_cast<int>(64 * i)).to_uint64();
  return result;
}

class CsimPixels final : public PixelEngine {
 public:
  CsimPixels(std::span<const std::uint64_t> image, std::span<const contract::MaterialRecord> materials)
      : image_(image), materials_(materials.begin(), materials.end()) {}

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
    std::vector<contract::HitRecord> hits(rays.size());
    trace_entered(image_, rays, hits, options);

    std::vector<contract::ShadeInRecord> results;
    std::size_t next = 0;
    for (const contract::RasterOutRecord& one : *made) {
      contract::ShadeInRecord in{.scale = one.scale, .start = one.start, .pixel = one.pixel};
      if (one.enters != 0) {
        const contract::HitRecord& hit = hits[next++];
        in.hit = hit.status == static_cast<std::uint32_t>(contract::kStatusHit);
        in.t = hit.t;
        in.id = hit.id;
      }
      results.push_back(in);
    }
    auto pixels = shade_by_kernel(frame, results, materials_, &totals_.unknown);
    if (!pixels) throw Error("csim engine: the kernel refuses the frame");
    return std::move(*pixels);
  }

  const PixelTotals& totals() const override { return totals_; }

 private:
  std::span<const std::uint64_t> image_;
  std::vector<contract::MaterialRecord> materials_;
  PixelTotals totals_;
};

}  // namespace

void trace_entered(std::span<const std::uint64_t> words, std::span<const contract::RayRecord> rays,
                   std::span<contract::HitRecord> hits, const TraceOptions& options) {
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
            hits[range.begin() + i] = contract::HitRecord::unpack(halves(hit_words[i]).data());
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

std::optional<std::vector<std::uint32_t>> shade_by_kernel(const contract::FrameRecord& frame,
                                                          std::span<const contract::ShadeInRecord> samples,
                                                          std::span<const contract::MaterialRecord> materials,
                                                          std::uint64_t* unknown) {
  const std::vector<word_t> frame_words = words_of(std::span(&frame, 1)), material_words = words_of(materials);
  ::hls::stream<hls::shade_in_word_t> results("results", samples.size() + 1);
  for (const contract::ShadeInRecord& one : samples) {
    std::array<std::uint64_t, contract::ShadeInRecord::kWords> packed{};
    one.pack(packed.data());
    hls::shade_in_word_t word = packed[1];
    word <<= 64;
    word |= hls::shade_in_word_t(packed[0]);
    results.write(word);
  }
  const std::size_t pixels = std::size_t{frame.width} * frame.height;
  std::vector<ap_uint<32>> memory(2 * pixels + 1);
  std::array<ap_uint<64>, kPixelsWords> summary;
  retrace_shade(frame_words.data(), material_words.data(), results, memory.data(), summary.data(), materials.size());
  if (summary[kPixelsStatus] != 0) {
    results.clear();
    return std::nullopt;
  }
  if (unknown != nullptr) *unknown = summary[kPixelsOdd].to_uint64();
  std::vector<std::uint32_t> result(frame.kind == contract::kPixelHit ? 2 * pixels : pixels);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = memory[i].to_uint();
  return result;
}

std::unique_ptr<PixelEngine> make_csim_pixels(std::span<const std::uint64_t> image_words,
                                              std::span<const contract::MaterialRecord> materials) {
  return std::make_unique<CsimPixels>(image_words, materials);
}

}  // namespace retrace
