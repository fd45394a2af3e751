#include "open_scene.hpp"

#include <algorithm>
#include <filesystem>

#include "animated_scenes.hpp"
#include "generators.hpp"
#include "golden/gltf/gltf_loader.hpp"

namespace retrace {

namespace {

bool names(std::span<const SceneGenerator> generators, const std::string& name) {
  return std::any_of(generators.begin(), generators.end(), [&](const SceneGenerator& g) { return g.name == name; });
}

}  // namespace

bool is_generated_scene(const std::string& spec) {
  const std::string name = spec.substr(0, spec.find(':'));
  return names(scene_generators(), name) || names(animated_scene_generators(), name);
}

Scene open_scene(const std::string& spec) {
  std::error_code error;
  if (std::filesystem::is_regular_file(spec, error)) return load_gltf(spec, {.scene = {}, .posed = true});
  if (!is_generated_scene(spec)) throw Error(spec + ": neither a file nor a generated scene");
  const std::size_t colon = spec.find(':');
  const std::string name = spec.substr(0, colon);
  std::vector<std::string> settings;
  for (std::size_t at = colon; at != std::string::npos;) {
    const std::size_t comma = spec.find(',', at + 1);
    settings.push_back(spec.substr(at + 1, comma == std::string::npos ? comma : comma - at - 1));
    at = comma;
  }
  const SceneParameters parameters = parse_scene_parameters(settings);
  if (names(scene_generators(), name)) return make_scene(name, parameters);
  return load_gltf_memory(make_animated_glb(name, parameters), {.scene = {}, .posed = true});
}

}  // namespace retrace
