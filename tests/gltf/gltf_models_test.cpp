// Every glTF file of Debian's assimp-testmodels, many of them malformed on purpose: it loads, or ends in an Error of
// one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "golden/gltf/gltf_loader.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace {
namespace {

std::vector<std::filesystem::path> models() {
  std::vector<std::filesystem::path> found;
  std::error_code status;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(RETRACE_MODELS_DIR, status)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".gltf" || extension == ".glb") found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

TEST(GltfModels, EachLoadsOrSaysWhyNot) {
  const auto paths = models();
  if (paths.empty()) GTEST_SKIP() << "no models in " RETRACE_MODELS_DIR;
  int loaded = 0;
  for (const auto& path : paths) {
    SCOPED_TRACE(path.string());
    try {
      snap(flatten(load_gltf(path)));
      ++loaded;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_EQ(message.rfind(path.string() + ": ", 0), 0u) << message;
      EXPECT_GT(message.size(), path.string().size() + 10) << message;
    }
  }
  EXPECT_GT(loaded, 20) << "of " << paths.size();
}

TEST(GltfModels, KnownContents) {
  const std::filesystem::path folder = std::filesystem::path(RETRACE_MODELS_DIR) / "glTF2";
  const auto engine = folder / "2CylinderEngine-glTF-Binary" / "2CylinderEngine.glb";
  const auto box = folder / "BoxTextured-glTF" / "BoxTextured.gltf";
  if (!std::filesystem::exists(engine) || !std::filesystem::exists(box))
    GTEST_SKIP() << "no models in " RETRACE_MODELS_DIR;
  const Scene scene = load_gltf(engine);
  const WorldTriangles world = flatten(scene);
  EXPECT_EQ(world.vertices.size(), 121496u);
  EXPECT_EQ(snap(world).degenerate, 11160u);
  const Scene textured = load_gltf(box);
  ASSERT_EQ(textured.textures.size(), 1u);
  EXPECT_EQ(textured.textures[0].width, 211);
}

}  // namespace
}  // namespace retrace
