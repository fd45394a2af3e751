// Flattening and snapping. Both run in parallel and give the same result for any number of threads: every triangle is
// computed on its own, and the only reductions are minima and maxima.
#include "golden/scene/geometry.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "golden/scene/bounds.hpp"
#include "hls/include/contract.hpp"

namespace retrace {
namespace {

constexpr int kPositionFrac = 24;
constexpr double kOne = double(1 << kPositionFrac);  // code of 1.0

/// One primitive of one instance.
struct Part {
  std::uint32_t node, mesh, primitive;
  std::size_t first;  // its first world triangle
};

std::string describe(const Scene& scene, const Part& part) {
  const auto quoted = [](const std::string& name) { return name.empty() ? std::string() : " '" + name + "'"; };
  return "node " + std::to_string(part.node) + quoted(scene.nodes[part.node].name) + ", mesh " +
         std::to_string(part.mesh) + quoted(scene.meshes[part.mesh].name) + ", primitive " +
         std::to_string(part.primitive);
}

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Of zero area whatever the scale, so such a triangle has no say in the scale: two vertices at the same place, or all
/// on a line as far as doubles can tell.
bool collapsed(const std::array<glm::dvec3, 3>& t) {
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return true;
  const auto largest = [](const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
  const glm::dvec3 a = t[1] * 0.5 - t[0] * 0.5, b = t[2] * 0.5 - t[0] * 0.5;
  const double size_a = largest(a), size_b = largest(b);
  if (!(size_a > 0 && size_b > 0)) return true;
  return largest(glm::cross(a / size_a, b / size_b)) <= 0x1p-50;
}

bool has_area(const std::array<GridPoint, 3>& t) {
  using Wide = glm::vec<3, std::int64_t>;
  const Wide a = Wide(t[1]) - Wide(t[0]), b = Wide(t[2]) - Wide(t[0]);  // below 2^26 each: products below 2^52
  return a.y * b.z != a.z * b.y || a.z * b.x != a.x * b.z || a.x * b.y != a.y * b.x;
}

}  // namespace

WorldTriangles flatten(const Scene& scene) {
  const std::vector<glm::dmat4> world = scene.mesh_transforms();
  std::vector<Part> parts;
  std::size_t total = 0;
  for (const std::uint32_t node : scene.reachable()) {
    const std::uint32_t mesh = scene.nodes[node].mesh;
    if (mesh == kNone) continue;
    if (mesh >= scene.meshes.size())
      throw Error("node " + std::to_string(node) + ": there is no mesh " + std::to_string(mesh));
    for (std::uint32_t p = 0; p < scene.meshes[mesh].primitives.size(); ++p) {
      const std::size_t count = scene.meshes[mesh].primitives[p].triangles.size();
      if (count == 0) continue;
      parts.push_back({node, mesh, p, total});
      total += count;
      if (total > kMaxWorldTriangles)
        throw Error(scene.name + ": more than " + std::to_string(kMaxWorldTriangles) +
                    " triangles, instances counted (" + describe(scene, parts.back()) + ")");
    }
  }

  WorldTriangles out;
  out.vertices.resize(total);
  out.sources.resize(total);
  // The first bad triangle is reported, whichever thread finds one first.
  struct Bad {
    std::size_t triangle = std::numeric_limits<std::size_t>::max();
  };
  const auto convert = [&](const tbb::blocked_range<std::size_t>& range, Bad bad) {
    // Part that holds the range's first triangle: the last that starts at or before it.
    std::size_t k =
        static_cast<std::size_t>(std::upper_bound(parts.begin(), parts.end(), range.begin(),
                                                  [](std::size_t i, const Part& p) { return i < p.first; }) -
                                 parts.begin()) -
        1;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      while (k + 1 < parts.size() && parts[k + 1].first <= i) ++k;
      const Part& part = parts[k];
      const Primitive& primitive = scene.meshes[part.mesh].primitives[part.primitive];
      const glm::uvec3 corners = primitive.triangles[i - part.first];
      const glm::dmat4& m = world[part.node];
      out.sources[i] = {part.node, part.mesh, part.primitive, static_cast<std::uint32_t>(i - part.first)};
      for (int c = 0; c < 3; ++c) {
        glm::dvec3& p = out.vertices[i][static_cast<std::size_t>(c)];
        p = corners[c] < primitive.positions.size()
                ? glm::dvec3(m * glm::dvec4(glm::dvec3(primitive.positions[corners[c]]), 1.0))
                : glm::dvec3(std::numeric_limits<double>::quiet_NaN());
        if (!finite(p)) bad.triangle = std::min(bad.triangle, i);
      }
    }
    return bad;
  };
  const Bad bad = tbb::parallel_reduce(tbb::blocked_range<std::size_t>(0, total, 4096), Bad{}, convert,
                                       [](Bad a, Bad b) { return a.triangle < b.triangle ? a : b; });
  if (bad.triangle < total) {
    const TriangleSource& source = out.sources[bad.triangle];
    const Primitive& primitive = scene.meshes[source.mesh].primitives[source.primitive];
    const glm::uvec3 corners = primitive.triangles[source.triangle];
    int c = 0;
    while (finite(out.vertices[bad.triangle][static_cast<std::size_t>(c)])) ++c;
    const std::string where = scene.name + ": " + describe(scene, {source.node, source.mesh, source.primitive, 0}) +
                              ", vertex " + std::to_string(corners[c]);
    throw Error(corners[c] < primitive.positions.size() ? where + ": the world position is not finite"
                                                        : where + ": there is no such vertex");
  }
  return out;
}

std::optional<PlacedTriangle> find_placed(const GridScene& scene, std::uint32_t id) {
  if (!scene.two_levels) {
    const GridTriangle* found = find_triangle(scene.triangles, id);
    return found ? std::optional(PlacedTriangle{found, {}}) : std::nullopt;
  }
  const auto next = std::ranges::upper_bound(scene.instances, id, {},
                                             [](const GridInstance& instance) { return instance.record.first_id; });
  if (next == scene.instances.begin()) return std::nullopt;
  const auto place = static_cast<std::size_t>(next - scene.instances.begin()) - 1;
  const contract::InstanceRecord& record = scene.instances[place].record;
  const GridTriangle* found = find_triangle(scene.objects[record.root].triangles, id - record.first_id);
  return found ? std::optional(PlacedTriangle{found, place}) : std::nullopt;
}

std::uint64_t placed_triangles(const GridScene& scene) {
  std::uint64_t sum = scene.triangles.size();
  for (const GridInstance& instance : scene.instances) sum += scene.objects[instance.record.root].triangles.size();
  return sum;
}

GridScene snap(const WorldTriangles& world, double side, double most) {
  const std::size_t count = world.vertices.size();
  const Bounds bounds = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, count, 4096), Bounds{},
      [&](const tbb::blocked_range<std::size_t>& range, Bounds b) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          if (collapsed(world.vertices[i])) continue;
          for (const glm::dvec3& p : world.vertices[i]) b.add(p);
        }
        return b;
      },
      [](Bounds a, const Bounds& b) {
        a.add(b.lower);
        a.add(b.upper);
        return a;
      });

  GridScene out;
  if (!bounds.empty()) {
    // Halves first: the difference of two finite numbers can overflow.
    out.transform.center = bounds.lower * 0.5 + bounds.upper * 0.5;
    const glm::dvec3 extent = glm::max(bounds.upper - out.transform.center, out.transform.center - bounds.lower);
    const double half = std::max({extent.x, extent.y, extent.z});
    // One code is left beside the pad, so rounding cannot take the padded box out of reach. Where the reciprocal
    // overflows, the scene is smaller than 2^-1000 of its units: it shrinks to a point, as it does when half is 0.
    const double scale = std::min((side * kOne - contract::kBoxPad - 1) / kOne / half, most);
    out.transform.scale = std::isfinite(scale) ? scale : 1.0;
  }

  std::vector<std::array<GridPoint, 3>> codes(count);
  std::vector<std::uint8_t> keep(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 4096), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      if (collapsed(world.vertices[i])) continue;
      for (std::size_t c = 0; c < 3; ++c)
        codes[i][c] = GridPoint(glm::floor(out.transform.to_grid(world.vertices[i][c]) * kOne + 0.5));
      keep[i] = has_area(codes[i]);
    }
  });

  GridPoint lower(std::numeric_limits<std::int32_t>::max()), upper(std::numeric_limits<std::int32_t>::min());
  out.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!keep[i]) continue;
    out.triangles.push_back({codes[i], static_cast<std::uint32_t>(i)});
    for (const GridPoint& p : codes[i]) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
  }
  out.degenerate = static_cast<std::uint32_t>(count - out.triangles.size());
  if (out.triangles.empty()) lower = upper = GridPoint(0);
  for (int a = 0; a < 3; ++a) {
    out.box[static_cast<std::size_t>(2 * a)] = lower[a] - static_cast<std::int32_t>(contract::kBoxPad);
    out.box[static_cast<std::size_t>(2 * a + 1)] = upper[a] + static_cast<std::int32_t>(contract::kBoxPad);
  }
  return out;
}

}  // namespace retrace
