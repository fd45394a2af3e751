// Factories of all structures of the lab. Each is implemented in the file named beside it.
#pragma once
#include <memory>
#include <vector>

#include "accel.hpp"
#include "golden/tree/memory_image.hpp"

namespace retrace::accel {

/// Work of a build, for tests of its complexity: references and boxes of the grids, boxes put into bins, children weighed.
struct BuildSteps {
  std::uint64_t steps = 0;
};

// All structures keep a reference to the set (and to the tree or image they walk): it must outlive them.

/// brute_force.cpp: every triangle, every ray. What is true.
std::unique_ptr<Structure> make_brute_force(const TriangleSet& set);

// ------------------------------------------------------------------------------------------ uniform grid (grid.cpp)
enum class GridDensity {
  kWoo,    ///< voxels are halved along their longest side until occupied ones hold 20 triangles on average
  kPharr,  ///< 3 cbrt(N) voxels along the longest side of the scene, cubes; references by bounding box, as in the book
  kPharrExact,  ///< the same resolution; references from the voxels that the triangle itself touches
};
/// At most 64 voxels and 16 references a triangle: where the density asks for more, the grid is coarser.
std::unique_ptr<Structure> make_grid(const TriangleSet& set, GridDensity density, BuildSteps* steps = nullptr);

/// What stands in which voxel: voxel (x, y, z) has references offsets[v] .. offsets[v + 1] - 1, v = (z ny + y) nx + x.
struct VoxelLists {
  glm::ivec3 resolution{1};
  std::vector<std::uint32_t> offsets, references;
};
/// Voxels on each axis of the grid kPharrExact.
glm::ivec3 grid_resolution(const TriangleSet& set);
/// Triangles in each voxel (widened by kMargin) of a grid over the set's box; of a lower resolution where that one takes too many references.
VoxelLists list_voxels(const TriangleSet& set, const glm::ivec3& resolution);

// ---------------------------------------------------------------------------- kd-tree, over the memory image (kd.cpp)
enum class KdTraversal {
  kStack,           ///< near child first, far child on a stack
  kShortStack,      ///< the same with few entries; restarts when an entry was lost (Horn et al. 2007)
  kRestart,         ///< from the root after every leaf (Foley & Sugerman 2005)
  kBacktrackBoxes,  ///< up by parent links to the first node whose box the ray has not left (Foley & Sugerman 2005)
  kBacktrackPlane,  ///< up by parent links to the ancestor whose split is the plane the ray left through
  kFaceLinks,       ///< straight to that ancestor's far child, by a link of the leaf
};
class KdTree;
/// Decodes the image of the same scene once; traversals share it.
std::shared_ptr<const KdTree> decode_kd(const MemoryImage& image, const TriangleSet& set);
/// `entries`: of the short stack, at least 1.
std::unique_ptr<Structure> make_kd(std::shared_ptr<const KdTree> tree, KdTraversal traversal, int entries = 0);

// --------------------------------------------------------------------------------- bounding volume hierarchies
// (bvh*.cpp)
enum class BvhBuilder {
  kBinnedSah,        ///< bvh_binned_sah.cpp, Wald 2007
  kKayKajiya,        ///< bvh_kay_kajiya.cpp, median cut, one triangle a leaf, 1986
  kGoldsmithSalmon,  ///< bvh_goldsmith_salmon.cpp, incremental insertion, 1987
};
enum class BvhTraversal {
  kStack,      ///< ordered by entry distance
  kHeap,       ///< Kay & Kajiya's: always the nearest volume of all
  kStackless,  ///< parent links, three states (Hapala et al. 2011)
};
class Bvh;
/// `slabs`: pairs of planes a volume, 3 to 7 (3: boxes).
std::shared_ptr<const Bvh> build_bvh(const TriangleSet& set, BvhBuilder builder, int slabs = 3,
                                     BuildSteps* steps = nullptr);
std::unique_ptr<Structure> make_bvh(std::shared_ptr<const Bvh> bvh, BvhTraversal traversal);

}  // namespace retrace::accel
