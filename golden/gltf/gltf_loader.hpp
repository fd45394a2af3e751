// glTF 2.0 (.gltf and .glb) to Scene, on nlohmann::json and OpenImageIO.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "golden/scene/scene.hpp"

namespace retrace {

struct GltfOptions {
  std::optional<std::uint32_t> scene;  ///< index of the glTF scene; default: the file's default scene, else the first
  bool textures = true;                ///< decode images
  /// Skins and morph weights are applied as they are at rest: what a still shows. Otherwise meshes are as stored, which
  /// is what load_animation needs.
  bool posed = false;
  std::uint64_t max_texels = std::uint64_t{1} << 27;  ///< of all images; larger ones are held at half their size
};

/// Loads a file. Throws Error with one line that names the file, the object and what is wrong, if something that the
/// chosen scene shows cannot be used; about everything else that is wrong or not supported there is one line in `notes`.
Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options = {},
                std::vector<std::string>* notes = nullptr);

/// The same from memory (for the fuzzer): no external file is opened.
Scene load_gltf_memory(std::span<const std::uint8_t> bytes, const GltfOptions& options = {},
                       std::vector<std::string>* notes = nullptr);

/// The file and those beside it that its buffers and images name: what must not be written while it is read. Nothing
/// but the file itself where it is no glTF file; empty if it is not there.
std::vector<std::filesystem::path> gltf_files(const std::filesystem::path& path);

}  // namespace retrace
