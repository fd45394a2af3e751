// The lights of a picture: those of the scene (KHR_lights_punctual and emissive triangles), or, when it has none, a rig that follows
// the camera. Radiance and irradiance in the scene's own (photometric or arbitrary) units; exposure comes later.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "golden/render/surface.hpp"
#include "golden/render/view.hpp"

namespace retrace {

/// Hemispherical sky: radiance changes linearly with the height of the direction, from `down` to `up`.
struct Sky {
  glm::vec3 up{0.0f}, down{0.0f};
  glm::vec3 radiance(const glm::dvec3& direction) const;
  /// Irradiance on a surface with this normal, divided by pi; nothing in the way.
  glm::vec3 average(const glm::dvec3& normal) const;
};

enum class LightChoice { kAuto, kScene, kRig };
/// "auto", "scene" or "rig". Throws UsageError.
LightChoice parse_lights(const std::string& name);

/// Light that arrives at a point from one place if nothing is in between.
struct LightSample {
  glm::dvec3 direction{0.0};   ///< unit, towards the light
  double distance = 0.0;       ///< world units; infinite for directional lights
  glm::vec3 irradiance{0.0f};  ///< on a surface that faces the light
};

class Lighting {
 public:
  /// kScene takes punctual lights and emissive triangles; kAuto the punctual lights, or, if there are none, the emissive triangles if they
  /// are more than specks, or else the rig. The rig of a camera inside a closed space is a lamp near the camera, otherwise a sun over its
  /// left shoulder and a sky.
  Lighting(const Surfaces& surfaces, const ViewCamera& camera, LightChoice choice, bool indoors);

  /// Number of samples that sample() writes at most: one a punctual light (up to kMaxPunctual), `area_samples` of the emissive triangles.
  static constexpr int kMaxPunctual = 8;
  int max_samples(int area_samples) const;
  /// Lights that may reach the point, weighted so that their sum is an unbiased estimate. `index` and `seed` choose the points on area
  /// lights and, with more than kMaxPunctual lights, the lights.
  void sample(const SurfacePoint& point, int area_samples, std::uint32_t index, std::uint32_t seed,
              std::vector<LightSample>& samples) const;

  bool is_rig() const { return rig_; }
  /// "3 punctual lights, 2 emissive triangles" or what the rig is.
  std::string describe() const;
  Sky sky;

 private:
  struct Lamp {
    Light::Type type = Light::Type::kPoint;
    glm::dvec3 position{0.0}, axis{0.0};  ///< axis: the way the light goes
    glm::vec3 power{0.0f};                ///< lux or candela
    double range = 0.0, cos_inner = 1.0, cos_outer = 0.0;
    double radius = 0.0;  ///< sine of the angular radius of a directional light: soft shadows of the rig's sun
  };
  struct Emitter {
    glm::dvec3 corner{0.0}, edge1{0.0}, edge2{0.0}, normal{0.0};
    glm::vec3 radiance{0.0f};
    double area = 0.0;
    bool both_sides = false;
  };
  LightSample from_lamp(const Lamp& lamp, const glm::dvec3& position, const glm::dvec2& random) const;

  std::vector<Lamp> lamps_;
  std::vector<Emitter> emitters_;
  std::vector<double> cumulative_;  ///< of area times luminance, by emitter; last is the total
  double offset_ = 0.0, clearance_ = 0.0, closest2_ = 0.0;
  bool rig_ = false, indoors_ = false;
};

}  // namespace retrace
