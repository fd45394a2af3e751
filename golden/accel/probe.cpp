// Construction of mailboxes, clipped rays and triangle sets.
#include "probe.hpp"

#include <stdexcept>

namespace retrace::accel {

Mailbox::Mailbox(int entries, std::size_t triangles) : entries_(entries) {
  if (entries == kExact) {
    stamps_.assign(triangles, 0);
  } else if (entries < 0 || entries > 64 || (entries & (entries - 1)) != 0 || entries == 1) {
    throw std::invalid_argument("mailbox entries: exact, 0, or a power of two from 2 to 64");
  }
  mask_ = entries > 0 ? static_cast<std::uint32_t>(entries - 1) : 0;
}

ClippedRay::ClippedRay(const Ray& ray, const Box& box) : inverse(1.0 / ray.direction) {
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0.0) {
      if (ray.origin[a] < box.lower[a] || ray.origin[a] > box.upper[a]) ok = false;
      continue;
    }
    const double t0 = (box.lower[a] - ray.origin[a]) * inverse[a], t1 = (box.upper[a] - ray.origin[a]) * inverse[a];
    t_min = std::max(t_min, std::min(t0, t1));
    t_max = std::min(t_max, std::max(t0, t1));
  }
  if (!(t_min <= t_max)) ok = false;
}

TriangleSet from_grid(const GridScene& scene) {
  TriangleSet set;
  set.triangles.reserve(scene.triangles.size());
  for (const GridTriangle& g : scene.triangles) {
    Triangle t;
    for (int k = 0; k < 3; ++k) t.vertices[k] = glm::dvec3(g.vertices[k]) * 0x1p-24;
    t.id = g.id;
    set.triangles.push_back(t);
  }
  for (int a = 0; a < 3; ++a) {
    set.box.lower[a] = scene.box[2 * a] * 0x1p-24;
    set.box.upper[a] = scene.box[2 * a + 1] * 0x1p-24;
  }
  return set;
}

TriangleSet make_triangle_set(std::vector<Triangle> triangles) {
  TriangleSet set{std::move(triangles), {}};
  for (const Triangle& t : set.triangles) set.box.add(t.box());
  if (set.box.empty()) set.box.lower = set.box.upper = glm::dvec3(0.0);
  const double pad = contract::kBoxPad * 0x1p-24;
  set.box.lower -= pad, set.box.upper += pad;
  return set;
}

}  // namespace retrace::accel
