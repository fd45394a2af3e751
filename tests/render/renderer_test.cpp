// Whole pictures, small ones: shadows, occlusion, transparency, AOVs, the same through every engine and for any number of threads.
#include "golden/render/renderer.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "golden/render/tonemap.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/generators.hpp"
#include "testbench/csim/csim_engine.hpp"

namespace retrace {
namespace {

/// A scene from node to pixel.
struct Studio : TracedScene {
  ViewCamera camera;

  explicit Studio(Scene s) : TracedScene(prepare_scene(std::move(s))), camera(default_view(scene, world)) {}
  RenderResult shoot(const RenderOptions& options, Engine* engine = nullptr) {
    const std::unique_ptr<Engine> golden = make_golden_engine(grid, image);
    const Surfaces surfaces(scene, world, grid);
    return render(surfaces, camera, grid.box, engine ? *engine : *golden, options);
  }
};

RenderOptions small(int width = 48, int height = 36, int spp = 1) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.spp = spp;
  return options;
}

glm::vec3 radiance(const RenderResult& result, int x, int y) { return result.color.rgb(x, y); }

double mean(const Raster& raster) {
  double sum = 0;
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) sum += luminance(raster.rgb(x, y));
  }
  return sum / (static_cast<double>(raster.width) * raster.height);
}

/// Squares of side 2 size about (0, 0, z), facing +z, seen by an orthographic camera at z = 10 that shows [-1, 1]^2.
struct Squares {
  Scene scene;

  Squares() {
    scene.cameras.resize(1);
    scene.cameras[0].perspective = false;
    Node node;
    node.camera = 0;
    node.translation = {0, 0, 10};
    scene.nodes.push_back(node);
    scene.roots.push_back(0);
  }
  std::uint32_t square(double size, double z, const glm::vec4& color, glm::dvec2 where = {0, 0}) {
    const auto s = static_cast<float>(size);
    Primitive p;
    p.positions = {{-s, -s, 0}, {s, -s, 0}, {s, s, 0}, {-s, s, 0}};
    p.texcoords[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    p.triangles = {{0, 1, 2}, {0, 2, 3}};
    p.material = static_cast<std::uint32_t>(scene.materials.size());
    Material material;
    material.base_color = color;
    material.metallic = 0.0f;
    scene.materials.push_back(material);
    Mesh mesh;
    mesh.primitives.push_back(p);
    Node node;
    node.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    node.translation = {where, z};
    scene.meshes.push_back(mesh);
    scene.roots.push_back(static_cast<std::uint32_t>(scene.nodes.size()));
    scene.nodes.push_back(node);
    return p.material;
  }
  void sun(const glm::dvec3& from, float lux = 3.14159265f) {
    Light light;
    light.type = Light::Type::kDirectional;
    light.intensity = lux;
    Node node;
    const glm::dvec3 back = glm::normalize(from), right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0.1), back));
    node.has_matrix = true;
    node.matrix = glm::dmat4(glm::dvec4(right, 0), glm::dvec4(glm::cross(back, right), 0), glm::dvec4(back, 0),
                             glm::dvec4(0, 0, 0, 1));
    node.light = static_cast<std::uint32_t>(scene.lights.size());
    scene.lights.push_back(light);
    scene.roots.push_back(static_cast<std::uint32_t>(scene.nodes.size()));
    scene.nodes.push_back(node);
  }
};

TEST(Renderer, DepthNormalAlbedoAndIdOfASquare) {
  Squares squares;
  squares.square(0.5, 2.0, {0.25f, 0.5f, 0.75f, 1});
  Studio studio(squares.scene);
  const RenderResult result = studio.shoot(small(32, 32));
  const int center = 16 * 32 + 16;
  EXPECT_NEAR(*result.depth.at(16, 16), 8.0, 1e-5);
  EXPECT_TRUE(std::isinf(*result.depth.at(2, 2)));
  EXPECT_NEAR(result.normal.rgb(16, 16).z, 1.0, 1e-6);
  EXPECT_EQ(result.normal.rgb(2, 2), glm::vec3(0.0f));
  EXPECT_NEAR(result.albedo.rgb(16, 16).g, 0.5, 1e-5);
  EXPECT_LT(result.id[center], 2u);
  EXPECT_EQ(result.id[2 * 32 + 2], kNone);
  EXPECT_EQ(result.color.at(16, 16)[3], 1.0f);
  EXPECT_EQ(result.color.at(2, 2)[3], 0.0f);
  int covered = 0;
  for (const std::uint32_t id : result.id) covered += id != kNone;
  EXPECT_EQ(covered, 16 * 16);
  EXPECT_EQ(result.camera.rays, 32u * 32u);
  EXPECT_GT(*result.tests.at(16, 16), 0.0f);
  for (const Aov& aov : known_aovs()) {
    if (std::string(aov.name) != "id") EXPECT_EQ(aov_data(result, aov.name).width, 32) << aov.name;
    EXPECT_EQ(aov_picture(result, aov.name, ColorMap::kInferno).width, 32) << aov.name;
  }
  EXPECT_THROW(aov_data(result, "nonsense"), Error);
}

// A matt white square that a sun of pi lux meets head on reflects radiance of nearly its albedo.
TEST(Renderer, LambertIsCalibrated) {
  Squares squares;
  squares.square(0.9, 0.0, {1, 1, 1, 1});
  squares.sun({0, 0, 1});
  Studio studio(squares.scene);
  RenderOptions options = small(16, 16);
  const RenderResult lit = studio.shoot(options);
  squares.scene.materials[0].base_color = {0, 0, 0, 1};
  const RenderResult black = Studio(squares.scene).shoot(options);
  // Direct light only differs by the albedo; the ambient part is what a bounced mean gives, and 0 for black but for the coat.
  EXPECT_GT(radiance(lit, 8, 8).g - radiance(black, 8, 8).g, 0.9);
  EXPECT_LT(radiance(black, 8, 8).g, 0.15);
  EXPECT_EQ(lit.lights, "1 light");
}

TEST(Renderer, ShadowsFallWhereTheBlockerIs) {
  Squares squares;
  squares.square(1.0, 0.0, {1, 1, 1, 1});
  squares.square(0.2, 1.0, {1, 0, 0, 1}, {-0.5, 0.0});
  squares.sun({-1, 0, 1});  // over the blocker: its shadow falls one to the right of it
  Studio studio(squares.scene);
  RenderOptions options = small(40, 40);
  const RenderResult with = studio.shoot(options);
  options.shadows = false;
  const RenderResult without = studio.shoot(options);
  EXPECT_LT(radiance(with, 30, 20).g, 0.6 * radiance(without, 30, 20).g);
  EXPECT_NEAR(radiance(with, 30, 5).g, radiance(without, 30, 5).g, 0.15 * radiance(without, 30, 5).g);
  EXPECT_GT(with.shadow.rays, 0u);
  EXPECT_EQ(without.shadow.rays, 0u);
}

TEST(Renderer, MasksLetRaysAndLightThrough) {
  Squares squares;
  squares.square(1.0, 0.0, {1, 1, 1, 1});
  const std::uint32_t mask = squares.square(0.6, 1.0, {1, 1, 1, 1}, {0, 0});
  Texture holes;  // left half open
  holes.width = 2;
  holes.height = 1;
  holes.texels = {{0, 1, 0, 0}, {0, 1, 0, 1}};
  holes.wrap_u = holes.wrap_v = Texture::Wrap::kClamp;
  squares.scene.textures.push_back(holes);
  squares.scene.materials[mask].base_texture = 0;
  squares.scene.materials[mask].alpha = Material::Alpha::kMask;
  squares.sun({0, 0, 1});
  const RenderResult result = Studio(squares.scene).shoot(small(40, 40));
  const auto triangle = [&](int x, int y) { return result.id[static_cast<std::size_t>(y * 40 + x)]; };
  EXPECT_GE(triangle(28, 20), 2u);  // closed half: the mask
  EXPECT_LT(triangle(12, 20), 2u);  // open half: the square behind
  EXPECT_NEAR(*result.depth.at(28, 20), 9.0, 1e-5);
  EXPECT_NEAR(*result.depth.at(12, 20), 10.0, 1e-5);
  // What is behind the hole is lit as what nothing covers, which the closed half does not allow.
  EXPECT_NEAR(radiance(result, 12, 20).r, radiance(result, 3, 3).r, 1e-4);
  EXPECT_LT(radiance(result, 28, 20).r, 0.2 * radiance(result, 3, 3).r);
}

TEST(Renderer, UnlitSurfacesShowTheirColours) {
  Squares squares;
  const std::uint32_t plain = squares.square(0.6, 1.0, {0.2f, 0.4f, 0.6f, 1});
  squares.square(1.0, 0.0, {0.5f, 0.5f, 0.5f, 1});
  squares.scene.materials[plain].unlit = true;
  squares.scene.materials[plain].metallic = 1.0f;
  squares.scene.materials[plain].emissive = glm::vec3(50.0f);  // does not count
  squares.sun({0, 0.3, 1}, 40.0f);
  for (const int ao : {0, 4}) {
    RenderOptions options = small(40, 40);
    options.ao = ao;
    const RenderResult result = Studio(squares.scene).shoot(options);
    EXPECT_LT(glm::length(radiance(result, 20, 20) - glm::vec3(0.2f, 0.4f, 0.6f)), 1e-6f);
    for (const double exposure : {0.01, 1.0, 100.0}) {
      const Raster picture = develop(result, exposure);
      EXPECT_LT(glm::length(picture.rgb(20, 20) - srgb_encode(glm::vec3(0.2f, 0.4f, 0.6f))), 1e-5f) << exposure;
    }
    EXPECT_GT(luminance(develop(result, 1.0).rgb(3, 3)), 1.5f * luminance(develop(result, 0.001).rgb(3, 3)));
  }
}

/// Behind however many faint layers what is left of a ray ends on the opaque surface.
TEST(Renderer, ManyLayersDoNotHideWhatIsBehind) {
  for (const int layers : {31, 40, 200}) {
    Squares squares;
    squares.square(1.0, -1.0, {0, 1, 0, 1});
    for (int i = 0; i < layers; ++i) {
      const std::uint32_t layer = squares.square(1.0, 0.01 * i, {1, 0, 0, 0.005f});
      squares.scene.materials[layer].alpha = Material::Alpha::kBlend;
    }
    squares.sun({0, 0, 1});
    const RenderResult result = Studio(squares.scene).shoot(small(12, 12));
    EXPECT_NEAR(result.color.at(6, 6)[3], 1.0, 1e-4) << layers;
    EXPECT_NEAR(result.albedo.rgb(6, 6).g, std::pow(0.995, layers), 1e-3) << layers;
    EXPECT_GT(radiance(result, 6, 6).g, 0.1f) << layers;  // and light gets there
    EXPECT_EQ(result.cut_rays, 0u);
  }
}

/// The radiance is that of all of them, and the number of surfaces that are shaded has a bound.
TEST(Renderer, ManyLayersAreShadedInGroups) {
  const auto shoot = [](int layers, float alpha, bool shadows) {
    Squares squares;
    for (int i = 0; i < layers; ++i) {
      const std::uint32_t layer = squares.square(1.0, 0.002 * i, {1, 0, 0, alpha});
      squares.scene.materials[layer].alpha = Material::Alpha::kBlend;
    }
    squares.sun({0, 0, 1});
    RenderOptions options = small(4, 4);
    options.shadows = shadows;
    return Studio(squares.scene).shoot(options);
  };
  const RenderResult one = shoot(1, 1.0f, false), many = shoot(300, 0.01f, false);
  const float cover = 1.0f - std::pow(0.99f, 300.0f);
  EXPECT_NEAR(many.color.at(2, 2)[3], cover, 1e-3);
  EXPECT_NEAR(many.color.at(2, 2)[0], cover * one.color.at(2, 2)[0], 0.01f * one.color.at(2, 2)[0]);
  const RenderResult shadowed = shoot(300, 0.01f, true);
  EXPECT_GT(shadowed.shadow.rays, 4u * 32u);
  EXPECT_LE(shadowed.shadow.rays, 16u * (32u + 64u + 1u));  // of 16 * 300
  EXPECT_EQ(shadowed.cut_rays, 0u);
}

TEST(Renderer, RaysThatPassTooManyLayersAreCounted) {
  Squares squares;
  for (int i = 0; i < 1100; ++i) {
    const std::uint32_t layer = squares.square(1.0, 0.001 * i, {1, 0, 0, 0.0f});
    squares.scene.materials[layer].alpha = Material::Alpha::kBlend;
  }
  RenderOptions options = small(4, 4);
  options.shadows = false;
  const RenderResult result = Studio(squares.scene).shoot(options);
  EXPECT_EQ(result.cut_rays, 16u);
  EXPECT_NEAR(result.color.at(2, 2)[3], 1.0, 1e-4);
}

TEST(Renderer, NearAndFarPlaneClip) {
  Squares squares;  // seen from z = 10
  squares.square(1.0, 0.0, {1, 1, 1, 1});
  squares.square(1.0, 4.0, {1, 1, 1, 1});
  squares.square(1.0, 8.0, {1, 1, 1, 1});
  for (const bool perspective : {false, true}) {
    Camera& camera = squares.scene.cameras[0];
    camera.perspective = perspective;
    camera.yfov = 0.1;
    const auto depth = [&](double znear, double zfar) {
      camera.znear = znear;
      camera.zfar = zfar;
      return *Studio(squares.scene).shoot(small(5, 5)).depth.at(1, 1);
    };
    const double infinite = std::numeric_limits<double>::infinity();
    EXPECT_NEAR(depth(0, infinite), 2, 1e-4);
    EXPECT_NEAR(depth(1.99, infinite), 2, 1e-4);
    EXPECT_NEAR(depth(2.01, infinite), 6, 1e-4);
    EXPECT_NEAR(depth(7, 11), 10, 1e-4);
    EXPECT_EQ(depth(7, 9.9), infinite);
  }
}

/// The same picture of a cube at the origin and of one so far away that world coordinates are coarser than the offset
/// of secondary rays.
TEST(Renderer, FarFromTheOriginIsAsNear) {
  const auto shoot = [](double at) {
    Scene scene = make_scene("box");
    for (const std::uint32_t root : scene.roots) scene.nodes[root].translation.x += at;
    RenderOptions options = small(64, 48);
    options.ao = 4;
    Studio studio(scene);
    return studio.shoot(options);
  };
  const RenderResult near = shoot(0.0), far = shoot(0x1p36);
  int different = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) different += glm::length(radiance(near, x, y) - radiance(far, x, y)) > 0.02f;
  EXPECT_LT(different, 30);
}

TEST(Renderer, WhatIsLeftOutDoesNotDecideTheFraming) {
  Squares squares;
  squares.square(1.0, 0.0, {1, 1, 1, 1});
  squares.scene.roots = {1};  // without the camera
  const ViewCamera expected = Studio(squares.scene).camera;
  const std::array<std::array<glm::vec3, 3>, 2> flat{
      {{glm::vec3(100), glm::vec3(100), glm::vec3(100)},
       {glm::vec3(50, 0, 0), glm::vec3(75, 0, 0), glm::vec3(100, 0, 0)}}};
  for (const auto& corners : flat) {
    Scene scene = squares.scene;
    Primitive p;
    p.positions.assign(corners.begin(), corners.end());
    p.triangles = {{0, 1, 2}};
    scene.meshes[0].primitives.push_back(p);
    const Studio studio(scene);
    EXPECT_EQ(studio.camera.world, expected.world);
    EXPECT_EQ(studio.grid.transform.scale, snap(flatten(squares.scene)).transform.scale);
    EXPECT_EQ(studio.grid.degenerate, 1u);
  }
}

TEST(Renderer, BlendsAddUp) {
  Squares squares;
  squares.square(1.0, 0.0, {1, 0, 0, 1});
  const std::uint32_t glass = squares.square(0.6, 1.0, {0, 0, 1, 0.25f});
  squares.scene.materials[glass].alpha = Material::Alpha::kBlend;
  RenderOptions options = small(40, 40);
  options.shadows = false;
  const RenderResult result = Studio(squares.scene).shoot(options);
  const glm::vec3 through = result.albedo.rgb(20, 20);
  EXPECT_NEAR(through.r, 0.75, 1e-4);
  EXPECT_NEAR(through.b, 0.25, 1e-4);
  EXPECT_NEAR(result.color.at(20, 20)[3], 1.0, 1e-4);
}

// Under an even sky nothing occludes a convex body, and everything in a closed box does.
TEST(Renderer, AmbientOcclusionOfConvexAndClosedBodies) {
  Studio sphere(make_scene("sphere", {{"cells", 12}, {"displacement", 0}}));
  RenderOptions options = small(48, 36, 2);
  options.lights = LightChoice::kRig;
  options.shadows = false;
  const double open = mean(sphere.shoot(options).color);
  options.ao = 16;
  const RenderResult occluded = sphere.shoot(options);
  EXPECT_NEAR(mean(occluded.color), open, 0.02 * open);
  EXPECT_GT(occluded.occlusion.rays, 0u);

  // The corner where the block meets the floor is darker than the middle of the floor.
  Squares corner;
  corner.square(1.0, 0.0, {1, 1, 1, 1});
  corner.square(0.5, 0.02, {1, 1, 1, 1}, {0.5, 0});
  Studio studio(corner.scene);
  options = small(40, 40);
  options.lights = LightChoice::kScene;
  options.ao = 0;
  EXPECT_EQ(mean(studio.shoot(options).color), 0.0);  // no light at all: black
  options.lights = LightChoice::kRig;
  options.ao = 64;
  const RenderResult shaded = studio.shoot(options);
  options.ao = 0;
  const RenderResult plain = studio.shoot(options);
  EXPECT_NEAR(radiance(shaded, 5, 20).g / radiance(plain, 5, 20).g, 1.0, 0.03);
}

TEST(Renderer, IndoorsIsTold) {
  Studio room(make_scene("room", {{"detail", 0.02}})), sphere(make_scene("sphere", {{"cells", 8}}));
  const auto indoors = [](Studio& studio) {
    const std::unique_ptr<Engine> engine = make_golden_engine(studio.grid, studio.image);
    const Surfaces surfaces(studio.scene, studio.world, studio.grid);
    return is_indoors(surfaces, studio.camera, studio.grid.box, *engine, {});
  };
  EXPECT_TRUE(indoors(room));
  EXPECT_FALSE(indoors(sphere));
}

TEST(Renderer, SameBitsForAnyNumberOfThreads) {
  Studio studio(make_scene("box"));
  RenderOptions options = small(40, 30, 3);
  options.ao = 2;
  const RenderResult all = studio.shoot(options);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  options.trace.threads = 1;
  const RenderResult one = studio.shoot(options);
  EXPECT_EQ(all.color.data, one.color.data);
  EXPECT_EQ(all.id, one.id);
  EXPECT_EQ(all.tests.data, one.tests.data);
}

TEST(Renderer, FixedPointPicturesLookTheSame) {
  Studio studio(make_scene("knot", {{"along", 120}, {"around", 16}}));
  const std::unique_ptr<Engine> csim = make_csim_engine(studio.image);
  RenderOptions options = small(64, 48, 1);
  const RenderResult a = studio.shoot(options), b = studio.shoot(options, csim.get());
  int different = 0;
  double worst = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * 64 + x);
      different += a.id[i] != b.id[i];
      worst =
          std::max(worst, static_cast<double>(std::fabs(luminance(a.color.rgb(x, y)) - luminance(b.color.rgb(x, y)))));
    }
  }
  EXPECT_LE(different, 3);
  EXPECT_LT(worst, 0.05);
  // The walks are the same up to rounding, so the work is nearly the same.
  EXPECT_NEAR(static_cast<double>(a.camera.tests), static_cast<double>(b.camera.tests),
              0.01 * static_cast<double>(a.camera.tests));
}

TEST(Renderer, SupersamplingCoversPartly) {
  Squares squares;
  squares.square(0.5 + 0.5 / 32, 0.0, {1, 1, 1, 1});  // ends in the middle of a pixel of a picture of 32 x 32
  const RenderResult result = Studio(squares.scene).shoot(small(32, 32, 64));
  EXPECT_NEAR(result.color.at(7, 16)[3], 0.25, 0.06);
  EXPECT_EQ(result.color.at(16, 16)[3], 1.0f);
  const Raster picture = develop(result, 1.0);
  for (const float value : picture.data) ASSERT_TRUE(value >= 0 && value <= 1);
}

TEST(Renderer, EmptySceneIsABackdrop) {
  Studio studio(make_scene("none"));
  const RenderResult result = studio.shoot(small());
  EXPECT_EQ(mean(result.color), 0.0);
  const Raster picture = develop(result, result.exposure);
  EXPECT_LT(luminance(picture.rgb(5, 0)), luminance(picture.rgb(5, 35)));
}

TEST(Renderer, SizesAreChecked) {
  Studio studio(make_scene("one"));
  EXPECT_THROW(studio.shoot(small(0, 4)), Error);
  EXPECT_THROW(studio.shoot(small(16385, 4)), Error);
  EXPECT_THROW(studio.shoot(small(4, 4, 0)), Error);
  EXPECT_NO_THROW(studio.shoot(small(1, 1)));
  EXPECT_NO_THROW(studio.shoot(small(300, 1)));
}

/// An engine that returns what no scene holds.
class Liar : public Engine {
 public:
  explicit Liar(Hit hit) : hit_(hit) {}
  std::string name() const override { return "liar"; }
  void trace(std::span<const GridRay>, std::span<Hit> hits, std::span<RayWork>, const TraceOptions&) override {
    std::fill(hits.begin(), hits.end(), hit_);
  }

 private:
  Hit hit_;
};

TEST(Renderer, WrongEnginesAreAnError) {
  Studio studio(make_scene("one"));
  Hit hit;
  hit.status = contract::kStatusHit;
  hit.id = 77;
  Liar wrong_id(hit);
  EXPECT_THROW(studio.shoot(small(), &wrong_id), Error);
  hit.status = contract::kStatusStepLimit;
  Liar fault(hit);
  EXPECT_THROW(studio.shoot(small(), &fault), Error);
}

}  // namespace
}  // namespace retrace
