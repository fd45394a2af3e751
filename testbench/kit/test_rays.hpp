// Rays that look for trouble: along axes, in split planes, through vertices and edges, from inside, from far outside.
#pragma once
#include <vector>

#include "golden/engine/engine.hpp"
#include "random.hpp"

namespace retrace {

/// Kinds of ray that make_test_rays mixes.
enum class RayKind {
  kThrough,     ///< from the box's surface to a point inside
  kInside,      ///< from a point inside, any direction
  kVertex,      ///< at a vertex
  kEdge,        ///< at a point of an edge
  kAxis,        ///< two components exactly zero, often through a vertex
  kSplitPlane,  ///< in a split plane, and along it
  kFar,         ///< from up to 10^6 box sizes away
  kFlat,        ///< one component exactly zero
  kTiny,        ///< components of a few units of the last place
  kCount
};

/// `count` rays of all kinds; a part of them any-hit or with a short t_max. `image` must belong to `scene`.
std::vector<GridRay> make_test_rays(const GridScene& scene, const MemoryImage& image, std::size_t count,
                                    Random& random);

/// Rays from `origin` (codes) at points of edges and at vertices of triangles drawn at random.
std::vector<GridRay> make_edge_rays(const GridScene& scene, const GridPoint& origin, std::size_t count, Random& random);

}  // namespace retrace
