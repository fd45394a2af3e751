// See board_engine.hpp.
#include "testbench/driver/board_engine.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "golden/engine/hit_codec.hpp"
#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"
#include "testbench/driver/serial_device.hpp"

namespace retrace {
namespace {

class Board final : public BoardEngine {
 public:
  Board(std::span<const std::uint64_t> image, std::unique_ptr<cosim::BoardDevice> device, const BoardOptions& options,
        const std::string& name)
      : name_(name), options_(options), device_(std::move(device)), driver_(*device_) {
    if (driver_.identity().data_bytes != 8)
      throw Error(name_ + " engine: the board's core has a bus of " + std::to_string(driver_.identity().data_bytes) +
                  " bytes, expected 8");
    if (driver_.identity().levels < 2 && cosim::has_two_levels(image))
      throw Error(name_ + " engine: the image has instances, and the board's core has one level");
    // Image, rays and hits each begin at a multiple of kAlignment, and CoreDriver leaves 8 bytes behind rays and hits.
    constexpr std::uint64_t kAlign = cosim::BoardDevice::kAlignment, kPad = 2 * (kAlign + 8);
    const std::uint64_t memory = device_->identity().memory_bytes;
    const std::uint64_t taken = (std::max<std::uint64_t>(image.size() * 8, 64) + kAlign - 1) / kAlign * kAlign + kPad;
    constexpr std::uint64_t kRay = contract::kRayBytes + contract::kHitBytes, kFewest = 16;
    if (taken + kFewest * kRay > memory)
      throw Error(name_ + " engine: the memory image of " + std::to_string(image.size() * 8) +
                  " bytes and a few rays do not fit the board's memory of " + std::to_string(memory) + " bytes");
    most_rays_ = static_cast<std::size_t>((memory - taken) / kRay);
    if (options.most_rays != 0) most_rays_ = std::min(most_rays_, options.most_rays);
    driver_.soft_reset();  // whatever a program before has left running
    driver_.load(image, most_rays_);
  }

  std::string name() const override { return name_; }
  std::span<const std::uint64_t> raw_hits() const override { return raw_hits_; }
  const cosim::CoreCounters& counters() const override { return counters_; }
  cosim::CoreIdentity identity() const override { return driver_.identity(); }
  const cosim::BoardIdentity& board() const override { return device_->identity(); }
  const cosim::LinkStatistics& link() const override { return device_->statistics(); }
  std::uint64_t runs() const override { return runs_; }
  std::size_t most_rays() const override { return most_rays_; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size()) throw Error(name_ + " engine: sizes of rays and hits differ");
    if (!work.empty()) throw Error(name_ + " engine: the core counts work for the whole run, not for each ray");
    if (options.way_up == WayUp::kStack)
      throw Error(name_ + " engine: the core has no stack; use parent or face links");
    if (options.mailbox != 0 && options.mailbox != driver_.identity().mail_entries)
      throw Error(name_ + " engine: the mailbox of the board's core has " +
                  std::to_string(driver_.identity().mail_entries) + " entries, or 0 to leave it off");
    raw_hits_.assign(kHitWords * rays.size(), 0);
    std::fill(hits.begin(), hits.end(), Hit{});
    std::vector<std::size_t> batch;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].outside) {
        if (options.done) ++*options.done;
        continue;
      }
      batch.push_back(i);
      if (batch.size() == most_rays_) {
        run(rays, batch, hits, options);
        batch.clear();
      }
    }
    if (!batch.empty()) run(rays, batch, hits, options);
  }

 private:
  void run(std::span<const GridRay> rays, const std::vector<std::size_t>& batch, std::span<Hit> hits,
           const TraceOptions& options) {
    const std::vector<std::uint64_t> ray_words = pack_rays(rays, batch);
    std::vector<std::uint64_t> hit_words(kHitWords * batch.size());
    cosim::CoreMode mode;
    mode.parent_links = options.way_up == WayUp::kParentLinks;
    mode.mailbox = options.mailbox != 0;
    const std::uint32_t before = device_->runs();
    driver_.start(ray_words, mode);
    driver_.wait(100000 + options_.clocks_per_ray * batch.size());
    // Exactly one run has ended since: these hits are of these rays.
    const std::uint32_t after = device_->runs();
    if (after != before + 1)
      throw Error(name_ + " engine: the board has run " + std::to_string(after - before) + " times instead of once");
    const cosim::CoreStatus status = driver_.status();
    if (status.image_fault != 0)
      throw Error(name_ + " engine: the core refuses the image (fault " + std::to_string(status.image_fault) + ")");
    if (status.write_fault)
      throw Error(name_ + " engine: the board could not write the hit of ray " +
                  std::to_string(status.write_fault_ray));
    const cosim::CoreCounters counters = driver_.counters();
    if (counters.rays != batch.size())
      throw Error(name_ + " engine: the core has finished " + std::to_string(counters.rays) + " rays of " +
                  std::to_string(batch.size()));
    counters_.add(counters);
    driver_.hits(hit_words);
    for (std::size_t i = 0; i < batch.size(); ++i)
      if (hit_words[2 * i] == cosim::CoreDriver::kUnwritten && hit_words[2 * i + 1] == cosim::CoreDriver::kUnwritten)
        throw Error(name_ + " engine: the core has not written the hit of ray " + std::to_string(i));
    unpack_hits(hit_words, batch, hits, raw_hits_);
    ++runs_;
    if (options.done) *options.done += batch.size();
  }

  std::string name_;
  BoardOptions options_;
  std::unique_ptr<cosim::BoardDevice> device_;
  cosim::CoreDriver driver_;
  std::size_t most_rays_ = 0;
  std::vector<std::uint64_t> raw_hits_;
  cosim::CoreCounters counters_;
  std::uint64_t runs_ = 0;
};

}  // namespace

std::unique_ptr<BoardEngine> make_board_engine(const MemoryImage& image, std::unique_ptr<cosim::BoardDevice> device,
                                               const BoardOptions& options, const std::string& name) {
  return std::make_unique<Board>(image.words(), std::move(device), options, name);
}

std::unique_ptr<BoardEngine> make_serial_engine(const MemoryImage& image, std::unique_ptr<cosim::SerialLine> line,
                                                const BoardOptions& options) {
  return make_board_engine(image, std::make_unique<cosim::SerialDevice>(std::move(line), options.link), options,
                           "serial");
}

}  // namespace retrace
