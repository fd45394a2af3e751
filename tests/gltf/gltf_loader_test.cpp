// What the glTF loader promises, feature by feature, on files made for it.
#include "golden/gltf/gltf_loader.hpp"

#include <gtest/gtest.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "gltf_builder.hpp"
#include "golden/base/base64.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace {
namespace {

using nlohmann::json;
using test::base64;
using test::Bytes;
using test::GltfBuilder;

Scene load(const GltfBuilder& b, const GltfOptions& options = {}) { return load_gltf_memory(b.gltf(), options); }

/// A folder that goes away with the test.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "retrace-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path write(const std::string& name, const Bytes& bytes) const {
    const std::filesystem::path path = path_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path;
  }

 private:
  std::filesystem::path path_;
};

template <class T>
Bytes encode(const char* format, int width, int height, int channels, const std::vector<T>& texels) {
  const auto type = sizeof(T) == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
  Bytes out;
  OIIO::Filesystem::IOVecOutput sink(out);
  const auto output = OIIO::ImageOutput::create(format);
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  EXPECT_TRUE(output && output->set_ioproxy(&sink) && output->open(std::string("x.") + format, spec) &&
              output->write_image(type, texels.data()) && output->close());
  return out;
}

double linear(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

/// The triangle with a material whose base colour comes from an image.
GltfBuilder with_image(json image, json sampler = json::object()) {
  GltfBuilder b = GltfBuilder::triangle();
  b.add("images", std::move(image));
  b.add("samplers", std::move(sampler));
  b.add("textures", {{"source", 0}, {"sampler", 0}});
  b.primitive()["material"] = b.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  return b;
}

TEST(GltfLoader, TextAndBinaryGiveTheSameTriangle) {
  const GltfBuilder b = GltfBuilder::triangle();
  for (const Bytes& bytes : {b.gltf(), b.glb()}) {
    const Scene scene = load_gltf_memory(bytes);
    ASSERT_EQ(scene.meshes.size(), 1u);
    const Primitive& p = scene.meshes[0].primitives.at(0);
    ASSERT_EQ(p.triangles.size(), 1u);
    EXPECT_EQ(p.triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_EQ(p.positions.at(1), glm::vec3(1, 0, 0));
    EXPECT_EQ(p.material, kNone);
    EXPECT_TRUE(p.normals.empty() && p.colors.empty() && p.texcoords[0].empty() && p.texcoords[1].empty());
    EXPECT_EQ(scene.roots, std::vector<std::uint32_t>{0});
  }
}

TEST(GltfLoader, ByteOrderMarkIsSkipped) {
  Bytes bytes = GltfBuilder::triangle().gltf();
  bytes.insert(bytes.begin(), {0xef, 0xbb, 0xbf});
  EXPECT_EQ(load_gltf_memory(bytes).meshes.size(), 1u);
}

TEST(GltfLoader, ExternalFilesAreFoundBesideTheGltf) {
  const Folder folder;
  GltfBuilder b = GltfBuilder::triangle();
  b.root["buffers"] = json::array({{{"byteLength", b.buffer.size()}, {"uri", "data%20of/it/../my%20buffer.bin"}}});
  const auto path = folder.write("my scene.gltf", b.gltf());
  folder.write("data of/my buffer.bin", b.buffer);
  const Scene scene = load_gltf(path);
  EXPECT_EQ(scene.name, "my scene.gltf");
  EXPECT_EQ(scene.meshes.at(0).primitives.at(0).positions.at(2), glm::vec3(0, 1, 0));
  // A .glb may have an external buffer beside or instead of its own.
  const auto binary = folder.write("binary.glb", GltfBuilder::glb(b.root.dump(), {}));
  EXPECT_EQ(load_gltf(binary).meshes.size(), 1u);
}

TEST(GltfLoader, IndicesOfAllWidths) {
  for (const int component : {GltfBuilder::kUnsignedByte, GltfBuilder::kUnsignedShort, GltfBuilder::kUnsignedInt}) {
    GltfBuilder b;
    const int positions = b.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3");
    const std::vector<std::uint32_t> list = {2, 3, 0, 0, 1, 2};
    int indices = -1;
    if (component == GltfBuilder::kUnsignedByte)
      indices = b.values(std::vector<std::uint8_t>(list.begin(), list.end()), component, "SCALAR");
    if (component == GltfBuilder::kUnsignedShort)
      indices = b.values(std::vector<std::uint16_t>(list.begin(), list.end()), component, "SCALAR");
    if (component == GltfBuilder::kUnsignedInt) indices = b.values(list, component, "SCALAR");
    b.root_node({{"mesh", b.mesh({{"POSITION", positions}}, indices)}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).primitives.at(0).triangles, (std::vector<glm::uvec3>{{2, 3, 0}, {0, 1, 2}}));
  }
}

TEST(GltfLoader, StripsAndFansAreUnrolledWithTheirWinding) {
  std::vector<float> points;
  for (int i = 0; i < 5; ++i) points.insert(points.end(), {static_cast<float>(i), static_cast<float>(i * i), 0.0f});
  const std::vector<std::uint8_t> reversed = {4, 3, 2, 1, 0};
  for (const bool indexed : {false, true}) {
    const auto v = [&](std::uint32_t i) { return indexed ? 4 - i : i; };
    GltfBuilder b;
    const int positions = b.floats(points, "VEC3");
    const int indices = indexed ? b.values(reversed, GltfBuilder::kUnsignedByte, "SCALAR") : -1;
    for (const int mode : {4, 5, 6}) b.root_node({{"mesh", b.mesh({{"POSITION", positions}}, indices, mode)}});
    const Scene scene = load(b);
    // Five corners: one whole triangle as a list, three as a strip or a fan.
    EXPECT_EQ(scene.meshes.at(0).primitives.at(0).triangles, (std::vector<glm::uvec3>{{v(0), v(1), v(2)}}));
    EXPECT_EQ(scene.meshes.at(1).primitives.at(0).triangles,
              (std::vector<glm::uvec3>{{v(0), v(1), v(2)}, {v(1), v(3), v(2)}, {v(2), v(3), v(4)}}));
    EXPECT_EQ(scene.meshes.at(2).primitives.at(0).triangles,
              (std::vector<glm::uvec3>{{v(1), v(2), v(0)}, {v(2), v(3), v(0)}, {v(3), v(4), v(0)}}));
  }
}

TEST(GltfLoader, PointsAndLinesKeepTheirPlaceEmptyAndAreReported) {
  const Folder folder;
  GltfBuilder b = GltfBuilder::triangle();
  json triangle = b.primitive();
  b.root["meshes"][0]["name"] = "mixed";
  b.root["meshes"][0]["primitives"] = json::array();
  for (int mode = 0; mode <= 4; ++mode) {
    triangle["mode"] = mode;
    b.root["meshes"][0]["primitives"].push_back(triangle);
  }
  b.root["extensionsUsed"] = {"EXT_unheard_of", "KHR_lights_punctual"};
  std::vector<std::string> warnings;
  const Scene scene = load_gltf(folder.write("a.gltf", b.gltf()), {}, &warnings);
  ASSERT_EQ(scene.meshes[0].primitives.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(scene.meshes[0].primitives[i].triangles.empty());
  EXPECT_EQ(scene.meshes[0].primitives[4].triangles.size(), 1u);
  ASSERT_EQ(warnings.size(), 5u);
  EXPECT_NE(warnings[0].find("a.gltf: extension 'EXT_unheard_of'"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("mesh 0 'mixed' primitive 0: points and lines"), std::string::npos) << warnings[1];
  const WorldTriangles world = flatten(scene);
  ASSERT_EQ(world.sources.size(), 1u);
  EXPECT_EQ(world.sources[0].primitive, 4u);
}

TEST(GltfLoader, InterleavedAttributesWithOffsetsAndStride) {
  GltfBuilder b;
  // Position, normal, texture coordinate, one after the other for each vertex.
  const int view = b.view(std::vector<float>{0, 0, 0, 0, 0, 1, 0.00f, 0.25f,  //
                                             1, 0, 0, 0, 1, 0, 0.50f, 0.75f,  //
                                             0, 1, 0, 1, 0, 0, 1.00f, 0.125f},
                          32);
  const int positions = b.accessor(view, GltfBuilder::kFloat, 3, "VEC3");
  const int normals = b.accessor(view, GltfBuilder::kFloat, 3, "VEC3", 12);
  const int coords = b.accessor(view, GltfBuilder::kFloat, 3, "VEC2", 24);
  b.root_node({{"mesh", b.mesh({{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_0", coords}})}});
  const Primitive p = load(b).meshes.at(0).primitives.at(0);
  EXPECT_EQ(p.positions, (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(p.normals, (std::vector<glm::vec3>{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}}));
  EXPECT_EQ(p.texcoords[0], (std::vector<glm::vec2>{{0, 0.25f}, {0.5f, 0.75f}, {1, 0.125f}}));
}

TEST(GltfLoader, SparseAccessorsWithAndWithoutBase) {
  for (const bool base : {true, false}) {
    GltfBuilder b;
    const int view = base ? b.view(std::vector<float>{9, 9, 9, 1, 0, 0, 8, 8, 8, 7, 7, 7}) : -1;
    const int positions = b.accessor(view, GltfBuilder::kFloat, 4, "VEC3");
    const int indices = b.view(std::vector<std::uint8_t>{0, 2});
    const int values = b.view(std::vector<float>{0, 0, 5, 0, 1, 5});
    b.root["accessors"][positions]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", indices}, {"componentType", GltfBuilder::kUnsignedByte}}},
        {"values", {{"bufferView", values}}}};
    b.root_node({{"mesh", b.mesh({{"POSITION", positions}}, -1, 5)}});
    const Primitive p = load(b).meshes.at(0).primitives.at(0);
    const glm::vec3 untouched1 = base ? glm::vec3(1, 0, 0) : glm::vec3(0),
                    untouched3 = base ? glm::vec3(7) : glm::vec3(0);
    EXPECT_EQ(p.positions, (std::vector<glm::vec3>{{0, 0, 5}, untouched1, {0, 1, 5}, untouched3}));
  }
}

TEST(GltfLoader, NormalisedAndQuantisedAccessors) {
  GltfBuilder b;
  const auto normalised = [&](int accessor) {
    b.root["accessors"][accessor]["normalized"] = true;
    return accessor;
  };
  const int positions =
      normalised(b.accessor(b.view(std::vector<std::int16_t>{-32768, -32767, 0, 0, 32767, 0, 0, 0, 0, 16384, 0, 0}, 8),
                            GltfBuilder::kShort, 3, "VEC3"));
  const int plain = b.accessor(b.view(std::vector<std::uint8_t>{0, 1, 2, 0, 255, 4, 5, 0, 6, 7, 8, 0}, 4),
                               GltfBuilder::kUnsignedByte, 3, "VEC3");
  const int normals = normalised(b.accessor(
      b.view(std::vector<std::int8_t>{-128, 0, 127, 0, 0, 127, 0, 0, 64, 0, 0, 0}, 4), GltfBuilder::kByte, 3, "VEC3"));
  const int coords =
      normalised(b.values(std::vector<std::uint16_t>{0, 65535, 32768, 0, 1, 2}, GltfBuilder::kUnsignedShort, "VEC2"));
  const int colors = normalised(b.values(std::vector<std::uint8_t>{255, 0, 51, 102, 0, 0, 0, 0, 255, 255, 255, 255},
                                         GltfBuilder::kUnsignedByte, "VEC4"));
  b.root["extensionsRequired"] = {"KHR_mesh_quantization"};
  b.root_node(
      {{"mesh", b.mesh({{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_1", coords}, {"COLOR_0", colors}})}});
  b.root_node({{"mesh", b.mesh({{"POSITION", plain}})}});
  const Scene scene = load(b);
  const Primitive& p = scene.meshes.at(0).primitives.at(0);
  EXPECT_EQ(p.positions[0], glm::vec3(-1, -1, 0));
  EXPECT_EQ(p.positions[1], glm::vec3(1, 0, 0));
  EXPECT_FLOAT_EQ(p.positions[2].y, 16384 / 32767.0f);
  EXPECT_EQ(p.normals[0], glm::vec3(-1, 0, 1));
  EXPECT_EQ(p.texcoords[1][0], glm::vec2(0, 1));
  EXPECT_FLOAT_EQ(p.texcoords[1][1].x, 32768 / 65535.0f);
  EXPECT_FLOAT_EQ(p.colors[0].b, 0.2f);
  EXPECT_FLOAT_EQ(p.colors[0].a, 0.4f);
  EXPECT_EQ(scene.meshes.at(1).primitives.at(0).positions[1], glm::vec3(255, 4, 5));
}

TEST(GltfLoader, SharedVertexBuffersAreCutToWhatAPrimitiveUses) {
  GltfBuilder b;
  std::vector<float> points;
  for (int i = 0; i < 300; ++i) points.insert(points.end(), {static_cast<float>(i), static_cast<float>(i % 7), 1.0f});
  std::vector<float> coords;
  for (int i = 0; i < 300; ++i) coords.insert(coords.end(), {static_cast<float>(i), 0.0f});
  const int positions = b.floats(points, "VEC3"), uv = b.floats(coords, "VEC2");
  const int indices =
      b.values(std::vector<std::uint16_t>{299, 7, 120, 7, 299, 3}, GltfBuilder::kUnsignedShort, "SCALAR");
  b.root_node({{"mesh", b.mesh({{"POSITION", positions}, {"TEXCOORD_0", uv}}, indices)}});
  const Primitive p = load(b).meshes.at(0).primitives.at(0);
  EXPECT_EQ(p.positions.size(), 4u);
  ASSERT_EQ(p.triangles.size(), 2u);
  const float expected[2][3] = {{299, 7, 120}, {7, 299, 3}};
  for (std::size_t t = 0; t < 2; ++t)
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(p.positions[p.triangles[t][c]].x, expected[t][c]);
      EXPECT_EQ(p.texcoords[0][p.triangles[t][c]].x, expected[t][c]);
    }
}

TEST(GltfLoader, HierarchyOfMatricesAndTrs) {
  GltfBuilder b = GltfBuilder::triangle();
  b.root["nodes"][0]["translation"] = {0, 0, 5};
  b.root["nodes"][0]["children"] = {1, 3};
  const double h = std::sqrt(0.5);
  b.add("nodes", {{"rotation", {0, 0, h, h}}, {"scale", {2, 3, 4}}, {"children", {2}}});  // a quarter turn about z
  b.add("nodes", {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1}}, {"mesh", 0}});
  b.add("nodes", {{"rotation", {0, 0, 0, 2}}, {"mesh", 0}});  // not of unit length: normalised
  const Scene scene = load(b);
  EXPECT_EQ(scene.reachable(), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(scene.nodes[2].parent, 1u);
  const WorldTriangles world = flatten(scene);
  ASSERT_EQ(world.vertices.size(), 3u);
  // Node 2: (x, y, z) -> (x+10, y+20, z+30) -> scale -> turn -> +5 in z. Vertex 1 is (1, 0, 0).
  const glm::dvec3 p = world.vertices[1][1], q(-3 * 20, 2 * 11, 4 * 30 + 5);
  EXPECT_LT(glm::length(p - q), 1e-12);
  EXPECT_LT(glm::length(world.vertices[2][1] - glm::dvec3(1, 0, 5)), 1e-15);
  EXPECT_EQ(world.sources[1].node, 2u);
}

TEST(GltfLoader, ScenesAreChosen) {
  GltfBuilder b = GltfBuilder::triangle();
  b.add("nodes", {{"mesh", 0}, {"translation", {1, 0, 0}}});
  b.add("nodes", {{"mesh", 0}, {"translation", {2, 0, 0}}});
  b.root["scenes"].push_back({{"nodes", {1, 2, 1}}});
  EXPECT_EQ(load(b).roots, std::vector<std::uint32_t>{0});
  b.root["scene"] = 1;
  EXPECT_EQ(load(b).roots, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(flatten(load(b)).vertices.size(), 2u);
  GltfOptions options;
  options.scene = 0;
  EXPECT_EQ(load(b, options).roots, std::vector<std::uint32_t>{0});
  options.scene = 2;
  EXPECT_THROW(load(b, options), Error);
  b.root.erase("scenes");
  b.root.erase("scene");
  EXPECT_EQ(load(b).roots, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(GltfLoader, DeepHierarchyNeedsNoStack) {
  GltfBuilder b = GltfBuilder::triangle();
  b.root["nodes"][0].erase("mesh");
  const int depth = 30000;
  for (int i = 1; i <= depth; ++i) {
    b.root["nodes"][i - 1]["children"] = {i};
    b.add("nodes", {{"translation", {1, 0, 0}}});
  }
  b.root["nodes"][depth]["mesh"] = 0;
  const WorldTriangles world = flatten(load(b));
  ASSERT_EQ(world.vertices.size(), 1u);
  EXPECT_EQ(world.vertices[0][0], glm::dvec3(depth, 0, 0));
}

TEST(GltfLoader, Materials) {
  GltfBuilder b = GltfBuilder::triangle();
  b.add("materials", json::object());
  b.add("materials",
        {{"name", "m"},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.75}}},
         {"emissiveFactor", {0.5, 0.25, 1}},
         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}},
         {"alphaMode", "MASK"},
         {"alphaCutoff", 0.3},
         {"doubleSided", true}});
  b.add("materials", {{"alphaMode", "BLEND"},
                      {"extensions",
                       {{"KHR_materials_pbrSpecularGlossiness",
                         {{"diffuseFactor", {0.5, 0.6, 0.7, 1}}, {"glossinessFactor", 0.75}}}}}});
  b.primitive()["material"] = 1;
  const Scene scene = load(b);
  ASSERT_EQ(scene.materials.size(), 3u);
  const Material &plain = scene.materials[0], &m = scene.materials[1], &gloss = scene.materials[2];
  EXPECT_EQ(plain.base_color, glm::vec4(1));
  EXPECT_EQ(plain.emissive, glm::vec3(0));
  EXPECT_EQ(plain.metallic, 1.0f);
  EXPECT_EQ(plain.roughness, 1.0f);
  EXPECT_EQ(plain.alpha, Material::Alpha::kOpaque);
  EXPECT_FALSE(plain.double_sided);
  EXPECT_EQ(m.name, "m");
  EXPECT_EQ(m.base_color, glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
  EXPECT_EQ(m.emissive, glm::vec3(4, 2, 8));
  EXPECT_EQ(m.metallic, 0.25f);
  EXPECT_EQ(m.roughness, 0.75f);
  EXPECT_EQ(m.alpha, Material::Alpha::kMask);
  EXPECT_EQ(m.alpha_cutoff, 0.3f);
  EXPECT_TRUE(m.double_sided);
  EXPECT_EQ(gloss.base_color, glm::vec4(0.5f, 0.6f, 0.7f, 1));
  EXPECT_EQ(gloss.metallic, 0.0f);
  EXPECT_EQ(gloss.roughness, 0.25f);
  EXPECT_EQ(gloss.alpha, Material::Alpha::kBlend);
  EXPECT_EQ(scene.meshes[0].primitives[0].material, 1u);
}

TEST(GltfLoader, ImagesFromFileDataUriAndBufferView) {
  const std::vector<std::uint8_t> texels = {0, 128, 255, 255, 255, 255, 255, 0, 10, 20, 30, 128, 200, 100, 50, 255};
  const Bytes png = encode("png", 2, 2, 4, texels);
  const Folder folder;
  folder.write("tex/a b.png", png);
  GltfBuilder from_view = with_image(json::object());
  from_view.root["images"][0] = {{"mimeType", "image/png"}, {"bufferView", from_view.view(png)}};
  const Scene scenes[] = {
      load_gltf(folder.write("f.gltf", with_image({{"uri", "tex/a%20b.png"}, {"name", "logo"}}).gltf())),
      load(with_image({{"uri", "data:image/png;base64," + base64(png)}})), load(from_view),
      load_gltf_memory(from_view.glb())};
  for (const Scene& scene : scenes) {
    ASSERT_EQ(scene.textures.size(), 1u);
    const Texture& t = scene.textures[0];
    ASSERT_EQ(t.width, 2);
    ASSERT_EQ(t.height, 2);
    ASSERT_EQ(t.texels.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      // Colour is sRGB, alpha is linear and has not been multiplied in.
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(t.texels[i][c], linear(texels[4 * i + static_cast<std::size_t>(c)] / 255.0), 1e-6);
      EXPECT_NEAR(t.texels[i].a, texels[4 * i + 3] / 255.0, 1e-6);
    }
    EXPECT_EQ(scene.materials[0].base_texture, 0u);
  }
  EXPECT_EQ(scenes[0].textures[0].name, "logo");
}

TEST(GltfLoader, ImageFormats) {
  const auto texel = [](const Bytes& image, std::size_t i) {
    return load(with_image({{"uri", "data:application/octet-stream;base64," + base64(image)}}))
        .textures.at(0)
        .texels.at(i);
  };
  EXPECT_EQ(texel(encode<std::uint8_t>("png", 2, 1, 1, {0, 255}), 1), glm::vec4(1));
  const glm::vec4 grey_alpha = texel(encode<std::uint8_t>("png", 1, 1, 2, {188, 51}), 0);
  EXPECT_NEAR(grey_alpha.g, linear(188 / 255.0), 1e-6);
  EXPECT_NEAR(grey_alpha.a, 0.2, 1e-6);
  const glm::vec4 wide = texel(encode<std::uint16_t>("png", 1, 1, 3, {65535, 32768, 1000}), 0);
  EXPECT_NEAR(wide.r, 1.0, 1e-6);
  EXPECT_NEAR(wide.g, linear(32768 / 65535.0), 1e-6);
  EXPECT_NEAR(wide.b, linear(1000 / 65535.0), 1e-6);
  const glm::vec4 lossy = texel(encode("jpeg", 16, 16, 3, std::vector<std::uint8_t>(16 * 16 * 3, 128)), 100);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(lossy[c], linear(128 / 255.0), 0.01);
  EXPECT_EQ(lossy.a, 1.0f);
}

TEST(GltfLoader, SamplersAndSharedImages) {
  const std::string uri = "data:image/png;base64," + base64(encode<std::uint8_t>("png", 1, 1, 3, {255, 0, 0}));
  GltfBuilder b = with_image({{"uri", uri}}, {{"wrapS", 33071}, {"wrapT", 33648}});
  b.add("textures", {{"source", 0}});
  b.add("textures", {{"source", 0}, {"sampler", 0}});
  b.add("textures", {{"source", 0}});  // nobody uses this one
  b.root["materials"][0]["emissiveTexture"] = {{"index", 1}, {"texCoord", 1}};
  b.add("materials", {{"emissiveTexture", {{"index", 2}}}});
  const Scene scene = load(b);
  ASSERT_EQ(scene.textures.size(), 2u);
  EXPECT_EQ(scene.textures[0].wrap_u, Texture::Wrap::kClamp);
  EXPECT_EQ(scene.textures[0].wrap_v, Texture::Wrap::kMirror);
  EXPECT_EQ(scene.textures[1].wrap_u, Texture::Wrap::kRepeat);
  EXPECT_EQ(scene.textures[1].texels, scene.textures[0].texels);
  EXPECT_EQ(scene.materials[0].base_texture, 0u);
  EXPECT_EQ(scene.materials[0].emissive_texture, 1u);
  EXPECT_EQ(scene.materials[0].emissive_texcoord, 1);
  EXPECT_EQ(scene.materials[1].emissive_texture, 0u);
  GltfOptions options;
  options.textures = false;
  EXPECT_TRUE(load(b, options).textures.empty());
  EXPECT_EQ(load(b, options).materials[0].base_texture, kNone);
}

TEST(GltfLoader, Cameras) {
  GltfBuilder b = GltfBuilder::triangle();
  b.add(
      "cameras",
      {{"type", "perspective"}, {"name", "p"}, {"perspective", {{"yfov", 0.5}, {"aspectRatio", 1.5}, {"znear", 0.1}}}});
  b.add("cameras",
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 2}, {"ymag", -3}, {"znear", 0}, {"zfar", 10}}}});
  b.root_node({{"camera", 1}});
  const Scene scene = load(b);
  ASSERT_EQ(scene.cameras.size(), 2u);
  EXPECT_TRUE(scene.cameras[0].perspective);
  EXPECT_EQ(scene.cameras[0].name, "p");
  EXPECT_EQ(scene.cameras[0].yfov, 0.5);
  EXPECT_EQ(scene.cameras[0].aspect, 1.5);
  EXPECT_EQ(scene.cameras[0].znear, 0.1);
  EXPECT_FALSE(scene.cameras[1].perspective);
  EXPECT_EQ(scene.cameras[1].xmag, 2);
  EXPECT_EQ(scene.cameras[1].ymag, 3);
  EXPECT_EQ(scene.nodes[1].camera, 1u);
}

TEST(GltfLoader, PunctualLights) {
  GltfBuilder b = GltfBuilder::triangle();
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "directional"}, {"intensity", 3}},
      {{"type", "point"}, {"name", "bulb"}, {"color", {1, 0.5, 0.25}}, {"intensity", 40}, {"range", 7}},
      {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}}};
  b.root_node({{"extensions", {{"KHR_lights_punctual", {{"light", 2}}}}}});
  const Scene scene = load(b);
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0].type, Light::Type::kDirectional);
  EXPECT_EQ(scene.lights[0].intensity, 3.0f);
  EXPECT_EQ(scene.lights[0].color, glm::vec3(1));
  EXPECT_EQ(scene.lights[1].type, Light::Type::kPoint);
  EXPECT_EQ(scene.lights[1].name, "bulb");
  EXPECT_EQ(scene.lights[1].color, glm::vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(scene.lights[1].range, 7.0f);
  EXPECT_EQ(scene.lights[2].type, Light::Type::kSpot);
  EXPECT_EQ(scene.lights[2].inner_cone, 0.25f);
  EXPECT_EQ(scene.lights[2].outer_cone, 0.5f);
  EXPECT_EQ(scene.nodes[1].light, 2u);
  EXPECT_EQ(scene.nodes[0].light, kNone);
}

TEST(GltfLoader, AccessorsWithoutDataAreZeros) {
  GltfBuilder b = GltfBuilder::triangle();
  b.primitive()["attributes"]["TEXCOORD_0"] = b.accessor(-1, GltfBuilder::kFloat, 3, "VEC2");
  b.primitive()["attributes"]["COLOR_0"] = b.accessor(-1, GltfBuilder::kUnsignedByte, 3, "VEC4");
  const int zeros = b.accessor(-1, GltfBuilder::kUnsignedShort, 3, "SCALAR");
  b.root_node({{"mesh", b.mesh({{"POSITION", b.accessor(-1, GltfBuilder::kFloat, 4, "VEC3")}}, zeros)}});
  const Scene scene = load(b);
  const Primitive& p = scene.meshes.at(0).primitives.at(0);
  EXPECT_EQ(p.texcoords[0], std::vector<glm::vec2>(3, glm::vec2(0)));
  EXPECT_EQ(p.colors, std::vector<glm::vec4>(3, glm::vec4(0)));
  const Primitive& q = scene.meshes.at(1).primitives.at(0);
  EXPECT_EQ(q.positions, std::vector<glm::vec3>(4, glm::vec3(0)));
  EXPECT_EQ(q.triangles, std::vector<glm::uvec3>(1, glm::uvec3(0)));
}

TEST(GltfLoader, DataUris) {
  const GltfBuilder b = GltfBuilder::triangle();
  const auto positions = [&](const std::string& uri) {
    GltfBuilder c = b;
    c.root["buffers"] = {{{"byteLength", c.buffer.size()}, {"uri", uri}}};
    return load(c).meshes.at(0).primitives.at(0).positions;
  };
  const std::string text = base64(b.buffer);
  std::string escaped, wrapped, raw;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char code[4];
    std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned>(text[i]));
    escaped += i % 3 == 0 ? std::string(code) : std::string(1, text[i]);
    wrapped += std::string(1, text[i]) + (i % 10 == 9 ? "\r\n" : "");
  }
  for (const std::uint8_t byte : b.buffer) {
    char code[4];
    std::snprintf(code, sizeof code, "%%%02x", byte);
    raw += code;
  }
  const auto expected = positions("data:application/octet-stream;base64," + text);
  EXPECT_EQ(positions("data:;base64," + escaped), expected);
  EXPECT_EQ(positions("DATA:a/b;charset=x;BASE64," + wrapped), expected);
  EXPECT_EQ(positions("data:application/octet-stream," + raw), expected);
}

TEST(Base64, ThereAndBack) {
  Bytes bytes;
  for (int i = 0; i < 300; ++i) {
    const std::string text = encode_base64(bytes);
    EXPECT_EQ(text.size(), (bytes.size() + 2) / 3 * 4);
    EXPECT_EQ(decode_base64(text), bytes);
    EXPECT_EQ(decode_base64(text.substr(0, text.find('='))), bytes);
    bytes.push_back(static_cast<std::uint8_t>(i * 37));
  }
  for (const char* bad : {"A", "AAAAA", "AA=A", "AA!A", "AA-_"}) EXPECT_THROW(decode_base64(bad), Error) << bad;
}

TEST(GltfLoader, MaterialsOfExtensionsAndTheirTextures) {
  const std::string uri = "data:image/png;base64," + base64(encode<std::uint8_t>("png", 1, 1, 3, {10, 128, 64}));
  GltfBuilder b = with_image({{"uri", uri}});
  json& m = b.root["materials"][0];
  m["extensions"]["KHR_materials_unlit"] = json::object();
  json& pbr = m["pbrMetallicRoughness"];
  pbr["metallicRoughnessTexture"] = {{"index", 0}, {"texCoord", 1}};
  pbr["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
      {"offset", {0.5, 0.25}}, {"rotation", 1.5707963267948966}, {"scale", {2, 3}}, {"texCoord", 1}};
  b.root["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  const Scene scene = load(b);
  const Material& material = scene.materials.at(0);
  EXPECT_TRUE(material.unlit);
  EXPECT_EQ(material.surface_texcoord, 1);
  ASSERT_LT(material.surface_texture, scene.textures.size());
  // Factors are stored as they are, colours are sRGB.
  EXPECT_NEAR(scene.textures[material.surface_texture].texels[0].g, 128 / 255.0, 1e-6);
  EXPECT_NEAR(scene.textures[material.base_texture].texels[0].g, linear(128 / 255.0), 1e-6);
  EXPECT_EQ(material.base_texcoord, 1);
  // KHR_texture_transform: translation * rotation * scale, with the matrices of its text.
  const glm::vec2 uv = material.base_transform.apply({0.1f, 0.2f});
  EXPECT_NEAR(uv.x, 0.5 + 3 * 0.2, 1e-6);
  EXPECT_NEAR(uv.y, 0.25 - 2 * 0.1, 1e-6);
  EXPECT_EQ(material.surface_transform.apply({0.1f, 0.2f}), glm::vec2(0.1f, 0.2f));
}

TEST(GltfLoader, LargeImagesAreHeldAtHalfTheirSize) {
  const std::string uri = "data:image/png;base64," + base64(encode("png", 4, 2, 1, std::vector<std::uint8_t>(8, 255)));
  GltfBuilder b = with_image({{"uri", uri}});
  b.add("images", {{"uri", uri}, {"name", "second"}});
  b.add("textures", {{"source", 1}});
  b.root["materials"][0]["emissiveTexture"] = {{"index", 1}};
  GltfOptions options;
  std::vector<std::string> notes;
  options.max_texels = 12;
  const Scene scene = load_gltf_memory(b.gltf(), options, &notes);
  ASSERT_EQ(scene.textures.size(), 2u);
  EXPECT_EQ(scene.textures[0].width, 2);
  EXPECT_EQ(scene.textures[0].height, 1);
  EXPECT_EQ(scene.textures[0].texels, std::vector<glm::vec4>(2, glm::vec4(1)));
  EXPECT_EQ(scene.textures[1].width, 4);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("image 0: is held at 2 x 1 pixels; the images of the file have more than 12 in total"),
            std::string::npos)
      << notes[0];
}

TEST(GltfLoader, InstancesAreFlattened) {
  GltfBuilder b = GltfBuilder::triangle();
  const int move = b.floats({0, 0, 0, 5, 0, 0, 0, 0, 7}, "VEC3");
  // Quarter turns about z, as normalised bytes of no particular length.
  const int turn =
      b.values(std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 90, 90, 0, 0, 0, 127}, GltfBuilder::kByte, "VEC4");
  b.root["accessors"][turn]["normalized"] = true;
  const int size = b.floats({1, 1, 1, 2, 2, 2, 1, 1, 1}, "VEC3");
  b.root["nodes"][0]["translation"] = {0, 10, 0};
  b.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", move}, {"ROTATION", turn}, {"SCALE", size}, {"_ID", 99}};
  b.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = load(b);
  const WorldTriangles world = flatten(scene);
  ASSERT_EQ(world.vertices.size(), 3u);
  EXPECT_EQ(world.vertices[0][1], glm::dvec3(1, 10, 0));
  EXPECT_LT(glm::length(world.vertices[1][1] - glm::dvec3(5, 12, 0)), 1e-12);
  EXPECT_EQ(world.vertices[2][1], glm::dvec3(1, 10, 7));
  EXPECT_EQ(scene.nodes.size(), 4u);
  EXPECT_EQ(scene.nodes[world.sources[2].node].source, 0u);
}

/// A triangle that follows two joints: vertices 0 and 1 the first, vertex 2 the second.
GltfBuilder skinned() {
  GltfBuilder b = GltfBuilder::triangle();
  b.primitive()["attributes"]["JOINTS_0"] =
      b.values(std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, GltfBuilder::kUnsignedByte, "VEC4");
  b.primitive()["attributes"]["WEIGHTS_0"] = b.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
  b.root["nodes"][0]["skin"] = b.add("skins", {{"joints", {1, 2}}});
  b.root_node({{"translation", {0, 0, 5}}});
  b.root_node({{"translation", {0, 1, 6}}});
  return b;
}

TEST(GltfLoader, StillsShowSkinsAsTheyRest) {
  for (const json& scale : {json{1, 1, 1}, json{0, 0, 0}, json{-3, 2, 1}}) {
    GltfBuilder b = skinned();
    b.root["nodes"][0]["translation"] = {100, 0, 0};  // of a skinned mesh: does not count
    b.root["nodes"][0]["scale"] = scale;
    std::vector<std::string> notes;
    const Scene scene = load_gltf_memory(b.gltf(), {.scene = {}, .posed = true}, &notes);
    EXPECT_TRUE(notes.empty());
    const WorldTriangles world = flatten(scene);
    EXPECT_EQ(world.vertices.at(0),
              (std::array<glm::dvec3, 3>{glm::dvec3(0, 0, 5), glm::dvec3(1, 0, 5), glm::dvec3(0, 2, 6)}));
    EXPECT_EQ(scene.meshes[world.sources[0].mesh].source, 0u);
  }
  // Far away the pose is as fine as anywhere.
  GltfBuilder far = skinned();
  far.root["nodes"][1]["translation"] = {5e10, 0, 0};
  far.root["nodes"][2]["translation"] = {5e10, 0, 0};
  const auto t = flatten(load_gltf_memory(far.gltf(), {.scene = {}, .posed = true})).vertices.at(0);
  EXPECT_EQ(t[1] - t[0], glm::dvec3(1, 0, 0));
  // More joints than are followed: the first eight.
  GltfBuilder many = skinned();
  for (const char* name : {"JOINTS_", "WEIGHTS_"})
    for (const char* set : {"1", "2"})
      many.primitive()["attributes"][std::string(name) + set] = many.primitive()["attributes"][std::string(name) + "0"];
  std::vector<std::string> notes;
  load_gltf_memory(many.gltf(), {.scene = {}, .posed = true}, &notes);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("more than two sets of joints"), std::string::npos);
}

TEST(GltfLoader, StillsShowMorphWeightsAsTheyRest) {
  for (const bool of_node : {false, true}) {
    GltfBuilder b = GltfBuilder::triangle();
    // As gltfpack writes them: short integers, not normalised.
    const int target = b.accessor(b.view(std::vector<std::int16_t>{0, 0, 2, 0, 0, 0, 2, 0, 4, -8, 2, 0}, 8),
                                  GltfBuilder::kShort, 3, "VEC3");
    b.primitive()["targets"] = {{{"POSITION", target}}, {{"POSITION", 99}}};
    b.primitive()["targets"].erase(1);
    if (of_node) b.root["meshes"][0]["weights"] = {7};
    (of_node ? b.root["nodes"][0] : b.root["meshes"][0])["weights"] = {0.5};
    const Scene scene = load_gltf_memory(b.gltf(), {.scene = {}, .posed = true});
    EXPECT_EQ(flatten(scene).vertices.at(0),
              (std::array<glm::dvec3, 3>{glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 1), glm::dvec3(2, -3, 1)}));
    EXPECT_EQ(flatten(load(b)).vertices.at(0)[0], glm::dvec3(0));  // as stored
  }
}

TEST(GltfLoader, WhatOthersWriteAndNobodyNeedsIsIgnored) {
  GltfBuilder b = GltfBuilder::triangle();
  b.root["animations"] = {{{"channels", "nonsense"}}};
  b.root["extras"] = {{"deep", {1, {2, {3, nullptr}}}}};
  b.root["nodes"][0]["extras"] = 42;
  b.primitive()["attributes"]["_CUSTOM"] = 77;  // no such accessor
  b.primitive()["attributes"]["TEXCOORD_7"] = 78;
  b.primitive()["targets"] = {{{"POSITION", 99}}};
  b.root["bufferViews"].push_back({{"buffer", 5}, {"byteLength", 1}});  // used by nobody
  EXPECT_EQ(load(b).meshes.at(0).primitives.at(0).triangles.size(), 1u);
}

}  // namespace
}  // namespace retrace
