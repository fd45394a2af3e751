// See core_driver.hpp.
#include "testbench/driver/core_driver.hpp"

#include <algorithm>
#include <cstddef>

#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"
#include "rtl/shell/rt_regs.h"

namespace retrace::cosim {
namespace {

constexpr std::uint32_t kPollLimit = 1000000;
#define RT_OFFSET(name) static_cast<std::uint32_t>(offsetof(rt_regs_t, name))

std::uint32_t field(std::uint32_t value, std::uint32_t mask, std::uint32_t position) {
  return (value & mask) >> position;
}
#define RT_FIELD(value, name) field(value, RT_REGS__##name##_bm, RT_REGS__##name##_bp)

}  // namespace

void CoreCounters::add(const CoreCounters& o) {
  std::uint64_t CoreCounters::*const plain[] = {&CoreCounters::clocks,
                                                &CoreCounters::rays,
                                                &CoreCounters::faults,
                                                &CoreCounters::down,
                                                &CoreCounters::up,
                                                &CoreCounters::leaf,
                                                &CoreCounters::tests,
                                                &CoreCounters::skipped,
                                                &CoreCounters::node_hits,
                                                &CoreCounters::node_misses,
                                                &CoreCounters::leaf_hits,
                                                &CoreCounters::leaf_misses,
                                                &CoreCounters::list_hits,
                                                &CoreCounters::list_misses,
                                                &CoreCounters::triangle_hits,
                                                &CoreCounters::triangle_misses,
                                                &CoreCounters::read_beats,
                                                &CoreCounters::write_beats,
                                                &CoreCounters::context_clocks,
                                                &CoreCounters::entries,
                                                &CoreCounters::entry_passed,
                                                &CoreCounters::entry_refused,
                                                &CoreCounters::entry_blocked};
  for (auto member : plain) this->*member += o.*member;
  UnitClocks CoreCounters::*const units[] = {&CoreCounters::lanes,      &CoreCounters::leaf_unit,
                                             &CoreCounters::references, &CoreCounters::tri_test,
                                             &CoreCounters::results,    &CoreCounters::bus};
  for (auto member : units) {
    (this->*member).busy += (o.*member).busy;
    (this->*member).starved += (o.*member).starved;
    (this->*member).blocked += (o.*member).blocked;
  }
}

std::uint32_t register_bytes() { return static_cast<std::uint32_t>(sizeof(rt_regs_t)); }

bool has_two_levels(std::span<const std::uint64_t> image_words) {
  return image_words.size() >= contract::HeaderRecord::kWords &&
         contract::HeaderRecord::unpack(image_words.data()).version ==
             static_cast<std::uint32_t>(contract::kImageVersionTwoLevels);
}

CoreDriver::CoreDriver(Device& device) : device_(device) {
  if (device.read_register(RT_OFFSET(id)) != RT_REGS__ID__VALUE_reset)
    throw Error("rtl core: no Retrace core behind these registers");
  const std::uint32_t version = device.read_register(RT_OFFSET(version));
  if (RT_FIELD(version, VERSION__CORE) != RT_REGS__VERSION__CORE_reset)
    throw Error("rtl core: register map of version " + std::to_string(RT_FIELD(version, VERSION__CORE)) +
                ", expected " + std::to_string(RT_REGS__VERSION__CORE_reset));
  const std::uint32_t image_version = RT_FIELD(version, VERSION__IMAGE);
  if (image_version == static_cast<std::uint32_t>(contract::kImageVersionTwoLevels))
    identity_.levels = 2;
  else if (image_version != static_cast<std::uint32_t>(contract::kImageVersion))
    throw Error("rtl core: reads memory images of another version");
  const std::uint32_t build = device.read_register(RT_OFFSET(build));
  identity_.lanes = static_cast<int>(RT_FIELD(build, BUILD__LANES));
  identity_.contexts = static_cast<int>(RT_FIELD(build, BUILD__CONTEXTS));
  identity_.data_bytes = static_cast<int>(RT_FIELD(build, BUILD__DATA_BYTES));
  identity_.pixels = RT_FIELD(device.read_register(RT_OFFSET(features)), FEATURES__PIXELS) != 0;
  identity_.mail_entries = static_cast<int>(RT_FIELD(build, BUILD__MAIL_ENTRIES));
}

void CoreDriver::load(std::span<const std::uint64_t> image_words, std::uint64_t most_rays, std::uint64_t ray_offset) {
  load_at(image_words, most_rays, {.rays = ray_offset * contract::kRayBytes});
}

void CoreDriver::load_at(std::span<const std::uint64_t> image_words, std::uint64_t most_rays,
                         const Placement& placement) {
  constexpr std::uint64_t kImageUnit = 64, kRayUnit = 32, kHitUnit = 16, kSpare = 8;
  if (placement.image % kImageUnit != 0 || placement.rays % kRayUnit != 0 || placement.hits % kHitUnit != 0)
    throw Error("rtl core: no register can name this place of image, rays or hits");
  device_.release_all();
  image_lines_ = image_words.size() / 8;
  image_address_ =
      device_.allocate(placement.image + std::max<std::uint64_t>(image_words.size() * 8, 64)) + placement.image;
  ray_address_ = device_.allocate(placement.rays + most_rays * contract::kRayBytes + kSpare) + placement.rays;
  hit_address_ = device_.allocate(placement.hits + most_rays * contract::kHitBytes + kSpare) + placement.hits;
  most_rays_ = most_rays;
  device_.write_memory(image_address_, image_words);
}

void CoreDriver::start(std::span<const std::uint64_t> ray_words, const CoreMode& mode) {
  rays_ = ray_words.size() * 8 / contract::kRayBytes;
  if (rays_ > most_rays_) throw Error("rtl core: more rays than load() made room for");
  device_.write_memory(ray_address_, ray_words);
  device_.write_memory(hit_address_, std::vector<std::uint64_t>(2 * rays_, kUnwritten));
  const auto address = [&](std::uint32_t low, std::uint64_t value) {
    device_.write_register(low, static_cast<std::uint32_t>(value));
    device_.write_register(low + 4, static_cast<std::uint32_t>(value >> 32));
  };
  address(RT_OFFSET(image_base_lo), image_address_);
  address(RT_OFFSET(ray_base_lo), ray_address_);
  address(RT_OFFSET(hit_base_lo), hit_address_);
  device_.write_register(RT_OFFSET(image_lines), static_cast<std::uint32_t>(image_lines_));
  device_.write_register(RT_OFFSET(ray_count), static_cast<std::uint32_t>(rays_));
  device_.write_register(RT_OFFSET(ray_row), mode.ray_row);
  device_.write_register(RT_OFFSET(step_limit), mode.step_limit);
  std::uint32_t control = RT_REGS__CONTROL__START_bm | RT_REGS__CONTROL__IRQ_ENABLE_bm;
  if (mode.parent_links) control |= RT_REGS__CONTROL__PARENT_LINKS_bm;
  if (mode.mailbox) control |= RT_REGS__CONTROL__USE_MAILBOX_bm;
  if (mode.own_step_limit) control |= RT_REGS__CONTROL__OWN_STEP_LIMIT_bm;
  device_.write_register(RT_OFFSET(control), control);
}

void CoreDriver::load_pictures(std::span<const std::uint64_t> image_words, const ShadeTable& table,
                               std::uint64_t pixel_bytes) {
  device_.release_all();
  image_lines_ = image_words.size() / 8;
  image_address_ = device_.allocate(std::max<std::uint64_t>(image_words.size() * 8, 64));
  // Reads are whole granules, which may end behind the last record.
  material_address_ = device_.allocate(table.words.size() * 8 + 64);
  pixel_bytes_ = (pixel_bytes + 63) / 64 * 64;
  for (std::uint64_t& address : frame_address_) address = device_.allocate(pixel_bytes_ + 64);
  materials_ = table.size();
  instances_ = table.instances;
  device_.write_memory(image_address_, image_words);
  device_.write_memory(material_address_, table.words);
}

void CoreDriver::start_picture(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                               const CoreMode& mode) {
  const std::size_t back = static_cast<std::size_t>(1 - status().front);
  device_.write_memory(frame_address_[back], std::vector<std::uint64_t>(pixel_bytes_ / 8, kUnwritten));
  rays_ = std::uint64_t{frame.width} * frame.height << frame.samples;
  const auto words = [&](std::uint32_t offset, const auto& record) {
    std::array<std::uint64_t, std::remove_cvref_t<decltype(record)>::kWords> packed{};
    record.pack(packed.data());
    for (std::uint32_t i = 0; i < 2 * packed.size(); ++i)
      device_.write_register(offset + 4 * i, static_cast<std::uint32_t>(packed[i / 2] >> 32 * (i % 2)));
  };
  words(RT_OFFSET(pictures.frame), frame);
  words(RT_OFFSET(pictures.camera), camera);
  const auto address = [&](std::uint32_t low, std::uint64_t value) {
    device_.write_register(low, static_cast<std::uint32_t>(value));
    device_.write_register(low + 4, static_cast<std::uint32_t>(value >> 32));
  };
  address(RT_OFFSET(image_base_lo), image_address_);
  address(RT_OFFSET(pictures.material_base_lo), material_address_);
  address(RT_OFFSET(pictures.frame_base_0_lo), frame_address_[0]);
  address(RT_OFFSET(pictures.frame_base_1_lo), frame_address_[1]);
  device_.write_register(RT_OFFSET(pictures.material_count), static_cast<std::uint32_t>(materials_));
  device_.write_register(RT_OFFSET(pictures.instance_count), static_cast<std::uint32_t>(instances_));
  device_.write_register(RT_OFFSET(image_lines), static_cast<std::uint32_t>(image_lines_));
  device_.write_register(RT_OFFSET(step_limit), mode.step_limit);
  std::uint32_t control = RT_REGS__CONTROL__START_bm | RT_REGS__CONTROL__IRQ_ENABLE_bm | RT_REGS__CONTROL__ON_CHIP_bm;
  if (mode.parent_links) control |= RT_REGS__CONTROL__PARENT_LINKS_bm;
  if (mode.mailbox) control |= RT_REGS__CONTROL__USE_MAILBOX_bm;
  if (mode.own_step_limit) control |= RT_REGS__CONTROL__OWN_STEP_LIMIT_bm;
  device_.write_register(RT_OFFSET(control), control);
}

void CoreDriver::picture(std::span<std::uint64_t> words) {
  device_.read_memory(frame_address_[static_cast<std::size_t>(status().front)], words);
}

void CoreDriver::wait(std::uint64_t most_clocks, const std::function<void(std::uint64_t)>& progress) {
  const std::uint64_t limit = device_.clocks() + most_clocks;
  while (!device_.wait_interrupt()) {
    if (progress) progress(device_.read_register(RT_OFFSET(counters.rays)));
    if (device_.clocks() > limit) {
      const CoreCounters c = counters();
      throw Error("rtl core: not done after " + std::to_string(most_clocks) + " clocks: " + std::to_string(c.rays) +
                  " of " + std::to_string(rays_) + " rays finished, " + std::to_string(c.down) + " steps down, " +
                  std::to_string(c.leaf) + " leaves, " + std::to_string(c.tests) + " tests, misses " +
                  std::to_string(c.node_misses) + " node " + std::to_string(c.leaf_misses) + " leaf " +
                  std::to_string(c.list_misses) + " list " + std::to_string(c.triangle_misses) + " triangle, " +
                  std::to_string(c.read_beats) + " beats read");
    }
  }
  if (progress) progress(rays_);
}

void CoreDriver::hits(std::span<std::uint64_t> words) { device_.read_memory(hit_address_, words); }

CoreStatus CoreDriver::status() {
  const std::uint32_t value = device_.read_register(RT_OFFSET(status));
  CoreStatus status;
  status.busy = RT_FIELD(value, STATUS__BUSY) != 0;
  status.done = RT_FIELD(value, STATUS__DONE) != 0;
  status.image_fault = static_cast<int>(RT_FIELD(value, STATUS__IMAGE_FAULT));
  status.ray_fault = RT_FIELD(value, STATUS__RAY_FAULT) != 0;
  status.write_fault = RT_FIELD(value, STATUS__WRITE_FAULT) != 0;
  status.first_fault = RT_FIELD(value, STATUS__FIRST_FAULT);
  status.frame_fault = RT_FIELD(value, STATUS__FRAME_FAULT) != 0;
  status.camera_fault = RT_FIELD(value, STATUS__CAMERA_FAULT) != 0;
  status.material_fault = RT_FIELD(value, STATUS__MATERIAL_FAULT) != 0;
  status.front = static_cast<int>(RT_FIELD(value, STATUS__FRONT));
  status.fault_ray = device_.read_register(RT_OFFSET(fault_ray));
  status.write_fault_ray = device_.read_register(RT_OFFSET(write_fault_ray));
  return status;
}

CoreCounters CoreDriver::counters() {
  CoreCounters c;
#define RT_COUNTER(name) c.name = device_.read_register(RT_OFFSET(counters.name))
  RT_COUNTER(clocks);
  RT_COUNTER(rays);
  RT_COUNTER(faults);
  RT_COUNTER(down);
  RT_COUNTER(up);
  RT_COUNTER(leaf);
  RT_COUNTER(tests);
  RT_COUNTER(skipped);
  RT_COUNTER(node_hits);
  RT_COUNTER(node_misses);
  RT_COUNTER(leaf_hits);
  RT_COUNTER(leaf_misses);
  RT_COUNTER(list_hits);
  RT_COUNTER(list_misses);
  RT_COUNTER(triangle_hits);
  RT_COUNTER(triangle_misses);
  RT_COUNTER(read_beats);
  RT_COUNTER(write_beats);
  RT_COUNTER(context_clocks);
  RT_COUNTER(entries);
  RT_COUNTER(entry_passed);
  RT_COUNTER(entry_refused);
  RT_COUNTER(entry_blocked);
#undef RT_COUNTER
  // A unit that is neither busy nor starved is blocked: no counter of its own. Modulo 2^32, as the counters are.
#define RT_UNIT(member, name, units)                                            \
  c.member.busy = device_.read_register(RT_OFFSET(counters.name##_busy));       \
  c.member.starved = device_.read_register(RT_OFFSET(counters.name##_starved)); \
  c.member.blocked = static_cast<std::uint32_t>(c.clocks * (units)-c.member.busy - c.member.starved)
  RT_UNIT(lanes, lane, static_cast<std::uint64_t>(identity_.lanes));
  RT_UNIT(leaf_unit, leaf, 1);
  RT_UNIT(references, reference, 1);
  RT_UNIT(tri_test, test, 1);
  RT_UNIT(results, result, 1);
  RT_UNIT(bus, bus, 1);
#undef RT_UNIT
  return c;
}

void CoreDriver::soft_reset() {
  device_.write_register(RT_OFFSET(control), RT_REGS__CONTROL__SOFT_RESET_bm);
  for (std::uint32_t i = 0; i < kPollLimit; ++i) {
    if (!RT_FIELD(device_.read_register(RT_OFFSET(status)), STATUS__BUSY)) return;
  }
  throw Error("rtl core: soft reset does not end");
}

}  // namespace retrace::cosim
