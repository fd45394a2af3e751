// All structures of the lab on all scenes of the project and on the glTF models of Debian's assimp-testmodels: the hits
// of brute force bit for bit, and, where Embree is installed, Embree's hits outside a band around edges.
//
// Embree works in float32. Snapped vertices and ray origins fit a float exactly; directions lose their last bits, which
// moves a ray by less than 2^-22 within the box, and its edge test is exact to about as much. So a different triangle
// is accepted if the ray passes an edge of either triangle within kBand, or if both lie at the same depth within kDepth
// (overlapping triangles); everything else is a violation. Rays that graze either triangle (|cos| < kGrazingCos) are
// counted apart. A surface within kDepth of the start of the ray may be hit or not; what
// lies beyond it must agree.
//
// RETRACE_ORACLE_FULL=1 takes the scenes at full size and ten times the rays. RETRACE_ORACLE_SCENES (separated by
// spaces) takes others.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "golden/accel/catalogue.hpp"
#include "golden/accel/probe.hpp"
#include "golden/scene/gltf_loader.hpp"
#include "scenes/generators.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/test_rays.hpp"
#ifdef RETRACE_EMBREE
#include <embree3/rtcore.h>
#endif

namespace retrace::accel {
namespace {

constexpr double kBand = 0x1p-19, kDepth = 0x1p-18, kGrazingCos = 0x1p-10;

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

bool grazing(const Ray& ray, const Triangle& triangle) {
  const glm::dvec3 n =
      glm::cross(triangle.vertices[1] - triangle.vertices[0], triangle.vertices[2] - triangle.vertices[0]);
  return std::abs(glm::dot(n, ray.direction)) < kGrazingCos * glm::length(n) * glm::length(ray.direction);
}

struct EmbreeCount {
  std::size_t rays = 0, same = 0, edge = 0, depth = 0, grazing = 0, violations = 0;
};

void compare_with_embree(const EmbreeOracle& oracle, const TriangleSet& set, const Ray& ray, const Hit& hit,
                         EmbreeCount& count, const std::string& where, double t_min = 0.0) {
  ++count.rays;
  double t;
  const std::int64_t index = oracle.trace(ray, t, t_min);
  const Triangle* theirs = index < 0 ? nullptr : &set.triangles[static_cast<std::size_t>(index)];
  const Triangle* ours = nullptr;
  if (hit.hit()) {
    ours = &*std::lower_bound(set.triangles.begin(), set.triangles.end(), hit.id,
                              [](const Triangle& x, std::uint32_t id) { return x.id < id; });
  }
  if (ours == theirs && (!ours || std::abs(t - hit.t) < kDepth)) {
    ++count.same;
  } else if ((ours && edge_distance(ray, *ours) < kBand) || (theirs && edge_distance(ray, *theirs) < kBand)) {
    ++count.edge;
  } else if (ours && theirs && std::abs(t - hit.t) < kDepth) {
    ++count.depth;
  } else if ((ours && grazing(ray, *ours)) || (theirs && grazing(ray, *theirs))) {
    ++count.grazing;
  } else if ((!ours && std::abs(t - ray.t_max) < kDepth) || (!theirs && std::abs(hit.t - ray.t_max) < kDepth)) {
    ++count.depth;  // at the very end of the ray
  } else if (theirs && t_min == 0.0 && std::abs(t) < kDepth) {
    // Embree sees the surface that the ray starts on. What lies beyond must agree.
    EmbreeCount rest;
    compare_with_embree(oracle, set, ray, hit, rest, where + ", beyond the start", kDepth);
    ++count.depth;
    count.violations += rest.violations;
  } else {
    ++count.violations;
    ADD_FAILURE() << where << ": " << (ours ? std::to_string(ours->id) : "miss") << " at " << hit.t << ", Embree "
                  << (theirs ? std::to_string(theirs->id) : "miss") << " at " << t;
  }
}
#endif

void check_scene(const std::string& name, const Scene& scene, std::size_t ray_count, Random& random) {
  SCOPED_TRACE(name);
  const GridScene grid = snap(flatten(scene));
  const MemoryImage image = build_kd(grid);
  std::vector<Ray> rays;
  for (const GridRay& r : make_test_rays(grid, image, ray_count, random))
    if (!r.outside) rays.push_back(from_grid(r));
  Workshop workshop(grid);
  double seconds;
  std::vector<Hit> expected;
  std::size_t hits = 0, techniques = 0;
  for (const Technique& technique : catalogue()) {
    const auto structure = technique.make(workshop, seconds);
    Probe probe;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit hit = structure->trace(rays[i], probe);
      if (technique.key == "brute-force") {
        expected.push_back(hit);
        hits += hit.hit();
      } else if (rays[i].any) {
        ASSERT_EQ(expected[i].hit(), hit.hit()) << technique.key << ", ray " << i;
      } else {
        ASSERT_EQ(expected[i], hit) << technique.key << ", ray " << i;
      }
    }
    ++techniques;
  }
  std::printf("%-28s %7zu triangles, %5zu rays, %5zu hits, %zu structures equal", name.c_str(),
              workshop.set().triangles.size(), rays.size(), hits, techniques);
#ifdef RETRACE_EMBREE
  const EmbreeOracle oracle(workshop.set());
  EmbreeCount count;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays[i].any) continue;
    compare_with_embree(oracle, workshop.set(), rays[i], expected[i], count, name + ", ray " + std::to_string(i));
    if (count.violations > 3) break;
  }
  std::printf("; Embree: %zu same, %zu edge, %zu depth, %zu grazing, %zu violations", count.same, count.edge,
              count.depth, count.grazing, count.violations);
#endif
  std::printf("\n");
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
    const Scene scene = open_scene(spec);
    check_scene(spec, scene, affordable(scene), random);
    if (HasFailure()) return;
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
  std::size_t checked = 0;
  for (const std::filesystem::path& file : files) {
    Scene scene;
    try {
      scene = load_gltf(file, {.scene = {}, .textures = false});
    } catch (const Error&) {
      continue;  // malformed on purpose; the loader's tests look at those
    }
    if (scene.meshes.empty()) continue;
    const bool small = file.string().find("glTF-Asset-Generator") != std::string::npos;
    check_scene(file.stem().string(), scene, small && !full() ? 180 : affordable(scene), random);
    ++checked;
    if (HasFailure()) return;
  }
  EXPECT_GT(checked, 20u);
}

}  // namespace
}  // namespace retrace::accel
