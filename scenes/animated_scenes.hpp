// Scenes that move, written as binary glTF with animations, skins and morph targets: what golden/gltf/animation.hpp
// reads. All three classes of motion (Wald et al. 2003) and all three interpolations appear. Same parameters, same
// bytes.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scenes/generators.hpp"

namespace retrace {

/// All animated scenes, in the order in which they should be listed.
std::span<const SceneGenerator> animated_scene_generators();

/// The file. Throws Error for an unknown scene, an unknown parameter and a value out of range, as make_scene() does.
std::vector<std::uint8_t> make_animated_glb(const std::string& name, const SceneParameters& parameters = {});

}  // namespace retrace
