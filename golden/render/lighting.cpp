// Lights, see lighting.hpp. Spot and range attenuation as KHR_lights_punctual prescribes. Emissive triangles are sampled by area times
// luminance (P. Shirley, C. Wang, K. Zimmerman, "Monte Carlo techniques for direct lighting calculations", ACM TOG 15(1), 1996).
#include "golden/render/lighting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "golden/base/error.hpp"
#include "golden/render/sampling.hpp"
#include "golden/render/tonemap.hpp"

namespace retrace {

LightChoice parse_lights(const std::string& name) {
  if (name == "auto") return LightChoice::kAuto;
  if (name == "scene") return LightChoice::kScene;
  if (name == "rig") return LightChoice::kRig;
  throw UsageError("lights is auto, scene or rig, not '" + name + "'");
}

namespace {

/// Emissive surfaces light the scene if they are at least this part of its surface; smaller ones (lamps of a car) only glow.
constexpr double kEmissivePart = 1e-3;

glm::vec3 average_emission(const Surfaces& surfaces, std::uint32_t id) {
  // Corners and centre, which is enough for the constant emission that lamps have.
  constexpr std::array<glm::dvec2, 4> kWhere = {{{1 / 3.0, 1 / 3.0}, {0.1, 0.1}, {0.8, 0.1}, {0.1, 0.8}}};
  glm::vec3 sum(0.0f);
  for (const glm::dvec2& w : kWhere) {
    Hit hit;
    hit.status = contract::kStatusHit;
    hit.id = id;
    hit.u = w.x;
    hit.v = w.y;
    sum += surfaces.at(hit, -surfaces.front(id)).emissive;
  }
  return sum / static_cast<float>(kWhere.size());
}

}  // namespace

glm::vec3 Sky::radiance(const glm::dvec3& direction) const {
  return glm::mix(down, up, static_cast<float>(0.5 + 0.5 * direction.y));
}

glm::vec3 Sky::average(const glm::dvec3& normal) const {
  return 0.5f * (up + down) + static_cast<float>(normal.y / 3.0) * (up - down);
}

Lighting::Lighting(const Surfaces& surfaces, const ViewCamera& camera, LightChoice choice, bool indoors)
    : offset_(surfaces.offset()), indoors_(indoors) {
  const Scene& scene = surfaces.scene();
  // Closer than this a point light or emitter counts as being this far: keeps one sample from outshining the picture.
  closest2_ = std::pow(0x1p-9 / surfaces.grid().transform.scale, 2);
  clearance_ = 0x1p-12 / surfaces.grid().transform.scale;

  double total_area = 0, emissive_area = 0;
  if (choice != LightChoice::kRig) {
    const auto transforms = scene.world_transforms();
    for (const std::uint32_t n : scene.reachable()) {
      const Node& node = scene.nodes[n];
      if (node.light >= scene.lights.size()) continue;
      const Light& light = scene.lights[node.light];
      Lamp lamp;
      lamp.type = light.type;
      lamp.position = surfaces.from_world(glm::dvec3(transforms[n][3]));
      const glm::dvec3 axis = -glm::dvec3(transforms[n][2]);
      const double length = glm::length(axis);
      lamp.axis = length > 0 ? axis / length : glm::dvec3(0, 0, -1);
      lamp.power = light.color * light.intensity;
      lamp.range = light.range;
      lamp.cos_inner = std::cos(light.inner_cone);
      lamp.cos_outer = std::cos(light.outer_cone);
      if (luminance(lamp.power) > 0 && std::isfinite(luminance(lamp.power))) lamps_.push_back(lamp);
    }
    bool emits = false;
    for (const Material& material : scene.materials)
      emits = emits || (luminance(material.emissive) > 0 && !material.unlit);
    const auto add_emitter = [&](std::uint32_t id) {
      const glm::dvec3 p0 = surfaces.vertex(id, 0), e1 = surfaces.vertex(id, 1) - p0, e2 = surfaces.vertex(id, 2) - p0;
      const double area = 0.5 * glm::length(glm::cross(e1, e2));
      total_area += area;
      const std::uint32_t material = surfaces.primitive(id).material;
      if (material >= scene.materials.size() || !(luminance(scene.materials[material].emissive) > 0)) return;
      const glm::vec3 radiance = average_emission(surfaces, id);
      if (!(luminance(radiance) > 1e-3f)) return;
      emissive_area += area;
      emitters_.push_back({p0, e1, e2, surfaces.front(id), radiance, area, scene.materials[material].double_sided});
    };
    if (emits) surfaces.for_each_triangle(add_emitter);
  }
  // A file with punctual lights has put them where its lamps are, and then glowing surfaces are only seen, as in other glTF viewers.
  if (choice == LightChoice::kAuto && (!lamps_.empty() || emissive_area < kEmissivePart * total_area))
    emitters_.clear();
  double sum = 0;
  for (const Emitter& emitter : emitters_) cumulative_.push_back(sum += emitter.area * luminance(emitter.radiance));

  rig_ = lamps_.empty() && emitters_.empty() && choice != LightChoice::kScene;
  if (!rig_) return;
  const glm::dvec3 right(camera.world[0]), up(camera.world[1]), back(camera.world[2]);
  Lamp key;
  if (indoors) {
    // Over the left shoulder, near enough to the eye to be in the same room; falls off slowly, so its power follows the room's size.
    const double size = 1.0 / surfaces.grid().transform.scale;
    key.type = Light::Type::kPoint;
    key.position = surfaces.from_world(camera.eye()) + (-0.06 * right + 0.08 * up) * size;
    key.power = glm::vec3(1.0f, 0.96f, 0.9f) * static_cast<float>(1.6 * size * size);
    sky.up = glm::vec3(0.34f, 0.36f, 0.40f);
    sky.down = glm::vec3(0.26f, 0.25f, 0.24f);
  } else {
    key.type = Light::Type::kDirectional;
    key.axis = -glm::normalize(-0.55 * right + 0.75 * up + 0.65 * back);
    key.power = glm::vec3(1.0f, 0.95f, 0.87f) * 2.6f;
    key.radius = 0.03;
    sky.up = glm::vec3(0.52f, 0.62f, 0.78f);
    sky.down = glm::vec3(0.24f, 0.22f, 0.20f);
  }
  lamps_.push_back(key);
}

int Lighting::max_samples(int area_samples) const {
  return std::min<int>(static_cast<int>(lamps_.size()), kMaxPunctual) + (emitters_.empty() ? 0 : area_samples);
}

LightSample Lighting::from_lamp(const Lamp& lamp, const glm::dvec3& position, const glm::dvec2& random) const {
  LightSample sample;
  if (lamp.type == Light::Type::kDirectional) {
    sample.direction = -lamp.axis;
    if (lamp.radius > 0) {
      const glm::dvec2 d = to_disk(random) * lamp.radius;
      glm::dvec3 s, t;
      make_frame(sample.direction, s, t);
      sample.direction = glm::normalize(sample.direction + s * d.x + t * d.y);
    }
    sample.distance = std::numeric_limits<double>::infinity();
    sample.irradiance = lamp.power;
    return sample;
  }
  const glm::dvec3 to = lamp.position - position;
  const double d2 = glm::dot(to, to);
  if (!(d2 > 0)) return sample;
  const double distance = std::sqrt(d2);
  sample.direction = to / distance;
  // Lamps are put on the surfaces of their models; the shadow ray ends in front of those.
  sample.distance = std::max(distance - clearance_, 0.5 * distance);
  double factor = 1.0 / std::max(d2, closest2_);
  if (lamp.range > 0) {
    const double q = d2 / (lamp.range * lamp.range);
    factor *= std::clamp(1.0 - q * q, 0.0, 1.0);
  }
  if (lamp.type == Light::Type::kSpot) {
    const double width = std::max(0.001, lamp.cos_inner - lamp.cos_outer);
    const double a = std::clamp((-glm::dot(sample.direction, lamp.axis) - lamp.cos_outer) / width, 0.0, 1.0);
    factor *= a * a;
  }
  sample.irradiance = lamp.power * static_cast<float>(factor);
  return sample;
}

void Lighting::sample(const SurfacePoint& point, int area_samples, std::uint32_t index, std::uint32_t seed,
                      std::vector<LightSample>& samples) const {
  samples.clear();
  const glm::dvec3 from = point.position + point.geometric * offset_;  // where Surfaces::leave starts
  const auto useful = [&](const LightSample& s) {
    return luminance(s.irradiance) > 0 && glm::dot(s.direction, point.geometric) > 0;
  };
  if (lamps_.size() <= kMaxPunctual) {
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      const auto number = static_cast<std::uint32_t>(i);
      const glm::dvec2 random =
          lamps_[i].radius > 0 ? sample_2d(index, hash_combine(seed, 0x4c41u + number)) : glm::dvec2(0.5);
      const LightSample s = from_lamp(lamps_[i], from, random);
      if (useful(s)) samples.push_back(s);
    }
  } else {
    // Too many to ask all: kMaxPunctual of them, picked by what they would contribute, at evenly spread places of one random offset.
    std::vector<double> sums;
    std::vector<LightSample> all;
    double sum = 0;
    for (const Lamp& lamp : lamps_) {
      all.push_back(from_lamp(lamp, from, glm::dvec2(0.5)));
      const LightSample& s = all.back();
      sums.push_back(sum += useful(s) ? luminance(s.irradiance) * glm::dot(s.direction, point.geometric) : 0.0);
    }
    const double start = sample_2d(index, hash_combine(seed, 0x4d41u)).x;
    for (int k = 0; sum > 0 && k < kMaxPunctual; ++k) {
      const double where = (k + start) / kMaxPunctual * sum;
      const auto i =
          std::min<std::size_t>(std::upper_bound(sums.begin(), sums.end(), where) - sums.begin(), sums.size() - 1);
      const double part = sums[i] - (i > 0 ? sums[i - 1] : 0.0);
      if (!(part > 0)) continue;
      samples.push_back(all[i]);
      samples.back().irradiance *= static_cast<float>(sum / (part * kMaxPunctual));
    }
  }
  if (emitters_.empty()) return;
  const double total = cumulative_.back();
  for (int k = 0; k < area_samples; ++k) {
    const auto number = index * static_cast<std::uint32_t>(area_samples) + static_cast<std::uint32_t>(k);
    const double pick = sample_2d(number, hash_combine(seed, 0x5041u)).x * total;
    const auto i = std::min<std::size_t>(
        std::upper_bound(cumulative_.begin(), cumulative_.end(), pick) - cumulative_.begin(), emitters_.size() - 1);
    const Emitter& emitter = emitters_[i];
    if (emitter.area <= 0) continue;
    glm::dvec2 r = sample_2d(number, hash_combine(seed, 0x5051u));
    const double root = std::sqrt(r.x);
    glm::dvec3 target = emitter.corner + emitter.edge1 * (1.0 - root) + emitter.edge2 * (root * r.y);
    glm::dvec3 to = target - from;
    double cosine = glm::dot(to, emitter.normal);
    if (cosine >= 0 && !emitter.both_sides) continue;
    // The shadow ray ends in front of the emitter, by the offset that secondary rays start with.
    target -= emitter.normal * std::copysign(offset_, cosine);
    to = target - from;
    const double d2 = glm::dot(to, to), distance = std::sqrt(d2);
    if (!(distance > 0)) continue;
    cosine = std::fabs(glm::dot(to, emitter.normal)) / distance;
    LightSample s;
    s.direction = to / distance;
    s.distance = distance;
    // density over area: luminance / total; radiance * cosine / (d2 * density)
    const double weight = cosine * total / (std::max(d2, closest2_) * luminance(emitter.radiance) * area_samples);
    s.irradiance = emitter.radiance * static_cast<float>(weight);
    if (useful(s)) samples.push_back(s);
  }
}

std::string Lighting::describe() const {
  if (rig_) return indoors_ ? "lamp by the camera" : "sun and sky";
  std::string text;
  const auto add = [&](std::size_t n, const char* one, const char* many) {
    if (n == 0) return;
    if (!text.empty()) text += ", ";
    text += std::to_string(n) + " " + (n == 1 ? one : many);
  };
  add(lamps_.size(), "light", "lights");
  add(emitters_.size(), "emissive triangle", "emissive triangles");
  return text.empty() ? "none" : text;
}

}  // namespace retrace
