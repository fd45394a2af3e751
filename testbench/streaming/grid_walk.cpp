// See grid_walk.hpp.
#include "grid_walk.hpp"

#include <algorithm>

#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_inputs.hpp"

namespace retrace {

GridWalk walk_grid(const accel::GridImage& image, const std::array<std::int32_t, 6>& box,
                   const contract::RayRecord& record, std::vector<GridRead>* reads) {
  const contract::GridHeaderRecord& grid = image.header();
  contract::RaySetupInRecord in;
  in.origin = record.origin;
  in.direction = record.direction;
  in.t_max = record.t_max;
  in.any = record.any;
  in.box = box;
  const contract::RaySetupOutRecord ray = reference::ray_setup(in);

  GridWalk walk;
  contract::HitFinishInRecord best;
  best.status = contract::kStatusMiss;
  best.t = record.t_max;
  best.id = contract::kNoTriangle;
  const auto finish = [&](std::uint32_t status) {
    best.status = status;
    walk.hit = reference::hit_finish(best);
    return walk;
  };
  if (!ray.valid) return finish(contract::kStatusBadRay);

  std::array<std::int64_t, 3> voxel, leave{};
  const auto plane_t = [&](int axis) {
    const std::int64_t plane = grid.lower[axis] + (voxel[axis] + (ray.negative[axis] ? 0 : 1)) * grid.side[axis];
    return reference::t_plane(plane, ray.origin[axis], ray.reciprocal[axis], ray.shift[axis]);
  };
  for (int axis = 0; axis < 3; ++axis) {
    voxel[axis] = std::clamp<std::int64_t>((std::int64_t{ray.origin[axis]} - grid.lower[axis]) / grid.side[axis], 0,
                                           grid.resolution[axis] - 1);
    leave[axis] = plane_t(axis);
  }
  bool found = false;
  for (;;) {
    ++walk.voxels;
    if (reads != nullptr)
      reads->push_back(read_of_voxel(grid, {static_cast<std::uint32_t>(voxel[0]), static_cast<std::uint32_t>(voxel[1]),
                                            static_cast<std::uint32_t>(voxel[2])}));
    const std::uint32_t first = image.voxel((voxel[2] * grid.resolution[1] + voxel[1]) * grid.resolution[0] + voxel[0]);
    if (first != contract::kGridEmpty) {
      for (std::uint32_t i = first;; ++i) {
        const std::uint32_t entry = image.list(i), last = entry >> contract::kGridLastLog2;
        ++walk.tests;
        if (reads != nullptr) {
          reads->push_back(read_of_list(grid, i));
          reads->push_back(read_of_triangle(grid, entry & ~(last << contract::kGridLastLog2)));
        }
        const contract::TriTestOutRecord hit =
            reference::tri_test(tri_test_in(image.triangle(entry & ~(last << contract::kGridLastLog2)), ray));
        if (hit.hit && (hit.t < best.t || (hit.t == best.t && hit.id < best.id))) {
          found = true;
          best.t = hit.t;
          best.id = hit.id;
          best.edge_u = hit.edge_u;
          best.edge_v = hit.edge_v;
          best.dz = hit.dz;
          best.exponent_u = hit.exponent_u;
          best.exponent_v = hit.exponent_v;
          if (ray.any) return finish(contract::kStatusHit);
        }
        if (last) break;
      }
    }
    int axis = -1;
    for (int a = 0; a < 3; ++a)
      if (!ray.zero[a] && (axis < 0 || leave[a] < leave[axis])) axis = a;
    voxel[axis] += ray.negative[axis] ? -1 : 1;
    if (voxel[axis] < 0 || voxel[axis] >= grid.resolution[axis] || best.t <= leave[axis]) break;
    leave[axis] = plane_t(axis);
  }
  return finish(found ? contract::kStatusHit : contract::kStatusMiss);
}

}  // namespace retrace
