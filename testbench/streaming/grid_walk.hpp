// The streaming machine once more, in plain integers: what its kernels must give in every bit (hls/streaming/steps.hpp). Independent of them; the
// stages are those of testbench/kit/reference.hpp.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "golden/accel/grid_image.hpp"
#include "golden/contract/contract_records.hpp"

namespace retrace {

/// Where a walk reads: bytes from the image's beginning.
struct GridRead {
  enum Kind { kVoxel, kList, kTriangle } kind;
  std::uint64_t address;
};
inline GridRead read_of_voxel(const contract::GridHeaderRecord& grid, const std::array<std::uint32_t, 3>& voxel) {
  const std::uint64_t number =
      (std::uint64_t{voxel[2]} * grid.resolution[1] + voxel[1]) * grid.resolution[0] + voxel[0];
  return {GridRead::kVoxel, 64 * std::uint64_t{grid.voxel_offset} + 4 * number};
}
inline GridRead read_of_list(const contract::GridHeaderRecord& grid, std::uint32_t entry) {
  return {GridRead::kList, 64 * std::uint64_t{grid.list_offset} + 4 * std::uint64_t{entry}};
}
inline GridRead read_of_triangle(const contract::GridHeaderRecord& grid, std::uint32_t triangle) {
  return {GridRead::kTriangle, 64 * (std::uint64_t{grid.triangle_offset} + triangle)};
}

struct GridWalk {
  contract::HitRecord hit;
  std::uint32_t voxels = 0, tests = 0;
};

/// `reads`: every read of the walk is added. `box`: root box of the scene, outside of which no ray may begin.
GridWalk walk_grid(const accel::GridImage& image, const std::array<std::int32_t, 6>& box,
                   const contract::RayRecord& ray, std::vector<GridRead>* reads = nullptr);

}  // namespace retrace
