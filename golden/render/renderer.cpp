// Wavefront renderer, see renderer.hpp.
//
// Shading: Lambert and GGX with Smith's masking (B. Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007;
// E. Heitz, "Understanding the masking-shadowing function", JCGT 3(2), 2014) with Schlick's Fresnel term, as glTF 2.0 appendix B has it;
// ambient reflection by B. Karis's approximation ("Physically based shading on mobile", 2014).
// Ambient light of a scene with lights of its own: the mean of what its surfaces reflect, bounced on (after the ambient term of
// M. Cohen et al., "A progressive refinement approach to fast radiosity image generation", SIGGRAPH 1988, section 4).
#include "golden/render/renderer.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <numeric>
#include <optional>

#include "golden/base/clock.hpp"
#include "golden/render/sampling.hpp"
#include "golden/render/tonemap.hpp"

namespace retrace {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kMaxSize = 16384;
constexpr std::size_t kWave = std::size_t{1} << 18;  ///< rays handed to an engine at once
constexpr int kMaxLayers = 1024;                     ///< transparent surfaces that one ray may pass; the last is opaque
constexpr int kOwnLayers = 32;                       ///< surfaces of a ray that are each shaded by themselves
constexpr float kGroupWeight = 1.0f / 64;            ///< of those behind, as many as weigh this are shaded as one
constexpr std::size_t kMaxTasks = std::size_t{1} << 18;  ///< surfaces that wait to be shaded

template <class Body>
void parallel(std::size_t n, std::size_t grain, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) body(i);
  });
}

// ---------------------------------------------------------------------------------------------- reflection

struct Reflectance {
  glm::vec3 diffuse, specular0;
  float alpha;  ///< GGX roughness
};

Reflectance reflectance(const SurfacePoint& point) {
  const glm::vec3 base(point.base);
  return {base * (1.0f - point.metallic), glm::mix(glm::vec3(0.04f), base, point.metallic),
          std::max(point.roughness * point.roughness, 0.02f)};
}

/// Radiance reflected towards -view of unit irradiance (on a surface facing the light) from `light`.
glm::vec3 reflect(const SurfacePoint& point, const Reflectance& r, const glm::dvec3& view, const glm::dvec3& light) {
  const double cosine = glm::dot(point.normal, light);
  if (cosine <= 0) return glm::vec3(0.0f);
  const glm::dvec3 eye = -view;
  const glm::dvec3 half = glm::normalize(eye + light);
  const auto nl = static_cast<float>(cosine), nv = static_cast<float>(std::max(glm::dot(point.normal, eye), 1e-3)),
             nh = static_cast<float>(std::max(glm::dot(point.normal, half), 0.0)),
             vh = static_cast<float>(std::clamp(glm::dot(eye, half), 0.0, 1.0));
  const float a2 = r.alpha * r.alpha;
  const float q = nh * nh * (a2 - 1.0f) + 1.0f;
  const float distribution = a2 / (static_cast<float>(kPi) * q * q);
  const float masking =
      0.5f / (nl * std::sqrt(nv * nv * (1.0f - a2) + a2) + nv * std::sqrt(nl * nl * (1.0f - a2) + a2));
  const glm::vec3 fresnel = r.specular0 + (1.0f - r.specular0) * std::pow(1.0f - vh, 5.0f);
  return nl * ((1.0f - fresnel) * r.diffuse / static_cast<float>(kPi) + fresnel * (distribution * masking));
}

/// Reflection of an ambient environment: factor on its radiance in the mirrored direction.
glm::vec3 ambient_specular(const SurfacePoint& point, const Reflectance& r, const glm::dvec3& view) {
  const auto nv = static_cast<float>(std::clamp(-glm::dot(point.normal, view), 0.0, 1.0));
  const glm::vec4 x =
      point.roughness * glm::vec4(-1.0f, -0.0275f, -0.572f, 0.022f) + glm::vec4(1.0f, 0.0425f, 1.04f, -0.04f);
  const float y = std::min(x.x * x.x, std::exp2(-9.28f * nv)) * x.x + x.y;
  const glm::vec2 scale_bias = glm::vec2(-1.04f, 1.04f) * y + glm::vec2(x.z, x.w);
  return r.specular0 * scale_bias.x + scale_bias.y;
}

/// The sky in the mirrored direction, blurred towards its mean with roughness.
glm::vec3 mirrored_sky(const Sky& sky, const SurfacePoint& point, const glm::dvec3& view) {
  const glm::dvec3 mirror = view - 2.0 * glm::dot(view, point.normal) * point.normal;
  return glm::mix(sky.radiance(mirror), sky.average(mirror), point.roughness);
}

// ---------------------------------------------------------------------------------------------- waves

/// Engine, scene and the clock: everything that turns world rays into hits.
struct Tracer {
  const Surfaces& surfaces;
  const std::array<std::int32_t, 6>& box;
  Engine& engine;
  TraceOptions options;
  std::vector<GridRay> grid;
  std::vector<Hit> hits;
  std::vector<RayWork> work;
  double quantise_s = 0, trace_s = 0;
  std::uint64_t cut = 0;  ///< rays that have passed kMaxLayers surfaces

  void run(std::span<const WorldRay> rays, bool any, WorkTotals& totals) {
    grid.resize(rays.size());
    hits.assign(rays.size(), Hit{});
    work.assign(rays.size(), RayWork{});
    const double start = now();
    quantise_all(rays, grid, surfaces.grid().transform, box, any);
    const double middle = now();
    engine.trace(grid, hits, engine.counts_work() ? std::span<RayWork>(work) : std::span<RayWork>(), options);
    trace_s += now() - middle;
    quantise_s += middle - start;
    for (const RayWork& w : work) totals.add(w);
    for (const Hit& hit : hits) {
      if (hit.status > contract::kStatusHit) {
        throw Error("engine " + engine.name() + ": a ray ended with status " + std::to_string(hit.status));
      }
    }
  }
  double world_t(std::size_t i) const { return grid[i].t_base + grid[i].t_scale * hits[i].t; }
};

/// What is left of a ray behind the surface it hit. `attempt` counts hits of the same triangle in a row, which rounding may cause.
WorldRay behind(const WorldRay& ray, double t, const SurfacePoint& point, double offset, int attempt) {
  WorldRay rest = ray;
  const double length = glm::length(ray.direction);
  const double cosine = std::max(std::fabs(glm::dot(ray.direction, point.geometric)) / length, 0x1p-6);
  rest.t_min = t + std::ldexp(offset, attempt) / (cosine * length);
  return rest;
}

/// How much light passes along each ray: 1 or 0 for opaque scenes, products of alpha otherwise.
void transmittance(Tracer& tracer, std::span<const WorldRay> rays, std::vector<float>& passed, WorkTotals& totals) {
  passed.assign(rays.size(), 1.0f);
  if (!tracer.surfaces.transparent()) {
    tracer.run(rays, true, totals);
    totals.rays += rays.size();
    for (std::size_t i = 0; i < rays.size(); ++i) passed[i] = tracer.hits[i].hit() ? 0.0f : 1.0f;
    return;
  }
  // Masks and blends need the nearest surface, again and again.
  totals.rays += rays.size();
  std::vector<WorldRay> open(rays.begin(), rays.end());
  std::vector<std::uint32_t> owner(rays.size()), last(rays.size(), kNone);
  std::vector<int> attempts(rays.size(), 0);
  std::iota(owner.begin(), owner.end(), 0u);
  for (int layer = 0; layer < kMaxLayers && !open.empty(); ++layer) {
    tracer.run(open, false, totals);
    std::vector<std::uint8_t> goes_on(open.size(), 0);
    parallel(open.size(), 1024, [&](std::size_t i) {
      const Hit& hit = tracer.hits[i];
      if (!hit.hit()) return;
      const std::uint32_t o = owner[i];
      const SurfacePoint point = tracer.surfaces.at(hit, open[i].direction);
      attempts[o] = hit.id == last[o] ? attempts[o] + 1 : 0;
      if (attempts[o] == 0) passed[o] *= 1.0f - point.base.a;
      last[o] = hit.id;
      if (passed[o] < 1e-3f) {
        passed[o] = 0.0f;
        return;
      }
      open[i] = behind(open[i], tracer.world_t(i), point, tracer.surfaces.offset(), attempts[o]);
      goes_on[i] = 1;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (!goes_on[i]) continue;
      open[kept] = open[i];
      owner[kept++] = owner[i];
    }
    open.resize(kept);
    owner.resize(kept);
  }
  tracer.cut += open.size();
  for (const std::uint32_t o : owner) passed[o] = 0.0f;
}

/// A surface to be shaded: of one camera sample, with the weight that its radiance has there.
struct Task {
  std::uint32_t sample = 0;
  float weight = 1.0f;
  glm::dvec3 view{0.0};
  SurfacePoint point;
};

/// Faint layers far back on a ray, put together: one of each group is shaded for all, chosen by its weight, so that the mean is right and a ray
/// shades at most kOwnLayers + 1 / kGroupWeight + 1 surfaces, whatever it passes.
class LayerGroups {
 public:
  explicit LayerGroups(std::size_t samples) : groups_(samples) {
    for (Task& group : groups_) group.weight = 0.0f;
  }
  void add(const Task& task, std::uint32_t random) {
    Task& group = groups_[task.sample];
    const float total = group.weight + task.weight;
    if (static_cast<float>(random) * 0x1p-32f * total < task.weight) group = task;
    group.weight = total;
  }
  /// Moves the group of a sample to `tasks` if it is heavy enough, or if `ends` says that there will be no more.
  void close(std::uint32_t sample, bool ends, std::vector<Task>& tasks) {
    Task& group = groups_[sample];
    if (group.weight <= 0.0f || (!ends && group.weight < kGroupWeight)) return;
    tasks.push_back(group);
    group.weight = 0.0f;
  }

 private:
  std::vector<Task> groups_;
};

struct Shader {
  Tracer& tracer;
  const Lighting& lighting;
  const RenderOptions& options;
  double ao_distance;
  WorkTotals *shadow, *occlusion;

  struct Light {
    std::uint32_t task;
    glm::vec3 radiance;
  };

  /// Radiance of each task. `sample_index` and `seed` by task choose its random numbers.
  void shade(std::span<const Task> tasks, const std::function<std::uint32_t(std::size_t)>& sample_index,
             const std::function<std::uint32_t(std::size_t)>& seed, bool ambient, std::vector<glm::vec3>& radiance) {
    radiance.assign(tasks.size(), glm::vec3(0.0f));
    const std::size_t lights = static_cast<std::size_t>(lighting.max_samples(options.light_samples));
    const std::size_t ao = ambient ? static_cast<std::size_t>(options.ao) : 0;
    const std::size_t most = std::max<std::size_t>(1, kWave / std::max<std::size_t>({1, lights, ao}));
    for (std::size_t first = 0; first < tasks.size(); first += most) {
      const std::size_t n = std::min(most, tasks.size() - first);
      for (std::size_t i = 0; i < n; ++i) {
        const Task& task = tasks[first + i];
        radiance[first + i] = task.point.unlit ? glm::vec3(task.point.base) : task.point.emissive;
        if (!ambient || ao > 0 || task.point.unlit) continue;
        const Reflectance r = reflectance(task.point);
        radiance[first + i] +=
            r.diffuse * lighting.sky.average(task.point.normal) +
            ambient_specular(task.point, r, task.view) * mirrored_sky(lighting.sky, task.point, task.view);
      }
      // Direct light.
      cast(tasks.subspan(first, n), lights, options.shadows, *shadow, radiance.data() + first,
           [&](std::size_t i, std::vector<WorldRay>& rays, std::vector<Light>& out) {
             static thread_local std::vector<LightSample> samples;
             const Task& task = tasks[first + i];
             if (task.point.unlit) return;
             lighting.sample(task.point, options.light_samples, sample_index(first + i), seed(first + i), samples);
             const Reflectance r = reflectance(task.point);
             for (const LightSample& s : samples) {
               const glm::vec3 reflected = reflect(task.point, r, task.view, s.direction) * s.irradiance;
               if (!(luminance(reflected) > 0)) continue;
               rays.push_back(tracer.surfaces.leave(task.point, s.direction, s.distance));
               out.push_back({static_cast<std::uint32_t>(i), reflected});
             }
           });
      if (ao == 0) continue;
      cast(tasks.subspan(first, n), ao, true, *occlusion, radiance.data() + first,
           [&](std::size_t i, std::vector<WorldRay>& rays, std::vector<Light>& out) {
             const Task& task = tasks[first + i];
             if (task.point.unlit) return;
             const Reflectance r = reflectance(task.point);
             const glm::vec3 specular =
                 ambient_specular(task.point, r, task.view) * mirrored_sky(lighting.sky, task.point, task.view);
             const float part = 1.0f / static_cast<float>(ao);
             for (std::size_t k = 0; k < ao; ++k) {
               const auto number =
                   sample_index(first + i) * static_cast<std::uint32_t>(ao) + static_cast<std::uint32_t>(k);
               const glm::dvec3 d =
                   to_cosine_hemisphere(sample_2d(number, hash_combine(seed(first + i), 0x414fu)), task.point.normal);
               if (glm::dot(d, task.point.geometric) <= 0) continue;
               rays.push_back(tracer.surfaces.leave(task.point, d, ao_distance));
               out.push_back({static_cast<std::uint32_t>(i), part * (r.diffuse * lighting.sky.radiance(d) + specular)});
             }
           });
    }
  }

  /// Generates rays of all tasks in parallel, keeps their order, traces them and adds what passes to the radiance of their tasks.
  template <class Generate>
  void cast(std::span<const Task> tasks, std::size_t per_task, bool traced, WorkTotals& totals, glm::vec3* radiance,
            const Generate& generate) {
    if (per_task == 0 || tasks.empty()) return;
    constexpr std::size_t kBlock = 512;
    const std::size_t blocks = (tasks.size() + kBlock - 1) / kBlock;
    std::vector<std::vector<WorldRay>> rays(blocks);
    std::vector<std::vector<Light>> lights(blocks);
    parallel(blocks, 1, [&](std::size_t b) {
      for (std::size_t i = b * kBlock; i < std::min(tasks.size(), (b + 1) * kBlock); ++i)
        generate(i, rays[b], lights[b]);
    });
    std::vector<WorldRay> all;
    std::vector<Light> sums;
    for (std::size_t b = 0; b < blocks; ++b) {
      all.insert(all.end(), rays[b].begin(), rays[b].end());
      sums.insert(sums.end(), lights[b].begin(), lights[b].end());
    }
    std::vector<float> passed(all.size(), 1.0f);
    if (traced && !all.empty()) transmittance(tracer, all, passed, totals);
    for (std::size_t i = 0; i < sums.size(); ++i) radiance[sums[i].task] += sums[i].radiance * passed[i];
  }
};

/// Pixels in tiles of 16 x 16, so that neighbours in a batch are neighbours in the picture.
std::vector<std::uint32_t> tiled_order(int width, int height) {
  constexpr int kTile = 16;
  std::vector<std::uint32_t> order;
  order.reserve(static_cast<std::size_t>(width) * height);
  for (int ty = 0; ty < height; ty += kTile) {
    for (int tx = 0; tx < width; tx += kTile) {
      for (int y = ty; y < std::min(ty + kTile, height); ++y) {
        for (int x = tx; x < std::min(tx + kTile, width); ++x)
          order.push_back(static_cast<std::uint32_t>(y * width + x));
      }
    }
  }
  return order;
}

/// The ambient light that the scene's own lights cause: a coarse picture is lit, and its mean bounced on, in a closed space for ever.
glm::vec3 bounced_light(Tracer& tracer, const ViewCamera& camera, const Lighting& lighting,
                        const RenderOptions& options, bool indoors) {
  constexpr int kWidth = 64, kHeight = 48;
  std::vector<WorldRay> rays;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5, kWidth, kHeight));
  }
  WorkTotals ignored;
  tracer.run(rays, false, ignored);
  std::vector<Task> tasks;
  glm::vec3 albedo(0.0f);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!tracer.hits[i].hit()) continue;
    Task task;
    task.view = rays[i].direction;
    task.point = tracer.surfaces.at(tracer.hits[i], task.view);
    if (task.point.unlit) continue;
    task.point.emissive = glm::vec3(0.0f);
    // Seen as matt, so that a highlight in the picture does not count as light on everything.
    task.point.roughness = 1.0f;
    task.point.metallic = 0.0f;
    albedo += glm::vec3(task.point.base);
    tasks.push_back(task);
  }
  if (tasks.empty()) return glm::vec3(0.0f);
  RenderOptions coarse = options;
  coarse.light_samples = 4;
  coarse.ao = 0;
  Shader shader{tracer, lighting, coarse, 0.0, &ignored, &ignored};
  std::vector<glm::vec3> radiance;
  shader.shade(
      tasks, [](std::size_t) { return 0u; }, [](std::size_t i) { return hash_mix(static_cast<std::uint32_t>(i)); },
      false, radiance);
  glm::vec3 sum(0.0f);
  for (const glm::vec3& r : radiance) sum += r;
  const float n = static_cast<float>(tasks.size());
  // In the open much of what is reflected never meets a surface again.
  constexpr float kOpen = 0.6f, kDarkest = 0.35f;
  return indoors ? sum / n / glm::max(1.0f - albedo / n, kDarkest) : sum / n * kOpen;
}

/// Exposure that brings the picture's middle to a middle grey: log-average of the covered pixels (E. Reinhard et al., "Photographic tone
/// reproduction for digital images", SIGGRAPH 2002, section 3), which leaves the brightest hundredth some room.
double well_exposed(const Raster& color, const Raster& unlit) {
  std::vector<float> values;
  double sum = 0;
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      const float *p = color.at(x, y), *u = unlit.at(x, y);
      if (p[3] - u[3] < 0.5f) continue;
      const float l = luminance({p[0] - u[0], p[1] - u[1], p[2] - u[2]}) / (p[3] - u[3]);
      if (!(l > 0) || !std::isfinite(l)) continue;
      values.push_back(l);
      sum += std::log(static_cast<double>(l));
    }
  }
  if (values.empty()) return 1.0;
  const double middle = std::exp(sum / static_cast<double>(values.size()));
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 9 / 10);
  std::nth_element(values.begin(), place, values.end());
  const double bright = *place;
  return std::clamp(std::min(0.32 / middle, 1.6 / bright), 1e-9, 1e9);
}

}  // namespace

void quantise_all(std::span<const WorldRay> rays, std::span<GridRay> grid, const GridTransform& transform,
                  const std::array<std::int32_t, 6>& box, bool any) {
  parallel(rays.size(), 2048, [&](std::size_t i) { grid[i] = quantise(rays[i], transform, box, any); });
}

bool is_indoors(const Surfaces& surfaces, const ViewCamera& camera, const std::array<std::int32_t, 6>& box,
                Engine& engine, const TraceOptions& options) {
  // Of directions spread over the sphere (Fibonacci spiral) nine tenths must end on a surface.
  constexpr int kRays = 256;
  std::vector<WorldRay> rays(kRays);
  for (int i = 0; i < kRays; ++i) {
    const double y = 1.0 - 2.0 * (i + 0.5) / kRays, phi = i * 2.39996322972865332, r = std::sqrt(1.0 - y * y);
    rays[static_cast<std::size_t>(i)].origin = camera.eye();
    rays[static_cast<std::size_t>(i)].direction = {r * std::cos(phi), y, r * std::sin(phi)};
  }
  Tracer tracer{surfaces, box, engine, options, {}, {}, {}};
  WorkTotals ignored;
  tracer.run(rays, true, ignored);
  return std::count_if(tracer.hits.begin(), tracer.hits.end(), [](const Hit& hit) { return hit.hit(); }) >
         kRays * 9 / 10;
}

RenderResult render(const Surfaces& surfaces, const ViewCamera& camera, const std::array<std::int32_t, 6>& box,
                    Engine& engine, const RenderOptions& options) {
  if (options.width < 1 || options.height < 1 || options.width > kMaxSize || options.height > kMaxSize) {
    throw Error("the size of the picture must be between 1x1 and " + std::to_string(kMaxSize) + "x" +
                std::to_string(kMaxSize));
  }
  if (options.spp < 1 || options.ao < 0 || options.light_samples < 1)
    throw Error("numbers of samples must be positive");
  const double start = now();
  const int width = options.width, height = options.height;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto spp = static_cast<std::size_t>(options.spp);

  RenderResult result;
  result.color = Raster(width, height, 4);
  result.unlit = Raster(width, height, 4);
  result.albedo = Raster(width, height, 3);
  result.normal = Raster(width, height, 3);
  result.depth = Raster(width, height, 1, std::numeric_limits<float>::infinity());
  result.id.assign(pixels, kNone);
  for (Raster* raster : {&result.down, &result.up, &result.leaf, &result.tests, &result.skipped})
    *raster = Raster(width, height, 1);

  Tracer tracer{surfaces, box, engine, options.trace, {}, {}, {}};
  const bool indoors = is_indoors(surfaces, camera, box, engine, options.trace);
  Lighting lighting(surfaces, camera, options.lights, indoors);
  if (!lighting.is_rig()) {
    const glm::vec3 bounced = bounced_light(tracer, camera, lighting, options, indoors);
    lighting.sky = {bounced * 1.15f, bounced * 0.85f};
  }
  result.lights = lighting.describe();
  const double ao_distance =
      options.ao_distance > 0 ? options.ao_distance : (1.0 / 3.0) / surfaces.grid().transform.scale;
  Shader shader{tracer, lighting, options, ao_distance, &result.shadow, &result.occlusion};

  const glm::dvec3 eye = surfaces.from_world(camera.eye());
  const std::vector<std::uint32_t> order = tiled_order(width, height);
  const std::size_t chunk = std::max<std::size_t>(1, (std::size_t{1} << 16) / spp);  // pixels a wave
  const float inverse = 1.0f / static_cast<float>(spp);
  tracer.quantise_s = tracer.trace_s = 0;

  std::vector<WorldRay> rays;
  std::vector<std::uint32_t> owner, last;
  std::vector<int> attempts;
  std::vector<float> weight;
  std::vector<glm::vec3> sample_radiance, radiance;
  std::vector<glm::vec4> sample_unlit;
  std::vector<float> sample_cover;
  std::vector<Task> tasks, layer_tasks;
  std::vector<std::uint8_t> goes_on, shaded;
  for (std::size_t begin = 0; begin < pixels; begin += chunk) {
    const std::size_t count = std::min(chunk, pixels - begin), samples = count * spp;
    const auto pixel_of = [&](std::size_t sample) { return order[begin + sample / spp]; };
    const auto seed_of = [&](std::size_t sample) { return hash_combine(options.seed, pixel_of(sample)); };
    rays.resize(samples);
    owner.resize(samples);
    std::iota(owner.begin(), owner.end(), 0u);
    last.assign(samples, kNone);
    attempts.assign(samples, 0);
    weight.assign(samples, 1.0f);
    sample_radiance.assign(samples, glm::vec3(0.0f));
    sample_unlit.assign(samples, glm::vec4(0.0f));
    sample_cover.assign(samples, 0.0f);
    tasks.clear();
    const auto shade = [&] {
      shader.shade(
          tasks, [&](std::size_t i) { return static_cast<std::uint32_t>(tasks[i].sample % spp); },
          [&](std::size_t i) { return hash_combine(seed_of(tasks[i].sample), 0x5348u); }, true, radiance);
      for (std::size_t i = 0; i < tasks.size(); ++i) {
        sample_radiance[tasks[i].sample] += radiance[i] * tasks[i].weight;
        if (tasks[i].point.unlit) sample_unlit[tasks[i].sample] += glm::vec4(radiance[i], 1.0f) * tasks[i].weight;
      }
      tasks.clear();
    };
    parallel(samples, 2048, [&](std::size_t s) {
      const std::uint32_t pixel = pixel_of(s);
      const glm::dvec2 where = spp == 1
                                   ? glm::dvec2(0.5)
                                   : sample_2d(static_cast<std::uint32_t>(s % spp), hash_combine(seed_of(s), 0x5058u));
      const std::uint32_t column = pixel % static_cast<std::uint32_t>(width);
      const std::uint32_t row = pixel / static_cast<std::uint32_t>(width);
      rays[s] = camera.ray(column + where.x, row + where.y, width, height);
    });
    result.camera.rays += samples;

    std::optional<LayerGroups> groups;
    for (int layer = 0; layer < kMaxLayers && !rays.empty(); ++layer) {
      tracer.run(rays, false, result.camera);
      layer_tasks.assign(rays.size(), Task{});
      goes_on.assign(rays.size(), 0);
      shaded.assign(rays.size(), 0);
      parallel(rays.size(), 1024, [&](std::size_t i) {
        const Hit& hit = tracer.hits[i];
        const std::uint32_t s = owner[i], pixel = pixel_of(s);
        if (!hit.hit()) return;
        Task& task = layer_tasks[i];
        task.sample = s;
        task.view = glm::normalize(rays[i].direction);
        task.point = surfaces.at(hit, task.view);
        attempts[s] = hit.id == last[s] ? attempts[s] + 1 : 0;
        last[s] = hit.id;
        const float alpha = attempts[s] > 0 ? 0.0f : layer + 1 == kMaxLayers ? 1.0f : task.point.base.a;
        task.weight = weight[s] * alpha;
        shaded[i] = task.weight > 0;
        weight[s] *= 1.0f - alpha;
        sample_cover[s] += task.weight;
        if (alpha > 0.0f && s % spp == 0 && result.id[pixel] == kNone) {
          result.id[pixel] = hit.id;
          const int x = static_cast<int>(pixel) % width, y = static_cast<int>(pixel) / width;
          *result.depth.at(x, y) =
              static_cast<float>(-glm::dot(task.point.position - eye, glm::dvec3(camera.world[2])));
          result.normal.set_rgb(x, y, glm::vec3(task.point.normal));
        }
        if (weight[s] > 1e-3f) {
          goes_on[i] = 1;
          rays[i] = behind(rays[i], tracer.world_t(i), task.point, surfaces.offset(), attempts[s]);
        }
      });
      // Several rays may belong to one pixel, so sums over pixels are made in order.
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::uint32_t s = owner[i], pixel = pixel_of(s);
        const RayWork& w = tracer.work[i];
        result.down.data[pixel] += static_cast<float>(w.down) * inverse;
        result.up.data[pixel] += static_cast<float>(w.up) * inverse;
        result.leaf.data[pixel] += static_cast<float>(w.leaf) * inverse;
        result.tests.data[pixel] += static_cast<float>(w.tests) * inverse;
        result.skipped.data[pixel] += static_cast<float>(w.skipped) * inverse;
        for (int c = 0; c < 3 && shaded[i]; ++c) {
          result.albedo.data[3 * pixel + static_cast<std::size_t>(c)] +=
              layer_tasks[i].point.base[c] * layer_tasks[i].weight * inverse;
        }
        if (layer < kOwnLayers) {
          if (shaded[i]) tasks.push_back(layer_tasks[i]);
          continue;
        }
        if (!groups) groups.emplace(samples);
        if (shaded[i])
          groups->add(layer_tasks[i], hash_combine(seed_of(s), 0x4c41u + static_cast<std::uint32_t>(layer)));
        groups->close(s, !goes_on[i] || layer + 1 == kMaxLayers, tasks);
      }
      if (layer + 1 == kMaxLayers) tracer.cut += rays.size();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!goes_on[i]) continue;
        rays[kept] = rays[i];
        owner[kept++] = owner[i];
      }
      rays.resize(kept);
      owner.resize(kept);
      if (tasks.size() > kMaxTasks) shade();
    }
    shade();
    for (std::size_t s = 0; s < samples; ++s) {
      float* p = result.color.data.data() + 4 * static_cast<std::size_t>(pixel_of(s));
      for (int c = 0; c < 3; ++c) p[c] += sample_radiance[s][c] * inverse;
      p[3] += sample_cover[s] * inverse;
      float* u = result.unlit.data.data() + 4 * static_cast<std::size_t>(pixel_of(s));
      for (int c = 0; c < 4; ++c) u[c] += sample_unlit[s][c] * inverse;
    }
    if (options.progress) options.progress(static_cast<double>(begin + count) / static_cast<double>(pixels));
  }

  result.exposure = lighting.is_rig() ? 1.0 : well_exposed(result.color, result.unlit);
  result.cut_rays = tracer.cut;
  result.quantise_s = tracer.quantise_s;
  result.trace_s = tracer.trace_s;
  result.total_s = now() - start;
  result.shade_s = result.total_s - result.quantise_s - result.trace_s;
  return result;
}

Raster develop(const RenderResult& result, double exposure) {
  const Raster& color = result.color;
  Raster image(color.width, color.height, 3);
  parallel(static_cast<std::size_t>(color.height), 16, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    // The backdrop is part of the picture, not of the light: the same for every exposure. Neutral, darker above.
    const float height = (static_cast<float>(y) + 0.5f) / static_cast<float>(color.height);
    const glm::vec3 backdrop = glm::mix(glm::vec3(0.30f, 0.34f, 0.39f), glm::vec3(0.72f, 0.74f, 0.76f), height);
    for (int x = 0; x < color.width; ++x) {
      const float* p = color.at(x, y);
      const float cover = glm::clamp(p[3], 0.0f, 1.0f);
      glm::vec3 shown(0.0f);
      if (cover > 0.0f) {
        // Unlit surfaces show their colours as they are; the rest is exposed.
        const glm::vec4 unlit = result.unlit.width > 0 ? glm::make_vec4(result.unlit.at(x, y)) : glm::vec4(0.0f);
        const float lit = p[3] - unlit.a;
        if (lit > 1e-6f * p[3])
          shown = tone_map((glm::vec3(p[0], p[1], p[2]) - glm::vec3(unlit)) * (static_cast<float>(exposure) / lit)) *
                  (lit / p[3]);
        shown += glm::vec3(unlit) / p[3];
      }
      image.set_rgb(x, y, srgb_encode(glm::mix(srgb_decode(backdrop), shown, cover)));
    }
  });
  return image;
}

std::span<const Aov> known_aovs() {
  static constexpr std::array<Aov, 10> kAovs = {
      {{"depth", "distance along the viewing axis, world units"},
       {"normal", "interpolated world normal, turned towards the camera"},
       {"albedo", "base colour with textures"},
       {"id", "triangle id, an unsigned integer; 4294967295 where nothing is hit"},
       {"steps", "node visits of the camera rays: down + up + leaf"},
       {"down", "interior nodes visited on the way down"},
       {"up", "ancestors visited on the way up"},
       {"leaf", "leaves visited"},
       {"tests", "triangle tests"},
       {"skipped", "tests that the mailbox saved"}}};
  return kAovs;
}

Raster aov_data(const RenderResult& result, const std::string& name) {
  if (name == "depth") return result.depth;
  if (name == "normal") return result.normal;
  if (name == "albedo") return result.albedo;
  if (name == "down") return result.down;
  if (name == "up") return result.up;
  if (name == "leaf") return result.leaf;
  if (name == "tests") return result.tests;
  if (name == "skipped") return result.skipped;
  if (name == "steps") {
    Raster sum = result.down;
    for (std::size_t i = 0; i < sum.data.size(); ++i) sum.data[i] += result.up.data[i] + result.leaf.data[i];
    return sum;
  }
  if (name == "id") throw Error("triangle ids do not fit floats: they are RenderResult::id");
  throw Error("there is no AOV '" + name + "'");
}

Raster aov_picture(const RenderResult& result, const std::string& name, ColorMap map) {
  const Raster data = name == "id" ? result.depth : aov_data(result, name);  // of ids only the size is looked at
  if (name == "depth") return heat_map(data, ColorMap::kViridis, "depth");
  if (name != "normal" && name != "albedo" && name != "id") return heat_map(data, map, name + " per ray");
  Raster picture(data.width, data.height, 3);
  for (int y = 0; y < data.height; ++y) {
    for (int x = 0; x < data.width; ++x) {
      const std::uint32_t id =
          result.id[static_cast<std::size_t>(y) * static_cast<std::size_t>(data.width) + static_cast<std::size_t>(x)];
      glm::vec3 color(0.16f);
      if (name == "albedo") {
        color = srgb_encode(data.rgb(x, y));
      } else if (id != kNone) {
        color = name == "id" ? id_color(id) : data.rgb(x, y) * 0.5f + 0.5f;
      }
      picture.set_rgb(x, y, color);
    }
  }
  return picture;
}

}  // namespace retrace
