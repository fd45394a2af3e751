// The project's own scenes: closed where they say so, deterministic, of the stated size, the same after a round trip
// through a file.
#include "scenes/generators.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "golden/gltf/glb_writer.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/view.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace {
namespace {

std::size_t count_triangles(const Scene& scene) { return flatten(scene).vertices.size(); }

/// Every edge, by vertex index, runs exactly once each way: a closed, oriented surface with shared vertices.
void expect_closed(const Primitive& p) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const glm::uvec3& t : p.triangles)
    for (int c = 0; c < 3; ++c) ++edges[{t[c], t[(c + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << edge.first << " " << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " " << edge.second;
  }
  // Outward: the enclosed volume is positive.
  double volume = 0;
  for (const glm::uvec3& t : p.triangles)
    volume +=
        glm::dot(glm::dvec3(p.positions[t.x]), glm::cross(glm::dvec3(p.positions[t.y]), glm::dvec3(p.positions[t.z])));
  EXPECT_GT(volume, 0);
}

TEST(Generators, ClosedMeshesAreClosed) {
  const std::vector<std::pair<std::string, SceneParameters>> cases = {
      {"sphere", {{"cells", 1}}},
      {"sphere", {{"cells", 2}, {"displacement", 0}}},
      {"sphere", {{"cells", 33}, {"displacement", 0.9}}},
      {"knot", {{"along", 8}, {"around", 3}}},
      {"knot", {{"along", 333}, {"around", 17}, {"p", 3}, {"q", 5}, {"radius", 0.2}}},
      {"slivers", {{"count", 3}}},
      {"slivers", {{"count", 2500}, {"seed", 9}}}};
  for (const auto& [name, parameters] : cases) {
    std::ostringstream trace;
    trace << name;
    for (const auto& [key, value] : parameters) trace << " " << key << "=" << value;
    SCOPED_TRACE(trace.str());
    expect_closed(make_scene(name, parameters).meshes.at(0).primitives.at(0));
  }
}

TEST(Generators, Sizes) {
  EXPECT_EQ(count_triangles(make_scene("sphere", {{"cells", 10}})), 1200u);
  EXPECT_EQ(count_triangles(make_scene("knot", {{"along", 50}, {"around", 6}})), 600u);
  EXPECT_EQ(count_triangles(make_scene("slivers", {{"count", 70}})), 140u);
  EXPECT_EQ(count_triangles(make_scene("needles", {{"count", 123}})), 123u);
  EXPECT_EQ(count_triangles(make_scene("degenerate", {{"count", 77}})), 77u);
  EXPECT_EQ(count_triangles(make_scene("box")), 36u);
  EXPECT_EQ(count_triangles(make_scene("one")), 1u);
  EXPECT_EQ(count_triangles(make_scene("none")), 0u);
}

TEST(Generators, RoomIsOfTheStatedSizeAndComplete) {
  const Scene room = make_scene("room");
  const WorldTriangles world = flatten(room);
  EXPECT_NEAR(static_cast<double>(world.vertices.size()), 230000, 11500);
  EXPECT_LT(count_triangles(make_scene("room", {{"detail", 0.02}})), 60000u);
  EXPECT_GE(room.materials.size(), 25u);
  EXPECT_GE(room.textures.size(), 4u);
  EXPECT_GE(room.lights.size(), 3u);
  const ViewCamera view = default_view(room, world);
  EXPECT_EQ(view.name, "camera");
  // The eye is inside the room.
  EXPECT_LT(std::abs(view.eye().x), 3.0);
  EXPECT_LT(std::abs(view.eye().z), 2.4);
  for (const Mesh& mesh : room.meshes)
    for (const Primitive& p : mesh.primitives) {
      ASSERT_EQ(p.normals.size(), p.positions.size()) << mesh.name;
      ASSERT_NE(p.material, kNone) << mesh.name;
      if (room.materials[p.material].base_texture != kNone) {
        ASSERT_EQ(p.texcoords[0].size(), p.positions.size()) << mesh.name;
      }
      for (const glm::vec3& n : p.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-4f) << mesh.name;
    }
}

/// Shading normals and windings of everything agree, as far as a curved surface allows.
TEST(Generators, NormalsPointTheWayTheTrianglesTurn) {
  for (const char* name : {"box", "sphere", "knot", "field", "slivers", "room"}) {
    SCOPED_TRACE(name);
    const SceneParameters parameters =
        name == std::string("room") ? SceneParameters{{"detail", 0.5}} : SceneParameters{};
    for (const Mesh& mesh : make_scene(name, parameters).meshes)
      for (const Primitive& p : mesh.primitives) {
        std::size_t against = 0;
        for (const glm::uvec3& t : p.triangles) {
          if (p.normals.empty()) continue;
          const glm::dvec3 a(p.positions[t.x]), b(p.positions[t.y]), c(p.positions[t.z]);
          against +=
              glm::dot(glm::cross(b - a, c - a), glm::dvec3(p.normals[t.x] + p.normals[t.y] + p.normals[t.z])) < 0;
        }
        EXPECT_LE(against, p.triangles.size() / 100) << mesh.name;
      }
  }
}

TEST(Generators, SameParametersSameBytesOtherSeedOtherBytes) {
  for (const SceneGenerator& generator : scene_generators()) {
    SCOPED_TRACE(generator.name);
    SceneParameters parameters, other;
    if (generator.name == "room") parameters = other = {{"detail", 0.02}};
    bool seeded = false;
    for (const SceneParameter& p : generator.parameters) seeded = seeded || p.name == "seed";
    const auto bytes = to_glb(make_scene(generator.name, parameters));
    EXPECT_EQ(bytes, to_glb(make_scene(generator.name, parameters)));
    if (!seeded) continue;
    other["seed"] = 2;
    EXPECT_NE(bytes, to_glb(make_scene(generator.name, other)));
  }
}

TEST(Generators, FilesHoldTheScene) {
  for (const SceneGenerator& generator : scene_generators()) {
    SCOPED_TRACE(generator.name);
    const Scene made =
        make_scene(generator.name, generator.name == "room" ? SceneParameters{{"detail", 0.05}} : SceneParameters{});
    const Scene read = load_gltf_memory(to_glb(made));
    ASSERT_EQ(read.nodes.size(), made.nodes.size());
    ASSERT_EQ(read.meshes.size(), made.meshes.size());
    ASSERT_EQ(read.materials.size(), made.materials.size());
    ASSERT_EQ(read.textures.size(), made.textures.size());
    ASSERT_EQ(read.cameras.size(), made.cameras.size());
    ASSERT_EQ(read.lights.size(), made.lights.size());
    EXPECT_EQ(read.roots, made.roots);
    for (std::size_t i = 0; i < made.nodes.size(); ++i) {
      EXPECT_EQ(read.nodes[i].name, made.nodes[i].name);
      EXPECT_EQ(read.nodes[i].mesh, made.nodes[i].mesh);
      EXPECT_EQ(read.nodes[i].camera, made.nodes[i].camera);
      EXPECT_EQ(read.nodes[i].light, made.nodes[i].light);
    }
    for (std::size_t m = 0; m < made.meshes.size(); ++m) {
      ASSERT_EQ(read.meshes[m].primitives.size(), made.meshes[m].primitives.size());
      for (std::size_t k = 0; k < made.meshes[m].primitives.size(); ++k) {
        const Primitive &a = read.meshes[m].primitives[k], &b = made.meshes[m].primitives[k];
        EXPECT_EQ(a.positions, b.positions);
        EXPECT_EQ(a.normals, b.normals);
        EXPECT_EQ(a.texcoords[0], b.texcoords[0]);
        EXPECT_EQ(a.triangles, b.triangles);
        EXPECT_EQ(a.material, b.material);
      }
    }
    for (std::size_t i = 0; i < made.materials.size(); ++i) {
      const Material &a = read.materials[i], &b = made.materials[i];
      EXPECT_EQ(a.base_color, b.base_color);
      EXPECT_EQ(a.base_texture, b.base_texture);
      EXPECT_EQ(a.metallic, b.metallic);
      EXPECT_EQ(a.roughness, b.roughness);
      EXPECT_EQ(a.double_sided, b.double_sided);
      EXPECT_LT(glm::length(a.emissive - b.emissive), 1e-5f * (1 + glm::length(b.emissive)));
    }
    for (std::size_t i = 0; i < made.textures.size(); ++i) {
      const Texture &a = read.textures[i], &b = made.textures[i];
      ASSERT_EQ(a.texels.size(), b.texels.size());
      float worst = 0;
      for (std::size_t t = 0; t < a.texels.size(); ++t) worst = std::max(worst, glm::length(a.texels[t] - b.texels[t]));
      EXPECT_LT(worst, 1e-5f);
    }
    for (std::size_t i = 0; i < made.lights.size(); ++i) {
      EXPECT_EQ(read.lights[i].type, made.lights[i].type);
      EXPECT_EQ(read.lights[i].intensity, made.lights[i].intensity);
      EXPECT_EQ(read.lights[i].color, made.lights[i].color);
      EXPECT_EQ(read.lights[i].outer_cone, made.lights[i].outer_cone);
    }
    const WorldTriangles a = flatten(read), b = flatten(made);
    ASSERT_EQ(a.vertices.size(), b.vertices.size());
    for (std::size_t i = 0; i < a.vertices.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) ASSERT_LT(glm::length(a.vertices[i][c] - b.vertices[i][c]), 1e-12);
  }
}

TEST(Generators, DegenerateSceneIsWhatItSays) {
  const GridScene grid = snap(flatten(make_scene("degenerate")));
  EXPECT_GT(grid.degenerate, 300u);
  EXPECT_GE(grid.triangles.size(), 100u);
}

TEST(Generators, FieldIsInstanced) {
  const Scene scene = make_scene("field", {{"count", 300}});
  std::map<std::uint32_t, int> users;
  for (const Node& node : scene.nodes)
    if (node.mesh != kNone) ++users[node.mesh];
  EXPECT_EQ(scene.meshes.size(), 5u);
  int many = 0;
  for (const auto& [mesh, count] : users) many += count > 20;
  EXPECT_EQ(many, 4);
}

TEST(Generators, BadRequestsAreExplained) {
  const auto message = [](const std::string& name, const std::vector<std::string>& texts) -> std::string {
    try {
      make_scene(name, parse_scene_parameters(texts));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(message("casle", {}).rfind("there is no scene 'casle'; there are: box, room, ", 0), 0u);
  EXPECT_EQ(message("knot", {"size=3"}),
            "scene knot: there is no parameter 'size'; there are: along, around, p, q, radius");
  EXPECT_EQ(message("one", {"size=3"}), "scene one: there is no parameter 'size'; the scene has none");
  EXPECT_EQ(message("knot", {"along=7"}), "scene knot: 'along' must be from 8 to 100000, is 7");
  EXPECT_EQ(message("knot", {"along=8.5"}), "scene knot: 'along' must be an integer, is 8.5");
  EXPECT_EQ(message("room", {"detail=1e9"}), "scene room: 'detail' must be from 0.02 to 20, is 1000000000");
  EXPECT_EQ(message("knot", {"along"}), "parameter 'along' is not of the form name=number");
  EXPECT_EQ(message("knot", {"=4"}), "parameter '=4' is not of the form name=number");
  EXPECT_EQ(message("knot", {"along=ten"}), "parameter 'along=ten': 'ten' is not a number");
  EXPECT_EQ(message("knot", {"along=10x"}), "parameter 'along=10x': '10x' is not a number");
  EXPECT_EQ(message("knot", {"along=nan"}), "parameter 'along=nan': 'nan' is not a number");
  EXPECT_EQ(message("knot", {"along=inf"}), "parameter 'along=inf': 'inf' is not a number");
  EXPECT_EQ(message("knot", {"along=10", "along=11"}), "parameter 'along' is given twice");
  EXPECT_EQ(message("sphere", {"seed=-1"}), "scene sphere: 'seed' must be from 0 to 4294967295, is -1");
}

TEST(Generators, CommittedFilesAreUpToDate) {
  const std::string folder = RETRACE_SOURCE_DIR "/scenes/";
  std::ifstream list(folder + "shipped.txt");
  ASSERT_TRUE(list);
  int files = 0;
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string file, scene;
    words >> file >> scene;
    const std::vector<std::string> parameters{std::istream_iterator<std::string>(words), {}};
    SCOPED_TRACE(file);
    std::ifstream stream(folder + file, std::ios::binary);
    const std::vector<std::uint8_t> committed{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_TRUE(committed == to_glb(make_scene(scene, parse_scene_parameters(parameters))))
        << "run scenes/regenerate.sh";
    ++files;
  }
  EXPECT_EQ(files, 10);
}

}  // namespace
}  // namespace retrace
