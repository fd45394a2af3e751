// A scene is made as the static ones are, written by glb_writer, and its GLB then extended by what Scene cannot hold.
#include "scenes/animated_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "golden/gltf/glb_writer.hpp"
#include "scenes/shapes.hpp"

namespace retrace {
namespace {

using namespace shapes;
using json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;
using Values = SceneParameters;

constexpr double kPi = glm::pi<double>();
constexpr int kFloat = 5126, kUnsignedShort = 5123;

// ------------------------------------------------------------------------------------- a GLB taken apart and extended

class GlbEditor {
 public:
  explicit GlbEditor(const Scene& scene) {
    const Bytes glb = to_glb(scene);
    const auto word = [&](std::size_t at) {
      std::uint32_t x;
      std::memcpy(&x, glb.data() + at, 4);
      return x;
    };
    const std::uint32_t text = word(12);
    root = json::parse(glb.begin() + 20, glb.begin() + 20 + text);
    if (const std::size_t bin = 20 + text; bin < glb.size())
      data_.assign(glb.begin() + static_cast<std::ptrdiff_t>(bin) + 8, glb.end());
  }

  /// An accessor over the values.
  template <class T>
  std::size_t add(const std::vector<T>& values, int component, const char* type, std::size_t components,
                  bool bounds = false) {
    data_.resize((data_.size() + 3) / 4 * 4);
    const std::size_t bytes = values.size() * sizeof(T);
    root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes}});
    const auto* begin = reinterpret_cast<const std::uint8_t*>(values.data());
    data_.insert(data_.end(), begin, begin + bytes);
    json accessor = {{"bufferView", root["bufferViews"].size() - 1},
                     {"componentType", component},
                     {"count", values.size() / components},
                     {"type", type}};
    if (bounds) {  // glTF wants them for key times and positions
      json low = json::array(), high = json::array();
      for (std::size_t c = 0; c < components; ++c) {
        T lower = values[c], upper = values[c];
        for (std::size_t i = c; i < values.size(); i += components)
          lower = std::min(lower, values[i]), upper = std::max(upper, values[i]);
        low.push_back(lower), high.push_back(upper);
      }
      accessor["min"] = low, accessor["max"] = high;
    }
    root["accessors"].push_back(accessor);
    return root["accessors"].size() - 1;
  }
  std::size_t add_vectors(const std::vector<glm::vec3>& values) {
    std::vector<float> flat;
    for (const glm::vec3& v : values) flat.insert(flat.end(), {v.x, v.y, v.z});
    return add(flat, kFloat, "VEC3", 3, true);
  }

  /// A channel of the one animation. Values: `each` numbers a key (three times that for cubic splines).
  void animate(std::uint32_t node, const char* path, const char* interpolation, std::size_t times,
               const std::vector<float>& values, std::size_t each) {
    const char* type = each == 4 ? "VEC4" : each == 3 ? "VEC3" : "SCALAR";
    if (!root.contains("animations"))
      root["animations"].push_back({{"name", "motion"}, {"channels", json::array()}, {"samplers", json::array()}});
    json& animation = root["animations"][0];
    animation["samplers"].push_back(
        {{"input", times}, {"interpolation", interpolation}, {"output", add(values, kFloat, type, each)}});
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  }

  Bytes finish() {
    data_.resize((data_.size() + 3) / 4 * 4);
    root["buffers"] = json::array({{{"byteLength", data_.size()}}});
    std::string text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t total = 12 + 8 + text.size() + 8 + data_.size();
    if (total > 0xffffffffu) throw Error("the scene needs 4 GiB or more, which a GLB file cannot hold");
    Bytes out;
    const auto word = [&](std::size_t x) {
      for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(x >> (8 * i)));
    };
    word(0x46546C67), word(2), word(total);
    word(text.size()), word(0x4E4F534A);
    out.insert(out.end(), text.begin(), text.end());
    word(data_.size()), word(0x004E4942);
    out.insert(out.end(), data_.begin(), data_.end());
    return out;
  }

  json root;

 private:
  Bytes data_;
};

// --------------------------------------------------------------------------------------------------------- scene parts

std::uint32_t add_material(Scene& scene, const std::string& name, const glm::vec3& color, float roughness) {
  Material m;
  m.name = name;
  m.base_color = glm::vec4(color, 1.0f);
  m.roughness = roughness;
  m.metallic = 0.0f;
  scene.materials.push_back(m);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

std::uint32_t add_mesh(Scene& scene, const std::string& name, Primitive primitive, std::uint32_t material) {
  primitive.material = material;
  scene.meshes.push_back({name, {std::move(primitive)}});
  return static_cast<std::uint32_t>(scene.meshes.size() - 1);
}

std::uint32_t add_node(Scene& scene, const std::string& name, std::uint32_t parent = kNone) {
  const auto index = static_cast<std::uint32_t>(scene.nodes.size());
  scene.nodes.emplace_back();
  scene.nodes.back().name = name;
  scene.nodes.back().parent = parent;
  (parent == kNone ? scene.roots : scene.nodes[parent].children).push_back(index);
  return index;
}

void look(Node& node, const glm::dvec3& eye, const glm::dvec3& target) {
  node.translation = eye;
  node.rotation = glm::quat_cast(glm::dmat3(glm::inverse(glm::lookAt(eye, target, glm::dvec3(0, 1, 0)))));
}

void add_view(Scene& scene, const glm::dvec3& eye, const glm::dvec3& target) {
  Camera camera;
  camera.name = "camera";
  camera.yfov = 0.7;
  camera.aspect = 4.0 / 3.0;
  camera.znear = 0.01;
  scene.cameras.push_back(camera);
  const std::uint32_t node = add_node(scene, "camera");
  scene.nodes[node].camera = 0;
  look(scene.nodes[node], eye, target);
  Light sun;
  sun.name = "sun";
  sun.type = Light::Type::kDirectional;
  sun.intensity = 4.0f;
  scene.lights.push_back(sun);
  const std::uint32_t light = add_node(scene, "sun");
  scene.nodes[light].light = 0;
  look(scene.nodes[light], {-3, 5, 2}, {0, 0, 0});
}

void push(std::vector<float>& to, const glm::dvec3& v) {
  to.insert(to.end(), {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)});
}
void push(std::vector<float>& to, const glm::dquat& q) {
  to.insert(to.end(),
            {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)});
}

/// A turn about an axis in `keys` steps, as a LINEAR rotation.
std::vector<float> turn(const glm::dquat& start, const glm::dvec3& axis, double turns, int keys) {
  std::vector<float> values;
  for (int k = 0; k < keys; ++k) push(values, glm::angleAxis(2 * kPi * turns * k / (keys - 1), axis) * start);
  return values;
}

int whole(const Values& values, const char* name) { return static_cast<int>(values.at(name)); }

// -------------------------------------------------------------------------------------------------------------- scenes

/// Rings of objects that turn, bob and blink: affine motion only, over a static ground.
Bytes make_carousel(const Values& values) {
  Scene scene;
  const int count = whole(values, "count"), detail = whole(values, "detail");
  Random random(static_cast<std::uint64_t>(values.at("seed")));
  const std::uint32_t ground = add_mesh(scene, "ground", quad({-14, -1.6, 14}, {28, 0, 0}, {0, 0, -28}, 8, 8),
                                        add_material(scene, "ground", {0.35f, 0.37f, 0.33f}, 0.95f));
  scene.nodes[add_node(scene, "ground")].mesh = ground;
  const std::uint32_t kinds[] = {
      add_mesh(scene, "knot", torus_knot(2, 3, 0.4, 15 * detail, 4 * detail - 2),
               add_material(scene, "glaze", {0.10f, 0.35f, 0.45f}, 0.35f)),
      add_mesh(scene, "stone",
               cube_sphere(3 * detail, [](const glm::dvec3& d) { return 2.2 * (1 + 0.4 * noise(d * 2.2, 7)); }),
               add_material(scene, "stone", {0.45f, 0.42f, 0.38f}, 0.85f)),
      add_mesh(scene, "flower",
               cube_sphere(3 * detail,
                           [](const glm::dvec3& d) {
                             return 1.6 * (1 + 0.5 * std::sin(6 * std::atan2(d.z, d.x)) * (1 - d.y * d.y));
                           }),
               add_material(scene, "petals", {0.70f, 0.16f, 0.20f}, 0.6f))};
  constexpr double kSeconds = 8.0;
  const int rings = std::max(1, static_cast<int>(std::lround(std::sqrt(count / 12.0))));
  struct Rider {
    std::uint32_t node;
    glm::dvec3 place;
  };
  std::vector<std::uint32_t> hubs;
  std::vector<Rider> riders;
  for (int ring = 0, made = 0; ring < rings; ++ring) {
    hubs.push_back(add_node(scene, "ring " + std::to_string(ring)));
    const int here = ring + 1 == rings ? count - made
                                       : std::min(count - made, std::max(1, count * (2 * ring + 1) / (rings * rings)));
    for (int i = 0; i < here; ++i, ++made) {
      const double angle = 2 * kPi * i / here, radius = 2.0 + 9.0 * ring / rings;
      const std::uint32_t node = add_node(scene, "rider " + std::to_string(made), hubs.back());
      Node& n = scene.nodes[node];
      n.mesh = kinds[random.below(3)];
      n.scale = glm::dvec3(random.uniform(0.12, 0.2));
      n.translation = {radius * std::cos(angle), random.uniform(-0.6, 0.8), radius * std::sin(angle)};
      n.rotation = glm::angleAxis(random.uniform(0, 2 * kPi), random.direction());
      riders.push_back({node, n.translation});
    }
  }
  add_view(scene, {0, 9, 17}, {0, -1, 0});

  GlbEditor glb(scene);
  std::vector<float> turning, bobbing, blinking;
  for (int k = 0; k <= 8; ++k) turning.push_back(static_cast<float>(kSeconds * k / 8));
  for (int k = 0; k <= 4; ++k) bobbing.push_back(static_cast<float>(kSeconds * k / 4));
  for (int k = 0; k < 4; ++k) blinking.push_back(static_cast<float>(kSeconds * k / 4));
  const std::size_t turn_times = glb.add(turning, kFloat, "SCALAR", 1, true),
                    bob_times = glb.add(bobbing, kFloat, "SCALAR", 1, true),
                    blink_times = glb.add(blinking, kFloat, "SCALAR", 1, true);
  for (std::size_t r = 0; r < hubs.size(); ++r)
    glb.animate(hubs[r], "rotation", "LINEAR", turn_times,
                turn(glm::dquat(1, 0, 0, 0), {0, 1, 0}, r % 2 ? -1.0 : 1.0, 9), 4);
  for (std::size_t i = 0; i < riders.size(); ++i) {
    const Node& n = scene.nodes[riders[i].node];
    if (i % 3 != 2)
      glb.animate(riders[i].node, "rotation", "LINEAR", turn_times, turn(n.rotation, random.direction(), 1.0, 9), 4);
    if (i % 2 == 0) {
      std::vector<float> path;  // in-tangent, value, out-tangent
      for (int k = 0; k < 5; ++k) {
        const double phase = 2 * kPi * k / 4 + static_cast<double>(i);
        const glm::dvec3 slope{0, 0.5 * std::cos(phase) * 2 * kPi / kSeconds, 0};
        push(path, slope), push(path, riders[i].place + glm::dvec3(0, 0.5 * std::sin(phase), 0)), push(path, slope);
      }
      glb.animate(riders[i].node, "translation", "CUBICSPLINE", bob_times, path, 3);
    }
    if (i % 5 == 0) {
      std::vector<float> sizes;
      for (int k = 0; k < 4; ++k) push(sizes, n.scale * (k % 2 ? 1.4 : 1.0));
      glb.animate(riders[i].node, "scale", "STEP", blink_times, sizes, 3);
    }
  }
  return glb.finish();
}

/// A flag of morph targets, a worm with a skeleton, and balls that only move: one of each class over a static ground.
Bytes make_creatures(const Values& values) {
  Scene scene;
  const int detail = whole(values, "detail"), bones = whole(values, "bones");
  scene.nodes[add_node(scene, "ground")].mesh =
      add_mesh(scene, "ground", quad({-5, -1, 5}, {10, 0, 0}, {0, 0, -10}, 4, 4),
               add_material(scene, "ground", {0.35f, 0.37f, 0.33f}, 0.95f));
  const Primitive cloth = quad({0, 0, 0}, {3, 0, 0}, {0, 2, 0}, 6 * detail, 4 * detail);
  const std::uint32_t flag_mesh =
      add_mesh(scene, "flag", cloth, add_material(scene, "cloth", {0.65f, 0.12f, 0.10f}, 0.8f));
  scene.materials.back().double_sided = true;
  const std::uint32_t flag = add_node(scene, "flag");
  scene.nodes[flag].mesh = flag_mesh;
  scene.nodes[flag].translation = {-3.2, 0.2, -1};

  const double length = 3.0;
  const Primitive skin = tube([&](double u) { return glm::dvec3(0, length * u, 0); },
                              [](double u) { return 0.35 * std::sqrt(std::max(1e-4, 1 - u * u * u)); }, 4 * detail,
                              3 * detail * bones / 2, true);
  const std::uint32_t worm_mesh =
      add_mesh(scene, "worm", skin, add_material(scene, "skin", {0.20f, 0.45f, 0.15f}, 0.5f));
  const std::uint32_t worm = add_node(scene, "worm"), base = add_node(scene, "worm base");
  scene.nodes[worm].mesh = worm_mesh;
  scene.nodes[base].translation = {1.6, -1, 0};
  std::vector<std::uint32_t> joints;
  for (int b = 0; b < bones; ++b) {
    joints.push_back(add_node(scene, "bone " + std::to_string(b), b == 0 ? base : joints.back()));
    if (b > 0) scene.nodes[joints.back()].translation = {0, length / bones, 0};
  }
  const std::uint32_t ball = add_mesh(scene, "ball", cube_sphere(2 * detail, [](const glm::dvec3&) { return 0.3; }),
                                      add_material(scene, "ball", {0.75f, 0.55f, 0.15f}, 0.4f));
  std::vector<std::uint32_t> balls;
  for (int i = 0; i < 4; ++i) {
    balls.push_back(add_node(scene, "ball " + std::to_string(i)));
    scene.nodes[balls.back()].mesh = ball;
    scene.nodes[balls.back()].translation = {-1.5 + i, -0.7, 2};
  }
  add_view(scene, {0, 2.5, 9}, {0, 0.3, 0});

  GlbEditor glb(scene);
  json& cloth_json = glb.root["meshes"][flag_mesh]["primitives"][0];
  for (int target = 0; target < 2; ++target) {
    std::vector<glm::vec3> moves;
    for (const glm::vec3& p : scene.meshes[flag_mesh].primitives[0].positions) {
      const double phase = 3.0 * p.x + 0.5 * p.y + (target ? kPi / 2 : 0.0);
      moves.emplace_back(0.0f, 0.05f * std::sin(static_cast<float>(phase)),
                         0.12f * p.x * static_cast<float>(std::sin(phase)));
    }
    cloth_json["targets"].push_back({{"POSITION", glb.add_vectors(moves)}});
  }
  glb.root["meshes"][flag_mesh]["weights"] = {1.0, 0.0};

  // Every vertex of the worm follows its bone and the nearer neighbour.
  std::vector<std::uint16_t> influence;
  std::vector<float> weights;
  for (const glm::vec3& p : scene.meshes[worm_mesh].primitives[0].positions) {
    const double at = std::clamp(p.y / length * bones, 0.0, bones - 1e-6);
    const int bone = static_cast<int>(at), other = std::clamp(at - bone > 0.5 ? bone + 1 : bone - 1, 0, bones - 1);
    const double w = 1.0 - std::abs(at - bone - 0.5);
    influence.insert(influence.end(), {static_cast<std::uint16_t>(bone), static_cast<std::uint16_t>(other), 0, 0});
    weights.insert(weights.end(), {static_cast<float>(w), static_cast<float>(1.0 - w), 0.0f, 0.0f});
  }
  json& attributes = glb.root["meshes"][worm_mesh]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = glb.add(influence, kUnsignedShort, "VEC4", 4);
  attributes["WEIGHTS_0"] = glb.add(weights, kFloat, "VEC4", 4);
  std::vector<float> inverse_bind;
  for (int b = 0; b < bones; ++b) {
    const glm::dmat4 m = glm::translate(glm::dmat4(1.0), glm::dvec3(0, -length * b / bones, 0));
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) inverse_bind.push_back(static_cast<float>(m[c][r]));
  }
  glb.root["skins"].push_back({{"joints", joints}, {"inverseBindMatrices", glb.add(inverse_bind, kFloat, "MAT4", 16)}});
  glb.root["nodes"][worm]["skin"] = 0;

  std::vector<float> times;
  for (int k = 0; k <= 8; ++k) times.push_back(0.5f * static_cast<float>(k));
  const std::size_t input = glb.add(times, kFloat, "SCALAR", 1, true);
  std::vector<float> wave;
  for (int k = 0; k <= 8; ++k)
    wave.insert(wave.end(), {static_cast<float>(std::cos(kPi * k / 4)), static_cast<float>(std::sin(kPi * k / 4))});
  glb.animate(flag, "weights", "LINEAR", input, wave, 1);
  for (int b = 0; b < bones; ++b) {
    std::vector<float> bend;
    for (int k = 0; k <= 8; ++k)
      push(bend, glm::angleAxis(0.9 / bones * 2.0 * std::sin(kPi * k / 4 + 0.5 * b), glm::dvec3(0, 0, 1)));
    glb.animate(joints[static_cast<std::size_t>(b)], "rotation", "LINEAR", input, bend, 4);
  }
  for (std::size_t i = 0; i < balls.size(); ++i) {
    std::vector<float> hop;
    for (int k = 0; k <= 8; ++k) {
      const double height = (static_cast<std::size_t>(k) + i) % 2 ? 0.9 : 0.0;
      push(hop, glm::dvec3(0)), push(hop, scene.nodes[balls[i]].translation + glm::dvec3(0, height, 0)),
          push(hop, glm::dvec3(0));
    }
    glb.animate(balls[i], "translation", i % 2 ? "CUBICSPLINE" : "STEP", input, i % 2 ? hop : [&] {
      std::vector<float> steps;
      for (int k = 0; k <= 8; ++k) steps.insert(steps.end(), hop.begin() + k * 9 + 3, hop.begin() + k * 9 + 6);
      return steps;
    }(), 3);
  }
  return glb.finish();
}

struct Entry {
  SceneGenerator generator;
  Bytes (*make)(const Values&);
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      {{"carousel",
        "rings of turning, bobbing, blinking instances; affine motion",
        {{"count", 150, 1, 100000, true, "instances"},
         {"detail", 8, 2, 200, true, "fineness of an object; about 112 detail^2 triangles"},
         {"seed", 1, 0, 4294967295.0, true, "seed of all random choices"}}},
       make_carousel},
      {{"creatures",
        "a waving flag (morph targets), a worm (skin), hopping balls",
        {{"detail", 8, 2, 200, true, "fineness"}, {"bones", 8, 2, 64, true, "joints of the worm"}}},
       make_creatures},
  };
  return all;
}

}  // namespace

std::span<const SceneGenerator> animated_scene_generators() {
  static const std::vector<SceneGenerator> list = [] {
    std::vector<SceneGenerator> l;
    for (const Entry& entry : entries()) l.push_back(entry.generator);
    return l;
  }();
  return list;
}

std::vector<std::uint8_t> make_animated_glb(const std::string& name, const SceneParameters& parameters) {
  std::string names;
  for (const Entry& entry : entries()) {
    names += (names.empty() ? "" : ", ") + entry.generator.name;
    if (entry.generator.name != name) continue;
    return entry.make(check_scene_parameters(entry.generator, parameters));
  }
  throw Error("there is no animated scene '" + name + "'; there are: " + names);
}

}  // namespace retrace
