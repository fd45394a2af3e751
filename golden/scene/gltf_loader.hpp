// glTF 2.0 (.gltf and .glb) to Scene, on tinygltf and OpenImageIO.
#pragma once
#include <filesystem>
#include <optional>
#include <span>

#include "scene.hpp"

namespace retrace {

struct GltfOptions {
  std::optional<std::uint32_t> scene;  ///< index of the glTF scene; default: the file's default scene, else the first
  bool textures = true;                ///< decode images
};

/// Loads a file. Throws Error with one line that names the file, the object and what is wrong; warnings go to `warnings` if given.
Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options = {},
                std::vector<std::string>* warnings = nullptr);

/// The same from memory (for the fuzzer): no external file is opened.
Scene load_gltf_memory(std::span<const std::uint8_t> bytes, const GltfOptions& options = {});

}  // namespace retrace
