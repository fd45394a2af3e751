#include "test_rays.hpp"

#include <algorithm>
#include <cmath>

namespace retrace {
namespace {

constexpr std::int32_t kLongest = (1 << contract::kTLimitBits) - 1;

glm::dvec3 unit_vector(Random& random) {
  while (true) {
    const glm::dvec3 v{random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)};
    const double length = glm::length(v);
    if (length > 0.01 && length <= 1.0) return v / length;
  }
}

class Maker {
 public:
  Maker(const GridScene& scene, const MemoryImage* image, Random& random)
      : scene_(scene), image_(image), random_(random) {}

  GridPoint inside() {
    GridPoint p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = random_.integer(scene_.box[2 * axis], scene_.box[2 * axis + 1]);
    return p;
  }
  GridPoint on_surface() {
    GridPoint p = inside();
    const auto face = random_.below(6);
    p[face / 2] = scene_.box[face];
    return p;
  }
  const GridTriangle* triangle() {
    return scene_.triangles.empty() ? nullptr : &scene_.triangles[random_.below(scene_.triangles.size())];
  }
  glm::dvec3 vertex() {
    const GridTriangle* t = triangle();
    return t ? glm::dvec3(t->vertices[random_.below(3)]) : glm::dvec3(inside());
  }
  glm::dvec3 edge_point() {
    const GridTriangle* t = triangle();
    if (!t) return inside();
    const auto i = random_.below(3);
    return glm::mix(glm::dvec3(t->vertices[i]), glm::dvec3(t->vertices[(i + 1) % 3]), random_.real(0, 1));
  }

  GridRay ray(const GridPoint& origin, const glm::dvec3& direction) {
    GridRay result;
    const double length = glm::length(direction);
    if (length == 0.0) return ray(origin, {0.0, 0.0, 1.0});
    constexpr double kUnit = 1 << contract::kDirectionFrac;
    for (int axis = 0; axis < 3; ++axis) {
      result.record.origin[axis] = origin[axis];
      result.record.direction[axis] =
          static_cast<std::int32_t>(std::clamp(std::floor(direction[axis] / length * kUnit + 0.5), -kUnit, kUnit - 1));
    }
    result.record.t_max = kLongest;
    return result;
  }
  GridRay at(const GridPoint& origin, const glm::dvec3& target) { return ray(origin, target - glm::dvec3(origin)); }

  GridRay make(RayKind kind) {
    switch (kind) {
      case RayKind::kThrough:
        return at(on_surface(), inside());
      case RayKind::kInside:
        return ray(inside(), unit_vector(random_));
      case RayKind::kVertex:
        return at(random_.chance(2) ? inside() : on_surface(), vertex());
      case RayKind::kEdge:
        return at(random_.chance(2) ? inside() : on_surface(), edge_point());
      case RayKind::kAxis: {
        const auto axis = static_cast<int>(random_.below(3));
        GridPoint origin = random_.chance(2) ? GridPoint(vertex()) : inside();
        const bool up = random_.chance(2);
        if (random_.chance(2)) origin[axis] = scene_.box[2 * axis + (up ? 0 : 1)];
        glm::dvec3 direction{0.0};
        direction[axis] = up ? 1.0 : -1.0;
        return ray(origin, direction);
      }
      case RayKind::kSplitPlane: {
        GridPoint origin = random_.chance(2) ? GridPoint(vertex()) : inside();
        glm::dvec3 direction = unit_vector(random_);
        const auto pair = image_->pair(random_.below(image_->header().pair_count));
        const auto axis = static_cast<int>(pair.left_axis);
        if (axis != contract::kAxisLeaf) {
          origin[axis] = pair.left_split;
          direction[axis] = 0.0;
        }
        return ray(origin, direction);
      }
      case RayKind::kFar: {
        const glm::dvec3 away = unit_vector(random_) * std::pow(10.0, random_.real(0.5, 6.0));
        const glm::dvec3 target = glm::dvec3(inside()) / static_cast<double>(1 << contract::kPositionFrac);
        WorldRay world;
        world.origin = scene_.transform.to_world(target + away);
        world.direction = scene_.transform.to_world(target) - world.origin;
        return quantise(world, scene_.transform, scene_.box, false);
      }
      case RayKind::kFlat: {
        glm::dvec3 direction = unit_vector(random_);
        direction[static_cast<int>(random_.below(3))] = 0.0;
        return ray(random_.chance(2) ? GridPoint(vertex()) : inside(), direction);
      }
      default: {
        GridRay result = ray(inside(), unit_vector(random_));
        const auto axis = random_.below(3);
        result.record.direction[axis] = static_cast<std::int32_t>(random_.integer(-4, 4));
        return result;
      }
    }
  }

 private:
  const GridScene& scene_;
  const MemoryImage* image_;
  Random& random_;
};

}  // namespace

std::vector<GridRay> make_test_rays(const GridScene& scene, const MemoryImage& image, std::size_t count,
                                    Random& random) {
  Maker maker(scene, &image, random);
  std::vector<GridRay> rays;
  rays.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    GridRay ray = maker.make(static_cast<RayKind>(i % static_cast<std::size_t>(RayKind::kCount)));
    if (random.chance(8)) ray.record.any = 1;
    if (random.chance(8)) ray.record.t_max = static_cast<std::uint32_t>(random.integer(0, 3 << contract::kTLimitFrac));
    rays.push_back(ray);
  }
  return rays;
}

std::vector<GridRay> make_edge_rays(const GridScene& scene, const GridPoint& origin, std::size_t count,
                                    Random& random) {
  Maker maker(scene, nullptr, random);
  std::vector<GridRay> rays;
  rays.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    rays.push_back(maker.at(origin, i % 4 == 0 ? maker.vertex() : maker.edge_point()));
  return rays;
}

}  // namespace retrace
