// See rtl_engine.hpp.
#include "testbench/sim/core/rtl_engine.hpp"

#include <algorithm>

#include "golden/base/clock.hpp"
#include "golden/engine/hit_codec.hpp"
#include "testbench/sim/core/simulated_device.hpp"
#include "testbench/sim/core/stage_watch.hpp"

namespace retrace {
namespace {

/// Indices of the rays inside, in the order in which they stand in the core's memory: that of the list, which the core visits in tiles if it
/// has rows. Where rays are missing, what is left has no rows; then the list itself is in the tiles of rtl/ray/rt_ray_source.sv.
std::vector<std::size_t> rays_to_submit(std::span<const GridRay> rays, std::size_t row) {
  constexpr std::size_t kTileWidth = 4, kTileHeight = 64;
  std::vector<std::size_t> order = rays_inside(rays);
  if (order.size() == rays.size() || row == 0) return order;
  order.clear();
  const auto add = [&](std::size_t i) {
    if (i < rays.size() && !rays[i].outside) order.push_back(i);
  };
  for (std::size_t band = 0; band < rays.size(); band += kTileHeight * row)
    for (std::size_t column = 0; column < row; column += kTileWidth)
      for (std::size_t line = 0; line < kTileHeight; ++line)
        for (std::size_t x = column; x < std::min(column + kTileWidth, row); ++x) add(band + line * row + x);
  return order;
}

class Simulation final : public RtlEngine {
 public:
  Simulation(std::span<const std::uint64_t> image, const RtlOptions& options)
      : image_(image),
        options_(options),
        device_({options.configuration, options.memory, options.waves, options.seed}),
        driver_(device_) {
    if (driver_.identity().levels < 2 && cosim::has_two_levels(image))
      throw Error("rtl engine: the image has instances and the configuration '" + options.configuration +
                  "' one level; saarcor has two");
  }

  std::string name() const override { return "rtl"; }
  std::span<const std::uint64_t> raw_hits() const override { return raw_hits_; }
  const cosim::CoreCounters& counters() const override { return counters_; }
  const std::string& configuration() const override { return options_.configuration; }
  cosim::CoreIdentity identity() const override { return driver_.identity(); }
  std::array<std::uint64_t, cosim::kReadSources.size()> read_bytes_by_source() const override {
    constexpr std::uint32_t kMissRegisters = 16;  // of a source in ARID (rt_core_pkg::MshrIdBits)
    std::array<std::uint64_t, cosim::kReadSources.size()> bytes{};
    for (std::uint32_t id = 0; id < kMissRegisters * bytes.size(); ++id)
      bytes[id / kMissRegisters] += device_.bus_memory().read_bytes_of(id);
    return bytes;
  }
  void set_ray_row(std::uint32_t rays) override { options_.ray_row = rays; }
  cosim::CoreStatus status() const override { return status_; }
  std::uint64_t simulated_clocks() const override { return device_.clocks(); }
  double simulation_seconds() const override { return seconds_; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size()) throw Error("rtl engine: sizes of rays and hits differ");
    if (!work.empty()) throw Error("rtl engine: the core counts work for the whole run, not for each ray");
    if (options.way_up == WayUp::kStack) throw Error("rtl engine: the core has no stack; use parent or face links");
    if (options.mailbox != 0 && options.mailbox != driver_.identity().mail_entries)
      throw Error("rtl engine: the mailbox of this configuration has " +
                  std::to_string(driver_.identity().mail_entries) + " entries, or 0 to leave it off");
    const std::vector<std::size_t> inside = rays_to_submit(rays, options_.ray_row);
    const std::vector<std::uint64_t> ray_words = pack_rays(rays, inside);
    std::vector<std::uint64_t> hit_words(kHitWords * inside.size());

    const double begin = now();
    if (inside.size() > room_ || room_ == 0) {
      room_ = std::max<std::size_t>(inside.size(), 1);
      driver_.load(image_, room_);
    }
    cosim::CoreMode mode;
    mode.parent_links = options.way_up == WayUp::kParentLinks;
    mode.mailbox = options.mailbox != 0;
    if (inside.size() == rays.size()) mode.ray_row = options_.ray_row;
    driver_.start(ray_words, mode);
    std::uint64_t reported = 0;
    driver_.wait(100000 + options_.clocks_per_ray * inside.size(), [&](std::uint64_t finished) {
      if (options.done && finished > reported) *options.done += finished - reported;
      reported = std::max(reported, finished);
    });
    if (options.done) *options.done += rays.size() - inside.size();
    driver_.hits(hit_words);
    status_ = driver_.status();
    counters_.add(driver_.counters());
    seconds_ += now() - begin;

    if (status_.image_fault != 0) {
      constexpr const char* kWhy[] = {"", "the image's magic or version is wrong",
                                      "a section of the image lies outside it",
                                      "the memory answered with an error for the header"};
      throw Error(std::string("rtl engine: ") + kWhy[status_.image_fault]);
    }
    raw_hits_.assign(kHitWords * rays.size(), 0);
    std::fill(hits.begin(), hits.end(), Hit{});
    unpack_hits(hit_words, inside, hits, raw_hits_);
  }

  Walk walk(const GridRay& ray, const TraceOptions& options) override {
    Walk walk;
    {
      const cosim::StageWatch watch;
      reset();
      trace({&ray, 1}, {&walk.hit, 1}, {}, options);
      walk.calls = watch.calls();
    }
    reset();
    const std::vector<contract::InstanceRecord> instances = instances_of(image_);
    for (StageCall& call : walk.calls)
      if (call.stage == Stage::kInstanceEnter)
        name_instance(call, contract::InstanceEnterInRecord::unpack(call.input.data()), instances);
    find_levels(walk.calls);
    // When an any-hit ray gets its hit, further references of the leaf may be on their way through rt_tri_test; nobody looks at what they give.
    const auto is_test = [](const StageCall& call) { return call.stage == Stage::kTriTest; };
    std::uint32_t t_max_inside = 0;  // of the ray of the object that was entered last
    const auto first_hit = std::find_if(walk.calls.begin(), walk.calls.end(), [&](const StageCall& call) {
      if (call.stage == Stage::kInstanceEnter)
        t_max_inside = contract::InstanceEnterOutRecord::unpack(call.output.data()).t_max;
      return is_test(call) && contract::TriTestOutRecord::unpack(call.output.data()).hit != 0 &&
             contract::TriTestOutRecord::unpack(call.output.data()).t <=
                 (call.level != 0 ? t_max_inside : ray.record.t_max);
    });
    if (ray.record.any != 0 && first_hit != walk.calls.end())
      walk.calls.erase(std::remove_if(std::next(first_hit), walk.calls.end(), is_test), walk.calls.end());
    return walk;
  }

 private:
  /// The core forgets everything, so that the next trace() sets it up again; probes look who is watching.
  void reset() {
    device_.hard_reset();
    room_ = 0;
  }

  std::span<const std::uint64_t> image_;
  RtlOptions options_;
  cosim::SimulatedDevice device_;
  cosim::CoreDriver driver_;
  std::size_t room_ = 0;
  std::vector<std::uint64_t> raw_hits_;
  cosim::CoreCounters counters_;
  cosim::CoreStatus status_;
  double seconds_ = 0;
};

}  // namespace

std::unique_ptr<RtlEngine> make_rtl_engine(const MemoryImage& image, const RtlOptions& options) {
  return std::make_unique<Simulation>(image.words(), options);
}

std::unique_ptr<RtlEngine> make_rtl_engine(std::span<const std::uint64_t> image_words, const RtlOptions& options) {
  return std::make_unique<Simulation>(image_words, options);
}

}  // namespace retrace
