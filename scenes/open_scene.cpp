#include "open_scene.hpp"

#include <filesystem>

#include "generators.hpp"
#include "golden/gltf/gltf_loader.hpp"

namespace retrace {

Scene open_scene(const std::string& spec) {
  std::error_code error;
  if (std::filesystem::is_regular_file(spec, error)) return load_gltf(spec, {.scene = {}, .posed = true});
  const std::size_t colon = spec.find(':');
  const std::string name = spec.substr(0, colon);
  bool known = false;
  for (const SceneGenerator& generator : scene_generators()) known = known || generator.name == name;
  if (!known) throw Error(spec + ": neither a file nor a generated scene");
  std::vector<std::string> settings;
  for (std::size_t at = colon; at != std::string::npos;) {
    const std::size_t comma = spec.find(',', at + 1);
    settings.push_back(spec.substr(at + 1, comma == std::string::npos ? comma : comma - at - 1));
    at = comma;
  }
  return make_scene(name, parse_scene_parameters(settings));
}

}  // namespace retrace
