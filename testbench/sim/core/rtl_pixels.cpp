// See rtl_pixels.hpp.
#include "testbench/sim/core/rtl_pixels.hpp"

#include "golden/engine/stages/shade.hpp"
#include "testbench/sim/core/simulated_device.hpp"

namespace retrace {
namespace {

class RtlPixels final : public PixelEngine {
 public:
  RtlPixels(std::span<const std::uint64_t> image, const ShadeTable& table, const RtlOptions& options)
      : image_(image),
        table_(table),
        options_(options),
        device_({options.configuration, options.memory, options.waves, options.seed}),
        driver_(device_) {
    if (!driver_.identity().pixels)
      throw Error("rtl engine: configuration " + options.configuration + " makes no pictures by itself; chip does");
    if (driver_.identity().levels < 2 && cosim::has_two_levels(image))
      throw Error("rtl engine: configuration " + options.configuration +
                  " reads images of one level; saarcor takes two");
  }

  std::vector<std::uint32_t> draw(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                  const TraceOptions& options) override {
    check_frame(frame);
    if (options.way_up == WayUp::kStack) throw Error("rtl engine: the core has no stack; use parent or face links");
    const std::size_t pixels = std::size_t{golden::pixel_words(frame.kind)} * frame.width * frame.height;
    if (pixels > room_) {
      room_ = pixels;
      driver_.load_pictures(image_, table_, 4 * pixels);
    }
    driver_.start_picture(camera, frame,
                          {.parent_links = options.way_up == WayUp::kParentLinks, .mailbox = options.mailbox != 0});
    totals_ = {};
    totals_.samples = std::uint64_t{frame.width} * frame.height << frame.samples;
    driver_.wait(100000 + options_.clocks_per_ray * totals_.samples);
    const cosim::CoreStatus status = driver_.status();
    const cosim::CoreCounters counters = driver_.counters();
    totals_.rays = counters.rays;
    totals_.clocks = counters.clocks;
    totals_.bytes = (counters.read_beats + counters.write_beats) * static_cast<std::uint64_t>(device_.data_bytes());
    totals_.bad_samples = status.camera_fault ? 1 : 0;
    totals_.unknown = status.material_fault ? 1 : 0;
    if (status.image_fault != 0 || status.frame_fault || status.write_fault)
      throw Error("rtl engine: the core refuses the image or the frame, or cannot write it");
    std::vector<std::uint64_t> words((pixels + 1) / 2);
    driver_.picture(words);
    std::vector<std::uint32_t> result(pixels);
    for (std::size_t i = 0; i < pixels; ++i) result[i] = static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2));
    return result;
  }

  const PixelTotals& totals() const override { return totals_; }

 private:
  std::span<const std::uint64_t> image_;
  ShadeTable table_;
  RtlOptions options_;
  cosim::SimulatedDevice device_;
  cosim::CoreDriver driver_;
  std::size_t room_ = 0;
  PixelTotals totals_;
};

}  // namespace

std::unique_ptr<PixelEngine> make_rtl_pixels(std::span<const std::uint64_t> image_words, const ShadeTable& table,
                                             const RtlOptions& options) {
  return std::make_unique<RtlPixels>(image_words, table, options);
}

}  // namespace retrace
