// Cameras: rays where glTF says they are, choice by number and name, the view of a scene without camera.
#include "golden/render/view.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "scenes/generators.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

Scene with_cameras() {
  Scene scene;
  scene.name = "s";
  scene.cameras.resize(2);
  scene.cameras[0].name = "wide";
  scene.cameras[0].yfov = 1.0;
  scene.cameras[1].perspective = false;
  scene.cameras[1].xmag = 2;
  scene.cameras[1].ymag = 1;
  scene.nodes.resize(3);
  scene.nodes[0].camera = 0;
  scene.nodes[0].translation = {1, 2, 3};
  scene.nodes[1].camera = 1;
  scene.nodes[1].name = "flat";
  scene.nodes[1].rotation = glm::angleAxis(glm::radians(-90.0), glm::dvec3(1, 0, 0));  // looks down
  scene.nodes[1].scale = glm::dvec3(7, 7, 7);
  scene.nodes[2].camera = 0;  // not in the scene
  scene.roots = {0, 1};
  return scene;
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-12) {
  EXPECT_LT(glm::length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " against " << b.x << " " << b.y << " " << b.z;
}

TEST(View, PerspectiveRays) {
  const ViewCamera view = default_view(with_cameras(), {});
  EXPECT_EQ(view.name, "wide");
  const double t = std::tan(0.5);
  expect_near(view.ray(320, 240, 640, 480).origin, {1, 2, 3});
  expect_near(view.ray(320, 240, 640, 480).direction, {0, 0, -1});
  expect_near(view.ray(320, 0, 640, 480).direction, glm::normalize(glm::dvec3(0, t, -1)));
  expect_near(view.ray(320, 480, 640, 480).direction, glm::normalize(glm::dvec3(0, -t, -1)));
  expect_near(view.ray(640, 240, 640, 480).direction, glm::normalize(glm::dvec3(t * 4 / 3, 0, -1)));
  EXPECT_EQ(view.ray(1, 2, 640, 480).t_min, 0.0);
}

TEST(View, OtherShapesShowMoreNeverLess) {
  Scene scene = with_cameras();
  scene.cameras[0].aspect = 2.0;
  const ViewCamera view = default_view(scene, {});
  const double y = std::tan(0.5), x = 2 * y;
  expect_near(view.ray(0, 0, 800, 400).direction, glm::normalize(glm::dvec3(-x, y, -1)));
  expect_near(view.ray(0, 50, 400, 100).direction, glm::normalize(glm::dvec3(-2 * x, 0, -1)));
  expect_near(view.ray(0, 50, 100, 100).direction, glm::normalize(glm::dvec3(-x, 0, -1)));
  expect_near(view.ray(50, 0, 100, 100).direction, glm::normalize(glm::dvec3(0, x, -1)));
}

TEST(View, OrthographicRaysIgnoreTheScaleOfTheNode) {
  const ViewCamera view = default_view(with_cameras(), {}, "flat");
  EXPECT_FALSE(view.perspective);
  const WorldRay middle = view.ray(10, 5, 20, 10), corner = view.ray(0, 0, 20, 10), square = view.ray(0, 0, 10, 10);
  expect_near(middle.origin, {0, 0, 0});
  expect_near(middle.direction, {0, -1, 0});
  expect_near(corner.origin, {-2, 0, -1});
  expect_near(corner.direction, {0, -1, 0});
  expect_near(square.origin, {-2, 0, -2});
}

TEST(View, MirroringNodesMirror) {
  Scene scene = with_cameras();
  scene.nodes[0].scale = {-1, 1, 1};
  const ViewCamera view = default_view(scene, {});
  EXPECT_GT(view.ray(0, 240, 640, 480).direction.x, 0.1);
}

TEST(View, CamerasByNumberAndName) {
  const Scene scene = with_cameras();
  EXPECT_EQ(default_view(scene, {}, "0").name, "wide");
  EXPECT_EQ(default_view(scene, {}, "wide").name, "wide");
  EXPECT_EQ(default_view(scene, {}, "1").name, "flat");
  EXPECT_EQ(default_view(scene, {}, "flat").name, "flat");
  for (const char* bad : {"2", "-1", "narrow", "99999999999999999999", "0x", " "}) {
    try {
      default_view(scene, {}, bad);
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(message, "s: there is no camera '" + std::string(bad) + "'; there are: 0 'wide', 1 'flat'");
    }
  }
}

TEST(View, SingularCameraIsAnError) {
  for (const glm::dvec3 scale : {glm::dvec3(0, 1, 1), glm::dvec3(1, 0, 1), glm::dvec3(1, 1, 0)}) {
    Scene scene = with_cameras();
    scene.nodes[0].scale = scale;
    EXPECT_THROW(default_view(scene, {}), Error);
  }
}

/// Without a camera every vertex is in the picture, for scenes of any size and place.
TEST(View, FramesTheScene) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed);
  Random random(seed);
  for (int round = 0; round < 200; ++round) {
    const double size = std::exp2(random.real(-300, 300));
    const glm::dvec3 shape(random.real(0, 1), random.real(0, 1), random.chance(4) ? 0.0 : random.real(0, 1));
    const glm::dvec3 at = size * 20.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    WorldTriangles world;
    world.vertices.resize(20);
    for (auto& t : world.vertices)
      for (glm::dvec3& p : t)
        p = at + size * shape * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    const ViewCamera view = default_view(Scene{}, world);
    EXPECT_EQ(view.name, "default");
    const int width = 400, height = random.chance(2) ? 300 : 700;
    const glm::dvec3 left = view.ray(0, height / 2.0, width, height).direction,
                     top = view.ray(width / 2.0, 0, width, height).direction;
    const glm::dvec3 right(view.world[0]), up(view.world[1]), back(view.world[2]);
    const double slope_x = glm::dot(left, -right) / glm::dot(left, -back),
                 slope_y = glm::dot(top, up) / glm::dot(top, -back);
    for (const auto& t : world.vertices)
      for (const glm::dvec3& p : t) {
        const glm::dvec3 d = (p - view.eye()) / size;
        const double depth = -glm::dot(d, back);
        ASSERT_GT(depth, 0) << round;
        ASSERT_LT(std::abs(glm::dot(d, right)), depth * slope_x) << round;
        ASSERT_LT(std::abs(glm::dot(d, up)), depth * slope_y) << round;
      }
  }
}

TEST(View, EveryShippedSceneHasAView) {
  for (const SceneGenerator& generator : scene_generators()) {
    if (generator.name == "room") continue;  // its camera is the generators' test
    SCOPED_TRACE(generator.name);
    const Scene scene = make_scene(generator.name);
    const WorldRay ray = default_view(scene, flatten(scene)).ray(10, 20, 64, 48);
    EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace retrace
