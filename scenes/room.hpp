// The furnished room, the scene to look at.
#pragma once
#include <cstdint>

#include "golden/scene/scene.hpp"

namespace retrace {

/// A closed room of about 230,000 * detail triangles, metres, y up: every curved thing is cut finer with sqrt(detail).
Scene make_room(double detail, std::uint64_t seed);

}  // namespace retrace
