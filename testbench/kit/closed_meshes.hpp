// Closed meshes on the position grid, star-shaped about their centre, and rays from inside that go exactly through edges and vertices.
#pragma once
#include <string>
#include <vector>

#include "golden/engine/engine.hpp"
#include "random.hpp"

namespace retrace {

/// `kind`: box (axis-parallel, each face divided), sphere, random (a sphere with random radii), sliver (such a mesh squeezed by up to 2^10
/// on one axis and 2^5 on another, then turned). Throws Error for any other. `cells`: squares along an edge of a face.
GridScene make_closed_mesh(const std::string& kind, int cells, Random& random);

/// A point inside a mesh of make_closed_mesh.
GridPoint inside_closed_mesh(const GridScene& scene, Random& random);

/// Rays whose line contains a vertex or the middle of an edge, to the last bit: the direction is the difference of the codes times a power
/// of two, so it has no unit length (golden does not need one; the kernels do).
std::vector<GridRay> make_exact_edge_rays(const GridScene& scene, const GridPoint& origin, std::size_t count,
                                          Random& random);

}  // namespace retrace
