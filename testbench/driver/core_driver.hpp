// Driver of a Retrace core: loads an image, submits rays, waits, reads hits, status and counters. Works on any Device.
// Register map: rtl/shell/rt_regs.rdl.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/engine/shade_table.hpp"
#include "testbench/driver/device.hpp"

namespace retrace::cosim {

struct CoreIdentity {
  int lanes = 0, contexts = 0, data_bytes = 0, mail_entries = 0;
  int levels = 1;       ///< 2: it reads images with instances as well
  bool pixels = false;  ///< makes rays and pixels
};

struct CoreStatus {
  bool busy = false, done = false, ray_fault = false, write_fault = false;
  int image_fault =
      0;  ///< 0 none, 1 magic or version (also that of two levels, for a core of one), 2 section outside the image, 3 bus error in the header
  std::uint32_t first_fault = 0, fault_ray = 0, write_fault_ray = 0;
  bool frame_fault = false, camera_fault = false, material_fault = false;  ///< of pictures
  int front = 0;                                                           ///< frame buffer drawn last
};

/// Bytes of the core's registers.
std::uint32_t register_bytes();
/// Has this image instances? Of words that nobody has checked.
bool has_two_levels(std::span<const std::uint64_t> image_words);

/// Where the clocks of a unit went. Lanes: sum over the lanes.
struct UnitClocks {
  std::uint64_t busy = 0, starved = 0, blocked = 0;
};

struct CoreCounters : WorkTotals {
  std::uint64_t clocks = 0, faults = 0;
  std::uint64_t node_hits = 0, node_misses = 0, leaf_hits = 0, leaf_misses = 0, list_hits = 0, list_misses = 0,
                triangle_hits = 0, triangle_misses = 0, read_beats = 0, write_beats = 0, context_clocks = 0,
                entries = 0, entry_passed = 0, entry_refused = 0, entry_blocked = 0;
  UnitClocks lanes, leaf_unit, references, tri_test, results, bus;

  std::uint64_t node_steps() const { return visits(); }
  void add(const CoreCounters& other);
};

struct CoreMode {
  bool parent_links = false, mailbox = false;
  bool own_step_limit = false;
  std::uint32_t step_limit = 0;
  std::uint32_t ray_row =
      0;  ///< rays in a row of the image, so that the core may visit them in tiles; 0: one after the other
};

/// Where image, rays and hits begin, in bytes behind the start of a page: multiples of 64, 32 and 16.
struct Placement {
  std::uint64_t image = 0, rays = 0, hits = 0;
};

class CoreDriver {
 public:
  /// Throws Error if the device has no Retrace core of this version.
  explicit CoreDriver(Device& device);
  const CoreIdentity& identity() const { return identity_; }

  /// Makes room for an image and `most_rays` rays and their hits, and writes the image. The rays begin `ray_offset` rays into a page.
  void load(std::span<const std::uint64_t> image_words, std::uint64_t most_rays, std::uint64_t ray_offset = 0);
  /// The same at any place the registers can name.
  void load_at(std::span<const std::uint64_t> image_words, std::uint64_t most_rays, const Placement& placement);
  /// Writes the rays (4 words each), fills the hits with a pattern, starts.
  void start(std::span<const std::uint64_t> ray_words, const CoreMode& mode);
  /// The same for pictures: image, records for shading, two frame buffers of `pixel_bytes`.
  void load_pictures(std::span<const std::uint64_t> image_words, const ShadeTable& table, std::uint64_t pixel_bytes);
  /// Fills the frame buffer that is drawn next with a pattern, starts.
  void start_picture(const contract::CameraRecord& camera, const contract::FrameRecord& frame, const CoreMode& mode);
  /// Of the frame buffer drawn last.
  void picture(std::span<std::uint64_t> words);
  /// Until done. `progress` gets the number of rays finished now and then. Throws Error after `most_clocks` without the end.
  void wait(std::uint64_t most_clocks, const std::function<void(std::uint64_t)>& progress = {});
  /// Two words a ray.
  void hits(std::span<std::uint64_t> words);
  CoreStatus status();
  CoreCounters counters();
  /// At any moment; returns when the core is idle. Throws Error if it does not get there.
  void soft_reset();

  std::uint64_t image_address() const { return image_address_; }
  std::uint64_t ray_address() const { return ray_address_; }
  std::uint64_t hit_address() const { return hit_address_; }
  std::uint64_t frame_address(int buffer) const { return frame_address_[static_cast<std::size_t>(buffer)]; }
  std::uint64_t material_address() const { return material_address_; }
  static constexpr std::uint64_t kUnwritten = 0x5a5a5a5a5a5a5a5aull;  ///< what start() puts into the hits

 private:
  Device& device_;
  CoreIdentity identity_;
  std::uint64_t image_address_ = 0, ray_address_ = 0, hit_address_ = 0, most_rays_ = 0, image_lines_ = 0, rays_ = 0;
  std::uint64_t material_address_ = 0, materials_ = 0, instances_ = 0, pixel_bytes_ = 0;
  std::array<std::uint64_t, 2> frame_address_{};
};

}  // namespace retrace::cosim
