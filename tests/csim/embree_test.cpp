// Golden against Embree 3 (float), on every scene of the project and the real model where it is installed: the same
// hits outside a band about the edges. Embree computes in float32 (24 bits), so the band and the depth tolerance are
// what float leaves: kBand.
#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "golden/compare/compare.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

constexpr double kBand = 0x1p-17;  // 64 units in the last place of a float of magnitude 1 to 2

class EmbreeScene {
 public:
  explicit EmbreeScene(const GridScene& scene) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    const std::size_t count = scene.triangles.size();
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), count));
    for (std::size_t i = 0; i < count; ++i)
      for (unsigned v = 0; v < 3; ++v) {
        indices[3 * i + v] = static_cast<unsigned>(3 * i + v);
        // A code of up to 25 bits may round to 24: part of the band.
        for (int axis = 0; axis < 3; ++axis)
          vertices[9 * i + 3 * v + axis] = static_cast<float>(scene.triangles[i].vertices[v][axis] * 0x1p-24);
      }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// Index of the triangle hit, or kNone; t in grid units.
  std::uint32_t trace(const contract::RayRecord& ray, double& t) const {
    RTCRayHit query{};
    query.ray.org_x = static_cast<float>(ray.origin[0] * 0x1p-24);
    query.ray.org_y = static_cast<float>(ray.origin[1] * 0x1p-24);
    query.ray.org_z = static_cast<float>(ray.origin[2] * 0x1p-24);
    query.ray.dir_x = static_cast<float>(ray.direction[0] * 0x1p-26);
    query.ray.dir_y = static_cast<float>(ray.direction[1] * 0x1p-26);
    query.ray.dir_z = static_cast<float>(ray.direction[2] * 0x1p-26);
    query.ray.tfar = static_cast<float>(ray.t_max * 0x1p-24);
    query.ray.mask = ~0u;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &query);
    t = query.ray.tfar;
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kNone : query.hit.primID;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

/// Is the ray within the band of an edge of the triangle, nearly parallel to it, or is t at an end of the ray?
bool doubtful(const contract::RayRecord& ray, const GridTriangle& triangle) {
  const auto exact = intersect_exactly(ray, triangle);
  return std::abs(exact.outside) < kBand || exact.dz < 0x1p-10 || exact.t < kBand / exact.dz ||
         std::abs(exact.t - ray.t_max * 0x1p-24) < kBand / exact.dz;
}

class EmbreeTest : public testing::TestWithParam<const char*> {};

TEST_P(EmbreeTest, same_hits_as_golden_outside_the_band) {
  const std::uint64_t seed = test_seed();
  const std::string name = GetParam();
  if (name.ends_with(".glb") && !std::filesystem::exists(name)) GTEST_SKIP() << name << " is not installed";
  const GridScene scene = snap(flatten(open_scene(name)));
  const MemoryImage image = build_kd(scene);
  auto golden = make_golden_engine(scene, image);
  const EmbreeScene embree(scene);
  Random random(seed);
  auto rays = make_test_rays(scene, image, 18000, random);
  for (auto& ray : rays) ray.record.any = 0;
  std::vector<Hit> hits(rays.size());
  golden->trace(rays, hits, {}, {});
  std::size_t same = 0, band = 0;
  const auto triangle_of = [&](std::uint32_t id) -> const GridTriangle& {
    return *std::lower_bound(scene.triangles.begin(), scene.triangles.end(), id,
                             [](const GridTriangle& a, std::uint32_t b) { return a.id < b; });
  };
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays[i].outside) continue;
    const auto& ray = rays[i].record;
    double t = 0;
    const std::uint32_t index = embree.trace(ray, t);
    const std::uint32_t id = index == kNone ? contract::kNoTriangle : scene.triangles[index].id;
    if (id == hits[i].id) {
      ++same;
      continue;
    }
    bool explained = (hits[i].hit() && doubtful(ray, triangle_of(hits[i].id))) ||
                     (index != kNone && doubtful(ray, scene.triangles[index]));
    if (hits[i].hit() && index != kNone) {  // coincident or touching triangles: the depths agree
      const double dz = std::min(intersect_exactly(ray, triangle_of(hits[i].id)).dz,
                                 intersect_exactly(ray, scene.triangles[index]).dz);
      explained = explained || std::abs(t - hits[i].t) < kBand / dz;
    }
    ++band;
    ASSERT_TRUE(explained) << name << " seed " << seed << " ray " << i << " golden " << hits[i].id << " t " << hits[i].t
                           << " embree " << id << " t " << t;
  }
  RecordProperty("same", static_cast<int>(same));
  RecordProperty("band", static_cast<int>(band));
  EXPECT_GT(same, band);
}

INSTANTIATE_TEST_SUITE_P(Scenes, EmbreeTest,
                         testing::Values("box", "room:detail=0.1", "sphere:cells=40", "knot:along=300,around=24",
                                         "field", "needles", "slivers", "coincident", "degenerate", "one", "none",
                                         RETRACE_MODELS_DIR "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"));

}  // namespace
}  // namespace retrace
