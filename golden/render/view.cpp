// Cameras to primary rays.
#include "golden/render/view.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace retrace {
namespace {

bool finite(const glm::dmat4& m) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r])) return false;
  return true;
}

/// Direction of v, also where its square over- or underflows; zero for a zero vector.
glm::dvec3 direction(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest > 0 ? glm::normalize(v / largest) : glm::dvec3(0.0);
}

/// Camera to world without scale and shear: the view axis keeps its direction, then up, then right.
glm::dmat4 orthonormal(const glm::dmat4& m, const std::string& what) {
  const glm::dvec3 back = direction(glm::dvec3(m[2]));
  const glm::dvec3 tilted = direction(glm::dvec3(m[1]));
  const glm::dvec3 up = direction(tilted - back * glm::dot(back, tilted));
  const glm::dvec3 right = glm::cross(up, back);
  const double side = glm::dot(right, glm::dvec3(m[0]));
  if (!finite(m) || !(glm::dot(back, back) > 0.5) || !(glm::dot(up, up) > 0.5) || side == 0)
    throw Error(what + ": the transform of the camera is singular or not finite");
  return glm::dmat4(glm::dvec4(side < 0 ? -right : right, 0), glm::dvec4(up, 0), glm::dvec4(back, 0), m[3]);
}

/// From the right, above and in front, far enough for every corner of the bounding box to be in an image of 4:3.
ViewCamera framing(const WorldTriangles& triangles) {
  glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper(-std::numeric_limits<double>::infinity());
  const GridScene grid = snap(triangles);  // what it drops is not seen
  for (const GridTriangle& triangle : grid.triangles)
    for (const glm::dvec3& p : triangles.vertices[triangle.id]) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
  if (grid.triangles.empty()) {
    lower = glm::dvec3(-1.0);
    upper = glm::dvec3(1.0);
  }
  const glm::dvec3 center = lower * 0.5 + upper * 0.5;
  glm::dvec3 half = upper * 0.5 - lower * 0.5;
  const double largest = std::max({half.x, half.y, half.z});
  const double unit = largest > 0 ? largest : 1.0;
  half /= unit;

  ViewCamera camera;
  camera.name = "default";
  camera.yfov = 0.7;
  camera.aspect = 4.0 / 3.0;
  const glm::dvec3 back = glm::normalize(glm::dvec3(0.55, 0.5, 1.0));
  const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), back));
  const glm::dvec3 up = glm::cross(back, right);
  const double tan_y = std::tan(camera.yfov / 2), tan_x = tan_y * camera.aspect;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = half * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const double depth = glm::dot(p, back);  // towards the camera
    distance =
        std::max({distance, depth + std::abs(glm::dot(p, right)) / tan_x, depth + std::abs(glm::dot(p, up)) / tan_y});
  }
  const double margin = 1.04;
  camera.world = glm::dmat4(glm::dvec4(right, 0), glm::dvec4(up, 0), glm::dvec4(back, 0),
                            glm::dvec4(center + back * (distance * margin * unit), 1));
  return camera;
}

}  // namespace

WorldRay ViewCamera::ray(double px, double py, int width, int height) const {
  const double shape = static_cast<double>(width) / height;
  const double x = 2 * px / width - 1, y = 1 - 2 * py / height;
  const glm::dvec3 right(world[0]), up(world[1]), back(world[2]);
  WorldRay ray;
  if (perspective) {
    double tan_y = std::tan(yfov / 2);
    if (aspect > 0 && shape < aspect) tan_y *= aspect / shape;
    ray.origin = eye();
    ray.direction = glm::normalize(right * (x * tan_y * shape) + up * (y * tan_y) - back);
  } else {
    const double half_y = std::max(ymag, xmag / shape);
    ray.origin = eye() + right * (x * half_y * shape) + up * (y * half_y);
    ray.direction = -back;
  }
  const double along = -glm::dot(ray.direction, back);
  ray.t_min = std::max(znear, 0.0) / along;
  if (std::isfinite(zfar)) ray.t_max = zfar / along;
  return ray;
}

ViewCamera default_view(const Scene& scene, const WorldTriangles& triangles, const std::string& camera) {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t node : scene.reachable())
    if (scene.nodes[node].camera < scene.cameras.size()) found.push_back(node);

  std::size_t pick = 0;
  if (!camera.empty()) {
    pick = found.size();
    for (std::size_t i = found.size(); i-- > 0;) {
      const Node& node = scene.nodes[found[i]];
      if (node.name == camera || scene.cameras[node.camera].name == camera) pick = i;
    }
    std::size_t number = 0;
    const auto [end, status] = std::from_chars(camera.data(), camera.data() + camera.size(), number);
    if (pick == found.size() && status == std::errc() && end == camera.data() + camera.size())
      pick = std::min(number, found.size());
    if (pick == found.size()) {
      std::string list;
      for (std::size_t i = 0; i < found.size() && i < 20; ++i) {
        const Node& node = scene.nodes[found[i]];
        list += (i ? ", " : "") + std::to_string(i);
        const std::string& name = node.name.empty() ? scene.cameras[node.camera].name : node.name;
        if (!name.empty()) list += " '" + name + "'";
      }
      throw Error(scene.name + ": there is no camera '" + camera + "'; " +
                  (found.empty() ? "the scene has none" : "there are: " + list));
    }
  }
  const auto view_of = [&](std::size_t number) {
    const Node& node = scene.nodes[found[number]];
    const Camera& source = scene.cameras[node.camera];
    if (!source.fault.empty()) throw Error(scene.name + ": " + source.fault);
    ViewCamera view;
    view.name = !node.name.empty()     ? node.name
                : !source.name.empty() ? source.name
                                       : "camera " + std::to_string(number);
    view.world = orthonormal(scene.world_transforms()[found[number]], scene.name + ": camera '" + view.name + "'");
    view.perspective = source.perspective;
    view.yfov = source.yfov;
    view.aspect = source.aspect;
    view.xmag = source.xmag;
    view.ymag = source.ymag;
    view.znear = source.znear;
    view.zfar = source.zfar;
    return view;
  };
  if (!camera.empty()) return view_of(pick);
  for (std::size_t i = 0; i < found.size(); ++i)
    if (scene.cameras[scene.nodes[found[i]].camera].fault.empty()) return view_of(i);
  return framing(triangles);
}

}  // namespace retrace
