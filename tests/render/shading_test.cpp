// Surfaces, sample points and lights against what can be worked out by hand or by counting.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "golden/render/lighting.hpp"
#include "golden/render/sampling.hpp"
#include "golden/render/surface.hpp"
#include "golden/tree/kd_builder.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A scene of loose triangles in one mesh, each with the same material.
struct Model {
  Scene scene;
  WorldTriangles world;
  GridScene grid;
  Primitive& primitive() { return scene.meshes[0].primitives[0]; }

  Model() {
    scene.meshes.resize(1);
    scene.meshes[0].primitives.resize(1);
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.roots = {0};
    scene.materials.resize(1);
    scene.materials[0].metallic = 0.0f;
    primitive().material = 0;
  }
  void triangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const auto first = static_cast<std::uint32_t>(primitive().positions.size());
    for (const glm::vec3& p : {a, b, c}) primitive().positions.push_back(p);
    primitive().triangles.push_back({first, first + 1, first + 2});
  }
  void finish() {
    world = flatten(scene);
    grid = snap(world);
  }
};

Hit hit_of(std::uint32_t id, double u, double v) {
  Hit hit;
  hit.status = contract::kStatusHit;
  hit.id = id;
  hit.u = u;
  hit.v = v;
  return hit;
}

TEST(Textures, BilinearBetweenTexelCentres) {
  Texture texture;
  texture.width = 2;
  texture.height = 2;
  texture.texels = {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, {1, 1, 0, 0}};
  texture.wrap_u = texture.wrap_v = Texture::Wrap::kClamp;
  EXPECT_EQ(sample_texture(texture, {0.25f, 0.25f}), texture.texels[0]);
  EXPECT_EQ(sample_texture(texture, {0.75f, 0.75f}), texture.texels[3]);
  EXPECT_EQ(sample_texture(texture, {0.5f, 0.5f}), glm::vec4(0.5f, 0.5f, 0.0f, 0.75f));
  EXPECT_EQ(sample_texture(texture, {-9.0f, 0.25f}), texture.texels[0]);
  EXPECT_EQ(sample_texture(texture, {9.0f, 0.25f}), texture.texels[1]);
  texture.wrap_u = Texture::Wrap::kRepeat;
  EXPECT_EQ(sample_texture(texture, {0.0f, 0.25f}).r, 0.5f);  // across the seam
  EXPECT_EQ(sample_texture(texture, {3.25f, 0.25f}), texture.texels[0]);
  EXPECT_EQ(sample_texture(texture, {-0.25f, 0.25f}), texture.texels[1]);
  texture.wrap_u = Texture::Wrap::kMirror;
  EXPECT_EQ(sample_texture(texture, {0.0f, 0.25f}), texture.texels[0]);
  EXPECT_EQ(sample_texture(texture, {1.25f, 0.25f}), texture.texels[1]);
  EXPECT_EQ(sample_texture(texture, {1.75f, 0.25f}), texture.texels[0]);
}

TEST(Textures, SurviveAnyCoordinate) {
  Texture texture;
  texture.width = 3;
  texture.height = 1;
  texture.texels.assign(3, glm::vec4(0.5f));
  for (const auto wrap : {Texture::Wrap::kRepeat, Texture::Wrap::kClamp, Texture::Wrap::kMirror}) {
    texture.wrap_u = texture.wrap_v = wrap;
    for (const float x : {INFINITY, -INFINITY, NAN, 1e30f, -3e38f, 1e-38f, 16777217.0f}) {
      EXPECT_EQ(sample_texture(texture, {x, -x}), glm::vec4(0.5f));
    }
  }
  EXPECT_EQ(sample_texture(Texture{}, {0.5f, 0.5f}), glm::vec4(1.0f));
}

// u and v of a hit belong to vertices of the record's order. Points made from them must be the points they were made for.
TEST(SurfacePoints, BarycentricsBelongToTheVerticesOfTheFile) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  Model model;
  for (int i = 0; i < 300; ++i) {
    std::array<glm::vec3, 3> p;
    for (glm::vec3& q : p) q = {random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)};
    model.triangle(p[0], p[1], p[2]);
  }
  for (std::size_t i = 0; i < model.primitive().positions.size(); ++i) {
    model.primitive().texcoords[0].push_back({i % 3 == 1 ? 1.0f : 0.0f, i % 3 == 2 ? 1.0f : 0.0f});
  }
  model.finish();
  const Surfaces surfaces(model.scene, model.world, model.grid);
  std::array<int, 3> orders{};
  for (const GridTriangle& triangle : model.grid.triangles) {
    std::array<int, 3> order{};
    make_unit_triangle(triangle, &order);
    ++orders[static_cast<std::size_t>(order[1])];
    const double u = random.real(0, 0.5), v = random.real(0, 0.5);
    std::array<double, 3> weights{};
    weights[static_cast<std::size_t>(order[0])] = 1 - u - v;
    weights[static_cast<std::size_t>(order[1])] = u;
    weights[static_cast<std::size_t>(order[2])] = v;
    glm::dvec3 expected(0.0);
    for (std::size_t k = 0; k < 3; ++k) expected += model.world.vertices[triangle.id][k] * weights[k];
    const SurfacePoint point = surfaces.at(hit_of(triangle.id, u, v), {0, 0, 1});
    ASSERT_LT(glm::length(point.position - surfaces.from_world(expected)), 1e-6) << triangle.id;
    ASSERT_NEAR(point.texcoord.x, weights[1], 1e-6) << triangle.id;
    ASSERT_NEAR(point.texcoord.y, weights[2], 1e-6) << triangle.id;
    const glm::dvec3 b = surfaces.file_barycentrics(hit_of(triangle.id, u, v));
    ASSERT_EQ(b.y, weights[1]);
    ASSERT_EQ(b.z, weights[2]);
    ASSERT_LT(glm::dot(point.geometric, glm::dvec3(0, 0, 1)), 1e-12);
  }
  for (const int count : orders) EXPECT_GT(count, 30);  // every permutation was there
}

TEST(SurfacePoints, UnknownTrianglesAreAnError) {
  Model model;
  model.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0});  // degenerate
  model.finish();
  const Surfaces surfaces(model.scene, model.world, model.grid);
  EXPECT_NO_THROW(surfaces.at(hit_of(0, 0.1, 0.1), {0, 0, -1}));
  for (const std::uint32_t id : {1u, 2u, 0xffffffffu})
    EXPECT_THROW(surfaces.at(hit_of(id, 0.1, 0.1), {0, 0, -1}), Error) << id;
}

TEST(SurfacePoints, NormalsTurnTowardsTheRay) {
  Model model;
  model.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.primitive().normals.assign(3, glm::normalize(glm::vec3(0.2f, 0.0f, 1.0f)));
  model.scene.materials[0].emissive = glm::vec3(1.0f);
  model.finish();
  const Surfaces surfaces(model.scene, model.world, model.grid);
  const SurfacePoint front = surfaces.at(hit_of(0, 0.2, 0.2), {0, 0, -1}),
                     back = surfaces.at(hit_of(0, 0.2, 0.2), {0, 0, 1});
  EXPECT_NEAR(front.geometric.z, 1, 1e-12);
  EXPECT_NEAR(front.normal.x, 0.2 / std::sqrt(1.04), 1e-6);
  EXPECT_NEAR(back.geometric.z, -1, 1e-12);
  EXPECT_NEAR(back.normal.x, -0.2 / std::sqrt(1.04), 1e-6);
  EXPECT_EQ(front.emissive, glm::vec3(1.0f));
  EXPECT_EQ(back.emissive, glm::vec3(0.0f));  // single-sided: shines to the front
  EXPECT_NEAR(surfaces.leave(front, {0, 0, 1}, 1.0).origin.z, surfaces.offset(), 1e-12);
}

TEST(SurfacePoints, MirroredNodesTurnTheFront) {
  Model model;
  model.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.scene.nodes[0].scale = {-1, 1, 1};
  model.scene.materials[0].emissive = glm::vec3(1.0f);
  model.finish();
  const Surfaces surfaces(model.scene, model.world, model.grid);
  EXPECT_NEAR(surfaces.front(0).z, 1.0, 1e-12);
  EXPECT_EQ(surfaces.at(hit_of(0, 0.2, 0.2), {0, 0, -1}).emissive, glm::vec3(1.0f));
}

TEST(SurfacePoints, AlphaIsWhatTheModeSays) {
  Model model;
  model.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.finish();
  Material& material = model.scene.materials[0];
  const auto alpha = [&](Material::Alpha mode, float a) {
    material.alpha = mode;
    material.base_color.a = a;
    const Surfaces surfaces(model.scene, model.world, model.grid);
    EXPECT_EQ(surfaces.transparent(), mode != Material::Alpha::kOpaque);
    return surfaces.at(hit_of(0, 0.1, 0.1), {0, 0, -1}).base.a;
  };
  EXPECT_EQ(alpha(Material::Alpha::kOpaque, 0.2f), 1.0f);
  EXPECT_EQ(alpha(Material::Alpha::kMask, 0.49f), 0.0f);
  EXPECT_EQ(alpha(Material::Alpha::kMask, 0.5f), 1.0f);
  EXPECT_EQ(alpha(Material::Alpha::kBlend, 0.25f), 0.25f);
}

TEST(SurfacePoints, MetallicAndRoughnessComeFromTheirTexture) {
  Model model;
  model.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.finish();
  Texture factors;  // left and right texel differ
  factors.width = 2;
  factors.height = 1;
  factors.texels = {{1, 0.5f, 0.0f, 1}, {1, 0.25f, 1.0f, 1}};
  factors.wrap_u = factors.wrap_v = Texture::Wrap::kClamp;
  model.scene.textures.push_back(factors);
  Material& material = model.scene.materials[0];
  material.metallic = 0.5f;
  material.roughness = 0.8f;
  material.surface_texture = 0;
  const Surfaces surfaces(model.scene, model.world, model.grid);
  const auto at = [&](float u) {
    material.surface_transform.offset = {u, 0.5f};
    material.surface_transform.scale = {0, 0};
    return surfaces.at(hit_of(0, 0.2, 0.2), {0, 0, -1});
  };
  EXPECT_FLOAT_EQ(at(0.0f).metallic, 0.0f);
  EXPECT_FLOAT_EQ(at(0.0f).roughness, 0.4f);
  EXPECT_FLOAT_EQ(at(1.0f).metallic, 0.5f);
  EXPECT_FLOAT_EQ(at(1.0f).roughness, 0.2f);
}

// Each of the 2^k elementary boxes holds exactly one of the first 2^k points, whatever the seed: a (0, 2)-sequence.
TEST(Sampling, IsANetInEveryElementaryBox) {
  for (const std::uint32_t seed : {0u, 1u, 0xdeadbeefu}) {
    for (int split = 0; split <= 6; ++split) {
      const int columns = 1 << split, rows = 1 << (6 - split);
      std::vector<int> count(64, 0);
      for (std::uint32_t i = 0; i < 64; ++i) {
        const glm::dvec2 p = sample_2d(i, seed);
        ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
        ++count[static_cast<std::size_t>(static_cast<int>(p.y * rows) * columns + static_cast<int>(p.x * columns))];
      }
      for (const int n : count) ASSERT_EQ(n, 1) << "seed " << seed << " split " << split;
    }
  }
}

TEST(Sampling, HemisphereIsCosineWeighted) {
  const glm::dvec3 n = glm::normalize(glm::dvec3(1, -2, 0.5));
  constexpr int kCount = 4096;
  double cosines = 0;
  glm::dvec3 sum(0.0);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const glm::dvec3 d = to_cosine_hemisphere(sample_2d(i, 7), n);
    ASSERT_NEAR(glm::length(d), 1, 1e-9);
    ASSERT_GE(glm::dot(d, n), 0);
    cosines += glm::dot(d, n);
    sum += d;
  }
  EXPECT_NEAR(cosines / kCount, 2.0 / 3.0, 2e-3);
  EXPECT_LT(glm::length(sum / double(kCount) - n * (2.0 / 3.0)), 3e-3);
}

TEST(Skies, AverageIsTheMeanOverTheHemisphere) {
  const Sky sky{{0.2f, 0.5f, 1.0f}, {0.4f, 0.3f, 0.1f}};
  for (const glm::dvec3 n : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0, 0), glm::normalize(glm::dvec3(1, -1, 2))}) {
    glm::vec3 sum(0.0f);
    constexpr int kCount = 4096;
    for (std::uint32_t i = 0; i < kCount; ++i)
      sum += sky.radiance(to_cosine_hemisphere(sample_2d(i, 3), n)) / float(kCount);
    EXPECT_LT(glm::length(sum - sky.average(n)), 2e-3f);
  }
}

/// A floor in the plane y = 0 under whatever lights a test adds.
struct Lit : Model {
  Lit() {
    triangle({-4, 0, -4}, {-4, 0, 4}, {4, 0, -4});
    triangle({4, 0, 4}, {4, 0, -4}, {-4, 0, 4});
  }
  void light(const Light& light, const glm::dvec3& where, const glm::dquat& rotation = {1, 0, 0, 0}) {
    Node node;
    node.translation = where;
    node.rotation = rotation;
    node.light = static_cast<std::uint32_t>(scene.lights.size());
    scene.lights.push_back(light);
    scene.roots.push_back(static_cast<std::uint32_t>(scene.nodes.size()));
    scene.nodes.push_back(node);
  }
  /// Mean over `count` samples of the irradiance at a point of the floor.
  double irradiance(const glm::dvec3& where, int count = 1, int area_samples = 1) {
    finish();
    const Surfaces surfaces(scene, world, grid);
    const Lighting lighting(surfaces, default_view(scene, world), LightChoice::kScene, false);
    SurfacePoint point;
    point.position = surfaces.from_world(where);
    point.geometric = point.normal = {0, 1, 0};
    std::vector<LightSample> samples;
    double sum = 0;
    for (int i = 0; i < count; ++i) {
      lighting.sample(point, area_samples, static_cast<std::uint32_t>(i), 99, samples);
      EXPECT_LE(samples.size(), static_cast<std::size_t>(lighting.max_samples(area_samples)));
      for (const LightSample& s : samples) sum += s.irradiance.g * std::max(0.0, s.direction.y);
    }
    return sum / count;
  }
};

const glm::dquat kDownwards = glm::angleAxis(-kPi / 2, glm::dvec3(1, 0, 0));  // turns -z to -y

TEST(Lights, PointLightFallsWithTheSquare) {
  Lit lit;
  Light light;
  light.intensity = 10;
  lit.light(light, {0, 2, 0});
  EXPECT_NEAR(lit.irradiance({0, 0, 0}), 10.0 / 4, 1e-4);
  EXPECT_NEAR(lit.irradiance({2, 0, 0}), 10.0 / 8 * std::sqrt(0.5), 1e-4);
  lit.scene.lights[0].range = 2.5f;
  EXPECT_NEAR(lit.irradiance({0, 0, 0}), 2.5 * (1 - std::pow(2 / 2.5, 4)), 1e-4);
  EXPECT_EQ(lit.irradiance({2, 0, 0}), 0);
}

TEST(Lights, SpotLightHasACone) {
  Lit lit;
  Light light;
  light.type = Light::Type::kSpot;
  light.intensity = 4;
  light.inner_cone = 0.2f;
  light.outer_cone = 0.5f;
  lit.light(light, {0, 2, 0}, kDownwards);
  const auto at_angle = [&](double a) { return lit.irradiance({2 * std::tan(a), 0, 0}) / (std::pow(std::cos(a), 3)); };
  EXPECT_NEAR(at_angle(0.0), 1.0, 1e-4);
  EXPECT_NEAR(at_angle(0.19), 1.0, 1e-4);
  const double between = (std::cos(0.35) - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5));
  EXPECT_NEAR(at_angle(0.35), between * between, 1e-4);
  EXPECT_EQ(at_angle(0.51), 0);
}

TEST(Lights, DirectionalLightIsTheSameEverywhere) {
  Lit lit;
  Light light;
  light.type = Light::Type::kDirectional;
  light.intensity = 3;
  lit.light(light, {5, 1, 7}, kDownwards);
  EXPECT_NEAR(lit.irradiance({0, 0, 0}), 3, 1e-6);
  EXPECT_NEAR(lit.irradiance({3, 0, -2}), 3, 1e-6);
}

// A square lamp over the floor: E = radiance times the form factor of a parallel rectangle above the point, by summation.
TEST(Lights, EmissiveTrianglesGiveTheIrradianceOfTheirArea) {
  Lit lit;
  Material lamp;
  lamp.emissive = glm::vec3(2.0f);
  lit.scene.materials.push_back(lamp);
  Primitive square;
  square.material = 1;
  square.positions = {{-0.5f, 1, -0.5f}, {0.5f, 1, -0.5f}, {0.5f, 1, 0.5f}, {-0.5f, 1, 0.5f}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};  // faces down
  lit.scene.meshes[0].primitives.push_back(square);
  for (const glm::dvec3 where : {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0.5)}) {
    double exact = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const glm::dvec3 to = glm::dvec3((i + 0.5) / kSteps - 0.5, 1, (j + 0.5) / kSteps - 0.5) - where;
        exact += 2.0 / std::pow(glm::dot(to, to), 2) / (kSteps * kSteps);
      }
    }
    EXPECT_NEAR(lit.irradiance(where, 1024), exact, 0.01 * exact);
    EXPECT_NEAR(lit.irradiance(where, 256, 4), exact, 0.01 * exact);
  }
  std::swap(lit.scene.meshes[0].primitives[1].triangles[0].y, lit.scene.meshes[0].primitives[1].triangles[0].z);
  std::swap(lit.scene.meshes[0].primitives[1].triangles[1].y, lit.scene.meshes[0].primitives[1].triangles[1].z);
  EXPECT_EQ(lit.irradiance({0, 0, 0}, 64), 0);  // faces up now
}

TEST(Lights, ManyLightsAreSampledWithoutBias) {
  Lit lit;
  Random random(test_seed());
  double exact = 0;
  for (int i = 0; i < 40; ++i) {
    Light light;
    light.intensity = static_cast<float>(random.real(0.1, 5));
    const glm::dvec3 where(random.real(-3, 3), random.real(0.5, 3), random.real(-3, 3));
    lit.light(light, where);
    exact += light.intensity * where.y / std::pow(glm::length(where), 3);
  }
  EXPECT_NEAR(lit.irradiance({0, 0, 0}, 2048), exact, 0.02 * exact);
}

TEST(Lights, RigIsTakenOnlyWhereThereIsNoLight) {
  Lit dark;
  dark.finish();
  const Surfaces surfaces(dark.scene, dark.world, dark.grid);
  const ViewCamera camera = default_view(dark.scene, dark.world);
  EXPECT_TRUE(Lighting(surfaces, camera, LightChoice::kAuto, false).is_rig());
  EXPECT_FALSE(Lighting(surfaces, camera, LightChoice::kScene, false).is_rig());
  EXPECT_EQ(Lighting(surfaces, camera, LightChoice::kScene, false).describe(), "none");
  EXPECT_NE(Lighting(surfaces, camera, LightChoice::kAuto, true).describe(),
            Lighting(surfaces, camera, LightChoice::kAuto, false).describe());
  Lit lit;
  lit.light(Light{}, {0, 1, 0});
  lit.finish();
  const Surfaces with(lit.scene, lit.world, lit.grid);
  EXPECT_FALSE(Lighting(with, camera, LightChoice::kAuto, false).is_rig());
  EXPECT_TRUE(Lighting(with, camera, LightChoice::kRig, false).is_rig());
}

}  // namespace
}  // namespace retrace
