// Animated glTF and two-level structures: interpolation by hand, deformation by formula, hits equal to brute force and
// to a full rebuild bit for bit, and one clear error for every kind of bad animation.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "golden/accel/two_level.hpp"
#include "golden/gltf/animation.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "scenes/animated_scenes.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

using accel::Hit;
using accel::Probe;
using accel::Ray;
using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;
using Path = AnimationTrack::Path;
using Interpolation = AnimationTrack::Interpolation;

AnimatedScene open(const Bytes& glb) {
  Scene scene = load_gltf_memory(glb);
  Animation animation = load_animation_memory(glb, scene);
  return AnimatedScene(std::move(scene), std::move(animation));
}

/// The file with its JSON changed.
Bytes edited(const Bytes& glb, const std::function<void(json&)>& change) {
  std::uint32_t length;
  std::memcpy(&length, glb.data() + 12, 4);
  json root = json::parse(glb.begin() + 20, glb.begin() + 20 + length);
  change(root);
  std::string text = root.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t rest = glb.size() - 20 - length;
  Bytes out(20 + text.size() + rest);
  std::copy_n(glb.begin(), 20, out.begin());
  std::copy(text.begin(), text.end(), out.begin() + 20);
  std::copy_n(glb.end() - static_cast<std::ptrdiff_t>(rest), rest, out.end() - static_cast<std::ptrdiff_t>(rest));
  const std::uint32_t total = static_cast<std::uint32_t>(out.size()), size = static_cast<std::uint32_t>(text.size());
  std::memcpy(out.data() + 8, &total, 4);
  std::memcpy(out.data() + 12, &size, 4);
  return out;
}

AnimationTrack track(Path path, Interpolation interpolation, std::uint32_t components, std::vector<double> times,
                     std::vector<double> values) {
  return {0, path, interpolation, components, std::move(times), std::move(values)};
}
std::vector<double> value(const AnimationTrack& t, double time) {
  std::vector<double> out(t.components);
  t.evaluate(time, out);
  return out;
}

TEST(AnimationTrack, StepHoldsAndLinearBlends) {
  const std::vector<double> values{0, 0, 0, 2, 4, 6, 3, 3, 3};
  const AnimationTrack step = track(Path::kTranslation, Interpolation::kStep, 3, {1, 2, 4}, values);
  const AnimationTrack linear = track(Path::kTranslation, Interpolation::kLinear, 3, {1, 2, 4}, values);
  EXPECT_EQ(value(step, 0.0), (std::vector<double>{0, 0, 0}));  // before the first key
  EXPECT_EQ(value(step, 1.99), (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(value(step, 2.0), (std::vector<double>{2, 4, 6}));
  EXPECT_EQ(value(step, 9.0), (std::vector<double>{3, 3, 3}));  // after the last
  EXPECT_EQ(value(linear, 1.5), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(value(linear, 3.0), (std::vector<double>{2.5, 3.5, 4.5}));
  EXPECT_EQ(value(linear, 4.0), (std::vector<double>{3, 3, 3}));
}

TEST(AnimationTrack, RotationTakesTheShortWay) {
  const double h = std::sqrt(0.5);
  // From 0 to -270 degrees written as such, which is +90 the other way round.
  const AnimationTrack t = track(Path::kRotation, Interpolation::kLinear, 4, {0, 1}, {0, 0, 0, 1, 0, 0, -h, -h});
  const std::vector<double> q = value(t, 0.5);
  EXPECT_NEAR(std::abs(q[2]), std::sin(M_PI / 8), 1e-12);
  EXPECT_NEAR(std::abs(q[3]), std::cos(M_PI / 8), 1e-12);
  EXPECT_GT(q[2] * q[3], 0.0);
}

TEST(AnimationTrack, CubicSplineFollowsItsTangents) {
  // x(t) = t^3 between 0 and 2: tangents 0 and 12 are reproduced exactly.
  const AnimationTrack t = track(Path::kTranslation, Interpolation::kCubicSpline, 3, {0, 2},
                                 {0, 0, 0, 0, 0, 0, 0, 0, 0, 12, 12, 12, 8, 8, 8, 0, 0, 0});
  for (const double x : {0.0, 0.25, 1.0, 1.9, 2.0}) EXPECT_NEAR(value(t, x)[0], x * x * x, 1e-12) << x;
}

TEST(AnimatedScene, ClassesOfMotion) {
  AnimatedScene scene = open(make_animated_glb("creatures", {{"detail", 2}, {"bones", 3}}));
  std::map<std::string, Motion> motion;
  for (std::uint32_t n = 0; n < scene.scene().nodes.size(); ++n) motion[scene.scene().nodes[n].name] = scene.motion(n);
  EXPECT_EQ(motion["ground"], Motion::kStatic);
  EXPECT_EQ(motion["ball 0"], Motion::kAffine);
  EXPECT_EQ(motion["flag"], Motion::kUnstructured);
  EXPECT_EQ(motion["worm"], Motion::kUnstructured);
  EXPECT_EQ(motion["camera"], Motion::kStatic);
  EXPECT_DOUBLE_EQ(scene.duration(), 4.0);
}

TEST(AnimatedScene, MorphTargetsAddUp) {
  const Bytes glb = make_animated_glb("creatures", {{"detail", 3}});
  const Scene rest = load_gltf_memory(glb);
  const Animation animation = load_animation_memory(glb, rest);
  AnimatedScene scene(rest, animation);
  std::uint32_t flag = 0;
  while (rest.nodes[flag].name != "flag") ++flag;
  const double time = 0.7;  // weights: between keys 1 (0.5 s) and 2 (1.0 s) of a cosine and a sine in steps of pi / 4
  const double f = (time - 0.5) / 0.5, w0 = std::cos(M_PI / 4) * (1 - f), w1 = std::sin(M_PI / 4) * (1 - f) + f;
  const Scene& now = scene.at(time);
  const Primitive& p = now.meshes[now.nodes[flag].mesh].primitives[0];
  const Primitive& r = rest.meshes[rest.nodes[flag].mesh].primitives[0];
  const Deformation& d = animation.deformations[rest.nodes[flag].mesh][0];
  ASSERT_EQ(d.targets.size(), 2u);
  ASSERT_EQ(p.positions.size(), r.positions.size());
  float moved = 0.0f;
  for (std::size_t i = 0; i < p.positions.size(); ++i) {
    const glm::dvec3 expected =
        glm::dvec3(r.positions[i]) + w0 * glm::dvec3(d.targets[0][i]) + w1 * glm::dvec3(d.targets[1][i]);
    EXPECT_LT(glm::length(glm::dvec3(p.positions[i]) - expected), 1e-6) << i;
    moved = std::max(moved, glm::length(p.positions[i] - r.positions[i]));
  }
  EXPECT_GT(moved, 0.05f);
}

TEST(AnimatedScene, SkinFollowsItsJoints) {
  const Bytes glb = make_animated_glb("creatures", {{"detail", 3}, {"bones", 5}});
  const Scene rest = load_gltf_memory(glb);
  AnimatedScene scene(rest, load_animation_memory(glb, rest));
  std::uint32_t worm = 0, first = 0;
  while (rest.nodes[worm].name != "worm") ++worm;
  while (rest.nodes[first].name != "bone 0") ++first;
  const Scene& now = scene.at(1.3);
  const std::vector<glm::dmat4> world = now.world_transforms(), placed = now.mesh_transforms();
  const Primitive& p = now.meshes[now.nodes[worm].mesh].primitives[0];
  const Primitive& r = rest.meshes[rest.nodes[worm].mesh].primitives[0];
  int checked = 0;
  for (std::size_t i = 0; i < p.positions.size(); ++i) {
    // In the lower half of the first segment bone 0 is alone; its inverse bind matrix is the identity.
    if (r.positions[i].y > 0.3 / 5 || r.positions[i].y < 0.0) continue;
    const glm::dvec3 expected = glm::dvec3(world[first] * glm::dvec4(glm::dvec3(r.positions[i]), 1.0));
    const glm::dvec3 found = glm::dvec3(placed[worm] * glm::dvec4(glm::dvec3(p.positions[i]), 1.0));
    EXPECT_LT(glm::length(found - expected), 1e-5) << i;
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

std::vector<Ray> rays_into(const Scene& scene, std::size_t count, Random& random) {
  const WorldTriangles world = flatten(scene);
  accel::Box box;
  for (const auto& t : world.vertices)
    for (const glm::dvec3& v : t) box.add(v);
  std::vector<Ray> rays;
  const auto inside = [&] {
    glm::dvec3 p;
    for (int a = 0; a < 3; ++a) p[a] = random.real(box.lower[a], box.upper[a]);
    return p;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 origin = random.chance(3) ? inside() : box.center() + 3.0 * (inside() - box.center());
    glm::dvec3 target = inside();
    if (random.chance(2)) {  // a vertex or an edge point
      const auto& t = world.vertices[random.below(world.vertices.size())];
      target = random.chance(2) ? t[0] : glm::mix(t[0], t[1], random.real(0, 1));
    }
    Ray ray{origin, target - origin};
    if (random.chance(5)) ray.direction[static_cast<int>(random.below(3))] = 0.0;
    if (ray.direction == glm::dvec3(0.0)) continue;
    ray.any = random.chance(6);
    if (random.chance(6)) ray.t_max = random.real(0.0, 2.0);
    rays.push_back(ray);
  }
  return rays;
}

void expect_same(const Ray& ray, const Hit& a, const Hit& b, const std::string& where) {
  if (ray.any) {
    EXPECT_EQ(a.hit(), b.hit()) << where;
  } else {
    EXPECT_EQ(a, b) << where << ": " << a.id << " at " << a.t << " and " << b.id << " at " << b.t;
  }
}

TEST(TwoLevel, EqualsBruteForceAndFullRebuild) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const std::vector<std::pair<std::string, Bytes>> files{
      {"carousel", make_animated_glb("carousel", {{"count", 20}, {"detail", 2}})},
      {"creatures", make_animated_glb("creatures", {{"detail", 2}})}};
  for (const auto& [name, glb] : files) {
    AnimatedScene scene = open(glb);
    scene.at(0.0);
    accel::TwoLevel two(scene);
    EXPECT_LT(two.objects(), two.instances());
    for (const double time : {0.0, 0.9, 2.5, scene.duration()}) {
      const Scene& now = scene.at(time);
      const accel::TwoLevelUpdate update = two.update();
      EXPECT_EQ(update.objects_rebuilt, name == "creatures" ? 2u : 0u);
      accel::TwoLevel fresh(scene);
      accel::FlatFrame flat(now, two);
      EXPECT_EQ(flat.degenerate, 0u);
      std::size_t hits = 0;
      const std::vector<Ray> rays = rays_into(now, 1500, random);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        Probe probe;
        const Hit expected = two.brute_force(rays[i], probe), hit = two.trace(rays[i], probe);
        const std::string where = name + " at " + std::to_string(time) + " s, ray " + std::to_string(i);
        expect_same(rays[i], expected, hit, where);
        expect_same(rays[i], expected, flat.trace(rays[i], probe), where + ", full rebuild");
        expect_same(rays[i], hit, fresh.trace(rays[i], probe), where + ", built anew");
        hits += hit.hit();
        if (HasFailure()) return;
      }
      EXPECT_GT(hits, rays.size() / 4);
    }
  }
}

TEST(TwoLevel, InstancesAreNotCopied) {
  AnimatedScene scene = open(make_animated_glb("carousel", {{"count", 120}, {"detail", 2}}));
  scene.at(0.0);
  const accel::TwoLevel two(scene);
  EXPECT_EQ(two.instances(), 121u);  // and the ground
  EXPECT_EQ(two.objects(), 4u);
  EXPECT_GT(two.instanced_triangles(), 20 * two.size());
}

/// A mailbox is per ray and object: instances of one object must not hide each other's triangles.
TEST(TwoLevel, MailboxesOnlySaveTests) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  AnimatedScene scene = open(make_animated_glb("carousel", {{"count", 30}, {"detail", 2}}));
  const Scene& now = scene.at(1.7);
  const accel::TwoLevel two(scene);
  const std::vector<Ray> rays = rays_into(now, 1500, random);
  Probe plain;
  std::vector<Hit> expected;
  for (const Ray& ray : rays) expected.push_back(two.trace(ray, plain));
  for (const int entries : {2, 8, 64, accel::Mailbox::kExact}) {
    Probe probe(accel::Mailbox(entries, two.size()));
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_EQ(expected[i], two.trace(rays[i], probe)) << "mailbox " << entries << ", ray " << i;
    EXPECT_EQ(plain.work.tests, probe.work.tests + probe.work.skipped) << "mailbox " << entries;
    EXPECT_GT(probe.work.skipped, 0u) << "mailbox " << entries;
  }
}

TEST(TwoLevel, EngineAgreesWithGolden) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  AnimatedScene scene = open(make_animated_glb("creatures", {{"detail", 3}}));
  const Scene& now = scene.at(1.0);
  const accel::TwoLevel two(scene);
  const GridScene grid = snap(flatten(now));
  const MemoryImage image = build_kd(grid);
  std::vector<GridRay> rays;
  for (const Ray& r : rays_into(now, 4000, random)) {
    WorldRay world;
    world.origin = r.origin, world.direction = r.direction;
    rays.push_back(quantise(world, grid.transform, grid.box, r.any));
  }
  std::vector<retrace::Hit> a(rays.size()), b(rays.size());
  accel::make_two_level_engine(two, grid)->trace(rays, a, {}, {});
  make_golden_engine(grid, image)->trace(rays, b, {}, {});
  std::size_t other = 0, hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    hits += a[i].hit();
    if (a[i].hit() != b[i].hit() || (!rays[i].record.any && a[i].id != b[i].id)) {
      ++other;  // rays at edges: vertices are snapped to another grid
      continue;
    }
    if (!a[i].hit() || rays[i].record.any) continue;
    EXPECT_NEAR(a[i].t, b[i].t, 1e-4) << i;
  }
  EXPECT_GT(hits, rays.size() / 4);
  EXPECT_LT(other, rays.size() / 20);
}

// ------------------------------------------------------------------------------------------------------------- bad
// input

void expect_error(const Bytes& glb, const std::string& part, const std::string& what) {
  try {
    AnimatedScene scene = open(glb);
    scene.at(0.5);
    accel::TwoLevel two(scene);
    two.update();
    ADD_FAILURE() << what << ": accepted";
  } catch (const Error& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find(part), std::string::npos) << what << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << what;
  }
}

class BadAnimation : public testing::Test {
 protected:
  const Bytes good = make_animated_glb("creatures", {{"detail", 2}, {"bones", 4}});
  /// Accessor of the input (or output) of the sampler of the first channel with this path.
  static json& accessor(json& root, const std::string& path, const char* which) {
    json& animation = root["animations"][0];
    for (json& channel : animation["channels"])
      if (channel["target"]["path"] == path)
        return root["accessors"][animation["samplers"][channel["sampler"].get<int>()][which].get<int>()];
    throw std::logic_error("no such channel");
  }
  /// Values of an accessor replaced by floats.
  static Bytes with_floats(const Bytes& glb, const std::string& path, const char* which,
                           const std::vector<float>& values) {
    std::size_t offset = 0;
    Bytes out = edited(glb, [&](json& root) {
      offset = root["bufferViews"][accessor(root, path, which)["bufferView"].get<int>()]["byteOffset"];
    });
    std::uint32_t length;
    std::memcpy(&length, out.data() + 12, 4);
    std::memcpy(out.data() + 20 + length + 8 + offset, values.data(), values.size() * sizeof(float));
    return out;
  }
};

TEST_F(BadAnimation, GoodFileLoads) {
  AnimatedScene scene = open(good);
  scene.at(0.5);
  EXPECT_TRUE(scene.animated());
}
TEST_F(BadAnimation, NoKeys) {
  expect_error(edited(good, [](json& r) { accessor(r, "weights", "input")["count"] = 0; }), "has no keys", "no keys");
}
TEST_F(BadAnimation, MissingKeys) {
  expect_error(edited(good, [](json& r) { accessor(r, "rotation", "output")["count"] = 5; }),
               "has 5 values, but 9 keys need 9", "too few values");
  expect_error(edited(good, [](json& r) { accessor(r, "weights", "output")["count"] = 17; }),
               "has 17 values, but 9 keys need 18", "too few weights");
  expect_error(edited(good, [](json& r) { r["animations"][0]["samplers"][0].erase("input"); }), "'input' is missing",
               "no input");
}
TEST_F(BadAnimation, UnsortedKeys) {
  expect_error(with_floats(good, "rotation", "input", {0, 1, 0.5}), "not in ascending order: key 2", "unsorted");
  expect_error(with_floats(good, "rotation", "input", {0, 0.5, 0.5}), "not in ascending order: key 2", "equal");
  expect_error(with_floats(good, "rotation", "input", {-1}), "before time 0", "negative");
  expect_error(with_floats(good, "rotation", "input", {NAN}), "is not finite", "not a number");
}
TEST_F(BadAnimation, SkinWithTooFewJoints) {
  expect_error(edited(good, [](json& r) { r["skins"][0]["joints"].erase(3); }), "has only 3 joints", "a joint less");
  expect_error(edited(good, [](json& r) { r["skins"][0]["joints"] = json::array(); }), "has no joints", "none");
  expect_error(
      edited(good, [](json& r) { r["accessors"][r["skins"][0]["inverseBindMatrices"].get<int>()]["count"] = 2; }),
      "has 4 joints, but only 2 inverse bind matrices", "inverse bind matrices");
  expect_error(edited(good, [](json& r) { r["skins"][0]["joints"][1] = 99; }), "there is no node 99",
               "joint out of range");
}
TEST_F(BadAnimation, SingularInstanceMatrix) {
  const auto at = [](json& r, const std::string& name) -> json& {
    for (json& node : r["nodes"])
      if (node.value("name", "") == name) return node;
    throw std::logic_error("no such node");
  };
  expect_error(edited(good,
                      [&](json& r) {
                        at(r, "ball 2")["scale"] = {1, 0, 1};
                      }),
               "'ball 2': the instance's matrix is singular", "flat ball");
  // The transform of a skinned node does not count, not even a singular one.
  AnimatedScene plain = open(good), flat = open(edited(good, [&](json&r) {
                                      at(r, "worm")["scale"] = {0, 0, 0};
                                      at(r, "worm")["translation"] = {9, 9, 9};
                                    }));
  for (const double time : {0.0, 1.3}) EXPECT_EQ(flatten(plain.at(time)).vertices, flatten(flat.at(time)).vertices);
}
TEST_F(BadAnimation, VerticesThatLeaveTheRangeOfFloat) {
  // The displacements read as short integers are large numbers.
  const Bytes bad = edited(with_floats(good, "weights", "output", std::vector<float>(18, 3e38f)), [](json& r) {
    for (json& mesh : r["meshes"])
      for (json& primitive : mesh["primitives"])
        if (primitive.contains("targets"))
          for (json& target : primitive["targets"])
            r["accessors"][target["POSITION"].get<int>()]["componentType"] = 5123;
  });
  try {
    AnimatedScene scene = open(bad);
    for (int i = 0; i < 8; ++i) {
      scene.at(0.5 * i);
      accel::TwoLevel two(scene);
    }
    ADD_FAILURE() << "accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("leaves the range of single precision"), std::string::npos) << e.what();
  }
}
TEST_F(BadAnimation, Targets) {
  expect_error(edited(good, [](json& r) { r["animations"][0]["channels"][1]["target"]["node"] = 99; }),
               "there is no node 99", "node");
  expect_error(edited(good, [](json& r) { r["animations"][0]["channels"][1]["target"]["path"] = "colour"; }),
               "'path' must be", "path");
  expect_error(edited(good,
                      [](json& r) {
                        r["animations"][0]["channels"][2]["target"] = r["animations"][0]["channels"][1]["target"];
                      }),
               "another channel drives rotation", "twice");
  expect_error(edited(good, [](json& r) { r["animations"][0]["channels"][0]["target"]["node"] = 0; }),
               "has no morph targets", "weights");
  expect_error(edited(good, [](json& r) { r["animations"][0]["samplers"][0]["interpolation"] = "CUBIC"; }),
               "'interpolation' must be", "interpolation");
  expect_error(edited(good, [](json& r) { r["animations"][0]["channels"][0] = 7; }), "must be an object", "type");
  expect_error(edited(good, [](json& r) { r["animations"] = json::object({{"0", 1}}); }), "animation", "type");
  expect_error(edited(good, [](json& r) { r["skins"] = "none"; }), "", "type");
}

/// Whatever single property is lost or of another type: an error or a scene, never a crash. Sanitizers watch.
TEST_F(BadAnimation, AnyPropertyBroken) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  int rejected = 0;
  for (int i = 0; i < 300; ++i) {
    const Bytes bad = edited(good, [&](json& root) {
      json* at = &root[random.chance(3) ? "skins" : "animations"];
      while (at->is_structured() && !at->empty() && !random.chance(6)) {
        auto it = at->begin();
        std::advance(it, static_cast<std::ptrdiff_t>(random.below(at->size())));
        at = &*it;
      }
      const json values[] = {nullptr,        -1,          1e300, "x", json::array(),
                             json::object(), 4000000000u, true,  3,   json::array({json::array()})};
      *at = values[random.below(std::size(values))];
    });
    try {
      AnimatedScene scene = open(bad);
      scene.at(0.5);
    } catch (const Error& e) {
      ++rejected;
      EXPECT_NE(std::string(e.what()), "");
    }
  }
  EXPECT_GT(rejected, 100);
}

TEST(AnimatedModels, LoadAndMove) {
  for (const char* name : {"glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf",
                           "glTF2/simple_skin/simple_skin.gltf"}) {
    const std::filesystem::path path = std::filesystem::path(RETRACE_MODELS_DIR) / name;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not installed";
    EXPECT_EQ(count_animations(path), 1u);
    Scene loaded = load_gltf(path);
    Animation animation = load_animation(path, loaded);
    AnimatedScene scene(std::move(loaded), std::move(animation));
    const auto shape = [&](double time) {
      const WorldTriangles world = flatten(scene.at(time));
      return world.vertices;
    };
    const auto before = shape(0.0), after = shape(0.4 * scene.duration());
    ASSERT_EQ(before.size(), after.size());
    EXPECT_NE(before, after) << name;
    accel::TwoLevel two(scene);
    Random random(test_seed());
    for (const Ray& ray : rays_into(scene.scene(), 300, random)) {
      Probe probe;
      expect_same(ray, two.brute_force(ray, probe), two.trace(ray, probe), name);
    }
  }
}

}  // namespace
}  // namespace retrace
