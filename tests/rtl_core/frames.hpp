// What the tests of the core share: small frames and what the kernel in C simulation says of them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/sim/core/axi_memory.hpp"

namespace retrace::rtl_core_test {

constexpr std::uint64_t kPatience =
    20000000;  // clocks; more than any of these runs takes, so that a hang ends the test

constexpr int kWidth = 32, kHeight = 24;  // of a frame

struct Prepared {
  GridScene grid;
  MemoryImage image;
  std::vector<GridRay> primary, awkward;
};

/// A scene with primary rays of a small frame, half of them again as any-hit rays, and awkward rays. Made once.
inline const Prepared& prepared(const std::string& name) {
  static std::map<std::string, Prepared> cache;
  auto [it, is_new] = cache.try_emplace(name);
  Prepared& p = it->second;
  if (!is_new) return p;
  const Scene scene = open_scene(name);
  const WorldTriangles world = flatten(scene);
  p.grid = snap(world);
  p.image = build_kd(p.grid);
  const ViewCamera view = default_view(scene, world);
  for (int any = 0; any < 2; ++any)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; x += 1 + any)
        p.primary.push_back(
            quantise(view.ray(x + 0.5, y + 0.5, kWidth, kHeight), p.grid.transform, p.grid.box, any != 0));
  Random random(test_seed());
  p.awkward = make_test_rays(p.grid, p.image, 700, random);
  return p;
}

inline std::vector<std::uint64_t> packed(std::span<const GridRay> rays) {
  std::vector<std::uint64_t> words(contract::RayRecord::kWords * rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i].record.pack(&words[contract::RayRecord::kWords * i]);
  return words;
}

inline std::vector<GridRay> only_inside(std::span<const GridRay> rays) {
  std::vector<GridRay> inside;
  std::copy_if(rays.begin(), rays.end(), std::back_inserter(inside), [](const GridRay& r) { return !r.outside; });
  return inside;
}

inline std::vector<std::uint64_t> csim_hits(std::span<const std::uint64_t> image, std::span<const GridRay> rays,
                                            const TraceOptions& options) {
  auto csim = make_csim_engine(image);
  std::vector<Hit> hits(rays.size());
  csim->trace(rays, hits, {}, options);
  const auto raw = csim->raw_hits();
  return {raw.begin(), raw.end()};
}

inline std::uint32_t status_of(const std::vector<std::uint64_t>& hits, std::size_t ray) {
  return contract::HitRecord::unpack(&hits[2 * ray]).status;
}

inline cosim::MemoryOptions hostile_memory(std::uint64_t seed) {
  cosim::MemoryOptions memory;
  memory.latency_min = 1;
  memory.latency_max = 200;
  memory.reorder = true;
  memory.stall_percent = 20;
  memory.seed = seed;
  return memory;
}

}  // namespace retrace::rtl_core_test
