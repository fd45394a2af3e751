// All structures of the lab, the two-level one too, on all scenes of the project and on the glTF models of Debian's
// assimp-testmodels: the hits of brute force bit for bit, and, where Embree is installed, Embree's hits outside a band
// around edges. Rays that look for trouble, and those that `retrace lab` measures with: primary, shadow, one bounce.
//
// Embree works in float32. Snapped vertices and ray origins fit a float exactly; directions lose their last bits, which
// moves a ray by less than 2^-22 within the box, and its edge test is exact to about as much. So a different triangle
// is accepted if the ray passes an edge of the nearer one within kBand (the other has overlooked it), or if both lie at
// the same depth within kBand / |cos| of each (overlapping triangles); everything else is a violation. Rays that graze
// the nearer triangle (|cos| < kGrazingCos) are counted apart. What Embree alone sees at an edge or so close to the
// start of the ray may be there or not; what lies beyond it must agree. Occlusion rays: the answer must be whether the same ray has a nearest hit, and that
// one is compared.
//
// RETRACE_ORACLE_FULL=1 takes the scenes at full size and ten times the rays. RETRACE_ORACLE_SCENES (separated by
// spaces) takes others.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <sstream>

#include "golden/accel/catalogue.hpp"
#include "golden/accel/probe.hpp"
#include "golden/accel/two_level.hpp"
#include "golden/gltf/animation.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "scenes/animated_scenes.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/test_rays.hpp"
#include "testbench/lab/lab_scene.hpp"
#include "tests/accel/against_brute_force.hpp"
#ifdef RETRACE_EMBREE
#include <embree3/rtcore.h>
#endif

namespace retrace::accel {
namespace {

constexpr double kBand = 0x1p-19, kGrazingCos = 0x1p-10;

bool full() { return std::getenv("RETRACE_ORACLE_FULL") != nullptr; }

#ifdef RETRACE_EMBREE
class EmbreeOracle {
 public:
  explicit EmbreeOracle(const TriangleSet& set) : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    if (!set.triangles.empty()) {
      RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                   RTC_FORMAT_FLOAT3, 12, set.triangles.size() * 3));
      auto* indices = static_cast<unsigned*>(
          rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, set.triangles.size()));
      for (std::size_t i = 0; i < set.triangles.size() * 3; ++i) {
        for (int a = 0; a < 3; ++a)
          vertices[3 * i + static_cast<std::size_t>(a)] = static_cast<float>(set.triangles[i / 3].vertices[i % 3][a]);
        indices[i] = static_cast<unsigned>(i);
      }
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene_, geometry);
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(scene_);
  }
  ~EmbreeOracle() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  /// Number of the triangle in the set, or -1; its depth.
  std::int64_t trace(const Ray& ray, double& t, double t_min = 0.0) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query{};
    query.ray.org_x = static_cast<float>(ray.origin.x), query.ray.org_y = static_cast<float>(ray.origin.y),
    query.ray.org_z = static_cast<float>(ray.origin.z);
    query.ray.dir_x = static_cast<float>(ray.direction.x), query.ray.dir_y = static_cast<float>(ray.direction.y),
    query.ray.dir_z = static_cast<float>(ray.direction.z);
    query.ray.tnear = static_cast<float>(t_min);
    query.ray.tfar = static_cast<float>(ray.t_max);
    query.ray.mask = 0xffffffffu;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &query);
    t = static_cast<double>(query.ray.tfar);
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<std::int64_t>(query.hit.primID);
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

double edge_distance(const Ray& ray, const Triangle& triangle) {
  double nearest = kInfinity;
  const glm::dvec3 d = glm::normalize(ray.direction);
  for (int k = 0; k < 3; ++k) {
    // Distance of the ray's line from the edge, in the plane across the ray.
    const auto flat = [&](const glm::dvec3& p) { return p - glm::dot(p, d) * d; };
    const glm::dvec3 a = flat(triangle.vertices[k] - ray.origin),
                     e = flat(triangle.vertices[(k + 1) % 3] - ray.origin) - a;
    const double ee = glm::dot(e, e), s = ee > 0.0 ? std::clamp(-glm::dot(a, e) / ee, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, glm::length(a + s * e));
  }
  return nearest;
}

/// |cos| of the angle between ray and normal.
double incidence(const Ray& ray, const Triangle& triangle) {
  const glm::dvec3 n =
      glm::cross(triangle.vertices[1] - triangle.vertices[0], triangle.vertices[2] - triangle.vertices[0]);
  return std::abs(glm::dot(n, ray.direction)) / (glm::length(n) * glm::length(ray.direction));
}

/// What moves a ray by kBand sideways moves the hit so far along it.
double depth_band(const Ray& ray, const Triangle* triangle) {
  return triangle ? kBand / std::max(incidence(ray, *triangle), kGrazingCos) : 0.0;
}

struct EmbreeCount {
  std::size_t same = 0, edge = 0, depth = 0, grazing = 0, violations = 0;
};

void compare_with_embree(const EmbreeOracle& oracle, const TriangleSet& set, const Ray& ray, const Hit& hit,
                         EmbreeCount& count, const std::string& where, double t_min = 0.0) {
  double t;
  const std::int64_t index = oracle.trace(ray, t, t_min);
  const Triangle* theirs = index < 0 ? nullptr : &set.triangles[static_cast<std::size_t>(index)];
  const Triangle* ours = nullptr;
  if (hit.hit()) {
    const auto found = std::lower_bound(set.triangles.begin(), set.triangles.end(), hit.id,
                                        [](const Triangle& x, std::uint32_t id) { return x.id < id; });
    if (found == set.triangles.end() || found->id != hit.id) {  // no area on this grid: all of it is edge
      ++count.edge;
      return;
    }
    ours = &*found;
  }
  // The hit that one of them must have overlooked if they differ.
  const Triangle* nearer = ours && (!theirs || hit.t < t) ? ours : theirs;
  const auto edge_of = [&](const Triangle* x) { return x && edge_distance(ray, *x) < kBand; };
  const double depth = depth_band(ray, ours) + depth_band(ray, theirs);
  const auto beyond = [&] {
    compare_with_embree(oracle, set, ray, hit, count, where + ", beyond " + std::to_string(theirs->id), t + depth);
  };
  if (ours == theirs && (!ours || std::abs(t - hit.t) < depth)) {
    ++count.same;
  } else if (ours && theirs && std::abs(t - hit.t) < depth) {
    ++(edge_of(ours) || edge_of(theirs) ? count.edge : count.depth);
  } else if (edge_of(nearer)) {
    ++count.edge;
    if (nearer == theirs) beyond();
  } else if (incidence(ray, *nearer) < kGrazingCos) {
    ++count.grazing;
  } else if ((!ours && std::abs(t - ray.t_max) < depth) || (!theirs && std::abs(hit.t - ray.t_max) < depth)) {
    ++count.depth;  // at the very end of the ray
  } else if (theirs && t < depth) {
    ++count.depth;  // at its start
    beyond();
  } else {
    ++count.violations;
    ADD_FAILURE() << where << ": " << (ours ? std::to_string(ours->id) : "miss") << " at " << hit.t << ", Embree "
                  << (theirs ? std::to_string(theirs->id) : "miss") << " at " << t;
  }
}
#endif

/// Half of `count` rays look for trouble, half are the lab's.
std::vector<GridRay> rays_for(const Scene& scene, const GridScene& grid, const MemoryImage& image, std::size_t count,
                              Random& random, std::array<std::size_t, lab::kKinds>& kinds) {
  std::vector<GridRay> rays;
  for (const GridRay& r : make_test_rays(grid, image, count / 2, random))
    if (!r.outside) rays.push_back(r);
  lab::LabScene source{scene, flatten(scene), grid, image};
  lab::LabOptions options;
  // A pixel gives up to three rays.
  options.height = std::max(4, static_cast<int>(std::sqrt(static_cast<double>(count) / 2.0 / 3.0 * 0.75)));
  options.width = options.height * 4 / 3;
  std::string camera, light;
  const auto batches = lab::make_rays(source, options, camera, light);
  for (int kind = 0; kind < lab::kKinds; ++kind) {
    kinds[kind] = batches[kind].grid.size();
    rays.insert(rays.end(), batches[kind].grid.begin(), batches[kind].grid.end());
  }
  return rays;
}

#ifdef RETRACE_EMBREE
/// `nearest` answers what an occlusion ray would hit first.
void compare_all(const TriangleSet& set, const std::vector<Ray>& rays, const std::vector<Hit>& hits,
                 const Structure& nearest, const std::function<Ray(const Ray&)>& into, const std::string& name) {
  const EmbreeOracle oracle(set);
  EmbreeCount count, shadow;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::string where = name + ", ray " + std::to_string(i);
    Ray ray = rays[i];
    Hit hit = hits[i];
    if (ray.any) {
      ray.any = false;
      Probe probe;
      hit = nearest.trace(into(ray), probe);
      ASSERT_EQ(hits[i].hit(), hit.hit()) << where;
    }
    compare_with_embree(oracle, set, ray, hit, rays[i].any ? shadow : count, where);
    if (count.violations + shadow.violations > 3) break;
  }
  const auto print = [](const char* kind, const EmbreeCount& c) {
    std::printf("; Embree, %s: %zu same, %zu edge, %zu depth, %zu grazing, %zu violations", kind, c.same, c.edge,
                c.depth, c.grazing, c.violations);
  };
  print("nearest", count);
  print("occlusion", shadow);
}
#endif

/// A scene with everything that `scene` holds, standing still.
AnimatedScene at_rest(const Scene& scene) {
  AnimatedScene still(scene, {});
  still.at(0.0);
  return still;
}

void check_two_level(const AnimatedScene& scene, const GridScene& grid, const std::vector<Ray>& rays,
                     const std::string& name) {
  std::optional<TwoLevel> two;
  try {
    two.emplace(scene);
  } catch (const Error& e) {
    std::printf("  two-level: %s\n", e.what());
    ASSERT_NE(std::string(e.what()).find("singular"), std::string::npos);
    return;
  }
  const auto to_world = [&](const Ray& r) {
    return Ray{grid.transform.to_world(r.origin), r.direction / grid.transform.scale, r.t_max, r.any};
  };
  std::vector<Hit> hits;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Probe probe;
    const Ray world = to_world(rays[i]);
    const Hit expected = two->brute_force(world, probe);
    hits.push_back(two->trace(world, probe));
    if (world.any) {
      ASSERT_EQ(expected.hit(), hits[i].hit()) << "two-level, ray " << i;
    } else {
      ASSERT_EQ(expected, hits[i]) << "two-level, ray " << i;
    }
  }
  std::printf("  two-level: %zu instances of %zu objects, equal to brute force", two->instances(), two->objects());
#ifdef RETRACE_EMBREE
  compare_all(from_grid(grid), rays, hits, *two, to_world, name + ", two-level");
#endif
  std::printf("\n");
}

void check_scene(const std::string& name, const AnimatedScene& animated, std::size_t ray_count, Random& random) {
  SCOPED_TRACE(name);
  const Scene& scene = animated.scene();
  const GridScene grid = snap(flatten(scene));
  const MemoryImage image = build_kd(grid);
  std::array<std::size_t, lab::kKinds> kinds;
  std::vector<Ray> rays;
  for (const GridRay& r : rays_for(scene, grid, image, ray_count, random, kinds)) rays.push_back(from_grid(r));
  Workshop workshop(grid);
  Agreement agreement;
  ASSERT_NO_FATAL_FAILURE(compare_with_brute_force(workshop, rays, agreement));
  std::printf("%-28s %7zu triangles, %5zu rays (%zu primary, %zu shadow, %zu bounce), %5zu hits, %zu structures equal",
              name.c_str(), workshop.set().triangles.size(), rays.size(), kinds[0], kinds[1], kinds[2], agreement.hits,
              agreement.techniques);
#ifdef RETRACE_EMBREE
  compare_all(
      workshop.set(), rays, agreement.expected, *make_brute_force(workshop.set()), [](const Ray& r) { return r; },
      name);
#endif
  std::printf("\n");
  check_two_level(animated, grid, rays, name);
}

/// Rays that brute force can afford.
std::size_t affordable(const Scene& scene) {
  std::size_t triangles = 0;
  for (const std::uint32_t node : scene.reachable())
    if (scene.nodes[node].mesh != kNone)
      for (const Primitive& p : scene.meshes[scene.nodes[node].mesh].primitives) triangles += p.triangles.size();
  const double budget = full() ? 2e9 : 4e7;
  return std::clamp<std::size_t>(static_cast<std::size_t>(budget / static_cast<double>(triangles + 1)), 180,
                                 full() ? 20000 : 1800);
}

TEST(Oracle, ScenesOfTheProject) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  std::vector<std::string> specs;
  if (const char* given = std::getenv("RETRACE_ORACLE_SCENES")) {
    std::istringstream list(given);
    for (std::string spec; list >> spec;) specs.push_back(spec);
  } else {
    for (const SceneGenerator& g : scene_generators()) specs.push_back(g.name);
    if (!full()) {
      const std::map<std::string, std::string> smaller{
          {"room", "room:detail=0.05"},        {"sphere", "sphere:cells=24"},    {"knot", "knot:along=180,around=24"},
          {"field", "field:count=100"},        {"needles", "needles:count=500"}, {"slivers", "slivers:count=300"},
          {"coincident", "coincident:cells=8"}};
      for (std::string& spec : specs)
        if (const auto it = smaller.find(spec); it != smaller.end()) spec = it->second;
    }
  }
  for (const std::string& spec : specs) {
    const AnimatedScene scene = at_rest(open_scene(spec));
    check_scene(spec, scene, affordable(scene.scene()), random);
    if (HasFailure()) return;
  }
}

TEST(Oracle, AnimatedScenesOfTheProject) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const std::map<std::string, SceneParameters> parameters{{"carousel", {{"count", 30}, {"detail", full() ? 8 : 2}}},
                                                          {"creatures", {{"detail", full() ? 8 : 3}}}};
  for (const SceneGenerator& g : animated_scene_generators()) {
    const auto it = parameters.find(g.name);
    const auto glb = make_animated_glb(g.name, it == parameters.end() ? SceneParameters{} : it->second);
    Scene loaded = load_gltf_memory(glb);
    Animation animation = load_animation_memory(glb, loaded);
    AnimatedScene scene(std::move(loaded), std::move(animation));
    for (const double part : {0.0, 0.37}) {
      const double time = part * scene.duration();
      check_scene(g.name + " at " + std::to_string(time) + " s", scene, affordable(scene.at(time)), random);
      if (HasFailure()) return;
    }
  }
}

TEST(Oracle, ModelsOfAssimp) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const std::filesystem::path folder = std::filesystem::path(RETRACE_MODELS_DIR) / "glTF2";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not installed";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::size_t checked = 0, moving = 0;
  for (const std::filesystem::path& file : files) {
    Scene scene;
    try {
      scene = load_gltf(file, {.scene = {}, .textures = false});
    } catch (const Error&) {
      continue;  // malformed on purpose; the loader's tests look at those
    }
    if (scene.meshes.empty()) continue;
    const bool small = file.string().find("glTF-Asset-Generator") != std::string::npos;
    const std::size_t rays = small && !full() ? 180 : affordable(scene);
    Animation animation;
    try {
      animation = load_animation(file, scene);
    } catch (const Error& e) {
      std::printf("%s, at rest\n", e.what());
    }
    moving += !animation.tracks.empty();
    AnimatedScene animated(std::move(scene), std::move(animation));
    animated.at(0.37 * animated.duration());
    check_scene(file.stem().string(), animated, rays, random);
    ++checked;
    if (HasFailure()) return;
  }
  std::printf("%zu models, %zu of them animated\n", checked, moving);
  EXPECT_GT(checked, 20u);
  EXPECT_GE(moving, 2u);
}

}  // namespace
}  // namespace retrace::accel
