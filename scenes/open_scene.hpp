// One name for every scene: a glTF file, or a generated scene with parameters, "knot" or "room:detail=0.5,seed=3".
#pragma once
#include <string>

#include "golden/scene/scene.hpp"

namespace retrace {

/// A path to an existing file, or NAME[:key=value[,key=value]...] of scenes/generators.hpp or scenes/animated_scenes.hpp, these at rest. Throws Error.
Scene open_scene(const std::string& spec);
/// Whether a scene of that name is made by code.
bool is_generated_scene(const std::string& spec);

}  // namespace retrace
