// Registry, parameters, and all scenes but the room (room.cpp).
#include "scenes/generators.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scenes/room.hpp"
#include "scenes/shapes.hpp"

namespace retrace {
namespace {

using namespace shapes;

constexpr double kPi = glm::pi<double>();

// ------------------------------------------------------------------------------------------------- putting a scene
// together

std::uint32_t add_material(Scene& scene, const std::string& name, const glm::vec3& color, float roughness,
                           float metallic = 0.0f) {
  Material m;
  m.name = name;
  m.base_color = glm::vec4(color, 1.0f);
  m.roughness = roughness;
  m.metallic = metallic;
  scene.materials.push_back(m);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

std::uint32_t add_mesh(Scene& scene, const std::string& name, Primitive primitive, std::uint32_t material) {
  primitive.material = material;
  scene.meshes.push_back({name, {std::move(primitive)}});
  return static_cast<std::uint32_t>(scene.meshes.size() - 1);
}

Node& add_node(Scene& scene, const std::string& name) {
  scene.roots.push_back(static_cast<std::uint32_t>(scene.nodes.size()));
  scene.nodes.emplace_back();
  scene.nodes.back().name = name;
  return scene.nodes.back();
}

void add_object(Scene& scene, const std::string& name, Primitive primitive, std::uint32_t material) {
  const std::uint32_t mesh = add_mesh(scene, name, std::move(primitive), material);
  add_node(scene, name).mesh = mesh;
}

void look(Node& node, const glm::dvec3& eye, const glm::dvec3& target) {
  node.translation = eye;
  node.rotation = glm::quat_cast(glm::dmat3(glm::inverse(glm::lookAt(eye, target, glm::dvec3(0, 1, 0)))));
}

void add_camera(Scene& scene, const glm::dvec3& eye, const glm::dvec3& target, double yfov) {
  Camera camera;
  camera.name = "camera";
  camera.yfov = yfov;
  camera.aspect = 4.0 / 3.0;
  camera.znear = 0.01;
  scene.cameras.push_back(camera);
  Node& node = add_node(scene, "camera");
  node.camera = static_cast<std::uint32_t>(scene.cameras.size() - 1);
  look(node, eye, target);
}

void add_triangle(Primitive& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const auto base = static_cast<std::uint32_t>(p.positions.size());
  for (const glm::dvec3& v : {a, b, c}) p.positions.emplace_back(v);
  p.triangles.push_back({base, base + 1, base + 2});
}

// ------------------------------------------------------------------------------------------------------------------
// scenes

using Values = SceneParameters;  // complete and checked

int whole(const Values& values, const char* name) { return static_cast<int>(values.at(name)); }
std::uint64_t seed_of(const Values& values) { return static_cast<std::uint64_t>(values.at("seed")); }

/// After the box of Cornell's Program of Computer Graphics: white room, red and green walls, two blocks, a lamp in the
/// ceiling.
Scene make_box(const Values&) {
  Scene scene;
  const std::uint32_t white = add_material(scene, "white", {0.73f, 0.73f, 0.73f}, 0.9f);
  const std::uint32_t red = add_material(scene, "red", {0.60f, 0.06f, 0.05f}, 0.9f);
  const std::uint32_t green = add_material(scene, "green", {0.12f, 0.42f, 0.09f}, 0.9f);
  const std::uint32_t lamp = add_material(scene, "lamp", {0.0f, 0.0f, 0.0f}, 1.0f);
  scene.materials[lamp].emissive = {17.0f, 13.0f, 8.5f};

  Primitive shell;
  append(shell, quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}));
  append(shell, quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}));
  append(shell, quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}));
  add_object(scene, "shell", shell, white);
  add_object(scene, "left wall", quad({-1, -1, 1}, {0, 0, -2}, {0, 2, 0}), red);
  add_object(scene, "right wall", quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}), green);

  const std::uint32_t block = add_mesh(scene, "block", box({-0.3, 0, -0.3}, {0.3, 0.6, 0.3}), white);
  Node& tall = add_node(scene, "tall block");
  tall.mesh = block;
  tall.translation = {-0.36, -1, -0.3};
  tall.rotation = glm::angleAxis(0.3, glm::dvec3(0, 1, 0));
  tall.scale = {1, 2, 1};
  Node& low = add_node(scene, "low block");
  low.mesh = block;
  low.translation = {0.34, -1, 0.35};
  low.rotation = glm::angleAxis(-0.29, glm::dvec3(0, 1, 0));

  add_object(scene, "lamp", quad({-0.24, 0.998, -0.2}, {0.48, 0, 0}, {0, 0, 0.38}), lamp);
  add_camera(scene, {0, 0, 3.75}, {0, 0, 0}, 0.68);
  return scene;
}

Scene make_sphere(const Values& values) {
  Scene scene;
  const double depth = values.at("displacement");
  const auto seed = static_cast<std::uint32_t>(seed_of(values));
  const auto radius = [&](const glm::dvec3& d) { return 1.0 + depth * fractal_noise(d * 3.0, 5, seed); };
  add_object(scene, "sphere", cube_sphere(whole(values, "cells"), radius),
             add_material(scene, "clay", {0.62f, 0.40f, 0.28f}, 0.6f));
  add_camera(scene, {1.6, 1.3, 2.6}, {0, 0, 0}, 0.7);
  return scene;
}

Scene make_knot(const Values& values) {
  Scene scene;
  const int p = whole(values, "p"), q = whole(values, "q");
  add_object(scene, "knot", torus_knot(p, q, values.at("radius"), whole(values, "along"), whole(values, "around")),
             add_material(scene, "glaze", {0.10f, 0.35f, 0.45f}, 0.35f));
  add_camera(scene, {3.2, 5.2, 6.2}, {0, -0.2, 0}, 0.72);
  return scene;
}

Scene make_field(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  const int count = whole(values, "count"), cells = whole(values, "cells");
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const double half = 0.5 * columns + 1;

  const std::uint32_t ground = add_material(scene, "ground", {0.36f, 0.42f, 0.20f}, 0.95f);
  add_object(scene, "ground", quad({-half, 0, half}, {2 * half, 0, 0}, {0, 0, -2 * half}), ground);

  std::vector<std::uint32_t> kinds;
  const std::uint32_t stone = add_material(scene, "stone", {0.45f, 0.44f, 0.42f}, 0.85f);
  kinds.push_back(add_mesh(scene, "stone",
                           cube_sphere(cells, [](const glm::dvec3& d) { return 0.26 * (1 + 0.5 * noise(d * 2.2, 7)); }),
                           stone));
  const std::uint32_t leaf = add_material(scene, "leaves", {0.10f, 0.30f, 0.08f}, 0.8f);
  const std::uint32_t bark = add_material(scene, "bark", {0.22f, 0.13f, 0.07f}, 0.9f);
  const int sides = 2 * cells;
  {
    Primitive crown, trunk;
    const glm::dvec2 profile[] = {{0, 0.2},     {0, 0.2},     {0.3, 0.25},  {0.3, 0.25}, {0.12, 0.55},
                                  {0.12, 0.55}, {0.24, 0.55}, {0.24, 0.55}, {0.09, 0.8}, {0.09, 0.8},
                                  {0.17, 0.8},  {0.17, 0.8},  {0, 1.15}};
    append(crown, lathe(profile, sides));
    const glm::dvec2 stem[] = {{0.05, 0}, {0.04, 0.3}};
    append(trunk, lathe(stem, sides));
    crown.material = leaf;
    trunk.material = bark;
    scene.meshes.push_back({"tree", {std::move(crown), std::move(trunk)}});
    kinds.push_back(static_cast<std::uint32_t>(scene.meshes.size() - 1));
  }
  const std::uint32_t copper = add_material(scene, "copper", {0.85f, 0.45f, 0.28f}, 0.3f, 1.0f);
  kinds.push_back(add_mesh(scene, "ring", torus_knot(2, 3, 0.35, 10 * cells, sides), copper));
  const std::uint32_t crystal = add_material(scene, "crystal", {0.30f, 0.22f, 0.55f}, 0.15f);
  const glm::dvec2 spar[] = {{0, 0}, {0.14, 0.0}, {0.14, 0.0}, {0.18, 0.4}, {0.18, 0.4}, {0, 0.75}};
  kinds.push_back(add_mesh(scene, "crystal", lathe(spar, 6), crystal));

  for (int i = 0; i < count; ++i) {
    const std::uint32_t kind = random.below(4);
    Node& node = add_node(scene, "object " + std::to_string(i));
    node.mesh = kinds[kind];
    const double size = random.uniform(0.5, 1.0) * (kind == 2 ? 0.1 : 1.0);
    node.translation = {i % columns - half + 1.5 + random.uniform(-0.3, 0.3),
                        kind == 0   ? 0.08
                        : kind == 2 ? 1.35 * size
                                    : 0.0,
                        static_cast<double>(i / columns) - half + 1.5 + random.uniform(-0.3, 0.3)};
    node.rotation = glm::angleAxis(random.uniform(0, 2 * kPi), glm::dvec3(0, 1, 0));
    if (kind == 0) node.rotation = glm::angleAxis(random.uniform(0, 2 * kPi), random.direction());
    node.scale = glm::dvec3(size);
  }
  Light sun;
  sun.name = "sun";
  sun.type = Light::Type::kDirectional;
  sun.color = {1.0f, 0.92f, 0.78f};
  sun.intensity = 4.0f;
  scene.lights.push_back(sun);
  Node& node = add_node(scene, "sun");
  node.light = 0;
  look(node, {-3, 4, 2}, {0, 0, 0});
  add_camera(scene, {0.15 * half, 0.30 * half + 1.5, half + 2.0}, {0, 0, 0.15 * half}, 0.75);
  return scene;
}

/// How `placed` places its instances.
enum class Placing { kRigid, kScaled, kSquashed, kSheared, kMirrored, kNested };

/// A turned, squashed and moved group of groups; the innermost show a mesh.
void nest(Scene& scene, std::uint32_t parent, int count, const std::vector<std::uint32_t>& meshes, double spread,
          Random& random) {
  constexpr int kBranches = 10;
  const int groups = std::min(count, kBranches);
  for (int i = 0; i < groups; ++i) {
    const auto index = static_cast<std::uint32_t>(scene.nodes.size());
    scene.nodes.emplace_back();
    scene.nodes[parent].children.push_back(index);
    Node& node = scene.nodes.back();
    node.rotation = glm::angleAxis(random.uniform(0, 2 * kPi), random.direction());
    node.translation = spread * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    node.scale = {random.uniform(0.7, 1.2), random.uniform(0.7, 1.2), random.uniform(0.7, 1.2)};
    const int part = count / groups + (i < count % groups ? 1 : 0);
    if (part > 1)
      nest(scene, index, part, meshes, spread / 2.5, random);
    else
      node.mesh = meshes[random.below(static_cast<std::uint32_t>(meshes.size()))];
  }
}

/// Instances of two closed meshes, all about as large to the eye of the camera.
Scene make_placed(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  const int count = whole(values, "count"), cells = whole(values, "cells");
  const auto kind = static_cast<Placing>(whole(values, "kind"));
  const std::uint32_t clay = add_material(scene, "clay", {0.55f, 0.30f, 0.20f}, 0.8f);
  const std::uint32_t jade = add_material(scene, "jade", {0.15f, 0.45f, 0.30f}, 0.4f);
  const std::vector<std::uint32_t> meshes{
      add_mesh(scene, "stone", cube_sphere(cells, [](const glm::dvec3& d) { return 0.8 + 0.2 * noise(d * 3.0, 7); }),
               clay),
      add_mesh(scene, "ring", torus_knot(2, 3, 0.3, 6 * cells, 2 * cells), jade)};
  const glm::dvec3 eye(0, 0, 12);
  if (kind == Placing::kNested) {
    add_node(scene, "all");
    nest(scene, scene.roots.back(), count, meshes, 3.0, random);
  }
  for (int i = 0; i < count && kind != Placing::kNested; ++i) {
    // Sizes from 1 down to 1e-3, and as much nearer.
    double size = random.uniform(0.6, 1.0);
    if (kind == Placing::kScaled) size = std::pow(10.0, -3.0 * i / std::max(count - 1, 1));
    const glm::dvec3 direction(random.uniform(-0.45, 0.45), random.uniform(-0.34, 0.34), -1.0);
    glm::dmat4 shape(1.0);
    if (kind == Placing::kSquashed) shape[static_cast<int>(random.below(3))] *= 0.01;
    if (kind == Placing::kMirrored) shape[static_cast<int>(random.below(3))] *= -1.0;
    if (kind == Placing::kSheared) shape[1] += random.uniform(-1.5, 1.5) * shape[0] + random.uniform(-1, 1) * shape[2];
    Node& node = add_node(scene, "instance " + std::to_string(i));
    node.mesh = meshes[random.below(2)];
    node.has_matrix = true;
    node.matrix = glm::translate(glm::dmat4(1.0), eye + 18.0 * random.uniform(0.6, 1.0) * size * direction) *
                  rotate(random.uniform(0, 2 * kPi), random.direction()) *
                  glm::scale(glm::dmat4(1.0), glm::dvec3(0.35 * size)) * shape;
  }
  add_camera(scene, eye, {0, 0, 0}, 0.75);
  return scene;
}

/// Triangles as thin as float32 allows, in all directions: aspect ratios up to 2^`thinness`.
Scene make_needles(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  Primitive p;
  for (int i = 0; i < whole(values, "count"); ++i) {
    const glm::dvec3 center = 0.8 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const glm::dvec3 along = random.direction() * random.uniform(0.1, 0.6);
    const glm::dvec3 across = random.direction() * std::exp2(-random.uniform(4, values.at("thinness")));
    add_triangle(p, center - along, center + along, center + across);
  }
  smooth_normals(p);
  const std::uint32_t steel = add_material(scene, "steel", {0.55f, 0.56f, 0.58f}, 0.4f);
  scene.materials[steel].double_sided = true;
  add_object(scene, "needles", std::move(p), steel);
  return scene;
}

/// Closed disc and dome whose triangles all meet in one vertex: a fan of `count` slivers, with no gap between
/// neighbours.
Scene make_slivers(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  const int count = whole(values, "count");
  // Angles at random: neighbours differ in width by orders of magnitude.
  std::vector<double> angles;
  for (int i = 0; i < count; ++i) angles.push_back(random.uniform(0, 2 * kPi));
  std::sort(angles.begin(), angles.end());
  Primitive p;
  p.positions.emplace_back(0.013, 0.71, 0.017);
  p.positions.emplace_back(-0.011, -0.31, 0.007);
  for (const double a : angles) p.positions.emplace_back(std::cos(a), 0.05 * std::sin(3 * a), -std::sin(a));
  const auto rim = [&](int i) { return static_cast<std::uint32_t>(2 + i % count); };
  for (int i = 0; i < count; ++i) {
    p.triangles.push_back({0, rim(i), rim(i + 1)});
    p.triangles.push_back({1, rim(i + 1), rim(i)});
  }
  smooth_normals(p);
  add_object(scene, "slivers", std::move(p), add_material(scene, "paper", {0.75f, 0.70f, 0.60f}, 0.8f));
  return scene;
}

/// What lies on top of each other: every triangle several times, in different windings and from different starting
/// vertices, overlapping coplanar triangles, and stacks of planes that are axis-aligned (split candidates). The lowest
/// id must win everywhere.
Scene make_coincident(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  Primitive p;
  const auto several = [&](glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    for (int copy = 0; copy < whole(values, "copies"); ++copy) {
      add_triangle(p, a, b, c);
      if (copy % 2) std::swap(a, b);
      std::swap(b, c);
    }
  };
  const int n = whole(values, "cells");
  for (int axis = 0; axis < 3; ++axis)
    for (int layer = 0; layer <= n; ++layer) {
      const auto at = [&](double u, double v) {
        glm::dvec3 q;
        q[axis] = static_cast<double>(layer) / n * 2 - 1;
        q[(axis + 1) % 3] = u;
        q[(axis + 2) % 3] = v;
        return q;
      };
      // Overlapping squares of the plane, corners on the lattice of the other planes.
      const double u = random.below(static_cast<std::uint32_t>(n)) * 2.0 / n - 1,
                   v = random.below(static_cast<std::uint32_t>(n)) * 2.0 / n - 1;
      const double s = 2.0 / n;
      several(at(u, v), at(u + s, v), at(u + s, v + s));
      several(at(u, v), at(u + s, v + s), at(u, v + s));
      several(at(u, v), at(u + s, v), at(u, v + s));
    }
  for (int i = 0; i < 4 * n; ++i) {
    const auto point = [&] {
      return 0.9 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    };
    const glm::dvec3 a = point();
    several(a, a + 0.3 * random.direction(), a + 0.3 * random.direction());
  }
  smooth_normals(p);
  const std::uint32_t card = add_material(scene, "card", {0.30f, 0.50f, 0.60f}, 0.7f);
  scene.materials[card].double_sided = true;
  add_object(scene, "coincident", std::move(p), card);
  return scene;
}

/// Among sound triangles: points, lines (two equal vertices, three on a line), repeated indices, triangles smaller than
/// the grid.
Scene make_degenerate(const Values& values) {
  Scene scene;
  Random random(seed_of(values));
  Primitive p;
  for (int i = 0; i < whole(values, "count"); ++i) {
    const auto point = [&] { return glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
    const glm::dvec3 a = point(), b = a + 0.4 * random.direction(), c = a + 0.4 * random.direction();
    switch (i % 6) {
      case 0:
        add_triangle(p, a, b, c);
        break;
      case 1:
        add_triangle(p, a, a, a);
        break;
      case 2:
        add_triangle(p, a, b, b);
        break;
      case 3: {
        // On a line exactly, as far as float32 is concerned; the grid rounds some of these to slivers.
        const auto coarse = [](const glm::dvec3& v) { return glm::floor(v * 0x1p16) * 0x1p-16; };
        add_triangle(p, coarse(a), coarse(b), 0.5 * (coarse(a) + coarse(b)));
        break;
      }
      case 4:
        add_triangle(p, a, a + 1e-9 * random.direction(), a + 1e-9 * random.direction());
        break;
      default: {
        const auto first = static_cast<std::uint32_t>(p.positions.size());
        p.positions.emplace_back(a);
        p.positions.emplace_back(b);
        p.triangles.push_back({first, first + 1, first});
      }
    }
  }
  smooth_normals(p);
  const std::uint32_t plain = add_material(scene, "plain", {0.55f, 0.35f, 0.35f}, 0.7f);
  scene.materials[plain].double_sided = true;
  add_object(scene, "degenerate", std::move(p), plain);
  return scene;
}

Scene make_one(const Values&) {
  Scene scene;
  Primitive p;
  add_triangle(p, {-1, -0.6, 0.2}, {1, -0.7, -0.3}, {0.1, 1, 0});
  smooth_normals(p);
  const std::uint32_t plain = add_material(scene, "plain", {0.70f, 0.45f, 0.15f}, 0.6f);
  scene.materials[plain].double_sided = true;
  add_object(scene, "triangle", std::move(p), plain);
  return scene;
}

Scene make_none(const Values&) {
  Scene scene;
  add_camera(scene, {0, 0, 3}, {0, 0, 0}, 0.8);
  return scene;
}

struct Entry {
  SceneGenerator generator;
  Scene (*make)(const Values&);
};

const SceneParameter kSeed = {"seed", 1, 0, 4294967295.0, true, "seed of all random choices"};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      {{"box", "Cornell-style box with two blocks and a ceiling lamp", {}}, make_box},
      {{"room",
        "closed, furnished room; about 230,000 triangles",
        {{"detail", 1, 0.02, 20, false, "triangles, as a multiple of the default number"}, kSeed}},
       [](const Values& v) { return make_room(v.at("detail"), static_cast<std::uint64_t>(v.at("seed"))); }},
      {{"sphere",
        "displaced sphere, closed; 12 cells^2 triangles",
        {{"cells", 96, 1, 1200, true, "cells along an edge of the cube that is blown up"},
         {"displacement", 0.25, 0, 0.9, false, "depth of the relief, radius 1"},
         kSeed}},
       make_sphere},
      {{"knot",
        "torus knot, closed; 2 along around triangles",
        {{"along", 720, 8, 100000, true, "cells along the tube"},
         {"around", 48, 3, 2000, true, "cells around the tube"},
         {"p", 2, 1, 16, true, "turns about the axis"},
         {"q", 3, 1, 16, true, "turns about the torus"},
         {"radius", 0.42, 0.001, 0.5, false, "of the tube; the torus has radii 2 and 1"}}},
       make_knot},
      {{"field",
        "many small objects on a plane, instances of four meshes",
        {{"count", 1000, 1, 200000, true, "objects"}, {"cells", 4, 2, 64, true, "fineness of an object"}, kSeed}},
       make_field},
      {{"placed",
        "instances of two closed meshes, placed in one of the ways that an instance can be",
        {{"kind", 0, 0, 5, true,
          "0 rigid, 1 sizes from 1 to 1e-3, 2 squashed 1:100, 3 sheared, 4 mirrored, 5 nested groups"},
         {"count", 120, 1, 100000, true, "instances"},
         {"cells", 9, 2, 200, true, "fineness of a mesh: 12 cells^2 and 24 cells^2 triangles"},
         kSeed}},
       make_placed},
      {{"needles",
        "triangles as thin as float32 allows, in all directions",
        {{"count", 2000, 1, 5000000, true, "triangles"},
         {"thinness", 22, 4, 30, false, "largest aspect ratio, as a power of two"},
         kSeed}},
       make_needles},
      {{"slivers",
        "closed dome of slivers that all meet in one vertex; 2 count triangles",
        {{"count", 2000, 3, 2000000, true, "slivers a side"}, kSeed}},
       make_slivers},
      {{"coincident",
        "identical, overlapping and axis-aligned triangles",
        {{"cells", 16, 1, 1000, true, "planes an axis"}, {"copies", 3, 1, 20, true, "of every triangle"}, kSeed}},
       make_coincident},
      {{"degenerate",
        "points, lines and specks among sound triangles",
        {{"count", 600, 1, 5000000, true, "triangles; one in six is sound"}, kSeed}},
       make_degenerate},
      {{"one", "one triangle", {}}, make_one},
      {{"none", "no triangle", {}}, make_none},
  };
  return all;
}

std::string shown(double x) {
  char text[40];
  const auto [end, status] = std::to_chars(text, text + sizeof text, x, std::chars_format::general, 15);
  return std::string(text, end);
}

}  // namespace

std::span<const SceneGenerator> scene_generators() {
  static const std::vector<SceneGenerator> list = [] {
    std::vector<SceneGenerator> l;
    for (const Entry& entry : entries()) l.push_back(entry.generator);
    return l;
  }();
  return list;
}

SceneParameters check_scene_parameters(const SceneGenerator& generator, const SceneParameters& parameters) {
  Values values;
  for (const SceneParameter& p : generator.parameters) values[p.name] = p.value;
  for (const auto& [key, value] : parameters) {
    const auto& known = generator.parameters;
    const auto it =
        std::find_if(known.begin(), known.end(), [&key = key](const SceneParameter& p) { return p.name == key; });
    if (it == known.end()) {
      std::string list;
      for (const SceneParameter& p : known) list += (list.empty() ? "" : ", ") + p.name;
      throw Error("scene " + generator.name + ": there is no parameter '" + key + "'; " +
                  (list.empty() ? "the scene has none" : "there are: " + list));
    }
    if (!(value >= it->lower && value <= it->upper))
      throw Error("scene " + generator.name + ": '" + key + "' must be from " + shown(it->lower) + " to " +
                  shown(it->upper) + ", is " + shown(value));
    if (it->integer && value != std::floor(value))
      throw Error("scene " + generator.name + ": '" + key + "' must be an integer, is " + shown(value));
    values[key] = value;
  }
  return values;
}

Scene make_scene(const std::string& name, const SceneParameters& parameters) {
  for (const Entry& entry : entries()) {
    if (entry.generator.name != name) continue;
    const Values values = check_scene_parameters(entry.generator, parameters);
    Scene scene = entry.make(values);
    scene.name = name;
    for (std::uint32_t i = 0; i < scene.nodes.size(); ++i)
      for (const std::uint32_t child : scene.nodes[i].children) scene.nodes[child].parent = i;
    return scene;
  }
  std::string list;
  for (const Entry& entry : entries()) list += (list.empty() ? "" : ", ") + entry.generator.name;
  throw Error("there is no scene '" + name + "'; there are: " + list);
}

SceneParameters parse_scene_parameters(std::span<const std::string> texts) {
  SceneParameters out;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Error("parameter '" + text + "' is not of the form name=number");
    const std::string key = text.substr(0, equals);
    const char *first = text.data() + equals + 1, *last = text.data() + text.size();
    double value = 0;
    const auto [end, status] = std::from_chars(first, last, value);
    if (status != std::errc() || end != last || !std::isfinite(value))
      throw Error("parameter '" + text + "': '" + std::string(first, last) + "' is not a number");
    if (!out.emplace(key, value).second) throw Error("parameter '" + key + "' is given twice");
  }
  return out;
}

}  // namespace retrace
